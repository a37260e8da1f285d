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

from perception.documents import read_json

from ..errors import AwarenavError
from ._connection import Deadline, opener, require_allowed

#: Largest file that is downloaded.
MAX_BYTES: Final = 2 << 30

_CHUNK_BYTES: Final = 1 << 18
_MIN_FREE_BYTES: Final = 64 << 20  # left free on the disk
_USER_AGENT: Final = "awarenav"
_CONTENT_RANGE: Final = re.compile(r"bytes (\d{1,15})-\d{1,15}/(\d{1,15})")
_LENGTH: Final = re.compile(r"[0-9]{1,15}")
# What can be sent back in a header.
_VALIDATOR: Final = re.compile(r"[ -~]{1,256}")
_NOT_SATISFIABLE: Final = 416
_PARTIAL: Final = 206
_CONNECTION_ERRORS: Final = (
    urllib.error.URLError,
    http.client.HTTPException,
    ssl.SSLError,
    ConnectionError,
    TimeoutError,
)


class _TooLargeError(AwarenavError):
    """A file that is larger than allowed."""


class BrokenDownloadError(AwarenavError):
    """A download that stopped early; the next attempt continues after the bytes so far."""


def download(
    url: str,
    target: Path,
    *,
    attempts: int = 4,
    pause_s: float = 1.0,
    timeout_s: float = 30.0,
    limit_s: float = 3600.0,
    max_bytes: int = MAX_BYTES,
    progress: bool = True,
) -> None:
    """Download ``url`` to ``target``, which appears when it is complete.

    Until then the bytes are in ``target`` with the suffix ``.part``; the file ``.part.json`` says
    which file they belong to. A further attempt, in this call or a later one, continues from there
    if the server still has the same file (HTTP Range with If-Range, RFC 9110), and starts from the
    beginning otherwise.

    Args:
        url: https, or http on this computer; so are redirects.
        target: in a folder that exists.
        attempts: most attempts in this call, while the connection breaks.
        pause_s: pause before the second attempt, seconds; it doubles each time.
        timeout_s: time without data after which a connection counts as broken, seconds.
        limit_s: most time of this call, seconds, after which nothing is attempted again.
        max_bytes: largest file.
        progress: shows a progress bar on standard error.

    Raises:
        BrokenDownloadError: every attempt was broken off, or the time is up; another call
            continues.
        AwarenavError: an address that is not allowed, a server that does not have the file or
            answers with malformed headers, a file that is too large, or a full disk.
    """
    require_allowed(url)
    with Deadline(limit_s) as deadline:
        for attempt in range(attempts):
            if attempt:
                time.sleep(pause_s * 2 ** (attempt - 1))
            try:
                _attempt(url, target, timeout_s, deadline, max_bytes, progress)
                if deadline.expired:  # an answer without a length seems to end there
                    raise BrokenDownloadError(f"{url}: ended")
            except BrokenDownloadError as cause:
                if deadline.expired:
                    raise BrokenDownloadError(
                        f"{url}: not finished within {limit_s:g} s; run it again to continue"
                    ) from cause
                if attempt == attempts - 1:
                    raise
            else:
                _part(target).replace(target)
                _state(target).unlink(missing_ok=True)
                return


def _attempt(
    url: str, target: Path, timeout_s: float, deadline: Deadline, max_bytes: int, progress: bool
) -> None:
    """Download what is missing of the file into its ``.part``."""
    request = urllib.request.Request(
        url, headers={"User-Agent": _USER_AGENT, "Accept-Encoding": "identity"}
    )
    part = _part(target)
    done, validator = _resume_point(url, target)
    if done:
        request.add_header("Range", f"bytes={done}-")
        request.add_header("If-Range", validator)
    try:
        with opener(deadline).open(request, timeout=timeout_s) as response:
            start, total = _content_range(response, done)
            if total is not None and total > max_bytes:
                raise _TooLargeError(_too_large(max_bytes))
            if start != done:
                _discard(target)
            _check_free_space(target, total, start)
            _write_state(url, target, response.headers)
            with part.open("ab" if start else "wb") as file:
                _copy(response, file, target.name, start, total, max_bytes, progress)
    except _TooLargeError as cause:
        _discard(target)
        raise AwarenavError(f"{url}: {cause}") from cause
    except AwarenavError:
        raise
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
    except ValueError as cause:  # of the standard library, for headers that it cannot parse
        raise AwarenavError(f"{url}: the server sends malformed headers: {cause}") from cause


def _copy(
    response: http.client.HTTPResponse,
    file: IO[bytes],
    name: str,
    start: int,
    total: int | None,
    max_bytes: int,
    progress: bool,
) -> None:
    """Copy the answer to the file; raise if it ends too early or is too large."""
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
            done += len(chunk)
            if done > max_bytes:
                raise _TooLargeError(_too_large(max_bytes))
            file.write(chunk)
            bar.update(len(chunk))
    if total is not None and done != total:
        raise http.client.IncompleteRead(b"", total - done)


def _content_range(response: http.client.HTTPResponse, asked: int) -> tuple[int, int | None]:
    """Return the offset of the answer's first byte in the file, and the file's size if known."""
    if response.status != _PARTIAL:
        return 0, _content_length(response.headers)
    found = _CONTENT_RANGE.fullmatch(response.headers.get("Content-Range", "").strip())
    if found is None or int(found[1]) != asked:
        raise http.client.HTTPException(
            f"asked from byte {asked}, got {response.headers.get('Content-Range')!r}"
        )
    return asked, int(found[2])


def _content_length(headers: http.client.HTTPMessage) -> int | None:
    lengths = {length.strip() for length in headers.get_all("Content-Length", [])}
    if not lengths:
        return None
    if len(lengths) > 1 or not _LENGTH.fullmatch(min(lengths)):
        raise ValueError(f"Content-Length {', '.join(sorted(lengths))[:80]!r}")
    return int(lengths.pop())


def _too_large(max_bytes: int) -> str:
    return f"the file is larger than {max_bytes / 1e6:.0f} MB, which is the limit; it is not kept"


def _resume_point(url: str, target: Path) -> tuple[int, str]:
    """Return the number of bytes that are here already, and the validator of their version."""
    try:
        state = read_json(_state(target), AwarenavError)
        validator = str(state["validator"])
        if state["url"] == url and _VALIDATOR.fullmatch(validator):
            return _part(target).stat().st_size, validator
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
