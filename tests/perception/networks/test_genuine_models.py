"""Third-party networks on photographs; skipped if the files are not beside the checkout."""

from __future__ import annotations

import importlib.util
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper
from paths import ROOT, SHARED

from perception import PerceptionError, PersonDetection
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
def test_no_person_is_found_twice(name: str, photographs: list[Photograph]) -> None:
    """No two boxes have the same person as best match at IoU 0.5."""
    detector = OnnxPersonDetector(model(name))
    for photograph in photographs:
        overlap = ious(detector.detect(photograph.image_rgb), photograph.boxes)
        matched = overlap.argmax(axis=1)[overlap.max(axis=1) >= 0.5]
        assert len(set(matched.tolist())) == len(matched)


@pytest.mark.parametrize("name", list(LAYOUTS)[:3])
def test_an_image_with_other_padding_shows_the_same_person(
    name: str, photographs: list[Photograph]
) -> None:
    detector = OnnxPersonDetector(model(name), score_threshold=0.6)
    image = photographs[0].image_rgb
    tall = np.pad(image, ((0, 200), (0, 0), (0, 0)), constant_values=114)
    (one,), (other,) = detector.detect(image), detector.detect(tall)
    assert ious((one,), other.box_xyxy_px[None]).item() > 0.8


@pytest.mark.parametrize("name", list(LAYOUTS)[:3])
def test_an_independent_decoder_finds_the_same_people(
    name: str, photographs: list[Photograph]
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
    detector = OnnxPersonDetector(
        path, iou_threshold=0.65, settings=OnnxSettings(intra_op_threads=1)
    )
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


def yolox_with_dets_and_labels(*, named: bool) -> bytes:
    """Return the genuine YOLOX with its boxes decoded in the graph, as OpenMMLab's exports do it.

    With ``named`` False its weights and nodes have numbers for names.
    """
    network = onnx.load(model("yolox_nano_416_coco"))
    graph = network.graph
    cells, strides = [], []
    for stride in (8, 16, 32):
        rows, columns = np.mgrid[: 416 // stride, : 416 // stride]
        cells.append(np.stack([columns.ravel(), rows.ravel()], axis=1))
        strides.append(np.full((columns.size, 1), stride))
    constants = {
        "cells": np.concatenate(cells)[None].astype(np.float32),
        "strides": np.concatenate(strides)[None].astype(np.float32),
        "half": np.float32(0.5),
        "parts": np.array([2, 2, 1, 80]),
    }
    graph.initializer.extend(
        numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()
    )
    raw, wanted = graph.output[0].name, ("xy", "log", "object", "classes")
    graph.node.append(helper.make_node("Split", [raw, "parts"], wanted, axis=2))
    for kind, inputs, output, options in (
        ("Add", ("xy", "cells"), "moved", {}),
        ("Mul", ("moved", "strides"), "centre", {}),
        ("Exp", ("log",), "size", {}),
        ("Mul", ("size", "strides"), "sides", {}),
        ("Mul", ("sides", "half"), "reach", {}),
        ("Sub", ("centre", "reach"), "low", {}),
        ("Add", ("centre", "reach"), "high", {}),
        ("Mul", ("object", "classes"), "scores", {}),
        ("ReduceMax", ("scores",), "score", {"axes": [2], "keepdims": 1}),
        ("ArgMax", ("scores",), "labels", {"axis": 2, "keepdims": 0}),
        ("Concat", ("low", "high", "score"), "dets", {"axis": 2}),
    ):
        graph.node.append(helper.make_node(kind, inputs, [output], **options))
    count = len(constants["cells"][0])
    del graph.output[:]
    graph.output.extend(
        [
            helper.make_tensor_value_info("dets", TensorProto.FLOAT, [1, count, 5]),
            helper.make_tensor_value_info("labels", TensorProto.INT64, [1, count]),
        ]
    )
    network.opset_import[0].version = max(network.opset_import[0].version, 13)
    if not named:
        numbers = {each.name: str(number) for number, each in enumerate(graph.initializer, 10_000)}
        for each in graph.initializer:
            each.name = numbers[each.name]
        for node in graph.node:
            node.name = ""
            node.input[:] = [numbers.get(name, name) for name in node.input]
    content: bytes = network.SerializeToString()
    return content


def test_a_yolox_with_dets_and_labels_finds_the_people_of_the_raw_one(
    photographs: list[Photograph],
) -> None:
    content = yolox_with_dets_and_labels(named=True)
    whole, raw = OnnxPersonDetector(content), OnnxPersonDetector(model("yolox_nano_416_coco"))
    assert whole.layout == "YOLOX with NMS"
    for photograph in photographs:
        found, wanted = (each.detect(photograph.image_rgb) for each in (whole, raw))
        boxes = np.array([person.box_xyxy_px for person in wanted])
        assert len(found) == len(wanted) > 0
        assert (ious(found, boxes).max(axis=0) > 0.95).all()


def test_a_yolox_whose_names_do_not_tell_is_asked_for(photographs: list[Photograph]) -> None:
    content = yolox_with_dets_and_labels(named=False)
    with pytest.raises(PerceptionError, match="family='rtmdet' or family='yolox'"):
        OnnxPersonDetector(content)
    told = OnnxPersonDetector(content, family="yolox")
    assert sum(len(told.detect(photograph.image_rgb)) for photograph in photographs) == 13


def test_two_detectors_may_share_a_loaded_model() -> None:
    loaded = OnnxModel(model("rtmdet_nano_person_320_mmpose"))
    small, large = (OnnxPersonDetector(loaded, input_size_hw_px=(s, s)) for s in (320, 640))
    assert small.model is large.model
    assert large.input_size_hw_px == (640, 640)
