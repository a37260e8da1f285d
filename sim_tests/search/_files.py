"""The files of a search: its settings, which a resumed search must repeat, and its tables."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from perception.documents import parse_json, read_json

from ..crossing import named_policy
from ..scenario import ScenarioTemplate
from ..study.runs import named_templates, policy_text
from ..world.errors import SimError
from ._process_lock import ProcessLock

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

# The files of every search. The log of a database that is gone is never replayed.
_STUDY: Final = ("study.db", "study.db-*")
_LOCKS: Final = ("locks/*.lock",)


def common_settings(
    policy: str, scenarios: Sequence[str], camera: str, population: str = "", robot: str = ""
) -> dict[str, Any]:
    """Return the settings that tuning and falsification share, as plain values.

    Args:
        policy: name of a preset, or a YAML file.
        scenarios: shipped names, YAML files, or ``"all"``.
        camera: as for :meth:`ScenarioTemplate.with_camera`.
        population: as for :meth:`ScenarioTemplate.with_population`.
        robot: as for :meth:`ScenarioTemplate.with_robot`.

    Returns:
        ``policy_name``, and ``policy`` and ``scenarios`` as YAML.

    Raises:
        SimError: an unknown scenario, camera or robot.
        NavError: an unusable policy.
    """
    name, own_policy = named_policy(policy)
    return {
        "policy_name": name,
        "policy": policy_text(own_policy),
        "scenarios": tuple(
            each.to_text() for each in named_templates(scenarios, camera, population, robot)
        ),
    }


def templates_of(scenarios: Iterable[str]) -> tuple[ScenarioTemplate, ...]:
    """Return the scenarios of settings, which hold them as YAML."""
    return tuple(ScenarioTemplate.from_text(text) for text in scenarios)


def write_or_check_settings(
    settings: DataclassInstance,
    folder: Path,
    file: str,
    search: str,
    *,
    resume: bool,
    overwrite: bool = False,
    results: Sequence[str] = (),
    may_grow: Sequence[str] = (),
) -> None:
    """Write the settings of a new search, or check that a resumed search has the same.

    Args:
        settings: a dataclass of plain values.
        folder: made when missing.
        file: name of the file.
        search: name of the search in messages: ``"tuning"`` or ``"falsification"``.
        resume: continue the search in the folder.
        overwrite: remove the search in the folder first.
        results: patterns of the result files of the search, which ``overwrite`` removes.
        may_grow: fields that may be larger than in the file.

    Raises:
        SimError: the folder holds a search and neither ``resume`` nor ``overwrite`` is True, it
            holds none and ``resume`` is True, another process works in it (with ``overwrite``), it
            holds results of something else, or the settings differ.
    """
    path = folder / file
    if path.exists() and overwrite:
        _remove_search(path, search, results)
    elif path.exists():
        if not resume:
            raise SimError(
                f"{folder} already holds a {search}; give --resume to go on with it, --overwrite "
                "to replace it, or another --out"
            )
        _compare(path, parse_json(json.dumps(asdict(settings)), file, SimError), may_grow)
    elif resume:
        raise SimError(f"--resume: there is no {search} in {folder}, no {file}")
    else:
        foreign = [each.name for each in _matching(folder, (*_STUDY, *results))]
        if foreign:
            raise SimError(
                f"{folder} holds {foreign[0]} but no {file}, so it is not the folder of a "
                f"{search}; choose another --out"
            )
    part = path.with_name(f"{path.name}.{os.getpid()}.part")  # several processes may write it
    try:
        folder.mkdir(parents=True, exist_ok=True)
        part.write_text(json.dumps(asdict(settings), indent=1) + "\n", encoding="utf-8")
        part.replace(path)
    except OSError as cause:
        raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV file that appears whole or not at all."""
    part = path.with_name(path.name + ".part")
    with part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
    part.replace(path)


def _remove_search(settings: Path, search: str, results: Sequence[str]) -> None:
    """Remove a search; its settings go last, so that a kill leaves one that can be removed.

    Raises:
        SimError: another process works in the folder, or a file cannot be removed.
    """
    folder = settings.parent
    with ExitStack() as stack:
        for path in _matching(folder, _LOCKS):
            if not stack.enter_context(ProcessLock(path, wait=False)).held:
                raise SimError(f"another process works on the {search} in {folder}")
        try:
            for path in (*_matching(folder, (*_STUDY, *results)), settings):
                path.unlink(missing_ok=True)
        except OSError as cause:
            raise SimError(f"cannot replace {settings}: {cause.strerror or cause}") from cause


def _matching(folder: Path, patterns: Sequence[str]) -> list[Path]:
    """Return the files in a folder that match one of the patterns."""
    return [path for pattern in patterns for path in sorted(folder.glob(pattern))]


def _compare(path: Path, now: dict[str, Any], may_grow: Sequence[str]) -> None:
    """Raise SimError for the first setting that differs from the file."""
    before = read_json(path, SimError)
    if not isinstance(before, dict):
        raise SimError(f"{path} must hold settings by name, got {before!r:.60}")
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
