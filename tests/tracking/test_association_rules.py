"""Matching against its rules written out: every gate, every cost, the best sum, every rival."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from perception.arrays import FloatArray
from tracking._association import Gates, Wide, associate
from tracking._sizes import Sized

GATES = Gates(
    mahalanobis2=9.0,
    distance_m=0.9,
    miss_cost=4.0,
    ambiguity_margin=3.0,
    ambiguity_distance_m=0.7,
)


@dataclass(frozen=True)
class Scene:
    """Up to four tracks and four measurements, close enough together to be confused."""

    positions: FloatArray
    covariances: FloatArray
    confirmed: FloatArray
    measured: FloatArray
    noises: FloatArray
    people: FloatArray | None
    wide: Wide | None
    sizes: Sized | None


def covariances(rng: np.random.Generator, *shape: int) -> FloatArray:
    """Return covariances (*shape, 2, 2) whose axes are turned and of different lengths."""
    root = rng.uniform(-0.3, 0.3, (*shape, 2, 2)) + 0.1 * np.eye(2)
    return np.asarray(root @ root.swapaxes(-1, -2) + 0.01 * np.eye(2))


def scene(seed: int) -> Scene:
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, 5, 2)
    measured = rng.uniform(-0.8, 0.8, (m, 2))
    wide = sizes = None
    if seed % 3 == 1:
        rows = rng.random(n) < 0.6
        extra = np.zeros((n, 4, 4))
        extra[:, :2, :2] = 2.0 * covariances(rng, n)
        wide = Wide(rows, extra, rows[:, None] & (rng.random((n, m)) < 0.8), 1.5)
    if seed % 3 == 2:
        moved = measured[None] + rng.uniform(-0.1, 0.1, (n, m, 2))
        scales = rng.uniform(0.7, 1.4, (n, m))
        sizes = Sized(moved, scales, np.zeros((n, m)), 0.3 * covariances(rng, n, m))
    return Scene(
        rng.uniform(-0.8, 0.8, (n, 2)),
        covariances(rng, n),
        rng.random(n) < 0.6,
        measured,
        covariances(rng, m),
        rng.integers(0, 3, n) if seed % 2 else None,
        wide,
        sizes,
    )


def costs_of(given: Scene) -> tuple[FloatArray, FloatArray]:
    """Return the cost of each match, infinite where it passes no gate, and which need the wide."""
    n, m = len(given.positions), len(given.measured)
    costs, beyond = np.full((n, m), np.inf), np.zeros((n, m), dtype=bool)
    for i, j in itertools.product(range(n), range(m)):
        place, noise = given.measured[j], given.noises[j]
        if given.sizes is not None:
            place = given.sizes.positions_odom_m[i, j]
            noise = noise * given.sizes.scales[i, j] ** 2 + given.sizes.extra[i, j]
        offset, spread = place - given.positions[i], given.covariances[i] + noise
        d2 = offset @ np.linalg.inv(spread) @ offset
        if math.hypot(*offset) <= GATES.distance_m and d2 <= GATES.mahalanobis2:
            costs[i, j] = d2 + math.log(np.linalg.det(spread))
        elif given.wide is not None and given.wide.near[i, j]:
            spread = spread + given.wide.extra[i, :2, :2]
            d2 = offset @ np.linalg.inv(spread) @ offset
            if d2 <= GATES.mahalanobis2:
                costs[i, j] = d2 + math.log(np.linalg.det(spread)) + given.wide.price
                beyond[i, j] = True
    return costs, beyond


def best(costs: FloatArray, rows: list[int], columns: list[int]) -> dict[int, int]:
    """Return the matches with the least sum, in which a track without one costs a miss."""
    choices = itertools.product([None, *columns], repeat=len(rows))
    sets = (
        {row: column for row, column in zip(rows, each, strict=True) if column is not None}
        for each in choices
        if len({column for column in each if column is not None})
        == sum(column is not None for column in each)
    )
    return min(sets, key=lambda each: sum(costs[pair] - GATES.miss_cost for pair in each.items()))


def rivals_of(given: Scene, costs: FloatArray, matches: dict[int, int]) -> set[tuple[int, int]]:
    """Return the pairs of a track in doubt and the other track that it may be, or −1."""
    holder = {column: row for row, column in matches.items()}
    found = set()
    for i, j in zip(*np.nonzero(np.isfinite(costs)), strict=True):
        owner = holder.get(j, -1)
        same = given.people is not None and owner >= 0 and given.people[i] == given.people[owner]
        if owner == i or same:
            continue
        if i in matches:
            apart = math.dist(given.measured[j], given.measured[matches[i]])
            close = apart <= GATES.ambiguity_distance_m
            if close and costs[i, j] <= costs[i, matches[i]] + GATES.ambiguity_margin:
                found.add((int(i), owner))
        if owner >= 0:
            apart = math.dist(given.positions[i], given.positions[owner])
            close = apart <= GATES.ambiguity_distance_m
            if close and costs[i, j] <= costs[owner, j] + GATES.ambiguity_margin:
                found.add((owner, int(i)))
    return found


@pytest.mark.parametrize("tracks", [1, 2])
@pytest.mark.parametrize(("margin", "distance_m"), [(0.25, 0.5), (0.24, 0.5), (0.25, 0.49)])
def test_a_rival_at_the_very_edge_counts(tracks: int, margin: float, distance_m: float) -> None:
    """With a spread of 1 m² the costs are squared distances, here 0 and 0.25."""
    places = np.array([[0.0, 0.0], [0.5, 0.0]])
    spread = np.broadcast_to(0.5 * np.eye(2), (2, 2, 2))
    gates = replace(GATES, ambiguity_margin=margin, ambiguity_distance_m=distance_m)
    measurements = 3 - tracks  # the second of the tracks, or of the measurements, is the rival
    found = associate(
        *(places[:tracks], spread[:tracks], np.ones(tracks, dtype=bool)),
        *(places[:measurements], spread[:measurements], gates),
    )
    assert found.tracks.tolist() == found.measurements.tolist() == [0]
    assert found.ambiguous.tolist() == [(margin, distance_m) == (0.25, 0.5)]


@pytest.mark.parametrize("first", range(0, 240, 40))
def test_matches_follow_the_rules(first: int) -> None:
    counts = {"matches": 0, "rivals": 0, "beyond": 0}
    for seed in range(first, first + 40):
        given = scene(seed)
        found = associate(
            given.positions,
            given.covariances,
            given.confirmed,
            given.measured,
            given.noises,
            GATES,
            given.people,
            given.wide,
            given.sizes,
        )
        costs, beyond = costs_of(given)
        # Confirmed tracks choose first.
        rows, columns = range(len(given.positions)), range(len(given.measured))
        matches = best(costs, [row for row in rows if given.confirmed[row]], list(columns))
        left = [column for column in columns if column not in matches.values()]
        matches |= best(costs, [row for row in rows if not given.confirmed[row]], left)
        rivals = rivals_of(given, costs, matches)
        pairs = list(zip(found.tracks.tolist(), found.measurements.tolist(), strict=True))
        assert pairs == sorted(matches.items()), seed
        assert found.wide.tolist() == [bool(beyond[pair]) for pair in pairs], seed
        assert {tuple(pair) for pair in found.rivals.tolist()} == rivals, seed
        doubted = {row for row, _ in rivals}
        assert found.ambiguous.tolist() == [row in doubted for row, _ in pairs], seed
        counts["matches"] += len(pairs)
        counts["rivals"] += len(rivals)
        counts["beyond"] += int(found.wide.sum())
    assert counts["matches"] > 20
    assert counts["rivals"] > 10
    assert counts["beyond"] > 0
