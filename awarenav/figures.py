"""Matplotlib figures without a display; no other module of awarenav imports matplotlib."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import count, product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Ellipse, Patch, Polygon, Rectangle, Wedge
from matplotlib.text import Text
from matplotlib.ticker import MultipleLocator
from matplotlib.transforms import Bbox
from PIL import Image  # a dependency of matplotlib

from .files import atomic_path, printable

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
    "label_points",
    "new_figure",
    "save_figure",
    "scale_by_roots",
]


#: A label may lie over other points from this ring of places on, and never over another label.
_RINGS = 8


def new_figure(
    width_in: float, height_in: float, *, dpi: float = 100.0, constrained: bool = True
) -> Figure:
    """Return an empty white figure.

    Args:
        width_in: width, inches.
        height_in: height, inches.
        dpi: pixels per inch.
        constrained: whether matplotlib's constrained layout places the axes.
    """
    figure = Figure(
        figsize=(width_in, height_in),
        dpi=dpi,
        facecolor="white",
        layout="constrained" if constrained else None,
    )
    FigureCanvasAgg(figure)
    return figure


def scale_by_roots(axes: Axes, highest: float) -> None:
    """Scale the y axis, which begins at 0, by square roots, so that small values show.

    Args:
        axes: the axes.
        highest: the highest value. Points at 0 lie free of the axis.
    """

    def root(y: Any) -> Any:
        return np.sign(y) * np.sqrt(np.abs(y))

    def square(y: Any) -> Any:
        return np.sign(y) * np.square(y)

    axes.set_yscale("function", functions=(root, square))
    axes.set_ylim(bottom=-0.004 * max(highest, 1.0))


def label_points(axes: Axes, labels: Iterable[tuple[float, float, str, str]]) -> None:
    """Write labels beside points: none over another one, or over the point of another one.

    Everything else must have been drawn, as the places depend on the scales and the layout.

    Args:
        axes: the axes.
        labels: x, y, text and colour of each.
    """
    labels = list(labels)
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()
    points = axes.transData.transform([(x, y) for x, y, _, _ in labels] or np.empty((0, 2)))
    taken: list[Bbox] = []
    for number, (x, y, text, colour) in enumerate(labels):
        places = np.delete(points, number, axis=0).tolist()
        others = [Bbox.from_bounds(at - 4.0, above - 4.0, 8.0, 8.0) for at, above in places]
        label = axes.annotate(
            text, (x, y), xytext=(0, 0), textcoords="offset points", color=colour, fontsize=9
        )
        for ring, up, right in (
            (n, *sides) for n in count() for sides in product((1, -1), (1, -1))
        ):
            label.set(ha="left" if right > 0 else "right", va="bottom" if up > 0 else "top")
            label.set_position((right * (4.0 + 2.0 * ring), up * (3.0 + 4.0 * ring)))
            box = label.get_window_extent()
            if not any(map(box.overlaps, taken + [each for each in others if ring < _RINGS])):
                break
        taken.append(box)


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as :func:`~awarenav.files.atomic_path` does, in the format of the suffix.

    Equal figures give equal files.

    Raises:
        AwarenavError: for a place that cannot be written.
    """
    # A date and random names in the file would make two runs differ.
    for text in figure.findobj(Text):
        if (shown := printable(text.get_text())) != text.get_text():
            text.set_text(shown)
    date = {".svg": "Date", ".pdf": "CreationDate"}.get(path.suffix.lower())
    with atomic_path(path) as part, rc_context({"svg.hashsalt": "awarenav"}):
        figure.savefig(
            part,
            format=path.suffix[1:].lower(),
            metadata=None if date is None else {date: None},
        )
