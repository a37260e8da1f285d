"""Four robots in the same aisle, and the figures of each.

A run is one robot with one seed. Seeds 0 to 9 are reported, from a table that comes with the
package; the scenario was chosen on seeds 500 to 507.
"""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from datetime import date
from importlib import resources
from statistics import median
from typing import Any, Final

import numpy as np

import awarenav

from ..crossing import CrossingResult, Observer, run_crossing
from ..scenario import Scenario
from ..study.measures import NOTHING, number_text
from ..study.runs import observed_episode, plan_jobs, scenario_of
from ._film import passage

#: Name of the scenario.
SCENARIO: Final = "steps_out_in_aisle"
#: Number of seeds that are reported, from 0 on.
REPORTED: Final = 10
# The rows of these seeds; ``awarenav demo --seeds 10`` makes the file.
_REPORT: Final = resources.files("sim_tests.demo") / "ten_seeds.jsonl"
_DECIMALS: Final = 3
# A touch is none; a near miss is a robot this fast in the intimate zone of the one who steps out.
_NEAR_MISS_M: Final = 0.45
_NEAR_MISS_MPS: Final = 0.25
# Within this distance of somebody, the robot's highest speed counts.
_BESIDE_M: Final = 2.0


@dataclass(frozen=True, slots=True)
class Lane:
    """A robot of the comparison."""

    name: str
    label: str
    policy: str
    planner: str
    sensors: str

    @property
    def words(self) -> str:
        """The robot within a sentence."""
        return {
            "today": "today's AMR that predicts people",
            "today-costmap": "today's AMR with a costmap planner",
        }.get(self.name, self.label)


#: The robots. Both of today read laser scanners alone, as in ``docs/leaderboard/rows.yaml``; the
#: first one's planner knows how people walk, the second one's knows places only.
LANES: Final = (
    Lane("today", "today's AMR, predicts", "scanner", "", "scanner"),
    Lane("today-costmap", "today's AMR, costmap", "scanner", "costmap", "scanner"),
    Lane("blind", "slow for everybody", "blind", "", "camera+scanner"),
    Lane("awarenav", "awarenav", "balanced", "", "camera+scanner"),
)


@dataclass(frozen=True, slots=True)
class LaneRow:
    """The figures of one robot with one seed.

    Attributes:
        seed: of the crossing.
        lane: name of the robot.
        time_to_goal_s: None without arrival.
        time_lost_s: time over that of the same robot with nobody there; all of it without arrival.
        touch_mps: highest speed of the robot at a contact with anybody while it moved; None for no
            such contact.
        hit: the robot caused such a contact by its own motion.
        nearest_m: smallest distance to the one who steps out, while the robot moved.
        nearest_mps: speed of the robot at that time.
        phone_mps: highest speed within 2 m of the one who steps out; None if never so near.
        watcher_mps: the same for the one who watches.
        step_out_never: step-out impacts per 1 000 crossings, never noticed; None as the next where
            rows of an earlier version do not have it.
        step_out_all: all step-out impacts.
    """

    seed: int
    lane: str
    time_to_goal_s: float | None
    time_lost_s: float
    touch_mps: float | None
    hit: bool
    nearest_m: float
    nearest_mps: float
    phone_mps: float | None
    watcher_mps: float | None
    step_out_never: float | None
    step_out_all: float | None

    @property
    def near_miss(self) -> bool:
        """True if the robot passed the one who steps out within 0.45 m at over 0.25 m/s."""
        near = self.nearest_m < _NEAR_MISS_M and self.nearest_mps > _NEAR_MISS_MPS
        return near and self.touch_mps is None


@dataclass(frozen=True, slots=True, eq=False)
class LaneRun:
    """A recorded run."""

    lane: Lane
    scenario: Scenario
    result: CrossingResult
    row: LaneRow


def run_lane(lane: Lane, seed: int, observer: Observer | None = None) -> LaneRun:
    """Run one robot with one seed, watched by an observer."""
    (job,) = plan_jobs(
        [SCENARIO], [lane.policy], [seed], planners=[lane.planner], sensors=[lane.sensors]
    )
    result, record = observed_episode(job, observer)
    scenario = scenario_of(job.scenario_text).draw(seed)
    phone, watcher = (_number(scenario, steps_out=each) for each in (True, False))
    near = passage(result, phone)
    figures = (
        record.time_to_goal_s,
        record.time_lost_s,
        record.moving_contact_mps,
        record.robot_touched,
        near.distance_m,
        near.speed_mps,
        _fastest_beside_mps(result, phone),
        _fastest_beside_mps(result, watcher),
        record.step_out_never,
        record.step_out_all,
    )
    rounded: list[Any] = [
        round(each, _DECIMALS) if isinstance(each, float) else each for each in figures
    ]
    row = LaneRow(seed, lane.name, *rounded)
    return LaneRun(lane, scenario, result, row)


def run_nobody(seed: int) -> CrossingResult:
    """Run awarenav's robot with the same task and nobody there."""
    scenario = Scenario.shipped(SCENARIO).draw(seed).without_people()
    return run_crossing(scenario, policy="balanced", perception="keypoints+scanner", seed=seed)


def _number(scenario: Scenario, *, steps_out: bool) -> int:
    """Return the number of the person who steps out, or of the other one."""
    steps = [person.sets_off_within_m is not None for person in scenario.people]
    return steps.index(steps_out)


