"""The colour of awareness, the same in every picture."""

from __future__ import annotations

from typing import Final

import numpy as np

Colour = tuple[int, int, int]

_UNKNOWN: Final[Colour] = (150, 152, 160)
_UNAWARE: Final = np.array([222.0, 66.0, 52.0])
_UNCERTAIN: Final = np.array([240.0, 172.0, 46.0])
_AWARE: Final = np.array([52.0, 178.0, 108.0])


def awareness_colour(alpha: float | None) -> Colour:
    """Red for unaware over amber to green for aware; grey for no evidence."""
    if alpha is None:
        return _UNKNOWN
    low, high = (_UNAWARE, _UNCERTAIN) if alpha < 0.5 else (_UNCERTAIN, _AWARE)
    share = 2.0 * alpha if alpha < 0.5 else 2.0 * alpha - 1.0
    red, green, blue = (low + share * (high - low)).round().astype(int).tolist()
    return red, green, blue
