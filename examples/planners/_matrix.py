"""Planner × scenario × seed, one line of JSON for each crossing; a stopped run continues."""

from __future__ import annotations

import itertools
import json
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from sim_tests import LocalPlanner, Scenario, ScenarioTemplate, run_crossing

Maker = Callable[[Scenario, int], LocalPlanner]


def run_matrix(
    makers: dict[str, Maker], scenarios: Sequence[str], seeds: Iterable[int], log: Path
) -> list[dict[str, Any]]:
    """Run every crossing that the log does not hold yet; return all that were asked for."""
    wanted = list(itertools.product(seeds, scenarios, makers))
    done = {(row["seed"], row["scenario"], row["planner"]): row for row in _read(log)}
    for key in wanted:
        if key in done:
            continue
        seed, scenario, planner = key
        done[key] = _crossing(planner, makers[planner], scenario, seed)
        with log.open("a", encoding="utf-8") as file:
            file.write(json.dumps(done[key]) + "\n")
    return [done[key] for key in wanted]


def _read(log: Path) -> list[dict[str, Any]]:
    if not log.exists():
        return []
    return [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines() if line]


def _crossing(planner: str, make: Maker, name: str, seed: int) -> dict[str, Any]:
    scenario = ScenarioTemplate.shipped(name).for_seed(seed)
    began = time.perf_counter()
    result = run_crossing(scenario, policy="balanced", planner=make(scenario, seed), seed=seed)
    reach_m = result.robot.circumscribed_radius_m
    # A command takes effect in the next cycle, and no robot brakes harder than it can.
    excess = [
        abs(after.robot_state.speed_mps)
        + abs(after.robot_state.yaw_rate_radps) * reach_m
        - max(
            before.constraints.fastest_point_limit_mps,
            abs(before.robot_state.speed_mps)
            + abs(before.robot_state.yaw_rate_radps) * reach_m
            - result.robot.max_deceleration_mps2 * (after.t_s - before.t_s),
        )
        for before, after in itertools.pairwise(result.frames)
    ]
    return {
        "planner": planner,
        "scenario": name,
        "seed": seed,
        "time_s": result.time_to_goal_s,
        "contact": result.contact_by,
        "min_margin_m": result.min_margin_m,
        "violation_s": result.violation_time_s,
        "separation_m": result.min_separation_m,
        "excess_mps": float(np.max(excess)),
        "took_s": round(time.perf_counter() - began, 2),
    }


def table(rows: list[dict[str, Any]]) -> str:
    """Return a Markdown table with one row per planner and scenario."""
    lines = [
        "| planner | scenario | arrived | median time, s | negative margin | least margin, m "
        "| contacts | fastest point above the limit, m/s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["scenario"], row["planner"]), []).append(row)
    for (scenario, planner), group in sorted(groups.items()):
        times = [row["time_s"] for row in group if row["time_s"] is not None]
        middle = f"{median(times):.1f}" if times else "–"
        margins = [row["min_margin_m"] for row in group]
        lines.append(
            f"| {planner} | {scenario} | {len(times)} of {len(group)} | {middle} "
            f"| {sum(margin < 0.0 for margin in margins)} | {min(margins):.2f} "
            f"| {sum(bool(row['contact']) for row in group)} "
            f"| {max(row['excess_mps'] for row in group):.2f} |"
        )
    return "\n".join(lines)
