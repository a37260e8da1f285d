"""``awarenav tracks`` as a newcomer runs it."""

from __future__ import annotations

import csv
import re

import numpy as np
import pytest
from paths import ROOT
from track_lines import lines, pose, standing, walking

from awarenav.cli import main
from awarenav.records import write_records
from awarenav.tracks._recording import read_recording
from awarenav.tracks._run import CSV_COLUMNS
from awarenav.tracks._tracking import track_recording
from perception import Camera
from tracking import AwarenessFilterConfig, TrackerConfig

WALKERS = [walking(4.0, -2.0, 0.0, 1.0), standing(5.0, 1.0)]
HEADS = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}


@pytest.fixture
def estimates(tmp_path):
    path = tmp_path / "estimates.jsonl"
    write_records(path, lines(WALKERS, hidden=lambda k, who: who == 0 and 15 < k < 22))
    return path


def run(path, *arguments):
    return main(["tracks", str(path), *map(str, arguments)])


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_plot_is_a_whole_file_and_the_same_every_time(estimates, tmp_path):
    first, second = tmp_path / "a.svg", tmp_path / "new" / "b.svg"
    assert run(estimates, "--out", first) == 0
    assert run(estimates, "--out", second) == 0
    assert first.read_bytes() == second.read_bytes()
    assert [each.name for each in second.parent.iterdir()] == [second.name]
    assert run(estimates, "--out", tmp_path / "a.pdf") == 0
    for path in (first, tmp_path / "a.pdf"):
        assert path.read_bytes().startswith(HEADS[path.suffix])


def test_the_table_has_one_line_per_track_with_its_life_and_awareness(estimates, capsys):
    assert run(estimates, "--out", "none") == 0
    header, *body = capsys.readouterr().out.splitlines()
    words = ["id", "born", "(s)", "confirmed", "(s)", "died", "(s)", "seen", "coasted"]
    assert header.split() == [*words, "mean", "α", "lower"]
    histories = track_recording(read_recording(estimates)).histories
    assert [line.split()[0] for line in body] == ["1", "2"]
    for line, history in zip(body, histories, strict=True):
        _, born, confirmed, died, seen, coasted, alpha, lower = line.split()
        assert (born, confirmed, died) == ("0.00", f"{history.confirmed_s:.2f}", "–")
        assert (int(seen), int(coasted)) == (history.seen_frames, 40 - history.seen_frames)
        assert float(alpha) == pytest.approx(history.mean("awareness"), abs=0.0051)
        assert float(lower) == pytest.approx(history.mean("awareness_lower"), abs=0.0051)
    assert histories[0].seen_frames == 34


def test_the_truth_names_the_person_of_each_track_and_smoothing_adds_no_track(
    estimates, tmp_path, capsys
):
    truth, out = tmp_path / "truth.jsonl", tmp_path / "a.png"
    write_records(truth, lines(WALKERS, named=True))
    assert run(estimates, "--truth", truth, "--smooth", "--out", out) == 0
    header, *body, written = capsys.readouterr().out.splitlines()
    assert header.split()[-1] == "person"
    assert [(line.split()[0], line.split()[-1]) for line in body] == [("1", "0"), ("2", "1")]
    assert written == f"Written to {out}"
    assert out.read_bytes().startswith(HEADS[".png"])


def test_the_csv_file_has_every_track_at_every_frame(estimates, tmp_path):
    path = tmp_path / "tracks.csv"
    assert run(estimates, "--out", "none", "--csv", path) == 0
    table = rows(path)
    assert tuple(table[0]) == CSV_COLUMNS
    samples = {
        (repr(sample.stamp_s), str(history.id)): sample
        for history in track_recording(read_recording(estimates)).histories
        for sample in history.frames
    }
    assert [(row["stamp_s"], row["id"]) for row in table] == sorted(
        samples, key=lambda key: (float(key[0]), int(key[1]))
    )
    for row in table:
        sample = samples[row["stamp_s"], row["id"]]
        assert row["status"] == sample.status
        assert row["seen"] == str(sample.seen).lower()
        assert float(row["x_odom_m"]) == pytest.approx(sample.position_odom_m[0], abs=1e-6)
        std = np.sqrt(sample.position_covariance_m2[1, 1])
        assert float(row["y_std_m"]) == pytest.approx(std, abs=1e-6)
        assert float(row["awareness_lower"]) == pytest.approx(sample.awareness_lower, abs=1e-6)
        assert (row["measured_awareness"] == "") == (sample.measured_awareness is None)


