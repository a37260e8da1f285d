"""The report of a run as one HTML page; the only module that imports Jinja."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Any, Final

from perception.installation import install_command

from ...world.errors import SimError
from ..measures import nondeterminism_notes
from ._awareness_split import split_by_awareness
from ._comparison import FURTHER, MAIN, PAIRED_ONLY, comparison_section
from ._episode_list import failures, list_episodes
from ._fault_table import fault_rows
from ._reproduction import reproduction, title_of
from ._run_data import RunData
from ._scatter import scatter
from ._scenario_table import scenario_table
from ._statistics import RunStatistics
from ._still import make_stills
from ._text import plural
from ._verdict import verdicts

try:
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise SimError(
        "a report needs jinja2, which is not installed; it is part of the extra 'bench': "
        + install_command("bench")
    ) from cause

_REPORT: Final = "report.html"


def _render_page(**parts: Any) -> str:
    """Return the HTML of a page; every text of its parts is escaped.

    Args:
        parts: variables of ``templates/report.html``.
    """
    environment = Environment(
        loader=PackageLoader("sim_tests.study.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    folder = resources.files("sim_tests.study.report") / "templates"
    assets = {
        name: Markup((folder / f"report.{ending}").read_text("utf-8"))
        for name, ending in (("style", "css"), ("script", "js"))
    }
    page: str = environment.get_template("report.html").render(**assets, **parts)
    return page


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
    listed = list_episodes(run, arms, path.parent)
    errors = sum(len(arm.errors) for arm in arms)
    page = _render_page(
        title=title_of(run, len(arms)),
        run=run,
        condition=f"under the fault {statistics.fault}" if statistics.fault else "without faults",
        arms=arms,
        verdicts=verdicts(statistics),
        comparison=comparison_section(statistics),
        groups=split_by_awareness(statistics),
        scatter=scatter(arms, listed.episodes, run.replay_prefix),
        table=scenario_table(statistics),
        stills=make_stills(run, arms, pictures=stills, progress=progress),
        pictured=stills,
        faults=fault_rows(statistics),
        failures=failures(run),
        unrepeatable=nondeterminism_notes(each.record for each in run.episodes),
        failed=f"{plural(errors, 'episode')} failed",
        episodes=listed,
        reproduction=reproduction(run),
        metrics=(*MAIN, *FURTHER, *PAIRED_ONLY),
    )
    part = path.with_name(path.name + ".part")
    try:
        part.write_text(page, "utf-8")
        part.replace(path)
    except OSError as cause:
        raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause
    finally:
        part.unlink(missing_ok=True)
    return path
