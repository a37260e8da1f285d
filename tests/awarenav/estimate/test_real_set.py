"""A photograph with the set ``real`` as the command fetches it: the newcomer's first picture."""

from __future__ import annotations

import shutil

import cv2
import pytest
from paths import SHARED

from awarenav.cli import main
from awarenav.records import read_records

PHOTOGRAPH = SHARED / "images" / "coco_000000040083.jpg"


@pytest.mark.slow
@pytest.mark.skipif(not PHOTOGRAPH.is_file(), reason="no photographs beside the checkout")
def test_two_commands_lead_to_the_people_in_a_photograph(tmp_path, monkeypatch, capsys):
    pytest.importorskip("ai_edge_litert", reason="the extra litert is not installed")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path / "models"))
    shutil.copy(PHOTOGRAPH, "photo.jpg")
    assert main(["estimate", "photo.jpg"]) == 2
    assert "`awarenav models fetch real` brings others" in capsys.readouterr().err
    if main(["models", "fetch", "real"]) != 0:
        pytest.skip(f"the networks cannot be fetched: {capsys.readouterr().err}")
    assert "next: awarenav estimate PHOTO.jpg\n" in capsys.readouterr().out
    assert main(["estimate", "photo.jpg", "--overlay", "seen.png"]) == 0
    said = capsys.readouterr()
    assert "networks of the fetched set real: detector efficientdet-lite0" in said.err
    # The one on the right looks at the camera, the other one past it.
    (frame,) = read_records(tmp_path / "estimates.jsonl")
    assert "simulator_networks" not in frame
    past, at_us = sorted(frame["people"], key=lambda each: each["box_xyxy_px"][0])
    assert at_us["awareness"] > 0.8
    assert past["awareness"] is None or past["awareness"] < 0.5
    assert cv2.imread("seen.png").shape == cv2.imread("photo.jpg").shape
    assert main(["doctor", "photo.jpg", "--out", "none", "--threads", "1"]) == 1  # no calibration
    assert "face-mesh by Google (MediaPipe)" in " ".join(capsys.readouterr().out.split())