def _fastest_beside_mps(result: CrossingResult, person: int) -> float | None:
    return max(
        (
            frame.robot_state.travel_mps
            for frame in result.frames
            if frame.separations_m[person] < _BESIDE_M
        ),
        default=None,
    )


def shown_seed(rows: Sequence[LaneRow]) -> int:
    """Return the median seed by the time that awarenav loses; of an even number the lower one."""
    lost = sorted((row.time_lost_s, row.seed) for row in rows if row.lane == LANES[-1].name)
    return lost[(len(lost) - 1) // 2][1]


def lanes_table(rows: Sequence[LaneRow]) -> str:
    """Return the figures as text of at most 80 columns; of several seeds medians and counts."""
    lines = [
        f"{'':21}{'goal':>5}{'lost':>6}{'touched':>12}{'near':>6}{'nearest':>8}{'at':>7}"
        f"{'fastest near':>15}",
        f"{'robot':21}{'s':>5}{'s':>6}{'(hit), m/s':>12}{'miss':>6}{'m':>8}{'m/s':>7}{'phone':>7}"
        f"{'watcher':>8}",
        "-" * 80,
    ]
    for lane in LANES:
        own = [row for row in rows if row.lane == lane.name]
        if own:
            lines.append(f"{lane.label:21}{_cells(own)}")
    return "\n".join([*lines, *_step_outs(rows)])


def _step_outs(rows: Sequence[LaneRow]) -> list[str]:
    """Return the mean step-out impacts of each robot, where all rows have them."""
    if any(None in (row.step_out_never, row.step_out_all) for row in rows):
        return []
    lines = ["", "step-out impacts per 1 000 crossings: never noticed; all"]
    for lane in LANES:
        own = [(row.step_out_never, row.step_out_all) for row in rows if row.lane == lane.name]
        if own:
            means = np.array(own, dtype=np.float64).mean(axis=0)
            lines.append(f"{lane.label:22}" + "; ".join(f"{mean:.1f}" for mean in means))
    return lines


def _cells(rows: Sequence[LaneRow]) -> str:
    """Return the figures of one robot, after its name."""
    touches = [row.touch_mps for row in rows if row.touch_mps is not None]
    misses, hits = (sum(getattr(row, name) for row in rows) for name in ("near_miss", "hit"))
    touched, missed = f"{max(touches):.2f}" if touches else NOTHING, str(misses)
    if len(rows) == 1:
        touched, missed = "hit, " * hits + touched, "yes" if misses else "no"
    elif touches:
        touched = f"{len(touches)} ({hits}), {touched}"

    def middle(name: str, decimals: int = 2) -> str:
        values = [getattr(row, name) for row in rows]
        return number_text(median(math.inf if v is None else v for v in values), decimals)

    return (
        f"{middle('time_to_goal_s', 1):>5}{middle('time_lost_s', 1):>6}{touched:>12}{missed:>6}"
        f"{middle('nearest_m'):>8}{middle('nearest_mps'):>7}{middle('phone_mps'):>7}"
        f"{middle('watcher_mps'):>8}"
    )


def legend(seeds: int) -> str:
    """Return what the columns of a table of some seeds mean."""
    several = "Medians, and counts of touches (hits), with the fastest, and near misses. "
    return textwrap.fill(
        f"{several * (seeds > 1)}Lost: over the time with nobody there. Touched: somebody, while "
        "the robot moved; hit: by its own motion, not by walking into its side. Near miss: within "
        f"{_NEAR_MISS_M:g} m of the worker with the phone, who steps out, at over "
        f"{_NEAR_MISS_MPS:g} m/s. Nearest: to that worker, while the robot moved. Fastest: with "
        f"that worker, and the one who watches, within {_BESIDE_M:g} m.",
        80,
    )


def report_text(rows: Iterable[LaneRow]) -> str:
    """Return rows as JSON Lines, below a line that says what was measured, and when."""
    about = {
        "scenario": Scenario.shipped(SCENARIO).id,
        "version": awarenav.__version__,
        "date": date.today().isoformat(),
    }
    return "".join(json.dumps(each) + "\n" for each in (about, *map(asdict, rows)))


def read_report() -> tuple[dict[str, str], tuple[LaneRow, ...]]:
    """Return what was measured and when, and the rows of the reported seeds."""
    about, *rows = map(json.loads, _REPORT.read_text("utf-8").splitlines())
    return about, tuple(LaneRow(**row) for row in rows)


def reported_table() -> str:
    """Return the table of the reported seeds."""
    return lanes_table(read_report()[1])


def reported_text() -> str:
    """Return which seed is shown, and how often and how fast each robot touched somebody."""
    _, rows = read_report()
    parts = []
    for lane in LANES:
        own = [row for row in rows if row.lane == lane.name]
        touches_mps = [row.touch_mps for row in own if row.touch_mps is not None]
        hits = sum(row.hit for row in own)
        about = (
            f", up to {max(touches_mps):.1f} m/s, {hits} by its own motion" if touches_mps else ""
        )
        lost_s = median(row.time_lost_s for row in own)
        parts.append(f"{lane.words} in {len(touches_mps)}{about} (lost {lost_s:.1f} s)")
    return (
        f"The film is the median of {REPORTED} crossings by awarenav's time lost, seed "
        f"{shown_seed(rows)}; its AMR has the costmap planner. In how many of the {REPORTED} "
        f"somebody and the moving robot touched: {'; '.join(parts)}. Lost is the median, over the "
        "time with nobody there."
    )
