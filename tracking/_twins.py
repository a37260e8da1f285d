"""Twins: second tracks of one person, which a detector that reports people twice starts.

A track that is born beside another may be its twin or another person. The frames that show one of
the two alone, and which one, decide: a duplicate comes in few frames and never alone; a person
comes in most frames, at times alone. A sequential probability ratio test (Wald, 1945) adds up this
evidence. A twin stays in the table, so that it becomes a person again when the evidence turns, but
it is not reported.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception.arrays import FloatArray
from perception.matrices import mahalanobis2

from ._awareness_update import forgotten
from ._config import TrackerConfig
from ._measurement import Measurements
from ._table import BoolArray, IndexArray, TrackTable

# Share of the frames with a person in which a detector reports a duplicate as well.
_DUPLICATE_SHARE: Final = 0.33
# Share of frames in which a real person beside another is detected while not hidden, and how often
# people become hidden and visible again.
_PERSON_SHARE: Final = 0.65
_HIDING_HZ: Final = 0.4
_SHOWING_HZ: Final = 1.3
# Odds of a frame that shows the second one alone: a duplicate without its person, a person whose
# neighbour was missed.
_ALONE_IF_TWIN: Final = 0.01
_ALONE_IF_PERSON: Final = 0.1
# Chance per frame that two tracks of one person exchange their measurements.
_LOG_EXCHANGE: Final = math.log(0.02)
# Frames closer than this share their errors, and count in proportion.
_INDEPENDENT_S: Final = 0.05
# Bounds of the evidence: how soon it can turn.
_LEAST_LOGIT: Final = -5.0
_MOST_LOGIT: Final = 3.0  # above twin_logit
# The next twin of a person who has had one starts with its evidence, but at most this.
_MOST_PRIOR: Final = 2.5
# A track with this evidence chooses measurements after all others, and is not kept for long unseen.
_DOUBTED_LOGIT: Final = 2.5
# Two tracks are apart when they are further apart than a twin can be, by this many σ.
_APART_SIGMAS: Final = 3.0
_MOST_LOG_RATIO: Final = 20.0


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """K tracks that may be twins, and their hosts: rows of the table."""

    twins: IndexArray
    hosts: IndexArray


def with_twins(
    before: TrackTable,
    after: TrackTable,
    source: IndexArray,
    measured: Measurements,
    dt_s: float,
    config: TrackerConfig,
    followed: BoolArray | None = None,
) -> TrackTable:
    """Return the tracks after the evidence of one frame about who is whose twin.

    Args:
        before: N tracks, predicted to the frame.
        after: the same tracks with the frame's measurements.
        source: (N,) the row of each track's measurement, −1 for none.
        measured: the frame's measurements.
        dt_s: since the frame before; at 0, nothing changes.
        config: settings.
        followed: (N,) True for the tracks that the frame's sensor has seen lately. Its frames say
            nothing about the others. None for all.
    """
    pairs = _pairs(after)
    if followed is not None:
        known = followed[pairs.twins] & followed[pairs.hosts]
        pairs = _Pairs(pairs.twins[known], pairs.hosts[known])
    if not pairs.twins.size or dt_s <= 0.0:
        return after
    b, a = pairs.twins, pairs.hosts
    shows_b, shows_a = source[b] >= 0, source[a] >= 0
    visible = after.twin_visibilities.copy()
    gain, visible[b] = _evidence(before, pairs, shows_b, shows_a, source, measured, dt_s)
    logits = after.twin_logits.copy()
    weight = min(1.0, dt_s / _INDEPENDENT_S)
    mutual = after.host_ids[a] == after.ids[b]
    exchanged = np.where(mutual, logits[a] + _LOG_EXCHANGE, -np.inf)
    found = np.logaddexp(logits[b], exchanged) + weight * gain
    logits[b] = np.clip(found, _LEAST_LOGIT, config.twin_logit + _MOST_LOGIT)
    hosts, twins = after.host_ids.copy(), after.twins.copy()
    twins[b[logits[b] < 0.0]] = False
    # Only frames that show both tell how far apart they are.
    due = ~twins[b] & (logits[b] >= config.twin_logit) & after.confirmed[a]
    near = np.flatnonzero((shows_a & shows_b) | due)
    if near.size:
        distance_m, std_m = separations(after, b[near], a[near])
        due[near] &= distance_m <= config.twin_distance_m + std_m
        apart = distance_m > config.twin_distance_m + _APART_SIGMAS * std_m
        apart &= (shows_a & shows_b)[near]
        far = b[near[apart]]
        hosts[far], twins[far], logits[far] = 0, False, 0.0
    released = after.twins & ~twins
    after = after.replaced(
        host_ids=hosts, twin_logits=logits, twins=twins, twin_visibilities=visible
    )
    after = _as_strangers(after, released, config)
    return _merged(after, pairs, due) if due.any() else after


def doubted(tracks: TrackTable) -> BoolArray:
    """Return (N,) True for the tracks that are more probably twins than people.

    Of two tracks that may be twins of each other it is one at most: somebody is there.
    """
    flags = tracks.twin_logits > _DOUBTED_LOGIT
    if not flags.any():
        return flags
    pairs = _pairs(tracks)
    b, a = pairs.twins, pairs.hosts
    mine, other = tracks.twin_logits[b], tracks.twin_logits[a]
    surer = (mine > other) | ((mine == other) & (b > a))
    mutual = tracks.host_ids[a] == tracks.ids[b]
    flags[b] &= tracks.twins[b] | (~tracks.twins[a] & (surer | ~mutual))
    return flags


def _evidence(
    tracks: TrackTable,
    pairs: _Pairs,
    shows_twin: BoolArray,
    shows_host: BoolArray,
    source: IndexArray,
    measured: Measurements,
    dt_s: float,
) -> tuple[FloatArray, FloatArray]:
    """Return (K,) log-likelihood ratios of a frame, of a twin to a person, and visibilities.

    The visibility is the probability that the person is not hidden, if it is one: a hidden Markov
    model with two states. A single measurement counts for the one whose place it fits. Frames that
    show neither do not count, since both may be hidden together.
    """
    visible = tracks.twin_visibilities[pairs.twins]
    hides, shows = -math.expm1(-_HIDING_HZ * dt_s), -math.expm1(-_SHOWING_HZ * dt_s)
    visible = visible * (1.0 - hides) + (1.0 - visible) * shows
    detected = _PERSON_SHARE * visible
    gain = np.zeros(len(visible))
    both, single = shows_twin & shows_host, shows_twin != shows_host
    gain[both] = np.log(_DUPLICATE_SHARE / detected[both])
    if single.any():
        first, second = pairs.twins[single], pairs.hosts[single]
        rows = np.maximum(source[first], source[second])
        ratio = np.exp(_log_ratio(tracks, first, second, measured, rows))
        person = detected[single]
        missed = (1.0 - _PERSON_SHARE) * visible[single]
        alone = person * _ALONE_IF_PERSON * ratio
        if_person = 1.0 - person + alone
        gain[single] = np.log(1.0 - _DUPLICATE_SHARE + _ALONE_IF_TWIN * ratio) - np.log(if_person)
        visible[single] = (missed + alone) / if_person
    visible[both] = 1.0
    return gain, visible


def _merged(tracks: TrackTable, pairs: _Pairs, due: BoolArray) -> TrackTable:
    """Return the tracks after those of the pairs that are ``due`` (K,) have become twins.

    The host of a new twin takes the lower awareness of both. A track that had the twin for a host
    has its host instead.
    """
    ids = tracks.ids
    hosts, twins = tracks.host_ids.copy(), tracks.twins.copy()
    priors = tracks.twin_priors.copy()
    means, variances = tracks.awareness_means.copy(), tracks.awareness_variances.copy()
    bounds, stamps = tracks.awareness_bounds.copy(), tracks.evidence_stamps_s.copy()
    looked_s = tracks.looked_s.copy()
    # The surest first; of two that may be twins of each other, the younger.
    order = np.flatnonzero(due)
    order = order[np.lexsort((-pairs.twins[order], -tracks.twin_logits[pairs.twins[order]]))]
    for index in order.tolist():
        twin, host = int(pairs.twins[index]), int(pairs.hosts[index])
        if twins[twin] or twins[host]:
            continue
        twins[twin], priors[host] = True, _MOST_PRIOR
        looked_s[host] = min(looked_s[host], looked_s[twin])
        hosts[(hosts == ids[twin]) & (ids != ids[host])] = ids[host]
        if (bounds[twin], means[twin]) < (bounds[host], means[host]):
            means[host], variances[host] = means[twin], variances[twin]
            bounds[host], stamps[host] = bounds[twin], stamps[twin]
    return tracks.replaced(
        host_ids=hosts,
        twins=twins,
        twin_priors=priors,
        awareness_means=means,
        awareness_variances=variances,
        awareness_bounds=bounds,
        evidence_stamps_s=stamps,
        looked_s=looked_s,
    )


def with_hosts(tracks: TrackTable, births: int, config: TrackerConfig) -> TrackTable:
    """Return the tracks after the last ``births`` of them have got the hosts that they may have.

    A new track beside another may be its twin. The other may as well be the twin of the new one:
    the first frame with two boxes does not show which one lasts.
    """
    count = len(tracks)
    if not births or count < 2:
        return tracks
    new = np.arange(count - births, count)
    offset = tracks.states[new, None, :2] - tracks.states[None, :, :2]
    distance2 = offset[..., 0] ** 2 + offset[..., 1] ** 2
    distance2[:, tracks.twins] = np.inf
    # A track has the older ones to choose from.
    distance2[np.arange(count) >= new[:, None]] = np.inf
    nearest = distance2.argmin(axis=1)
    distance_m, std_m = separations(tracks, new, nearest)
    near = distance_m <= config.twin_distance_m + _APART_SIGMAS * std_m
    near &= np.isfinite(distance2[np.arange(births), nearest])
    if config.twin_distance_m <= 0.0 or not near.any():
        return tracks
    hosts = tracks.host_ids.copy()
    new, nearest = new[near], nearest[near]
    hosts[new] = tracks.ids[nearest]
    lone = hosts[nearest] == 0
    hosts[nearest[lone]] = tracks.ids[new[lone]]
    logits = tracks.twin_logits.copy()
    logits[new] = tracks.twin_priors[nearest]
    return tracks.replaced(host_ids=hosts, twin_logits=logits)


def _as_strangers(tracks: TrackTable, released: BoolArray, config: TrackerConfig) -> TrackTable:
    """Return the tracks after those ``released`` (N,) have ceased to be twins: as unaware people.

    The faces in the two boxes may have been those of either person.
    """
    if not released.any():
        return tracks
    tracks = forgotten(tracks, released, config.awareness)
    return tracks.replaced(looked_s=np.where(released, 0.0, tracks.looked_s))


def without(tracks: TrackTable, deleted: BoolArray, config: TrackerConfig) -> TrackTable:
    """Return the tracks that are not ``deleted`` (N,).

    A twin goes with its host, unless it was seen later; then it is the person from now on.
    """
    if not deleted.any():
        return tracks
    pairs = _pairs(tracks)
    b, a = pairs.twins, pairs.hosts
    lost = deleted[b] & tracks.confirmed[b]
    if lost.any():
        priors = tracks.twin_priors.copy()
        priors[a[lost]] = np.clip(tracks.twin_logits[b[lost]], 0.0, _MOST_PRIOR)
        tracks = tracks.replaced(twin_priors=priors)
    orphans = deleted[a]
    if orphans.any():
        b, a = b[orphans], a[orphans]
        last_seen_s = tracks.last_seen_s
        deleted = deleted.copy()
        deleted[b] |= tracks.twins[b] & (last_seen_s[b] <= last_seen_s[a])
        hosts, logits, twins = (
            tracks.host_ids.copy(),
            tracks.twin_logits.copy(),
            tracks.twins.copy(),
        )
        hosts[b], logits[b], twins[b] = 0, 0.0, False
        released = tracks.twins & ~twins
        tracks = tracks.replaced(host_ids=hosts, twin_logits=logits, twins=twins)
        tracks = _as_strangers(tracks, released, config)
    return tracks.take(~deleted)


def with_lower_evidence(
    tracks: TrackTable, seen: BoolArray, means: FloatArray, variances: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the evidence of awareness of each track: a host gets the lower of both.

    Args:
        tracks: N tracks.
        seen: (N,) True for tracks that the frame shows.
        means: (N,) of logit(α), NaN for no evidence.
        variances: (N,) of logit(α).
    """
    rows = np.flatnonzero(tracks.twins & seen)
    if not rows.size:
        return means, variances
    pairs = _pairs(tracks)
    means, variances = means.copy(), variances.copy()
    for twin, host in zip(pairs.twins.tolist(), pairs.hosts.tolist(), strict=True):
        if tracks.twins[twin] and seen[twin] and means[twin] < means[host]:
            means[host], variances[host] = means[twin], variances[twin]
    return means, variances


