"""A contact sheet: small images with true boxes and gazes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from awarenav.drawing import awareness_colour
from awarenav.records import Record
from perception import Camera

from ..world.errors import SimError

_COLUMNS: Final = 6
_ROWS: Final = 4
_WIDTH_PX: Final = 320
_GAP_PX: Final = 4
# Length of a drawn gaze.
_GAZE_M: Final = 0.45
# A gaze that ends closer to the image plane than this is not drawn.
_NEAR_M: Final = 0.2


def write_contact_sheet(
    folder: Path, records: Sequence[Record], camera: Camera, path: Path
) -> None:
    """Write up to 24 evenly spaced images of ``folder`` with true boxes and gazes.

    Boxes and gaze lines have the colour of the awareness score, from red to green.

    Raises:
        SimError: when an image cannot be read.
    """
    count = min(_COLUMNS * _ROWS, len(records))
    chosen = [records[k * len(records) // count] for k in range(count)]
    tiles = [_tile(folder, record, camera) for record in chosen]
    if not tiles:
        return
    height = tiles[0].shape[0]
    rows = -(-count // _COLUMNS)
    columns = min(_COLUMNS, count)
    sheet = np.full(
        (rows * (height + _GAP_PX) + _GAP_PX, columns * (_WIDTH_PX + _GAP_PX) + _GAP_PX, 3),
        255,
        np.uint8,
    )
    for number, tile in enumerate(tiles):
        row, column = divmod(number, _COLUMNS)
        top, left = _GAP_PX + row * (height + _GAP_PX), _GAP_PX + column * (_WIDTH_PX + _GAP_PX)
        sheet[top : top + height, left : left + _WIDTH_PX] = tile
    encoded, data = cv2.imencode(".png", sheet[..., ::-1])
    if not encoded:
        raise SimError(f"cannot encode {path.name}")
    path.write_bytes(data.tobytes())


def _tile(folder: Path, record: Record, camera: Camera) -> NDArray[np.uint8]:
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
    tile: NDArray[np.uint8],
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
