"""A contact sheet: small images with true boxes and gazes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from awarenav.drawing import awareness_colour
from awarenav.records import Record
from perception import Camera
from perception.arrays import ImageRgb

from ..world.errors import SimError

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

    Args:
        folder: of the images.
        records: the truth of all images, at least one.
        camera: of the images.

    Raises:
        SimError: when an image cannot be read.
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
    tile: ImageRgb,
    person: Record,
    camera: Camera,
    scale: float,
    colour: tuple[int, int, int],
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
