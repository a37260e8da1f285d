"""Scenario and camera files: the shipped ones, users' own, and the defaults that they share."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from importlib import resources
from pathlib import Path
from typing import Any, Final

from awarenav.errors import not_one_of
from perception import documents
from tracking.config import other_kind

from ..conditions import SCENARIO_SETS
from ..world.errors import SimError

_FOLDER: Final = resources.files("sim_tests.scenario") / "shipped"
# The folder of each set of shipped scenarios.
_SETS: Final = {name: _FOLDER / ("" if name == "all" else name) for name in SCENARIO_SETS}
_DEFAULTS: Final = _FOLDER / "defaults"
_CAMERAS: Final = _FOLDER / "cameras"


def shipped_scenarios(scenario_set: str = "all") -> tuple[str, ...]:
    """Return the names of a set of the scenarios that come with the package, sorted."""
    if scenario_set not in _SETS:
        raise SimError(not_one_of("set of scenarios", scenario_set, SCENARIO_SETS))
    return _names_in(_SETS[scenario_set])


def shipped_text(name: str) -> tuple[str, str]:
    """Return the plain name and the YAML of a shipped scenario.

    Args:
        name: such as ``name``, or ``name@2`` with a version; see :func:`require_version`.
    """
    plain = str(name).partition("@")[0]
    folders = {name: folder for folder in _SETS.values() for name in _names_in(folder)}
    if plain not in folders:
        if (resources.files("nav_adapter.policies") / f"{plain}.yaml").is_file():
            raise SimError(f"{plain!r} is a policy, not a scenario; give it with --policy")
        names = (*folders, *SCENARIO_SETS)
        raise SimError(not_one_of("scenario", plain, names, listed_by="awarenav scenario list"))
    return plain, (folders[plain] / f"{plain}.yaml").read_text("utf-8")


def require_version(name: str, version: int) -> None:
    """Check the version in a name such as ``name@2``; a name without one is always right."""
    plain, at, wanted = str(name).partition("@")
    if at and wanted != str(version):
        raise SimError(
            f"scenario {plain!r} has version {version}, got {name!r}: results of different "
            "versions cannot be compared"
        )


def shipped_cameras() -> tuple[str, ...]:
    """Return the names of the cameras that come with the package, sorted."""
    return _names_in(_CAMERAS)


def camera_data(name: str) -> dict[str, Any]:
    """Return the keys of a scenario's ``camera``, from a YAML file or a shipped camera's name."""
    if name.endswith((".yaml", ".yml")):
        return _completed(documents.read_yaml(Path(name), SimError), name)
    names = shipped_cameras()
    if name not in names:
        raise SimError(not_one_of("camera", name, names, or_else="a YAML file"))
    return parse_yaml((_CAMERAS / f"{name}.yaml").read_text("utf-8"), name)


def read_file(path: Path, keys: Iterable[str]) -> dict[str, Any]:
    """Return the mapping in a scenario's file, with an absolute path as ``replay_csv``.

    In the file ``replay_csv`` is relative to the file's own folder.

    Raises:
        SimError: naming the file, when it cannot be read, holds no YAML mapping or is of another
            kind than a scenario, whose ``keys`` are given.
    """
    data = _completed(documents.read_yaml(path, SimError), str(path))
    kind = other_kind(data, keys)
    if kind:
        raise SimError(f"{path}: this is {kind}, not a scenario")
    replay = data.get("replay_csv")
    if isinstance(replay, str):
        data["replay_csv"] = str((path.parent / replay).resolve())
    return data


def parse_yaml(text: str, source: str) -> dict[str, Any]:
    """Return the mapping in a scenario's YAML, with the shared defaults filled in.

    ``extends: NAME`` takes the keys of ``shipped/defaults/NAME.yaml`` that the file does not have.
    Mappings are merged key by key, everything else is replaced.

    Raises:
        SimError: for text that is not a YAML mapping, and for unknown defaults.
    """
    return _completed(documents.parse_yaml(text, source, SimError), source)


def _completed(data: Any, source: str) -> dict[str, Any]:
    """Return the keys of a scenario with the defaults that it extends."""
    keys = documents.keys_of(data, source, SimError)
    if "extends" not in keys:
        return keys
    names = _names_in(_DEFAULTS)
    name = keys.pop("extends")
    if name not in names:
        raise SimError(f"{source}: {not_one_of('extends', name, names)}")
    defaults = parse_yaml((_DEFAULTS / f"{name}.yaml").read_text("utf-8"), str(name))
    return _merged(defaults, keys)


def _merged(defaults: dict[str, Any], data: dict[str, Any]) -> dict[str, Any]:
    merged = copy.deepcopy(defaults)
    for key, value in data.items():
        default = merged.get(key)
        if isinstance(default, dict) and isinstance(value, dict):
            merged[key] = _merged(default, value)
        else:
            merged[key] = value
    return merged


def _names_in(folder: Any) -> tuple[str, ...]:
    return tuple(
        sorted(
            entry.name.removesuffix(".yaml")
            for entry in folder.iterdir()
            if entry.name.endswith(".yaml")
        )
    )
