"""Letterboxing: images of any size in a network's input, and boxes mapped back exactly."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from onnx_graphs import colour_yolov8, disc_network, red_point_pose

from perception import Camera, PerceptionError
from perception.networks import OnnxPersonDetector, OnnxPoseEstimator, PixelFormat, rgb_image
from perception.networks.detectors import Letterbox, LetterboxGeometry
from perception.networks.heads import OnnxHeadPoseEstimator

CAMERA = Camera.from_fov(64, 48, 1.0)
sides = st.integers(1, 3000)


@given(sides, sides, st.integers(8, 700), st.integers(8, 700), st.booleans())
def test_the_image_fits_into_the_input_and_boxes_map_back(
    width: int, height: int, input_width: int, input_height: int, centred: bool
) -> None:
    geometry = LetterboxGeometry.of((width, height), (input_width, input_height), centred=centred)
    scaled, corner = np.array(geometry.scaled_px), np.array(geometry.corner_px)
    available = np.array([input_width, input_height])
    assert (scaled >= 1).all()
    assert (corner + scaled <= available).all()
    assert (scaled == available).any()  # as large as possible
    if centred:
        assert (abs(available - scaled - 2 * corner) <= 1).all()
    whole = np.array([[0.0, 0.0, width, height]])
    in_input = np.array([[*corner, *(corner + scaled)]])
    np.testing.assert_allclose(geometry.to_image(in_input), whole, atol=1e-9)
    middle = in_input * 0.5 + 0.5 * in_input[:, [2, 3, 0, 1]]
    np.testing.assert_allclose(geometry.to_image(middle), whole[:, [2, 3, 2, 3]] / 2.0, atol=1e-9)
    far = np.array([[-1e4, -1e4, 1e4, 1e4]])
    np.testing.assert_array_equal(geometry.to_image(far), whole)


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


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (np.zeros((4, 4), np.uint8), "cvtColor"),
        (np.zeros((4, 4, 4), np.uint8), "fourth channel"),
        (np.zeros((4, 4, 3), np.float32), "got float32"),
        (np.zeros((1, 40000, 3), np.uint8), "got 40000 x 1"),
        (None, "got NoneType"),
    ],
)
def test_anything_but_an_rgb_image_is_refused(image: object, words: str) -> None:
    with pytest.raises(PerceptionError, match=words):
        rgb_image(image)


@pytest.mark.parametrize(
    "run",
    [
        OnnxPersonDetector(colour_yolov8(64, 64)).detect,
        lambda image: OnnxPoseEstimator(red_point_pose(64, 48)).estimate(image, ()),
        lambda image: OnnxHeadPoseEstimator(disc_network()).estimate(image, CAMERA, ()),
    ],
    ids=["detector", "pose", "head"],
)
def test_every_estimator_checks_its_image(run: Callable[[object], object]) -> None:
    for image in (np.zeros((9, 9, 3)), None):
        with pytest.raises(PerceptionError, match="image_rgb must"):
            run(image)
