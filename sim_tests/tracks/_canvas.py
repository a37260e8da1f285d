"""The one place of this room that imports matplotlib: an empty figure, and a whole file of it."""

from __future__ import annotations

from typing import Final

from .._errors import MissingSimulatorError
from .._figure_file import save_figure

try:
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
