"""One crossing with and without awareness: its runs, its table and its plot."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from tqdm import tqdm

from awarenav.figures import Axes, new_figure, save_figure
from perception.arrays import FloatArray

from ..conditions import Perception, changed_scenario
from ..crossing import CrossingFrame, CrossingResult, run_crossing
from ..scenario import Scenario, ScenarioTemplate
from ._camera_film import CameraPicture, CameraRecorder

#: Policies that ignore awareness: α says nothing about what the robot does.
WITHOUT_AWARENESS: Final = ("blind", "scanner")


@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """One row of the comparison.

    Attributes:
        label: of the row.
        result: the crossing.
        scenario: its scenario.
        pictures: of the robot's camera, one for each picture of the film; empty without a film.
    """

    label: str
    result: CrossingResult
    scenario: Scenario
    pictures: tuple[CameraPicture, ...] = ()


def compare_policies(
    seed: int = 0,
    perception: str = "keypoints",
    *,
    filmed: bool = False,
    **axes: str,
) -> tuple[ComparisonRow, ...]:
    """Run the same crossing without people, as today, blind, and aware with two kinds of worker.

    Only the gaze and the robot's policy differ. The worker walks on in every run, unless somebody
    recorded answers to the robot. The robot has a camera and laser scanners; today's robot has the
    scanners alone. Shows a progress bar on a terminal.

    Args:
        seed: seed of everything random.
        perception: ``"keypoints"`` or ``"pixels"``.
        filmed: whether to take the pictures of the robot's camera for the film.
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
        camera = CameraRecorder() if filmed and policy == "balanced" and scenario.people else None
        result = run_crossing(
            scenario, policy=policy, perception=senses, seed=seed, observer=camera
        )
        rows.append(ComparisonRow(label, result, scenario, camera.pictures if camera else ()))
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


_COLOURS: Final = {
    "nobody there": "#8a8f98",
    "today's AMR": "#1f4e79",
    "awareness-blind": "#b3261e",
    "aware, attentive worker": "#2e7d4f",
    "aware, distracted worker": "#b8651b",
}
_QUIET: Final = "#5c6069"
_TEXT_PT: Final = 13
_SMALL_PT: Final = 12
# A limit this far below the speed of the free robot slows the robot down.
_SLOWER_MPS: Final = 0.002

Rows = Sequence[ComparisonRow]


def plot_comparison(path: Path, rows: Rows) -> None:
    """Plot the time that each crossing loses, and why: speed, awareness and radius over its way.

    Args:
        path: the PNG file.
        rows: the crossings; the first has nobody in it, and the others lose time against it.
    """
    figure = new_figure(7.4, 9.6, dpi=110.0)
    bars, speed, bound, radius = figure.subplots(
        4, 1, gridspec_kw={"height_ratios": [1.4, 1.25, 1.0, 1.0]}
    )
    figure.suptitle(headline(rows), fontsize=16, fontweight="bold", x=0.02, ha="left")
    _plot_time_lost(bars, rows)
    met = [row for row in rows if row.result.frames[0].truth]
    aware = [row for row in met if row.result.policy not in WITHOUT_AWARENESS]
    _plot_curves(speed, "speed (m/s)", 1.8, rows, lambda frame: frame.robot_state.travel_mps)
    _mark_limits(speed, rows)
    _plot_curves(bound, "awareness α: the lower bound that acts", 1.1, aware, lowest_bound)
    for number, row in enumerate(aware):
        _mark_memory(bound, row.result, named=number == 0)
    _plot_curves(radius, "obstacle radius (m)", 2.5, met, largest_radius_m)
    for axes in (speed, bound, radius) if met else ():
        place_m = float(met[0].result.frames[-1].truth[0].position_odom_m[0])
        axes.axvline(place_m, color="0.5", lw=1.2, ls=":", zorder=0)
        if axes is speed:
            axes.text(place_m + 0.1, 0.05, "worker", fontsize=_SMALL_PT, color=_QUIET)
    radius.set_xlabel("robot's way along the aisle (m)", fontsize=_TEXT_PT)
    save_figure(figure, path)


