"""Names of the weights and nodes in an ONNX file, read without the package ``onnx``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

# Numbers of the fields in onnx.proto: ModelProto.graph, then those of GraphProto with the number of
# the name in each: initializer (TensorProto.name) and node (NodeProto.name).
_GRAPH: Final = 7
_PARTS: Final = ((5, 8), (1, 3))
# Wire types of Protocol Buffers: a number of variable length, 8 bytes, a length and so many bytes,
# 4 bytes.
_VARINT, _EIGHT_BYTES, _BYTES, _FOUR_BYTES = 0, 1, 2, 5


def part_names(content: bytes) -> tuple[str, ...]:
    """Return the names of weights and nodes; empty for a file that is no ONNX model.

    Weights are skipped, not read, so this takes some milliseconds whatever the size of the file.
    """
    try:
        return tuple(
            bytes(name).decode("utf-8", "replace")
            for graph in _fields(memoryview(content), _GRAPH)
            for parts, own_name in _PARTS
            for part in _fields(graph, parts)
            for name in _fields(part, own_name)
        )
    except (IndexError, ValueError):
        return ()


def _fields(message: memoryview, wanted: int) -> Iterator[memoryview]:
    """Yield the content of each field ``wanted`` that has a length."""
    at = 0
    while at < len(message):
        key, at = _number(message, at)
        kind = key & 7
        if kind == _VARINT:
            _, at = _number(message, at)
        elif kind == _BYTES:
            size, at = _number(message, at)
            if key >> 3 == wanted:
                yield message[at : at + size]
            at += size
        elif kind in (_EIGHT_BYTES, _FOUR_BYTES):
            at += 8 if kind == _EIGHT_BYTES else 4
        else:
            raise ValueError(f"no wire type {kind}")


def _number(message: memoryview, at: int) -> tuple[int, int]:
    """Return a number of variable length, and where the next field begins."""
    value = shift = 0
    while True:
        byte = message[at]
        value |= (byte & 0x7F) << shift
        at += 1
        if byte < 0x80:
            return value, at
        shift += 7
