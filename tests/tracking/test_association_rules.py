"""Matching against its rules written out: every gate, every cost, the best sum, every rival."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception.arrays import FloatArray
from tracking import TrackerConfig
from tracking._frame import Frame, Measurement, Spread
from tracking._match import AMBIGUITY_M, AMBIGUITY_MARGIN, assigned, is_same_body, matched
from tracking._person import Track
from tracking._sensors import sensors_of
from tracking._state import Field, State, Step
from tracking.clock import FrameClock

CONFIG = TrackerConfig(gate_probability=0.99, gate_distance_m=0.9, miss_cost=4.0)
SENSORS = sensors_of(CONFIG, None, None)
GATE2 = -2.0 * math.log(0.01)


def measurement(rng: np.random.Generator, *, weak: bool) -> Measurement:
    """Return a measurement near the origin, whose covariance is turned, of unequal axes."""
    root = rng.uniform(-0.3, 0.3, (2, 2)) + 0.1 * np.eye(2)
    (xx, xy), (_, yy) = (root @ root.T + 0.01 * np.eye(2)).tolist()
    x, y = rng.uniform(-0.8, 0.8, 2).tolist()
    return Measurement(x, y, Spread(xx, xy, yy), weak=weak)


def scene(seed: int) -> tuple[list[Track], Step]:
    """Return up to four tracks and a frame with up to four measurements, near each other."""
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, 5, 2)
    frame = Frame(1.0, np.eye(4), [measurement(rng, weak=rng.random() < 0.25) for _ in range(m)])
    tracks = [Track(row + 1, measurement(rng, weak=False), frame, 1) for row in range(n)]
    for track in tracks:
        track.confirmed = bool(rng.random() < 0.6)
    state = State(tuple(tracks), (FrameClock(),), (Field(),))
    return tracks, Step.of(frame, state, SENSORS)


def costs_of(tracks: list[Track], measured: list[Measurement]) -> FloatArray:
    """Return the cost of each match, infinite where it does not pass both gates."""
    costs = np.full((len(tracks), len(measured)), np.inf)
    for (i, track), (j, one) in itertools.product(enumerate(tracks), enumerate(measured)):
        noise, offset = one.noise_m2, np.array([one.x - track.x, one.y - track.y])
        spread = np.array([[track.p00, track.p01], [track.p01, track.p11]])
        spread += [[noise.xx, noise.xy], [noise.xy, noise.yy]]
        d2 = offset @ np.linalg.inv(spread) @ offset
        if math.hypot(*offset) <= CONFIG.gate_distance_m and d2 <= GATE2:
            costs[i, j] = d2 + math.log(np.linalg.det(spread))
    return costs


def best(costs: FloatArray, rows: list[int], columns: list[int]) -> dict[int, int]:
    """Return the matches with the least sum, in which a track without one costs a miss."""
    choices = itertools.product([None, *columns], repeat=len(rows))
    sets = (
        {row: column for row, column in zip(rows, each, strict=True) if column is not None}
        for each in choices
        if len({column for column in each if column is not None})
        == sum(column is not None for column in each)
    )
    return min(sets, key=lambda each: sum(costs[pair] - CONFIG.miss_cost for pair in each.items()))


def rivals_of(
    tracks: list[Track],
    measured: list[Measurement],
    costs: FloatArray,
    matches: dict[int, int],
    rows: list[int],
    columns: list[int],
) -> set[tuple[int, int]]:
    """Return the pairs of a track in doubt and the other track that it may be, or −1."""
    holder = {column: row for row, column in matches.items()}
    found = set()
    for i, j in itertools.product(rows, columns):
        owner = holder.get(j, -1)
        if owner == i or costs[i, j] == np.inf:
            continue
        if i in matches:
            one, own = measured[j], measured[matches[i]]
            if owner < 0 and is_same_body(one, own):
                continue
            close = math.hypot(one.x - own.x, one.y - own.y) <= AMBIGUITY_M
            if close and costs[i, j] <= costs[i, matches[i]] + AMBIGUITY_MARGIN:
                found.add((i, owner))
        if owner >= 0:
            first, second = tracks[i], tracks[owner]
            close = math.hypot(first.x - second.x, first.y - second.y) <= AMBIGUITY_M
            if close and costs[i, j] <= costs[owner, j] + AMBIGUITY_MARGIN:
                found.add((owner, i))
    return found


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize(
    ("apart_m", "more_cost"),
    [
        (AMBIGUITY_M - 1e-9, AMBIGUITY_MARGIN - 1e-6),
        (AMBIGUITY_M - 1e-9, AMBIGUITY_MARGIN + 1e-6),
        (AMBIGUITY_M + 1e-9, AMBIGUITY_MARGIN - 1e-6),
    ],
)
def test_a_rival_up_to_the_very_edge_counts(count: int, apart_m: float, more_cost: float) -> None:
    """The costs of the two differ by the squared distance over the spread."""
    variance_m2 = 0.5 * apart_m**2 / more_cost
    half = Spread(variance_m2, 0.0, variance_m2)
    places = [Measurement(x, 0.0, half) for x in (0.0, apart_m)]
    # The second of the tracks, or of the measurements, is the rival.
    frame = Frame(1.0, np.eye(4), places[: 3 - count])
    tracks = [Track(row + 1, places[row], frame, 1) for row in range(count)]
    state = State(tuple(tracks), (FrameClock(),), (Field(),))
    found = matched(tracks, Step.of(frame, state, SENSORS))
    (sight,) = [each for each in found.sights if each is not None]
    assert sight.given is places[0]
    assert sight.ambiguous == (apart_m < AMBIGUITY_M and more_cost < AMBIGUITY_MARGIN)


@pytest.mark.parametrize("first", range(0, 240, 40))
def test_matches_follow_the_rules(first: int) -> None:
    counts = {"matches": 0, "rivals": 0, "new": 0}
    for seed in range(first, first + 40):
        tracks, step = scene(seed)
        measured = step.frame.measurements
        found = matched(tracks, step)
        costs, rows = costs_of(tracks, measured), range(len(tracks))
        strong = [j for j, one in enumerate(measured) if not one.weak]
        weak = [j for j, one in enumerate(measured) if one.weak]
        # Confirmed tracks choose first, then the others; the weak ones are left for the confirmed.
        matches = best(costs, [row for row in rows if tracks[row].confirmed], strong)
        left = [column for column in strong if column not in matches.values()]
        matches |= best(costs, [row for row in rows if not tracks[row].confirmed], left)
        rivals = rivals_of(tracks, measured, costs, matches, list(rows), strong)
        rest = [row for row in rows if tracks[row].confirmed and row not in matches]
        second = best(costs, rest, weak)
        rivals |= rivals_of(tracks, measured, costs, second, rest, weak)
        matches |= second
        given = {row: sight.given for row, sight in enumerate(found.sights) if sight is not None}
        assert {row: measured.index(one) for row, one in given.items()} == matches, seed
        assert set(found.rivals) == rivals, seed
        doubted = {row for row, _ in rivals}
        ambiguous = {i for i, sight in enumerate(found.sights) if sight and sight.ambiguous}
        assert ambiguous == doubted, seed
        new: list[Measurement] = []
        taken = [measured[j] for j in matches.values()]
        for one in sorted(measured, key=lambda one: math.hypot(one.x, one.y)):
            if one.weak or one in taken or any(is_same_body(one, other) for other in taken):
                continue
            taken.append(one)
            new.append(one)
        assert sorted(map(id, found.new)) == sorted(map(id, new)), seed
        counts["matches"] += len(matches)
        counts["rivals"] += len(rivals)
        counts["new"] += len(new)
    assert min(counts.values()) > 10


@given(
    st.dictionaries(
        st.integers(0, 4),
        st.dictionaries(st.integers(0, 4), st.floats(-20.0, 9.9), max_size=4),
        max_size=5,
    )
)
def test_the_assignment_is_the_cheapest(costs: dict[int, dict[int, float]]) -> None:
    table = np.full((5, 5), np.inf)
    for row, found in costs.items():
        for column, cost in found.items():
            table[row, column] = cost - 10.0 + CONFIG.miss_cost
    matches = best(table, sorted(costs), list(range(5)))
    chosen = assigned(costs, 10.0)
    assert len(set(chosen.values())) == len(chosen)
    total = sum(costs[row][column] - 10.0 for column, row in chosen.items())
    assert total == pytest.approx(sum(costs[pair[0]][pair[1]] - 10.0 for pair in matches.items()))
