"""Servers that send too much, too slowly, from elsewhere, or nonsense."""

from __future__ import annotations

import socket
import threading
import time

import pytest
from model_files import CONTENT, names, store

from awarenav.errors import AwarenavError
from awarenav.models import BrokenDownloadError, RealModel, download

FACTS = {
    "name": "tiny",
    "role": "detector",
    "licence": "Apache-2.0",
    "publisher": "nobody",
    "purpose": "tests",
}
OK = b"HTTP/1.1 200 OK\r\n"


class RawServer:
    """Answers every request with the parts given, each sent on its own."""

    def __init__(self, parts, pause_s=0.0):
        self.asked = 0
        self._parts, self._pause_s = parts, pause_s
        self._stop = threading.Event()
        self._socket = socket.create_server(("127.0.0.1", 0))
        self._port = self._socket.getsockname()[1]
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()
        self._thread.join()

    def url(self, path="a.onnx"):
        return f"http://127.0.0.1:{self._port}/{path}"

    def _serve(self):
        while not self._stop.is_set():
            try:
                connection, _ = self._socket.accept()
            except OSError:
                return
            with connection:
                self.asked += 1
                try:
                    connection.recv(65536)
                    for part in self._parts():
                        connection.sendall(part)
                        if self._stop.wait(self._pause_s):
                            break
                except OSError:
                    pass  # the client has heard enough


def answer(*headers, body=b"x"):
    return lambda: [OK + b"".join(header + b"\r\n" for header in headers) + b"\r\n" + body]


@pytest.mark.parametrize(
    "url",
    [
        "http://example.org/a.onnx",
        "http://localhost.example.org/a.onnx",
        "http://127.0.0.1.example.org/a.onnx",
        "http://localhost@example.org/a.onnx",
        "file:///etc/passwd",
        "ftp://127.0.0.1/a.onnx",
        "data:text/plain,x",
        "https:///a.onnx",
        "http://[::1/a.onnx",
        "a.onnx",
        "",
    ],
)
def test_addresses_that_are_not_allowed_are_refused(url, tmp_path, server):
    with pytest.raises(AwarenavError, match=r"is refused|is not an address"):
        download(url, tmp_path / "a.onnx", progress=False)
    server.serve("b.onnx", b"", redirect=url or "file:")
    with pytest.raises(AwarenavError, match=r"refused|not an address|malformed|answers 302|404"):
        download(server.url("b.onnx"), tmp_path / "b.onnx", attempts=1, progress=False)
    assert names(tmp_path) == set()


def test_a_file_that_says_it_is_too_large_is_not_begun(tmp_path):
    with RawServer(answer(b"Content-Length: 2000001", body=b"")) as server:
        with pytest.raises(AwarenavError, match="larger than 2 MB"):
            download(server.url(), tmp_path / "a.onnx", max_bytes=2_000_000, progress=False)
        assert server.asked == 1
    assert names(tmp_path) == set()


def test_a_file_that_does_not_end_is_cut_at_the_limit(tmp_path):
    with RawServer(answer(body=CONTENT * 3)) as server:
        with pytest.raises(AwarenavError, match="larger than 2 MB"):
            download(server.url(), tmp_path / "a.onnx", max_bytes=2_000_000, progress=False)
        assert server.asked == 1
    assert names(tmp_path) == set()


def _trickled_header():
    yield OK + b"X-Slow: "
    while True:
        yield b"x"


def _trickled_body():
    yield OK + b"Content-Length: 1000000\r\n\r\n"
    while True:
        yield b"x"


def _endless_body_without_length():
    yield OK + b"\r\n"
    while True:
        yield b"x"


@pytest.mark.parametrize("parts", [_trickled_header, _trickled_body, _endless_body_without_length])
def test_a_server_that_trickles_is_left_at_the_time_limit(parts, tmp_path):
    with RawServer(parts, pause_s=0.02) as server:
        start_s = time.monotonic()
        with pytest.raises(BrokenDownloadError, match=r"not finished within 0\.3 s"):
            download(server.url(), tmp_path / "a.onnx", limit_s=0.3, progress=False)
        assert time.monotonic() - start_s < 5.0
        assert server.asked == 1
    assert not (tmp_path / "a.onnx").exists()


@pytest.mark.parametrize(
    "headers",
    [
        [b"Content-Length: abc"],
        [b"Content-Length: -1"],
        [b"Content-Length: 1e3"],
        [b"Content-Length: " + b"9" * 5000],
        [b"Content-Length: 1", b"Content-Length: 2"],
        [b"Content-Length: "],
    ],
)
def test_malformed_headers_are_an_error_message(headers, tmp_path):
    with (
        RawServer(answer(*headers)) as server,
        pytest.raises(AwarenavError, match="malformed headers: Content-Length"),
    ):
        download(server.url(), tmp_path / "a.onnx", progress=False)
    assert not (tmp_path / "a.onnx").exists()


@pytest.mark.parametrize(
    "reply",
    [
        b"nonsense\r\n\r\n",
        b"HTTP/1.1 abc OK\r\n\r\n",
        OK + b"X: " + b"x" * 100_000 + b"\r\n\r\n",
        OK + b"".join(b"X%d: 1\r\n" % k for k in range(200)) + b"\r\n",
        OK + b"Transfer-Encoding: chunked\r\n\r\nnonsense\r\n",
        OK + b"Content-Length: 5\r\n\r\nx",
        b"HTTP/1.1 302 Found\r\nLocation: http://[::1\r\n\r\n",
        b"HTTP/1.1 302 Found\r\nLocation: http://127.0.0.1:port/\r\n\r\n",
        b"HTTP/1.1 302 Found\r\nLocation: https://" + b"x" * 300 + b"/\r\n\r\n",
        b"HTTP/1.1 206 Partial Content\r\nContent-Range: bytes 0-1/" + b"9" * 5000 + b"\r\n\r\n",
        b"",
    ],
)
def test_nonsense_is_an_error_message(reply, tmp_path):
    with RawServer(lambda: [reply]) as server, pytest.raises(AwarenavError) as caught:
        download(server.url(), tmp_path / "a.onnx", attempts=1, progress=False)
    assert server.url() in str(caught.value)
    assert not (tmp_path / "a.onnx").exists()


def test_a_tag_that_cannot_be_sent_back_is_not_kept(server, tmp_path):
    server.serve("a.onnx", CONTENT, etag='"\xe9\x80"', cuts=[300_000, None])
    download(server.url("a.onnx"), tmp_path / "a.onnx", pause_s=0.0, progress=False)
    assert (tmp_path / "a.onnx").read_bytes() == CONTENT
    assert [request.get("range") for request in server.requests] == [None, None]


def test_the_store_gives_each_network_a_limit(tmp_path):
    with RawServer(answer(b"Content-Length: 66000001", body=b"")) as server:
        entry = RealModel.model_validate({**FACTS, "url": server.url(), "size_mb": 1.0})
        with pytest.raises(AwarenavError, match="larger than 66 MB"):
            store(tmp_path, entry).fetch("tiny", progress=False)
    assert names(tmp_path) == set()
