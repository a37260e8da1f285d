"""Person detectors: layouts are recognised or refused, and decoded in closed form."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from onnx_graphs import (
    RTMDET_HEAD,
    YOLOX_HEAD,
    cell_centres,
    cell_count,
    colour_dets,
    colour_yolov8,
    colour_yolox,
    fixed,
    red_point_pose,
)

from perception import PerceptionError, PersonDetector
from perception.networks import OnnxPersonDetector, PixelFormat
from perception.networks.detectors import Letterbox, LetterboxGeometry

SIZE = HEIGHT, WIDTH = 256, 320
CELLS = cell_count(*SIZE)
ONE_CLASS = {"names": "{0: 'person'}", "task": "detect"}
SIZES = [(480, 640), (601, 77), (1, 1)]
# Boxes as fractions of the image's sides, and their scores; the last box crosses the border.
PEOPLE = np.array([[0.1, 0.2, 0.3, 0.9], [0.5, 0.1, 0.8, 0.6], [0.85, 0.5, 1.2, 1.1]])
SCORES = np.array([0.9, 0.6, 0.3])

Layout = Callable[[np.ndarray, np.ndarray], bytes]


def yolov8(boxes: np.ndarray, scores: np.ndarray, classes: int = 1, person: int = 0) -> bytes:
    rows = np.zeros((1, 4 + classes, CELLS))
    places = slice(100, 100 + len(boxes))
    rows[0, :2, places] = 0.5 * (boxes[:, :2] + boxes[:, 2:]).T
    rows[0, 2:4, places] = (boxes[:, 2:] - boxes[:, :2]).T
    rows[0, 4 + person, places] = scores
    names = {number: f"thing {number}" for number in range(classes)} | {person: "person"}
    return fixed({"output0": rows}, SIZE, metadata={"names": str(names)})


def rows6(boxes: np.ndarray, scores: np.ndarray) -> bytes:
    rows = np.zeros((1, 300, 6))
    rows[0, : len(boxes), :4] = boxes
    rows[0, : len(boxes), 4] = scores
    return fixed({"output0": rows}, SIZE, metadata=ONE_CLASS | {"end2end": "False"})


def yolox(boxes: np.ndarray, scores: np.ndarray) -> bytes:
    centres, strides = cell_centres(*SIZE)
    rows = np.zeros((1, CELLS, 85))
    for number, (box, score) in enumerate(zip(boxes, scores, strict=True)):
        cell = 40 + 700 * number  # one at each stride
        rows[0, cell, :2] = 0.5 * (box[:2] + box[2:]) / strides[cell]
        rows[0, cell, :2] -= centres[cell] / strides[cell] - 0.5
        rows[0, cell, 2:4] = np.log((box[2:] - box[:2]) / strides[cell])
        rows[0, cell, 4] = np.sqrt(score)
        rows[0, cell, 5] = np.sqrt(score)
    return fixed({"output": rows}, SIZE)


def rtmdet(boxes: np.ndarray, scores: np.ndarray) -> bytes:
    dets = np.concatenate([boxes, scores[:, None]], axis=1)[None]
    labels = np.zeros((1, len(boxes)), np.int64)
    return fixed({"dets": dets, "labels": labels}, SIZE, part=RTMDET_HEAD)


LAYOUTS: dict[str, tuple[Layout, bool]] = {
    "YOLOv8": (yolov8, True),
    "rows (NMS inside)": (rows6, True),
    "YOLOX raw": (yolox, False),
    "RTMDet": (rtmdet, False),
}


def to_input(geometry: LetterboxGeometry, boxes: np.ndarray) -> np.ndarray:
    """Map boxes (N, 4) from the image to the input."""
    factor = np.divide(geometry.scaled_px, geometry.image_px)
    return np.asarray(boxes * np.tile(factor, 2) + geometry.corner_px * 2)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", LAYOUTS)
def test_boxes_are_mapped_to_images_of_any_size(name: str, size: tuple[int, int]) -> None:
    make, centred = LAYOUTS[name]
    height, width = size
    geometry = LetterboxGeometry.of((width, height), (WIDTH, HEIGHT), centred=centred)
    boxes = PEOPLE * (width, height, width, height)
    detector = OnnxPersonDetector(make(to_input(geometry, boxes), SCORES))
    assert isinstance(detector, PersonDetector)
    assert detector.layout == name
    people = detector.detect(np.zeros((height, width, 3), np.uint8))
    wanted = np.clip(boxes, 0.0, (width, height, width, height))
    large = (wanted[:, 2:] - wanted[:, :2] >= 1.0).all(axis=1)
    assert len(people) == large.sum()
    for person, box, score in zip(people, wanted[large], SCORES[large], strict=True):
        np.testing.assert_allclose(person.box_xyxy_px, box, atol=2e-5 * max(size))
        assert person.score == pytest.approx(score, abs=1e-5)


@pytest.mark.parametrize("name", LAYOUTS)
def test_boxes_and_scores_that_are_not_finite_are_dropped(name: str) -> None:
    make, centred = LAYOUTS[name]
    geometry = LetterboxGeometry.of((640, 480), (WIDTH, HEIGHT), centred=centred)
    good = to_input(geometry, np.array([[10.0, 20.0, 110.0, 220.0]]))[0]
    boxes = np.tile(good, (3, 1))
    boxes[1, 3], boxes[2, 0] = np.nan, np.inf
    with np.errstate(all="ignore"):
        detector = OnnxPersonDetector(make(boxes, np.array([0.8, 0.9, 0.9])))
        unscored = OnnxPersonDetector(make(boxes, np.array([0.8, np.nan, np.inf])))
    for each in (detector, unscored):
        (person,) = each.detect(np.zeros((480, 640, 3), np.uint8))
        np.testing.assert_allclose(person.box_xyxy_px, [10, 20, 110, 220], atol=1e-2)


@pytest.mark.parametrize(
    ("make", "size"),
    [
        (colour_yolov8(*SIZE), None),
        (colour_yolov8(HEIGHT, WIDTH, dtype="float16"), None),
        (colour_yolov8(HEIGHT, WIDTH, dtype="uint8"), None),
        (colour_yolox(*SIZE), None),
        (colour_dets(*SIZE), SIZE),
        (colour_dets(320, 320), None),
        (colour_dets(HEIGHT, WIDTH, YOLOX_HEAD, rtmdet=False), SIZE),
    ],
)
@pytest.mark.parametrize("image_size", [(300, 500)])
def test_networks_get_the_channels_in_their_own_order(
    make: bytes, size: tuple[int, int] | None, image_size: tuple[int, int]
) -> None:
    """Only the red patch is found: not the green one, the blue one or the padding."""
    image = np.zeros((*image_size, 3), np.uint8)
    image[:, :, 1] = 40
    image[50:150, 100:200] = (0, 255, 0)
    image[50:150, 300:400] = (0, 0, 255)
    image[150:250, 200:300] = (255, 0, 0)
    detector = OnnxPersonDetector(make, score_threshold=0.999, input_size_hw_px=size)
    people = detector.detect(image)
    boxes = np.array([person.box_xyxy_px for person in people])
    assert len(boxes) > 4
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    assert (low >= (199.0, 149.0)).all()
    assert (high <= (301.0, 251.0)).all()
    assert (high - low > 70.0).all()


def test_only_the_person_class_is_returned() -> None:
    boxes = np.array([[10.0, 20.0, 60.0, 200.0]])
    image = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    assert len(OnnxPersonDetector(yolov8(boxes, np.array([0.9]), 5, 3)).detect(image)) == 1
    # Another class at the same place neither suppresses the person nor counts.
    rows = np.zeros((1, 6, CELLS))
    rows[0, :4, 0] = (35, 110, 50, 180)
    rows[0, 4:, 0] = (0.9, 0.4)
    names = {"names": "{0: 'dog', 1: 'person'}"}
    graph = fixed({"output0": rows}, SIZE, metadata=names)
    (person,) = OnnxPersonDetector(graph).detect(image)
    assert person.score == pytest.approx(0.4)
    (dog,) = OnnxPersonDetector(graph, person_class=0).detect(image)
    assert dog.score == pytest.approx(0.9)
    rows6 = np.zeros((1, 300, 6))
    rows6[0, 0], rows6[0, 1] = (10, 20, 60, 200, 0.9, 0), (100, 20, 160, 200, 0.8, 1)
    graph = fixed({"output0": rows6}, SIZE, metadata=names)
    (person,) = OnnxPersonDetector(graph).detect(image)
    np.testing.assert_allclose(person.box_xyxy_px, [100, 20, 160, 200])
    dets = np.array([[[10, 20, 60, 200, 0.9], [100, 20, 160, 200, 0.8]]])
    outputs = {"dets": dets, "labels": np.array([[1, 0]])}
    graph = fixed(outputs, SIZE, part=RTMDET_HEAD)
    (person,) = OnnxPersonDetector(graph).detect(image)
    np.testing.assert_allclose(person.box_xyxy_px, [100, 20, 160, 200])


def test_overlapping_boxes_are_suppressed_and_the_highest_score_comes_first() -> None:
    # A box 60 px wide, shifted by 6 and by 30 px: IoU 0.82, 0.33, and 0.43 between the shifted.
    boxes = np.array([[100.0, 20.0, 160.0, 200.0]]) + np.array([[0], [6], [30]]) * (1, 0, 1, 0)
    graph = yolov8(boxes, np.array([0.7, 0.9, 0.5]))
    image = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    assert [round(p.score, 3) for p in OnnxPersonDetector(graph).detect(image)] == [0.9, 0.5]
    picky = OnnxPersonDetector(graph, score_threshold=0.6)
    assert [round(p.score, 3) for p in picky.detect(image)] == [0.9]


def test_several_threads_may_share_a_detector() -> None:
    detector = OnnxPersonDetector(colour_yolov8(*SIZE), score_threshold=0.999)
    images = np.zeros((2, 512, 640, 3), np.uint8)
    images[0, 100:300, :200, 0] = images[1, 100:300, 300:500, 0] = 255

    def boxes(number: int) -> list[list[float]]:
        return [each.box_xyxy_px.tolist() for each in detector.detect(images[number])]

    wanted = [boxes(0), boxes(1)]
    with ThreadPoolExecutor(2) as threads:
        assert list(threads.map(boxes, [0, 1] * 20)) == wanted * 20


# --- layouts --------------------------------------------------------------------------------------


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
        ((1, 6, CELLS), "{0: 'person', 1: 'dog'}", "YOLOv8"),
        ((1, 84, CELLS + 4 * 5), None, "YOLOv8"),  # with stride 64
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
        ((1, 84, CELLS), "['person', 'dog']", "cells of strides"),
        ((1, 3 * CELLS, 85), None, "cells of strides"),  # as YOLOv5 with its anchors
        ((1, 84, 8400), None, rf"an input of this size has {CELLS} cells"),
        ((1, 17, 64, 48), None, "no known detector has such outputs"),
        ((2, 84, CELLS), None, "batch size 1 for one image"),
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
    with pytest.raises(PerceptionError, match="takes 4 images at a time"):
        OnnxPersonDetector(red_point_pose(32, 32, batch=4))
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


@pytest.mark.parametrize("part", ["constant", "rtm_cls.obj_preds"])
def test_dets_and_labels_of_an_unknown_network_are_asked_for(part: str) -> None:
    graph = colour_dets(*SIZE, part, rtmdet=False)
    for family in (None, "ultralytics"):
        with pytest.raises(PerceptionError, match="family='rtmdet' or family='yolox'") as refused:
            OnnxPersonDetector(graph, input_size_hw_px=SIZE, family=family)
        assert "--detector rtmdet:FILE or yolox:FILE" in str(refused.value)
    detector = OnnxPersonDetector(
        graph, input_size_hw_px=SIZE, family="yolox", score_threshold=0.99
    )
    assert detector.layout == "YOLOX with NMS"
    assert detector.detect(RED)
    assert OnnxPersonDetector(graph, input_size_hw_px=SIZE, family="rtmdet").layout == "RTMDet"


def test_rows_of_one_class_are_not_read_as_raw_yolox() -> None:
    rows = np.zeros((1, CELLS, 6))  # a row for each cell, as an NMS of fixed size leaves them
    rows[0, :2, :4] = BOXES
    rows[0, :2, 4] = 0.9
    detector = OnnxPersonDetector(fixed({"out": rows}, SIZE), family="ultralytics")
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


def test_yolox_with_boxes_decoded_in_the_network_is_refused() -> None:
    centres, strides = cell_centres(*SIZE)
    rows = np.zeros((1, CELLS, 85))
    rows[0, :, :2], rows[0, :, 2:4] = centres, 3.0 * strides[:, None]
    with pytest.raises(PerceptionError, match="decode_in_inference=False"):
        OnnxPersonDetector(fixed({"out": rows}, SIZE))
    rows[0, :, 4] = 1.0  # YOLOv6 has no objectness, and no such option
    with pytest.raises(PerceptionError, match="looks like YOLOv6") as refused:
        OnnxPersonDetector(fixed({"out": rows}, SIZE))
    assert "decode_in_inference" not in str(refused.value)


@pytest.mark.parametrize(
    ("names", "found"),
    [
        ("{0: 'helmet', 1: 'vest'}", None),
        ("{0: 'helmet', 1: 'Person'}", 1),
        ("not a dictionary", 0),
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
    # Only RTMDet has one of its own.
    assert OnnxPersonDetector(colour_dets(320, 320)).input_size_hw_px == (320, 320)
    with pytest.raises(PerceptionError, match="input_size_hw_px"):
        OnnxPersonDetector(colour_dets(320, 320, YOLOX_HEAD))
    square = fixed({"out": np.zeros((1, 84, 8400))}, ("h", "w"), metadata={"imgsz": "640"})
    assert OnnxPersonDetector(square).input_size_hw_px == (640, 640)


# --- the input ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("size", "input_size"),
    [((640, 480), (320, 256)), ((100, 75), (320, 256)), ((77, 200), (64, 64))],
)
def test_scaling_is_bilinear_between_pixel_centres(
    size: tuple[int, int], input_size: tuple[int, int]
) -> None:
    """An image of noise shows a shift of a tenth of a pixel."""
    width, height = size
    image = np.random.default_rng(0).integers(0, 256, (height, width, 3), np.uint8)
    letterbox = Letterbox(input_size[1], input_size[0], PixelFormat(), centred=True)
    blob, geometry = letterbox.fill(image)
    (columns, rows), (left, top) = geometry.scaled_px, geometry.corner_px

    def interpolated(values: np.ndarray, count: int) -> np.ndarray:
        """Interpolate along the first axis at the centres of ``count`` pixels of equal size."""
        places = (np.arange(count) + 0.5) * len(values) / count - 0.5
        flat = values.reshape(len(values), -1).T
        lines = [np.interp(places, np.arange(len(values)), line) for line in flat]
        return np.stack(lines, axis=1).reshape(count, *values.shape[1:])

    wanted = interpolated(interpolated(image, rows).transpose(1, 0, 2), columns)
    found = blob[0, :, top : top + rows, left : left + columns]
    np.testing.assert_allclose(found, wanted.transpose(2, 1, 0), atol=1.5)


@pytest.mark.parametrize("centred", [True, False])
def test_padding_is_grey_also_after_an_image_of_another_shape(centred: bool) -> None:
    letterbox = Letterbox(64, 64, PixelFormat(), centred=centred)
    white = np.full((64, 20, 3), 255, np.uint8)
    letterbox.fill(white)
    blob, geometry = letterbox.fill(np.ascontiguousarray(white.transpose(1, 0, 2)))
    (width, height), (left, top) = geometry.scaled_px, geometry.corner_px
    assert (width, height) == (64, 20)
    assert top == (22 if centred else 0)
    outside = np.ones((64, 64), bool)
    outside[top : top + height, left : left + width] = False
    assert (blob[0][:, outside] == 114.0).all()
    assert (blob[0][:, ~outside] == 255.0).all()
