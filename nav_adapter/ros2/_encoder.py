"""Messages to CDR bytes: plain CDR (XCDR1), little-endian, as ROS 2 sends it.

The library's own encoder walks every field of every message in Python, which was most of the time
of a publication. This one is put together once for each type: fields of fixed size that follow each
other are packed by one call of ``struct``. Reading is left to the library, and a test holds the
bytes of both against each other.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from operator import attrgetter
from typing import Any, Final

from ._message import FieldType, Message, field_types

# Representation identifier (CDR, little-endian) and options.
_HEADER: Final = b"\x00\x01\x00\x00"
_ALIGNMENTS: Final = 8
_CODES: Final = {
    "bool": "?",
    "byte": "B",
    "int8": "b",
    "uint8": "B",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "float32": "f",
    "float64": "d",
}
_LENGTH: Final = struct.Struct("<I")
_PADDING: Final = (b"", b"\0\0\0", b"\0\0", b"\0")

#: What :func:`encoded` raises for a value that does not fit its field.
REFUSALS: Final = (struct.error, TypeError, ValueError, AttributeError, OverflowError)

_Step = Callable[[Any, bytearray], None]
_ENCODERS: Final[dict[type[Message], _Step]] = {}


def encoded(message: Message) -> bytes:
    """The bytes of a message, with the four-byte header.

    Raises one of :data:`REFUSALS` for a value that does not fit its field.
    """
    # The header is put before it at the end: positions count from behind it.
    body = bytearray()
    _encoder(type(message))(message, body)
    return _HEADER + bytes(body)


def _encoder(kind: type[Message]) -> _Step:
    """What appends a message of this class."""
    known = _ENCODERS.get(kind)
    return known or _ENCODERS.setdefault(kind, _made_for(kind))


def _made_for(kind: type[Message]) -> _Step:
    steps: list[_Step] = []
    run: list[tuple[str, str]] = []
    for path, field in _leaves(kind, ""):
        code = _CODES.get(field.name)
        if field.count is None and code is not None:
            run.append((path, code))
            continue
        if run:
            steps.append(_fixed(run))
            run = []
        steps.append(_varying(path, field))
    if run:
        steps.append(_fixed(run))
    if len(steps) == 1:
        return steps[0]

    def append(message: Any, body: bytearray) -> None:
        for step in steps:
            step(message, body)

    return append


def _leaves(kind: type[Message], path: str) -> list[tuple[str, FieldType]]:
    """The fields of a message and of those inside it, in the order of the wire."""
    leaves = []
    for name, field in field_types(kind).items():
        if field.message is not None and field.count is None:
            leaves += _leaves(field.message, f"{path}{name}.")
        else:
            leaves.append((path + name, field))
    return leaves


def _fixed(run: list[tuple[str, str]]) -> _Step:
    """Fields of fixed size in one go."""
    values = attrgetter(*(path for path, _ in run))
    packers = _packers([code for _, code in run])
    if len(run) == 1:

        def append_one(message: Any, body: bytearray) -> None:
            body += packers[len(body) % _ALIGNMENTS](values(message))

        return append_one

    def append(message: Any, body: bytearray) -> None:
        body += packers[len(body) % _ALIGNMENTS](*values(message))

    return append


def _packers(codes: list[str]) -> list[Callable[..., bytes]]:
    """One for each position in the eight bytes to which everything is aligned."""
    packers = []
    for start in range(_ALIGNMENTS):
        at, form = start, "<"
        for code in codes:
            size = struct.calcsize(f"<{code}")
            gap = -at % size
            form += "x" * gap + code
            at += gap + size
        packers.append(struct.Struct(form).pack)
    return packers


def _varying(path: str, field: FieldType) -> _Step:
    """A string, an array, or a sequence."""
    value = attrgetter(path)
    if field.count is None:
        return lambda message, body: _append_string(value(message), body)
    if field.name in ("int8", "uint8"):
        return _raw(value, field.count)
    each: _Step = _append_string
    if field.message is not None:
        each = _encoder(field.message)
    elif field.name != "string":
        return _numbers(value, field.count, _CODES[field.name])
    if field.count:
        raise NotImplementedError(f"{path}: arrays of messages and strings are not needed so far")

    def append(message: Any, body: bytearray) -> None:
        several = value(message)
        _append_length(len(several), body)
        for one in several:
            each(one, body)

    return append


def _raw(value: Callable[[Any], bytes], count: int) -> _Step:
    def append(message: Any, body: bytearray) -> None:
        data = value(message)
        if count and len(data) != count:
            raise ValueError(f"{count} bytes are needed, got {len(data)}")
        if not count:
            _append_length(len(data), body)
        body += data

    return append


def _numbers(value: Callable[[Any], Any], count: int, code: str) -> _Step:
    size = struct.calcsize(f"<{code}")

    def append(message: Any, body: bytearray) -> None:
        several = value(message)
        if count and len(several) != count:
            raise ValueError(f"{count} numbers are needed, got {len(several)}")
        if not count:
            _append_length(len(several), body)
        if len(several):
            gap = -len(body) % size
            body += struct.pack(f"<{gap}x{len(several)}{code}", *several)

    return append


def _append_length(length: int, body: bytearray) -> None:
    body += _PADDING[len(body) % 4]
    body += _LENGTH.pack(length)


def _append_string(text: str, body: bytearray) -> None:
    data = text.encode()
    if b"\0" in data:
        raise ValueError("a string must not hold the character 0")
    _append_length(len(data) + 1, body)
    body += data
    body += b"\0"
