"""Crops of people: their content, and the way back to the image."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception.networks.poses import PersonCrops

HEIGHT, WIDTH = 192, 144
boxes = st.tuples(
    st.floats(-500, 1500), st.floats(-500, 1500), st.floats(1, 2000), st.floats(1, 2000)
).map(lambda b: np.array([[b[0], b[1], b[0] + b[2], b[1] + b[3]]]))


@given(boxes)
def test_a_crop_is_the_padded_box_in_the_crops_aspect_ratio(box: np.ndarray) -> None:
    crops = PersonCrops(box, HEIGHT, WIDTH)
    size = np.array([WIDTH, HEIGHT])
    extent = crops.step_px[0] * size
    wanted = 1.25 * (box[0, 2:] - box[0, :2])
    assert (extent >= wanted - 0.51).all()
    assert (np.abs(extent - wanted) <= 0.51).any()  # no larger than needed
    # Both axes have the same scale, apart from the rounding to whole pixels.
    np.testing.assert_allclose(*crops.step_px[0], rtol=0.51 / WIDTH + 0.51 / HEIGHT + 1e-9)
    middle = crops.to_image(0.5 * size[None, None], np.array([0]))[0, 0]
    np.testing.assert_allclose(middle, 0.5 * (box[0, :2] + box[0, 2:]) - 0.5, atol=0.8)


@pytest.mark.parametrize(
    "box",
    [
        (60.0, 40.0, 300.0, 440.0),  # resized
        (150.3, 90.7, 180.1, 150.9),  # enlarged
        (-60.0, -80.0, 330.0, 500.0),  # over the left and upper borders
        (300.0, 200.0, 700.0, 600.0),  # over the right and lower borders
        (0.0, 0.0, 640.0, 480.0),
        (-4000.0, -3000.0, 4000.0, 3000.0),  # too large to resize
    ],
)
def test_each_pixel_of_a_crop_shows_its_place_in_the_image(box: tuple[float, ...]) -> None:
    """Two brightness ramps show the place of each pixel; outside the image crops are black."""
    height, width = 480, 640
    v, u = np.mgrid[:height, :width]
    image = np.zeros((height, width, 3), np.uint8)
    image[..., 0], image[..., 1], image[..., 2] = u * 0.25 + 50, v * 0.25 + 50, 200
    crops = PersonCrops(np.array([box]), HEIGHT, WIDTH)
    out = np.empty((HEIGHT, WIDTH, 3), np.uint8)
    assert crops.inside(image).tolist() == [True]
    crops.cut(image, 0, out)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    places = crops.to_image(np.stack([columns, rows], axis=-1).reshape(1, -1, 2), np.array([0]))
    place_u, place_v = places[0].T.reshape(2, HEIGHT, WIDTH)
    step = float(crops.step_px.max())
    within = (place_u > 1) & (place_u < width - 2) & (place_v > 1) & (place_v < height - 2)
    beyond = (place_u < -1 - step) | (place_u > width + step)
    beyond |= (place_v < -1 - step) | (place_v > height + step)
    assert within.sum() > 500 if step < 8 else within.sum() > 5
    assert (out[within, 2] >= 198).all()
    assert (out[beyond] == 0).all()
    for channel, place in ((0, place_u), (1, place_v)):
        seen = (out[within, channel].astype(float) - 50.0 + 0.375) * 4.0  # rounded down
        np.testing.assert_allclose(seen, place[within], atol=5.0)
        assert abs(float(np.mean(seen - place[within]))) < 1.0


def test_crops_outside_the_image_and_boxes_without_extent_are_found() -> None:
    image = np.zeros((480, 640, 3), np.uint8)
    cases = {
        (10, 10, 100, 200): True,
        (-90, 10, -1, 200): True,  # the padding reaches into the image
        (-400, 10, -300, 200): False,
        (900, 10, 1000, 200): False,
        (10, 700, 100, 900): False,
        (50, 50, 50, 50): False,
        (50, 50, 50, 90): True,  # a line has a height
    }
    crops = PersonCrops(np.array(list(cases), float), HEIGHT, WIDTH)
    assert crops.inside(image).tolist() == list(cases.values())
