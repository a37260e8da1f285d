"""Faults of camera, detections, odometry and scanners as data."""

from __future__ import annotations

from functools import reduce
from importlib import resources
from pathlib import Path
from typing import Any, Final

from pydantic import Field

from awarenav.errors import not_one_of
from perception.documents import parse_yaml, yaml_text

from ...world.config import SimConfig
from ...world.errors import SimError
from ._outage import Onset, Outage
from ._scanner_fault import ScannerFault

_JOINT: Final = "+"


class Bursts(SimConfig):
    """Periods in which the detector misses a person, independent for each person.

    Attributes:
        for_s: mean duration, exponentially distributed; 0 for none.
        every_s: mean time between two of them, exponentially distributed.
    """

    for_s: float = Field(default=0.0, ge=0.0, le=600.0)
    every_s: float = Field(default=3.0, gt=0.0, le=3600.0)


class Ghosts(SimConfig):
    """False detections of people.

    A ghost stands where it appeared in the camera's view, 1 m to 8 m away. Half of them have a
    face, with an α uniformly distributed in [0, 1]; the others give no evidence of awareness.

    Attributes:
        rate_hz: new ghosts per second (a Poisson process); 0 for none.
        for_s: mean lifetime, exponentially distributed.
    """

    rate_hz: float = Field(default=0.0, ge=0.0, le=100.0)
    for_s: float = Field(default=0.5, gt=0.0, le=600.0)


class Fault(SimConfig):
    """A fault of camera, detections, odometry or scanners; the default changes nothing at all.

    Sensors and odometry follow the scenario; the fault is added to them. It draws from random
    streams of its own, so that everything else in an episode stays the same, bit for bit.

    Attributes:
        name: name in tables.
        description: one sentence.
        miss_rate: share of the observations that are lost, independently.
        bursts: periods in which a person is missed.
        ghosts: false detections.
        drop_rate: share of the images that never arrive.
        latency_s: delay of every image.
        latency_jitter_s: largest additional delay, uniformly distributed.
        frozen_camera: the last image is delivered again and again. With fresh stamps people seem to
            stand still in the image, and so to move with the robot.
        black_camera: pictures are black from a time on, while their stamps go on; None never. The
            robot takes no such picture for a view.
        pitch_error_deg: the robot assumes that its camera looks this much higher than it does.
        yaw_error_deg: the same to the left.
        odometry_delay_s: age of the newest pose and speed that the robot knows; they have their
            true stamps. Images are placed with the newest known pose.
        lost_odometry: pose and speed stay at the last known ones.
        awareness_bias: added to every observed α; the sum is clipped to [0, 1].
        awareness_std_factor: factor on the standard deviation of every observed α; below 1 is
            over-confident.
        scanner: fault of the laser scanners.
    """

    name: str = Field(default="none", min_length=1, pattern=r"^[A-Za-z0-9_.+-]+$")
    description: str = ""
    miss_rate: float = Field(default=0.0, ge=0.0, le=1.0)
    bursts: Bursts = Bursts()
    ghosts: Ghosts = Ghosts()
    drop_rate: float = Field(default=0.0, ge=0.0, le=1.0)
    latency_s: float = Field(default=0.0, ge=0.0, le=10.0)
    latency_jitter_s: float = Field(default=0.0, ge=0.0, le=10.0)
    frozen_camera: Outage = Outage()
    black_camera: Onset | None = None
    pitch_error_deg: float = Field(default=0.0, ge=-45.0, le=45.0)
    yaw_error_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    odometry_delay_s: float = Field(default=0.0, ge=0.0, le=10.0)
    lost_odometry: Outage = Outage(fresh_stamps=False)
    awareness_bias: float = Field(default=0.0, ge=-1.0, le=1.0)
    awareness_std_factor: float = Field(default=1.0, ge=0.0, le=100.0)
    scanner: ScannerFault = ScannerFault()

    @classmethod
    def shipped(cls, name: str) -> Fault:
        """Load a fault that comes with the package; raises SimError for other names."""
        if name not in (names := shipped_faults()):
            raise SimError(not_one_of("fault", name, names))
        text = (resources.files("sim_tests.crossing.faults") / f"{name}.yaml").read_text("utf-8")
        return cls.model_validate(parse_yaml(text, name, SimError))

    @classmethod
    def of(cls, name: str) -> Fault:
        """Load a shipped fault, one from a ``.yaml`` or ``.yml`` file, or several at once.

        Args:
            name: a name or a file; several are joined by ``+``, as in ``ghosts+scanner_late``.

        Raises:
            SimError: for an unknown name, and for two faults that set the same thing.
        """
        if name.endswith((".yaml", ".yml")) and (Path(name).exists() or _JOINT not in name):
            return cls.from_yaml(name)
        if _JOINT in name:
            return reduce(cls.joined_with, map(cls.of, name.split(_JOINT)))
        return cls.shipped(name)

    def joined_with(self, other: Fault) -> Fault:
        """Return both faults at once.

        Raises:
            SimError: if both set the same thing, because only one of them could count.
        """
        own, others = (
            each.model_dump(exclude_defaults=True, exclude={"name", "description"})
            for each in (self, other)
        )
        name = f"{self.name}{_JOINT}{other.name}"
        description = " ".join(each for each in (self.description, other.description) if each)
        return Fault.model_validate(
            {"name": name, "description": description, **_joined(own, others, name)}
        )

    def to_text(self) -> str:
        """Return the fault as YAML, without default values."""
        data = self.model_dump(mode="json", exclude_defaults=True)
        return yaml_text({"name": self.name, **data})


def shipped_faults() -> tuple[str, ...]:
    """Return the names of the faults that come with the package, sorted."""
    folder = resources.files("sim_tests.crossing.faults")
    names = (entry.name for entry in folder.iterdir() if entry.name.endswith(".yaml"))
    return tuple(sorted(name.removesuffix(".yaml") for name in names))


def _joined(first: dict[str, Any], second: dict[str, Any], name: str) -> dict[str, Any]:
    """Return the settings of both; those of the scanners are joined one by one."""
    both = {**first, **second}
    for key in first.keys() & second.keys():
        if key != "scanner":
            raise SimError(f"the faults of {name!r} must set different things, both set {key!r}")
        scanners = first[key], second[key]
        if scanners[0].get("only") != scanners[1].get("only"):
            raise SimError(f"the faults of {name!r} must have the same 'only'")
        twice = set.intersection(*(set(each) - {"only"} for each in scanners))
        if twice:
            raise SimError(
                f"the faults of {name!r} must set different things, both set "
                f"{', '.join(sorted(twice))!r} of the scanners"
            )
        both[key] = {**scanners[0], **scanners[1]}
    return both
