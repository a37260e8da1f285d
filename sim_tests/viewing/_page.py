"""The page of a crossing: one HTML file that needs no server and no other file."""

from __future__ import annotations

import html
import json
import os
import sys
import webbrowser
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, Final

from awarenav.files import write_text

from ..world.errors import SimError

#: Most characters of pictures in a page; every second picture is left out until they fit.
MOST_PICTURE_CHARACTERS: Final = 6_000_000
_SCRIPTS: Final = ("plan.js", "charts.js", "player.js")


def page_text(title: str, recording: Mapping[str, Any] | None = None) -> str:
    """Return a page.

    Args:
        title: the page's title.
        recording: ``begin``, ``states``, ``outcome`` and ``note`` of a crossing; None for a page
            that receives them live from its server.
    """
    folder = resources.files("sim_tests.viewing") / "templates"
    data = json.dumps(
        recording, ensure_ascii=False, allow_nan=False, separators=(",", ":")
    ).replace("<", "\\u003c")
    parts = {
        "title": html.escape(title),
        "style": (folder / "watch.css").read_text("utf-8"),
        "script": "\n".join((folder / name).read_text("utf-8") for name in _SCRIPTS),
        "data": data,
    }
    pieces = (folder / "watch.html").read_text("utf-8").split("@@")
    # The odd pieces are the names of parts.
    pieces[1::2] = [parts[name] for name in pieces[1::2]]
    return "".join(pieces)


def write_page(
    path: Path,
    begin: Mapping[str, Any],
    states: Sequence[Mapping[str, Any]],
    outcome: str,
    note: str = "",
) -> None:
    """Write the page of a recorded crossing; the file appears whole or not at all.

    Args:
        path: of the HTML file.
        begin: hall, robot and names.
        states: the states; at least one.
        outcome: one sentence on the end of the crossing.
        note: why there are no pictures; empty where there are.

    Raises:
        SimError: there are no states, or the file cannot be written.
    """
    if not states:
        raise SimError(f"cannot write {path}: the crossing has no states")
    title = f"{begin['scenario']}, seed {begin['seed']}, policy {begin['policy']}"
    recording = {"begin": begin, "states": _thinned(states), "outcome": outcome, "note": note}
    write_text(path, page_text(title, recording), SimError)


def show_page(address: str) -> bool:
    """Open an address in the browser if there is a display; return whether one was opened."""
    has_display = sys.platform in ("win32", "darwin") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )
    return has_display and webbrowser.open(address)


def _thinned(states: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return the states with as many of their pictures as fit into a page."""
    kept = [index for index, state in enumerate(states) if "picture" in state]
    while len(kept) > 1 and sum(len(states[i]["picture"]) for i in kept) > MOST_PICTURE_CHARACTERS:
        kept = kept[::2]
    pictured = set(kept)
    return [
        state
        if index in pictured or "picture" not in state
        else {key: value for key, value in state.items() if key != "picture"}
        for index, state in enumerate(states)
    ]
