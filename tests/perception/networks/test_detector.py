"""Person detectors: each layout with graphs whose results are known in closed form."""

from __future__ import annotations

from collections.abc import Callable
from threading import Thread

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
)

from perception import PersonDetector
from perception.networks import OnnxPersonDetector
from perception.networks.detectors import LetterboxGeometry

HEIGHT, WIDTH = 256, 320
CELLS = cell_count(HEIGHT, WIDTH)
ONE_CLASS = {"names": "{0: 'person'}", "task": "detect"}
SIZES = [(480, 640), (333, 500), (1080, 1920), (601, 77), (1, 1)]
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
    return fixed({"output0": rows}, (HEIGHT, WIDTH), metadata={"names": str(names)})


def rows6(boxes: np.ndarray, scores: np.ndarray) -> bytes:
    rows = np.zeros((1, 300, 6))
    rows[0, : len(boxes), :4] = boxes
    rows[0, : len(boxes), 4] = scores
    return fixed({"output0": rows}, (HEIGHT, WIDTH), metadata=ONE_CLASS | {"end2end": "False"})


def yolox(boxes: np.ndarray, scores: np.ndarray) -> bytes:
    centres, strides = cell_centres(HEIGHT, WIDTH)
    rows = np.zeros((1, CELLS, 85))
    for number, (box, score) in enumerate(zip(boxes, scores, strict=True)):
        cell = 40 + 700 * number  # one at each stride
        rows[0, cell, :2] = 0.5 * (box[:2] + box[2:]) / strides[cell]
        rows[0, cell, :2] -= centres[cell] / strides[cell] - 0.5
        rows[0, cell, 2:4] = np.log((box[2:] - box[:2]) / strides[cell])
        rows[0, cell, 4] = np.sqrt(score)
        rows[0, cell, 5] = np.sqrt(score)
    return fixed({"output": rows}, (HEIGHT, WIDTH))


def rtmdet(boxes: np.ndarray, scores: np.ndarray) -> bytes:
    dets = np.concatenate([boxes, scores[:, None]], axis=1)[None]
    labels = np.zeros((1, len(boxes)), np.int64)
    return fixed({"dets": dets, "labels": labels}, (HEIGHT, WIDTH), part=RTMDET_HEAD)


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
        (colour_yolov8(HEIGHT, WIDTH), None),
        (colour_yolov8(HEIGHT, WIDTH, dtype="float16"), None),
        (colour_yolov8(HEIGHT, WIDTH, dtype="uint8"), None),
        (colour_yolox(HEIGHT, WIDTH), None),
        (colour_dets(HEIGHT, WIDTH), (HEIGHT, WIDTH)),
        (colour_dets(320, 320), None),
        (colour_dets(HEIGHT, WIDTH, YOLOX_HEAD, rtmdet=False), (HEIGHT, WIDTH)),
        (colour_dets(HEIGHT, WIDTH, "head.obj_preds.1.bias", rtmdet=False), (HEIGHT, WIDTH)),
    ],
)
@pytest.mark.parametrize("image_size", [(512, 640), (300, 500)])
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
    graph = fixed({"output0": rows}, (HEIGHT, WIDTH), metadata=names)
    (person,) = OnnxPersonDetector(graph).detect(image)
    assert person.score == pytest.approx(0.4)
    (dog,) = OnnxPersonDetector(graph, person_class=0).detect(image)
    assert dog.score == pytest.approx(0.9)
    rows6 = np.zeros((1, 300, 6))
    rows6[0, 0], rows6[0, 1] = (10, 20, 60, 200, 0.9, 0), (100, 20, 160, 200, 0.8, 1)
    graph = fixed({"output0": rows6}, (HEIGHT, WIDTH), metadata=names)
    (person,) = OnnxPersonDetector(graph).detect(image)
    np.testing.assert_allclose(person.box_xyxy_px, [100, 20, 160, 200])
    dets = np.array([[[10, 20, 60, 200, 0.9], [100, 20, 160, 200, 0.8]]])
    outputs = {"dets": dets, "labels": np.array([[1, 0]])}
    graph = fixed(outputs, (HEIGHT, WIDTH), part=RTMDET_HEAD)
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


def test_random_outputs_give_a_bounded_number_of_valid_boxes() -> None:
    rng = np.random.default_rng(0)
    rows = rng.normal(0.0, 1e3, (1, 5, CELLS))
    people = OnnxPersonDetector(fixed({"output0": rows}, (HEIGHT, WIDTH)), score_threshold=0.0)
    found = people.detect(np.zeros((480, 640, 3), np.uint8))
    assert 0 < len(found) <= 1000
    boxes = np.array([person.box_xyxy_px for person in found])
    assert (boxes >= 0.0).all()
    assert (boxes <= (640, 480, 640, 480)).all()
    only_nan = np.full((1, 5, CELLS), np.nan)
    detector = OnnxPersonDetector(fixed({"output0": only_nan}, (HEIGHT, WIDTH)))
    assert detector.detect(np.zeros((480, 640, 3), np.uint8)) == ()


def test_several_threads_may_share_a_detector() -> None:
    detector = OnnxPersonDetector(colour_yolov8(HEIGHT, WIDTH), score_threshold=0.999)
    images = []
    for left in (0, 300):
        image = np.zeros((512, 640, 3), np.uint8)
        image[100:300, left : left + 200, 0] = 255
        images.append(image)
    wanted = [detector.detect(image) for image in images]
    wrong = []

    def work(number: int) -> None:
        for _ in range(20):
            found = detector.detect(images[number])
            same = len(found) == len(wanted[number]) and all(
                np.array_equal(a.box_xyxy_px, b.box_xyxy_px)
                for a, b in zip(found, wanted[number], strict=True)
            )
            if not same:
                wrong.append(number)

    threads = [Thread(target=work, args=(number,)) for number in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
