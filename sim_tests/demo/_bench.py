"""The speed of crossings, compared with real time and with bare physics in the same run."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Final

from tqdm import tqdm

from awarenav.baseline import MeasuredValue, comparison_text, read_baseline, write_baseline
from awarenav.files import json_text

from ..crossing import run_crossing
from ..scenario import Scenario
from ..world import Warehouse
from ..world.hall import WarehouseLayout

#: Goals on an otherwise idle computer: keypoints on one core, pixels with networks on two.
GOALS: Final = {
    "crossing_keypoints_real_time_factor": 15.0,
    "crossing_pixels_real_time_factor": 1.0,
}


# Figure, crossings and perception that it times.
_TIMED: Final = (
    ("crossing_truth", ("crossing_attentive", "crossing_distracted"), "truth"),
    ("encounter_60hz_truth", ("paper_encounter",), "truth"),
    ("crossing_keypoints", ("crossing_attentive", "crossing_distracted"), "keypoints"),
    ("crowd_of_eight_keypoints", ("crowd_of_eight",), "keypoints"),
    ("crossing_pixels", ("crossing_attentive",), "pixels"),
)


def measure(repeats: int = 3) -> tuple[MeasuredValue, ...]:
    """Time crossings on this machine; the best of ``repeats`` counts, since other load only slows.

    The reference runs in the same process: PyBullet stepping the empty hall, faster than any
    crossing.
    """
    physics = min(_time_bare_physics() for _ in range(repeats))
    figures = []
    for name, scenarios, perception in tqdm(
        _TIMED, desc="bench", unit="figure", leave=False, file=sys.stderr
    ):
        runs = [_time_runs(scenarios, perception) for _ in range(repeats)]
        simulated_s, wall_s = min(runs, key=lambda run: run[1])
        # The speed depends on the machine; the wide tolerance only detects large changes.
        factor = simulated_s / wall_s
        figures.append(
            MeasuredValue(f"{name}_real_time_factor", factor, "x real time", "higher", 0.6)
        )
        if name in ("crossing_truth", "crossing_keypoints"):
            cost = 1.0 / factor / physics
            figures.append(MeasuredValue(f"{name}_cost_over_bare_physics", cost, "x", "lower", 0.5))
    return tuple(figures)


def _time_bare_physics() -> float:
    """Return the wall seconds per simulated second of the empty hall."""
    with Warehouse(WarehouseLayout.named("crossing")) as warehouse:
        steps = round(5.0 / warehouse.physics_dt_s)
        start = time.perf_counter()
        for _ in range(steps):
            warehouse.step()
        return (time.perf_counter() - start) / 5.0


def _time_runs(names: Iterable[str], perception: str) -> tuple[float, float]:
    """Return simulated and wall seconds of the named crossings, with the loading of the world."""
    simulated = 0.0
    start = time.perf_counter()
    for name in names:
        result = run_crossing(Scenario.shipped(name), policy="balanced", perception=perception)
        simulated += result.duration_s
    return simulated, time.perf_counter() - start


def bench_command(baseline_path: Path, out: Path | None, *, as_json: bool = False) -> int:
    """Measure, print the figures beside the baseline, and return the exit status.

    Raises:
        AwarenavError: for a baseline that cannot be read, and a file that cannot be written.
    """
    baseline = read_baseline(baseline_path) if baseline_path.exists() else {}
    metrics = measure()
    text, good = comparison_text(metrics, baseline, GOALS)
    print(json_text([asdict(metric) for metric in metrics]) if as_json else text)
    if out is not None:
        write_baseline(out, metrics)
    return 0 if good else 1
