"""The comparison of planners: its episodes, its section of the report, and what it prints."""

from __future__ import annotations

import contextlib
import inspect
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from statistics import median
from typing import Any, Final

from awarenav.errors import AwarenavError
from awarenav.files import json_text
from nav_adapter import AwarenessPolicy
from perception.anthropometry import BODY_RADIUS_M

from ...conditions import ORACLE, REFERENCE_PLANNER
from ...crossing.planner import KNOWN_PLANNERS, SamplingPlanner
from ...scenario import ScenarioTemplate
from ...world.errors import SimError
from ..measures import (
    BASELINE,
    NOTHING,
    OVERSHOOT_MPS,
    EpisodeRecord,
    paired,
    paired_difference,
    proportion_interval,
    table_text,
)
from ..runs import Job, plan_jobs, policy_of, run_jobs, template_of
from ._page import Cell, Row, Section, Table, interval_cell, number_cell, share_cell
from ._results import WIDE_KEY, Arm, Episode, Results, Run

#: Radii of the probe, as a multiple of the policy's.
RADII_FACTOR: Final = 2.0
#: The probe of radii runs the first seeds only, at most so many.
PROBED_SEEDS: Final = 5
_LARGEST_RADIUS_M: Final = 10.0
#: Paths or distances that differ by less count as the same.
SAME_PATH_M: Final = 0.01
_REFERENCE: Final = "SamplingPlanner"


def compare_planners(
    planners: Iterable[str | type | Any],
    scenarios: Sequence[str | ScenarioTemplate],
    out_dir: Path | str,
    *,
    policies: Sequence[str | tuple[str, AwarenessPolicy]] = ("balanced",),
    seeds: Iterable[int] = range(5),
    workers: int | None = 1,
    time_limit_s: float | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
    about: Mapping[str, Any] | None = None,
    **conditions: Any,
) -> tuple[EpisodeRecord, ...]:
    """Compare planners on the same crossings, and write the report of the run into its folder.

    Every planner runs each scenario with each seed and policy, and so do the reference planner and
    the policy ``blind``, which times are compared with. An episode whose planner raises an error,
    returns no command or exceeds the time limit fails alone.

    Args:
        planners: ``"module:NAME"`` (a class, a function that returns a planner, or a planner, with
            arguments as ``"module:NAME(gain=2.0)"``), ``"reference"``, ``"costmap"``,
            ``"straight_on"``, or a class or function that can be imported by its name.
        scenarios: templates, shipped names, YAML files, or ``"all"``.
        out_dir: folder of the run (:class:`~sim_tests.study.runs.RunFiles`), with
            ``report.html``.
        policies: presets, YAML files, ``"oracle"``, or pairs of a name and a policy.
        seeds: seeds of the episodes.
        workers: number of processes; 1 runs in this process unless there is a time limit.
        time_limit_s: wall-clock limit of an episode, which ends planners that hang.
        resume: continue the comparison in the folder.
        overwrite: replace the one in the folder.
        progress: show progress on standard error.
        about: further entries of ``run.json``.
        conditions: ``perception`` (default ``"truth"``), ``sensors`` (one set), ``camera``,
            ``robot`` and ``population``, as for :func:`~sim_tests.study.runs.plan_jobs`.

    Returns:
        The rows of all episodes, the failed ones included.

    Raises:
        SimError: an unusable argument or folder; nothing has run then.
        NavError: an unknown preset or unusable policy file.
    """
    folder = Path(out_dir)
    names = [each if isinstance(each, str) else _import_name(each) for each in planners]
    jobs, wide = plan_comparison(names, scenarios, policies, tuple(seeds), **conditions)
    try:
        records = run_jobs(
            jobs,
            folder,
            workers=workers,
            time_limit_s=time_limit_s,
            resume=resume,
            overwrite=overwrite,
            progress=progress,
            about={**(about or {}), WIDE_KEY: wide},
        )
    except KeyboardInterrupt:
        with contextlib.suppress(SimError):  # nothing has run yet
            _write_report(folder)
        raise
    _write_report(folder, progress=progress)
    return records


