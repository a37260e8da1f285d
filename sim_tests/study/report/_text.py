"""Numbers as the page writes them."""

from __future__ import annotations

import math
from typing import Final

MINUS: Final = "\N{MINUS SIGN}"
THIN: Final = "\N{NARROW NO-BREAK SPACE}"
NOTHING: Final = "–"
# What sums of floats leave between all and all.
_ROUNDING: Final = 1e-9


def number(value: float | None, decimals: int = 2, *, sign: bool = False) -> str:
    """A number with a true minus sign; a dash for None and what is not finite."""
    if value is None or not math.isfinite(value):
        return NOTHING
    text = f"{value:+.{decimals}f}" if sign else f"{value:.{decimals}f}"
    if not float(text):
        text = f"{0.0:.{decimals}f}"
    return text.replace("-", MINUS)


def percent(share: float | None, decimals: int | None = None, *, sign: bool = False) -> str:
    """A share in per cent.

    Small shares, and those near all, get decimals unless told otherwise: almost all is not all.
    """
    if share is None or not math.isfinite(share):
        return NOTHING
    if decimals is None:
        rest = min(abs(share), abs(1.0 - abs(share)))
        decimals = 0 if rest >= 0.1 or rest < _ROUNDING else 1 if rest >= 0.01 else 2
    return f"{number(100.0 * share, decimals, sign=sign)}{THIN}%"


def count(amount: int) -> str:
    """A whole number, thousands set apart."""
    return f"{amount:,}".replace(",", THIN)


def plural(amount: int, one: str, many: str | None = None) -> str:
    """A number and its noun."""
    return f"{count(amount)} {one if amount == 1 else many or one + 's'}"


def listed(names: list[str]) -> str:
    """Names in a sentence: ``a, b and c``."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
