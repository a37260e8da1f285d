"""The length of a video, as its container states it."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO, Final

# First boxes of MP4 and its kin (ISO/IEC 14496-12), the containers that list their frames.
_BOXES: Final = (b"ftyp", b"moov", b"mdat", b"moof", b"wide", b"free", b"skip", b"styp")
_EBML, _SEGMENT = 0x1A45DFA3, 0x18538067
# Lengths that a recorder leaves in a file which it writes to a pipe, or does not finish.
_OPEN: Final = (0, 0xFFFFFFFF)


def lists_frames(path: Path) -> bool:
    """Return whether a container has a list of its frames.

    Others (Matroska, WebM, AVI, MPEG-TS, FLV, …) have no number of frames, or count empty ones. A
    number of their frames is the duration times a nominal rate.
    """
    with path.open("rb") as file:
        return file.read(8)[4:] in _BOXES


def missing_bytes(path: Path) -> int:
    """Return how many bytes a cut-off Matroska, WebM or AVI file lacks; 0 if it does not say."""
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            file.seek(0)
            end = _riff_end(file, size) if file.read(4) == b"RIFF" else _matroska_end(file)
    except (OSError, struct.error, IndexError):  # gone, or cut off in its head
        return 0
    return max(end - size, 0)


def _riff_end(file: BinaryIO, size: int) -> int:
    """Return where the last RIFF chunk ends; long AVI files have several."""
    at = 0
    while at < size:
        file.seek(at)
        kind, length = struct.unpack("<4sI", file.read(8))
        if kind != b"RIFF" or length in _OPEN:
            return 0
        at += 8 + length + length % 2
    return at


def _matroska_end(file: BinaryIO) -> int:
    """Return where the segment ends (RFC 8794 and RFC 9559); 0 if that is unknown."""
    file.seek(0)
    for wanted in (_EBML, _SEGMENT):
        if int.from_bytes(file.read(4), "big") != wanted:
            return 0
        first = file.read(1)[0]
        more = 8 - first.bit_length()
        rest = file.read(more)
        length = int.from_bytes(bytes([first & (0x7F >> more)]) + rest, "big")
        if length == (1 << 7 * (more + 1)) - 1:
            return 0
        if wanted == _SEGMENT:
            return file.tell() + length
        file.seek(length, 1)
    return 0
