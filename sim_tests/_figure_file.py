"""A figure written to a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ._errors import SimError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure whole or not at all; the ending says the format.

    Raises:
        SimError: for a place that cannot be written.
    """
    from matplotlib import rc_context  # noqa: PLC0415 - whoever has a figure has it

    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Dates of the day and random names inside the file would make two runs differ.
        date = {".svg": "Date", ".pdf": "CreationDate"}.get(path.suffix.lower())
        with rc_context({"svg.hashsalt": "awarenav"}):
            figure.savefig(
                part,
                format=path.suffix[1:].lower(),
                metadata=None if date is None else {date: None},
            )
        part.replace(path)
    except OSError as cause:
        raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause
    finally:
        part.unlink(missing_ok=True)
