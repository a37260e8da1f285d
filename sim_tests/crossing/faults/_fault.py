"""Something that stops for a while, again and again.

What is wrong with a robot's senses in a crossing, as data.
"""

from __future__ import annotations

from importlib import resources
from typing import ClassVar

import yaml
from pydantic import Field, model_validator

from awarenav.errors import not_one_of
from tracking.config import StrictConfig

from ...world.errors import SimError


class Outage(StrictConfig):
    """Something that stops for a while, again and again; the default never stops.

    Within an episode the first outage begins at a time drawn evenly from the first ``every_s``, so
    that over many episodes every instant of an encounter is hit.

    Attributes:
        for_s: how long each lasts; 0 for none.
        every_s: from the beginning of one to that of the next, longer than ``for_s``.
        fresh_stamps: what was last known is repeated as if it were new, which nobody downstream can
            tell; False repeats it with the stamp that it had.
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
        """Whether it is down at ``t_s`` when the first outage begins at ``first_s``."""
        return t_s >= first_s and (t_s - first_s) % self.every_s < self.for_s


class Bursts(StrictConfig):
    """Stretches in which the detector does not see a person at all, each person on their own.

    Attributes:
        for_s: mean length, exponentially distributed; 0 for none.
        every_s: mean time between two of them, exponentially distributed.
    """

    error: ClassVar[type[ValueError]] = SimError

    for_s: float = Field(default=0.0, ge=0.0, le=600.0)
    every_s: float = Field(default=3.0, gt=0.0, le=3600.0)


class Ghosts(StrictConfig):
    """People whom the detector sees and who are not there.

    A ghost stands where it appeared in the camera's view, 1 m to 8 m away. Every other one has a
    face, with an α drawn evenly from [0, 1]; the others give no evidence of awareness.

    Attributes:
        rate_hz: new ones a second (a Poisson process); 0 for none.
        for_s: mean life, exponentially distributed.
    """

    error: ClassVar[type[ValueError]] = SimError

    rate_hz: float = Field(default=0.0, ge=0.0, le=100.0)
    for_s: float = Field(default=0.5, gt=0.0, le=600.0)


class Fault(StrictConfig):
    """What is wrong with a robot's senses; the default is nothing, to the last bit.

    Camera and odometry themselves are as good as the scenario says: faults come on top, drawn from
    random streams of their own, so that everything else in an episode stays what it was.

    Attributes:
        name: what tables call it.
        description: one sentence.
        miss_rate: share of the observations that are lost, each on its own.
        bursts: stretches in which a person is not seen.
        ghosts: people who are not there.
        drop_rate: share of the frames that never arrive.
        latency_s: every frame arrives so much later.
        latency_jitter_s: up to so much more, evenly distributed.
        frozen_camera: the last picture is delivered again and again. With fresh stamps people seem
            to stand still in the picture, and so to move with the robot.
        pitch_error_deg: the robot believes its camera to look so much higher than it does.
        yaw_error_deg: so much farther left.
        odometry_delay_s: the newest pose and speed of the robot known to it are so old, and bear
            the stamp of their time. Frames are placed with the newest pose known.
        lost_odometry: pose and speed stay the last ones known.
        awareness_bias: added to every observed α, the sum clipped to [0, 1].
        awareness_std_factor: on the standard deviation given with every observed α; below 1 is
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
        """Load one of the faults that come with the package; raises SimError for others."""
        if name not in (names := shipped_faults()):
            raise SimError(not_one_of("fault", name, names))
        text = (resources.files("sim_tests.crossing.faults") / f"{name}.yaml").read_text("utf-8")
        return cls.model_validate(yaml.safe_load(text))

    @classmethod
    def of(cls, name: str) -> Fault:
        """The shipped fault of that name, or the one in a ``.yaml`` or ``.yml`` file."""
        return cls.from_yaml(name) if name.endswith((".yaml", ".yml")) else cls.shipped(name)

    def to_text(self) -> str:
        """The fault as YAML: what differs from the default."""
        data = self.model_dump(mode="json", exclude_defaults=True)
        return yaml.safe_dump({"name": self.name, **data}, sort_keys=False, allow_unicode=True)


def shipped_faults() -> tuple[str, ...]:
    """Names of the faults that come with the package, sorted."""
    folder = resources.files("sim_tests.crossing.faults")
    names = (entry.name for entry in folder.iterdir() if entry.name.endswith(".yaml"))
    return tuple(sorted(name.removesuffix(".yaml") for name in names))
