"""Numbers and lists as a report writes them."""

from __future__ import annotations

import math
from typing import Final

MINUS: Final = "\N{MINUS SIGN}"
THIN: Final = "\N{NARROW NO-BREAK SPACE}"
NOTHING: Final = "–"
# Rounding error of sums; a share this close to 1 is all.
_ROUNDING: Final = 1e-9


def number(value: float | None, decimals: int = 2, *, sign: bool = False) -> str:
    """Return a number with a true minus sign; a dash for None, NaN and infinity."""
    if value is None or not math.isfinite(value):
        return NOTHING
    text = f"{value:+.{decimals}f}" if sign else f"{value:.{decimals}f}"
    if not float(text):
        text = f"{0.0:.{decimals}f}"
    return text.replace("-", MINUS)


def percent(share: float | None, decimals: int | None = None, *, sign: bool = False) -> str:
    """Return a share in per cent.

    By default, shares near 0 and 1 get more decimals, so that 99.75 % does not read as 100 %.
    """
    if share is None or not math.isfinite(share):
        return NOTHING
    if decimals is None:
        rest = min(abs(share), abs(1.0 - abs(share)))
        decimals = 0 if rest >= 0.1 or rest < _ROUNDING else 1 if rest >= 0.01 else 2
    return f"{number(100.0 * share, decimals, sign=sign)}{THIN}%"


def count(amount: int) -> str:
    """Return a whole number with spaces between thousands."""
    return f"{amount:,}".replace(",", THIN)


def plural(amount: int, one: str, many: str | None = None) -> str:
    """Return a number with its noun."""
    return f"{count(amount)} {one if amount == 1 else many or one + 's'}"
