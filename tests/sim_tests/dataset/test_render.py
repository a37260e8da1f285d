"""``awarenav render``: reproducible, resumable, and with a truth that matches its images."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from full_disk import files_up_to

from awarenav.cli import main
from awarenav.records import read_records, write_records
from perception import Camera
from sim_tests import SimError
from sim_tests.dataset import RenderConfig, RenderScene, render

CONFIG = RenderConfig(frames=8, scenes=3, people=2, width_px=192, height_px=144, seed=5)


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("render")
    render(CONFIG, out, processes=1, progress=False)
    return out


def contents(folder: Path) -> dict[str, bytes]:
    return {entry.name: entry.read_bytes() for entry in folder.iterdir()}


def test_the_same_settings_give_the_same_bytes_for_any_number_of_processes(
    rendered: Path, tmp_path: Path
) -> None:
    render(CONFIG, tmp_path, processes=2, progress=False)
    assert contents(tmp_path) == contents(rendered)


def test_an_interrupted_run_is_continued_to_the_same_bytes(rendered: Path, tmp_path: Path) -> None:
    whole = contents(rendered)
    for name, data in whole.items():
        (tmp_path / name).write_bytes(data)
    # Killed before the end: one image has no truth yet, and one truth has lost its image.
    (tmp_path / "truth.jsonl").unlink()
    for record in read_records(rendered / "truth.jsonl")[:5]:
        write_records(tmp_path / record["frame"].replace("png", "json"), [record])
    (tmp_path / "000001.png").unlink()
    modified_ns = (tmp_path / "000003.png").stat().st_mtime_ns
    render(CONFIG, tmp_path, processes=1, progress=False)
    assert contents(tmp_path) == whole
    assert (tmp_path / "000003.png").stat().st_mtime_ns == modified_ns


def test_a_folder_with_images_of_other_settings_is_left_alone(rendered: Path) -> None:
    before = contents(rendered)
    with pytest.raises(SimError, match=r"other settings \(seed: 5, asked for 6\)"):
        render(CONFIG.model_copy(update={"seed": 6}), rendered, progress=False)
    assert contents(rendered) == before


def test_a_truth_file_without_settings_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "truth.jsonl").write_text("mine\n", "utf-8")
    with pytest.raises(SimError, match="another folder"):
        render(CONFIG, tmp_path, progress=False)
    assert (tmp_path / "truth.jsonl").read_text("utf-8") == "mine\n"


def test_the_truth_is_consistent_and_matches_the_images(rendered: Path) -> None:
    camera = Camera.from_yaml(rendered / "camera.yaml")
    records = read_records(rendered / "truth.jsonl")
    assert [record["frame"] for record in records] == [f"{k:06d}.png" for k in range(8)]
    people = 0
    for record in records:
        image = cv2.imread(str(rendered / record["frame"]))
        assert image is not None
        assert image.shape == (144, 192, 3)
        T = np.array(record["T_odom_camera"])
        assert T[:3, :3] @ T[:3, :3].T == pytest.approx(np.eye(3), abs=1e-5)
        for person in record["people"]:
            people += 1
            low, high = np.split(np.array(person["box_xyxy_px"]), 2)
            assert (low >= 0).all()
            assert (low < high).all()
            assert (high <= (192, 144)).all()
            assert np.linalg.norm(person["gaze_camera"]) == pytest.approx(1.0, abs=1e-5)
            assert 0.0 <= person["awareness"] <= 1.0
            assert 0.0 <= person["occlusion"] <= 1.0
            assert 0.0 <= person["truncation"] <= 1.0
            x, _, z = person["position_camera_m"]
            assert CONFIG.min_range_m - 0.2 <= np.hypot(x, z) <= CONFIG.max_range_m + 0.2
            for name, (u, v, seen) in person["keypoints"].items():
                point = np.array(person["keypoints_camera_m"][name])
                if point[2] > 0.2:
                    assert camera.project(point[None])[0] == pytest.approx((u, v), abs=0.3)
                if seen:
                    assert (np.array([u, v]) >= low - 3.0).all()
                    assert (np.array([u, v]) <= high + 2.0).all()
            ears = [np.array(person["keypoints_camera_m"][f"{s}_ear"]) for s in ("left", "right")]
            nose = np.array(person["keypoints_camera_m"]["nose"])
            forward = nose - 0.5 * (ears[0] + ears[1])
            cosine = forward @ person["head_forward_camera"] / np.linalg.norm(forward)
            assert cosine > np.cos(np.radians(15.0))
    assert people >= 8


def test_a_person_who_looks_away_is_unaware(rendered: Path) -> None:
    people = [p for r in read_records(rendered / "truth.jsonl") for p in r["people"]]
    for person in people:
        points = {name: np.array(at) for name, at in person["keypoints_camera_m"].items()}
        gaze, eyes = (
            np.array(person["gaze_camera"]),
            0.5 * (points["left_eye"] + points["right_eye"]),
        )
        angle = np.arccos(-eyes @ gaze / np.linalg.norm(eyes))
        up = np.cross(points["right_ear"] - points["left_ear"], gaze)
        lowered = np.arctan2(-eyes @ up / np.linalg.norm(up), -eyes @ gaze)
        if angle > np.radians(62.0):
            assert person["awareness"] == 0.0
        elif person["awareness"] > 0.0:
            expected = 1.0 - np.tan(angle) / np.tan(np.radians(60.0))
            expected *= np.interp(np.degrees(lowered), (8.0, 22.0), (1.0, 0.0))
            assert person["awareness"] == pytest.approx(expected, abs=0.12)


def test_the_command_renders_and_replaces_a_set_on_request_only(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "set"
    command = ["render", "--frames", "2", "--size", "96x72", "--workers", "1", "--out", str(out)]
    assert main(command) == 0
    assert "2 images" in capsys.readouterr().out
    first = contents(out)
    assert set(first) == {
        "000000.png",
        "000001.png",
        "camera.yaml",
        "contact_sheet.png",
        "render.yaml",
        "truth.jsonl",
    }
    assert main(command) == 2
    message = capsys.readouterr().err
    for remedy in ("--resume", "--overwrite", "--out"):
        assert remedy in message
    assert main([*command, "--resume"]) == 0
    assert contents(out) == first
    (out / "mine.txt").write_text("mine")
    # Another seed: no image of the first set may be used again.
    assert main([*command, "--seed", "5", "--overwrite"]) == 0
    second = contents(out)
    assert second.pop("mine.txt") == b"mine"
    assert second.keys() == first.keys()
    assert all(second[name] != first[name] for name in ("000000.png", "000001.png"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--size", "640"], "WIDTHxHEIGHT"),
        (["--size", "8x8"], "width_px"),
        (["--fov", "200"], "horizontal_fov_deg"),
        (["--people", "50"], "people"),
    ],
)
def test_settings_out_of_range_are_refused_by_name(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["render", *arguments, "--out", str(tmp_path / "x")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


def test_ranges_beyond_the_size_of_the_hall_are_refused() -> None:
    far = CONFIG.model_copy(update={"min_range_m": 29.0, "max_range_m": 30.0})
    with RenderScene(far, 0) as scene, pytest.raises(SimError, match="29 to 30 m"):
        scene.snapshot(0)


def test_images_are_spread_evenly_over_the_scenes() -> None:
    config = RenderConfig(frames=50, scenes=7)
    scenes = [config.scene_of(frame) for frame in range(50)]
    assert scenes == sorted(scenes)
    assert set(scenes) == set(range(7))
    assert RenderConfig(frames=3, scenes=10).scene_count == 3
    assert RenderConfig(frames=400).scene_count == 20


def test_a_full_disk_is_said_and_the_set_continues(rendered: Path, tmp_path: Path) -> None:
    whole = contents(rendered)
    with files_up_to(10_000), pytest.raises(SimError, match="cannot write"):
        render(CONFIG, tmp_path, processes=1, progress=False)
    assert not list(tmp_path.glob("*.part"))
    render(CONFIG, tmp_path, processes=1, progress=False)
    assert contents(tmp_path) == whole