def test_settings_and_camera_come_from_files(tmp_path, capsys):
    path = tmp_path / "estimates.jsonl"
    write_records(path, lines([standing(4.0, 2.0)], frames=90, hidden=lambda k, who: k > 10))

    def died_s(*arguments):
        assert run(path, "--out", "none", *arguments) == 0
        return float(capsys.readouterr().out.splitlines()[1].split()[3])

    unknown_view_s = died_s()
    config = tmp_path / "tracker.yaml"
    TrackerConfig(max_missed_s=3.0).to_yaml(config)
    assert died_s("--config", config) > unknown_view_s + 1.0
    # A camera whose image ends before the person's place.
    Camera.from_fov(640, 480, 0.4).to_yaml(tmp_path / "elsewhere.yaml")
    known_view_s = died_s("--camera", tmp_path / "elsewhere.yaml")
    assert known_view_s > unknown_view_s + 1.0
    (tmp_path / "elsewhere.yaml").rename(tmp_path / "camera.yaml")
    assert died_s() == known_view_s


@pytest.mark.parametrize(("step_m", "said"), [(0.2, False), (4.0, True)])
def test_single_images_of_many_places_are_reported(tmp_path, capsys, step_m, said):
    path = tmp_path / "set.jsonl"
    write_records(path, lines(WALKERS, frames=6, camera=lambda t: pose(10.0 * step_m * t)))
    assert run(path, "--out", "none") == 0
    error = capsys.readouterr().err
    assert (f"the camera jumps by {step_m:.1f} m from frame to frame" in error) == said


def test_a_file_without_people_is_reported_and_drawn(tmp_path, capsys):
    path = tmp_path / "nobody.jsonl"
    write_records(path, lines([], frames=5))
    assert run(path, "--out", tmp_path / "nobody.png") == 0
    assert "no people in 5 frames" in capsys.readouterr().out
    assert (tmp_path / "nobody.png").read_bytes().startswith(HEADS[".png"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--out", "{tmp}/tracks.txt"], "--out must end in .png, .svg, .pdf or be none"),
        (["--csv", "{tmp}"], "--csv must be a file"),
        (["--csv", "{tmp}/estimates.jsonl"], "would replace an input"),
        (["--csv", "{tmp}/out.png"], "--out and --csv are the same file"),
        (["--config", "{tmp}/absent.yaml"], "absent.yaml"),
        (["--config", "{tmp}/estimates.jsonl"], "estimates.jsonl"),
        (["--camera", "{tmp}/absent.yaml"], "absent.yaml"),
        (["--truth", "{tmp}/absent.jsonl"], "absent.jsonl"),
        (["--truth", "{tmp}/estimates.jsonl"], "people of a truth file need an id"),
        (["--ids"], "leave out --ids to track them here"),
    ],
)
def test_bad_input_is_refused_and_nothing_is_written(
    estimates, tmp_path, capsys, arguments, message
):
    out = tmp_path / "out.png"
    arguments = [argument.replace("{tmp}", str(tmp_path)) for argument in arguments]
    before = sorted(tmp_path.iterdir())
    assert run(estimates, "--out", out, *arguments) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert sorted(tmp_path.iterdir()) == before


def test_the_page_about_tracking_names_settings_that_exist():
    page = (ROOT / "docs" / "tracking.md").read_text("utf-8")
    settings = {*TrackerConfig.model_fields, *AwarenessFilterConfig.model_fields}
    named = set(re.findall(r"`([a-z_0-9]+_(?:m|s|mps|m2ps3|hits|cost|probability|std))`", page))
    assert len(named) > 12
    assert named <= settings | {"stamp_s", "aware_for_s"}  # of tracks
