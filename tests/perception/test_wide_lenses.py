"""Wide lenses: every pixel gets its ray, or is said to lie beyond the end of the model."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception import Camera, PerceptionError
from perception.body import place_boxes
from perception.surround import FisheyeLens
from tracking import CameraView

# Calibrations as they are published for such cameras, and siblings with other coefficients.
LENSES = {
    "Azure Kinect, 4K": Camera(
        3840, 2160, 1942.0, 1941.5, 1913.7, 1096.3,
        [0.5246, -2.6764, 0.00054, -0.00015, 1.5586, 0.4009, -2.4943, 1.4829],
    ),
    "wide with eight coefficients": Camera(
        1280, 800, 567.0, 567.0, 640.0, 400.0, [10.1, 22.1, -1e-4, 2e-4, 6.4, 10.3, 24.6, 13.2]
    ),
    "120 degrees": Camera(
        1280, 720, 520.0, 520.0, 640.0, 360.0, [-0.28, 0.09, 0.0004, -0.0003, -0.0135]
    ),
    "one coefficient": Camera(640, 480, 300.0, 300.0, 320.0, 240.0, [-0.3, 0, 0, 0, 0]),
    "pincushion": Camera(640, 480, 300.0, 305.0, 318.0, 243.0, [0.2, 0.1, 0.002, 0.001, 0]),
    "tilted sensor": Camera(
        640, 480, 350.0, 350.0, 320.0, 240.0,
        [-0.25, 0.06, 0, 0, 0, 0, 0, 0, 0.001, 0, 0.001, 0, 0.02, -0.03],
    ),
}  # fmt: skip
BARREL = LENSES["one coefficient"]
# Where the derivative of r − 0.3 r³ is zero.
END = 1.0 / math.sqrt(0.9)


def grid(camera: Camera, count: int = 41) -> np.ndarray:
    u, v = (np.linspace(-0.5, each - 0.5, count) for each in (camera.width_px, camera.height_px))
    return np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)


@pytest.mark.parametrize("camera", LENSES.values(), ids=LENSES)
def test_every_pixel_has_the_ray_that_is_projected_to_it(camera: Camera) -> None:
    pixels = grid(camera)
    rays = camera.normalise(pixels)
    known = np.isfinite(rays).all(axis=1)
    ends = np.column_stack((rays[known], np.ones(known.sum())))
    np.testing.assert_allclose(camera.project(ends), pixels[known], atol=0.01)
    # A lens whose polynomial does not turn back has a ray for every pixel.
    turns_back = camera in (LENSES["120 degrees"], BARREL)
    assert known.all() != turns_back
    nearest = camera.normalise(pixels, nearest=True)
    assert np.isfinite(nearest).all()
    np.testing.assert_array_equal(nearest[known], rays[known])


@given(
    st.floats(-0.35, 0.2), st.floats(-0.1, 0.15), st.floats(-0.03, 0.03),
    st.floats(-2e-3, 2e-3), st.floats(-2e-3, 2e-3), st.floats(0.25, 1.0),
)  # fmt: skip
def test_a_ray_is_right_or_not_there(k1, k2, k3, p1, p2, focal) -> None:
    camera = Camera(640, 480, 640 * focal, 640 * focal, 320.0, 240.0, [k1, k2, p1, p2, k3])
    pixels = grid(camera, 15)
    rays = camera.normalise(pixels)
    known = np.isfinite(rays).all(axis=1)
    assert known[len(pixels) // 2]
    image, _ = cv2.projectPoints(
        np.column_stack((rays[known], np.ones(known.sum()))),
        np.zeros(3), np.zeros(3), camera.matrix, camera.distortion,
    )  # fmt: skip
    np.testing.assert_allclose(image[:, 0], pixels[known], atol=0.01)


def test_beyond_the_end_of_the_model_is_no_image() -> None:
    inside, outside = 0.99 * END, 1.01 * END
    assert np.isfinite(BARREL.project([[inside, 0, 1.0], [0, -inside, 1.0]])).all()
    # OpenCV folds them back, to pixels of people further in.
    assert np.isnan(BARREL.project([[outside, 0, 1.0], [0, -3.0, 1.0]])).all()
    edge_px = 320.0 + 300.0 * (END - 0.3 * END**3)
    rays = BARREL.normalise([[edge_px - 0.1, 240.0], [edge_px + 0.1, 240.0]])
    assert rays[0, 0] == pytest.approx(END, rel=0.05)
    assert np.isnan(rays[1]).all()
    bound = BARREL.normalise([[edge_px + 30.0, 240.0]], nearest=True)
    assert bound[0] == pytest.approx([END, 0.0], rel=0.02)


def test_somebody_beyond_the_end_is_still_placed_and_tracked() -> None:
    placed = place_boxes(BARREL, [np.array([560.0, 100.0, 630.0, 380.0])])[0]
    assert placed is not None
    assert math.degrees(math.atan2(placed[0][0], placed[0][2])) > 35.0
    level = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.2], [0, 0, 0, 1]])
    seen = CameraView(BARREL).visibility([[3.0, 0.0], [3.0, 2.0], [1.0, 3.0]], level)
    assert (seen[:2] > 0.0).all()
    assert seen[2] == 0.0


# Of one lens, in the picture of another model or unit: its first five of eight coefficients, those
# of a model in pixels, and the numbers of three drivers, at two sizes of the field.
CUT = [4.655, 1.348, 0.0002, -0.0001, 0.0369]
NO_LENSES = (
    CUT, CUT[:4], [15.6, -41.2, 6e-4, -2e-4, 37.9], [-1035.2, 2410.7, 0, 0, -812.4],
    [-3.0, 0, 0, 0], [900.0, 0, 0, 0], [1e12, 0, 0, 0], [-1e12, 0, 0, 0], [-0.6, 0, 0, 0],
    [0, 0, 0, 0, 0, 9.0, 0, 0], [0.05, -0.1, 0.4, 0, 0], [0, 0, 0, -0.5],
)  # fmt: skip


@pytest.mark.parametrize("coefficients", NO_LENSES)
@pytest.mark.parametrize("scale", [1, 3])
def test_a_distortion_that_no_lens_has_is_refused(coefficients, scale) -> None:
    size = 640 * scale, 480 * scale
    with pytest.raises(PerceptionError, match=r"is that of no lens.*rectified images"):
        Camera(*size, 554.0 * scale, 554.0 * scale, 320.0 * scale, 240.0 * scale, coefficients)


def test_a_picture_that_the_bend_does_not_reach_is_a_camera_s() -> None:
    # A telephoto lens: its coefficients are not known well, and bend nothing.
    assert Camera(640, 480, 6000.0, 6000.0, 320.0, 240.0, CUT).distortion is not None
    for camera in LENSES.values():  # a part that is cut out, away from the principal point
        far = replace(camera, width_px=200, height_px=100, cx_px=camera.cx_px - 150.0)
        assert np.isfinite(far.normalise([[100.0, 50.0]], nearest=True)).all()


@given(st.floats(-0.02, 0.02), st.floats(0.3, 1.0))
def test_every_projection_of_fisheye_lenses_is_a_lens(more, focal) -> None:
    """Between f sin θ and f tan θ lie all of them: their series, and somewhat beside them."""
    series = [
        [-1 / 6, 1 / 120], [-1 / 24, 1 / 1920], [0, 0], [1 / 12, 1 / 120], [1 / 3, 2 / 15]
    ]  # fmt: skip
    for k1, k2 in series:
        FisheyeLens(
            640, 480, 640 * focal, 640 * focal, 320.0, 240.0, [k1 + more, k2, 0, 0],
            max_angle_rad=math.radians(60.0),
        )  # fmt: skip


@pytest.mark.parametrize("coefficients", [[9.0, 0, 0, 0], [80.0, -2.0, 0, 0], [0, 0, 900.0, 0]])
def test_fisheye_coefficients_that_no_lens_has_are_refused(coefficients) -> None:
    with pytest.raises(PerceptionError, match="are those of no lens"):
        FisheyeLens(640, 480, 300.0, 300.0, 320.0, 240.0, coefficients)
