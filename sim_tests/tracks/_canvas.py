"""The one place of this room that imports matplotlib: an empty figure, and a whole file of it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from .._errors import MissingSimulatorError, SimError

try:
    from matplotlib import rc_context
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec
    from matplotlib.lines import Line2D
    from matplotlib.patches import Ellipse, Patch, Wedge
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise MissingSimulatorError(
        "a plot needs matplotlib, which is not installed: pip install matplotlib, or the extra "
        "'sim' that it is part of: pip install 'awarenav[sim]'; tables alone (--out none) work "
        "without it"
    ) from cause

__all__ = [
    "Axes",
    "Ellipse",
    "Figure",
    "GridSpec",
    "Line2D",
    "Patch",
    "Wedge",
    "new_figure",
    "save_figure",
]

_DPI: Final = 150


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure that is drawn without a display."""
    figure = Figure(figsize=(width_in, height_in), dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure whole or not at all; the ending says the format.

    Raises:
        SimError: for a place that cannot be written.
    """
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Dates of the day and random names inside the file would make two runs differ.
        date = {".svg": "Date", ".pdf": "CreationDate"}.get(path.suffix.lower())
        with rc_context({"svg.hashsalt": "awarenav"}):
            figure.savefig(
                part,
                format=path.suffix[1:].lower(),
                metadata=None if date is None else {date: None},
            )
        part.replace(path)
    except OSError as cause:
        raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause
    finally:
        part.unlink(missing_ok=True)
