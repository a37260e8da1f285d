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
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from awarenav.errors import AwarenavError
from awarenav.judge import judge_frames
from awarenav.records import PersonRecord, read_person
from perception import Camera

from ._degradations import estimated
from ._pictures import add_networks, pipeline_of

#: Bounds of the figures.
MIN_RECALL: Final = 0.75
MAX_FALSE_PER_PICTURE: Final = 0.3
AWARE: Final = 0.5
LABELS: Final = "agreed_boxes.json"

#: The people of every photograph, by the name of its file.
People = dict[str, list[PersonRecord]]


def read_labels(folder: Path) -> People:
    """Return the people in every labelled photograph of a folder, of whom the boxes are known.

    Raises:
        AwarenavError: for a folder without labels, and for labels that are not boxes.
    """
    path = folder / LABELS
    if not path.is_file():
        raise AwarenavError(f"{folder} must hold photographs and {LABELS}, which is missing")
    labels: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return {
        name: [read_person({"box_xyxy_px": box}, name) for box in label["people_xyxy_px"]]
        for name, label in sorted(labels.items())
    }


def find_people(
    folder: Path,
    names: list[str],
    networks: Path | None = None,
    fov_rad: float = math.radians(60.0),
) -> People:
    """Run the pipeline on the photographs of a folder.

    Args:
        folder: the photographs.
        names: of their files.
        networks: folder of networks with a manifest; None takes the shipped ones.
        fov_rad: horizontal field of view that is assumed of the longer side.
    """
    found = {}
    for name in names:
        rgb = read_rgb(folder / name)
        height, width = rgb.shape[:2]
        # The field of view belongs to the longer side, also of an upright photograph.
        focal = 0.5 * max(height, width) / math.tan(0.5 * fov_rad)
        camera = Camera(width, height, focal, focal, 0.5 * width, 0.5 * height)
        found[name] = [estimated(each) for each in pipeline_of(camera, networks).process(rgb, 0.0)]
    return found


def read_rgb(path: Path) -> NDArray[np.uint8]:
    """Read a photograph (H, W, 3); AwarenavError for a file that is none."""
    data = np.frombuffer(path.read_bytes(), np.uint8) if path.is_file() else None
    bgr = None if data is None else cv2.imdecode(data, cv2.IMREAD_COLOR)
    if bgr is None:
        raise AwarenavError(f"{path} must be a photograph that OpenCV reads")
    return np.ascontiguousarray(np.asarray(bgr, dtype=np.uint8)[..., ::-1])


def figures(truth: People, found: People) -> str:
    """Return recall and false positives of all people, however small, in a line."""
    metrics = judge_frames(truth, found, min_height_px=0.0)
    overall, false = metrics["overall"], metrics["detection"]["false_positives_per_frame"]
    recall = "–" if overall["recall"] is None else f"{overall['recall']:.2f}"
    return (
        f"{overall['people']} people in {len(truth)} photographs: "
        f"recall {recall} (wanted {MIN_RECALL:g}), "
        f"false positives a picture {false:.2f} (at most {MAX_FALSE_PER_PICTURE:g})"
    )


def aware_lines(found: People) -> list[str]:
    """Return a line for everybody with α ≥ 0.5, people and things alike."""
    return [
        f"{name}: α = {each.awareness:.2f} ± {each.awareness_std or 0.0:.2f}, score "
        f"{each.score:.2f}, at {', '.join(f'{edge:.0f}' for edge in each.box_xyxy_px.tolist())}"
        for name, people in found.items()
        for each in people
        if each.awareness is not None and each.awareness >= AWARE and each.box_xyxy_px is not None
    ]


def run(parser: argparse.ArgumentParser, chosen: argparse.Namespace) -> None:
    """Print the figures and the people with α ≥ 0.5."""
    try:
        truth = read_labels(chosen.folder)
        found = find_people(chosen.folder, list(truth), chosen.networks, math.radians(chosen.fov))
    except AwarenavError as cause:
        parser.error(str(cause))
    print(figures(truth, found))
    lines = aware_lines(found)
    print(f"α ≥ {AWARE:g}: {len(lines) or 'nobody'}")
    print("\n".join(lines))


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the folder of photographs, and how they were taken."""
    parser.add_argument("folder", type=Path, help=f"photographs and {LABELS}")
    add_networks(parser)
    parser.add_argument(
        "--fov", type=float, default=60.0, metavar="DEG", help="of the longer side (default: 60)"
    )
