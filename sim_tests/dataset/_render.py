"""Rendering of a set of images with truth, in several processes, resumable, and a contact sheet."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from joblib import Parallel, delayed
from joblib.externals.loky.process_executor import TerminatedWorkerError
from numpy.typing import NDArray
from tqdm import tqdm

from awarenav.drawing import awareness_colour
from awarenav.errors import counted
from awarenav.files import atomic_path
from awarenav.records import Record, read_records, write_records
from perception import Camera
from perception.arrays import ImageRgb

from ..world.bullet import require_pybullet
from ..world.errors import SimError
from ._config import RenderConfig

_COLUMNS: Final = 6
_ROWS: Final = 4
_WIDTH_PX: Final = 320
_GAP_PX: Final = 4
# Length of a drawn gaze.
_GAZE_M: Final = 0.45
# A gaze that ends closer to the image plane than this is not drawn.
_NEAR_M: Final = 0.2


def contact_sheet(folder: Path, records: Sequence[Record], camera: Camera) -> ImageRgb:
    """Return up to 24 evenly spaced images of a folder as one, with true boxes and gazes.

    Boxes and gaze lines have the colour of the awareness score, from red to green.
    """
    count = min(_COLUMNS * _ROWS, len(records))
    chosen = (records[k * len(records) // count] for k in range(count))
    tiles = [_framed(_tile(folder, each, camera), top=_GAP_PX, left=_GAP_PX) for each in chosen]
    columns = min(_COLUMNS, count)
    tiles += [np.full_like(tiles[0], 255)] * (-count % columns)
    rows = [cv2.hconcat(tiles[at : at + columns]) for at in range(0, len(tiles), columns)]
    return _framed(cv2.vconcat(rows), bottom=_GAP_PX, right=_GAP_PX)


def _framed(
    image: Any, *, top: int = 0, bottom: int = 0, left: int = 0, right: int = 0
) -> ImageRgb:
    """Return an image with white borders, pixels."""
    framed = cv2.copyMakeBorder(
        image, top, bottom, left, right, cv2.BORDER_CONSTANT, value=(255, 255, 255)
    )
    return np.asarray(framed, dtype=np.uint8)


def _tile(folder: Path, record: Record, camera: Camera) -> ImageRgb:
    image = cv2.imread(str(folder / str(record["frame"])), cv2.IMREAD_COLOR)
    if image is None:
        raise SimError(f"cannot read {folder / str(record['frame'])}")
    scale = _WIDTH_PX / image.shape[1]
    size = _WIDTH_PX, round(image.shape[0] * scale)
    tile = np.ascontiguousarray(
        cv2.resize(image, size, interpolation=cv2.INTER_AREA)[..., ::-1], dtype=np.uint8
    )
    for person in record["people"]:
        colour = awareness_colour(person["awareness"])
        box = np.round(np.array(person["box_xyxy_px"]) * scale).astype(int).tolist()
        cv2.rectangle(tile, (box[0], box[1]), (box[2] - 1, box[3] - 1), colour, 1, cv2.LINE_AA)
        _draw_gaze(tile, person, camera, scale, colour)
    return tile


def _draw_gaze(
    tile: ImageRgb, person: Record, camera: Camera, scale: float, colour: tuple[int, int, int]
) -> None:
    """Draw a line from the nose along the gaze, in perspective."""
    if not person["keypoints"].get("nose", (0.0, 0.0, 0.0))[2]:
        return
    nose = np.array(person["keypoints_camera_m"]["nose"])
    tip = nose + _GAZE_M * np.array(person["gaze_camera"])
    if tip[2] < _NEAR_M:
        return
    start, end = np.round(camera.project(np.stack([nose, tip])) * scale).astype(int).tolist()
    cv2.line(tile, tuple(start), tuple(end), colour, 2, cv2.LINE_AA)


_TRUTH: Final = "truth.jsonl"
_SETTINGS: Final = "render.yaml"
_SHEET: Final = "contact_sheet.png"
# All files of a set but its settings.
_MADE: Final = re.compile(
    r"(\d{6,}\.(png|json)|truth\.jsonl|camera\.yaml|contact_sheet\.png)(\.part)?"
)


def render(
    config: RenderConfig,
    out: Path,
    *,
    processes: int | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = True,
) -> Path:
    """Write the images of ``config`` into a folder; continue an interrupted set.

    Images ``000000.png`` … and their truth, ``000000.json`` …, appear whole or not at all; an
    interrupted set is continued with those that are missing. At the end the truth of all images
    moves into ``truth.jsonl``. ``camera.yaml`` is ROS camera_info, ``render.yaml`` holds the
    settings, and ``contact_sheet.png`` shows a sample with the true boxes.

    Raises:
        SimError: when ``out`` holds images of other settings, a finished set (with neither
            ``resume`` nor ``overwrite``) or none (with ``resume``), or a process died.
    """
    require_pybullet()
    if overwrite:
        _remove_set(out)
    _check_folder(config, out, resume=resume)
    truth = out / _TRUTH
    done = _finished_records(config, out)
    if len(done) == config.frames and (out / _SHEET).exists() and not resume:
        raise SimError(
            f"{out} holds a finished set of {counted(config.frames, 'image')}: replace it with "
            "--overwrite, choose another --out, or keep it with --resume"
        )
    _write(config.camera, out / "camera.yaml")
    tasks = _group_by_scene(config, [f for f in range(config.frames) if frame_name(f) not in done])
    workers = min(processes or os.cpu_count() or 1, max(len(tasks), 1))
    with tqdm(
        total=config.frames,
        initial=len(done),
        desc="render",
        unit="frame",
        file=sys.stderr,
        disable=not progress,
    ) as bar:
        scenes = Parallel(n_jobs=workers, return_as="generator_unordered")(
            delayed(_render_scene)(config, out, task) for task in tasks
        )
        try:
            for records in scenes:
                done.update((record["frame"], record) for record in records)
                bar.update(len(records))
        except TerminatedWorkerError as cause:
            left = config.frames - len(done)
            raise SimError(
                f"a rendering process ended with {left} images to go; run the command again to "
                "continue"
            ) from cause
    records = [done[frame_name(frame)] for frame in range(config.frames)]
    write_records(truth, records)
    for part in out.glob("*.json"):
        if _MADE.fullmatch(part.name):
            part.unlink()
    _write_png(out / _SHEET, contact_sheet(out, records, config.camera))
    return truth


def frame_name(frame: int) -> str:
    """Return the file name of an image."""
    return f"{frame:06d}.png"


def _remove_set(out: Path) -> None:
    """Remove a set of images; its settings go last, so that a kill leaves one that can go on."""
    settings = out / _SETTINGS
    if not settings.exists():
        return
    try:
        for path in out.iterdir():
            if _MADE.fullmatch(path.name):
                path.unlink()
        settings.unlink()
    except OSError as cause:
        raise SimError(f"cannot replace the images in {out}: {cause.strerror or cause}") from cause


def _check_folder(config: RenderConfig, out: Path, *, resume: bool) -> None:
    """Write the settings into a new folder; refuse a folder that holds another set of images."""
    if out.exists() and not out.is_dir():
        raise SimError(f"--out must be a folder, {out} is a file")
    settings = out / _SETTINGS
    if resume and not settings.exists():
        raise SimError(f"--resume: there are no images in {out}, no {_SETTINGS}")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as cause:
        raise SimError(f"cannot write {out}: {cause.strerror or cause}") from cause
    if settings.exists():
        present = RenderConfig.from_yaml(settings)
        if present != config:
            differ = [
                f"{name}: {getattr(present, name)!r}, asked for {getattr(config, name)!r}"
                for name in type(config).model_fields
                if getattr(present, name) != getattr(config, name)
            ]
            raise SimError(
                f"{out} holds images made with other settings ({'; '.join(differ)}); "
                "use the same settings to continue it, --overwrite to replace it, or another folder"
            )
        return
    if (out / _TRUTH).exists():
        raise SimError(
            f"{out} holds a {_TRUTH} without {_SETTINGS}, so it was not made by this command; "
            "use another folder"
        )
    _write(config, settings)


def _write(content: Camera | RenderConfig, path: Path) -> None:
    try:
        content.to_yaml(path)
    except OSError as cause:
        raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause


def _finished_records(config: RenderConfig, out: Path) -> dict[str, Record]:
    """Return the truth of the images that exist, by their names."""
    names = {frame_name(frame) for frame in range(config.frames)}
    files = [path for path in out.glob("*.json") if f"{path.stem}.png" in names]
    found = [record for path in sorted(files) for record in read_records(path)]
    if (out / _TRUTH).exists():
        found += read_records(out / _TRUTH)
    return {
        record["frame"]: record
        for record in found
        if record["frame"] in names and (out / record["frame"]).is_file()
    }


def _group_by_scene(config: RenderConfig, frames: Sequence[int]) -> list[list[int]]:
    scenes: dict[int, list[int]] = {}
    for frame in frames:
        scenes.setdefault(config.scene_of(frame), []).append(frame)
    return list(scenes.values())


def _render_scene(config: RenderConfig, out: Path, frames: list[int]) -> list[Record]:
    """Render and write the images of one scene; return their records."""
    from ._scene import RenderScene  # noqa: PLC0415 - the parent process needs no simulator

    cv2.setNumThreads(1)
    records = []
    with RenderScene(config, config.scene_of(frames[0])) as scene:
        for frame in frames:
            image, record = scene.snapshot(frame)
            _write_png(out / frame_name(frame), image)
            write_records(out / f"{frame:06d}.json", [record])
            records.append(record)
    return records


def _write_png(path: Path, image_rgb: NDArray[np.uint8]) -> None:
    encoded, data = cv2.imencode(".png", image_rgb[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 3])
    if not encoded:
        raise SimError(f"cannot encode {path.name}")
    with atomic_path(path, SimError) as part:
        part.write_bytes(data.tobytes())
