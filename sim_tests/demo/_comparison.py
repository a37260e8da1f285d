"""One crossing with and without awareness: its runs, its table and its ``episodes.csv``."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from tqdm import tqdm

from awarenav.files import csv_number, write_csv
from perception.arrays import ImageRgb

from ..conditions import Perception, changed_scenario
from ..crossing import CrossingFrame, CrossingResult, run_crossing
from ..scenario import Scenario, ScenarioTemplate
from ..world.errors import SimError
from ._portraits import PortraitRecorder

#: Policies that ignore awareness: α says nothing about what the robot does.
WITHOUT_AWARENESS: Final = ("blind", "scanner")
#: Attributes of :class:`~sim_tests.CrossingResult` in the columns of ``episodes.csv``.
EPISODE_COLUMNS: Final = (
    *("scenario", "seed", "policy", "planner", "perception", "success", "contact", "contact_by"),
    *("min_separation_m", "time_to_goal_s", "max_speed_within_2m_mps", "min_margin_m"),
    *("violation_time_s", "contacts", "duration_s"),
)


@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """One row of the comparison.

    Attributes:
        label: of the row.
        result: the crossing.
        scenario: its scenario.
        portraits: the worker in the robot's camera, one for each picture of the film, None where
            the camera does not show the worker; empty without a camera or a film.
    """

    label: str
    result: CrossingResult
    scenario: Scenario
    portraits: tuple[ImageRgb | None, ...] = ()


def compare_policies(
    seed: int = 0,
    perception: str = "keypoints",
    *,
    filmed: bool = False,
    **axes: str,
) -> tuple[ComparisonRow, ...]:
    """Run the same crossing without people, as today, blind, and aware with two kinds of worker.

    Only the gaze and the robot's policy differ. A scripted worker walks the same path in every run;
    a recorded one begins the same, and then answers to the robot. The robot has a camera and laser
    scanners; today's robot has the scanners alone. Shows a progress bar on a terminal.

    Args:
        seed: seed of everything random.
        perception: ``"keypoints"`` or ``"pixels"``.
        filmed: whether to take the worker's portraits for the film.
        axes: other conditions that change the crossings, as for ``run_crossing``: ``robot`` and
            ``population``; empty ones keep the scenario's own.

    Raises:
        SimError: an unknown robot or population.
    """
    attentive, distracted = compared_scenarios(axes)
    both = Perception.of(perception, "camera+scanner").name
    alone = Perception.of(perception, "scanner").name
    runs = (
        ("nobody there", attentive.without_people(), "balanced", both),
        ("today's AMR", attentive, "scanner", alone),
        ("awareness-blind", attentive, "blind", both),
        ("aware, attentive worker", attentive, "balanced", both),
        ("aware, distracted worker", distracted, "balanced", both),
    )
    rows = []
    for label, scenario, policy, senses in tqdm(
        runs, desc="crossings", unit="run", disable=None, file=sys.stderr
    ):
        portraits = PortraitRecorder(scenario) if filmed and policy == "balanced" else None
        result = run_crossing(
            scenario, policy=policy, perception=senses, seed=seed, observer=portraits
        )
        rows.append(
            ComparisonRow(label, result, scenario, portraits.portraits if portraits else ())
        )
    return tuple(rows)


def compared_scenarios(axes: Mapping[str, str]) -> tuple[Scenario, Scenario]:
    """Return the crossings with an attentive and with a distracted worker.

    Raises:
        SimError: an unknown robot or population.
    """
    attentive, distracted = (
        changed_scenario(ScenarioTemplate.shipped(name), axes).median()
        for name in ("crossing_attentive", "crossing_distracted")
    )
    return attentive, distracted


def comparison_table(rows: Iterable[ComparisonRow]) -> str:
    """Return the comparison as text."""
    lines = [
        f"{'':26s}{'time to':>9s}{'smallest':>12s}{'top speed':>12s}{'margin':>12s}{'':>10s}",
        f"{'crossing':26s}{'goal':>9s}{'separation':>12s}{'within 2 m':>12s}{'violated':>12s}"
        f"{'contacts':>10s}",
        "-" * 81,
    ]
    for row in rows:
        result = row.result
        goal = "never" if result.time_to_goal_s is None else f"{result.time_to_goal_s:.2f} s"
        cells = ["-"] * 4
        if result.frames and result.frames[0].truth:
            cells = [
                f"{result.min_separation_m:.2f} m",
                f"{result.max_speed_within_2m_mps:.2f} m/s",
                f"{result.violation_time_s:.2f} s",
                str(len(result.contacts)),
            ]
        separation, speed, violation, contacts = cells
        lines.append(
            f"{row.label:26s}{goal:>9s}{separation:>12s}{speed:>12s}{violation:>12s}{contacts:>10s}"
        )
    return "\n".join(lines)


def delay_won_back(rows: Sequence[ComparisonRow]) -> float | None:
    """Return the share of the blind robot's delay that an aware robot does not have.

    None if one of the robots does not reach the goal, or the blind one has no delay.
    """
    free, _, blind, aware = (row.result.time_to_goal_s for row in rows[:4])
    if free is None or blind is None or aware is None or blind <= free:
        return None
    return (blind - aware) / (blind - free)


def write_episodes(path: Path, results: Iterable[CrossingResult]) -> None:
    """Write ``episodes.csv``, one row per crossing; the file appears whole or not at all."""
    rows = ([_cell(getattr(result, name)) for name in EPISODE_COLUMNS] for result in results)
    write_csv(path, EPISODE_COLUMNS, rows, SimError)


def _cell(value: Any) -> object:
    """Return the cell of a value: truth in small letters, a number with six decimals, a count."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return len(value)
    return csv_number(value) if value is None or isinstance(value, float) else value


def lowest_bound(frame: CrossingFrame) -> float | None:
    """Return the lowest bound of α that was used for an obstacle; None without obstacles."""
    return min((each.awareness_lower for each in frame.constraints.obstacles), default=None)


def largest_radius_m(frame: CrossingFrame) -> float | None:
    """Return the largest radius of the obstacles; None without obstacles."""
    return max((each.radius_m for each in frame.constraints.obstacles), default=None)


def time_lost_s(result: CrossingResult, free: CrossingResult) -> float | None:
    """Return how much later a robot arrives than with nobody there; None if one never arrives."""
    if result.time_to_goal_s is None or free.time_to_goal_s is None:
        return None
    return result.time_to_goal_s - free.time_to_goal_s


def time_behind_s(frame: CrossingFrame, free: CrossingResult) -> float | None:
    """Return the time since the free robot was as far along its way as this robot is now.

    None where the free robot does not arrive.
    """
    if free.time_to_goal_s is None:
        return None
    places = np.array([each.robot_state.position_odom_m for each in free.frames])
    way = (places[-1] - places[0]) / max(float(np.linalg.norm(places[-1] - places[0])), 1e-9)
    # The first time at each place, so that standing at the start counts as lost time, too.
    along, first = np.unique(np.maximum.accumulate((places - places[0]) @ way), return_index=True)
    now = float((frame.robot_state.position_odom_m - places[0]) @ way)
    was_there_s = float(np.interp(now, along, np.array([each.t_s for each in free.frames])[first]))
    return max(frame.t_s - was_there_s, 0.0)
