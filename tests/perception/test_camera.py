"""The camera: projection against OpenCV, ROS files and refusals."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception import Camera, PerceptionError

DISTORTION = [-0.28, 0.07, 0.001, -0.0005, 0.01]


def test_projection_agrees_with_opencv_with_and_without_distortion():
    points = np.random.default_rng(0).uniform([-2, -1, 1.5], [2, 1, 8], (200, 3))
    for distortion in (None, DISTORTION):
        camera = Camera(640, 480, 500.0, 510.0, 320.0, 238.0, distortion)
        expected, _ = cv2.projectPoints(
            points, np.zeros(3), np.zeros(3), camera.matrix, camera.distortion
        )
        np.testing.assert_allclose(camera.project(points), expected[:, 0], atol=1e-6)


@pytest.mark.parametrize("distortion", [None, DISTORTION])
def test_normalise_undoes_project(distortion):
    camera = Camera(640, 480, 500.0, 510.0, 320.0, 238.0, distortion)
    points = np.random.default_rng(1).uniform([-1, -0.8, 2], [1, 0.8, 6], (100, 3))
    rays = camera.normalise(camera.project(points))
    np.testing.assert_allclose(rays, points[:, :2] / points[:, 2:], atol=2e-4)


@given(st.floats(0.2, 2.6), st.integers(16, 4000))
def test_the_field_of_view_spans_the_image(fov, width):
    camera = Camera.from_fov(width, 100, fov)
    ray = np.array([math.sin(0.5 * fov), 0.0, math.cos(0.5 * fov)])
    assert camera.project([ray])[0, 0] == pytest.approx(width)
    assert camera.project([[0.0, 0.0, 1.0]])[0] == pytest.approx([0.5 * width, 50.0])


def test_points_behind_the_camera_have_no_image():
    pixels = Camera.from_fov(640, 480, 1.0).project([[0, 0, 1], [0, 0, -1], [1, 1, 0]])
    assert np.isfinite(pixels[0]).all()
    assert np.isnan(pixels[1:]).all()


@pytest.mark.parametrize("distortion", [None, DISTORTION, [0.1] * 8])
def test_yaml_round_trip(tmp_path, distortion):
    camera = Camera(640, 480, 500.0, 510.0, 320.0, 238.0, distortion)
    camera.to_yaml(tmp_path / "camera.yaml")
    read = Camera.from_yaml(tmp_path / "camera.yaml")
    np.testing.assert_array_equal(read.matrix, camera.matrix)
    assert (read.width_px, read.height_px) == (640, 480)
    if distortion is None:
        assert read.distortion is None
    else:
        np.testing.assert_array_equal(read.distortion, camera.distortion)


def test_a_file_of_the_ros_calibrator_is_read(tmp_path):
    path = tmp_path / "ost.yaml"
    path.write_text(
        "image_width: 640\nimage_height: 480\ncamera_name: head\n"
        "camera_matrix:\n  rows: 3\n  cols: 3\n"
        "  data: [438.8, 0.0, 305.6, 0.0, 437.3, 243.7, 0.0, 0.0, 1.0]\n"
        "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
        "  data: [-0.36, 0.112, 0.0011, 0.0005, 0.0]\n"
        "rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"
    )
    camera = Camera.from_yaml(path)
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (438.8, 437.3, 305.6, 243.7)
    assert camera.distortion == pytest.approx([-0.36, 0.112, 0.0011, 0.0005, 0.0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "width: 640\nheight: 480\nk: [0, 0, 320, 0, 501, 240, 0, 0, 1]\n",
            "fx_px must lie in",
        ),
        ("image_width: 640\nimage_height: 480\n", "lacks the key 'camera_matrix'"),
        ("- 1\n", "must hold the keys"),
        ("a: [", "not valid YAML"),
        (
            "image_width: 640\nimage_height: 480\ncamera_matrix: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
            "distortion_model: equidistant\ndistortion_coefficients: [0.1, 0, 0, 0]\n",
            "equidistant",
        ),
        ("image_width: 640\nimage_height: 480\ncamera_matrix: [1, 2]\n", "must have 9 numbers"),
    ],
)
def test_invalid_files_are_refused_by_name(tmp_path, text, message):
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(PerceptionError, match=message) as refusal:
        Camera.from_yaml(path)
    assert "bad.yaml" in str(refusal.value)
