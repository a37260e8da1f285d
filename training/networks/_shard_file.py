"""Shards on disk: NumPy archives of plain arrays, so that reading one runs no code."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

import numpy as np

from ._samples import ImageSample, Patch, PersonTruth

_TRUTH: Final = tuple(field.name for field in fields(PersonTruth))
_PATCH: Final = ("origin_px", "size_px", "intrinsics_px")


@dataclass(frozen=True)
class Shard:
    """The samples of one scene.

    Attributes:
        frames: whole images.
        people: crops of people.
        heads: crops of heads.
    """

    frames: tuple[ImageSample, ...]
    people: tuple[Patch, ...]
    heads: tuple[Patch, ...]


def shard_path(folder: Path, scene: int) -> Path:
    """Return the path of a scene's shard."""
    return folder / f"scene{scene:04d}.npz"


def write_shard(path: Path, shard: Shard) -> None:
    """Write a shard; the file appears whole or not at all."""
    frames = shard.frames
    arrays = {
        **_packed_pictures("frames", [frame.png for frame in frames]),
        **_packed_people("frames", [person for frame in frames for person in frame.people]),
        "frames_count": np.array([len(frame.people) for frame in frames], np.int64),
        "frames_focal_px": np.array([frame.focal_px for frame in frames], np.float64),
    }
    for name, patches in (("people", shard.people), ("heads", shard.heads)):
        arrays |= _packed_pictures(name, [patch.png for patch in patches])
        arrays |= _packed_people(name, [patch.person for patch in patches])
        for key in _PATCH:
            arrays[f"{name}_{key}"] = np.array([getattr(patch, key) for patch in patches])
    part = path.with_suffix(".part")
    with part.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)
    part.replace(path)


def read_shard(path: Path) -> Shard:
    """Read a shard that :func:`write_shard` wrote."""
    with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        arrays: dict[str, Any] = dict(archive)
    people = _people(arrays, "frames")
    ends = np.cumsum(arrays["frames_count"]).tolist()
    frames = tuple(
        ImageSample(png, tuple(people[end - count : end]), focal_px)
        for png, end, count, focal_px in zip(
            _pictures(arrays, "frames"),
            ends,
            arrays["frames_count"].tolist(),
            arrays["frames_focal_px"].tolist(),
            strict=True,
        )
    )
    return Shard(frames, _patches(arrays, "people"), _patches(arrays, "heads"))


def read_shards(folder: Path, first: int = 0, last: int | None = None) -> Iterator[Shard]:
    """Yield the shards of a folder in order."""
    for path in sorted(folder.glob("scene*.npz"))[first:last]:
        yield read_shard(path)


def _patches(arrays: dict[str, Any], name: str) -> tuple[Patch, ...]:
    columns = [[tuple(row) for row in arrays[f"{name}_{key}"].tolist()] for key in _PATCH]
    rows = zip(_pictures(arrays, name), *columns, _people(arrays, name), strict=True)
    return tuple(Patch(*row) for row in rows)


def _packed_pictures(name: str, pictures: Sequence[bytes]) -> dict[str, Any]:
    """Return pictures one after another, and where each ends."""
    return {
        f"{name}_png": np.frombuffer(b"".join(pictures), np.uint8),
        f"{name}_png_end": np.cumsum([len(picture) for picture in pictures], dtype=np.int64),
    }


def _pictures(arrays: dict[str, Any], name: str) -> list[bytes]:
    parts = np.split(arrays[f"{name}_png"], arrays[f"{name}_png_end"])[:-1]
    return [part.tobytes() for part in parts]


def _packed_people(name: str, people: Sequence[PersonTruth]) -> dict[str, Any]:
    """Return one array per field, with a row per person."""
    return {
        f"{name}_truth_{key}": np.array([getattr(person, key) for person in people])
        for key in _TRUTH
    }


def _people(arrays: dict[str, Any], name: str) -> list[PersonTruth]:
    columns = [arrays[f"{name}_truth_{key}"] for key in _TRUTH]
    # A number of one person is a Python number again.
    rows = [column.tolist() if column.ndim == 1 else list(column) for column in columns]
    return [PersonTruth(*row) for row in zip(*rows, strict=True)]
