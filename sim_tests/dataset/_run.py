"""The command ``awarenav render``: from its options to a set of images."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from awarenav.errors import counted

from ._config import RenderConfig, parse_image_size
from ._render import render


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderOptions:
    """The options of ``awarenav render``."""

    frames: int
    people: int
    scenes: int | None
    size: str
    fov: float
    range_m: tuple[float, float]
    workers: tuple[str, ...]
    layouts: tuple[str, ...]
    eyes: str
    supersampling: int
    processes: int | None
    out: Path
    resume: bool
    overwrite: bool
    seed: int


def render_command(options: RenderOptions) -> int:
    """Run the command and return its exit status.

    Raises:
        SimError: for options that cannot be used.
    """
    width, height = parse_image_size(options.size)
    config = RenderConfig.checked(
        frames=options.frames,
        people=options.people,
        scenes=options.scenes,
        width_px=width,
        height_px=height,
        horizontal_fov_deg=options.fov,
        min_range_m=options.range_m[0],
        max_range_m=options.range_m[1],
        supersampling=options.supersampling,
        seed=options.seed,
        workers=list(options.workers) or None,
        layouts=list(options.layouts) or None,
        eyes=options.eyes,
    )
    truth = render(
        config,
        options.out,
        processes=options.processes,
        resume=options.resume,
        overwrite=options.overwrite,
    )
    print(
        f"Written to {options.out}: {counted(config.frames, 'image')}, camera.yaml, {truth.name}, "
        "contact_sheet.png"
    )
    return 0
