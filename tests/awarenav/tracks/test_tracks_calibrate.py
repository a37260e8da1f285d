"""``awarenav tracks calibrate``, positions as CSV, and smoothed paths in the plot."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from awarenav.cli import main
from awarenav.tracks._plot import tracks_figure
from awarenav.tracks._recording import read_positions
from awarenav.tracks._tracking import distances_m, smoothed_path, track_recording
from tracking.prediction import REGION_SHARE, PredictionModel

STD_M = 0.1
PERIOD_S = 0.1


def walks(people: int, seconds: float, seed: int = 0) -> np.ndarray:
    """Return true places (T, N, 2) of people who turn as they walk, each in a lane of their own."""
    rng = np.random.default_rng(seed)
    steps = round(seconds / PERIOD_S)
    turn = np.cumsum(rng.normal(0.0, 0.12, (steps, people)), axis=0)
    speed_mps = rng.uniform(0.8, 1.5, people)
    step = PERIOD_S * speed_mps * np.stack([np.cos(turn), np.sin(turn)], axis=0)
    lanes = np.array([60.0 * np.arange(people), np.zeros(people)])
    return np.moveaxis(np.cumsum(step, axis=1) + lanes[:, None], 0, -1)


def write_csv(path: Path, truth: np.ndarray, *, std: bool = True, seed: int = 1) -> Path:
    rng = np.random.default_rng(seed)
    measured = truth + rng.normal(0.0, STD_M, truth.shape)
    rows = ["t_s,id,x_m,y_m" + (",std_m" if std else "")]
    for frame, places in enumerate(measured):
        for person, (x, y) in enumerate(places.tolist()):
            more = f",{STD_M}" if std else ""
            rows.append(f"{PERIOD_S * frame:.2f},{person},{x:.4f},{y:.4f}{more}")
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.fixture(scope="module")
def crowd(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_csv(tmp_path_factory.mktemp("crowd") / "crowd.csv", walks(12, 20.0))


def calibrate(*words: object) -> int:
    return main(["tracks", "calibrate", *map(str, words)])


def test_the_model_is_written_and_holds_on_the_other_half(crowd, tmp_path, capsys):
    out = tmp_path / "new" / "site.yaml"
    assert calibrate(crowd, "--out", out) == 0
    text = capsys.readouterr().out
    assert f"Written to {out}" in text
    assert "(6 and 6 people)" in text
    model = PredictionModel.from_yaml(out)
    assert model.horizons_s == (0.2, 0.5, 1.0, 1.5, 2.0)
    assert calibrate(crowd, "--json", "--out", out) == 0
    record = json.loads(capsys.readouterr().out)
    assert [row["factor"] for row in record["horizons"]] == list(model.std_factors)
    for row in record["horizons"]:
        assert abs(row["inside"] - REGION_SHARE) < 0.06
        assert abs(row["inside"] - REGION_SHARE) <= abs(row["inside_before"] - REGION_SHARE) + 0.02


def test_several_recordings_count_together_up_to_the_longest_horizon(crowd, tmp_path, capsys):
    short = [write_csv(tmp_path / f"{k}.csv", walks(4, 4.0, seed=k)) for k in (3, 4, 5)]
    assert calibrate(*short, "--longest", "0.8", "--out", tmp_path / "p.yaml") == 0
    assert PredictionModel.from_yaml(tmp_path / "p.yaml").horizons_s == (0.2, 0.5, 0.8)


def test_outputs_and_options_that_do_not_fit_are_refused(crowd, tmp_path, capsys):
    std = tmp_path / "std.csv"
    std.write_text("t_s,id,x_m,y_m,std_m\n0,1,2,3,0\n")
    few = write_csv(tmp_path / "few.csv", walks(3, 2.0))
    for words, message in (
        ((crowd, "--out", tmp_path / "p.txt"), "--out must end in .yaml or .yml"),
        ((crowd, tmp_path / "none.csv"), "cannot read"),
        ((std,), "line 2: std_m must be above 0 m, got 0"),
        ((few,), "needs 4 people or more who are tracked for 0.2 s, got 3"),
        ((crowd, "--longest", "0.1"), "0.1"),
    ):
        assert calibrate(*words) == 2
        assert message in capsys.readouterr().err
    own = tmp_path / "tracker.yaml"
    own.write_text("{}\n")
    assert calibrate(crowd, "--config", own, "--out", own) == 2
    assert "would replace an input" in capsys.readouterr().err
    camera = ("tracks", str(crowd), "--camera", "camera.yaml", "--out", "none")
    assert main(list(camera)) == 2
    assert "--camera cannot be used with positions" in capsys.readouterr().err


def test_positions_are_read_as_they_stand(tmp_path):
    truth = walks(3, 2.0)
    recording = read_positions(write_csv(tmp_path / "a.csv", truth, std=False))
    assert len(recording.frames) == 20
    assert recording.frames[7].ids == (0, 1, 2)
    places = np.array(recording.frames[7].positions_odom_m())
    assert np.abs(places - truth[7]).max() < 5.0 * STD_M
    assert recording.without_covariance == 60


def test_smoothed_paths_are_nearer_to_the_truth_and_drawn(crowd, capsys):
    truth = walks(12, 20.0)
    tracked = track_recording(read_positions(crowd))
    errors = []
    paths = {}
    for history in tracked.histories:
        path = smoothed_path(history, None)
        if path is None or len(path.stamps_s) < 150:
            continue  # an outlier, or its track
        paths[history.id] = path
        lane = round(float(path.states[0, 0]) / 60.0)
        reached = truth[np.round(path.stamps_s / PERIOD_S).astype(int), lane]
        both = (history.positions_odom_m[: len(path.stamps_s)], path.states[:, :2])
        errors.append([np.linalg.norm(each - reached, axis=1).mean() for each in both])
        assert distances_m(history, path).mean() < 0.1
    assert len(paths) >= 10
    before, after = np.mean(errors, axis=0)
    assert after < 0.85 * before
    figure = tracks_figure(tracked, "title", smoothed=paths, most=4)
    labels = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert "smoothed" in labels
    assert "camera" not in labels
    drawn = {tuple(line.get_xydata()[0]) for line in figure.axes[0].get_lines()}
    starts = [tuple(path.states[0, :2]) in drawn for path in paths.values()]
    assert sum(starts) == 4  # of the people with a colour
    assert main(["tracks", str(crowd), "--smooth", "--out", "none"]) == 0
    assert "apart on average" in capsys.readouterr().err


def test_ids_of_positions_are_shown_as_they_are_and_not_smoothed(crowd, capsys):
    assert main(["tracks", str(crowd), "--ids", "--out", "none"]) == 0
    assert len(capsys.readouterr().out.splitlines()) >= 12
    assert main(["tracks", str(crowd), "--ids", "--smooth", "--out", "none"]) == 2
    assert "--smooth" in capsys.readouterr().err
