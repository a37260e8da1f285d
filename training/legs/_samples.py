"""Hypotheses of labelled scans, as the samples of the training."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray
from perception.laser import clusters_of, hypotheses_of

from ._scenes import LabelledScan

# A cluster belongs to a person who returned at least this share of its points.
_SHARE: Final = 0.7
# Somebody who sits may share the cluster with the seat, with at least this share of its points.
_BESIDE_SEAT_SHARE: Final = 0.25


class Samples(NamedTuple):
    """S hypotheses.

    Attributes:
        features: (S, 79) float32.
        person: (S,) 1.0 for a person, 0.0 for none.
        offset_m: (S, 2) from the middle of the clusters to the person, away from the scanner and to
            its left; 0 without.
    """

    features: NDArray[np.float32]
    person: FloatArray
    offset_m: FloatArray


def samples_of(scans: Iterable[LabelledScan]) -> Samples:
    """Return the hypotheses of all scans with their labels."""
    features, persons, offsets = [], [], []
    for scan in scans:
        points = scan.points
        usable = points.usable
        xy = points.points_odom_m[:, :2]
        increment = points.angle_increment_rad
        origin = points.origins_odom_m[len(usable) // 2, :2]
        clusters = clusters_of(xy, points.ranges_m, usable, origin, increment, scan.noise_m)
        found = hypotheses_of(clusters, xy, points.ranges_m, increment)
        owner = np.full(len(clusters.starts), -1)
        for person in range(len(scan.people_m)):
            met = scan.person[clusters.rays]
            body = clusters.sums((met == person).astype(float))
            seated = body + clusters.sums((met == -2 - person).astype(float))
            enough = seated >= _SHARE * clusters.counts
            owner[enough & (body >= _BESIDE_SEAT_SHARE * clusters.counts)] = person
        one = owner[found.first]
        other = np.where(found.second >= 0, owner[found.second], one)
        label = (one >= 0) & (one == other)
        away = scan.people_m[np.maximum(one, 0)] - found.centres_m
        left = np.column_stack((-found.rays[:, 1], found.rays[:, 0]))
        offset = np.column_stack(((away * found.rays).sum(axis=1), (away * left).sum(axis=1)))
        features.append(found.features)
        persons.append(label.astype(float))
        offsets.append(np.where(label[:, None], offset, 0.0))
    return Samples(np.concatenate(features), np.concatenate(persons), np.concatenate(offsets))
