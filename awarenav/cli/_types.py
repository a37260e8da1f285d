"""Types of option values; a refusal says what is valid and which valid word is nearest."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any, Final

import click

from ..errors import not_one_of

# No computer finishes more episodes, seeds or frames.
_MOST: Final = 10**8


class Whole(click.IntRange):
    """A whole number within limits, ``Whole(1)`` or ``Whole(1, 9)``."""

    name = "whole number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number, or fail: nothing has more than :data:`_MOST`."""
        number = super().convert(value, param, ctx)
        if number > _MOST:
            self.fail(f"must be at most {_MOST}, got {number}", param, ctx)
        return number


class Number(click.FloatRange):
    """A finite number within limits, ``Number(0.0, 1.0)``."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number, or fail: NaN is within all limits."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"must be finite, got {value}", param, ctx)
        return number

    def _describe_range(self) -> str:
        """Return the limits as help says them; click has "x<=None" for none."""
        return "" if self.min is None and self.max is None else super()._describe_range()


#: A whole number of at least 1.
POSITIVE: Final = Whole(1)
#: Any finite number.
NUMBER: Final = Number()
#: A number from 0 to 1.
SHARE: Final = Number(0.0, 1.0)
#: The path of a file; the command itself checks whether the file exists.
FilePath = partial(click.Path, path_type=Path)
#: The path of a folder, which need not exist.
FolderPath = partial(click.Path, path_type=Path, file_okay=False)


class OneOf(click.Choice[str]):
    """One of several words; the message about another word names the nearest."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the word, or fail and name the nearest valid one."""
        if value not in self.choices:
            self.fail(not_one_of("the word", str(value), self.choices), param, ctx)
        return str(value)


class Seeds(click.ParamType[tuple[int, ...]]):
    """Seeds: a number of them from 0 on, or the first and the last."""

    name = "seeds"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, ...]:
        """Return the seeds, or fail and say what is valid."""
        if isinstance(value, tuple):
            return value
        first, dash, last = str(value).partition("-")
        try:
            seeds = range(int(first), int(last) + 1) if dash else range(int(first))
        except ValueError:
            seeds = range(0)
        if not 0 < seeds.stop - seeds.start <= _MOST:
            self.fail(
                f"must be a number of seeds from 1 to {_MOST}, or the first and the last as 10-19, "
                f"got {str(value)!r}",
                param,
                ctx,
            )
        return tuple(seeds)


class WordAndNumbers(OneOf):
    """One of several words, numbers as ``key=value,key=value``, or both: ``word,key=value``.

    The command itself knows the keys.
    """

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the text, or fail and name the nearest valid word."""
        words = str(value).split(",")
        if "=" not in words[0]:
            super().convert(words.pop(0), param, ctx)
        if not all(word.partition("=")[2] for word in words):
            self.fail(f"must hold KEY=VALUE after a comma, got {str(value)!r}", param, ctx)
        return str(value)
