"""The one place that imports Jinja: the page out of its parts.

From a run's folder to its page.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Any, Final

from ...world.errors import SimError
from ._awareness_split import split_by_awareness
from ._comparison import PAIRED_ONLY, compare
from ._episode_list import failures, list_episodes
from ._fault_table import faults_of
from ._figures import Figures
from ._measure import FURTHER, MAIN
from ._reproduction import reproduction, title_of
from ._run_data import RunData
from ._scatter import scatter
from ._scenario_table import tabulate
from ._still import make_stills
from ._text import plural
from ._verdict import verdicts

try:
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise SimError(
        "a report needs jinja2, which is not installed; it is part of the extra 'bench': "
        "pip install 'awarenav[bench]'"
    ) from cause


def render_page(**parts: Any) -> str:
    """The HTML of a page; every text of its parts is escaped.

    Args:
        parts: what ``templates/report.html`` asks for.
    """
    environment = Environment(
        loader=PackageLoader("sim_tests.study.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    folder = resources.files("sim_tests.study.report") / "templates"
    own = {
        name: Markup((folder / f"report.{ending}").read_text("utf-8"))
        for name, ending in (("style", "css"), ("script", "js"))
    }
    page: str = environment.get_template("report.html").render(**own, **parts)
    return page


#: Name of the page in its folder.
REPORT: Final = "report.html"


def write_report(
    out_dir: Path | str, *, stills: bool = True, path: Path | None = None, progress: bool = False
) -> Path:
    """Write the page of a run and return its path; it appears whole or not at all.

    The same folder gives the same page, byte for byte. What is missing or unfinished in the folder
    is said on the page.

    Args:
        out_dir: folder with ``episodes.csv``, ``jobs.jsonl`` and ``run.json``.
        stills: run the worst episodes again for pictures of them.
        path: the page; default ``report.html`` in the folder.
        progress: show it on the standard error stream.

    Raises:
        SimError: there is no ``episodes.csv``, it is no table of episodes, Jinja is not installed,
            or the page cannot be written.
    """
    folder = RunData.read(out_dir)
    figures = Figures.of(folder.episodes)
    arms = figures.arms
    listed = list_episodes(folder, arms)
    errors = sum(len(arm.errors) for arm in arms)
    page = render_page(
        title=title_of(folder, len(arms)),
        folder=folder,
        condition=f"under the fault {figures.fault}" if figures.fault else "without faults",
        arms=arms,
        verdicts=verdicts(figures),
        comparison=compare(figures),
        groups=split_by_awareness(figures),
        scatter=scatter(arms, listed.episodes, folder.replay_prefix),
        table=tabulate(figures),
        stills=make_stills(folder, arms, pictures=stills, progress=progress),
        pictured=stills,
        faults=faults_of(figures),
        failures=failures(folder),
        failed=f"{plural(errors, 'episode')} failed",
        episodes=listed,
        reproduction=reproduction(folder),
        measures=(*MAIN, *FURTHER, *PAIRED_ONLY),
    )
    path = folder.path / REPORT if path is None else path
    part = path.with_name(path.name + ".part")
    try:
        part.write_text(page, "utf-8")
        part.replace(path)
    except OSError as cause:
        raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause
    finally:
        part.unlink(missing_ok=True)
    return path