def same_person(tracks: TrackTable) -> IndexArray | None:
    """Return (N,) the row of the person of each track: of its host for a twin, else its own.

    None if there are no twins.
    """
    if not tracks.twins.any():
        return None
    rows = np.arange(len(tracks))
    pairs = _pairs(tracks)
    hidden = tracks.twins[pairs.twins]
    rows[pairs.twins[hidden]] = pairs.hosts[hidden]
    return rows


def reported(tracks: TrackTable) -> BoolArray:
    """Return (N,) True for the tracks that are people of their own."""
    if not tracks.twins.any():
        return np.ones(len(tracks), dtype=np.bool_)
    return ~tracks.twins | ~np.isin(tracks.host_ids, tracks.ids)


def separations(
    tracks: TrackTable, first: IndexArray, second: IndexArray
) -> tuple[FloatArray, FloatArray]:
    """Return (K,) distances of pairs of tracks and their standard deviations, in metres."""
    offset = tracks.states[first, :2] - tracks.states[second, :2]
    spread = tracks.covariances[first, :2, :2] + tracks.covariances[second, :2, :2]
    distance = np.hypot(offset[:, 0], offset[:, 1])
    unit = offset / np.maximum(distance, 1e-9)[:, None]
    variance = (unit[:, None, :] @ spread @ unit[:, :, None])[:, 0, 0]
    return distance, np.sqrt(np.maximum(variance, 0.0))


def _pairs(tracks: TrackTable) -> _Pairs:
    """Return the tracks that have a host."""
    rows = np.flatnonzero(tracks.host_ids)
    return _Pairs(rows, np.searchsorted(tracks.ids, tracks.host_ids[rows]))


def _log_ratio(
    tracks: TrackTable,
    first: IndexArray,
    second: IndexArray,
    measured: Measurements,
    rows: IndexArray,
) -> FloatArray:
    """Return (K,) log-likelihood ratios of measurements: of the first track to the second."""

    def log_likelihood(track_rows: IndexArray) -> FloatArray:
        spread = tracks.covariances[track_rows, :2, :2] + measured.noises_m2[rows]
        offset = measured.positions_odom_m[rows] - tracks.states[track_rows, :2]
        determinant = spread[:, 0, 0] * spread[:, 1, 1] - spread[:, 0, 1] ** 2
        return np.asarray(-0.5 * (mahalanobis2(offset, spread) + np.log(determinant)))

    found = log_likelihood(first) - log_likelihood(second)
    return np.clip(found, -_MOST_LOG_RATIO, _MOST_LOG_RATIO)
