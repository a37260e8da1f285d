"""The report of a run as one HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from ..measures import answering_note, nondeterminism_notes
from ._awareness_split import split_by_awareness
from ._comparison import FURTHER, MAIN, PAIRED_ONLY, REQUESTS, comparison_section
from ._episode_list import failures, list_episodes
from ._fault_table import fault_rows
from ._page import write_page
from ._reproduction import reproduction, title_of
from ._run_data import RunData
from ._scatter import scatter
from ._scenario_table import recorded_people, scenario_table
from ._statistics import RunStatistics
from ._still import make_stills
from ._text import plural
from ._verdict import verdicts

_REPORT: Final = "report.html"


def write_report(
    out_dir: Path | str, *, stills: bool = True, path: Path | None = None, progress: bool = False
) -> Path:
    """Write the report of a run and return its path; the file appears whole or not at all.

    The same folder gives the same page, byte for byte. The page says what is missing or unfinished
    in the folder.

    Args:
        out_dir: folder with ``episodes.csv``, ``jobs.jsonl`` and ``run.json``.
        stills: run the worst episodes again for pictures.
        path: the file; default ``report.html`` in the folder.
        progress: show progress on standard error.

    Raises:
        SimError: there is no ``episodes.csv``, it is not a table of episodes, or the page cannot
            be written.
    """
    run = RunData.read(out_dir)
    statistics = RunStatistics.of(run.episodes)
    arms = statistics.arms
    path = run.path / _REPORT if path is None else path
    comparison = comparison_section(statistics)
    listed = list_episodes(run, arms, path.parent)
    errors = sum(len(arm.errors) for arm in arms)
    write_page(
        path,
        "report.html",
        plural=plural,
        title=title_of(run, len(arms)),
        run=run,
        condition=f"under the fault {statistics.fault}" if statistics.fault else "without faults",
        arms=arms,
        verdicts=verdicts(statistics),
        comparison=comparison,
        answering=answering_note(run.about),
        groups=split_by_awareness(statistics),
        scatter=scatter(arms, listed.episodes, run.replay_prefix),
        table=scenario_table(statistics),
        recorded=recorded_people(run.jobs),
        stills=make_stills(run, arms, pictures=stills, progress=progress),
        pictured=stills,
        faults=fault_rows(statistics),
        failures=failures(run),
        unrepeatable=nondeterminism_notes(each.record for each in run.episodes),
        failed=f"{plural(errors, 'episode')} failed",
        episodes=listed,
        reproduction=reproduction(run),
        metrics=(*MAIN, *FURTHER, *(REQUESTS if comparison.requests else ()), *PAIRED_ONLY),
    )
    return path
