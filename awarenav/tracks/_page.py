"""One colour an identity, told apart on white.

A figure whose parts are placed in inches.
"""

from __future__ import annotations

from typing import Final

from ..figures import Axes, new_figure

INK: Final = "#28282e"
FAINT: Final = "#8a8f98"
SHADE: Final = "#e4e5e9"
CAMERA: Final = "#26548c"
PAPER: Final = "#ffffff"

# Ten hues that are dark enough for a thin line on white, then the same ten darker or duller.
_COLOURS: Final = (
    "#1f77b4",
    "#d95f02",
    "#2e8b45",
    "#c2185b",
    "#7b4fb5",
    "#8c5a3c",
    "#00929e",
    "#a08800",
    "#e0403a",
    "#5c6470",
    "#0b3f78",
    "#8a3c00",
    "#0f5227",
    "#75003a",
    "#44207c",
    "#4d2a14",
    "#004f57",
    "#574a00",
    "#86110d",
    "#22272e",
)


def colour_of(index: int) -> str:
    """The colour of the identity at this place; they come again after twenty."""
    return _COLOURS[index % len(_COLOURS)]


_DPI: Final = 150


class Page:
    """A page; places are in inches from its upper left corner.

    Args:
        width_in: of the page.
        height_in: of the page.
    """

    def __init__(self, width_in: float, height_in: float) -> None:
        self.figure = new_figure(width_in, height_in, dpi=_DPI, constrained=False)
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
