"""Settings of ``awarenav render``."""

from __future__ import annotations

import math
import re
from typing import Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from awarenav.errors import not_one_of
from perception import Camera
from tracking.config import complaints

from ..actors.body import worker_file
from ..world.camera import SensorConfig
from ..world.config import SimConfig
from ..world.errors import SimError
from ..world.hall import LAYOUTS

_SIZE = re.compile(r"^(\d+)x(\d+)$")


class RenderConfig(SimConfig):
    """Settings of a set of randomised images; the same settings give the same bytes.

    Attributes:
        frames: number of images.
        scenes: number of scenes, each a hall with workers, that the images are spread over; None
            for one per twenty images.
        people: largest number of people in an image; each image has between one and this many.
        width_px: image width.
        height_px: image height.
        horizontal_fov_deg: horizontal field of view of the camera.
        min_range_m: smallest distance of a person from the camera.
        max_range_m: largest distance of a person from the camera.
        supersampling: samples per pixel and side; 2 smooths edges and costs three times as much.
        seed: seed of everything random.
        sensor: noise of the camera; the default adds none.
        workers: names of shipped workers, or .npz files; None for all shipped workers.
        layouts: names of the halls; None for all.
        variants: first and last number of the variants of a hall's goods and colours.
        eyes: ``"wander"``: the eyes turn in the head, by 7° sideways and 3.4° up and down (standard
            deviations); ``"ahead"``: the gaze is the direction of the head.
    """

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
        for name in names or ():
            worker_file(name)
        return names

    @field_validator("layouts")
    @classmethod
    def _known_layouts(cls, names: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for name in names or ():
            if name not in LAYOUTS:
                raise ValueError(not_one_of("layout", name, LAYOUTS))
        return names

    @classmethod
    def checked(cls, **values: Any) -> RenderConfig:
        """Validate settings given as keywords; raises SimError that names each wrong one."""
        try:
            return cls(**values)
        except ValidationError as cause:
            raise SimError(complaints(cause)) from cause

    @property
    def scene_count(self) -> int:
        """Number of scenes; never more than images."""
        wanted = math.ceil(self.frames / 20) if self.scenes is None else self.scenes
        return min(wanted, self.frames)

    def scene_of(self, frame: int) -> int:
        """Return the scene of an image; consecutive images share a scene."""
        return frame * self.scene_count // self.frames

    @property
    def camera(self) -> Camera:
        """Camera of every image."""
        return Camera.from_fov(self.width_px, self.height_px, math.radians(self.horizontal_fov_deg))


def parse_image_size(text: str) -> tuple[int, int]:
    """Return width and height of a text such as ``640x480``; raises SimError for other texts."""
    match = _SIZE.match(text.strip())
    if match is None:
        raise SimError(f"size must be WIDTHxHEIGHT in pixels such as 640x480, got {text!r}")
    return int(match[1]), int(match[2])