def headline(rows: Rows) -> str:
    """Return the result in two lines: the time that the aware robot loses to each worker."""
    lost = {row.label: time_lost_s(row.result, rows[0].result) for row in rows}
    watched, ignored = (lost[f"aware, {kind} worker"] for kind in ("attentive", "distracted"))
    if watched is None or ignored is None:
        return "The aware robot does not reach\nits goal in both runs"
    return (
        f"The aware robot loses {watched:.1f} s to a worker\n"
        f"who watches it, and {ignored:.1f} s to one who looks away"
    )


def _plot_time_lost(axes: Axes, rows: Rows) -> None:
    """Plot one bar a crossing; its text above names it, in the colour of its curves below."""
    free = rows[0].result
    for place, row in enumerate(rows):
        lost = time_lost_s(row.result, free)
        text = "does not arrive" if lost is None else f"{lost:.1f} s"
        if row.result.frames[0].truth:
            text += f", passes at up to {row.result.max_speed_within_2m_mps:.2f} m/s"
        colour = _COLOURS[row.label]
        axes.barh(place, lost or 0.0, color=colour, height=0.28)
        axes.text(
            0.0, place - 0.2, f"{row.label}: {text}", va="bottom", fontsize=_TEXT_PT, color=colour
        )
    axes.set_ylim(len(rows) - 0.6, -0.85)
    axes.set_xlim(0.0, max(*(time_lost_s(row.result, free) or 0.0 for row in rows), 1.0))
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[["top", "right", "bottom", "left"]].set_visible(False)
    time = "" if free.time_to_goal_s is None else f" (nobody there: {free.time_to_goal_s:.2f} s)"
    axes.set_title(f"time lost{time}", fontsize=_TEXT_PT, fontweight="bold", loc="left")


def _plot_curves(
    axes: Axes, title: str, top: float, rows: Rows, pick: Callable[[CrossingFrame], float | None]
) -> None:
    """Plot one quantity of each crossing over its way; a gap where it has no value."""
    axes.set_title(title, fontsize=_TEXT_PT, fontweight="bold", loc="left")
    axes.set_xlim(0.0, 13.1)
    axes.set_ylim(0.0, top)
    axes.tick_params(labelsize=_SMALL_PT)
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    for number, row in enumerate(rows):
        values = [np.nan if (v := pick(frame)) is None else v for frame in row.result.frames]
        # Thinner lines lie on top, so that curves that coincide all show.
        width = 4.5 - 0.8 * number
        axes.plot(_along_m(row.result), values, color=_COLOURS[row.label], lw=width)


def _along_m(result: CrossingResult) -> FloatArray:
    return np.array([frame.robot_state.position_odom_m[0] for frame in result.frames])


def _mark_limits(axes: Axes, rows: Rows) -> None:
    """Mark the places at which the worker begins to limit the speed of a robot."""
    free = rows[0].result
    along, speeds = _along_m(free), [frame.robot_state.travel_mps for frame in free.frames]
    for number, row in enumerate(rows[1:]):
        for x, frame in zip(_along_m(row.result).tolist(), row.result.frames, strict=True):
            if frame.constraints.speed_limit_mps < np.interp(x, along, speeds) - _SLOWER_MPS:
                colour = _COLOURS[row.label]
                axes.plot(x, frame.robot_state.travel_mps, "o", color=colour, ms=7)
                place = (1.3, 0.08 + 0.2 * number)
                axes.text(*place, f"limit from {x:.1f} m", fontsize=_SMALL_PT, color=colour)
                break


def _mark_memory(axes: Axes, result: CrossingResult, *, named: bool) -> None:
    """Mark where the worker is out of the camera's view and still counts as aware."""
    along, frames = _along_m(result).tolist(), result.frames
    seen = [x for x, frame in zip(along, frames, strict=True) if frame.observation_of(0)]
    aware = [x for x, frame in zip(along, frames, strict=True) if lowest_bound(frame)]
    if seen and aware and aware[-1] > seen[-1]:
        axes.axvspan(seen[-1], aware[-1], color=_QUIET, alpha=0.12, lw=0)
    if named and seen:
        text = "out of camera's view:\nremembered"
        axes.text(seen[-1] + 0.1, 0.85, text, fontsize=_SMALL_PT, color=_QUIET, va="center")
