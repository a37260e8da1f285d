"""One colour an identity, told apart on white."""

from __future__ import annotations

from typing import Final

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
