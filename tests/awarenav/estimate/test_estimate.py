"""``awarenav estimate`` from the source to the last line of its results."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import av
import cv2
import numpy as np
import pytest
from full_disk import files_up_to
from numbered_images import CAMERA, HEIGHT, WIDTH, NumberReader, numbered

from awarenav.cli import main
from awarenav.errors import AwarenavError
from awarenav.estimate import CameraChoice, fixed_camera_pose
from awarenav.estimate._camera import scaled_camera
from awarenav.estimate._run import estimate_command
from awarenav.estimate.command import estimate as command
from awarenav.judge import judge_files
from awarenav.records import read_records
from awarenav.video import VideoWriter
from perception import Camera, PerceptionError, PersonDetection


def folder(path: Path, count: int, camera: Camera | None = CAMERA) -> Path:
    path.mkdir()
    for number in range(count):
        assert cv2.imwrite(str(path / f"{number:06d}.png"), numbered(number))
    if camera is not None:
        camera.to_yaml(path / "camera.yaml")
    return path


def film(path: Path, count: int) -> Path:
    with VideoWriter(path, 10, (WIDTH, HEIGHT)) as video:
        for number in range(count):
            video.add(numbered(number))
    return path


def options(*arguments: object) -> SimpleNamespace:
    with command.make_context("estimate", list(map(str, arguments))) as context:
        return SimpleNamespace(**context.params)


def estimate(reader: NumberReader, *arguments: object) -> int:
    return estimate_command(options(*arguments), reader.networks)


def names(path: Path) -> list[str]:
    return [record["frame"] for record in read_records(path)]


def test_a_folder_becomes_one_line_per_frame_in_the_format_of_truth(tmp_path, capsys):
    out = tmp_path / "new" / "out.jsonl"
    reader = NumberReader()
    assert estimate(reader, folder(tmp_path / "set", 4), "--out", out) == 0
    records = read_records(out)
    assert names(out) == [f"{k:06d}.png" for k in range(4)]
    for number, record in enumerate(records):
        assert record["stamp_s"] == float(number)
        assert record["T_odom_camera"] is None
        (person,) = record["people"]
        assert person["id"] is None
        assert person["position_camera_m"][2] == pytest.approx(3.5, rel=0.08)
        assert person["position_camera_m"][0] == pytest.approx(-0.6 + 0.05 * number, abs=0.1)
        assert np.linalg.eigvalsh(person["position_covariance_m2"])[0] > 0.0
        # He looks along the camera's axis, past the camera by his own offset: at most 10 degrees.
        assert person["gaze_camera"][2] < -0.95
        assert person["awareness"] > 0.5
        assert person["awareness_std"] > 0.0
        assert set(person["keypoints"]) >= {"nose", "left_ankle", "neck"}
        neck = np.mean(
            [person["keypoints"][f"{side}_shoulder"] for side in ("left", "right")], axis=0
        )
        assert person["keypoints"]["neck"] == pytest.approx(neck, abs=0.02)
    assert "4 frames" in capsys.readouterr().out
    figures = judge_files(out, out)
    assert figures["detection"]["ap50"] == 1.0


def test_one_picture_is_told_person_by_person(tmp_path, capsys):
    picture = folder(tmp_path / "set", 1) / "000000.png"
    out = tmp_path / "out.jsonl"
    assert estimate(NumberReader(), picture, "--out", out) == 0
    (person,) = read_records(out)[0]["people"]
    said = capsys.readouterr().out.splitlines()
    assert said[0].endswith("1 observation of people, 0 of them without evidence of awareness")
    x_m, _, z_m = person["position_camera_m"]
    assert said[1:] == [
        f"  {z_m:.1f} m ahead, {-x_m:.1f} m to the left: α {person['awareness']:.2f} ± "
        f"{person['awareness_std']:.2f}"
    ]
    # Of a face four pixels wide there is no pose.
    far = NumberReader(Camera.from_fov(WIDTH, HEIGHT, math.radians(170.0)))
    assert estimate(far, picture, "--out", out, "--overwrite", "--fov-deg", 170) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].endswith("1 of them without evidence of awareness (no head pose: 1)")
    assert said[1].endswith("no α, which is not aware (no head pose)")


def test_a_video_is_estimated_and_drawn(tmp_path):
    out, drawn = tmp_path / "out.jsonl", tmp_path / "drawn.mp4"
    arguments = [film(tmp_path / "a.mp4", 12), "--out", out, "--overlay", drawn, "--fov-deg", 60]
    assert estimate(NumberReader(), *arguments) == 0
    assert [record["stamp_s"] for record in read_records(out)] == pytest.approx(
        [k / 10 for k in range(12)], abs=2e-3
    )
    with av.open(str(drawn)) as video:
        assert video.streams.video[0].average_rate == 10
        assert len(list(video.decode(video=0))) == 12


def test_tracks_give_people_an_id(tmp_path):
    out = tmp_path / "out.jsonl"
    assert estimate(NumberReader(), film(tmp_path / "a.mp4", 10), "--out", out, "--tracks") == 0
    records = read_records(out)
    (identity,) = {record["people"][0]["id"] for record in records}
    last = records[-1]
    (track,) = last["tracks"]
    assert track["id"] == identity
    assert track["status"] == "confirmed"
    # odom lies under the camera, x ahead and y to the left.
    assert track["position_odom_m"][0] == pytest.approx(3.5, rel=0.08)
    assert track["position_odom_m"][1] == pytest.approx(0.6 - 0.05 * 9, abs=0.15)
    assert 0.0 <= track["awareness_lower"] <= track["awareness"] <= 1.0
    assert np.array(last["T_odom_camera"]).shape == (4, 4)


def test_an_existing_file_is_neither_replaced_nor_mixed_with_other_settings(tmp_path):
    out = tmp_path / "out.jsonl"
    source = folder(tmp_path / "set", 4)
    assert estimate(NumberReader(), source, "--out", out, "--frames", 2) == 0
    before = out.read_bytes()
    with pytest.raises(AwarenavError, match="--resume continues it, --overwrite replaces it"):
        estimate(NumberReader(), source, "--out", out)
    with pytest.raises(AwarenavError, match="made with other settings"):
        estimate(NumberReader(), source, "--out", out, "--resume", "--head", "pnp")
    assert out.read_bytes() == before
    reader = NumberReader()
    assert estimate(reader, source, "--out", out, "--resume") == 0
    assert reader.seen == [2, 3]
    assert names(out) == [f"{k:06d}.png" for k in range(4)]
    assert estimate(NumberReader(), source, "--out", out, "--overwrite", "--frames", 1) == 0
    assert names(out) == ["000000.png"]


def test_torn_estimates_continue_and_damaged_ones_are_refused_by_line(tmp_path, capsys):
    whole, out = tmp_path / "whole.jsonl", tmp_path / "out.jsonl"
    source = folder(tmp_path / "set", 4)
    assert estimate(NumberReader(), source, "--out", whole) == 0
    data = whole.read_bytes()
    lines = data.splitlines(keepends=True)
    full_disk = files_up_to(len(lines[0]) + len(lines[1]) + 50)
    with full_disk, pytest.raises(AwarenavError, match="the lines so far are kept"):
        estimate(NumberReader(), source, "--out", out)
    reader = NumberReader()
    assert estimate(reader, source, "--out", out, "--resume") == 0
    assert reader.seen == [2, 3]
    assert out.read_bytes() == data
    assert "the last line is unfinished, its frame is made again" in capsys.readouterr().err
    out.write_bytes(b"".join([lines[0], lines[1][:30], *lines[2:]]))
    before = out.read_bytes()
    with pytest.raises(AwarenavError, match=r"out\.jsonl, line 2"):
        estimate(reader, source, "--out", out, "--resume")
    assert out.read_bytes() == before


def test_ctrl_c_keeps_complete_lines_and_a_playable_video(tmp_path):
    out, drawn = tmp_path / "out.jsonl", tmp_path / "drawn.mp4"
    reader = NumberReader(fail_at=(5,), error=KeyboardInterrupt())
    source = film(tmp_path / "a.mp4", 12)
    with pytest.raises(KeyboardInterrupt):
        estimate(reader, source, "--out", out, "--overlay", drawn)
    assert names(out) == [f"{k:06d}" for k in range(5)]
    with av.open(str(drawn)) as video:
        assert len(list(video.decode(video=0))) == 5


def test_frames_that_cannot_be_read_or_estimated_are_named_and_the_rest_is_kept(tmp_path, capsys):
    out = tmp_path / "out.jsonl"
    source = folder(tmp_path / "set", 5)
    (source / "000001.png").write_bytes(b"\x89PNG broken")
    assert cv2.imwrite(str(source / "000002.png"), numbered(2, (100, 100)))
    reader = NumberReader(fail_at=(3,), error=PerceptionError("the network gave NaN"))
    assert estimate(reader, source, "--out", out) == 1
    assert names(out) == ["000000.png", "000004.png"]
    said = capsys.readouterr().err
    for words in ("000001.png is not an image", "another aspect ratio", "the network gave NaN"):
        assert words in said
    assert "3 frames could not be read or estimated" in said


def test_a_run_in_which_nothing_works_ends_early_and_says_why(tmp_path):
    reader = NumberReader(fail_at=tuple(range(30)), error=PerceptionError("it gave NaN"))
    source = folder(tmp_path / "set", 25)
    with pytest.raises(AwarenavError, match=r"not one of the first 10 frames.*NaN"):
        estimate(reader, source, "--out", tmp_path / "a.jsonl")
    assert len(reader.seen) == 10
    with pytest.raises(AwarenavError, match=r"nothing could be estimated: .*NaN"):
        estimate(reader, source, "--out", tmp_path / "b.jsonl", "--frames", 2)


class TwoBoxes(NumberReader):
    """The one person of each image, found twice: both boxes get the same keypoints."""

    def detect(self, image_rgb):
        (person,) = super().detect(image_rgb)
        beside = PersonDetection(person.box_xyxy_px + np.array([9.0, 0.0, 9.0, 0.0]), 0.4)
        return beside, person


def test_keypoints_are_written_for_one_person_only(tmp_path):
    out = tmp_path / "out.jsonl"
    assert estimate(TwoBoxes(), folder(tmp_path / "set", 2), "--out", out) == 0
    for record in read_records(out):
        beside, person = record["people"]
        assert (beside["awareness"], beside["keypoints"]) == (None, {})
        assert beside["awareness_reason"] == "skeleton of another person"
        assert person["awareness"] > 0.5
        assert person["awareness_reason"] is None


def test_people_in_the_truth_beside_the_images_are_not_read(tmp_path):
    source = folder(tmp_path / "set", 3)
    pose = fixed_camera_pose(1.1).tolist()
    lines = [
        {"frame": f"{k:06d}.png", "stamp_s": 10.0 + k, "T_odom_camera": pose, "people": [k] * k}
        for k in range(3)
    ]
    outs = []
    for name, people in (("with", True), ("without", False)):
        text = "".join(
            json.dumps(line if people else {**line, "people": []}) + "\n" for line in lines
        )
        (source / "truth.jsonl").write_text(text)
        outs.append(tmp_path / f"{name}.jsonl")
        assert estimate(NumberReader(), source, "--out", outs[-1]) == 0
    assert outs[0].read_bytes() == outs[1].read_bytes()
    records = read_records(outs[0])
    assert [record["stamp_s"] for record in records] == [10.0, 11.0, 12.0]
    assert np.array(records[0]["T_odom_camera"]) == pytest.approx(np.array(pose), abs=1e-6)


def test_a_missing_calibration_is_assumed_and_reported(tmp_path, capsys):
    source = folder(tmp_path / "set", 2, camera=None)
    assert estimate(NumberReader(), source, "--out", tmp_path / "a.jsonl") == 0
    assert "60 degrees across the longer side are assumed" in capsys.readouterr().err
    # The same field of view, given: the same estimates, without a word.
    arguments = ["--out", tmp_path / "b.jsonl", "--fov-deg", 60]
    assert estimate(NumberReader(), source, *arguments) == 0
    assert "assumed" not in capsys.readouterr().err
    first, second = (read_records(tmp_path / f"{name}.jsonl") for name in "ab")
    assert [r["people"] for r in first] == [r["people"] for r in second]


def test_a_scaled_camera_fits_the_scaled_image():
    camera = Camera(640, 480, 500.0, 510.0, 322.0, 236.0, np.array([-0.2, 0.05, 0.001, 0.002, 0.0]))
    half = scaled_camera(camera, 320, 240)
    points = np.random.default_rng(0).uniform([-1, -1, 2], [1, 1, 5], (20, 3))
    # Corners of pixels scale; centres lie half a pixel inside.
    assert half.project(points) + 0.5 == pytest.approx((camera.project(points) + 0.5) / 2)
    with pytest.raises(AwarenavError, match="another aspect ratio"):
        scaled_camera(camera, 640, 360)
    said: list[str] = []
    choice = CameraChoice(camera, None, said.append)
    assert choice.of_size(320, 240) is choice.of_size(320, 240)
    assert choice.of_size(640, 480) is camera
    assert len(said) == 1


@pytest.mark.parametrize("pitch_deg", [0.0, 12.0, -5.0])
def test_a_fixed_camera_has_its_height_and_pitch(pitch_deg):
    pose = fixed_camera_pose(1.3, pitch_deg)
    forward, down = pose[:3, 2], pose[:3, 1]
    angle = math.radians(pitch_deg)
    assert forward == pytest.approx([math.cos(angle), 0.0, -math.sin(angle)])
    assert down[2] < 0.0
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    assert pose[:3, 3] == pytest.approx([0.0, 0.0, 1.3])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["absent.png"], "no such file or folder"),
        (["{set}", "--fov-deg", "200"], "200.0 is not in the range 1.0<=x<=179.0"),
        (["{set}", "--resume", "--tracks"], "cannot continue --tracks"),
        (["{set}", "--resume", "--overlay", "a.mp4"], "cannot continue a video"),
        (["0", "--resume"], "cannot continue a camera"),
        (["{set}", "--camera-pitch-deg", "5"], "needs --camera-height-m"),
        (["{set}", "--camera-height-m", "0"], "0.0 is not in the range x>0.0"),
        (["{set}", "--camera", "absent.yaml"], "absent.yaml"),
        (
            ["{set}", "--detector", "absent.onnx"],
            "--detector must be 'shipped', a file of a network",
        ),
        (["{set}", "--topic", "/image"], "--topic is for ROS recordings"),
        (["{set}", "--detector", "{set}/cut.onnx"], "cut.onnx"),
        (["{set}", "--fps", "0"], "is not in the range 0.01<=x<=1000.0"),
        (["{set}/000000.png", "--fps", "10"], "--fps is for a folder of images"),
    ],
)
def test_bad_input_is_one_line_and_exit_status_2(tmp_path, capsys, arguments, message):
    source = folder(tmp_path / "set", 1)
    (source / "cut.onnx").write_bytes(b"\x08\x07 cut off")
    arguments = [each.replace("{set}", str(source)) for each in arguments]
    out = tmp_path / "out.jsonl"
    assert main(["estimate", *arguments, "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert not out.exists()


@pytest.mark.parametrize(("fps", "stamps_s"), [(None, [0.0, 1.0, 2.0]), (25, [0.0, 0.04, 0.08])])
def test_a_folder_of_frames_has_the_times_that_fps_says(tmp_path, capsys, fps, stamps_s) -> None:
    source, out = folder(tmp_path / "set", 3), tmp_path / "out.jsonl"
    given = () if fps is None else ("--fps", fps)
    assert estimate(NumberReader(), source, "--out", out, "--tracks", *given) == 0
    assert [record["stamp_s"] for record in read_records(out)] == pytest.approx(stamps_s)
    assert ("give --fps" in capsys.readouterr().err) == (fps is None)
