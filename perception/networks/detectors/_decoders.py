"""Decoders: from the outputs of a detector to boxes of people, one function per known layout.

Boxes are x1, y1, x2, y2 in pixels of the network's input, before the removal of overlaps. Rows are
selected by their scores before their boxes are computed: of some thousand cells a few dozen remain,
and the comparison drops scores that are NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

STRIDES: Final = (8, 16, 32)

Floats = NDArray[np.float32]


#: Finds the people in a detector's outputs for one image: from outputs and score threshold to boxes
#: (N, 4) and scores (N,) of the people with scores ≥ the threshold.
Decoder: TypeAlias = Callable[[Sequence[NDArray[Any]], float], tuple[Floats, Floats]]


def cell_count(height_px: int, width_px: int, strides: tuple[int, ...] = STRIDES) -> int:
    """Return the number of outputs of an anchor-free head: one per cell at each stride."""
    return sum((height_px // stride) * (width_px // stride) for stride in strides)


def decode_yolov8(
    outputs: Sequence[NDArray[Any]], score_threshold: float, *, person_class: int
) -> tuple[Floats, Floats]:
    """YOLOv8: output (1, 4 + C, N) of centre x, y, width, height and one score per class."""
    columns = outputs[0][0]
    scores = columns[4 + person_class]
    selected = (scores >= score_threshold).nonzero()[0]
    boxes = _float32(columns[:4, selected]).T
    return centre_to_corners(boxes[:, :2], boxes[:, 2:]), _float32(scores[selected])


def decode_rows(
    outputs: Sequence[NDArray[Any]], score_threshold: float, *, person_class: int
) -> tuple[Floats, Floats]:
    """Output (1, M, 6) of x1, y1, x2, y2, score and class; the network removes overlaps."""
    rows = _float32(outputs[0][0])
    rows = rows[(rows[:, 4] >= score_threshold) & (np.rint(rows[:, 5]) == person_class)]
    return rows[:, :4], rows[:, 4]


def decode_yolox(
    outputs: Sequence[NDArray[Any]],
    score_threshold: float,
    *,
    person_class: int,
    grid: tuple[Floats, Floats],
) -> tuple[Floats, Floats]:
    """YOLOX's raw head: output (1, N, 5 + C) of offset, log size, objectness and class scores.

    Offsets and sizes are in cells, of which ``grid`` has places and strides (:func:`cells`): the
    centre is (offset + cell) · stride, the size exp(log size) · stride. The score is objectness
    times class score.
    """
    rows = outputs[0][0]
    scores = _float32(rows[:, 4]) * _float32(rows[:, 5 + person_class])
    selected = (scores >= score_threshold).nonzero()[0]
    found, (place, stride) = _float32(rows[selected, :4]), (each[selected] for each in grid)
    centre = (found[:, :2] + place) * stride
    size = np.exp(found[:, 2:]) * stride
    return centre_to_corners(centre, size), scores[selected]


def decode_dets(
    outputs: Sequence[NDArray[Any]],
    score_threshold: float,
    *,
    person_class: int,
    dets: int,
    labels: int,
) -> tuple[Floats, Floats]:
    """RTMDet, or YOLOX with its own NMS: outputs ``dets`` (1, N, 5) and ``labels`` (1, N).

    A row of ``dets`` is x1, y1, x2, y2, score. ``dets`` and ``labels`` are the numbers of the
    outputs.
    """
    rows = _float32(outputs[dets][0])
    people = outputs[labels][0] == person_class
    rows = rows[people & (rows[:, 4] >= score_threshold)]
    return rows[:, :4], rows[:, 4]


def cells(height_px: int, width_px: int) -> tuple[Floats, Floats]:
    """Return column and row (N, 2) and stride (N, 1) of each cell.

    Cells are in row-major order, the finest stride first.
    """
    places, strides = [], []
    for stride in STRIDES:
        rows, columns = np.mgrid[: height_px // stride, : width_px // stride]
        places.append(np.stack([columns.ravel(), rows.ravel()], axis=1))
        strides.append(np.full((columns.size, 1), stride))
    return _float32(np.concatenate(places)), _float32(np.concatenate(strides))


def centre_to_corners(centre: NDArray[Any], size: NDArray[Any]) -> NDArray[Any]:
    """Return the corners x1, y1, x2, y2 (N, 4) of boxes with centres (N, 2) and sizes (N, 2)."""
    return np.concatenate([centre - 0.5 * size, centre + 0.5 * size], axis=1)


def _float32(values: NDArray[Any]) -> Floats:
    return np.asarray(values, dtype=np.float32)
