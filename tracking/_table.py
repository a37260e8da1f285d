"""All tracks at one instant as arrays, one row per track."""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

IntArray = NDArray[np.int64]
IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class TrackTable:
    """The tracks in the order of their ids. The arrays are never written to once they are in here.

    Attributes:
        ids: (N,) increasing.
        states: (N, 4) x, y, vx, vy in odom, metres and metres per second.
        covariances: (N, 4, 4) of the states.
        awareness_means: (N,) of logit(α).
        awareness_variances: (N,) of logit(α).
        awareness_bounds: (N,) remembered lower bound of logit(α); −∞ before the first evidence.
        evidence_stamps_s: (N,) of the latest evidence of awareness that was used; NaN for none.
        hit_stamps_s: (N, confirm_hits) stamps of the latest frames that showed the person, oldest
            first; −∞ where there were fewer.
        confirmed: (N,) whether enough frames have shown the person.
        standing: (N,) whether the person stood still when last seen.
        seen_stamps_s: (N, S) stamps of the latest frames of each sensor that showed the person; −∞
            for none. The latest of them ends ``hit_stamps_s``.
        missed_s: (N, S) time since each sensor last saw the person in which its frames should have
            shown them.
        passed_stamps_s: (N, S) stamp of each sensor's latest frame if it has shown the person's
            place empty (:class:`~tracking.RangedView`); −∞ if it has not.
        existence_logits: (N,) log-likelihood ratio of a person to clutter, of the detections after
            the first; 0 at the first.
        birth_stamps_s: (N,) stamps of the first frames that showed the people.
        birth_places_camera_m: (N, 2) where they were then, relative to the sensor (``_exits``).
        last_places_camera_m: (N, 2) the same for the latest frames of the camera that showed them.
        host_ids: (N,) ids of the tracks whose twins these may be, 0 for none (``_twins``).
        twin_logits: (N,) evidence that they are.
        twin_visibilities: (N,) probability that they are not hidden, if they are people.
        twin_priors: (N,) evidence with which the next possible twin of this track starts.
        twins: (N,) True where the evidence has sufficed; such a track is not reported.
        looked_s: (N,) for how long the person has looked at the robot lately (``_noticed``).
        look_stamps_s: (N,) of the latest look; NaN for none.
        look_velocities_mps: (N, 2) velocity at that time.
        look_speeds_mps: (N,) least speed since then.
        look_standing: (N,) whether the person has stood since then.
        averted_s: (N,) for how long frames since then have shown a face that looks away.
        lasting_stds: (N,) relative standard deviation of the range from the camera that lasts; it
            is not in ``covariances`` (``_sizes``).
        size_logs: (N,) ln of the range at which an adult would look as large, over the range.
        size_variances: (N,) of it; ∞ where nothing is known of the person's size.
    """

    ids: IntArray
    states: FloatArray
    covariances: FloatArray
    awareness_means: FloatArray
    awareness_variances: FloatArray
    awareness_bounds: FloatArray
    evidence_stamps_s: FloatArray
    hit_stamps_s: FloatArray
    confirmed: BoolArray
    standing: BoolArray
    seen_stamps_s: FloatArray
    missed_s: FloatArray
    passed_stamps_s: FloatArray
    existence_logits: FloatArray
    birth_stamps_s: FloatArray
    birth_places_camera_m: FloatArray
    last_places_camera_m: FloatArray
    host_ids: IntArray
    twin_logits: FloatArray
    twin_visibilities: FloatArray
    twin_priors: FloatArray
    twins: BoolArray
    looked_s: FloatArray
    look_stamps_s: FloatArray
    look_velocities_mps: FloatArray
    look_speeds_mps: FloatArray
    look_standing: BoolArray
    averted_s: FloatArray
    lasting_stds: FloatArray
    size_logs: FloatArray
    size_variances: FloatArray

    @staticmethod
    def empty(confirm_hits: int, sensors: int = 1) -> TrackTable:
        """Return a table without tracks, for this number of sensors."""
        no_numbers = np.empty(0)
        no_flags = np.empty(0, dtype=np.bool_)
        return TrackTable(
            ids=np.empty(0, dtype=np.int64),
            states=np.empty((0, 4)),
            covariances=np.empty((0, 4, 4)),
            awareness_means=no_numbers,
            awareness_variances=no_numbers,
            awareness_bounds=no_numbers,
            evidence_stamps_s=no_numbers,
            hit_stamps_s=np.empty((0, confirm_hits)),
            confirmed=no_flags,
            standing=no_flags,
            seen_stamps_s=np.empty((0, sensors)),
            missed_s=np.empty((0, sensors)),
            passed_stamps_s=np.empty((0, sensors)),
            existence_logits=no_numbers,
            birth_stamps_s=no_numbers,
            birth_places_camera_m=np.empty((0, 2)),
            last_places_camera_m=np.empty((0, 2)),
            host_ids=np.empty(0, dtype=np.int64),
            twin_logits=no_numbers,
            twin_visibilities=no_numbers,
            twin_priors=no_numbers,
            twins=no_flags,
            looked_s=no_numbers,
            look_stamps_s=no_numbers,
            look_velocities_mps=np.empty((0, 2)),
            look_speeds_mps=no_numbers,
            look_standing=no_flags,
            averted_s=no_numbers,
            lasting_stds=no_numbers,
            size_logs=no_numbers,
            size_variances=no_numbers,
        )

    @property
    def last_seen_s(self) -> FloatArray:
        """(N,) stamp of the latest frame that showed each person."""
        return self.hit_stamps_s[:, -1]

    def __len__(self) -> int:
        return len(self.ids)

    def take(self, keep: BoolArray) -> TrackTable:
        """Return the tracks where ``keep`` (N,) is True."""
        if keep.all():
            return self
        return TrackTable(*(column[keep] for column in _COLUMNS_OF(self)))

    def replaced(self, **columns: NDArray[Any]) -> TrackTable:
        """Return the table with other columns; takes half the time of ``dataclasses.replace``."""
        values = list(_COLUMNS_OF(self))
        for name, column in columns.items():
            values[_INDEX[name]] = column
        return TrackTable(*values)

    def append(self, other: TrackTable) -> TrackTable:
        """Return these tracks followed by the others, whose ids must be higher."""
        if not len(self):
            return other
        if not len(other):
            return self
        return TrackTable(
            *map(np.concatenate, zip(_COLUMNS_OF(self), _COLUMNS_OF(other), strict=True))
        )


_COLUMNS = tuple(TrackTable.__slots__)
_COLUMNS_OF = attrgetter(*_COLUMNS)
_INDEX = {name: index for index, name in enumerate(_COLUMNS)}
