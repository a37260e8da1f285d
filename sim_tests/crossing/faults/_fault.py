"""Faults of camera, detections and odometry as data."""

from __future__ import annotations

from importlib import resources
from typing import ClassVar

import yaml
from pydantic import Field, model_validator

from awarenav.errors import not_one_of
from perception.documents import parse_yaml
from tracking.config import StrictConfig

from ...world.errors import SimError


class Outage(StrictConfig):
    """A repeated outage; the default has none.

    In each episode the first outage begins at a random time within the first ``every_s``, uniformly
    distributed, so that over many episodes every instant of an encounter is hit.

    Attributes:
        for_s: duration of each outage; 0 for none.
        every_s: time from the beginning of one to that of the next, longer than ``for_s``.
        fresh_stamps: the last message is repeated as if it were new, which no receiver can tell;
            False repeats it with its old stamp.
    """

    error: ClassVar[type[ValueError]] = SimError

    for_s: float = Field(default=0.0, ge=0.0, le=600.0)
    every_s: float = Field(default=10.0, gt=0.0, le=3600.0)
    fresh_stamps: bool = True

    @model_validator(mode="after")
    def _ends_before_the_next(self) -> Outage:
        if self.for_s >= self.every_s:
            raise ValueError(
                f"for_s must be shorter than every_s, got {self.for_s:g} s of {self.every_s:g} s"
            )
        return self

    def holds(self, t_s: float, first_s: float) -> bool:
        """Return whether there is an outage at ``t_s`` if the first one begins at ``first_s``."""
        return t_s >= first_s and (t_s - first_s) % self.every_s < self.for_s


class Bursts(StrictConfig):
    """Periods in which the detector misses a person, independent for each person.

    Attributes:
        for_s: mean duration, exponentially distributed; 0 for none.
        every_s: mean time between two of them, exponentially distributed.
    """

    error: ClassVar[type[ValueError]] = SimError

    for_s: float = Field(default=0.0, ge=0.0, le=600.0)
    every_s: float = Field(default=3.0, gt=0.0, le=3600.0)


class Ghosts(StrictConfig):
    """False detections of people.

    A ghost stands where it appeared in the camera's view, 1 m to 8 m away. Half of them have a
    face, with an α uniformly distributed in [0, 1]; the others give no evidence of awareness.

    Attributes:
        rate_hz: new ghosts per second (a Poisson process); 0 for none.
        for_s: mean lifetime, exponentially distributed.
    """

    error: ClassVar[type[ValueError]] = SimError

    rate_hz: float = Field(default=0.0, ge=0.0, le=100.0)
    for_s: float = Field(default=0.5, gt=0.0, le=600.0)


class Fault(StrictConfig):
    """A fault of camera, detections or odometry; the default changes nothing, bit for bit.

    Camera and odometry follow the scenario; the fault is added to them. It draws from random
    streams of its own, so that everything else in an episode stays the same.

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
        pitch_error_deg: the robot assumes that its camera looks this much higher than it does.
        yaw_error_deg: the same to the left.
        odometry_delay_s: age of the newest pose and speed that the robot knows; they have their
            true stamps. Images are placed with the newest known pose.
        lost_odometry: pose and speed stay at the last known ones.
        awareness_bias: added to every observed α; the sum is clipped to [0, 1].
        awareness_std_factor: factor on the standard deviation of every observed α; below 1 is
            over-confident.
    """

    error: ClassVar[type[ValueError]] = SimError

    name: str = Field(default="none", min_length=1, pattern=r"^[A-Za-z0-9_.+-]+$")
    description: str = ""
    miss_rate: float = Field(default=0.0, ge=0.0, le=1.0)
    bursts: Bursts = Bursts()
    ghosts: Ghosts = Ghosts()
    drop_rate: float = Field(default=0.0, ge=0.0, le=1.0)
    latency_s: float = Field(default=0.0, ge=0.0, le=10.0)
    latency_jitter_s: float = Field(default=0.0, ge=0.0, le=10.0)
    frozen_camera: Outage = Outage()
    pitch_error_deg: float = Field(default=0.0, ge=-45.0, le=45.0)
    yaw_error_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    odometry_delay_s: float = Field(default=0.0, ge=0.0, le=10.0)
    lost_odometry: Outage = Outage(fresh_stamps=False)
    awareness_bias: float = Field(default=0.0, ge=-1.0, le=1.0)
    awareness_std_factor: float = Field(default=1.0, ge=0.0, le=100.0)

    @classmethod
    def shipped(cls, name: str) -> Fault:
        """Load a fault that comes with the package; raises SimError for other names."""
        if name not in (names := shipped_faults()):
            raise SimError(not_one_of("fault", name, names))
        text = (resources.files("sim_tests.crossing.faults") / f"{name}.yaml").read_text("utf-8")
        return cls.model_validate(parse_yaml(text, name, SimError))

    @classmethod
    def of(cls, name: str) -> Fault:
        """Load a shipped fault, or one from a ``.yaml`` or ``.yml`` file."""
        return cls.from_yaml(name) if name.endswith((".yaml", ".yml")) else cls.shipped(name)

    def to_text(self) -> str:
        """Return the fault as YAML, without default values."""
        data = self.model_dump(mode="json", exclude_defaults=True)
        return yaml.safe_dump({"name": self.name, **data}, sort_keys=False, allow_unicode=True)


def shipped_faults() -> tuple[str, ...]:
    """Return the names of the faults that come with the package, sorted."""
    folder = resources.files("sim_tests.crossing.faults")
    names = (entry.name for entry in folder.iterdir() if entry.name.endswith(".yaml"))
    return tuple(sorted(name.removesuffix(".yaml") for name in names))
