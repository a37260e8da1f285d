"""A file server on loopback that behaves, and misbehaves, as file servers do."""

from __future__ import annotations

import contextlib
import threading
from dataclasses import dataclass, field
from email.utils import formatdate
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any


@dataclass
class ServedFile:
    """One file and the manners of its server."""

    content: bytes
    etag: str | None = '"1"'
    #: Answers a Range request with the part; otherwise the whole comes every time.
    ranges: bool = True
    #: Bytes after which the connection is cut, one entry an answer; None lets it through.
    cuts: list[int | None] = field(default_factory=list)
    #: Status codes answered before anything else.
    refusals: list[int] = field(default_factory=list)
    redirect: str | None = None


class ModelServer:
    """Serves ``files`` by path and keeps the headers of every request in ``requests``."""

    def __init__(self) -> None:
        self.files: dict[str, ServedFile] = {}
        self.requests: list[dict[str, str]] = []
        owner = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self) -> None:
                owner._answer(self)

            def log_message(self, *_: Any) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._thread = threading.Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True
        )

    def __enter__(self) -> ModelServer:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def url(self, path: str) -> str:
        return f"http://127.0.0.1:{self._server.server_address[1]}/{path}"

    def serve(self, path: str, content: bytes, **manners: Any) -> ServedFile:
        self.files[path] = ServedFile(content, **manners)
        return self.files[path]

    def _answer(self, handler: BaseHTTPRequestHandler) -> None:
        self.requests.append({key.lower(): value for key, value in handler.headers.items()})
        handler.close_connection = True
        file = self.files.get(handler.path.lstrip("/"))
        if file is None:
            handler.send_error(404)
            return
        if file.refusals:
            handler.send_error(file.refusals.pop(0))
            return
        if file.redirect is not None:
            handler.send_response(302)
            handler.send_header("Location", file.redirect)
            handler.send_header("Content-Length", "0")
            handler.end_headers()
            return
        start = self._start(handler, file)
        if start >= len(file.content) > 0:
            handler.send_response(416)
            handler.send_header("Content-Range", f"bytes */{len(file.content)}")
            handler.send_header("Content-Length", "0")
            handler.end_headers()
            return
        body = file.content[start:]
        handler.send_response(206 if start else 200)
        handler.send_header("Content-Length", str(len(body)))
        handler.send_header("Last-Modified", formatdate(0, usegmt=True))
        if file.etag is not None:
            handler.send_header("ETag", file.etag)
        if start:
            end = len(file.content) - 1
            handler.send_header("Content-Range", f"bytes {start}-{end}/{len(file.content)}")
        handler.end_headers()
        cut = file.cuts.pop(0) if file.cuts else None
        with contextlib.suppress(ConnectionError):  # the client has heard enough
            handler.wfile.write(body if cut is None else body[:cut])

    def _start(self, handler: BaseHTTPRequestHandler, file: ServedFile) -> int:
        wanted = handler.headers.get("Range")
        if not wanted or not file.ranges:
            return 0
        state = file.etag if file.etag is not None else formatdate(0, usegmt=True)
        if handler.headers.get("If-Range", state) != state:
            return 0  # the file has changed: the whole new one
        return int(wanted.removeprefix("bytes=").split("-")[0])
