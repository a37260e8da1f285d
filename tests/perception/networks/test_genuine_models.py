"""Third-party networks on photographs; skipped if the files are not beside the checkout."""

from __future__ import annotations

import importlib.util
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
from paths import ROOT, SHARED

from perception import PersonDetection
from perception.networks import OnnxModel, OnnxPersonDetector, OnnxSettings

MODELS, IMAGES = SHARED / "models", SHARED / "images"
REFERENCE = ROOT / "tests" / "genuine_detectors.py"
TRUTH = IMAGES / "truth_coco_wholebody_mmpose.json"
LAYOUTS = {
    "rtmdet_nano_person_320_mmpose": ("RTMDet", (320, 320)),
    "yolov8n_int8_640_coco": ("YOLOv8", (640, 640)),
    "yolox_nano_416_coco": ("YOLOX raw", (416, 416)),
    "yolo26n_e2e_random": ("rows (NMS inside)", (640, 640)),
}


@dataclass(frozen=True)
class Photograph:
    image_rgb: np.ndarray
    boxes: np.ndarray  # (N, 4) boxes of all people
    clear: np.ndarray  # (N,) True for people taller than 80 px and less than half hidden


def model(name: str) -> Path:
    path = MODELS / f"{name}.onnx"
    if not path.is_file():
        pytest.skip(f"needs {path.name} in the folder of genuine models")
    return path


@pytest.fixture(scope="module")
def photographs() -> list[Photograph]:
    if not TRUTH.is_file():
        pytest.skip(f"needs {TRUTH.name} and its images in the folder of genuine images")
    truth = json.loads(TRUTH.read_text(encoding="utf-8"))
    found = []
    for entry in truth["images"]:
        path = next(iter(IMAGES.glob(f"*{entry['file_name']}")), None)
        if path is None:
            continue
        people = [p for p in truth["annotations"] if p["image_id"] == entry["id"]]
        boxes = np.array([p["bbox"] for p in people], float)
        boxes[:, 2:] += boxes[:, :2]
        # COCO marks a visible keypoint with 2; half of the keypoints must be visible.
        shown = [np.mean(np.array(p["keypoints"])[2::3] == 2) for p in people]
        clear = (boxes[:, 3] - boxes[:, 1] > 80.0) & (np.array(shown) > 0.5)
        clear &= np.array([not p["iscrowd"] for p in people])
        image = cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB)
        found.append(Photograph(image, boxes, clear))
    assert len(found) == 4
    return found


def ious(people: tuple[PersonDetection, ...], boxes: np.ndarray) -> np.ndarray:
    """Return the intersection over union (people, boxes)."""
    mine = np.array([p.box_xyxy_px for p in people]).reshape(-1, 1, 4)
    low, high = np.maximum(mine[..., :2], boxes[:, :2]), np.minimum(mine[..., 2:], boxes[:, 2:])
    shared = np.prod(np.clip(high - low, 0.0, None), axis=2)
    areas = [np.prod(b[..., 2:] - b[..., :2], axis=-1) for b in (mine, boxes)]
    return np.asarray(shared / (areas[0] + areas[1] - shared))


@pytest.mark.parametrize("name", LAYOUTS)
def test_each_file_loads_and_its_layout_is_recognised(name: str) -> None:
    detector = OnnxPersonDetector(model(name))
    assert (detector.layout, detector.input_size_hw_px) == LAYOUTS[name]
    grey = np.full((480, 640, 3), 128, np.uint8)
    assert all(p.score < 0.5 for p in detector.detect(grey))


def test_all_files_in_the_folder_are_tested() -> None:
    if not MODELS.is_dir():
        pytest.skip("needs the folder of genuine models")
    assert {path.stem for path in MODELS.glob("*.onnx")} == set(LAYOUTS)


def test_rtmdet_and_yolov8_together_find_all_clear_people(
    photographs: list[Photograph],
) -> None:
    detectors = [
        OnnxPersonDetector(model(name))
        for name in ("rtmdet_nano_person_320_mmpose", "yolov8n_int8_640_coco")
    ]
    wanted = 0
    for photograph in photographs:
        best = np.max(
            [
                ious(d.detect(photograph.image_rgb), photograph.boxes).max(axis=0, initial=0.0)
                for d in detectors
            ],
            axis=0,
        )
        assert (best[photograph.clear] >= 0.5).all(), best
        wanted += int(photograph.clear.sum())
    assert wanted >= 8


@pytest.mark.parametrize("name", list(LAYOUTS)[:3])
def test_an_independent_decoder_finds_the_same_people(
    name: str, photographs: list[Photograph], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reference is an independent program, which also judges the rendered workers."""
    path = model(name)
    spec = importlib.util.spec_from_file_location("reference_detectors", REFERENCE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look themselves up there
    spec.loader.exec_module(module)
    reference = module.GenuineDetector(name)
    monkeypatch.setattr("perception.networks.detectors._detector._SAME_PERSON_IOU", 0.65)
    detector = OnnxPersonDetector(path, settings=OnnxSettings(intra_op_threads=1))
    compared = 0
    for photograph in photographs:
        people = detector.detect(photograph.image_rgb)
        wanted = reference.people(photograph.image_rgb, least_score=0.25)
        height, width = photograph.image_rgb.shape[:2]
        boxes = np.clip(wanted.boxes_xyxy_px, 0, (width, height, width, height))
        assert len(people) == len(boxes)
        for person, box, score in zip(people, boxes, wanted.scores, strict=True):
            # The reference has one scale for both axes; here the sides are rounded to whole pixels,
            # which differs by 0.3 %.
            np.testing.assert_allclose(person.box_xyxy_px, box, atol=1.5)
            assert person.score == pytest.approx(score, abs=0.01)
            compared += 1
    assert compared >= 10


def test_two_detectors_may_share_a_loaded_model() -> None:
    loaded = OnnxModel(model("rtmdet_nano_person_320_mmpose"))
    small, large = (OnnxPersonDetector(loaded, input_size_hw_px=(s, s)) for s in (320, 640))
    assert small.model is large.model
    assert large.input_size_hw_px == (640, 640)
