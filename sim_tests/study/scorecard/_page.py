"""The scorecard as one HTML page, ``scorecard.html``."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Final

from ..measures import Interval, Metric
from ..report import Panel, panel, plural, write_page
from ._plan import PROBED_SEEDS, RADII_FACTOR
from ._score import Score, Scorecard
from ._tables import COLUMNS, PROBE_COLUMNS, looks, probe_rows, rows, scope
from ._verdict import verdicts

# A line may break here.
_BREAK: Final = "\N{ZERO WIDTH SPACE}"
_PACKAGE: Final = "sim_tests.study.scorecard"

_GOALS: Final = Metric(
    "goals",
    "Goals reached",
    "%",
    "higher",
    "Share of episodes that reached the goal.",
    share=True,
    from_zero=False,
)
_MARGIN: Final = Metric(
    "negative_margin",
    "Negative separation margin",
    "%",
    "lower",
    "Share of episodes with a negative margin.",
    share=True,
)
_BLIND: Final = Metric(
    "against_blind_s",
    "Time lost against blind",
    "s",
    "lower",
    "Mean difference to the policy blind with the same planner, scenario and seed.",
    decimals=1,
)


@dataclass(frozen=True, slots=True)
class _FailedEpisodes:
    """A line of the list of failures, with the command that shows one of the episodes."""

    look: int
    planner: str
    times: int
    message: str
    replay: str


def write_page_of(card: Scorecard, folder: Path) -> Path:
    """Write ``scorecard.html`` into the folder of a comparison; return its path.

    Raises:
        SimError: the page cannot be written, or the extra ``bench`` is missing.
    """
    path = folder / "scorecard.html"
    look_of = {planner.name: look for look, planner in looks(card)}
    style = resources.files(_PACKAGE) / "templates" / "scorecard.css"
    write_page(
        path,
        "scorecard.html",
        package=_PACKAGE,
        own_style=style.read_text("utf-8"),
        card=card,
        scope=scope(card),
        plural=plural,
        words=_words,
        verdicts=[(look_of[each.name], each) for each in verdicts(card)],
        columns=COLUMNS,
        rows=rows(card),
        panels=_panels(card),
        probes=probe_rows(card),
        probe_columns=PROBE_COLUMNS,
        radii_factor=f"{RADII_FACTOR:g}",
        probed_seeds=PROBED_SEEDS,
        failures=[
            _FailedEpisodes(
                look_of[planner.name],
                planner.name,
                each.times,
                each.message,
                f"awarenav replay {shlex.quote(str(folder))} {each.episode}",
            )
            for planner in card.planners
            for each in planner.failures
        ],
    )
    return path


def _words(name: str) -> list[str]:
    """Return the parts of a name, between which a line may break: MyPlanner is My and Planner."""
    return re.findall(r"[A-Z]*[^A-Z_]*_*", name)


def _panels(card: Scorecard) -> tuple[Panel, ...]:
    """Return the plots of intervals for the policy that verdicts speak of."""
    judged = [
        (look, _BREAK.join(_words(planner.name)), score)
        for look, planner in looks(card)
        if (score := planner.with_policy(card.policy)) is not None
    ]
    found: list[Panel] = []
    for metric, signed in ((_GOALS, False), (_MARGIN, False), (_BLIND, True)):
        lines = [(look, name, _estimate(score, metric)) for look, name, score in judged]
        if any(estimate.known for _, _, estimate in lines):
            found.append(panel(metric, lines, signed=signed))
    return tuple(found)


def _estimate(score: Score, metric: Metric) -> Interval:
    if metric is _BLIND:
        return score.against_blind_s[""]
    return score.goals if metric is _GOALS else score.negative_margin