def plan_comparison(
    planners: Sequence[str],
    scenarios: Sequence[str | ScenarioTemplate],
    policies: Sequence[str | tuple[str, AwarenessPolicy]],
    seeds: Sequence[int],
    *,
    perception: str = "truth",
    sensors: str = "camera",
    **conditions: Any,
) -> tuple[tuple[Job, ...], str]:
    """Return the episodes of a comparison, and the name of its policy with wider radii.

    The reference planner and the policy ``blind`` are added where they are missing. The arguments
    are those of :func:`compare_planners`.

    Raises:
        SimError: an unusable argument, or a scenario that needs no planner.
        NavError: an unknown preset or unusable policy file.
    """
    for name, given in (("seeds", seeds), ("scenarios", scenarios)):
        if not given:
            raise SimError(f"{name} must be at least one, got none")
    wanted = dict.fromkeys(["", *("" if each == REFERENCE_PLANNER else each for each in planners)])
    conditions |= {
        "planners": list(wanted),
        "perception": perception,
        "sensors": (sensors,),
    }
    main = plan_jobs(
        scenarios, [BASELINE, *(p for p in policies if p != BASELINE)], seeds, **conditions
    )
    for text in dict.fromkeys(job.scenario_text for job in main):
        if template_of(text).median().robot.straight_on_speed_mps is not None:
            raise SimError(
                f"scenario {template_of(text).name!r} drives straight on without a planner, so it "
                "cannot compare planners"
            )
    texts = {job.policy: job.policy_text for job in main}
    probed = next((name for name in texts if name not in (BASELINE, ORACLE)), BASELINE)
    wide = f"{probed}, radii × {RADII_FACTOR:g}"
    policy = _with_wider_radii(policy_of(texts[probed]))
    return main + plan_jobs(scenarios, [(wide, policy)], seeds[:PROBED_SEEDS], **conditions), wide


def _write_report(folder: Path, *, progress: bool = False) -> None:
    try:
        from ._write import write_report  # noqa: PLC0415 - needs the extra bench

        write_report(folder, progress=progress)
    except AwarenavError as error:  # the episodes are complete; the report can be made later
        print(f"no report: {error}; then: awarenav report {folder}", file=sys.stderr)


def _import_name(planner: Any) -> str:
    """Return ``module:NAME`` of a class or function; raise SimError for anything without one."""
    module, name = getattr(planner, "__module__", None), getattr(planner, "__qualname__", "")
    if not module or not name or "<" in name:
        raise SimError(
            "a planner must be given as module:NAME, or as a class or function that can be "
            f"imported by its name, got {planner!r:.80}"
        )
    return f"{module}:{name}"


def _with_wider_radii(policy: AwarenessPolicy) -> AwarenessPolicy:
    """Return a policy whose radii are larger, and which is otherwise the same."""
    data = policy.model_dump(mode="json")
    data["inflation"] = _scaled(data["inflation"])
    data["margins"] = _scaled(data["margins"])
    return AwarenessPolicy.model_validate(data)


def _scaled(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with every radius multiplied by :data:`RADII_FACTOR`."""

    def wider(radius_m: float) -> float:
        return min(RADII_FACTOR * radius_m, _LARGEST_RADIUS_M)

    scaled = dict(settings)
    for name, value in settings.items():
        if name.endswith("radius_m") and value is not None:
            scaled[name] = wider(value)
        elif name == "table_m":
            scaled[name] = [[alpha, wider(radius_m)] for alpha, radius_m in value]
    return scaled


def print_comparison(folder: Path, *, as_json: bool) -> None:
    """Print the figures of a comparison that fit on a terminal, and what its planners obey."""
    from ._planners import planners_section  # noqa: PLC0415 - makes tables of results
    from ._results import Results  # noqa: PLC0415
    from ._sections import arms_section  # noqa: PLC0415

    run = Run.read(folder)
    results = Results.of(run)
    obeys = planners_section(results, run)
    tables = () if obeys is None else obeys.tables
    if as_json:
        found = {
            "arms": [asdict(arm.row) for arm in results.arms],
            "planners": [table.values() for table in tables],
        }
        print(json_text(found), end="")
        return
    for arm in results.judged:
        print(f"{arm.name}: {results.verdict(arm)}\n")
    for table in (arms_section(results).tables[0], *tables):
        print(table_text(list(table.columns), [[cell.text for cell in row] for row in table.cells]))
        print()
    print(f"Report: {folder / 'report.html'}")


def known_planners() -> dict[str, str]:
    """Return the planners that have a name, with the first sentence about each."""
    makers = {REFERENCE_PLANNER: SamplingPlanner, **KNOWN_PLANNERS}
    sentences = {
        name: (inspect.getdoc(make) or "").partition("\n")[0].removeprefix("Return ")
        for name, make in makers.items()
    }
    return {name: text[:1].upper() + text[1:] for name, text in sentences.items()}


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
