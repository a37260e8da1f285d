"""Types of option values, with messages that name what is valid and what is nearest."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any, Final

import click


class Whole(click.ParamType[int]):
    """A whole number of at least ``least``."""

    name = "whole number"

    def __init__(self, least: int) -> None:
        self.least = least

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number, or fail and say what is valid."""
        try:
            number = int(value)
        except ValueError:
            number = self.least - 1
        if number < self.least:
            self.fail(
                f"must be a whole number of at least {self.least}, got {str(value)!r}", param, ctx
            )
        return number


#: A whole number of at least 1.
POSITIVE: Final = Whole(1)
#: A number from 0 to 1.
SHARE: Final = click.FloatRange(min=0.0, max=1.0)


class OneOf(click.Choice[str]):
    """One of some words; the message for any other names the nearest."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the word, or fail with the nearest valid one."""
        if value not in self.choices:
            near = difflib.get_close_matches(str(value), self.choices, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            valid = ", ".join(self.choices)
            self.fail(f"must be one of {valid}, got {str(value)!r}{hint}", param, ctx)
        return str(value)


class FilePath(click.Path):
    """A file, as :class:`pathlib.Path`; whether it exists is the command's business."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)


class FolderPath(click.Path):
    """A folder, as :class:`pathlib.Path`; completion offers folders only."""

    def __init__(self) -> None:
        super().__init__(path_type=Path, file_okay=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path; a command says itself what is wrong with a folder."""
        return Path(value)
