"""Rendering of a set of images with truth, in several processes, resumable."""

from __future__ import annotations

import json
import multiprocessing
import os
import queue
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from awarenav.errors import counted
from awarenav.files import atomic_path
from awarenav.records import (
    Record,
    RecordFile,
    continue_records,
    read_records,
    record_line,
    write_records,
)
from perception import Camera
from perception.documents import parse_json

from ..world.errors import SimError
from ._config import RenderConfig
from ._contact_sheet import write_contact_sheet

_TRUTH: Final = "truth.jsonl"
_SETTINGS: Final = "render.yaml"
_SHEET: Final = "contact_sheet.png"
# All files of a set but its settings.
_MADE: Final = re.compile(r"(\d{6,}\.png|truth\.jsonl|camera\.yaml|contact_sheet\.png)(\.part)?")
# Time without a record after which the processes are checked for being alive.
_POLL_S: Final = 1.0


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

    Images ``000000.png`` … appear whole or not at all. ``truth.jsonl`` grows by one line per image
    and is sorted at the end. ``camera.yaml`` is ROS camera_info, ``render.yaml`` holds the
    settings, and ``contact_sheet.png`` shows a sample with the true boxes.

    Args:
        config: settings of the set.
        out: folder, made when missing.
        processes: number of processes; None for one per processor.
        resume: accept a finished set as well, and require a set to continue.
        overwrite: remove the set in the folder first.
        progress: show a progress bar on standard error.

    Returns:
        Path of the truth file.

    Raises:
        SimError: when ``out`` holds images of other settings, a finished set (with neither
            ``resume`` nor ``overwrite``) or none (with ``resume``), or all processes died.
    """
    if overwrite:
        _remove_set(out)
    _check_folder(config, out, resume=resume)
    truth = out / _TRUTH
    done = {record["frame"]: record for record in _finished_records(config, out)}
    if len(done) == config.frames and (out / _SHEET).exists() and not resume:
        raise SimError(
            f"{out} holds a finished set of {counted(config.frames, 'image')}: replace it with "
            "--overwrite, choose another --out, or keep it with --resume"
        )
    write_records(truth, done.values())
    missing = [frame for frame in range(config.frames) if frame_name(frame) not in done]
    _write(config.camera, out / "camera.yaml")
    tasks = _group_by_scene(config, missing)
    workers = min(processes or os.cpu_count() or 1, max(len(tasks), 1))
    with (
        RecordFile(truth, SimError) as file,
        tqdm(
            total=config.frames,
            initial=len(done),
            desc="render",
            unit="frame",
            file=sys.stderr,
            disable=not progress,
        ) as bar,
    ):
        for record in _render_tasks(config, out, tasks, workers):
            file.add(record)
            bar.update()
    records = sorted(read_records(truth), key=lambda record: str(record["frame"]))
    write_records(truth, records)
    write_contact_sheet(out, records, config.camera, out / _SHEET)
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


def _finished_records(config: RenderConfig, out: Path) -> list[Record]:
    """Return the records whose images exist."""
    truth = out / _TRUTH
    records = continue_records(truth) if truth.exists() else []
    return [record for record in records if (out / str(record["frame"])).is_file()]


def _group_by_scene(config: RenderConfig, frames: Sequence[int]) -> list[list[int]]:
    """Return the frames in groups of one scene each."""
    scenes: dict[int, list[int]] = {}
    for frame in frames:
        scenes.setdefault(config.scene_of(frame), []).append(frame)
    return list(scenes.values())


def _render_tasks(
    config: RenderConfig, out: Path, tasks: list[list[int]], workers: int
) -> Iterator[Record]:
    """Yield records as they are made; one worker runs in this process."""
    if workers <= 1:
        for task in tasks:
            yield from _scene_records(config, out, task)
        return
    context = multiprocessing.get_context("spawn")
    task_queue, record_queue = context.Queue(), context.Queue()
    for task in tasks:
        task_queue.put(task)
    for _ in range(workers):
        task_queue.put(None)
    settings = config.model_dump_json()
    processes = [
        context.Process(
            target=_render_scenes, args=(settings, str(out), task_queue, record_queue), daemon=True
        )
        for _ in range(workers)
    ]
    for process in processes:
        process.start()
    try:
        left = sum(map(len, tasks))
        while left:
            try:
                line = record_queue.get(timeout=_POLL_S)
            except queue.Empty:
                if not any(process.is_alive() for process in processes) and record_queue.empty():
                    raise SimError(
                        f"every rendering process ended with {left} images to go; "
                        "run the command again to continue"
                    ) from None
                continue
            record = parse_json(line, "a rendering process", SimError)
            if "error" in record:
                raise SimError(f"rendering failed: {record['error']}")
            left -= 1
            yield record
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.join()


def _render_scenes(settings: str, out: str, task_queue: Any, record_queue: Any) -> None:
    """Run one process: render scenes until the queue of tasks ends."""
    cv2.setNumThreads(1)
    config = RenderConfig.model_validate_json(settings)
    try:
        while (task := task_queue.get()) is not None:
            for record in _scene_records(config, Path(out), task):
                record_queue.put(record_line(record))
    except KeyboardInterrupt:
        return
    except Exception as error:
        record_queue.put(json.dumps({"error": f"{type(error).__name__}: {error}"}))


def _scene_records(config: RenderConfig, out: Path, frames: list[int]) -> Iterator[Record]:
    """Render and write the images of one scene; yield their records."""
    from ._scene import RenderScene  # noqa: PLC0415 - the parent process needs no simulator

    with RenderScene(config, config.scene_of(frames[0])) as scene:
        for frame in frames:
            image, record = scene.snapshot(frame)
            _write_png(out / frame_name(frame), image)
            yield record


def _write_png(path: Path, image_rgb: NDArray[np.uint8]) -> None:
    """Write a PNG; the file appears whole or not at all."""
    encoded, data = cv2.imencode(".png", image_rgb[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 3])
    if not encoded:
        raise SimError(f"cannot encode {path.name}")
    with atomic_path(path, SimError) as part:
        part.write_bytes(data.tobytes())
