"""The command ``awarenav models``."""

from __future__ import annotations

import argparse
import re
import sys
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from ._catalogue import RealModel
    from ._store import ModelStore

_SHA256: Final = re.compile(r"[0-9a-fA-F]{64}")
_WIDTH: Final = 100
_FOLDER_HELP: Final = (
    "folder of fetched networks (default: $AWARENAV_MODELS, or awarenav/models in the user's cache)"
)


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``models`` with its three verbs to the command line."""
    models = commands.add_parser(
        "models",
        help="the networks in the box, and those for a real robot",
        description="The networks that come in the box are made for the simulator. List them and "
        "those to use on a real robot, verify what is here, and fetch the others from their "
        "publishers.",
    )
    verbs = models.add_subparsers(dest="verb", required=True, metavar="VERB")

    listing = verbs.add_parser(
        "list",
        help="what is in the box, and what can be fetched",
        description="List the shipped networks with size, sha256 and whether they are unaltered, "
        "and the networks for a real robot with size, licence, address and whether fetched.",
    )
    _add_out(listing)
    listing.set_defaults(run=_list)

    verify = verbs.add_parser(
        "verify",
        help="check every sha256; exit status 1 when one is wrong",
        description="Check the sha256 of the shipped networks and of the fetched ones; exit status "
        "1 when a file is missing or altered.",
    )
    _add_out(verify)
    verify.set_defaults(run=_verify)

    fetch = verbs.add_parser(
        "fetch",
        help="download networks for a real robot",
        description="Download networks by the names of 'awarenav models list'. A download that "
        "breaks off goes on when the command is run again; a file appears when it is whole and "
        "verified. Where no sha256 is known beforehand, the first download is trusted, its sha256 "
        "kept in models.lock.json, and every later one held to it.",
    )
    fetch.add_argument("names", nargs="+", metavar="NAME", help="as yolox-tiny or rtmpose-m")
    fetch.add_argument(
        "--sha256",
        type=_hexadecimal,
        metavar="HEX",
        help="what the ONNX file must have, from a source you trust; for a single NAME",
    )
    _add_out(fetch)
    fetch.set_defaults(run=_fetch)


def _add_out(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, metavar="DIR", help=_FOLDER_HELP)


def _hexadecimal(text: str) -> str:
    if not _SHA256.fullmatch(text):
        raise argparse.ArgumentTypeError(f"must be 64 hexadecimal digits, got {text!r}")
    return text.lower()


def _list(options: argparse.Namespace) -> int:
    from perception.shipped import shipped_models  # noqa: PLC0415 - help needs no networks

    from ._store import ModelStore  # noqa: PLC0415

    store = ModelStore(options.out)
    print("In the box, made for the simulator:\n")
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
            print(_indented(f"Mind: {real.note}."))
        print(f"    {real.url}")
        print(f"    sha256 {_hash_text(store, real)}  {_real_state(store, real)}\n")
    print("Named only, not fetched:\n")
    for other in store.catalogue.elsewhere:
        print(f"  {other.name}  {other.licence}  {other.role}")
        print(_indented(f"{other.why}.") + "\n")
    return 0


def _verify(options: argparse.Namespace) -> int:
    from perception.shipped import shipped_models  # noqa: PLC0415

    from ._store import ModelStore  # noqa: PLC0415

    store = ModelStore(options.out)
    states = [(model.name, _shipped_state(model.name)) for model in shipped_models()]
    locked = store.locked()
    states += [
        (real.name, _real_state(store, real))
        for real in store.catalogue.models
        if store.is_fetched(real.name) or real.name in locked
    ]
    for name, state in states:
        print(f"{name:16s}{state}")
    wrong = [name for name, state in states if not state.startswith("verified")]
    good = len(states) - len(wrong)
    print(f"{good} of {len(states)} networks are what they should be" if states else "none here")
    return 1 if wrong else 0


def _fetch(options: argparse.Namespace) -> int:
    from .._errors import SimError  # noqa: PLC0415
    from ._store import ModelStore  # noqa: PLC0415

    if options.sha256 is not None and len(options.names) > 1:
        raise SimError(f"--sha256 is for a single name, got {len(options.names)}")
    store = ModelStore(options.out)
    wanted = [store.catalogue[name] for name in dict.fromkeys(options.names)]
    for model in wanted:
        trusted = options.sha256 or store.expected_sha256(model.name)
        path, downloaded = store.fetch(model.name, sha256=options.sha256)
        if not downloaded:
            print(f"{model.name}: already there and unaltered, {path}")
            continue
        print(f"{model.name}: {path} ({model.licence}, {model.publisher})")
        if model.note is not None:
            print(_indented(f"Mind: {model.note}."))
        if trusted is None:
            print(
                _indented(
                    f"Its sha256 {store.expected_sha256(model.name)} was not known beforehand: "
                    "this first download was trusted, later ones are held to it."
                ),
                file=sys.stderr,
            )
    return 0


def _shipped_state(name: str) -> str:
    from perception import PerceptionError  # noqa: PLC0415
    from perception.shipped import verify_shipped_model  # noqa: PLC0415

    try:
        verify_shipped_model(name)
    except PerceptionError as error:
        return f"WRONG: {error}"
    return "verified"


def _real_state(store: ModelStore, model: RealModel) -> str:
    from .._errors import SimError  # noqa: PLC0415

    if not store.is_fetched(model.name) and model.name not in store.locked():
        return "not fetched"
    try:
        store.path(model.name)
    except SimError as error:
        return f"WRONG: {error}"
    return "verified" if model.sha256 is not None else "verified as first fetched"


def _hash_text(store: ModelStore, model: RealModel) -> str:
    if model.sha256 is not None:
        return model.sha256
    kept = store.expected_sha256(model.name)
    return "not known beforehand" if kept is None else f"{kept} (first fetched)"


def _indented(text: str) -> str:
    return textwrap.fill(text, _WIDTH, initial_indent="    ", subsequent_indent="    ")
