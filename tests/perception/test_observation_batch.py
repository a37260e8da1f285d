"""The observations of a frame made at once equal those made one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from perception import PerceptionError, PersonObservation


def columns(count: int = 4) -> dict[str, Any]:
    rng = np.random.default_rng(5)
    factor = rng.normal(size=(count, 3, 3))
    gazes = rng.normal(size=(count, 3))
    return {
        "positions_camera_m": rng.normal(size=(count, 3)),
        "position_covariances_m2": factor @ factor.transpose(0, 2, 1) + 0.01 * np.eye(3),
        "scores": rng.random(count),
        "gazes_camera": gazes / np.linalg.norm(gazes, axis=1, keepdims=True),
        "awareness": rng.random(count),
        "awareness_std": rng.random(count),
        "boxes_xyxy_px": rng.random((count, 4)),
    }


def assert_equal(one: PersonObservation, other: PersonObservation) -> None:
    for name in PersonObservation.__slots__:
        first, second = getattr(one, name), getattr(other, name)
        assert type(first) is type(second), name
        if first is not None:
            np.testing.assert_allclose(first, second, rtol=1e-15, err_msg=name)


def test_a_batch_equals_observations_made_one_by_one() -> None:
    given = columns()
    given["gazes_camera"][1] = np.nan
    given["boxes_xyxy_px"][2] = np.nan
    given["awareness"][3] = given["awareness_std"][3] = np.nan
    made = PersonObservation.batch(1.5, **given)
    assert len(made) == 4
    for row, one in enumerate(made):
        known = row != 3
        alone = PersonObservation(
            1.5,
            given["positions_camera_m"][row],
            given["position_covariances_m2"][row],
            None if row == 1 else given["gazes_camera"][row],
            float(given["awareness"][row]) if known else None,
            float(given["awareness_std"][row]) if known else None,
            float(given["scores"][row]),
            None if row == 2 else given["boxes_xyxy_px"][row],
        )
        assert_equal(one, alone)


def test_what_is_left_out_is_none() -> None:
    given = columns()
    names = ("positions_camera_m", "position_covariances_m2", "scores")
    for one in PersonObservation.batch(0.0, **{name: given[name] for name in names}):
        assert one.gaze_camera is one.awareness is one.awareness_std is one.box_xyxy_px is None


def test_nobody_is_an_empty_tuple() -> None:
    assert PersonObservation.batch(0.0, **columns(0)) == ()


def test_the_arrays_are_copies_and_read_only() -> None:
    given = columns()
    (first, *_) = PersonObservation.batch(0.0, **given)
    before = first.position_camera_m.copy()
    given["positions_camera_m"][:] = 9.0
    np.testing.assert_array_equal(first.position_camera_m, before)
    for name in ("position_camera_m", "position_covariance_m2", "gaze_camera", "box_xyxy_px"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(first, name)[0] = 1.0


@pytest.mark.parametrize(
    ("name", "index", "value", "message"),
    [
        ("positions_camera_m", (2, 0), np.nan, "positions_camera_m must be finite"),
        ("positions_camera_m", None, np.zeros((3, 3)), "position_covariances_m2 must have one"),
        ("positions_camera_m", None, np.zeros((4, 2)), r"must have shape \(N, 3\)"),
        ("position_covariances_m2", (2, 0, 1), 7.0, r"covariances_m2\[2\] must be symmetric"),
        ("position_covariances_m2", (1, 0, 0), -1.0, r"covariances_m2\[1\] must be positive semi"),
        ("position_covariances_m2", (1, 0, 0), np.inf, "must be finite"),
        ("scores", 3, 1.2, r"scores\[3\] must lie in \[0, 1\], got 1.2"),
        ("scores", 3, np.nan, "scores must be finite"),
        ("awareness", 1, -0.1, r"awareness\[1\] must lie in \[0, 1\], got -0.1"),
        ("awareness", 1, np.nan, r"must both be given or both be NaN, got awareness\[1\]=nan"),
        ("awareness", None, None, "must both be given or both be None"),
        ("awareness", None, np.zeros(3), r"awareness must have shape \(4,\), got \(3,\)"),
        ("awareness_std", 1, np.inf, r"awareness_std\[1\] must be finite"),
        ("awareness_std", 1, -1.0, r"awareness_std\[1\] must lie in \[0, inf\)"),
        ("gazes_camera", 2, (0.0, 2.0, 0.0), r"gazes_camera\[2\] must be a unit vector"),
        ("gazes_camera", (2, 1), np.nan, r"gazes_camera\[2\] must be finite, or NaN throughout"),
        ("boxes_xyxy_px", (0, 1), np.inf, r"boxes_xyxy_px\[0\] must be finite"),
        ("boxes_xyxy_px", None, [["a"] * 4] * 4, "must be an array of numbers"),
    ],
)
def test_bad_columns_are_refused(name: str, index: Any, value: Any, message: str) -> None:
    given = columns()
    if index is None:
        given[name] = value
    else:
        given[name][index] = value
    with pytest.raises(PerceptionError, match=message):
        PersonObservation.batch(0.0, **given)


def test_a_bad_stamp_is_refused() -> None:
    with pytest.raises(PerceptionError, match="stamp_s must be finite"):
        PersonObservation.batch(float("nan"), **columns())
