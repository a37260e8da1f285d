"""``awarenav render``: pictures of people in warehouses with the truth about every one of them."""

from __future__ import annotations

import json
import multiprocessing
import os
import queue
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from awarenav.records import Record, read_records, record_line, write_records

from ..world.errors import SimError
from ._config import RenderConfig
from ._contact_sheet import write_contact_sheet

_TRUTH: Final = "truth.jsonl"
_SETTINGS: Final = "render.yaml"
_SHEET: Final = "contact_sheet.png"
# A process that has said nothing for so long is asked whether it still lives.
_POLL_S: Final = 1.0


def render(
    config: RenderConfig, out: Path, *, processes: int | None = None, progress: bool = True
) -> Path:
    """Write the pictures of ``config`` into a folder; continues one that was interrupted.

    ``000000.png`` … are written whole or not at all, ``truth.jsonl`` grows by a line a picture and
    is sorted at the end, ``camera.yaml`` is ROS camera_info, ``render.yaml`` the settings and
    ``contact_sheet.png`` a sample with the true boxes.

    Args:
        config: what to render.
        out: folder, made when missing.
        processes: how many work at once; None is one a processor.
        progress: shows a bar on standard error.

    Returns:
        The truth file.

    Raises:
        SimError: when ``out`` holds the pictures of other settings, or a process died.
    """
    _claim(config, out)
    truth = out / _TRUTH
    done = {record["frame"]: record for record in _finished(out)}
    write_records(truth, done.values())
    missing = [frame for frame in range(config.frames) if frame_name(frame) not in done]
    config.camera.to_yaml(out / "camera.yaml")
    tasks = _by_scene(config, missing)
    workers = min(processes or os.cpu_count() or 1, max(len(tasks), 1))
    with (
        truth.open("a", encoding="utf-8") as file,
        tqdm(
            total=config.frames,
            initial=len(done),
            desc="render",
            unit="frame",
            file=sys.stderr,
            disable=not progress,
        ) as bar,
    ):
        for record in _records(config, out, tasks, workers):
            file.write(record_line(record))
            file.flush()
            bar.update()
    records = sorted(read_records(truth), key=lambda record: str(record["frame"]))
    write_records(truth, records)
    write_contact_sheet(out, records, config.camera, out / _SHEET)
    return truth


def frame_name(frame: int) -> str:
    """File of a picture."""
    return f"{frame:06d}.png"


def _claim(config: RenderConfig, out: Path) -> None:
    """Note the settings, or refuse a folder that holds another set of pictures."""
    if out.exists() and not out.is_dir():
        raise SimError(f"--out must be a folder, {out} is a file")
    out.mkdir(parents=True, exist_ok=True)
    settings = out / _SETTINGS
    if settings.exists():
        present = RenderConfig.from_yaml(settings)
        if present != config:
            differ = [
                f"{name}: {getattr(present, name)!r}, asked for {getattr(config, name)!r}"
                for name in type(config).model_fields
                if getattr(present, name) != getattr(config, name)
            ]
            raise SimError(
                f"{out} holds pictures made with other settings ({'; '.join(differ)}); "
                "use the same settings to continue it, or another folder"
            )
        return
    if (out / _TRUTH).exists():
        raise SimError(
            f"{out} holds a {_TRUTH} without {_SETTINGS}, so it was not made by this command; "
            "use another folder"
        )
    config.to_yaml(settings)


def _finished(out: Path) -> list[Record]:
    """Records whose pictures are there."""
    truth = out / _TRUTH
    records = read_records(truth) if truth.exists() else []
    return [record for record in records if (out / str(record["frame"])).is_file()]


def _by_scene(config: RenderConfig, frames: Sequence[int]) -> list[list[int]]:
    """Pictures that are missing, those of one scene together."""
    scenes: dict[int, list[int]] = {}
    for frame in frames:
        scenes.setdefault(config.scene_of(frame), []).append(frame)
    return list(scenes.values())


def _records(
    config: RenderConfig, out: Path, tasks: list[list[int]], workers: int
) -> Iterator[Record]:
    """Records as they come; in this process when one is enough."""
    if workers <= 1:
        for task in tasks:
            yield from _scene_records(config, out, task)
        return
    context = multiprocessing.get_context("spawn")
    todo, made = context.Queue(), context.Queue()
    for task in tasks:
        todo.put(task)
    for _ in range(workers):
        todo.put(None)
    settings = config.model_dump_json()
    crew = [
        context.Process(target=_work, args=(settings, str(out), todo, made), daemon=True)
        for _ in range(workers)
    ]
    for process in crew:
        process.start()
    try:
        left = sum(map(len, tasks))
        while left:
            try:
                line = made.get(timeout=_POLL_S)
            except queue.Empty:
                if not any(process.is_alive() for process in crew) and made.empty():
                    raise SimError(
                        f"every rendering process ended with {left} pictures to go; "
                        "run the command again to continue"
                    ) from None
                continue
            record = json.loads(line)
            if "error" in record:
                raise SimError(f"rendering failed: {record['error']}")
            left -= 1
            yield record
    finally:
        for process in crew:
            process.terminate()
        for process in crew:
            process.join()


def _work(settings: str, out: str, todo: Any, made: Any) -> None:
    """A process: scene after scene until there is none."""
    cv2.setNumThreads(1)
    config = RenderConfig.model_validate_json(settings)
    try:
        while (task := todo.get()) is not None:
            for record in _scene_records(config, Path(out), task):
                made.put(record_line(record))
    except KeyboardInterrupt:
        return
    except Exception as error:
        made.put(json.dumps({"error": f"{type(error).__name__}: {error}"}))


def _scene_records(config: RenderConfig, out: Path, frames: list[int]) -> Iterator[Record]:
    """Render pictures of one scene and write them."""
    from ._scene import RenderScene  # noqa: PLC0415 - the parent process needs no simulator

    with RenderScene(config, config.scene_of(frames[0])) as scene:
        for frame in frames:
            image, record = scene.snapshot(frame)
            _write_picture(out / frame_name(frame), image)
            yield record


def _write_picture(path: Path, image_rgb: NDArray[np.uint8]) -> None:
    """Write a PNG whole or not at all."""
    good, data = cv2.imencode(".png", image_rgb[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 3])
    if not good:
        raise SimError(f"cannot encode {path.name}")
    part = path.with_name(path.name + ".part")
    part.write_bytes(data.tobytes())
    part.replace(path)
