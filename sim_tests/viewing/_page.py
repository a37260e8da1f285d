"""The page that shows a crossing: recorded as a file, or live by server-sent events."""

from __future__ import annotations

import html
import json
import os
import sys
import threading
import time
import webbrowser
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from pathlib import Path
from typing import Any, Final

from awarenav.files import write_text

from ..world.errors import SimError

#: Most characters of pictures in a page; every second picture is left out until they fit.
MOST_PICTURE_CHARACTERS: Final = 6_000_000
_SCRIPTS: Final = ("plan.js", "charts.js", "player.js")
_HOST: Final = "127.0.0.1"
_NAMES: Final = (_HOST, "localhost")
# A comment on an idle stream, so that a reader that is gone is noticed.
_QUIET_S: Final = 5.0


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
    """Write the page of a recorded crossing; the file appears whole or not at all."""
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


class LivePage(AbstractContextManager["LivePage"]):
    """Serves a page and the stream of its events at ``/`` and ``/states`` on loopback.

    The stream follows the standard of server-sent events. Its events are ``begin`` (hall, robot and
    names), messages (states) and ``end`` (outcome). Every reader gets all of them from the
    beginning.
    """

    def __init__(self, page: str, port: int = 0) -> None:
        self._page = page.encode("utf-8")
        self._events: list[bytes] = []
        self._ended = False
        self._readers = 0
        self._opened = 0
        self._changed = threading.Condition()
        try:
            self._server = ThreadingHTTPServer((_HOST, port), _handler_of(self))
        except (OSError, OverflowError) as cause:
            raise SimError(f"cannot listen on port {port} of {_HOST}: {cause}") from cause
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """The address of the page."""
        return f"http://{_HOST}:{self._server.server_address[1]}/"

    @property
    def opened(self) -> int:
        """The number of readers of the stream, past ones included."""
        return self._opened

    def begin(self, begin: dict[str, Any]) -> None:
        """Send hall, robot and names."""
        self._send("begin", begin)

    def state(self, state: dict[str, Any]) -> None:
        """Send one state."""
        self._send("", state)

    def end(self, outcome: str, note: str = "") -> None:
        """Send the outcome, which is the last event."""
        self._send("end", {"outcome": outcome, "note": note})
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def wait_for_reader(self, timeout_s: float) -> bool:
        """Wait until somebody reads the stream; return whether somebody does."""
        with self._changed:
            return self._changed.wait_for(lambda: self._opened > 0, timeout_s)

    def wait_for_delivery(self, timeout_s: float) -> bool:
        """Wait until all readers have all events; return whether they have."""
        with self._changed:
            return self._changed.wait_for(lambda: self._readers == 0, timeout_s)

    def close(self) -> None:
        """End the server; readers get what has been sent so far."""
        if not self._ended:
            self.end("The crossing was stopped.")
            self.wait_for_delivery(1.0)
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(2.0)

    def __exit__(self, *error: object) -> None:
        self.close()

    def _send(self, event: str, value: dict[str, Any]) -> None:
        text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        kind = f"event: {event}\n" if event else ""
        with self._changed:
            self._events.append(f"{kind}data: {text}\n\n".encode())
            self._changed.notify_all()

    def _answer(self, request: BaseHTTPRequestHandler) -> None:
        host = request.headers.get("Host", _HOST).partition(":")[0]
        if host not in _NAMES:  # a page of another site that uses its name for this computer
            request.send_error(403)
        elif request.path == "/":
            request.send_response(200)
            request.send_header("Content-Type", "text/html; charset=utf-8")
            request.send_header("Content-Length", str(len(self._page)))
            request.send_header("Cache-Control", "no-store")
            request.end_headers()
            request.wfile.write(self._page)
        elif request.path == "/states":
            self._stream(request)
        else:
            request.send_error(404)

    def _stream(self, request: BaseHTTPRequestHandler) -> None:
        request.send_response(200)
        request.send_header("Content-Type", "text/event-stream; charset=utf-8")
        request.send_header("Cache-Control", "no-store")
        request.end_headers()
        request.close_connection = True
        with self._changed:
            self._readers += 1
            self._opened += 1
            self._changed.notify_all()
        try:
            self._follow(request)
        except OSError:  # the reader is gone
            return
        finally:
            with self._changed:
                self._readers -= 1
                self._changed.notify_all()

    def _follow(self, request: BaseHTTPRequestHandler) -> None:
        """Write all events until the last."""
        sent = 0
        while True:
            with self._changed:
                begun = time.monotonic()
                while len(self._events) <= sent and not self._ended:
                    if not self._changed.wait(_QUIET_S - (time.monotonic() - begun)):
                        break
                waiting, ended = self._events[sent:], self._ended
            request.wfile.write(b"".join(waiting) or b": \n\n")
            request.wfile.flush()
            sent += len(waiting)
            if ended:
                return


def _handler_of(live: LivePage) -> type[BaseHTTPRequestHandler]:
    """Return a handler of requests for a page; it writes no log."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            live._answer(self)

        def log_message(self, format: str, *arguments: object) -> None:
            pass

    return Handler
