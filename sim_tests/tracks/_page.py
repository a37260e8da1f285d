"""A figure whose parts are placed in inches."""

from __future__ import annotations

from ._canvas import Axes, new_figure
from ._palette import INK


class Page:
    """A page; places are in inches from its upper left corner.

    Args:
        width_in: of the page.
        height_in: of the page.
    """

    def __init__(self, width_in: float, height_in: float) -> None:
        self.figure = new_figure(width_in, height_in)
        self._size = (width_in, height_in)

    def axes(self, left: float, top: float, width: float, height: float) -> Axes:
        """Empty axes."""
        across, down = self._size
        return self.figure.add_axes(
            (left / across, 1.0 - (top + height) / down, width / across, height / down)
        )

    def write(self, left: float, base: float, text: str, *, size: float, weight: str = "") -> None:
        """A line of text on its base line."""
        self.figure.text(
            left / self._size[0],
            1.0 - base / self._size[1],
            text,
            fontsize=size,
            weight=weight or "normal",
            color=INK,
        )
