"""The comparison of planners: ``awarenav planners compare``."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from awarenav.cli import table_text
from awarenav.errors import AwarenavError
from awarenav.files import json_text
from nav_adapter import AwarenessPolicy

from ...conditions import ORACLE, REFERENCE_PLANNER
from ...scenario import Scenario
from ...world.errors import SimError
from ..measures import BASELINE, EpisodeRecord
from ..runs import Job, plan_jobs, policy_of, run_jobs, scenario_of
from ._results import WIDE_KEY, Results, Run

#: Radii of the probe, as a multiple of the policy's.
RADII_FACTOR: Final = 2.0
#: The probe of radii runs the first seeds only, at most so many.
PROBED_SEEDS: Final = 5
_LARGEST_RADIUS_M: Final = 10.0


def compare_planners(
    planners: Iterable[str | type | Any],
    scenarios: Sequence[str | Scenario],
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

    A planner is given as on the command line, or as a class or function that can be imported by its
    name. ``conditions`` are those of :func:`~sim_tests.study.runs.plan_jobs`, with one set of
    sensors and by default the truth; the rest is as for :func:`~sim_tests.study.runs.run_jobs`.

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
    scenarios: Sequence[str | Scenario],
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
    """
    for name, given in (("seeds", seeds), ("scenarios", scenarios)):
        if not given:
            raise SimError(f"{name} must be at least one, got none")
    wanted = dict.fromkeys(["", *("" if each == REFERENCE_PLANNER else each for each in planners)])
    conditions |= {"planners": list(wanted), "perception": perception, "sensors": (sensors,)}
    main = plan_jobs(
        scenarios, [BASELINE, *(p for p in policies if p != BASELINE)], seeds, **conditions
    )
    for text in dict.fromkeys(job.scenario_text for job in main):
        if scenario_of(text).robot.straight_on_speed_mps is not None:
            raise SimError(
                f"scenario {scenario_of(text).name!r} drives straight on without a planner, so it "
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
    from ._write import arms_section, planners_section  # noqa: PLC0415 - needs the extra bench

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
