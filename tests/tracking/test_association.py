"""Matching: gates, the best sum of costs, and ambiguous matches."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tracking._association import Gates, associate

GATES = Gates(
    mahalanobis2=11.6,
    distance_m=1.0,
    miss_cost=10.0,
    ambiguity_margin=4.0,
    ambiguity_distance_m=0.8,
)


class Match(NamedTuple):
    track: int
    measurement: int
    ambiguous: bool


def match(
    tracks: list[tuple[float, float]],
    measured: list[tuple[float, float]],
    *,
    track_std_m: float | list[float] = 0.1,
    noise_std_m: float = 0.1,
    confirmed: list[bool] | None = None,
    gates: Gates = GATES,
) -> tuple[Match, ...]:
    stds = np.broadcast_to(np.asarray(track_std_m, dtype=float), len(tracks))
    found = associate(
        np.array(tracks, dtype=float).reshape(-1, 2),
        np.array([np.eye(2) * std**2 for std in stds]).reshape(-1, 2, 2),
        np.array([True] * len(tracks) if confirmed is None else confirmed, dtype=bool),
        np.array(measured, dtype=float).reshape(-1, 2),
        np.array([np.eye(2) * noise_std_m**2] * len(measured)).reshape(-1, 2, 2),
        gates,
    )
    columns = (found.tracks, found.measurements, found.ambiguous)
    return tuple(
        Match(i, j, ambiguous)
        for i, j, ambiguous in zip(*(column.tolist() for column in columns), strict=True)
    )


def pairs(matches: tuple[Match, ...]) -> set[tuple[int, int]]:
    return {(found.track, found.measurement) for found in matches}


def test_nothing_matches_nothing() -> None:
    assert match([], []) == ()
    assert match([(0, 0)], []) == ()
    assert match([], [(0, 0)]) == ()


def test_the_distance_gate_holds_however_wide_the_track() -> None:
    assert match([(0, 0)], [(0.99, 0)], track_std_m=5.0)
    assert not match([(0, 0)], [(1.01, 0)], track_std_m=5.0)


def test_the_mahalanobis_gate_holds_however_near_the_measurement() -> None:
    # S = 2 · 0.1², so the gate √11.6 σ lies at 0.48 m.
    assert match([(0, 0)], [(0.47, 0)])
    assert not match([(0, 0)], [(0.49, 0)])


def test_confirmed_tracks_choose_first() -> None:
    found = match([(0.0, 0), (0.2, 0)], [(0.2, 0)], confirmed=[True, False])
    assert pairs(found) == {(0, 0)}
    found = match([(0.0, 0), (0.2, 0)], [(0.2, 0)], confirmed=[True, True])
    assert pairs(found) == {(1, 0)}


def test_tentative_tracks_take_what_is_left() -> None:
    found = match([(0.0, 0), (0.3, 0)], [(0.3, 0), (0.0, 0)], confirmed=[True, False])
    assert pairs(found) == {(0, 1), (1, 0)}


def test_an_uncertain_track_does_not_take_its_neighbours_measurement() -> None:
    # The uncertain track is nearer in Mahalanobis distance, but its log-determinant costs more.
    found = match([(0.0, 0), (0.45, 0)], [(0.16, 0)], track_std_m=[0.05, 0.8])
    assert pairs(found) == {(0, 0)}


@given(
    st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=4),
    st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=4),
)
def test_matching_is_the_best_over_all_permutations(
    tracks: list[tuple[float, float]], measured: list[tuple[float, float]]
) -> None:
    found = match(tracks, measured)
    assert len({m.track for m in found}) == len({m.measurement for m in found}) == len(found)

    def cost(i: int, j: int) -> float:
        """Return the cost of a match less that of a miss; 0 outside a gate."""
        offset = np.hypot(*np.subtract(tracks[i], measured[j]))
        distance2 = offset**2 / 0.02
        if offset > GATES.distance_m or distance2 > GATES.mahalanobis2:
            return 0.0
        return float(distance2 + np.log(0.02**2) - GATES.miss_cost)

    best = 0.0
    size = max(len(tracks), len(measured))
    for order in itertools.permutations(range(size)):
        allowed = [(i, j) for i, j in enumerate(order) if i < len(tracks) and j < len(measured)]
        best = min(best, sum(cost(i, j) for i, j in allowed))
    chosen = [cost(m.track, m.measurement) for m in found]
    assert all(c < 0.0 for c in chosen)
    assert sum(chosen) <= best + 1e-6


def test_a_missed_person_does_not_cause_a_chain_of_wrong_matches() -> None:
    # B's measurement is at B and in A's gate, clutter is in B's gate. The largest set of matches
    # would be A with B's measurement and B with the clutter.
    tracks: list[tuple[float, float]] = [(0.0, 0), (0.45, 0)]
    measured: list[tuple[float, float]] = [(0.45, 0), (0.9, 0)]
    assert pairs(match(tracks, measured)) == {(1, 0)}


def test_a_match_without_rivals_is_never_ambiguous() -> None:
    assert not match([(0, 0)], [(0.4, 0)])[0].ambiguous


def test_a_measurement_between_two_near_tracks_is_ambiguous() -> None:
    assert match([(-0.2, 0), (0.2, 0)], [(0.01, 0)])[0].ambiguous
    # The same measurement is not ambiguous when the other track is two metres away.
    assert not match([(0.0, 0), (2.0, 0)], [(0.01, 0)])[0].ambiguous


def test_a_track_between_two_near_measurements_is_ambiguous() -> None:
    assert match([(0, 0)], [(-0.2, 0), (0.21, 0)])[0].ambiguous


def test_rivals_that_fit_much_worse_or_are_far_away_make_no_match_ambiguous() -> None:
    tracks: list[tuple[float, float]] = [(0.0, 0), (0.42, 0)]
    measured: list[tuple[float, float]] = [(0.0, 0), (0.42, 0)]
    assert not any(found.ambiguous for found in match(tracks, measured))
    near = Gates(11.6, 1.0, 10.0, 20.0, 0.3)
    assert not any(found.ambiguous for found in match(tracks, measured, gates=near))
    wide = Gates(11.6, 1.0, 10.0, 20.0, 0.8)
    assert all(found.ambiguous for found in match(tracks, measured, gates=wide))
