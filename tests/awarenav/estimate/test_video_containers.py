"""Videos whose containers state no number of frames, whole and cut off."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np
import pytest
from numbered_images import HEIGHT, WIDTH, NumberReader, numbered
from test_estimate import estimate

from awarenav import AwarenavError
from awarenav.estimate import open_source
from awarenav.records import read_records

av = pytest.importorskip("av", reason="PyAV is not installed")

COUNT = 24
#: Stamps of a recorder that leaves out pictures, milliseconds.
STAMPS_MS = np.cumsum([0, *np.random.default_rng(1).integers(10, 140, COUNT - 1)])
FROM_TEN_SECONDS_MS = np.arange(COUNT) * 100 // 3 + 10_000
CONTAINERS = {"mkv": "libx264", "webm": "libvpx", "avi": "mpeg4", "ts": "libx264", "flv": "libx264"}


def recorded(path: Path, stamps_ms: np.ndarray, options: dict[str, str] | None = None) -> Path:
    codec = CONTAINERS.get(path.suffix[1:], "libx264")
    with av.open(str(path), "w", options=options or {}) as container:
        stream = container.add_stream(codec, rate=30)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 1000)
        if codec == "libvpx":
            stream.options = {"deadline": "realtime", "cpu-used": "8"}
        for number, stamp_ms in enumerate(stamps_ms):
            frame = av.VideoFrame.from_ndarray(numbered(number), format="rgb24")
            frame.pts, frame.time_base = int(stamp_ms), Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def cut(path: Path, share: float) -> Path:
    data = path.read_bytes()
    path.write_bytes(data[: round(share * len(data))])
    return path


@pytest.mark.parametrize(
    ("suffix", "stamps_ms"),
    [*((suffix, STAMPS_MS) for suffix in CONTAINERS), ("mkv", FROM_TEN_SECONDS_MS)],
)
def test_a_whole_recording_is_read_without_a_problem(tmp_path, suffix, stamps_ms) -> None:
    source = open_source(str(recorded(tmp_path / f"a.{suffix}", stamps_ms)))
    frames = list(source.frames())
    source.close()
    assert source.count is None
    assert [frame.problem for frame in frames] == [""] * COUNT
    # AVI has no stamps: its writer fills the time before the first picture after it.
    stamps = np.array([frame.stamp_s for frame in frames])[1:]
    np.testing.assert_allclose(np.diff(stamps), np.diff(stamps_ms[1:]) / 1000.0, atol=2e-3)


def test_a_fragmented_mp4_states_its_frames(tmp_path) -> None:
    fragments = {"movflags": "frag_keyframe+empty_moov", "frag_duration": "300000"}
    source = open_source(str(recorded(tmp_path / "a.mp4", STAMPS_MS, fragments)))
    assert source.count == COUNT
    assert not any(frame.problem for frame in source.frames())
    source.close()


@pytest.mark.parametrize("suffix", ["mkv", "webm", "avi"])
def test_a_recording_that_is_cut_off_is_a_problem(tmp_path, suffix) -> None:
    path = cut(recorded(tmp_path / f"a.{suffix}", STAMPS_MS), 0.6)
    out = tmp_path / "out.jsonl"
    assert estimate(NumberReader(), path, "--fov-deg", 60, "--out", out) == 1
    assert 5 <= len(read_records(out)) <= COUNT
    source = open_source(str(path))
    *_, last = source.frames()
    source.close()
    assert "it is cut off" in last.problem


def test_depth_goes_by_frame_number_and_in_its_order_needs_the_number_of_frames(tmp_path) -> None:
    path = recorded(tmp_path / "a.mkv", STAMPS_MS)
    depth, out = tmp_path / "depth", tmp_path / "out.jsonl"
    depth.mkdir()
    for number in range(COUNT):
        image = np.full((HEIGHT, WIDTH), 3500, np.uint16)
        assert cv2.imwrite(str(depth / f"{number:06d}.png"), image)
    arguments = ["--fov-deg", 60, "--depth", depth, "--out", out]
    assert estimate(NumberReader(), path, *arguments) == 0
    assert len(read_records(out)) == COUNT
    for number in range(COUNT):
        (depth / f"{number:06d}.png").rename(depth / f"d{number}.png")
    with pytest.raises(AwarenavError, match=r"unknown number of frames.*numbers of their frames"):
        estimate(NumberReader(), path, *arguments, "--overwrite")
