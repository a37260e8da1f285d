"""Data association: one-to-one matches of measurements to tracks, and which are ambiguous."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from perception.arrays import FloatArray
from perception.matrices import mahalanobis2

from ._sizes import Sized
from ._table import BoolArray, IndexArray


@dataclass(frozen=True, slots=True)
class Gates:
    """Limits within which a match is possible, and within which it is ambiguous.

    Attributes:
        mahalanobis2: largest squared Mahalanobis distance (χ² with two degrees of freedom).
        distance_m: largest distance.
        miss_cost: cost of leaving a track and a measurement unmatched; see :func:`associate`.
        ambiguity_margin: a rival that costs at most this much more makes a match ambiguous, …
        ambiguity_distance_m: … if it is no further away than this.
    """

    mahalanobis2: float
    distance_m: float
    miss_cost: float
    ambiguity_margin: float
    ambiguity_distance_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """K matches, one to one.

    Attributes:
        tracks: (K,) rows of tracks.
        measurements: (K,) rows of measurements.
        ambiguous: (K,) True where a rival match is about as likely.
        wide: (K,) True where only a :class:`Wide` allows the match.
        rivals: (P, 2) rows of tracks: the match of the first is ambiguous, and the second is the
            other track that it may be; −1 where it may be nobody known.
    """

    tracks: IndexArray
    measurements: IndexArray
    ambiguous: BoolArray
    wide: BoolArray
    rivals: IndexArray


@dataclass(frozen=True, slots=True, eq=False)
class Wide:
    """Matches of some tracks that are possible beyond the gates, at a price (``_fusion``).

    Attributes:
        rows: (N,) True for these tracks.
        extra: (N, 4, 4) what is added to the covariances of their states.
        near: (N, M) True where such a match is possible.
        price: added to its cost.
    """

    rows: BoolArray
    extra: FloatArray
    near: BoolArray
    price: float

    def part(self, rows: IndexArray, measurements: IndexArray) -> Wide:
        """Return the part for some tracks and some measurements."""
        near = self.near[rows[:, None], measurements]
        return Wide(self.rows[rows], self.extra[rows], near, self.price)


@dataclass(frozen=True, slots=True, eq=False)
class _Edges:
    """The matches that pass both gates: rows of tracks and measurements, and their costs."""

    tracks: IndexArray
    measurements: IndexArray
    costs: FloatArray
    wide: BoolArray

    def where(self, mask: BoolArray) -> _Edges:
        return _Edges(self.tracks[mask], self.measurements[mask], self.costs[mask], self.wide[mask])


_NO_ROWS: IndexArray = np.empty(0, dtype=np.intp)
_NO_FLAGS: BoolArray = np.empty(0, dtype=np.bool_)
_NO_RIVALS: IndexArray = np.empty((0, 2), dtype=np.intp)
_NO_MATCHES = Matches(_NO_ROWS, _NO_ROWS, _NO_FLAGS, _NO_FLAGS, _NO_RIVALS)


def associate(
    positions_m: FloatArray,
    covariances_m2: FloatArray,
    confirmed: BoolArray,
    measured_m: FloatArray,
    noises_m2: FloatArray,
    gates: Gates,
    people: IndexArray | None = None,
    wide: Wide | None = None,
    sizes: Sized | None = None,
) -> Matches:
    """Match tracks to measurements one to one: confirmed tracks first, then the others.

    The cost d² + ln det S is twice the negative log-likelihood of the measurement. Without its
    second term a track that has coasted, and so has a wide S, would take its neighbour's
    measurements. Each of the two rounds chooses the matches with the least sum of costs, where an
    unmatched track costs ``miss_cost``. Without that, a person whom the frame missed would take the
    measurement of a neighbour, and the neighbour any clutter in reach.

    Args:
        positions_m: (N, 2) predicted positions.
        covariances_m2: (N, 2, 2) of the predicted positions.
        confirmed: (N,) True for the tracks of the first round.
        measured_m: (M, 2) measured positions, in the same frame.
        noises_m2: (M, 2, 2) of the measured positions, positive definite.
        gates: a match must pass both gates.
        people: (N,) equal for tracks of one person, which do not make each other ambiguous; None
            where every track is another person.
        wide: matches beyond the gates; None for none.
        sizes: the measurements as each track takes them; None where that is as they are.
    """
    if not len(positions_m) or not len(measured_m):
        return _NO_MATCHES
    edges = _edges(positions_m, covariances_m2, measured_m, noises_m2, gates, wide, sizes)
    if not edges.tracks.size:
        return _NO_MATCHES
    partner = np.full(len(positions_m), -1, dtype=np.intp)
    if confirmed.all():
        _solve(edges, gates.miss_cost, partner)
    else:
        first = confirmed[edges.tracks]
        _solve(edges.where(first), gates.miss_cost, partner)
        taken = np.zeros(len(measured_m), dtype=np.bool_)
        taken[partner[partner >= 0]] = True
        _solve(edges.where(~first & ~taken[edges.measurements]), gates.miss_cost, partner)
    tracks = np.flatnonzero(partner >= 0)
    measurements = partner[tracks]
    rivals = _rivals(edges, partner, positions_m, measured_m, gates, people)
    ambiguous = np.zeros(len(positions_m), dtype=np.bool_)
    ambiguous[rivals[:, 0]] = True
    beyond = np.zeros(len(positions_m), dtype=np.bool_)
    if wide is not None:
        chosen = edges.wide & (partner[edges.tracks] == edges.measurements)
        beyond[edges.tracks[chosen]] = True
    return Matches(tracks, measurements, ambiguous[tracks], beyond[tracks], rivals)


def _edges(
    positions_m: FloatArray,
    covariances_m2: FloatArray,
    measured_m: FloatArray,
    noises_m2: FloatArray,
    gates: Gates,
    wide: Wide | None,
    sizes: Sized | None,
) -> _Edges:
    """Return the matches that pass both gates, with their costs d² + ln det S."""
    places_m = measured_m[None] if sizes is None else sizes.positions_odom_m
    offsets_m = places_m - positions_m[:, None]
    near = np.square(offsets_m).sum(axis=-1) <= gates.distance_m**2
    flat = np.flatnonzero(near if wide is None else near | wide.near)
    tracks, measurements = np.divmod(flat, len(measured_m))
    offsets_m = offsets_m.reshape(-1, 2)[flat]
    spread = covariances_m2[tracks] + noises_m2[measurements]
    if sizes is not None:
        scale2 = sizes.scales[tracks, measurements] ** 2 - 1.0
        spread += scale2[:, None, None] * noises_m2[measurements]
        spread += sizes.extra[tracks, measurements]
    distance2, costs = _distance2_and_cost(offsets_m, spread)
    inside = distance2 <= gates.mahalanobis2
    beyond = np.zeros(len(flat), dtype=np.bool_)
    if wide is not None:
        inside &= near.ravel()[flat]
        rows = np.flatnonzero(wide.near.ravel()[flat])
        spread = spread[rows] + wide.extra[tracks[rows], :2, :2]
        distance2, dearer = _distance2_and_cost(offsets_m[rows], spread)
        dearer += wide.price
        possible = (distance2 <= gates.mahalanobis2) & ~inside[rows]
        costs[rows[possible]] = dearer[possible]
        beyond[rows[possible]] = inside[rows[possible]] = True
    edges = _Edges(tracks, measurements, costs, beyond)
    return edges if inside.all() else edges.where(inside)


def _distance2_and_cost(
    offsets_m: FloatArray, spread_m2: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return d² and d² + ln det S, (E,) each, of offsets (E, 2) with covariances S (E, 2, 2)."""
    distance2 = mahalanobis2(offsets_m, spread_m2)
    determinant = spread_m2[:, 0, 0] * spread_m2[:, 1, 1] - spread_m2[:, 0, 1] ** 2
    return distance2, np.asarray(distance2 + np.log(determinant))


