"""The table of frame rates: ours beside the simple tracker and norfair, from 1 to 30 Hz."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from awarenav.baseline import MeasuredValue

from ._contender import Contender, run
from ._judges import TrackingScores, judge
from ._measurements import SensorSettings, SimulatedRecording, record
from ._recorded import record_walks, recordings_in, walks_of

#: The simple tracker must not be better at any of these.
JUDGED_HZ = (2.0, 2.5, 5.0, 10.0, 20.0, 30.0)
RATES_HZ = (1.0, *JUDGED_HZ)
#: Simulated walkers: number of people and length of a recording.
WALKERS, WALKERS_S = 12, 25.0
_FIELDS = ("mota", "idf1", "hota")
#: Differences below this are chance: a tenth of a person for a tenth of the time.
_TOLERANCE = 0.005
#: Nor do differences below this many standard errors over the recordings count.
_STANDARD_ERRORS = 2.0
_SEED = 31
#: Recorded people are many; in a crowd of twelve one exchange of ids changes IDF1 by hundredths.
_RECORDED_SEEDS = 3


def rate_table(
    sets: Mapping[str, SensorSettings],
    makers: Mapping[str, Callable[[], Contender]],
    seeds: Sequence[int],
    folder: Path,
) -> tuple[list[MeasuredValue], list[str]]:
    """Print the table; return the figures of ours and where the simple tracker is better."""
    metrics: list[MeasuredValue] = []
    missed: list[str] = []
    if not recordings_in(folder):
        print(f"left out, recorded people: no CSV in {folder}", file=sys.stderr)
    print(f"\n{'people':10s}{'set':10s}{'Hz':>5s}  {'tracker':12s}{'MOTA':>8s}{'IDF1':>8s}", end="")
    print(f"{'HOTA':>8s}{'switches':>10s}")
    for source in ("recorded", "simulated"):
        for name, sensor in sets.items():
            for rate_hz in RATES_HZ:
                at_rate = replace(sensor, rate_hz=rate_hz)
                scores: dict[str, list[TrackingScores]] = {tracker: [] for tracker in makers}
                recordings = list(_recordings(source, at_rate, seeds, folder))
                for recording in tqdm(
                    recordings, f"{source}, {name}, {rate_hz:g} Hz", leave=False, file=sys.stderr
                ):
                    for tracker, make in makers.items():
                        scores[tracker].append(judge(recording.truth, run(make(), recording)))
                if not recordings:
                    continue
                found = {tracker: _means(runs) for tracker, runs in scores.items()}
                for tracker, (mota, idf1, hota, switches) in found.items():
                    print(
                        f"{source:10s}{name:10s}{rate_hz:5g}  {tracker:12s}{mota:8.3f}{idf1:8.3f}"
                        f"{hota:8.3f}{switches:10.1f}",
                        flush=True,
                    )
                where = f"{source}_{name}_{rate_hz:g}hz"
                if "ours" in found:
                    metrics += [
                        MeasuredValue(f"{where}_ours_{field}", value, "1", "higher", 0.03)
                        for field, value in zip(_FIELDS, found["ours"][:3], strict=True)
                    ]
                if rate_hz in JUDGED_HZ:
                    missed += _worse(where, scores)
    return metrics, missed


def _recordings(
    source: str, sensor: SensorSettings, seeds: Sequence[int], folder: Path
) -> Iterator[SimulatedRecording]:
    """Yield the recordings of one row: every file, or one crowd, for each seed."""
    for seed in seeds if source == "simulated" else seeds[:_RECORDED_SEEDS]:
        if source == "simulated":
            rng = np.random.default_rng([seed, _SEED])
            yield record(WALKERS, round(WALKERS_S * sensor.rate_hz), rng, sensor)
            continue
        for index, path in enumerate(recordings_in(folder)):
            yield record_walks(walks_of(path), np.random.default_rng([seed, index]), sensor)


def _means(scores: Sequence[TrackingScores]) -> tuple[float, float, float, float]:
    """Return the mean MOTA, IDF1, HOTA and number of switches."""
    mota, idf1, hota, switches = (
        float(np.mean([getattr(score, field) for score in scores]))
        for field in (*_FIELDS, "switches")
    )
    return mota, idf1, hota, switches


def _worse(where: str, scores: Mapping[str, Sequence[TrackingScores]]) -> list[str]:
    """Return a line for each figure of ours that the simple tracker surpasses.

    Both ran on the same recordings, so their differences tell more than their means.
    """
    lines = []
    for tracker in scores:
        if "ours" not in scores or not tracker.startswith("naive"):
            continue
        for field in _FIELDS:
            ours, theirs = (
                np.array([getattr(score, field) for score in scores[name]])
                for name in ("ours", tracker)
            )
            behind, error = (theirs - ours).mean(), 0.0
            if len(ours) > 1:
                error = (theirs - ours).std(ddof=1) / np.sqrt(len(ours))
            if behind > max(_TOLERANCE, _STANDARD_ERRORS * error):
                lines.append(
                    f"{where}: {field.upper()} {ours.mean():.3f}, the {tracker} tracker has "
                    f"{theirs.mean():.3f} ({behind:.3f} ± {error:.3f} more)"
                )
    return lines
