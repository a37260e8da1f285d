"""Crossings with networks of one's own: the same choice as on a robot, part of the episode."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from genuine_detectors import MODELS

from awarenav.cli import main
from perception.shipped import DETECTOR, HEAD, shipped_model_path
from sim_tests import SimError, run_crossing
from sim_tests.scenario import Scenario
from sim_tests.study.runs import attempt, plan_jobs, run_jobs, scenario_of

LOOKED_AT = """
name: looked_at
duration_s: 1.0
control_hz: 10.0
layout: open
robot: {goal_x_m: 6.0}
camera: {width_px: 640, height_px: 480, horizontal_fov_deg: 60.0}
people:
  - name: stands
    route: [{x_m: 4.0, y_m: 0.5}]
    heading_deg: 180.0
    gaze: [{t_s: 0.0, look: robot}]
"""
SCENE = Scenario.from_text(LOOKED_AT)
#: The shipped networks by name, so that they are loaded as networks of one's own are.
BY_NAME = "{detector: shipped, pose: shipped, head: network, eyes: none}"


def written(path: Path, text: str) -> str:
    path.write_text(text)
    return str(path)


def jobs_of(networks: str):
    return plan_jobs([SCENE], ["balanced"], [0], perception="pixels", networks=networks)


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A file whose head network is a file of one's own, a copy of the shipped one."""
    shutil.copy(shipped_model_path(HEAD), tmp_path / "head.onnx")
    return Path(written(tmp_path / "own.yaml", f"head: {tmp_path / 'head.onnx'}"))


@pytest.mark.slow
def test_the_shipped_networks_by_name_give_the_rows_of_the_default(tmp_path: Path):
    by_name = written(tmp_path / "by_name.yaml", BY_NAME)
    (usual,), (named,) = jobs_of(""), jobs_of(by_name)
    assert (usual.networks, named.networks) == ("", "by_name")
    first, second = attempt(usual).record, attempt(named).record
    assert not first.error
    for name in first.__dataclass_fields__:
        if name != "networks":
            assert getattr(first, name) == getattr(second, name), name


@pytest.mark.slow
def test_the_networks_of_the_file_see_the_pictures(own: Path):
    usual = run_crossing(SCENE, policy="balanced", perception="pixels")
    same = run_crossing(SCENE, policy="balanced", perception="pixels", networks=str(own))
    own.write_text("head: pnp")
    pnp = run_crossing(SCENE, policy="balanced", perception="pixels", networks=str(own))

    def gazes(result):
        seen = [each for frame in result.frames for each in frame.observations]
        return [each.gaze_camera for each in seen if each.gaze_camera is not None]

    assert len(gazes(usual)) >= 6
    np.testing.assert_array_equal(gazes(usual), gazes(same))
    assert not np.array_equal(gazes(usual), gazes(pnp))


def test_the_contents_of_the_networks_are_part_of_the_episode(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    own.write_text("head: head.onnx")
    (job,) = jobs_of("own.yaml")
    networks = scenario_of(job.scenario_text).networks
    assert networks["head"] == str(tmp_path / "head.onnx")
    assert list(networks["sha256"]) == ["head"]
    assert jobs_of("own.yaml") == (job,)
    shutil.copy(shipped_model_path(DETECTOR), tmp_path / "detector.onnx")
    own.write_text("{head: ./head.onnx, detector: 'ultralytics:detector.onnx'}")
    (other,) = jobs_of("own.yaml")
    assert other.networks == job.networks
    both = scenario_of(other.scenario_text).networks
    assert both["head"] == networks["head"]
    assert both["detector"] == f"ultralytics:{tmp_path / 'detector.onnx'}"
    assert other != job
    altered = job.scenario_text.replace(networks["sha256"]["head"], 64 * "0")
    error = attempt(replace(job, scenario_text=altered)).record.error
    assert f"head {tmp_path / 'head.onnx'} has changed: its sha256 is" in error


@pytest.mark.slow
def test_a_run_with_other_networks_is_not_resumed(own: Path, tmp_path: Path):
    out = tmp_path / "run"
    run_jobs(jobs_of(str(own)), out, workers=1)
    own.write_text(f"{{head: {tmp_path / 'head.onnx'}, eyes: none}}")
    before = (out / "episodes.csv").read_bytes()
    with pytest.raises(SimError, match=r"another scenario_text \(networks\.eyes\); resume with"):
        run_jobs(jobs_of(str(own)), out, workers=1, resume=True)
    assert (out / "episodes.csv").read_bytes() == before


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "cannot read "),
        ("detectr: shipped", "unknown key 'detectr' in NetworkChoice; did you mean 'detector'?"),
        ("head: nothing.onnx", "there is no file 'nothing.onnx'"),
        ("detector: rtmdet-nano", "rtmdet-nano is not in "),
        ("head: {folder}/own.yaml", "is not an ONNX network that onnxruntime "),
    ],
)
def test_unusable_networks_are_refused_before_anything_is_written(
    text: str | None,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path / "empty"))
    file, out = tmp_path / "own.yaml", tmp_path / "out"
    if text is not None:
        file.write_text(text.replace("{folder}", str(tmp_path)))
    words = ["--scenario", "blind_corner", "--networks", str(file), "--out", str(out)]
    for command in ("crossings", "tune"):
        assert main([command, *words, "--perception", "pixels"]) == 2
        error = capsys.readouterr().err
        assert error.startswith(f"awarenav {command}: ")
        assert str(file) in error
        assert message in error
        assert error.count("\n") == 1
        assert not out.exists()


def test_networks_without_pictures_are_refused(own: Path, capsys: pytest.CaptureFixture[str]):
    message = "networks see pictures: they need perception 'pixels', got "
    with pytest.raises(SimError, match=f"{message}'truth'"):
        run_crossing(SCENE, policy="balanced", networks=str(own))
    with pytest.raises(SimError, match=f"{message}'scanner'"):
        run_crossing(SCENE, policy="balanced", perception="scanner", networks=str(own))
    for command in ("crossings", "falsify", "tune"):
        assert main([command, "--scenario", "blind_corner", "--networks", str(own)]) == 2
        assert f"{message}'keypoints'" in capsys.readouterr().err


def test_an_environment_drives_with_its_networks(own: Path):
    pytest.importorskip("gymnasium", reason="needs the extra awarenav[gym]")
    from sim_tests.learning import CrossingEnv  # noqa: PLC0415 - needs the extra

    with pytest.raises(SimError, match="need perception 'pixels', got 'truth'"):
        CrossingEnv(SCENE, networks=str(own))
    env = CrossingEnv(SCENE, perception="pixels", networks=str(own))
    env.reset(seed=0)
    assert set(env.crossing.scenario.networks) == {"head", "sha256"}
    env.close()


@pytest.mark.slow
def test_a_detector_of_photographs_finds_the_person_in_every_picture(tmp_path: Path):
    """The detector looks at every other picture, and at each one that needs it."""
    detector = MODELS / "rtmdet_nano_person_320_mmpose.onnx"
    if not detector.exists():
        pytest.skip("needs the folder of genuine models")
    own = written(tmp_path / "real.yaml", f"{{detector: {detector}, head: network}}")
    result = run_crossing(SCENE, policy="balanced", perception="pixels", networks=own)
    # A picture of the last cycle has not arrived.
    assert sum(0 in frame.observed_workers for frame in result.frames) >= len(result.frames) - 1
    seen = [each.awareness for frame in result.frames for each in frame.observations]
    # One picture in ten may have a poor head: α 0.43 among 0.97.
    assert sum(alpha is not None and alpha > 0.6 for alpha in seen) > 0.8 * len(seen)
