"""A short drive with held-out workers: people are found, racks and posts are not people."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.laser_actors import TROLLEY_SIZE_M, Trolley
from benchmarks.laser_people import Figures, drive
from perception.laser import LegDetectorConfig
from sim_tests.actors.body import worker_names
from sim_tests.world.hall import LAYOUTS
from sim_tests.world.sightlines import cut_surfaces
from training.legs import TRAINING_HALLS, TRAINING_WORKERS

HELD_OUT = [name for name in worker_names() if name not in TRAINING_WORKERS]


def driven(hall: str, people: int, seconds: float, seed: int, trolleys=()) -> Figures:
    figures = Figures()
    config = LegDetectorConfig()
    drive(hall, 0, HELD_OUT[:people], seconds, seed, figures, config, trolleys=trolleys)
    return figures


def found(figures: Figures) -> np.ndarray:
    return np.concatenate([v for k, v in figures.seen.items() if k.startswith("range")])


def test_the_judged_halls_and_people_are_in_no_training_scan() -> None:
    assert len(HELD_OUT) >= 5
    assert "staging_hall" in set(LAYOUTS) - set(TRAINING_HALLS)


def test_people_in_a_held_out_hall_are_found_and_nothing_else() -> None:
    figures = driven("staging_hall", 5, 5.0, 7)
    seen = found(figures)
    assert len(seen) > 100
    assert seen.mean() >= 0.95
    assert np.median(np.concatenate(list(figures.errors_m.values()))) < 0.05
    assert not figures.ghosts


def test_people_who_push_trolleys_are_found_by_their_legs() -> None:
    figures = driven("open", 2, 6.0, 1, ("base", "castors"))
    for kind in ("base", "castors"):
        seen = figures.seen[f"pushing, {kind}, legs in view"]
        assert len(seen) > 30
        assert np.mean(seen) >= 0.95
    assert not figures.ghosts


@pytest.mark.parametrize("kind", ["base", "castors"])
def test_a_trolley_is_cut_at_the_height_of_a_scanner(kind) -> None:
    """Its base is one box; of its castors four are met, below the platform."""
    trolley = Trolley(kind, lambda: (3.0, 1.0, 0.5))
    low, high = trolley.reach_odom_m()
    length, width = TROLLEY_SIZE_M
    for z, boxes in ((0.2, 1 if kind == "base" else 4), (0.28, 1)):
        segments, _ = cut_surfaces([trolley.surface(1)], np.array([0.0, 0.0, 1.0]), z)
        points = segments.reshape(-1, 3)
        assert len(segments) == 8 * boxes  # four sides of two triangles each
        assert ((points > low) & (points < high)).all()
        along = (points[:, :2] - (3.0, 1.0)) @ (np.cos(0.5), np.sin(0.5))
        across = (points[:, :2] - (3.0, 1.0)) @ (-np.sin(0.5), np.cos(0.5))
        off = 0.0 if boxes == 1 else 0.06 - 0.035
        assert np.ptp(along) == pytest.approx(length - 2.0 * off)
        assert np.ptp(across) == pytest.approx(width - 2.0 * (off and 0.06 - 0.025))


@pytest.mark.full
def test_every_hall_keeps_its_figures() -> None:
    every, ghosts, seconds = [], 0, 0.0
    for hall in LAYOUTS:
        for people in (5, 0):
            figures = driven(hall, people, 60.0, 5)
            every += found(figures).tolist() if people else []
            ghosts, seconds = ghosts + len(figures.ghosts), seconds + 60.0
    assert np.mean(every) >= 0.96
    assert ghosts <= seconds / 60.0
