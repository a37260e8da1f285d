"""Detection and awareness on labelled photographs.

The folder holds photographs and ``agreed_boxes.json``: for each file its size and the boxes of the
people in it (``people_xyxy_px``). It prints recall and false positives a picture at the pipeline's
default score, and lists everybody to whom the networks give α ≥ 0.5. Whether such a person looks at
the camera is for the reader to judge: the boxes do not say it.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from perception import Camera, PersonObservation

from ._pictures import add_networks, pipeline_of

Image = NDArray[np.uint8]

#: Bounds of the figures.
MIN_RECALL: Final = 0.75
MAX_FALSE_PER_PICTURE: Final = 0.3
AWARE: Final = 0.5
LABELS: Final = "agreed_boxes.json"

_MIN_IOU: Final = 0.5


@dataclass(frozen=True)
class PhotographResult:
    """People found in one photograph.

    Attributes:
        name: of the file.
        truth: (T, 4) boxes of the people.
        observations: what the pipeline reported.
        pairs: (truth, observation) with an IoU of at least 0.5, each used once.
    """

    name: str
    truth: NDArray[np.float64]
    observations: tuple[PersonObservation, ...]
    pairs: tuple[tuple[int, int], ...]


def read_labels(folder: Path) -> dict[str, NDArray[np.float64]]:
    """Return the boxes (N, 4) of the people in every labelled photograph of a folder.

    Raises:
        ValueError: for a folder without labels, and for labels that are not boxes.
    """
    path = folder / LABELS
    if not path.is_file():
        raise ValueError(f"{folder} must hold photographs and {LABELS}, which is missing")
    labels: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    boxes = {}
    for name, label in labels.items():
        array = np.array(label["people_xyxy_px"], dtype=np.float64).reshape(-1, 4)
        if not (np.isfinite(array).all() and (array[:, 2:] > array[:, :2]).all()):
            raise ValueError(f"{path}: boxes of {name} must be x0, y0, x1, y1 in pixels")
        boxes[name] = array
    return boxes


def matched(
    truth: NDArray[np.float64], found: NDArray[np.float64], min_iou: float = _MIN_IOU
) -> tuple[tuple[int, int], ...]:
    """Return pairs (truth, found) of boxes (T, 4) and (F, 4): the most, then the best overlaps."""
    low = np.maximum(truth[:, None, :2], found[None, :, :2])
    high = np.minimum(truth[:, None, 2:], found[None, :, 2:])
    shared = np.prod(np.clip(high - low, 0.0, None), axis=2)
    areas = [np.prod(boxes[:, 2:] - boxes[:, :2], axis=1) for boxes in (truth, found)]
    union = areas[0][:, None] + areas[1][None] - shared
    iou = np.divide(shared, union, out=np.zeros_like(shared), where=union > 0.0)
    good = iou >= min_iou
    rows, columns = linear_sum_assignment(np.where(good, 10.0 + iou, 0.0), maximize=True)
    return tuple(
        (int(row), int(column))
        for row, column in zip(rows, columns, strict=True)
        if good[row, column]
    )


def judge_folder(
    folder: Path, networks: Path | None = None, fov_rad: float = math.radians(60.0)
) -> list[PhotographResult]:
    """Run the pipeline on the labelled photographs of a folder.

    Args:
        folder: photographs and their labels.
        networks: folder of networks with a manifest; None takes the shipped ones.
        fov_rad: horizontal field of view that is assumed of the longer side.
    """
    results = []
    for name, truth in sorted(read_labels(folder).items()):
        rgb = read_rgb(folder / name)
        height, width = rgb.shape[:2]
        # The field of view belongs to the longer side, also of an upright photograph.
        focal = 0.5 * max(height, width) / math.tan(0.5 * fov_rad)
        camera = Camera(width, height, focal, focal, 0.5 * width, 0.5 * height)
        observations = pipeline_of(camera, networks).process(rgb, 0.0)
        boxes = [o.box_xyxy_px for o in observations if o.box_xyxy_px is not None]
        found = np.array(boxes, dtype=np.float64).reshape(-1, 4)
        results.append(PhotographResult(name, truth, observations, matched(truth, found)))
    return results


def read_rgb(path: Path) -> Image:
    """Read a photograph (H, W, 3); ValueError for a file that is none."""
    data = np.frombuffer(path.read_bytes(), np.uint8) if path.is_file() else None
    bgr = None if data is None else cv2.imdecode(data, cv2.IMREAD_COLOR)
    if bgr is None:
        raise ValueError(f"{path} must be a photograph that OpenCV reads")
    return np.ascontiguousarray(np.asarray(bgr, dtype=np.uint8)[..., ::-1])


def figures(results: Sequence[PhotographResult]) -> dict[str, float]:
    """Return ``recall``, ``false_per_picture``, and the numbers of people and of pictures."""
    people = sum(len(each.truth) for each in results)
    found = sum(len(each.pairs) for each in results)
    false = sum(len(each.observations) - len(each.pairs) for each in results)
    return {
        "people": people,
        "pictures": len(results),
        "recall": found / people if people else math.nan,
        "false_per_picture": false / len(results) if results else math.nan,
    }


def aware_lines(results: Sequence[PhotographResult]) -> list[str]:
    """Return a line for everybody with α ≥ 0.5, people and things alike."""
    lines = []
    for each in results:
        people = {column for _, column in each.pairs}
        for row, observation in enumerate(each.observations):
            alpha, box = observation.awareness, observation.box_xyxy_px
            if alpha is None or alpha < AWARE or box is None:
                continue
            who = "a person" if row in people else "no labelled person"
            place = ", ".join(f"{edge:.0f}" for edge in box.tolist())
            lines.append(
                f"{each.name}: α = {alpha:.2f} ± {observation.awareness_std or 0.0:.2f}, "
                f"score {observation.score:.2f}, {who} at {place}"
            )
    return lines


def run(parser: argparse.ArgumentParser, chosen: argparse.Namespace) -> None:
    """Print the figures and the people with α ≥ 0.5."""
    try:
        results = judge_folder(chosen.folder, chosen.networks, math.radians(chosen.fov))
    except ValueError as cause:
        parser.error(str(cause))
    found = figures(results)
    print(
        f"{found['people']} people in {found['pictures']} photographs: recall "
        f"{found['recall']:.2f} (wanted {MIN_RECALL:g}), false positives a picture "
        f"{found['false_per_picture']:.2f} (at most {MAX_FALSE_PER_PICTURE:g})"
    )
    lines = aware_lines(results)
    print(f"α ≥ {AWARE:g}: {len(lines) or 'nobody'}")
    print("\n".join(lines))


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the folder of photographs, and how they were taken."""
    parser.add_argument("folder", type=Path, help=f"photographs and {LABELS}")
    add_networks(parser)
    parser.add_argument(
        "--fov", type=float, default=60.0, metavar="DEG", help="of the longer side (default: 60)"
    )
