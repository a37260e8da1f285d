"""The command ``awarenav frontier``: run the policies, then print and draw what they found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from awarenav.errors import counted
from awarenav.figures import Axes, label_points, new_figure, save_figure, scale_by_roots
from awarenav.files import json_text, write_text
from perception.arrays import FloatArray

from ...conditions import Experiment
from ...world.errors import SimError
from ..measures import NOTHING, EpisodeRecord, Interval
from ..report import Table
from ..runs import RunFiles, about_run, experiment_jobs, policy_text, read_rows, run_jobs
from ._frontier import TODAY, Frontier, Point, Worth, family, frontier_of, sensors_of_today

# The policy of the sentences, chosen beforehand: that of `balanced`.
_SPEED_MPS: Final = 1.5
_KINDS: Final = {"blind": "none", "aware": "who looks", "memory": "who looks or has looked"}
_HEADER: Final = (
    "policy",
    "U (m/s)",
    "awareness",
    "time lost (s)",
    "time over today's",
    "impacts",
    "never noticed",
    "wins at equal risk (s)",
    "avoids at equal time",
)
_TODAY: Final = "#b3261e"
_OTHER: Final = "#b8651b"
_LINES: Final = {
    "blind": ("#8a8f98", "s", "without awareness"),
    "aware": ("#1f4e79", "o", "with awareness"),
    "memory": ("#2e7d4f", "D", "with awareness, 3 s of memory"),
}


def frontier_command(
    folder: Path | None, experiment: Experiment, out: Path, *, as_json: bool, **running: Any
) -> int:
    """Run the family unless a folder of episodes is given, and write what it shows."""
    failed = 0
    if folder is None:
        folder, records = out, _run(experiment, out, **running)
        failed = sum(bool(record.error) for record in records)
    else:
        records = read_rows(folder)
    frontier = frontier_of(records)
    text, data = frontier_text(frontier), json_text(asdict(frontier))
    write_text(folder / "frontier.md", text, SimError)
    write_text(folder / "frontier.json", data, SimError)
    for suffix in ("png", "svg"):
        draw_frontier(frontier, folder / f"frontier.{suffix}")
    if as_json:
        print(data, end="")
    else:
        print(text)
        print(f"Written to {folder}: frontier.png, frontier.svg, frontier.md, frontier.json")
    if failed:
        print(f"{counted(failed, 'episode')} failed; {RunFiles(folder).errors} has the tracebacks")
    return 1 if failed else 0


def _run(experiment: Experiment, out: Path, **running: Any) -> tuple[EpisodeRecord, ...]:
    """Run the family and today's AMR, and write the policies beside the episodes."""
    sensors = experiment.one("sensors")
    members = [(each.name, each.policy()) for each in family(memory="scanner" in sensors)]
    today = experiment.replaced(sensors=sensors_of_today(sensors))
    jobs = experiment_jobs(experiment, members) + experiment_jobs(today, [TODAY])
    about = about_run(experiment, "frontier", out)
    records = run_jobs(jobs, out, progress=True, about=about, **running)
    for name, policy in members:
        write_text(out / "policies" / f"{name}.yaml", policy_text(policy), SimError)
    return records


def frontier_text(frontier: Frontier) -> str:
    """Return the frontier as Markdown: the sentences, the episodes and a table."""
    worth = {each.member.name: each for each in frontier.worth}
    rows = []
    for point in frontier.points:
        own, member = worth.get(point.name), point.member
        rows.append(
            (
                f"`{point.name}`",
                NOTHING if member is None else f"{member.speed_mps:g}",
                NOTHING if member is None else _KINDS[member.kind],
                point.time_lost_s.text(),
                point.time_over_today.text(),
                point.impacts.text(),
                point.never_noticed.text(),
                NOTHING if own is None else own.at_equal_risk_s.text(),
                NOTHING if own is None else own.at_equal_time.text(),
            )
        )
    table = Table(dict.fromkeys(_HEADER, ""), rows).markdown()
    episodes = (
        f"{counted(frontier.episodes, 'episode')} of each policy in "
        f"{counted(frontier.scenarios, 'scenario')}; 95 % intervals. Impacts: step-out impacts "
        "with all people, and with those who have never noticed the robot, per 1 000 crossings."
    )
    return "\n\n".join([*sentences(frontier), episodes, table]) + "\n"


def sentences(frontier: Frontier) -> tuple[str, ...]:
    """Return what awareness wins at equal risk and at equal time, one sentence each.

    They are about the policy with the U of ``balanced``, and with its memory if the run has that.
    """
    rows = [each for each in frontier.worth if each.member.speed_mps == _SPEED_MPS]
    if not rows:
        return ()
    worth = rows[-1]  # memory comes last
    return _at_equal_risk(worth), _at_equal_time(worth)


