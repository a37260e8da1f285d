"""Installation commands for what is missing, in the words of the installation that runs.

An installation from an index is extended by ``pip install 'awarenav[sim]'``. One from a checkout or
an archive is not: that line would look for an index which may not have this version. Installers
record the place they installed from (PEP 610, ``direct_url.json``).
"""

from __future__ import annotations

import json
import shlex
import sys
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit
from urllib.request import url2pathname

_NAME: Final = "awarenav"
# pyproject.toml leaves PyBullet out on later ones.
_NEWEST_OF_PYBULLET: Final = (3, 11)
_CHECKOUT: Final = Path(__file__).parents[1]


def install_command(extras: str = "", options: str = "") -> str:
    """Return the pip command that installs this version again, with extras.

    Args:
        extras: names of extras with commas between them, for example ``"sim,bench"``.
        options: further options of ``pip install``.
    """
    words = ["pip", "install", *options.split()]
    brackets = f"[{extras}]" if extras else ""
    origin = _origin()
    if origin is None:
        words.append(_NAME + brackets)
    elif "dir_info" in origin:
        folder = url2pathname(urlsplit(origin["url"]).path)
        editable = ["-e"] if origin["dir_info"].get("editable") else []
        words += [*editable, folder + brackets]
    else:
        vcs = origin.get("vcs_info")
        url = origin["url"] if vcs is None else f"{vcs['vcs']}+{origin['url']}@{vcs['commit_id']}"
        words.append(f"{_NAME}{brackets} @ {url}")
    return " ".join(shlex.quote(word) for word in words)


def reinstall_command() -> str:
    """Return the pip command that puts files of this installation back."""
    return install_command(options="--force-reinstall --no-deps")


def missing_simulator(module: str, python: tuple[int, int] = sys.version_info[:2]) -> str:
    """Return the message about a missing module of the extra ``sim``, with the way out.

    The line also brings ``bench``, which most commands of the simulator need next.

    Args:
        module: name of the module.
        python: version of Python; PyBullet has no wheels for those after 3.11.
    """
    install = install_command("sim,bench")
    cure = f"it is part of the extra 'sim': {install}"
    if python > _NEWEST_OF_PYBULLET:
        cure = (
            f"PyBullet has no wheel for this Python {'.'.join(map(str, python))}. One with 3.11 "
            "beside it (`pipx install uv` brings uv): `uv venv --python 3.11 && . "
            f".venv/bin/activate && uv {install}`"
        )
    return f"the simulator needs {module}, which is not installed; {cure}"


def _origin() -> dict[str, Any] | None:
    """Return the record of PEP 610, or that of a checkout which is not installed."""
    try:
        text = distribution(_NAME).read_text("direct_url.json")
    except PackageNotFoundError:
        if (_CHECKOUT / "pyproject.toml").is_file():
            return {"url": _CHECKOUT.as_uri(), "dir_info": {"editable": True}}
        return None
    if text is None:
        return None
    try:
        origin = json.loads(text)
    except ValueError:  # damaged: the name alone is the best guess
        return None
    if not (isinstance(origin, dict) and isinstance(origin.get("url"), str)):
        return None
    return origin
