"""The work of ``awarenav models``."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from perception.installation import install_command
from perception.named import DEFAULT_SET, RealModel, Source, default_folder
from perception.shipped import shipped_models, verify_shipped_model

from ..errors import AwarenavError, counted
from ..files import json_text
from ._store import ModelStore

_WIDTH: Final = 100
# Ends of files that LiteRT runs.
_OF_LITERT: Final = (".tflite", ".task")


def list_command(folder: Path | None, *, as_json: bool) -> int:
    """Print the shipped networks and those for a real robot; return the exit status.

    Raises:
        AwarenavError: for a catalogue that cannot be read.
    """
    store = ModelStore(folder)
    if as_json:
        print(json_text(_listing(store)), end="")
        return 0
    print("Shipped, for the simulator; they have seen no real person:\n")
    shipped = shipped_models()
    for model in shipped:
        print(f"  {model.name:20s}{model.size_bytes / 1e6:6.1f} MB  {model.licence}")
        print(_indented(f"{model.summary} Input {model.input}."))
        print(f"    Trained on {model.training_domain}.")
        print(f"    sha256 {model.sha256}  {_shipped_state(model.name)}\n")
    if not shipped:
        print("  none in this build\n")
    print(f"For a real robot, fetched to {store.folder}:\n")
    for real in store.catalogue.models:
        print(f"  {real.name:20s}{real.size_mb:6.1f} MB  {real.licence}  {real.role}")
        print(_indented(f"{real.publisher}: {real.purpose}."))
        if real.note is not None:
            print(_indented(f"Note: {real.note}."))
        print(_indented(f"Trained on {real.trained_on}."))
        for source in real.sources:
            print(f"    From {_place(source)}")
        print(f"    Licence at {real.licence_page}")
        print(f"    sha256 {real.sha256}  {_real_state(store, real)}\n")
    print("Sets, all that a robot needs:\n")
    for each in store.catalogue.sets:
        print(f"  {each.name:20s}{', '.join(each.networks.values())}, head from {each.head}")
        print(_indented(f"{each.purpose}.") + "\n")
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
        "sets": [each.model_dump(mode="json") for each in store.catalogue.sets],
        "named_only": [each.model_dump(mode="json") for each in store.catalogue.elsewhere],
    }


def verify_command(folder: Path | None, *, as_json: bool) -> int:
    """Check every sha256; return the exit status.

    Raises:
        AwarenavError: for a catalogue that cannot be read.
    """
    store = ModelStore(folder)
    states = [(model.name, _shipped_state(model.name)) for model in shipped_models()]
    states += [
        (real.name, _real_state(store, real))
        for real in store.catalogue.models
        if store.is_fetched(real.name)
    ]
    wrong = [name for name, state in states if state != "verified"]
    if as_json:
        print(json_text(dict(states)), end="")
        return 1 if wrong else 0
    for name, state in states:
        print(f"{name:20s}{state}")
    good = len(states) - len(wrong)
    networks = counted(len(states), "network is", "networks are")
    print(f"{good} of {networks} unaltered" if states else "no networks")
    return 1 if wrong else 0


def fetch_command(names: Sequence[str], folder: Path | None, origin: Path | None) -> int:
    """Fetch networks, by their names or those of sets; return the exit status.

    Args:
        names: without one, the first set of the catalogue.
        folder: of the networks; None for the usual one.
        origin: file or folder that the networks are taken from; None for their sources.

    Raises:
        AwarenavError: for an unknown name, and for a network that no source has or that cannot be
            verified.
    """
    store = ModelStore(folder)
    catalogue = store.catalogue
    names = names or [catalogue.sets[0].name]
    sets = [each for each in catalogue.sets if each.name in names]
    members = {each.name: each.networks.values() for each in sets}
    singles = [single for name in names for single in members.get(name, (name,))]
    for name, (path, source) in store.fetch(*singles, origin=origin).items():
        model = catalogue[name]
        if source is None:
            print(f"{name}: already there and unaltered, {path}")
            continue
        print(f"{name}: {path} ({model.licence}, {model.publisher}; from {source})")
        if model.note is not None:
            print(_indented(f"Note: {model.note}."))
    if any(catalogue[name].file.endswith(_OF_LITERT) for name in singles) and not find_spec(
        "ai_edge_litert"
    ):
        print(f"note: LiteRT, which runs these networks, is missing: {install_command('litert')}")
    at_home = store.folder == default_folder()
    for each in sets:
        where = "" if at_home else f"AWARENAV_MODELS={store.folder.resolve()} "
        which = "" if each.name == DEFAULT_SET else f" --networks {each.name}"
        print(f"next: {where}awarenav estimate PHOTO.jpg{which}")
        if each.hint is not None:
            print(f"note: {each.hint}")
    return 0


def _place(source: Source) -> str:
    """Return a source in words, with what brings a package."""
    return source.place + (" (pip)" if source.wheel else " (npm)" if source.npm else "")


def _shipped_state(name: str) -> str:
    return _state(lambda: verify_shipped_model(name))


def _real_state(store: ModelStore, model: RealModel) -> str:
    if not store.is_fetched(model.name):
        return "not fetched"
    return _state(lambda: store.path(model.name))


def _state(check: Callable[[], object]) -> str:
    try:
        check()
    except AwarenavError as error:
        return f"WRONG: {error}"
    return "verified"


def _indented(text: str) -> str:
    return textwrap.fill(text, _WIDTH, initial_indent="    ", subsequent_indent="    ")
