"""Layouts of detectors: known ones are recognised, unknown and ambiguous ones are refused."""

from __future__ import annotations

import numpy as np
import pytest
from onnx_graphs import (
    RTMDET_HEAD,
    YOLOX_HEAD,
    cell_centres,
    cell_count,
    colour_dets,
    fixed,
    red_point_pose,
)

from perception import PerceptionError
from perception.networks import OnnxPersonDetector

SIZE = (256, 320)
CELLS = cell_count(*SIZE)
IMAGE = np.zeros((*SIZE, 3), np.uint8)
BOXES = np.array([[150.0, 40.0, 190.0, 160.0], [20.0, 60.0, 70.0, 250.0]])


def layout(shape: tuple[int, ...], names: str | None = None, **metadata: str) -> str:
    properties = metadata if names is None else metadata | {"names": names}
    graph = fixed({"out": np.zeros(shape)}, SIZE, metadata=properties)
    return OnnxPersonDetector(graph).layout


@pytest.mark.parametrize(
    ("shape", "names", "wanted"),
    [
        ((1, 84, CELLS), None, "YOLOv8"),
        ((1, 5, CELLS), None, "YOLOv8"),
        ((1, 6, CELLS), "{0: 'person', 1: 'dog'}", "YOLOv8"),
        ((1, 84, CELLS + 4 * 5), None, "YOLOv8"),  # with stride 64
        ((1, 300, 6), "{0: 'person'}", "rows (NMS inside)"),
        ((1, 100, 6), "{0: 'person', 1: 'dog'}", "rows (NMS inside)"),
        ((1, CELLS, 85), None, "YOLOX raw"),
        ((1, CELLS, 6), "['person']", "rows (NMS inside)"),  # of zeros, as it finds nobody
    ],
)
def test_the_layout_is_recognised_from_shapes(
    shape: tuple[int, ...], names: str | None, wanted: str
) -> None:
    assert layout(shape, names) == wanted


@pytest.mark.parametrize(
    ("shape", "names", "reason"),
    [
        ((1, CELLS, 84), None, "cells of strides"),  # a transposed YOLOv8
        ((1, CELLS, 5), None, "cells of strides"),
        ((1, 84, CELLS), "['person', 'dog']", "cells of strides"),
        ((1, 3 * CELLS, 85), None, "cells of strides"),  # as YOLOv5 with its anchors
        ((1, 84, 8400), None, rf"an input of this size has {CELLS} cells"),
        ((1, 300, 84), None, "cells"),
        ((1, 17, 64, 48), None, "no known detector has such outputs"),
        ((2, 84, CELLS), None, "batch size 1 for one image"),
        ((300, 6), None, "batch size 1 for one image"),
    ],
)
def test_other_shapes_are_refused_with_what_was_found_and_what_is_known(
    shape: tuple[int, ...], names: str | None, reason: str
) -> None:
    with pytest.raises(PerceptionError, match=reason) as refused:
        layout(shape, names)
    assert f"Found input (1, 3, 256, 320) -> out {shape}" in str(refused.value)
    assert "Known: YOLOv8/11" in str(refused.value)


def test_other_tasks_and_other_numbers_of_outputs_are_refused() -> None:
    with pytest.raises(PerceptionError, match="its task is 'pose'"):
        layout((1, 56, CELLS), task="pose")
    two = {"a": np.zeros((1, 84, CELLS)), "b": np.zeros((1, 32, 64, 80))}
    with pytest.raises(PerceptionError, match="only RTMDet and YOLOX with NMS have two"):
        OnnxPersonDetector(fixed(two, SIZE))
    three = {name: np.zeros((1, 4, 4)) for name in "abc"}
    with pytest.raises(PerceptionError, match="no known detector"):
        OnnxPersonDetector(fixed(three, SIZE))


RED = np.full((*SIZE, 3), (255, 0, 0), np.uint8)


