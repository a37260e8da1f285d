"""Types of option values; a refusal says what is valid and which valid word is nearest."""

from __future__ import annotations

import difflib
import math
from pathlib import Path
from typing import Any, Final

import click


class Whole(click.ParamType[int]):
    """A whole number within limits."""

    name = "whole number"

    def __init__(self, least: int, most: int | None = None) -> None:
        self.least = least
        self.most = most

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number, or fail and say what is valid."""
        try:
            number = int(value)
        except ValueError:
            number = self.least - 1
        if number < self.least or (self.most is not None and number > self.most):
            limits = (
                f"of at least {self.least}"
                if self.most is None
                else f"from {self.least} to {self.most}"
            )
            self.fail(f"must be a whole number {limits}, got {str(value)!r}", param, ctx)
        return number


class Number(click.ParamType[float]):
    """A number, within limits if there are any."""

    name = "number"

    def __init__(self, least: float = -math.inf, most: float = math.inf) -> None:
        self.least = least
        self.most = most

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number, or fail and say what is valid."""
        limits = "" if math.isinf(self.least) else f" from {self.least:g} to {self.most:g}"
        try:
            number = float(value)
        except ValueError:
            self.fail(f"must be a number{limits}, got {str(value)!r}", param, ctx)
        if number < self.least or number > self.most:
            self.fail(f"must be a number{limits}, got {str(value)!r}", param, ctx)
        return number


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
        if not seeds:
            self.fail(
                "must be a number of seeds of at least 1, or the first and the last as 10-19, got "
                f"{str(value)!r}",
                param,
                ctx,
            )
        return tuple(seeds)


#: A whole number of at least 1.
POSITIVE: Final = Whole(1)
#: Any number.
NUMBER: Final = Number()
#: A number from 0 to 1.
SHARE: Final = Number(0.0, 1.0)


class OneOf(click.Choice[str]):
    """One of several words; the message about another word names the nearest."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the word, or fail and name the nearest valid one."""
        if value not in self.choices:
            near = difflib.get_close_matches(str(value), self.choices, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            valid = ", ".join(self.choices)
            self.fail(f"must be one of {valid}, got {str(value)!r}{hint}", param, ctx)
        return str(value)


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


class FilePath(click.Path):
    """The path of a file; the command itself checks whether the file exists."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)


class FolderPath(click.Path):
    """The path of a folder; completion offers folders only."""

    def __init__(self) -> None:
        super().__init__(path_type=Path, file_okay=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path; the command itself checks the folder."""
        return Path(value)
