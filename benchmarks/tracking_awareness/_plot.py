"""Plot of one person over time: truth, measurements, estimate and lower bound."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from ._attention import Attention, FloatArray
from ._camera import Measured


def plot(
    path: Path,
    attention: Attention,
    measured: Measured,
    awareness: FloatArray,
    lower: FloatArray,
    threshold: float,
    person: int,
    span_s: float = 20.0,
) -> None:
    """Plot the first ``span_s`` seconds of one person into a file."""
    rows = attention.stamps_s < span_s
    stamps = attention.stamps_s[rows]
    alpha, std = measured.awareness[rows, person], measured.awareness_std[rows, person]
    with mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=(12, 4.5), layout="constrained")
        axes = figure.add_subplot()
        blind, unseen = np.isnan(alpha), ~measured.seen[rows, person]
        for where, colour, label in (
            (blind & ~unseen, "0.90", "seen, no face"),
            (unseen, "0.78", "not seen"),
        ):
            axes.fill_between(
                stamps, 0, 1, where=where, step="mid", color=colour, linewidth=0, label=label
            )
        axes.errorbar(
            stamps, alpha, std, fmt=".", color="tab:orange", alpha=0.35, markersize=4,
            elinewidth=0.6, label="measured α ± σ",
        )  # fmt: skip
        axes.plot(stamps, attention.awareness[rows, person], "k", lw=1.5, label="true α")
        axes.plot(stamps, awareness[rows, person], "tab:blue", lw=1.0, label="awareness")
        axes.plot(stamps, lower[rows, person], "tab:green", lw=1.8, label="awareness_lower")
        axes.axhline(threshold, color="tab:red", lw=0.8, ls="--", label="threshold")
        axes.set(xlim=(stamps[0], stamps[-1]), ylim=(-0.02, 1.02), xlabel="time (s)", ylabel="α")
        figure.legend(loc="outside lower center", ncols=7, frameon=False)
        figure.savefig(path, dpi=110)