@pytest.mark.parametrize(
    ("part", "wanted"),
    [
        (RTMDET_HEAD, "RTMDet"),
        ("model.bbox_head.rtm_reg.2.bias", "RTMDet"),
        (YOLOX_HEAD, "YOLOX with NMS"),
        ("head.obj_preds.0.weight_quantized", "YOLOX with NMS"),
    ],
)
def test_names_of_weights_tell_what_has_dets_and_labels(part: str, wanted: str) -> None:
    graph = colour_dets(*SIZE, part, rtmdet=wanted == "RTMDet")
    detector = OnnxPersonDetector(graph, input_size_hw_px=SIZE, score_threshold=0.99)
    assert detector.layout == wanted
    assert detector.detect(RED)
    # With the pixels of the other family it would find nothing, or this red as well.
    assert not detector.detect(np.full((*SIZE, 3), (250, 255, 255), np.uint8))


@pytest.mark.parametrize("part", ["constant", "rpn_head.rpn_cls.weight", "rtm_cls.obj_preds"])
def test_dets_and_labels_of_an_unknown_network_are_asked_for(part: str) -> None:
    graph = colour_dets(*SIZE, part, rtmdet=False)
    with pytest.raises(PerceptionError, match="family='rtmdet' or family='yolox'") as refused:
        OnnxPersonDetector(graph, input_size_hw_px=SIZE)
    assert "--detector rtmdet:FILE or yolox:FILE" in str(refused.value)
    detector = OnnxPersonDetector(
        graph, input_size_hw_px=SIZE, family="yolox", score_threshold=0.99
    )
    assert detector.layout == "YOLOX with NMS"
    assert detector.detect(RED)
    assert OnnxPersonDetector(graph, input_size_hw_px=SIZE, family="rtmdet").layout == "RTMDet"


def test_only_rtmdet_has_an_input_size_of_its_own() -> None:
    assert OnnxPersonDetector(colour_dets(320, 320)).input_size_hw_px == (320, 320)
    with pytest.raises(PerceptionError, match="input_size_hw_px"):
        OnnxPersonDetector(colour_dets(320, 320, YOLOX_HEAD))


def one_class_with_nms() -> np.ndarray:
    """Return a row for each cell, as an NMS of fixed size leaves them."""
    rows = np.zeros((1, CELLS, 6))
    rows[0, :2, :4] = BOXES
    rows[0, :2, 4] = 0.9
    return rows


def test_rows_of_one_class_are_not_read_as_raw_yolox() -> None:
    detector = OnnxPersonDetector(fixed({"out": one_class_with_nms()}, SIZE), family="ultralytics")
    assert detector.layout == "rows (NMS inside)"
    np.testing.assert_allclose([p.box_xyxy_px for p in detector.detect(IMAGE)], BOXES)


@pytest.mark.parametrize("names", [None, "['person']"])
def test_raw_yolox_of_one_class_and_free_shapes_is_still_raw(names: str | None) -> None:
    rng = np.random.default_rng(3)
    rows = np.concatenate(
        [rng.normal(0.0, 1.0, (1, CELLS, 4)), rng.uniform(0.001, 0.02, (1, CELLS, 2))], axis=2
    )
    metadata = {} if names is None else {"names": names}
    declared = {"out": (1, "cells", 6)}
    graph = fixed({"out": rows}, SIZE, metadata=metadata, declared=declared)
    assert OnnxPersonDetector(graph).layout == "YOLOX raw"
    graph = fixed({"out": rows}, SIZE, metadata={"names": "['person', 'dog']"}, declared=declared)
    with pytest.raises(PerceptionError, match="cells of strides"):
        OnnxPersonDetector(graph)


