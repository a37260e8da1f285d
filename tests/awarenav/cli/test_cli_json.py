"""``--json``: one JSON document on standard output, and nothing else."""

from __future__ import annotations

import json

import pytest
from command_line import COMMANDS, SHORT_SCENARIO, options_of

from awarenav.cli import main
from awarenav.records import write_records
from sim_tests.study.measures import EpisodeRecord
from sim_tests.study.measures import write_records as write_episodes

PERSON = {
    "id": 0,
    "box_xyxy_px": [100.0, 100.0, 200.0, 300.0],
    "position_camera_m": [0.2, 0.1, 3.0],
    "gaze_camera": [0.0, 0.0, -1.0],
    "awareness": 0.5,
    "awareness_std": 0.1,
    "score": 0.9,
}
FRAMES = [
    {"frame": f"{k:06d}.png", "stamp_s": 0.1 * k, "T_odom_camera": None, "people": [PERSON]}
    for k in range(4)
]
# These take minutes, or need a study of many episodes; their own tests read their JSON.
SLOW = {("bench",), ("demo",), ("falsify",), ("planners", "compare"), ("tune",)}


def printed(capfd, *words, status=0):
    """Run a command and return the JSON that it prints."""
    assert main([*map(str, words), "--json"]) == status
    return json.loads(capfd.readouterr().out)


@pytest.fixture
def estimates(tmp_path):
    path = tmp_path / "estimates.jsonl"
    write_records(path, FRAMES)
    return path


def test_every_command_with_json_is_tested_here():
    commands = {path for path, each in COMMANDS.items() if "--json" in options_of(each)}
    tested = {
        ("compare",),
        ("crossings",),
        ("doctor",),
        ("judge",),
        ("measures",),
        ("models", "list"),
        ("models", "verify"),
        ("planners", "list"),
        ("policy", "show"),
        ("scenario", "list"),
        ("tracks",),
        ("tracks", "calibrate"),
    }
    assert commands == tested | SLOW


def test_policy_show_prints_json(capfd):
    shown = printed(capfd, "policy", "show", "blind", "balanced", "--out", "none")
    assert list(shown) == ["blind", "balanced"]
    assert len(shown["blind"]["radius_m"]) == len(shown["blind"]["awareness"])


def test_models_print_json(capfd, tmp_path):
    listed = printed(capfd, "models", "list", "--out", tmp_path)
    assert {"shipped", "real_robot", "named_only"} < set(listed)
    states = printed(capfd, "models", "verify", "--out", tmp_path)
    assert set(states) == {each["name"] for each in listed["shipped"]}


def test_planners_list_prints_json(capfd):
    listed = printed(capfd, "planners", "list")
    assert [each["name"] for each in listed] == ["reference", "costmap", "straight_on"]
    assert all(each["about"].endswith((".", "(Fox, Burgard and Thrun 1997).")) for each in listed)


def test_doctor_prints_json(capfd):
    subjects = [each["subject"] for each in printed(capfd, "doctor")]
    assert {"packages", "shipped networks", "extras"} <= set(subjects)


def test_scenario_list_prints_json(capfd):
    names = [each["name"] for each in printed(capfd, "scenario", "list")]
    assert "blind_corner" in names


def test_tracks_print_json(capfd, tmp_path, estimates):
    (track,) = printed(capfd, "tracks", estimates, "--out", tmp_path / "tracks.png")
    assert track["id"] == 1
    assert track["seen_frames"] == len(FRAMES)
    assert (tmp_path / "tracks.png").exists()


def test_calibrate_prints_json(capfd, tmp_path):
    rows = ["t_s,id,x_m,y_m"]
    rows += [f"{0.1 * k:.1f},{id},{0.12 * k:.2f},{10 * id}" for k in range(30) for id in range(4)]
    (tmp_path / "people.csv").write_text("\n".join(rows))
    words = ("--longest", "0.4", "--out", tmp_path / "prediction.yaml")
    table = printed(capfd, "tracks", "calibrate", tmp_path / "people.csv", *words)
    assert table["people"] == [2, 2]
    assert [row["horizon_s"] for row in table["horizons"]] == [0.2, 0.4]


def test_judge_prints_json(capfd, tmp_path, estimates):
    metrics = printed(capfd, "judge", estimates, estimates, "--out", tmp_path / "report.md")
    assert metrics["detection"]["ap50"] == 1.0
    assert (tmp_path / "report.md").read_text("utf-8").startswith("4 frames")


def test_measures_print_json(capfd, tmp_path):
    track = tmp_path / "track.csv"
    track.write_text("timestamp,robot_x,robot_y\n0,0,0\n1000000000,0.5,0\n")
    (found,) = printed(capfd, "measures", track).values()
    assert found["episodes"] == 1
    assert found["means"]["navwareset_speed_mps"] == 0.5
    assert found["means"]["spl"] is None


def test_compare_prints_json(capfd, tmp_path):
    records = [
        EpisodeRecord("blind_corner", seed, policy, "SamplingPlanner", "keypoints", success=True)
        for seed in range(2)
        for policy in ("blind", "balanced")
    ]
    write_episodes(tmp_path / "episodes.csv", records)
    summary = printed(capfd, "compare", tmp_path, "--out", tmp_path / "all.csv")
    assert [each["variant"] for each in summary["policies"]] == ["blind", "balanced"]


def test_crossings_print_json(capfd, tmp_path):
    scenario = tmp_path / "short.yaml"
    scenario.write_text(SHORT_SCENARIO)
    words = ["crossings", "--scenario", scenario, "--policy", "blind", "--perception", "truth"]
    words += ["--workers", "1", "--out", tmp_path / "run"]
    (row,) = printed(capfd, *words)
    assert row["variant"] == "blind"
    assert row["episodes"] == 1
    assert (tmp_path / "run" / "report.html").exists()
