"""The work of ``awarenav models``."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from perception import PerceptionError
from perception.shipped import shipped_models, verify_shipped_model

from ..errors import AwarenavError
from ..files import json_text
from ._catalogue import RealModel
from ._store import ModelStore

_WIDTH: Final = 100


def list_command(folder: Path | None, *, as_json: bool) -> int:
    """Print the shipped networks and those for a real robot; return the exit status.

    Raises:
        AwarenavError: for a catalogue or a lock file that cannot be read.
    """
    store = ModelStore(folder)
    if as_json:
        print(json_text(_listing(store)), end="")
        return 0
    print("Shipped, made for the simulator:\n")
    shipped = shipped_models()
    for model in shipped:
        print(f"  {model.name:16s}{model.size_bytes / 1e6:6.1f} MB  {model.licence}")
        print(_indented(f"{model.summary} Input {model.input}."))
        print(f"    sha256 {model.sha256}  {_shipped_state(model.name)}\n")
    if not shipped:
        print("  none in this build\n")
    print(f"For a real robot, fetched to {store.folder}:\n")
    for real in store.catalogue.models:
        print(f"  {real.name:16s}{real.size_mb:6.1f} MB  {real.licence}  {real.role}")
        print(_indented(f"{real.publisher}: {real.purpose}."))
        if real.note is not None:
            print(_indented(f"Note: {real.note}."))
        print(f"    {real.url}")
        print(f"    sha256 {_hash_text(store, real)}  {_real_state(store, real)}\n")
    print("Named here, but not fetched:\n")
    for other in store.catalogue.elsewhere:
        print(f"  {other.name}  {other.licence}  {other.role}")
        print(_indented(f"{other.why}.") + "\n")
    return 0


def _listing(store: ModelStore) -> dict[str, Any]:
    """Return the contents of the list as plain data."""
    return {
        "folder": str(store.folder),
        "shipped": [
            {**asdict(model), "state": _shipped_state(model.name)} for model in shipped_models()
        ],
        "real_robot": [
            {**model.model_dump(mode="json"), "state": _real_state(store, model)}
            for model in store.catalogue.models
        ],
        "named_only": [each.model_dump(mode="json") for each in store.catalogue.elsewhere],
    }


def verify_command(folder: Path | None, *, as_json: bool) -> int:
    """Check every sha256; return the exit status.

    Raises:
        AwarenavError: for a catalogue or a lock file that cannot be read.
    """
    store = ModelStore(folder)
    states = [(model.name, _shipped_state(model.name)) for model in shipped_models()]
    locked = store.locked()
    states += [
        (real.name, _real_state(store, real))
        for real in store.catalogue.models
        if store.is_fetched(real.name) or real.name in locked
    ]
    wrong = [name for name, state in states if not state.startswith("verified")]
    if as_json:
        print(json_text(dict(states)), end="")
        return 1 if wrong else 0
    for name, state in states:
        print(f"{name:16s}{state}")
    good = len(states) - len(wrong)
    print(f"{good} of {len(states)} networks are unaltered" if states else "no networks")
    return 1 if wrong else 0


def fetch_command(names: Sequence[str], sha256: str | None, folder: Path | None) -> int:
    """Download networks; return the exit status.

    Raises:
        AwarenavError: for an unknown name, and for a download that fails or cannot be verified.
    """
    if sha256 is not None and len(names) > 1:
        raise AwarenavError(f"--sha256 is for a single name, got {len(names)}")
    store = ModelStore(folder)
    wanted = [store.catalogue[name] for name in dict.fromkeys(names)]
    for model in wanted:
        trusted = sha256 or store.expected_sha256(model.name)
        path, downloaded = store.fetch(model.name, sha256=sha256)
        if not downloaded:
            print(f"{model.name}: already there and unaltered, {path}")
            continue
        print(f"{model.name}: {path} ({model.licence}, {model.publisher})")
        if model.note is not None:
            print(_indented(f"Note: {model.note}."))
        if trusted is None:
            print(
                _indented(
                    f"Its sha256 {store.expected_sha256(model.name)} was not known before: this "
                    "first download was trusted, and later ones must match it."
                ),
                file=sys.stderr,
            )
    return 0


def _shipped_state(name: str) -> str:
    try:
        verify_shipped_model(name)
    except PerceptionError as error:
        return f"WRONG: {error}"
    return "verified"


def _real_state(store: ModelStore, model: RealModel) -> str:
    if not store.is_fetched(model.name) and model.name not in store.locked():
        return "not fetched"
    try:
        store.path(model.name)
    except AwarenavError as error:
        return f"WRONG: {error}"
    return "verified" if model.sha256 is not None else "verified as first fetched"


def _hash_text(store: ModelStore, model: RealModel) -> str:
    if model.sha256 is not None:
        return model.sha256
    kept = store.expected_sha256(model.name)
    return "not known before" if kept is None else f"{kept} (of the first download)"


def _indented(text: str) -> str:
    return textwrap.fill(text, _WIDTH, initial_indent="    ", subsequent_indent="    ")
