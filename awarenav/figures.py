"""Figures drawn by matplotlib without a display; the one module that imports matplotlib."""

from __future__ import annotations

from pathlib import Path

from .errors import AwarenavError, MissingExtraError

try:
    from matplotlib import rc_context
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec
    from matplotlib.lines import Line2D
    from matplotlib.patches import Circle, Ellipse, Patch, Polygon, Rectangle, Wedge
    from matplotlib.ticker import MultipleLocator
    from PIL import Image  # matplotlib brings it
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise MissingExtraError(
        "a plot needs matplotlib, which is not installed: pip install matplotlib, or the extra "
        "'sim' that it is part of: pip install 'awarenav[sim]'; tables alone (--out none) work "
        "without it"
    ) from cause

__all__ = [
    "Axes",
    "Circle",
    "Ellipse",
    "Figure",
    "GridSpec",
    "Image",
    "Line2D",
    "MultipleLocator",
    "Patch",
    "Polygon",
    "QuadMesh",
    "Rectangle",
    "Wedge",
    "new_figure",
    "save_figure",
]


def new_figure(
    width_in: float, height_in: float, *, dpi: float = 100.0, constrained: bool = True
) -> Figure:
    """Return an empty white figure that is drawn without a display.

    Args:
        width_in: inches.
        height_in: inches.
        dpi: pixels an inch.
        constrained: let matplotlib place the axes.
    """
    figure = Figure(
        figsize=(width_in, height_in),
        dpi=dpi,
        facecolor="white",
        layout="constrained" if constrained else None,
    )
    FigureCanvasAgg(figure)
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure whole or not at all; the ending says the format.

    Raises:
        AwarenavError: for a place that cannot be written.
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
        raise AwarenavError(f"cannot write {path}: {cause.strerror or cause}") from cause
    finally:
        part.unlink(missing_ok=True)
