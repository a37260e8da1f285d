"""What ``awarenav render`` makes: settings that name a set of pictures completely."""

from __future__ import annotations

import math
import re
from typing import Any, ClassVar, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from perception import Camera
from tracking.config import StrictConfig

from ..actors.body import worker_names
from ..world.camera import SensorConfig
from ..world.errors import SimError
from ..world.hall import LAYOUTS

_SIZE = re.compile(r"^(\d+)x(\d+)$")


class RenderConfig(StrictConfig):
    """Randomised pictures of people in warehouses; the same settings give the same bytes.

    Attributes:
        frames: how many pictures.
        scenes: how many halls with a cast of workers the pictures are spread over; None is one
            for every twenty pictures.
        people: the most people in a picture; each has between one and this many.
        width_px: of a picture.
        height_px: of a picture.
        horizontal_fov_deg: of the camera.
        min_range_m: nobody stands nearer to the camera.
        max_range_m: nobody stands farther away.
        supersampling: samples a pixel and side; 2 smooths edges and costs three times as much.
        seed: of everything random.
        sensor: noise and exposure of the camera; the default adds none.
        workers: who appears: names of shipped workers or .npz files; None is all who are shipped.
        layouts: names of the halls; None is all.
        variants: numbers of the first and the last variant of a hall's goods and colours.
        eyes: ``"wander"``: they turn in the head, by 7° sideways and 3.4° up and down (standard
            deviation); ``"ahead"``: the gaze is the head's direction.
    """

    error: ClassVar[type[ValueError]] = SimError

    frames: int = Field(default=400, ge=1, le=10_000_000)
    scenes: int | None = Field(default=None, ge=1)
    people: int = Field(default=3, ge=1, le=12)
    width_px: int = Field(default=640, ge=32, le=4096)
    height_px: int = Field(default=480, ge=32, le=4096)
    horizontal_fov_deg: float = Field(default=60.0, ge=20.0, le=120.0)
    min_range_m: float = Field(default=1.5, ge=0.5)
    max_range_m: float = Field(default=8.0, le=30.0)
    supersampling: int = Field(default=1, ge=1, le=4)
    seed: int = Field(default=0, ge=0)
    sensor: SensorConfig = SensorConfig()
    workers: tuple[str, ...] | None = Field(default=None, min_length=1)
    layouts: tuple[str, ...] | None = Field(default=None, min_length=1)
    variants: tuple[int, int] = (0, 7)
    eyes: Literal["wander", "ahead"] = "wander"

    @model_validator(mode="after")
    def _ranges(self) -> RenderConfig:
        if self.min_range_m >= self.max_range_m:
            raise ValueError(
                "min_range_m must be less than max_range_m, got "
                f"{self.min_range_m:g} m and {self.max_range_m:g} m"
            )
        if not 0 <= self.variants[0] <= self.variants[1]:
            raise ValueError(f"variants must be 0 <= first <= last, got {self.variants}")
        return self

    @field_validator("workers")
    @classmethod
    def _known_workers(cls, names: tuple[str, ...] | None) -> tuple[str, ...] | None:
        unknown = [n for n in names or () if not n.endswith(".npz") and n not in worker_names()]
        if unknown:
            raise ValueError(f"must be .npz files or of {', '.join(worker_names())}")
        return names

    @field_validator("layouts")
    @classmethod
    def _known_layouts(cls, names: tuple[str, ...] | None) -> tuple[str, ...] | None:
        if not set(names or ()) <= set(LAYOUTS):
            raise ValueError(f"must be of {', '.join(LAYOUTS)}")
        return names

    @classmethod
    def checked(cls, **values: Any) -> RenderConfig:
        """Validate settings given one by one; raises SimError that names each wrong one."""
        try:
            return cls(**values)
        except ValidationError as cause:
            wrong = (
                f"{'.'.join(map(str, error['loc'])) or 'settings'}: {error['msg']}, "
                f"got {error['input']!r}"
                for error in cause.errors()
            )
            raise SimError("; ".join(wrong)) from cause

    @property
    def scene_count(self) -> int:
        """How many scenes there are; never more than pictures."""
        wanted = math.ceil(self.frames / 20) if self.scenes is None else self.scenes
        return min(wanted, self.frames)

    def scene_of(self, frame: int) -> int:
        """The scene that a picture shows; neighbouring pictures share theirs."""
        return frame * self.scene_count // self.frames

    @property
    def camera(self) -> Camera:
        """The camera of every picture."""
        return Camera.from_fov(self.width_px, self.height_px, math.radians(self.horizontal_fov_deg))


def picture_size(text: str) -> tuple[int, int]:
    """Read ``640x480``; raises SimError for anything else."""
    match = _SIZE.match(text.strip())
    if match is None:
        raise SimError(f"size must be WIDTHxHEIGHT in pixels such as 640x480, got {text!r}")
    return int(match[1]), int(match[2])
