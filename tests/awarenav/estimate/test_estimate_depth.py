"""``awarenav estimate --depth``: whose depth image it is, what it does, and what is refused."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numbered_images import HEIGHT, WIDTH, NumberReader
from test_estimate import estimate, film, folder

from awarenav.errors import AwarenavError
from awarenav.records import read_records

# The man of the pictures is an adult at 3.5 m; this is a tenth more, and a child cannot explain it.
FAR_M = 3.85
BEHIND_M = 0.12


def depth_file(path: Path, metres: float = FAR_M - BEHIND_M, shape=(HEIGHT, WIDTH)) -> Path:
    """Write a wall of depth, in the unit and type of the suffix."""
    path.parent.mkdir(exist_ok=True)
    depth = np.full(shape, metres, np.float32)
    if path.suffix == ".npy":
        np.save(path, depth)
    elif path.suffix == ".png":
        assert cv2.imwrite(str(path), np.rint(depth * 1000.0).astype(np.uint16))
    else:
        assert cv2.imwrite(str(path), depth)
    return path


def ranges(path: Path) -> list[float]:
    return [record["people"][0]["position_camera_m"][2] for record in read_records(path)]


def test_a_depth_image_moves_people_to_what_it_measured(tmp_path):
    images, out = folder(tmp_path / "set", 3), tmp_path / "out.jsonl"
    for number, suffix in enumerate((".png", ".npy", ".tiff")):
        depth_file(tmp_path / "depth" / f"{number:06d}{suffix}", FAR_M - BEHIND_M + 0.1 * number)
    assert estimate(NumberReader(), images, "--out", tmp_path / "without.jsonl") == 0
    assert estimate(NumberReader(), images, "--depth", tmp_path / "depth", "--out", out) == 0
    expected = [FAR_M, FAR_M + 0.1, FAR_M + 0.2]
    assert ranges(out) == pytest.approx(expected, rel=0.02)
    assert ranges(tmp_path / "without.jsonl") == pytest.approx([3.5] * 3, rel=0.05)
    # One image takes one file, whatever its name.
    depth, one = depth_file(tmp_path / "any_name.npy"), tmp_path / "one.jsonl"
    assert estimate(NumberReader(), images / "000000.png", "--depth", depth, "--out", one) == 0
    assert ranges(one) == pytest.approx([FAR_M], rel=0.02)


@pytest.mark.parametrize("name", ["{:06d}.png", "{}.npy", "at_{}.png"])
def test_frames_of_a_video_find_theirs_by_number_or_order(tmp_path, name):
    video, out = film(tmp_path / "a.mp4", 12), tmp_path / "out.jsonl"
    for number in range(12):
        depth_file(tmp_path / "depth" / name.format(number), FAR_M - BEHIND_M + 0.02 * number)
    arguments = ["--depth", tmp_path / "depth", "--out", out, "--fov-deg", 60]
    assert estimate(NumberReader(), video, *arguments) == 0
    assert ranges(out)[::5] == pytest.approx([FAR_M, FAR_M + 0.1, FAR_M + 0.2], abs=0.1)


def eight_bits(path: Path) -> None:
    assert cv2.imwrite(str(path), np.full((HEIGHT, WIDTH), 7, np.uint8))


def damage(path: Path) -> None:
    path.write_bytes(b"no image")


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (Path.unlink, "has no depth image of 000000.png"),
        (damage, r"000000\.png is not a depth image that can be read"),
        (eight_bits, r"000000\.png: depth_m must be .* got uint8"),
        (lambda path: depth_file(path, shape=(HEIGHT, WIDTH // 2)), r"000000\.png: .*shape"),
        (lambda path: depth_file(path, 0.004), r"000000\.png: .*another unit"),
        (lambda path: depth_file(path.with_suffix(".npy")), "are of the same image"),
    ],
    ids=["missing", "damaged", "8 bits", "size", "unit", "two"],
)
def test_bad_depth_images_are_named_before_anything_is_written(tmp_path, spoil, message):
    images, out = folder(tmp_path / "set", 2), tmp_path / "out.jsonl"
    files = [depth_file(tmp_path / "depth" / f"{number:06d}.png") for number in range(2)]
    spoil(files[0])
    with pytest.raises(AwarenavError, match=message):
        estimate(NumberReader(), images, "--depth", tmp_path / "depth", "--out", out)
    assert not out.exists()


def test_a_later_bad_one_costs_its_frame_only(tmp_path, capsys):
    images, out = folder(tmp_path / "set", 3), tmp_path / "out.jsonl"
    for number in range(3):
        depth_file(tmp_path / "depth" / f"{number:06d}.npy", 3500.0 if number == 1 else 3.5)
    assert estimate(NumberReader(), images, "--depth", tmp_path / "depth", "--out", out) == 1
    assert [record["frame"] for record in read_records(out)] == ["000000.png", "000002.png"]
    assert "000001.npy: depth_m of floating point must be in metres" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ([f"{number}.png" for number in range(1, 13)], "no depth image of frame 0"),
        ([f"{number}.png" for number in range(12) if number != 4], "no depth image of frame 4"),
        (["4.png", "04.png"], "are of the same frame"),
        ([f"at_{number}.png" for number in range(11)], "11 depth images for 12 frames"),
        ([], "has no depth image"),
        (None, "must be a folder of depth images"),
    ],
)
def test_depth_images_that_do_not_fit_a_video_are_refused(tmp_path, names, message):
    video, out = film(tmp_path / "a.mp4", 12), tmp_path / "out.jsonl"
    if names is not None:
        (tmp_path / "depth").mkdir()
    for name in names or ():
        depth_file(tmp_path / "depth" / name)
    with pytest.raises(AwarenavError, match=message):
        estimate(NumberReader(), video, "--depth", tmp_path / "depth", "--out", out)
    assert not out.exists()
