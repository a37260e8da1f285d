"""A figure whose axes are placed in inches, and its colours."""

from __future__ import annotations

from typing import Final

from ..figures import Axes, new_figure

TEXT_COLOUR: Final = "#28282e"
FAINT_COLOUR: Final = "#8a8f98"
UNSEEN_COLOUR: Final = "#e4e5e9"
CAMERA_COLOUR: Final = "#26548c"
BACKGROUND_COLOUR: Final = "#ffffff"

_DPI: Final = 150
# Ten hues that are dark enough for a thin line on white, then the same hues darker or duller.
_TRACK_COLOURS: Final = (
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


def track_colour(index: int) -> str:
    """Return the colour of the track with this index; the colours repeat after twenty."""
    return _TRACK_COLOURS[index % len(_TRACK_COLOURS)]


class Page:
    """A figure; positions are in inches from its upper left corner.

    Args:
        width_in: width, inches.
        height_in: height, inches.
    """

    def __init__(self, width_in: float, height_in: float) -> None:
        self.figure = new_figure(width_in, height_in, dpi=_DPI, constrained=False)
        self._size = (width_in, height_in)

    def axes(self, left: float, top: float, width: float, height: float) -> Axes:
        """Add empty axes."""
        page_width, page_height = self._size
        return self.figure.add_axes(
            (
                left / page_width,
                1.0 - (top + height) / page_height,
                width / page_width,
                height / page_height,
            )
        )

    def write(self, left: float, base: float, text: str, *, size: float, weight: str = "") -> None:
        """Write a line of text on the base line ``base``."""
        self.figure.text(
            left / self._size[0],
            1.0 - base / self._size[1],
            text,
            fontsize=size,
            weight=weight or "normal",
            color=TEXT_COLOUR,
        )
