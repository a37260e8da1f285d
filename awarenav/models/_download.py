"""Downloads that continue after a break; the file appears when it is complete."""

from __future__ import annotations

import http.client
import json
import re
import shutil
import ssl
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import IO, Final

from tqdm import tqdm

from ..errors import AwarenavError

_CHUNK_BYTES: Final = 1 << 18
_MIN_FREE_BYTES: Final = 64 << 20  # left free on the disk
_USER_AGENT: Final = "awarenav"
_CONTENT_RANGE: Final = re.compile(r"bytes (\d+)-\d+/(\d+)")
_NOT_SATISFIABLE: Final = 416
_PARTIAL: Final = 206
_CONNECTION_ERRORS: Final = (
    urllib.error.URLError,
    http.client.HTTPException,
    ssl.SSLError,
    ConnectionError,
    TimeoutError,
)


class BrokenDownloadError(AwarenavError):
    """A download that stopped early; the next attempt continues after the bytes so far."""


class _NoDowngrade(urllib.request.HTTPRedirectHandler):
    """Follows redirects, except from https to another scheme."""

    def redirect_request(
        self,
        req: urllib.request.Request,
        fp: IO[bytes],
        code: int,
        msg: str,
        headers: http.client.HTTPMessage,
        newurl: str,
    ) -> urllib.request.Request | None:
        if req.full_url.startswith("https:") and not newurl.startswith("https:"):
            raise AwarenavError(
                f"{req.full_url} redirects to {newurl}, which is not encrypted; refused"
            )
        return super().redirect_request(req, fp, code, msg, headers, newurl)


def download(
    url: str,
    target: Path,
    *,
    attempts: int = 4,
    pause_s: float = 1.0,
    timeout_s: float = 30.0,
    progress: bool = True,
) -> None:
    """Download ``url`` to ``target``, which appears when it is complete.

    Until then the bytes are in ``target`` with the suffix ``.part``; the file ``.part.json`` says
    which file they belong to. A further attempt, in this call or a later one, continues from there
    if the server still has the same file (HTTP Range with If-Range, RFC 9110), and starts from the
    beginning otherwise.

    Args:
        url: http or https.
        target: in a folder that exists.
        attempts: most attempts in this call, while the connection breaks.
        pause_s: pause before the second attempt, seconds; it doubles each time.
        timeout_s: time without data after which a connection counts as broken, seconds.
        progress: shows a progress bar on standard error.

    Raises:
        BrokenDownloadError: every attempt was broken off; another call continues.
        AwarenavError: the server does not have the file, or the disk is full.
    """
    for attempt in range(attempts):
        if attempt:
            time.sleep(pause_s * 2 ** (attempt - 1))
        try:
            _attempt(url, target, timeout_s, progress)
        except BrokenDownloadError:
            if attempt == attempts - 1:
                raise
        else:
            _part(target).replace(target)
            _state(target).unlink(missing_ok=True)
            return


def _attempt(url: str, target: Path, timeout_s: float, progress: bool) -> None:
    """Download what is missing of the file into its ``.part``."""
    request = urllib.request.Request(
        url, headers={"User-Agent": _USER_AGENT, "Accept-Encoding": "identity"}
    )
    part = _part(target)
    done, validator = _resume_point(url, target)
    if done:
        request.add_header("Range", f"bytes={done}-")
        request.add_header("If-Range", validator)
    opener = urllib.request.build_opener(_NoDowngrade)
    try:
        with opener.open(request, timeout=timeout_s) as response:
            start, total = _content_range(response, done)
            if start != done:
                _discard(target)
            _check_free_space(target, total, start)
            _write_state(url, target, response.headers)
            with part.open("ab" if start else "wb") as file:
                _copy(response, file, target.name, start, total, progress)
    except urllib.error.HTTPError as cause:
        with cause:
            if cause.code == _NOT_SATISFIABLE:
                _discard(target)
                raise BrokenDownloadError(f"{url}: the file on the server has changed") from cause
            busy = cause.code == http.HTTPStatus.TOO_MANY_REQUESTS or cause.code >= 500
            kind = BrokenDownloadError if busy else AwarenavError
            raise kind(f"{url}: the server answers {cause.code} {cause.reason}") from cause
    except _CONNECTION_ERRORS as cause:
        reason = getattr(cause, "reason", None) or cause or type(cause).__name__
        size = part.stat().st_size if part.exists() else 0
        what = f"broke off after {size} bytes ({reason})" if size else f"no connection ({reason})"
        raise BrokenDownloadError(f"{url}: {what}; run it again to continue") from cause
    except OSError as cause:
        raise AwarenavError(f"cannot write {part}: {cause.strerror or cause}") from cause


def _copy(
    response: http.client.HTTPResponse,
    file: IO[bytes],
    name: str,
    start: int,
    total: int | None,
    progress: bool,
) -> None:
    """Copy the answer to the file; raise if it ends too early."""
    done = start
    with tqdm(
        total=total,
        initial=start,
        desc=name,
        unit="B",
        unit_scale=True,
        file=sys.stderr,
        disable=not progress,
    ) as bar:
        while chunk := response.read(_CHUNK_BYTES):
            file.write(chunk)
            done += len(chunk)
            bar.update(len(chunk))
    if total is not None and done != total:
        raise http.client.IncompleteRead(b"", total - done)


def _content_range(response: http.client.HTTPResponse, asked: int) -> tuple[int, int | None]:
    """Return the offset of the answer's first byte in the file, and the file's size if known."""
    length = response.headers.get("Content-Length")
    if response.status != _PARTIAL:
        return 0, None if length is None else int(length)
    found = _CONTENT_RANGE.fullmatch(response.headers.get("Content-Range", "").strip())
    if found is None or int(found[1]) != asked:
        raise http.client.HTTPException(
            f"asked from byte {asked}, got {response.headers.get('Content-Range')!r}"
        )
    return asked, int(found[2])


def _resume_point(url: str, target: Path) -> tuple[int, str]:
    """Return the number of bytes that are here already, and the validator of their version."""
    try:
        state = json.loads(_state(target).read_text(encoding="utf-8"))
        if state["url"] == url and state["validator"]:
            return _part(target).stat().st_size, str(state["validator"])
    except (OSError, ValueError, KeyError, TypeError):
        pass  # no state, or a damaged one: start from the beginning
    return 0, ""


def _write_state(url: str, target: Path, headers: http.client.HTTPMessage) -> None:
    tag = headers.get("ETag", "")
    # If-Range takes strong tags only; without one, the date identifies the version.
    validator = headers.get("Last-Modified", "") if tag.startswith("W/") or not tag else tag
    _state(target).write_text(json.dumps({"url": url, "validator": validator}), encoding="utf-8")


def _check_free_space(target: Path, total: int | None, start: int) -> None:
    free = shutil.disk_usage(target.parent).free
    if total is not None and total - start > free - _MIN_FREE_BYTES:
        raise AwarenavError(
            f"{target.parent} has {free / 1e6:.0f} MB free; {target.name} needs "
            f"{(total - start + _MIN_FREE_BYTES) / 1e6:.0f} MB"
        )


def _part(target: Path) -> Path:
    return target.with_name(target.name + ".part")


def _state(target: Path) -> Path:
    return target.with_name(target.name + ".part.json")


def _discard(target: Path) -> None:
    _part(target).unlink(missing_ok=True)
    _state(target).unlink(missing_ok=True)
