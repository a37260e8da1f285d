"""A detector that reports people twice makes one track a person; two real people stay two."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from tracking_scenes import CAMERA, PERIOD_S, FloatArray, observe

from tracking import PersonTrack, PersonTracker, TrackerConfig

Scene = list[list[FloatArray]]
NOISE_M = 0.1


def twin_scene(seed: int, *, seconds: float = 20.0, period_s: float = PERIOD_S) -> Scene:
    """Return frames of one walker with a second box 0.35 m away in 30 % of the frames."""
    rng = np.random.default_rng([7, seed])
    angle = rng.uniform(0.0, 2.0 * math.pi)
    offset = 0.35 * np.array([math.cos(angle), math.sin(angle)])
    frames: Scene = []
    for frame in range(round(seconds / period_s)):
        place = np.array([5.0, 2.5 * math.sin(0.3 * frame * period_s)])
        seen = []
        if rng.random() < 0.9:
            seen.append(place + rng.normal(0.0, NOISE_M, 2))
            if rng.random() < 0.3:
                seen.append(place + offset + rng.normal(0.0, NOISE_M, 2))
        frames.append(seen)
    return frames


def pair_scene(
    seed: int,
    shares: tuple[float, float],
    *,
    apart_m: float = 0.4,
    seconds: float = 20.0,
    crossing: bool = False,
) -> Scene:
    """Return frames of two people beside each other, each detected in a share of the frames.

    People who cross pass each other every four seconds.
    """
    rng = np.random.default_rng([8, seed])
    angle = rng.uniform(0.0, 2.0 * math.pi)
    offset = apart_m * np.array([math.cos(angle), math.sin(angle)])
    frames: Scene = []
    for frame in range(round(seconds / PERIOD_S)):
        t = frame * PERIOD_S
        place = np.array([5.0, 2.5 * math.sin(0.3 * t)])
        other = place + (
            np.array([apart_m / 2.0, 3.0 * math.sin(math.pi * t / 4.0)]) if crossing else offset
        )
        seen = []
        if rng.random() < shares[0]:
            seen.append(place + rng.normal(0.0, NOISE_M, 2))
        if rng.random() < shares[1]:
            seen.append(other + rng.normal(0.0, NOISE_M, 2))
        frames.append(seen)
    return frames


def follow(
    scene: Scene,
    *,
    period_s: float = PERIOD_S,
    config: TrackerConfig | None = None,
    awareness: Sequence[float | None] = (None, None),
) -> list[tuple[PersonTrack, ...]]:
    tracker = PersonTracker(config)
    return [
        tracker.update(
            [
                observe(p, i * period_s, covariance_odom_m2=NOISE_M**2, awareness=alpha)
                for p, alpha in zip(seen, awareness, strict=False)
            ],
            i * period_s,
            CAMERA,
        )
        for i, seen in enumerate(scene)
    ]


def confirmed_counts(frames: Sequence[tuple[PersonTrack, ...]]) -> FloatArray:
    return np.array([sum(one.status != "tentative" for one in tracks) for tracks in frames])


def test_a_second_box_in_a_third_of_the_frames_is_no_second_person() -> None:
    counts = np.array([confirmed_counts(follow(twin_scene(seed))) for seed in range(2)])
    assert counts.mean() <= 1.2
    assert counts[:, 200:].mean() <= 1.05
    assert (counts[:, 20:] >= 1).all()


@pytest.mark.parametrize("shares", [(0.95, 0.95), (0.9, 0.8), (0.7, 0.7)])
def test_two_people_shoulder_to_shoulder_are_two(shares: tuple[float, float]) -> None:
    """Whoever is missed often may be a double, but is reported all the same, as unaware."""
    for seed, apart_m in enumerate((0.4, 0.5)):
        scene = pair_scene(seed, shares, apart_m=apart_m)
        frames = follow(scene, awareness=(0.95, 0.95))
        for tracks, seen in zip(frames, scene, strict=True):
            # Nearer to each other than two bodies they are one.
            assert len(tracks) >= 2 or not seen[1:] or math.dist(*seen) < 0.3
        if min(shares) > 0.75:
            assert (confirmed_counts(frames)[100:] >= 2).all()


def test_people_who_cross_stay_two() -> None:
    for seed in range(2):
        scene = pair_scene(seed, (0.9, 0.9), crossing=True)
        assert (confirmed_counts(follow(scene))[40:] >= 2).all()


def test_a_person_with_a_twin_is_kept_as_long_unseen_as_anybody() -> None:
    missed_s = TrackerConfig().max_missed_s
    for seed in range(3):
        scene = twin_scene(seed, seconds=8.0)
        unseen: Scene = [[] for _ in range(round((missed_s - 0.2) / PERIOD_S))]
        assert (confirmed_counts(follow(scene + unseen))[20:] >= 1).all()


def test_a_second_box_without_a_face_takes_no_awareness() -> None:
    scene: Scene = [[np.array([4.0, 0.5]), np.array([4.1, 0.55])] for _ in range(60)]
    for awareness in ((0.95, None), (None, 0.95)):
        (track,) = follow(scene, awareness=awareness)[-1]
        assert track.awareness_lower > 0.5


@pytest.mark.parametrize("awareness", [(0.95, 0.05), (0.05, 0.95)])
def test_two_boxes_on_one_body_are_as_aware_as_the_less_aware(awareness) -> None:
    """A detector without suppression reports each person twice in every frame."""
    rng = np.random.default_rng(3)
    scene: Scene = [
        [place, place + np.array([0.1, 0.05])] for place in rng.normal((4.0, 0.5), 0.03, (60, 2))
    ]
    both = follow(scene, awareness=(0.95, 0.95))
    (aware,) = both[-1]
    (less,) = follow(scene, awareness=awareness)[-1]
    assert aware.awareness_lower > 0.5
    assert less.awareness_lower < 0.05


def test_a_second_box_that_walks_off_is_somebody_else_without_awareness() -> None:
    scene = twin_scene(1, seconds=8.0)
    last = scene[-1][0] if scene[-1] else np.array([5.0, 2.5 * math.sin(0.3 * 8.0)])
    leaving = [[last, last + np.array([0.35 + 0.05 * step, 0.0])] for step in range(1, 40)]
    tracks = follow(scene + leaving, awareness=(0.95, None))[-1]
    assert len(tracks) == 2
    far = max(tracks, key=lambda one: float(one.position_odom_m[0]))
    assert far.awareness_lower == 0.0