def test_rows_get_the_input_of_their_family_or_are_asked_for() -> None:
    """A narrow image lies at the left of YOLOX's input, and in the middle of Ultralytics'."""
    rows = {"out": np.zeros((1, 100, 6))}
    rows["out"][0, 0] = (0, 0, 80, 256, 0.9, 0)
    image = IMAGE[:, :160]
    untold = fixed(rows, SIZE)
    for graph, family in ((fixed(rows, SIZE, part=YOLOX_HEAD), None), (untold, "yolox")):
        (person,) = OnnxPersonDetector(graph, family=family).detect(image)
        np.testing.assert_allclose(person.box_xyxy_px, [0, 0, 80, 256])
    assert OnnxPersonDetector(untold, family="ultralytics").detect(image) == ()
    told = fixed(rows, SIZE, metadata={"task": "detect"})
    assert OnnxPersonDetector(told).detect(image) == ()
    for metadata in ({}, {"onnx.infer": "onnxruntime.quant"}):
        with pytest.raises(PerceptionError, match=r"\(1, M, 6\).*family='ultralytics'") as refused:
            OnnxPersonDetector(fixed(rows, SIZE, metadata=metadata))
        assert "--detector ultralytics:FILE, yolox:FILE or rtmdet:FILE" in str(refused.value)


def test_dets_and_labels_are_not_those_of_ultralytics() -> None:
    graph = colour_dets(*SIZE, "constant")
    with pytest.raises(PerceptionError, match="family='rtmdet' or family='yolox'"):
        OnnxPersonDetector(graph, family="ultralytics", input_size_hw_px=SIZE)


def test_yolox_with_boxes_decoded_in_the_network_is_refused() -> None:
    centres, strides = cell_centres(*SIZE)
    rows = np.zeros((1, CELLS, 85))
    rows[0, :, :2], rows[0, :, 2:4] = centres, 3.0 * strides[:, None]
    with pytest.raises(PerceptionError, match="decode_in_inference=False"):
        OnnxPersonDetector(fixed({"out": rows}, SIZE))


@pytest.mark.parametrize(
    ("names", "found"),
    [
        ("{0: 'helmet', 1: 'vest'}", None),
        ("{0: 'helmet', 1: 'Person'}", 1),
        ("{0: '0', 1: '1'}", 0),
        ("not a dictionary", 0),
        ("{}", 0),
    ],
)
def test_the_person_class_is_found_by_name_or_is_the_first(names: str, found: int | None) -> None:
    rows = np.zeros((1, 6, CELLS))
    rows[0, :4, :2] = np.array([(50, 50, 40, 80), (200, 50, 40, 80)]).T
    rows[0, 4, 0] = rows[0, 5, 1] = 0.9
    graph = fixed({"out": rows}, SIZE, metadata={"names": names})
    if found is None:
        with pytest.raises(PerceptionError, match="no class 'person' but 'helmet', 'vest'"):
            OnnxPersonDetector(graph)
        found = 1
        detector = OnnxPersonDetector(graph, person_class=1)
    else:
        detector = OnnxPersonDetector(graph)
    (person,) = detector.detect(IMAGE)
    assert person.box_xyxy_px[0] == pytest.approx((30, 180)[found])


def test_a_free_input_size_comes_from_metadata_or_the_caller() -> None:
    rows = np.zeros((1, 84, CELLS))
    free = {"out": (1, 84, "cells")}
    described = fixed({"out": rows}, ("h", "w"), metadata={"imgsz": "[256, 320]"}, declared=free)
    assert OnnxPersonDetector(described).input_size_hw_px == SIZE
    undescribed = fixed({"out": rows}, ("h", "w"), declared=free)
    with pytest.raises(PerceptionError, match=r"give it with input_size_hw_px=\(height, width\)"):
        OnnxPersonDetector(undescribed)
    assert OnnxPersonDetector(undescribed, input_size_hw_px=SIZE).layout == "YOLOv8"
    square = fixed({"out": np.zeros((1, 84, 8400))}, ("h", "w"), metadata={"imgsz": "640"})
    assert OnnxPersonDetector(square).input_size_hw_px == (640, 640)


def test_networks_with_a_fixed_batch_of_several_images_are_refused() -> None:
    with pytest.raises(PerceptionError, match="takes 4 images at a time"):
        OnnxPersonDetector(red_point_pose(32, 32, batch=4))
