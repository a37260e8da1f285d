"""Awareness in the whole tracker: rise and fall, memory, missed frames, and its limits."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tracking_scenes import CAMERA, PERIOD_S, nearest, observe

from tracking import AwarenessFilterConfig, PersonTrack, PersonTracker, TrackerConfig

AWARE_ABOVE = 0.5
# Content of a frame: an α, None for a person without a face, "missed" for one whose head looks here
# and whose face is not found, "unseen" for no person.
Shown = float | str | None


def lower_bounds(
    shown: list[Shown],
    *,
    alpha_std: float = 0.07,
    noise_std: float | None = None,
    seed: int = 0,
    period_s: float = PERIOD_S,
    config: TrackerConfig | None = None,
) -> np.ndarray:
    """Return awareness_lower after each frame of one standing person.

    α has noise of ``noise_std``, by default the reported ``alpha_std``.
    """
    noise_std = alpha_std if noise_std is None else noise_std
    rng = np.random.default_rng(seed)
    tracker, bounds = PersonTracker(config), []
    for step, alpha in enumerate(shown):
        now = step * period_s
        frame = []
        if alpha != "unseen":
            measured = (
                None
                if alpha in (None, "missed")
                else float(np.clip(float(alpha) + rng.normal(0.0, noise_std), 0.0, 1.0))
            )
            one = observe((3.0, 0.0), now, awareness=measured, awareness_std=alpha_std)
            reason = "face missed" if alpha == "missed" else None
            frame = [replace(one, awareness_reason=reason)]
        tracks = tracker.update(frame, now, CAMERA)
        bounds.append(tracks[0].awareness_lower if tracks else 0.0)
    return np.array(bounds)


def exact_bounds(
    shown: list[Shown],
    period_s: float = PERIOD_S,
    alpha_std: float = 0.1,
    *,
    config: TrackerConfig | None = None,
) -> np.ndarray:
    """Return awareness_lower after each frame of one standing person; α is exact."""
    return lower_bounds(shown, alpha_std=alpha_std, noise_std=0.0, period_s=period_s, config=config)


@pytest.mark.parametrize(("alpha_std", "period_s"), [(0.05, 0.033), (0.1, 0.05), (0.1, 0.1)])
@pytest.mark.parametrize("lost", ["unseen", None, 0.0])
def test_awareness_falls_within_0_35_s(lost: Shown, period_s: float, alpha_std: float) -> None:
    before, after = round(1.0 / period_s), round(0.35 / period_s)
    released = []
    for seed in range(10):
        bounds = lower_bounds(
            [1.0] * before + [lost] * after, alpha_std=alpha_std, seed=seed, period_s=period_s
        )
        assert bounds[before - 1] > AWARE_ABOVE
        released.append(int(np.argmax(bounds[before:] < 0.5 * AWARE_ABOVE) + 1) * period_s)
        assert bounds[-1] < 0.5 * AWARE_ABOVE
    assert np.percentile(released, 95) <= 0.35


@pytest.mark.parametrize("period_s", [0.033, 0.05, 0.1])
@pytest.mark.parametrize("gap_s", [0.2, 0.45])
def test_a_gap_of_the_network_of_faces_leaves_somebody_aware(gap_s: float, period_s: float) -> None:
    before, gap, after = (round(each / period_s) for each in (1.5, gap_s, 0.5))
    for seed in range(5):
        bounds = lower_bounds(
            [1.0] * before + ["missed"] * gap + [1.0] * after, seed=seed, period_s=period_s
        )
        assert (bounds[before - 1 :] > AWARE_ABOVE).all()
        assert np.ptp(bounds[before - 1 : before + gap]) == 0.0
        # Of a head that has turned, a gap costs all.
        turned = lower_bounds([1.0] * before + [None] * gap, seed=seed, period_s=period_s)
        assert turned[-1] < bounds[before + gap - 1]


@pytest.mark.parametrize("period_s", [0.033, 0.05, 0.1])
def test_a_face_that_is_missed_for_longer_ends_awareness(period_s: float) -> None:
    before, held, after = (round(each / period_s) for each in (1.5, 0.5, 0.35))
    bounds = lower_bounds([1.0] * before + ["missed"] * (held + after + 1), period_s=period_s)
    assert bounds[-1] < 0.5 * AWARE_ABOVE
    assert (lower_bounds(["missed"] * 60, period_s=period_s) == 0.0).all()
    assert lower_bounds([0.0] * 20 + ["missed"] * 20, period_s=period_s).max() < 0.1


@pytest.mark.parametrize(("alpha_std", "period_s"), [(0.05, 0.033), (0.1, 0.05), (0.1, 0.1)])
def test_awareness_rises_within_0_5_s(period_s: float, alpha_std: float) -> None:
    before, after = round(1.0 / period_s), round(0.5 / period_s)
    for seed in range(10):
        bounds = lower_bounds(
            [0.0] * before + [0.9] * after, alpha_std=alpha_std, seed=seed, period_s=period_s
        )
        assert bounds[before - 1] < 0.5 * AWARE_ABOVE
        assert bounds[-1] > AWARE_ABOVE


@pytest.mark.parametrize(("alpha", "least"), [(0.7, 0.5), (0.9, 0.65), (1.0, 0.8)])
def test_steady_attention_is_recognised_and_not_overestimated(alpha: float, least: float) -> None:
    bounds = np.concatenate([lower_bounds([alpha] * 60, seed=seed)[30:] for seed in range(8)])
    assert bounds.mean() > least
    assert (bounds > alpha).mean() < 0.1


def test_one_frame_with_a_high_alpha_does_not_make_a_person_aware() -> None:
    bounds = lower_bounds([None] * 20 + [0.95] + [None] * 5)
    assert bounds.max() < AWARE_ABOVE
    assert lower_bounds([0.0] * 20 + [0.95] + [0.0] * 5).max() < AWARE_ABOVE


@pytest.mark.parametrize("blind", [None, "unseen"])
def test_without_a_face_nobody_becomes_aware(blind: Shown) -> None:
    assert (lower_bounds([blind] * 60) == 0.0).all()
    bounds = lower_bounds([0.0] * 10 + [blind] * 40)
    assert (np.diff(bounds[9:]) <= 0.0).all()


def test_evidence_from_before_confirmation_does_not_count() -> None:
    tracker = PersonTracker()
    (track,) = tracker.update([observe((3, 0), 0.0, awareness=1.0)], 0.0, CAMERA)
    step = 0
    while True:
        step += 1
        (unaware,) = copy.deepcopy(tracker).update(
            [observe((3, 0), step * PERIOD_S)], step * PERIOD_S, CAMERA
        )
        if unaware.status == "confirmed":
            break
        now = step * PERIOD_S
        (track,) = tracker.update([observe((3, 0), now, awareness=1.0)], now, CAMERA)
        assert (track.status, track.awareness_lower) == ("tentative", 0.0)
    assert step > 1
    assert unaware.awareness_lower == 0.0


def test_repeated_frames_make_nobody_more_aware() -> None:
    tracker = PersonTracker()
    for step in range(10):
        now = step * PERIOD_S
        tracker.update([observe((3, 0), now, awareness=0.3 + 0.05 * step)], now, CAMERA)
    (once,) = tracker.predict(now)
    for _ in range(30):
        (again,) = tracker.update([observe((3, 0), now, awareness=1.0)], now, CAMERA)
    assert again.awareness_lower == once.awareness_lower
    (lower,) = tracker.update([observe((3, 0), now, awareness=0.0)], now, CAMERA)
    assert lower.awareness_lower < once.awareness_lower


def test_looks_far_apart_are_no_evidence_for_the_time_between_them() -> None:
    def after_gap(gap_s: float) -> PersonTrack:
        tracker = PersonTracker()
        for step in range(40):
            now = step * PERIOD_S
            tracker.update([observe((3, 0), now, awareness=0.95)], now, CAMERA)
        look = [observe((3, 0), now + gap_s, awareness=0.6, awareness_std=0.25)]
        return tracker.update(look, now + gap_s, CAMERA)[0]

    gap_s = 0.25
    assert after_gap(gap_s - 1e-6).awareness > after_gap(gap_s + 1e-6).awareness + 0.05


@pytest.mark.parametrize("alpha_std", [0.3, 0.5, 1e6])
def test_an_alpha_with_a_large_standard_deviation_counts_as_no_face(alpha_std: float) -> None:
    tracker, twin = PersonTracker(), PersonTracker()
    for step in range(30):
        now = step * PERIOD_S
        vague = [observe((3, 0), now, awareness=1.0, awareness_std=alpha_std)]
        (track,) = tracker.update(vague, now, CAMERA)
        (blind,) = twin.update([observe((3, 0), now)], now, CAMERA)
        assert track.awareness == blind.awareness
        assert track.awareness_lower == 0.0


def two_people(
    places_of: Callable[[float], np.ndarray], alphas: tuple[Shown, Shown], seed: int
) -> list[tuple[float, np.ndarray, tuple[PersonTrack, ...]]]:
    rng = np.random.default_rng(seed)
    tracker, history = PersonTracker(), []
    for step in range(81):
        now = step * PERIOD_S
        places = places_of(now)
        frame = [
            observe(
                place + rng.normal(0.0, 0.08, 2),
                now,
                covariance_odom_m2=0.08**2,
                awareness=None if alpha is None else float(alpha),
                awareness_std=0.05,
            )
            for place, alpha in zip(places, alphas, strict=True)
        ]
        history.append((now, places, tracker.update(frame, now, CAMERA)))
    return history


def meeting(now: float) -> np.ndarray:
    """Return the places of two people who pass each other after 2 s, 5 cm apart."""
    along = 1.2 * (now - 2.0)
    return np.array([[5.0 + along, 0.0], [5.0 - along, 0.05]])


@pytest.mark.parametrize("unaware", [None, 0.0])
def test_awareness_is_not_inherited_when_two_people_pass(unaware: Shown) -> None:
    for seed in range(6):
        for _, places, tracks in two_people(meeting, (0.95, unaware), seed)[5:]:
            assert nearest(tracks, places[1]).awareness_lower < AWARE_ABOVE or (
                # While they pass, no camera can tell them apart.
                np.linalg.norm(places[0] - places[1]) < 0.2
            )


# How much of the bound is left in the missed frame, which lasts longer with a slow camera.
@pytest.mark.parametrize(("rate_hz", "left"), [(5.0, 0.4), (10.0, 0.6), (15.0, 0.6), (30.0, 0.8)])
def test_a_single_missed_frame_costs_little(rate_hz: float, left: float) -> None:
    looks = [0.9] * round(2.0 * rate_hz)
    bounds = exact_bounds([*looks, "unseen", 0.9], 1.0 / rate_hz)
    before, missed, after = bounds[-3:]
    assert left * before < missed < before
    assert after > 0.8 * before


@pytest.mark.parametrize("rate_hz", [10.0, 15.0, 30.0])
def test_missed_frames_in_a_row_end_awareness_within_0_3_s(rate_hz: float) -> None:
    looks, misses = [0.95] * round(2.0 * rate_hz), ["unseen"] * round(0.3 * rate_hz)
    bounds = exact_bounds([*looks, *misses], 1.0 / rate_hz)
    assert (np.diff(bounds[-len(misses) - 1 :]) < 0.0).all()
    assert bounds[-1] < 0.25 * bounds[-len(misses) - 1]


def test_a_frame_without_a_face_ends_the_grace() -> None:
    looks = [0.95] * 60
    faceless = exact_bounds([*looks, None, "unseen"], 1.0 / 30.0)
    missed = exact_bounds([*looks, "unseen", "unseen"], 1.0 / 30.0)
    assert faceless[-1] < faceless[-2] < missed[-2]
    slow = TrackerConfig(awareness=AwarenessFilterConfig(missed_frame_s=0.0))
    without = exact_bounds([*looks, None, "unseen"], 1.0 / 30.0, config=slow)
    assert faceless[-1] == pytest.approx(without[-1])