def _at_equal_risk(worth: Worth) -> str:
    won = worth.at_equal_risk_s
    if not won.known:
        return "At equal risk: no figure, as no policy without awareness has so many impacts."
    text = (
        f"At equal risk, awareness {_verb(won, 'wins', 'loses')} {_amount(won)} s a crossing "
        f"{_bounds(won)}"
    )
    attentive = worth.attentive_s
    if attentive.known:
        text += (
            f", and {_verb(attentive, 'wins', 'loses')} {_amount(attentive)} s with attentive "
            f"people {_bounds(attentive)}"
        )
    return f"{text} (`{worth.member.name}`)."


def _at_equal_time(worth: Worth) -> str:
    avoided = worth.at_equal_time
    if not avoided.known:
        return "At equal time: no figure, as no policy without awareness is so slow."
    return (
        f"At equal time, it {_verb(avoided, 'avoids', 'adds')} {_amount(avoided)} step-out impacts "
        f"per 1 000 crossings {_bounds(avoided)}."
    )


def _verb(interval: Interval, positive: str, negative: str) -> str:
    return positive if interval.value >= 0.0 else negative


def _amount(interval: Interval) -> str:
    return f"{abs(interval.value):.2f}"


def _bounds(interval: Interval) -> str:
    """Return the interval of the signed figure, ``"[?]"`` without bounds."""
    _, _, bounds = interval.text().partition(" ")
    return bounds


def draw_frontier(frontier: Frontier, path: Path) -> None:
    """Draw the frontier into a file (PNG, SVG or PDF).

    The axis of the impacts is that of their square roots, so that 0 and today's AMR both show.
    """
    figure = new_figure(8.2, 6.2, dpi=110.0)
    axes = figure.subplots()
    for kind, (colour, marker, label) in _LINES.items():
        found = [p for p in frontier.points if p.member is not None and p.member.kind == kind]
        if not found:
            continue
        _draw(axes, found, colour, marker, label)
        x, y = _places(frontier.line if kind == "blind" else found).T
        if kind == "blind":  # straight between two policies, which a scale by roots bends
            between = np.linspace(x[0], x[-1], 400)
            x, y = between, np.interp(between, x, y)
        axes.plot(x, y, color=colour, lw=1.4, alpha=0.7, zorder=1)
    _draw(axes, [frontier.today], _TODAY, "*", "today's AMR", size=13.0)
    others = [p for p in frontier.points[1:] if p.member is None]
    if others:
        _draw(axes, others, _OTHER, "^", "other policies")
    scale_by_roots(axes, max(point.impacts.value for point in frontier.points))
    free_s, today_s = frontier.free_s, frontier.free_s + frontier.today.time_lost_s.value

    def over_today(lost_s: Any) -> Any:
        return (free_s + lost_s) / today_s

    def lost_at(ratio: Any) -> Any:
        return ratio * today_s - free_s

    over = axes.secondary_xaxis("top", functions=(over_today, lost_at))
    over.set_xlabel("time to the goal over that of today's AMR")
    axes.set_xlabel(
        "time lost to people (s a crossing)\n"
        f"numbers: U in m/s; {counted(frontier.episodes, 'episode')} of each policy in "
        f"{counted(frontier.scenarios, 'scenario')}; 95 % intervals"
    )
    axes.set_ylabel("step-out impacts with all people, per 1 000 crossings")
    axes.grid(alpha=0.25)
    axes.spines[["right"]].set_visible(False)
    axes.legend(frameon=False)
    said = sentences(frontier)
    if said:
        figure.suptitle("\n".join(said).replace("`", ""), fontsize=9, x=0.02, ha="left")
    label_points(
        axes,
        (
            (p.time_lost_s.value, p.impacts.value, p.name, _OTHER)
            if p.member is None
            else (
                *(p.time_lost_s.value, p.impacts.value, f"{p.member.speed_mps:g}"),
                _LINES[p.member.kind][0],
            )
            for p in frontier.points[1:]
        ),
    )
    save_figure(figure, path)


def _draw(
    axes: Axes, points: Sequence[Point], colour: str, marker: str, label: str, size: float = 6.0
) -> None:
    """Draw points with the intervals of both figures, where they are bounded."""
    x, y = _places(points).T
    axes.errorbar(
        x,
        y,
        xerr=_ends([point.time_lost_s for point in points]),
        yerr=_ends([point.impacts for point in points]),
        fmt=marker,
        ms=size,
        color=colour,
        ecolor=colour,
        elinewidth=0.8,
        alpha=0.9,
        label=label,
        zorder=3,
    )


def _places(points: Sequence[Point]) -> FloatArray:
    places = [[p.time_lost_s.value, p.impacts.value] for p in points]
    return np.array(places, dtype=np.float64)


def _ends(intervals: Sequence[Interval]) -> FloatArray:
    """Return the (2, N) lengths of error bars; 0 where an interval is unbounded."""
    known = [
        each if each.bounded else replace(each, low=each.value, high=each.value)
        for each in intervals
    ]
    below = [max(each.value - each.low, 0.0) for each in known]
    return np.array([below, [max(each.high - each.value, 0.0) for each in known]], dtype=np.float64)
