"""The plot of a tuning: trials, the risk, presets, and the importances of the parameters."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

from awarenav.errors import counted
from awarenav.figures import new_figure, save_figure, scale_by_roots

from ._evaluation import FIGURES, RISK
from ._tune import Tuning

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TRIAL: Final = "#9aa3ad"
_WITHIN: Final = "#1f5fa8"
_CONTACT: Final = "#b3261e"
_ANCHOR: Final = "#d9822b"
_CHOSEN: Final = "#2e7d4f"
_BARS: Final = 8
_MARKERS: Final = ("D", "s", "^", "v", "P", "*")
_WORDS: Final = {"time_lost_s": "the time lost", "step_out_unaware": "the step-out impacts"}


def draw_tuning(tuning: Tuning, importance: Mapping[str, Mapping[str, float]], path: Path) -> None:
    """Draw trials, the risk, presets and chosen policies, and the importances beside them."""
    figure = new_figure(12.0, 6.0)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.7, 1.0))
    _draw_trials(figure.add_subplot(grid[:, 0]), tuning)
    for row, name in enumerate(FIGURES):
        _draw_importances(figure.add_subplot(grid[row, 1]), name, importance[name])
    save_figure(figure, path)


def _draw_trials(axes: Axes, tuning: Tuning) -> None:
    groups: dict[tuple[str, str, str], list[tuple[float, float]]] = {
        (_TRIAL, "o", "trial"): [],
        (_WITHIN, "o", "trial within the bounds"): [],
        (_CONTACT, "x", "trial with a contact"): [],
    }
    other, fine, touched = groups.values()
    for trial in tuning.trials:
        time_s, notes = trial.outcome.value, trial.outcome.notes
        if time_s is not None:
            kind = (
                touched if notes["moving_contacts"] else fine if trial in tuning.ranked else other
            )
            kind.append((time_s, max(notes[RISK], 0.0)))
    for (colour, marker, label), points in groups.items():
        if points:
            times_s, risks = zip(*points, strict=True)
            axes.scatter(times_s, risks, c=colour, marker=marker, s=26, label=label)
    axes.axhline(tuning.risk, color=_WITHIN, lw=1.0, ls="--", label="the given risk")
    for anchor, marker in zip(tuning.anchors, _MARKERS, strict=False):
        x, y = anchor.tuning.figures
        colour = _CONTACT if anchor.tuning.moving_contacts else _ANCHOR
        axes.scatter([x], [y], marker=marker, s=60, c=colour, zorder=3, label=anchor.name)
    places: dict[tuple[float, float], list[str]] = {}
    for chosen in tuning.chosen:
        places.setdefault(chosen.tuning.figures, []).append(chosen.name.replace("_", " "))
    for row, ((x, y), names) in enumerate(sorted(places.items())):
        below = row % 2 == 0  # so that the names of neighbours do not overlap
        axes.scatter([x], [y], marker="o", s=120, facecolors="none", edgecolors=_CHOSEN, lw=2)
        axes.annotate(
            ",\n".join(names),
            (x, y),
            xytext=(9, -7 if below else 7),
            textcoords="offset points",
            color=_CHOSEN,
            va="top" if below else "bottom",
        )
    settings = tuning.settings
    axes.set_title(
        f"{counted(len(tuning.trials), 'trial')} in "
        f"{counted(len(settings.tuning_templates), 'scenario')}, "
        f"{counted(settings.episodes, 'seed')} each unless it ended early",
        loc="left",
        fontsize=10,
    )
    axes.set_xlabel("mean time lost (s an episode)")
    axes.set_ylabel("step-out impacts with unaware people, per 1 000 crossings")
    axes.grid(alpha=0.25)
    axes.margins(0.12)
    scale_by_roots(axes, max(anchor.tuning.risk for anchor in tuning.anchors))
    axes.legend(loc="upper right", fontsize=8)


def _draw_importances(axes: Axes, figure: str, importance: Mapping[str, float]) -> None:
    first = sorted(importance.items(), key=lambda each: -each[1])[:_BARS][::-1]
    names, values = [name for name, _ in first], [value for _, value in first]
    axes.barh(names, values, color=_WITHIN)
    axes.set_title(f"what decided {_WORDS[figure]}", loc="left", fontsize=10)
    axes.tick_params(labelsize=8)
    if not any(values):
        axes.set_axis_off()
        axes.text(0.0, 0.9, "nothing: all trials are equal", transform=axes.transAxes, va="top")
    axes.set_xlim(0.0, max(1e-9, *values) * 1.1 if any(values) else 1.0)
    axes.grid(alpha=0.25, axis="x")
