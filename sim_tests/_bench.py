"""Measures how fast crossings run, against real time and against bare physics in the same run."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, Literal

from tqdm import tqdm

from ._crossing import run_crossing
from ._errors import SimError
from ._scenario import Scenario
from ._warehouse import Warehouse
from .hall._layout import WarehouseLayout

Direction = Literal["higher", "lower"]

#: What the project asks of a quiet computer: keypoints on one core, pixels with networks on two.
GOALS: Final = {
    "crossing_keypoints_real_time_factor": 15.0,
    "crossing_pixels_real_time_factor": 1.0,
}


@dataclass(frozen=True, slots=True)
class Metric:
    """One measured figure.

    Attributes:
        name: unique in a baseline.
        value: measured.
        unit: of the value.
        direction: which way is better.
        tolerance: relative worsening against the baseline that still counts as equal.
    """

    name: str
    value: float
    unit: str
    direction: Direction
    tolerance: float

    def is_worse_than(self, baseline: Metric) -> bool:
        """True when the value is worse than the baseline by more than its tolerance."""
        if baseline.direction == "higher":
            return self.value < baseline.value * (1.0 - baseline.tolerance)
        return self.value > baseline.value * (1.0 + baseline.tolerance)


def measure(repeats: int = 3) -> tuple[Metric, ...]:
    """Time crossings on this machine; the best of ``repeats`` counts, since noise only slows.

    A peer runs in the same process: PyBullet stepping the empty hall, which no crossing can beat.
    """
    names = ("crossing_attentive", "crossing_distracted")
    with tqdm(total=6, desc="bench", unit="figure", leave=False, file=sys.stderr) as bar:

        def best(names: tuple[str, ...], perception: str) -> tuple[float, float]:
            runs = [_time_runs(names, perception) for _ in range(repeats)]
            bar.update()
            return min(runs, key=lambda run: run[1])

        physics = min(_time_bare_physics() for _ in range(repeats))
        bar.update()
        truth = best(names, "truth")
        encounter = best(("paper_encounter",), "truth")
        keypoints = best(names, "keypoints")
        crowd = best(("crowd_of_eight",), "keypoints")
        pixels = best(("crossing_attentive",), "pixels")
    return (
        _factor("crossing_truth_real_time_factor", truth),
        Metric(
            "crossing_truth_cost_over_bare_physics",
            truth[1] / truth[0] / physics,
            "x",
            "lower",
            0.5,
        ),
        _factor("encounter_60hz_truth_real_time_factor", encounter),
        _factor("crossing_keypoints_real_time_factor", keypoints),
        Metric(
            "crossing_keypoints_cost_over_bare_physics",
            keypoints[1] / keypoints[0] / physics,
            "x",
            "lower",
            0.5,
        ),
        _factor("crowd_of_eight_keypoints_real_time_factor", crowd),
        _factor("crossing_pixels_real_time_factor", pixels),
    )


def _factor(name: str, run: tuple[float, float]) -> Metric:
    # A bare speed depends on the machine; the wide tolerance only catches a change of kind.
    return Metric(name, run[0] / run[1], "x real time", "higher", 0.6)


def _time_bare_physics() -> float:
    """Wall seconds a simulated second for the empty hall."""
    with Warehouse(WarehouseLayout.crossing()) as warehouse:
        steps = round(5.0 / warehouse.physics_dt_s)
        start = time.perf_counter()
        for _ in range(steps):
            warehouse.step()
        return (time.perf_counter() - start) / 5.0


def _time_runs(names: Iterable[str], perception: str) -> tuple[float, float]:
    """Simulated and wall seconds of the named crossings, loading the world included."""
    simulated = 0.0
    start = time.perf_counter()
    for name in names:
        result = run_crossing(Scenario.shipped(name), policy="balanced", perception=perception)
        simulated += result.duration_s
    return simulated, time.perf_counter() - start


def write_baseline(path: Path, metrics: Iterable[Metric]) -> None:
    """Write metrics as a baseline; the file appears whole or not at all."""
    partial = path.with_name(path.name + ".part")
    text = json.dumps({"metrics": [asdict(metric) for metric in metrics]}, indent=2)
    partial.write_text(text + "\n", encoding="utf-8")
    partial.replace(path)


def read_baseline(path: Path) -> dict[str, Metric]:
    """Read a baseline by metric name; raises SimError for a file that is not one."""
    try:
        entries = json.loads(path.read_text(encoding="utf-8"))["metrics"]
        return {entry["name"]: Metric(**entry) for entry in entries}
    except OSError as cause:
        raise SimError(f"cannot read the baseline {path}: {cause.strerror or cause}") from cause
    except (ValueError, KeyError, TypeError) as cause:
        raise SimError(
            f"{path} is not a baseline: it must hold a list 'metrics' of name, value, unit, "
            f"direction and tolerance ({cause})"
        ) from cause


def report(metrics: Iterable[Metric], baseline: dict[str, Metric]) -> tuple[str, bool]:
    """The metrics as text beside the baseline, and whether none is worse than it.

    Goals are printed too; a busy or slow computer that misses one fails nothing.
    """
    lines = [f"{'metric':42s}{'now':>10s}{'baseline':>10s}  unit"]
    good = True
    for metric in metrics:
        known = baseline.get(metric.name)
        verdict = ""
        if known is not None and metric.is_worse_than(known):
            verdict, good = "   WORSE", False
        before = "-" if known is None else f"{known.value:.1f}"
        goal = GOALS.get(metric.name)
        if goal is not None:
            verdict = f"   goal {goal:g}{'' if metric.value >= goal else ' NOT REACHED'}{verdict}"
        lines.append(f"{metric.name:42s}{metric.value:10.1f}{before:>10s}  {metric.unit}{verdict}")
    return "\n".join(lines), good