def _solve(edges: _Edges, miss_cost: float, partner: IndexArray) -> None:
    """Write the best set of matches into ``partner``: the measurement of each track.

    A match whose track and measurement have no other match is part of every best set if it costs
    less than a miss. ``scipy.optimize.linear_sum_assignment`` decides among the others.
    """
    worth = edges.costs < miss_cost
    if not worth.all():
        edges = edges.where(worth)
    if not edges.tracks.size:
        return
    per_track = np.bincount(edges.tracks)
    per_measurement = np.bincount(edges.measurements)
    lone = (per_track[edges.tracks] == 1) & (per_measurement[edges.measurements] == 1)
    partner[edges.tracks[lone]] = edges.measurements[lone]
    if lone.all():
        return
    rivals = edges.where(~lone)
    per_track[edges.tracks[lone]] = per_measurement[edges.measurements[lone]] = 0
    rows, columns = np.flatnonzero(per_track), np.flatnonzero(per_measurement)
    costs = np.full((len(rows), len(columns)), miss_cost)
    costs[rows.searchsorted(rivals.tracks), columns.searchsorted(rivals.measurements)] = (
        rivals.costs
    )
    # SciPy takes a third of the package's import time, so it is imported when it is needed.
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415

    chosen_rows, chosen_columns = linear_sum_assignment(costs)
    real = costs[chosen_rows, chosen_columns] < miss_cost
    partner[rows[chosen_rows[real]]] = columns[chosen_columns[real]]


def _rivals(
    edges: _Edges,
    partner: IndexArray,
    positions_m: FloatArray,
    measured_m: FloatArray,
    gates: Gates,
    people: IndexArray | None,
) -> IndexArray:
    """Return :attr:`Matches.rivals`: a rival track or measurement fits about as well."""
    chosen = partner[edges.tracks] == edges.measurements
    if chosen.all():
        return _NO_RIVALS
    holder = np.full(len(measured_m), -1, dtype=np.intp)
    holder[edges.measurements[chosen]] = edges.tracks[chosen]
    limit = np.full(len(positions_m) + 1, -np.inf)  # the last row is that of no track
    limit[edges.tracks[chosen]] = edges.costs[chosen] + gates.ambiguity_margin
    rivals = ~chosen
    if people is not None:
        owner = holder[edges.measurements]
        rivals &= (owner < 0) | (people[edges.tracks] != people[owner])
    rival = edges.where(rivals)
    reach2 = gates.ambiguity_distance_m**2

    # Rival measurements: the track could have matched another measurement.
    offset = measured_m[rival.measurements] - measured_m[partner[rival.tracks]]
    fits = (rival.costs <= limit[rival.tracks]) & (_squares(offset) <= reach2)
    first = rival.tracks[fits], holder[rival.measurements[fits]]
    # Rival tracks: the measurement could have matched another track.
    owner = holder[rival.measurements]
    offset = positions_m[rival.tracks] - positions_m[owner]
    fits = (rival.costs <= limit[owner]) & (_squares(offset) <= reach2)
    second = owner[fits], rival.tracks[fits]
    return np.column_stack([np.concatenate(pair) for pair in zip(first, second, strict=True)])


def _squares(offsets: FloatArray) -> FloatArray:
    """Return the squared lengths of (N, 2)."""
    return np.asarray(offsets[:, 0] * offsets[:, 0] + offsets[:, 1] * offsets[:, 1])
