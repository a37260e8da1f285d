"""One person in one frame: the type that perception hands over to tracking."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, fields
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from .arrays import (
    FloatArray,
    covariance_matrices,
    covariance_matrix,
    finite_array,
    finite_number,
    set_fields,
    unit_vector,
    unit_vectors,
)
from .errors import PerceptionError
from .evidence import AWARENESS_REASONS, AwarenessReason


@dataclass(frozen=True, slots=True, eq=False)
class PersonObservation:
    """One person in one frame.

    Attributes:
        stamp_s: time of the frame.
        position_camera_m: (3,) centre line of the body at chest height, in the camera frame.
        position_covariance_m2: (3, 3) covariance of the position.
        gaze_camera: (3,) unit vector of the gaze in the camera frame: the head's forward axis, or
            with ``eyes_seen`` that of the eyes. None without evidence, and where no face is seen
            and the head's direction is unknown.
        awareness: α in [0, 1], eqs. (1)–(3) of the paper, or None without evidence.
        awareness_std: standard deviation of α, ≥ 0; None if and only if ``awareness`` is None.
        score: confidence of the detection in [0, 1].
        box_xyxy_px: (4,) left, top, right, bottom in the image, or None without an image.
        legs_camera_m: (3,) middle of the ankles, or of the knees if the feet are not in the image,
            at the range of ``position_camera_m``; None if no leg was seen.
        awareness_reason: why ``awareness`` is None, one of :data:`AWARENESS_REASONS`; None if it is
            not, or if the reason is unknown.
        range_lasting_relative_std: the part of the range's relative standard deviation that is the
            same in every frame of this person, because their size is not known; in
            ``position_covariance_m2`` it is σ² p pᵀ. 0 for a measured range.
        size_range_m: range at which an adult who stands would have the size of this person in the
            image, before other cues; None if no size was assumed.
        size_range_relative_std: its relative standard deviation, that of the person's size left
            out; None if and only if ``size_range_m`` is None.
        eyes_seen: True if gaze and awareness contain a measurement of the eyes in the head. False:
            the eyes may look elsewhere than the head, and ``awareness_std`` says how far.
    """

    stamp_s: float
    position_camera_m: FloatArray
    position_covariance_m2: FloatArray
    gaze_camera: FloatArray | None
    awareness: float | None
    awareness_std: float | None
    score: float
    box_xyxy_px: FloatArray | None = None
    legs_camera_m: FloatArray | None = None
    awareness_reason: AwarenessReason | None = None
    range_lasting_relative_std: float = 0.0
    size_range_m: float | None = None
    size_range_relative_std: float | None = None
    eyes_seen: bool = False

    def __post_init__(self) -> None:
        if (self.awareness is None) != (self.awareness_std is None):
            raise PerceptionError(
                "awareness and awareness_std must both be given or both be None, got "
                f"awareness={self.awareness}, awareness_std={self.awareness_std}"
            )
        if self.awareness_reason is not None and (
            self.awareness is not None or self.awareness_reason not in AWARENESS_REASONS
        ):
            raise PerceptionError(
                f"awareness_reason must be one of {', '.join(map(repr, AWARENESS_REASONS))}, and "
                f"None with an awareness, got {self.awareness_reason!r} with "
                f"awareness={self.awareness}"
            )
        if (self.size_range_m is None) != (self.size_range_relative_std is None):
            raise PerceptionError(
                "size_range_m and size_range_relative_std must both be given or both be None, got "
                f"{self.size_range_m} and {self.size_range_relative_std}"
            )
        gaze, alpha, std, box = (
            self.gaze_camera,
            self.awareness,
            self.awareness_std,
            self.box_xyxy_px,
        )
        set_fields(
            self,
            stamp_s=finite_number("stamp_s", self.stamp_s),
            position_camera_m=finite_array("position_camera_m", self.position_camera_m, (3,)),
            position_covariance_m2=covariance_matrix(
                "position_covariance_m2", self.position_covariance_m2, 3
            ),
            gaze_camera=None if gaze is None else unit_vector("gaze_camera", gaze),
            awareness=None
            if alpha is None
            else finite_number("awareness", alpha, minimum=0.0, maximum=1.0),
            awareness_std=None if std is None else finite_number("awareness_std", std, minimum=0.0),
            score=finite_number("score", self.score, minimum=0.0, maximum=1.0),
            box_xyxy_px=None if box is None else finite_array("box_xyxy_px", box, (4,)),
            legs_camera_m=None
            if self.legs_camera_m is None
            else finite_array("legs_camera_m", self.legs_camera_m, (3,)),
            range_lasting_relative_std=finite_number(
                "range_lasting_relative_std", self.range_lasting_relative_std, minimum=0.0
            ),
            size_range_m=None
            if self.size_range_m is None
            else finite_number(
                "size_range_m", self.size_range_m, minimum=0.0, exclusive_minimum=True
            ),
            size_range_relative_std=None
            if self.size_range_relative_std is None
            else finite_number(
                "size_range_relative_std", self.size_range_relative_std, minimum=0.0
            ),
            eyes_seen=bool(self.eyes_seen),
        )

    @staticmethod
    def batch(
        stamp_s: float,
        positions_camera_m: Any,
        position_covariances_m2: Any,
        scores: Any,
        *,
        gazes_camera: Any = None,
        awareness: Any = None,
        awareness_std: Any = None,
        boxes_xyxy_px: Any = None,
    ) -> tuple[PersonObservation, ...]:
        """Return the N people of one frame, checked as one by one, in a seventh of the time.

        A row of NaN in ``gazes_camera`` or ``boxes_xyxy_px``, and a NaN in ``awareness`` and
        ``awareness_std``, stand for None. The arrays are copied; those of the observations are
        read-only views into the copies.

        Args:
            stamp_s: time of the frame.
            positions_camera_m: (N, 3).
            position_covariances_m2: (N, 3, 3).
            scores: (N,) in [0, 1].
            gazes_camera: (N, 3) unit vectors, or None without any gaze.
            awareness: (N,) in [0, 1], or None without any.
            awareness_std: (N,) ≥ 0; None if and only if ``awareness`` is None.
            boxes_xyxy_px: (N, 4), or None for no boxes.

        Raises:
            PerceptionError: as the constructor's, naming the row, and for arrays of other lengths.
        """
        stamp = finite_number("stamp_s", stamp_s)
        positions = finite_array("positions_camera_m", positions_camera_m, ("N", 3))
        count = len(positions)
        covariances = covariance_matrices("position_covariances_m2", position_covariances_m2, 3)
        _check_length("position_covariances_m2", len(covariances), count)
        score = finite_array("scores", scores, (count,))
        _check_range("scores", score, 1.0)
        if (awareness is None) != (awareness_std is None):
            raise PerceptionError(
                "awareness and awareness_std must both be given or both be None, got "
                f"awareness={awareness!r:.60}, awareness_std={awareness_std!r:.60}"
            )
        alphas: list[float | None] = [None] * count
        stds: list[float | None] = [None] * count
        if awareness is not None:
            alpha, known = _optional_rows("awareness", awareness, (count,))
            std, std_known = _optional_rows("awareness_std", awareness_std, (count,))
            if not np.array_equal(known, std_known):
                row = int(np.argmax(known != std_known))
                raise PerceptionError(
                    "awareness and awareness_std must both be given or both be NaN, got "
                    f"awareness[{row}]={alpha[row]:g}, awareness_std[{row}]={std[row]:g}"
                )
            _check_range("awareness", alpha, 1.0)
            _check_range("awareness_std", std, np.inf)
            alphas, stds = _list(alpha, known), _list(std, known)
        gazes: list[Any] = [None] * count
        if gazes_camera is not None:
            gaze, known = _optional_rows("gazes_camera", gazes_camera, (count, 3))
            gazes = _list(unit_vectors("gazes_camera", gaze, known), known)
        boxes: list[Any] = [None] * count
        if boxes_xyxy_px is not None:
            boxes = _list(*_optional_rows("boxes_xyxy_px", boxes_xyxy_px, (count, 4)))
        made = tuple(map(object.__new__, [PersonObservation] * count))
        columns = ([stamp] * count, positions, covariances, gazes, alphas, stds, score.tolist())
        rest = ([field.default] * count for field in fields(PersonObservation)[8:])
        for assign, column in zip(_SETTERS, (*columns, boxes, *rest), strict=True):
            deque(map(assign, made, column), maxlen=0)
        return made


_SETTERS: Final = tuple(
    cast(Any, getattr(PersonObservation, field.name)).__set__ for field in fields(PersonObservation)
)


def _check_length(name: str, given: int, count: int) -> None:
    if given != count:
        raise PerceptionError(
            f"{name} must have one entry for each of the {count} positions, got {given}"
        )


def _check_range(name: str, values: FloatArray, maximum: float) -> None:
    """Refuse values outside [0, maximum]; NaN passes."""
    outside = (values < 0.0) | (values > maximum)
    if outside.any():
        row = int(np.argmax(outside))
        high = ")" if np.isinf(maximum) else "]"
        raise PerceptionError(
            f"{name}[{row}] must lie in [0, {maximum:g}{high}, got {values[row]:g}"
        )


def _optional_rows(
    name: str, value: Any, shape: tuple[int, ...]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return a read-only copy of ``value`` and (N,) True for its rows that are not NaN."""
    try:
        array = np.array(value, dtype=np.float64, copy=True)
    except (TypeError, ValueError) as cause:
        raise PerceptionError(
            f"{name} must be an array of numbers of shape {shape}, got {type(value).__name__}: "
            f"{value!r:.80}"
        ) from cause
    if array.shape != shape:
        raise PerceptionError(f"{name} must have shape {shape}, got {array.shape}")
    array.setflags(write=False)
    if np.isfinite(array).all():
        return array, np.ones(shape[0], dtype=np.bool_)
    known = np.asarray(~np.isnan(array).reshape(shape[0], -1).all(axis=1))
    if not np.isfinite(array[known]).all():
        bad = known & ~np.isfinite(array).reshape(shape[0], -1).all(axis=1)
        row = int(np.argmax(bad))
        raise PerceptionError(
            f"{name}[{row}] must be finite, or NaN throughout for None, got {array[row].tolist()}"
        )
    return array, known


def _list(values: FloatArray, known: NDArray[np.bool_]) -> list[Any]:
    """Return the rows of an array, floats or read-only arrays, with None for unknown ones."""
    rows: list[Any] = values.tolist() if values.ndim == 1 else list(values)
    if known.all():
        return rows
    return [row if is_known else None for row, is_known in zip(rows, known.tolist(), strict=True)]
