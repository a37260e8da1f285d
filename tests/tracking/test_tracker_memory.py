"""``memory_s``: a look may count for longer if the settings ask for it, never by default."""

from __future__ import annotations

import numpy as np
import pytest
from tracking_scenes import CAMERA, PERIOD_S, observe

from tracking import AwarenessFilterConfig, PersonTracker, TrackerConfig

REMEMBERS = TrackerConfig(awareness=AwarenessFilterConfig(memory_s=2.0))
FORGETS = TrackerConfig()

Shown = float | str | None


def lower_bounds(config: TrackerConfig, shown: list[Shown]) -> np.ndarray:
    """Return awareness_lower after each frame; None is a person without a face, text nobody."""
    tracker, bounds = PersonTracker(config), []
    for step, alpha in enumerate(shown):
        now = step * PERIOD_S
        seen = [] if isinstance(alpha, str) else [observe((3.0, 0.0), now, awareness=alpha)]
        tracks = tracker.update(seen, now, CAMERA)
        bounds.append(tracks[0].awareness_lower if tracks else 0.0)
    return np.array(bounds)


def test_the_default_has_no_memory() -> None:
    assert AwarenessFilterConfig().memory_s == 0.0


@pytest.mark.parametrize("nothing", [None, "unseen"])
def test_memory_slows_the_fall_without_evidence_and_never_raises_the_bound(nothing: Shown) -> None:
    shown: list[Shown] = [0.95] * 40 + [nothing] * 40
    slow, fast = lower_bounds(REMEMBERS, shown), lower_bounds(FORGETS, shown)
    np.testing.assert_array_equal(slow[:40], fast[:40])
    assert (slow[40:] >= fast[40:]).all()
    assert slow[50] > 0.25
    assert slow[50] > 5.0 * fast[50]
    assert (np.diff(slow[39:]) <= 0.0).all()
    assert slow[-1] < 0.5 * slow[39]


def test_a_face_that_looks_away_ends_the_memory() -> None:
    away: list[Shown] = [0.95] * 40 + [0.0] * 7
    assert lower_bounds(REMEMBERS, away)[-1] < 0.25
    after_a_gap: list[Shown] = [0.95] * 40 + ["unseen"] * 6 + [0.0] * 7
    assert lower_bounds(REMEMBERS, after_a_gap)[-1] < 0.25


def test_without_a_look_there_is_nothing_to_remember() -> None:
    assert (lower_bounds(REMEMBERS, [None] * 40) == 0.0).all()


def test_an_ambiguous_match_ends_the_memory() -> None:
    tracker = PersonTracker(REMEMBERS)
    for step in range(40):
        now = step * PERIOD_S
        tracker.update([observe((3.0, 0.0), now, awareness=0.95)], now, CAMERA)
    # Two people where there was one: either may be the one who looked.
    now += PERIOD_S
    pair = [observe((3.0, y_m), now, awareness=0.95) for y_m in (-0.1, 0.1)]
    assert all(track.awareness_lower < 0.1 for track in tracker.update(pair, now, CAMERA))
