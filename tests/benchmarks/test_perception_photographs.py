"""Judging on photographs: matching, figures, bad folders, and the shipped networks as they are."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
from paths import SHARED

from benchmarks.perception.__main__ import main
from benchmarks.perception._photographs import (
    LABELS,
    figures,
    judge_folder,
    matched,
    read_labels,
)
from perception import PersonObservation

DEV = SHARED / "images" / "dev"


def seen(box, alpha=None, score=0.8):
    return PersonObservation(
        stamp_s=0.0,
        position_camera_m=np.array([0.0, 0.0, 3.0]),
        position_covariance_m2=np.eye(3),
        gaze_camera=None if alpha is None else np.array([0.0, 0.0, -1.0]),
        awareness=alpha,
        awareness_std=None if alpha is None else 0.1,
        score=score,
        box_xyxy_px=np.array(box, dtype=float),
    )


def test_each_box_matches_once_and_the_most_people_count():
    truth = np.array([[0.0, 0.0, 10.0, 20.0], [6.0, 0.0, 16.0, 20.0]])
    found = np.array([[3.0, 0.0, 13.0, 20.0], [0.0, 0.0, 10.0, 20.0], [50.0, 0.0, 60.0, 20.0]])
    assert matched(truth, found) == ((0, 1), (1, 0))
    assert matched(truth, np.zeros((0, 4))) == ()
    assert matched(np.zeros((0, 4)), found) == ()
    assert matched(truth[:1], found[:1], min_iou=0.6) == ()


def test_bad_folders_are_refused(tmp_path, capsys):
    with pytest.raises(ValueError, match=f"must hold photographs and {LABELS}"):
        read_labels(tmp_path)
    label = {"a.jpg": {"size": [9, 9], "people_xyxy_px": [[5, 5, 1, 1]]}}
    (tmp_path / LABELS).write_text(json.dumps(label), encoding="utf-8")
    with pytest.raises(ValueError, match=r"boxes of a\.jpg must be x0, y0, x1, y1"):
        read_labels(tmp_path)
    label["a.jpg"]["people_xyxy_px"] = [[1, 1, 5, 5]]
    (tmp_path / LABELS).write_text(json.dumps(label), encoding="utf-8")
    with pytest.raises(SystemExit):
        main(["photographs", str(tmp_path)])
    assert "a.jpg must be a photograph that OpenCV reads" in capsys.readouterr().err


def test_a_picture_of_noise_has_nobody(tmp_path, capsys):
    noise = np.random.default_rng(0).integers(100, 156, (120, 160, 3), np.uint8)
    cv2.imwrite(str(tmp_path / "n.png"), noise)
    label = {"n.png": {"size": [160, 120], "people_xyxy_px": [[10, 10, 50, 110]]}}
    (tmp_path / LABELS).write_text(json.dumps(label), encoding="utf-8")
    main(["photographs", str(tmp_path)])
    text = capsys.readouterr().out
    assert "1 people in 1 photographs: recall 0.00" in text
    assert "nobody" in text


@pytest.mark.full
@pytest.mark.skipif(not DEV.is_dir(), reason="the photographs of ../shared are not here")
def test_the_shipped_networks_on_photographs_are_measured_as_they_are():
    """The networks know renders; keypoints confirm what the detector is unsure of."""
    results = judge_folder(DEV)
    found = figures(results)
    assert (found["people"], found["pictures"]) == (19, 14)
    assert found["recall"] > 0.6
    assert found["false_per_picture"] <= 0.3
