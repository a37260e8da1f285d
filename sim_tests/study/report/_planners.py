"""The section of a report on the planners: whether they obey the limits, and use the radii."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from statistics import median
from typing import Final

from perception.anthropometry import BODY_RADIUS_M

from ..measures import (
    NOTHING,
    OVERSHOOT_MPS,
    EpisodeRecord,
    paired,
    paired_difference,
    proportion_interval,
)
from ._page import Cell, Row, Section, Table, interval_cell, number_cell, share_cell
from ._results import Arm, Results
from ._run import Episode, Run

#: Paths or distances that differ by less count as the same.
SAME_PATH_M: Final = 0.01
_REFERENCE: Final = "SamplingPlanner"


def planners_section(results: Results, run: Run) -> Section | None:
    """Return the conduct of the planners; None for a run whose conduct is not known."""
    lines: list[Row] = [
        _conduct_row(arm, _reference_of(arm, results))
        for arm in results.arms
        if any(each.conduct is not None for each in arm.episodes)
    ]
    if not lines:
        return None
    conduct = Table(
        {
            "Arm": "",
            "Speed limit, m/s": "largest excess of the travel speed over speed_limit_mps",
            "Episodes over": f"with an excess of more than {OVERSHOOT_MPS:g} m/s",
            "Yaw rule, m/s": "the same for |v| + |ω| R and fastest_point_limit_mps",
            "Episodes over it": f"with an excess of more than {OVERSHOOT_MPS:g} m/s",
            "plan(), ms": "median over episodes of the median of a call's elapsed time",
            "99th percentile, ms": "median over episodes; red if longer than the control cycle",
            "× reference": "median time of a call, divided by the reference planner's",
            "Repeats itself": "gives the same commands with the same seed",
        },
        lines,
        caption=f"Obeyed: no excess of more than {OVERSHOOT_MPS:g} m/s, about the motors' "
        "overshoot. Times depend on the computer and its load.",
    )
    tables = (conduct, _radii_table(results, run)) if results.probe and run.jobs else (conduct,)
    return Section("planners", "Planners", tables=tables)


def _reference_of(arm: Arm, results: Results) -> Sequence[Episode]:
    """Return the episodes of the reference planner with the policy and perception of an arm."""
    same = (arm.variant.policy, _REFERENCE, arm.variant.perception)
    for each in results.arms:
        if (each.variant.policy, each.variant.planner, each.variant.perception) == same:
            return each.episodes
    return ()


def _conduct_row(arm: Arm, reference: Sequence[Episode]) -> Row:
    conducts = [each.conduct for each in arm.episodes if each.conduct is not None]
    peers = {_task(each): each.conduct for each in reference if each.conduct is not None}
    ratios = [
        each.conduct.plan_median_s / peer.plan_median_s
        for each in arm.episodes
        if each.conduct is not None
        and (peer := peers.get(_task(each))) is not None
        and peer.plan_median_s > 0.0
    ]
    p99_s = median(each.plan_p99_s for each in conducts)
    repeats = not any(each.record.nondeterministic for each in arm.episodes)
    return [
        arm.name,
        *_obedience([each.limit_excess_mps for each in conducts]),
        *_obedience([each.fastest_point_excess_mps for each in conducts]),
        number_cell(1e3 * median(each.plan_median_s for each in conducts)),
        number_cell(1e3 * p99_s, bad=p99_s > median(each.cycle_s for each in conducts)),
        number_cell(median(ratios) if ratios else None),
        Cell("yes" if repeats else "no"),
    ]


def _task(episode: Episode) -> tuple[str, int]:
    return episode.record.scenario, episode.record.seed


def _obedience(excesses: Iterable[float | None]) -> tuple[Cell, Cell]:
    """Return the cells of the largest excess over a limit, and of the episodes over it."""
    known = [each for each in excesses if each is not None]
    if not known:
        return Cell(NOTHING), Cell(NOTHING)
    largest, over = max(known), sum(each > OVERSHOOT_MPS for each in known)
    text = f"{largest:+.2f}" if over else "obeyed"
    share = proportion_interval(over, len(known))
    return Cell(text, largest, bad=over > 0), share_cell(share, bad_from=1e-9)


def _radii_table(results: Results, run: Run) -> Table:
    """Return what wider radii change, with everything else the same."""
    from ..runs import policy_of  # noqa: PLC0415 - needs the simulator

    wide = next(job for job in run.jobs if job.policy == run.wide_policy)
    widest_m = policy_of(wide.policy_text).inflation.radius_m(0.0)
    probed = run.wide_policy.partition(",")[0]
    lines: list[Row] = []
    for arm in results.arms:
        if arm.variant.policy != probed:
            continue
        after = [e.record for e in results.probe if e.record.planner == arm.variant.planner]
        pairs = [
            pair
            for pair in paired([each.record for each in arm.episodes], after)
            if not any(each.error for each in pair)
        ]
        changed = sum(_differs(*pair) for pair in pairs)
        near = sum(
            first.min_separation_m is not None and first.min_separation_m < widest_m - BODY_RADIUS_M
            for first, _ in pairs
        )
        says = "uses them" if changed else "ignores them" if near else "nobody came near"
        lines.append(
            [
                arm.variant.planner,
                share_cell(proportion_interval(changed, len(pairs))),
                number_cell(near, 0),
                interval_cell(
                    paired_difference(
                        [first for first, _ in pairs],
                        [second for _, second in pairs],
                        "min_separation_m",
                    )
                ),
                Cell(says if pairs else NOTHING, bad=says == "ignores them"),
            ]
        )
    columns = {
        "Planner": "",
        "Other path": f"length or distance kept differs by more than {SAME_PATH_M:g} m",
        "Somebody near": "episodes in which the robot came into a wider circle",
        "More distance, m": "mean difference of the smallest separation",
        "Radii": "",
    }
    caption = f"Whether a planner uses the radii: {run.wide_policy}; speed limits are the same."
    return Table(columns, lines, caption=caption)


def _differs(one: EpisodeRecord, other: EpisodeRecord) -> bool:
    """Return whether two episodes have another path: its length, or the distance kept, differs."""
    if (one.time_to_goal_s is None) != (other.time_to_goal_s is None):
        return True
    for name in ("path_length_m", "min_separation_m"):
        first, second = getattr(one, name), getattr(other, name)
        if (first is None) != (second is None):
            return True
        if first is not None and abs(first - second) > SAME_PATH_M:
            return True
    return False
