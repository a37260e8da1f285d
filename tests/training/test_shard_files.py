"""Training data on disk is arrays only: it reads back exactly, and reading it runs no code."""

from __future__ import annotations

import dataclasses
import os
import pickle
import re

import numpy as np
import pytest
from paths import ROOT

from training.networks._samples import ImageSample, Patch, PersonTruth
from training.networks._shard_file import Shard, read_shard, read_shards, shard_path, write_shard


def person(rng):
    return PersonTruth(
        box_xyxy_px=rng.random(4, np.float32),
        keypoints_px=rng.random((17, 2), np.float32),
        keypoints_root_m=rng.random((17, 3), np.float32),
        visible=rng.random(17) < 0.5,
        rotation_camera_head=rng.random((3, 3), np.float32),
        head_centre_camera_m=rng.random(3, np.float32),
        head_keypoints_camera_m=rng.random((5, 3), np.float32),
        head_seen=float(rng.random()),
        pixels=int(rng.integers(1000)),
        depth_m=float(rng.random()),
        outline_px=rng.random((32, 2), np.float32),
    )


def patch(rng):
    first, size, intrinsics = (1, 2), (640, 480), (500.5, 319.5, 239.5)
    return Patch(rng.bytes(50), first, size, intrinsics, person(rng))


def shard(rng):
    counts = (2, 0, 1)
    return Shard(
        tuple(
            ImageSample(rng.bytes(9 + n), tuple(person(rng) for _ in range(n)), 500.25)
            for n in counts
        ),
        (patch(rng), patch(rng)),
        (),
    )


def plain(value):
    """Return a value with every array as its type, shape and bytes."""
    if dataclasses.is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, tuple):
        return tuple(plain(each) for each in value)
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    return type(value), value


def test_a_shard_reads_back_exactly(tmp_path):
    first, second = shard(np.random.default_rng(1)), Shard((), (), ())
    write_shard(shard_path(tmp_path, 3), first)
    write_shard(shard_path(tmp_path, 12), second)
    assert [plain(each) for each in read_shards(tmp_path)] == [plain(first), plain(second)]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene0003.npz", "scene0012.npz"]


class Executes:
    def __reduce__(self):
        return os.mkdir, ("executed",)


@pytest.mark.parametrize("inner", [False, True])
def test_reading_a_hostile_shard_runs_nothing(inner, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = shard_path(tmp_path, 0)
    if inner:
        with path.open("wb") as file:
            np.savez(file, frames_count=np.array([Executes()], dtype=object))
    else:
        path.write_bytes(pickle.dumps(Executes()))
    with pytest.raises(ValueError, match="allow_pickle"):
        read_shard(path)
    assert not (tmp_path / "executed").exists()


def test_training_loads_nothing_that_executes_code():
    forbidden = re.compile(
        r"\bpickle\.|import pickle|allow_pickle=True|weights_only=False|np\.load\((?!.*allow_pickle"
        r"=False)|torch\.load\((?!.*weights_only=True)|\bmarshal\b|\bshelve\b|\bjoblib\b"
    )
    for path in (ROOT / "training").rglob("*.py"):
        text = re.sub(r"\(\s+", "(", path.read_text(encoding="utf-8"))  # calls on one line
        text = re.sub(r",\n\s+", ", ", text)
        assert not forbidden.search(text), path
