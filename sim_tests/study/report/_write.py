"""The report of a run as one HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from awarenav.errors import counted

from ..measures import nondeterminism_notes
from ._compare import planners_section
from ._page import write_page
from ._results import Results, Run
from ._sections import (
    arms_section,
    awareness_section,
    charts_section,
    episodes_section,
    failures_section,
    faults_section,
    metrics_section,
    reproduction_section,
    requests_section,
    scenarios_section,
    stills_section,
)

_REPORT: Final = "report.html"


def write_report(
    out_dir: Path | str, *, stills: bool = True, path: Path | None = None, progress: bool = False
) -> Path:
    """Write the report of a run and return its path; the file appears whole or not at all.

    The same folder gives the same page, byte for byte. The page says what is missing or unfinished
    in the folder.

    Args:
        out_dir: folder of a run (:class:`~sim_tests.study.runs.RunFiles`).
        stills: run the worst episodes again for pictures.
        path: the file; default ``report.html`` in the folder.
        progress: show progress on standard error.

    Raises:
        SimError: there is no ``episodes.csv``, it is not a table of episodes, or the page cannot
            be written.
        MissingExtraError: matplotlib is not installed.
    """
    run = Run.read(out_dir)
    results = Results.of(run)
    path = run.path / _REPORT if path is None else path
    failures = failures_section(run)
    notices = [*run.missing, *nondeterminism_notes(each.record for each in run.episodes)]
    if failures is not None:
        failed = sum(bool(each.record.error) for each in run.episodes)
        notices.append(f"{counted(failed, 'episode')} failed; see “{failures.title}”.")
    if not run.episodes:
        notices.append("No episode has finished yet.")
    sections = [
        arms_section(results),
        charts_section(results),
        planners_section(results, run),
        scenarios_section(results, run.jobs),
        awareness_section(results),
        requests_section(results, run),
        faults_section(results),
        stills_section(run, results, pictures=stills, progress=progress),
        failures,
        metrics_section(results),
        reproduction_section(run),
        episodes_section(run, results, path.parent),
    ]
    write_page(
        path,
        _title(run),
        [section for section in sections if section is not None],
        lead=f"Under the fault {results.fault}." if results.fault else "",
        verdicts=[(arm.name, results.verdict(arm)) for arm in results.judged],
        notices=notices,
    )
    return path


def _title(run: Run) -> str:
    """Return the numbers of crossings, scenarios, policies, planners and seeds."""
    records = [each.record for each in run.episodes if each.record.policy != run.wide_policy]
    planners = len({each.planner for each in records})
    parts = [
        counted(len({each.versioned_scenario for each in records}), "scenario"),
        counted(len({each.policy for each in records}), "policy", "policies"),
        *([counted(planners, "planner")] if planners > 1 else []),
        counted(len({each.seed for each in records}), "seed"),
    ]
    return f"{counted(len(records), 'crossing')}: {', '.join(parts)}"
