"""What a search was asked for: written beside it, so that it is resumed as it was begun."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..world.errors import SimError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def keep_settings(
    settings: DataclassInstance,
    folder: Path,
    file: str,
    what: str,
    *,
    resume: bool,
    may_grow: Sequence[str] = (),
) -> None:
    """Write the settings, or check that they are those of the search that is there.

    Args:
        settings: a dataclass of plain values.
        folder: made when missing.
        file: name of the file.
        what: the search in words, for messages.
        resume: go on with the search that is there.
        may_grow: fields that may be larger than they were.

    Raises:
        SimError: a search is there and ``resume`` is False, there is none and it is True, or it was
            asked for otherwise.
    """
    path = folder / file
    if path.exists():
        if not resume:
            raise SimError(
                f"{folder} already holds a {what}; give --resume to go on with it, or another --out"
            )
        _compare(path, json.loads(json.dumps(asdict(settings))), may_grow)
    elif resume:
        raise SimError(f"--resume: there is no {what} in {folder}, no {file}")
    part = path.with_name(f"{path.name}.{os.getpid()}.part")  # several may begin at once
    try:
        folder.mkdir(parents=True, exist_ok=True)
        part.write_text(json.dumps(asdict(settings), indent=1) + "\n", encoding="utf-8")
        part.replace(path)
    except OSError as cause:
        raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause


def _compare(path: Path, now: dict[str, Any], may_grow: Sequence[str]) -> None:
    try:
        before = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as cause:
        raise SimError(f"cannot read {path}: {cause}") from cause
    for name, value in now.items():
        was = before.get(name)
        if value == was or (name in may_grow and was is not None and value > was):
            continue
        more = " or more" if name in may_grow else ""
        raise SimError(
            f"{path.parent} was begun with another {name}: {_short(was)}, now {_short(value)}; "
            f"give the same{more} again, or another --out"
        )


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
