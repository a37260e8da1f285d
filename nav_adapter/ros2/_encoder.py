"""Encoder of messages to CDR bytes: plain CDR (XCDR1), little-endian, as in ROS 2.

The encoder of ``cyclonedds`` visits every field of every message in Python, which took most of the
time of a publication. This one is built once per type: consecutive fields of fixed size are packed
by one call of ``struct``. ``cyclonedds`` decodes, and a test compares the bytes of both encoders.
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

#: The errors that :func:`encoded` raises for a value that does not fit its field.
ENCODING_ERRORS: Final = (struct.error, TypeError, ValueError, AttributeError, OverflowError)

_Step = Callable[[Any, bytearray], None]
_ENCODERS: Final[dict[type[Message], _Step]] = {}


def encoded(message: Message) -> bytes:
    """Return the bytes of a message, with the four-byte header.

    Raises one of :data:`ENCODING_ERRORS` for a value that does not fit its field.
    """
    # The header is added last, since alignment counts from the end of the header.
    body = bytearray()
    _encoder(type(message))(message, body)
    return _HEADER + bytes(body)


def _encoder(kind: type[Message]) -> _Step:
    """Return the function that appends a message of this class to a body."""
    known = _ENCODERS.get(kind)
    return known or _ENCODERS.setdefault(kind, _build_encoder(kind))


def _build_encoder(kind: type[Message]) -> _Step:
    steps: list[_Step] = []
    run: list[tuple[str, str]] = []
    for path, field in _leaves(kind, ""):
        code = _CODES.get(field.name)
        if field.count is None and code is not None:
            run.append((path, code))
            continue
        if run:
            steps.append(_fixed_size_step(run))
            run = []
        steps.append(_variable_size_step(path, field))
    if run:
        steps.append(_fixed_size_step(run))
    if len(steps) == 1:
        return steps[0]

    def append(message: Any, body: bytearray) -> None:
        for step in steps:
            step(message, body)

    return append


def _leaves(kind: type[Message], path: str) -> list[tuple[str, FieldType]]:
    """Return the fields of a message and of nested messages, in the order of the wire."""
    leaves = []
    for name, field in field_types(kind).items():
        if field.message is not None and field.count is None:
            leaves += _leaves(field.message, f"{path}{name}.")
        else:
            leaves.append((path + name, field))
    return leaves


def _fixed_size_step(run: list[tuple[str, str]]) -> _Step:
    """Return the step for consecutive fields of fixed size."""
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
    """Return one packer for each start position within the eight bytes of alignment."""
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


def _variable_size_step(path: str, field: FieldType) -> _Step:
    """Return the step for a string, an array or a sequence."""
    value = attrgetter(path)
    if field.count is None:
        return lambda message, body: _append_string(value(message), body)
    if field.name in ("int8", "uint8"):
        return _bytes_step(value, field.count)
    each: _Step = _append_string
    if field.message is not None:
        each = _encoder(field.message)
    elif field.name != "string":
        return _numbers_step(value, field.count, _CODES[field.name])
    if field.count:
        raise NotImplementedError(f"{path}: arrays of messages and strings are not supported")

    def append(message: Any, body: bytearray) -> None:
        several = value(message)
        _append_length(len(several), body)
        for one in several:
            each(one, body)

    return append


def _bytes_step(value: Callable[[Any], bytes], count: int) -> _Step:
    """Return the step for an array or sequence of bytes."""

    def append(message: Any, body: bytearray) -> None:
        data = value(message)
        if count and len(data) != count:
            raise ValueError(f"{count} bytes are needed, got {len(data)}")
        if not count:
            _append_length(len(data), body)
        body += data

    return append


def _numbers_step(value: Callable[[Any], Any], count: int, code: str) -> _Step:
    """Return the step for an array or sequence of numbers."""
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
