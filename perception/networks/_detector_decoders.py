"""From what detectors put out to boxes of people, one class for each of the known layouts.

Boxes are x1, y1, x2, y2 in pixels of the network's input, overlapping ones still among them.
Candidates are picked by their scores before anything is computed of their boxes: of some thousand
places a few dozen are left, and comparing drops what is not a number.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from ._box_format import BoxFormatVote, centre_to_corners

STRIDES: Final = (8, 16, 32)

Floats = NDArray[np.float32]


class Decoder(Protocol):
    """Finds the people in a detector's outputs for one picture."""

    def decode(
        self, outputs: Sequence[NDArray[Any]], score_threshold: float
    ) -> tuple[Floats, Floats]:
        """Return boxes (N, 4) and scores (N,) of the rows at or above the threshold."""
        ...


def cell_count(height_px: int, width_px: int, strides: tuple[int, ...] = STRIDES) -> int:
    """How many places a head without anchors has, one a cell at each stride."""
    return sum((height_px // stride) * (width_px // stride) for stride in strides)


class YoloV8Decoder:
    """Output (1, 4 + C, N): centre x, y, width, height and one score a class, already decoded."""

    def __init__(self, person_class: int) -> None:
        self._score_row = 4 + person_class

    def decode(
        self, outputs: Sequence[NDArray[Any]], score_threshold: float
    ) -> tuple[Floats, Floats]:
        """See :class:`Decoder`."""
        columns = outputs[0][0]
        scores = columns[self._score_row]
        picked = (scores >= score_threshold).nonzero()[0]
        boxes = _float32(columns[:4, picked]).T
        return centre_to_corners(boxes[:, :2], boxes[:, 2:]), _float32(scores[picked])


class RowsDecoder:
    """Output (1, M, 6): four numbers of a box, score, class; overlaps removed in the network.

    Args:
        person_class: which class counts.
        vote: tells corners from centres.
        input_px: width and height of the network's input.
    """

    def __init__(self, person_class: int, vote: BoxFormatVote, input_px: tuple[int, int]) -> None:
        self._person_class = person_class
        self._vote = vote
        self._input_px = input_px

    def decode(
        self, outputs: Sequence[NDArray[Any]], score_threshold: float
    ) -> tuple[Floats, Floats]:
        """See :class:`Decoder`."""
        rows = _float32(outputs[0][0])
        rows = rows[rows[:, 4] >= score_threshold]
        self._vote.listen(rows[:, :4], rows[:, 4], self._input_px)
        rows = rows[np.rint(rows[:, 5]) == self._person_class]
        return self._vote.corners(rows[:, :4]), rows[:, 4]


class YoloxDecoder:
    """Output (1, N, 5 + C) of YOLOX's raw head: offset, log size, objectness, classes.

    Offsets and sizes are in cells: the centre is (offset + cell) · stride, the size
    exp(log size) · stride. The score is objectness times class.
    """

    def __init__(self, person_class: int, height_px: int, width_px: int) -> None:
        self._class_column = 5 + person_class
        self._cells, self._strides = cells(height_px, width_px)

    def decode(
        self, outputs: Sequence[NDArray[Any]], score_threshold: float
    ) -> tuple[Floats, Floats]:
        """See :class:`Decoder`."""
        rows = outputs[0][0]
        scores = _float32(rows[:, 4]) * _float32(rows[:, self._class_column])
        picked = (scores >= score_threshold).nonzero()[0]
        found, stride = _float32(rows[picked, :4]), self._strides[picked]
        centre = (found[:, :2] + self._cells[picked]) * stride
        size = np.exp(found[:, 2:]) * stride
        return centre_to_corners(centre, size), scores[picked]


class RtmdetDecoder:
    """Outputs ``dets`` (1, N, 5): x1, y1, x2, y2, score, and ``labels`` (1, N)."""

    def __init__(self, person_class: int, dets: int, labels: int) -> None:
        self._person_class = person_class
        self._dets, self._labels = dets, labels

    def decode(
        self, outputs: Sequence[NDArray[Any]], score_threshold: float
    ) -> tuple[Floats, Floats]:
        """See :class:`Decoder`."""
        rows = _float32(outputs[self._dets][0])
        people = outputs[self._labels][0] == self._person_class
        rows = rows[people & (rows[:, 4] >= score_threshold)]
        return rows[:, :4], rows[:, 4]


def cells(height_px: int, width_px: int) -> tuple[Floats, Floats]:
    """Column and row (N, 2) of each cell and its stride (N, 1), row by row, finest stride first."""
    places, strides = [], []
    for stride in STRIDES:
        rows, columns = np.mgrid[: height_px // stride, : width_px // stride]
        places.append(np.stack([columns.ravel(), rows.ravel()], axis=1))
        strides.append(np.full((columns.size, 1), stride))
    return _float32(np.concatenate(places)), _float32(np.concatenate(strides))


def _float32(values: NDArray[Any]) -> Floats:
    return np.asarray(values, dtype=np.float32)
