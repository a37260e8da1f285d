"""The comparison of simulated and recorded people, as rows of a table and as plots."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.files import markdown_table
from perception.arrays import FloatArray
from sim_tests.actors.behaviour import LOOK_WITHIN_S, START_SHARES

from ._distribution import Distribution
from ._motion import QUANTITIES, Scene
from ._standing import DISPLACEMENTS, EYE_YAW_DEG, LOOKED

#: Two distributions count as alike up to this Kolmogorov-Smirnov distance.
GOAL: Final = 0.1
# The largest distance of a sample to its own distribution, 95 %, times the root of its size.
_CHANCE: Final = 1.358
_PERCENTS: Final = (50.0, 95.0, 99.0)


@dataclass(frozen=True)
class Compared:
    """A quantity, recorded and simulated.

    Attributes:
        name: of the quantity.
        text: its description.
        unit: of its values.
        samples: recorded values.
        recorded: 50th, 95th and 99th percentile, recorded.
        simulated: the same of each population.
        distance: Kolmogorov-Smirnov distance of each population.
    """

    name: str
    text: str
    unit: str
    samples: int
    recorded: tuple[float, ...]
    simulated: dict[str, tuple[float, ...]]
    distance: dict[str, float]

    @property
    def within_chance(self) -> float:
        """The goal, or the distance that so few recorded values have by chance."""
        return max(GOAL, _CHANCE / math.sqrt(max(self.samples, 1)))


def compare(
    recorded: Mapping[str, Distribution], simulated: Mapping[str, Sequence[Scene]]
) -> list[Compared]:
    """Return each quantity of moving people, for the scenes of each population."""
    rows = []
    for quantity in QUANTITIES:
        known = recorded[quantity.name]
        values = {people: quantity.values(scenes) for people, scenes in simulated.items()}
        values = {people: each for people, each in values.items() if len(each)}
        rows.append(
            Compared(
                quantity.name,
                quantity.text,
                quantity.unit,
                known.samples,
                tuple(known.percentile(percent) for percent in _PERCENTS),
                {each: _percentiles(found) for each, found in values.items()},
                {each: known.distance(found) for each, found in values.items()},
            )
        )
    return rows


def compare_eyes(simulated: Mapping[str, FloatArray]) -> Compared:
    """Return the yaw of the eyes in the head; of the recorded one only the spread is known."""
    draws = np.random.default_rng(0).normal(0.0, EYE_YAW_DEG, 200_000)
    known = Distribution(0, np.quantile(draws, np.linspace(0.0, 1.0, 101)))
    return Compared(
        "eye_yaw",
        "yaw of the eyes in the head",
        "°",
        10**6,
        tuple(known.percentile(percent) for percent in _PERCENTS),
        {each: _percentiles(found) for each, found in simulated.items()},
        {each: known.distance(found) for each, found in simulated.items()},
    )


def table(rows: Sequence[Compared]) -> str:
    """Return the rows as a Markdown table."""
    populations = list(dict.fromkeys(each for row in rows for each in row.simulated))
    head = [cell for each in populations for cell in (f"`{each}`", "KS")]
    lines = []
    for row in rows:
        cells = [f"{row.text}, {row.unit}", str(row.samples), _text(row.recorded)]
        for each in populations:
            found = row.simulated.get(each)
            cells += ["–", "–"] if found is None else [_text(found), f"{row.distance[each]:.2f}"]
        lines.append(cells)
    return markdown_table(["quantity", "n", "recorded people", *head], lines)


def displacement_table(simulated: Mapping[str, Sequence[FloatArray]]) -> str:
    """Return the displacements after standing as a Markdown table: 99th percentile, maximum."""
    lines = [
        [
            f"{after_s:g} s",
            f"{high_m:.2f}, {most_m:.2f} m",
            *(
                f"{np.percentile(values[row], 99):.2f}, {values[row].max():.2f} m"
                for values in simulated.values()
            ),
        ]
        for row, (after_s, high_m, most_m) in enumerate(DISPLACEMENTS)
    ]
    return markdown_table(["after", "recorded people", *_names(simulated)], lines)


def start_table(simulated: Mapping[str, Mapping[str, Sequence[tuple[int, int]]]]) -> str:
    """Return the shares of people who start within 1 s as a Markdown table."""
    names = ["now", *_ago(), "longer or never"]
    lines = []
    for robot, shares in START_SHARES.items():
        for row, share in enumerate(shares):
            cells = [robot, names[row], f"{100.0 * share:.0f} %"]
            for counts in simulated.values():
                begun, chances = counts[robot][row]
                cells.append(f"{100.0 * begun / max(chances, 1):.0f} % of {chances}")
            lines.append(cells)
    return markdown_table(["robot", "last look", "recorded people", *_names(simulated)], lines)


def looked_table(simulated: Mapping[str, Sequence[float]]) -> str:
    """Return the shares of people who had looked as a Markdown table."""
    lines = [
        [
            f"{within:g} s",
            f"{100.0 * share:.0f} %",
            *(f"{100.0 * shares[row]:.0f} %" for shares in simulated.values()),
        ]
        for row, (within, share) in enumerate(LOOKED)
    ]
    return markdown_table(["looked within", "recorded people", *_names(simulated)], lines)


def draw(
    recorded: Mapping[str, Distribution],
    simulated: Mapping[str, Sequence[Scene]],
    path: Path,
    names: Sequence[str],
) -> None:
    """Draw the distribution functions of some quantities into a PNG file."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - slow, and only for plots

    chosen = [quantity for quantity in QUANTITIES if quantity.name in names]
    columns = 3
    rows = math.ceil(len(chosen) / columns)
    figure = Figure(figsize=(9.0, 2.6 * rows), layout="constrained")
    levels = np.linspace(0.0, 1.0, 101)
    colours = {"classic": "tab:orange", "recorded": "tab:blue"}
    for number, quantity in enumerate(chosen):
        axes = figure.add_subplot(rows, columns, number + 1)
        known = recorded[quantity.name]
        axes.plot(known.quantiles, levels, color="black", linewidth=2.5, label="recorded people")
        for people, scenes in simulated.items():
            values = np.sort(quantity.values(scenes))
            axes.plot(
                np.quantile(values, levels),
                levels,
                color=colours.get(people),
                linewidth=1.3,
                label=f"simulated, {people}",
            )
        low, high = known.percentile(0.5), known.percentile(99.5)
        axes.set_xlim(low - 0.1 * (high - low), high + 0.1 * (high - low))
        axes.set_title(quantity.text, fontsize=8)
        axes.set_xlabel(quantity.unit, fontsize=8)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
        if number == 0:
            axes.legend(fontsize=7, loc="lower right")
    figure.savefig(path, dpi=90)


def _ago() -> list[str]:
    """Return the rows between a look now and none."""
    return [
        f"≤ {within:g} s ago" if last == 0.0 else f"{last:g}–{within:g} s ago"
        for last, within in itertools.pairwise(LOOK_WITHIN_S)
    ]


def _names(populations: Iterable[str]) -> list[str]:
    return [f"`{each}`" for each in populations]


def _percentiles(values: FloatArray) -> tuple[float, ...]:
    return tuple(float(each) for each in np.percentile(values, _PERCENTS))


def _text(values: Sequence[float]) -> str:
    return ", ".join(f"{each:.2f}" if abs(each) < 10.0 else f"{each:.0f}" for each in values)
