"""Third-party networks on photographs; skipped if the files are not beside the checkout."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from genuine_detectors import MODELS, GenuineDetector
from paths import SHARED

from perception.networks import OnnxModel, OnnxPersonDetector, OnnxSettings

LAYOUTS = {
    "rtmdet_nano_person_320_mmpose": ("RTMDet", (320, 320)),
    "yolov8n_int8_640_coco": ("YOLOv8", (640, 640)),
    "yolox_nano_416_coco": ("YOLOX raw", (416, 416)),
    "yolo26n_e2e_random": ("rows (NMS inside)", (640, 640)),
}


def model(name: str) -> Path:
    path = MODELS / f"{name}.onnx"
    if not path.is_file():
        pytest.skip(f"needs {path.name} in the folder of genuine models")
    return path


@pytest.mark.parametrize("name", LAYOUTS)
def test_each_file_loads_and_its_layout_is_recognised(name: str) -> None:
    loaded = OnnxModel(model(name))
    detector = OnnxPersonDetector(loaded)
    assert detector.model is loaded
    assert (detector.layout, detector.input_size_hw_px) == LAYOUTS[name]
    grey = np.full((480, 640, 3), 128, np.uint8)
    assert all(p.score < 0.5 for p in detector.detect(grey))


@pytest.mark.parametrize("name", list(LAYOUTS)[:3])
def test_an_independent_decoder_finds_the_same_people(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reference is an independent program, which also judges the rendered workers."""
    path = model(name)
    photographs = sorted((SHARED / "images").glob("coco_*.jpg"))[:4]
    if not photographs:
        pytest.skip("needs photographs in the folder of genuine images")
    reference = GenuineDetector(name)
    monkeypatch.setattr("perception.networks.detectors._overlaps._SAME_PERSON_IOU", 0.65)
    detector = OnnxPersonDetector(path, settings=OnnxSettings(intra_op_threads=1))
    compared = 0
    for photograph in photographs:
        image_rgb = cv2.cvtColor(cv2.imread(str(photograph)), cv2.COLOR_BGR2RGB)
        people = detector.detect(image_rgb)
        wanted = reference.people(image_rgb, least_score=0.25)
        height, width = image_rgb.shape[:2]
        boxes = np.clip(wanted.boxes_xyxy_px, 0, (width, height, width, height))
        assert len(people) == len(boxes)
        for person, box, score in zip(people, boxes, wanted.scores, strict=True):
            # The reference has one scale for both axes; here the sides are rounded to whole pixels,
            # which differs by 0.3 %.
            np.testing.assert_allclose(person.box_xyxy_px, box, atol=1.5)
            assert person.score == pytest.approx(score, abs=0.01)
            compared += 1
    assert compared >= 8
