"""The camera: fields of view, ROS files and camera_info as drivers and calibrators write it."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from perception import Camera, PerceptionError
from perception.surround import FisheyeLens


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


EIGHT = [0.52, -2.68, 0.0005, -0.0002, 1.56, 0.4, -2.5, 1.48]


@pytest.mark.parametrize("distortion", [None, [-0.28, 0.07, 0.001, -0.0005, 0.01], EIGHT])
def test_yaml_round_trip(tmp_path, distortion):
    camera = Camera(640, 480, 500.0, 510.0, 320.0, 238.0, distortion)
    camera.to_yaml(tmp_path / "camera.yaml")
    read = Camera.from_yaml(tmp_path / "camera.yaml")
    np.testing.assert_array_equal(read.matrix, camera.matrix)
    assert (read.width_px, read.height_px) == (640, 480)
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


# --- camera_info ----------------------------------------------------------------------------------


def info(
    size: tuple[int, int] = (640, 480),
    k: tuple[float, float, float] = (500.0, 320.0, 240.0),
    roi: tuple[int, int, int, int] = (0, 0, 0, 0),
    binning: tuple[int, int] = (0, 0),
    **others: Any,
) -> dict[str, Any]:
    """Return the fields of a message; ``k`` is f, cx, cy and ``roi`` x, y, width, height."""
    f, cx, cy = k
    x, y, width, height = roi
    return {
        "width": size[0],
        "height": size[1],
        "distortion_model": "plumb_bob",
        "d": [0.0] * 5,
        "k": [f, 0, cx, 0, f, cy, 0, 0, 1],
        "p": [0.0] * 12,
        "binning_x": binning[0],
        "binning_y": binning[1],
        "roi": {"x_offset": x, "y_offset": y, "width": width, "height": height},
        **others,
    }


def numbers(camera: Camera) -> tuple[float, ...]:
    return (
        camera.width_px, camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
    )  # fmt: skip


ODD = info(roi=(1, 0, 639, 480), binning=(2, 2))


@pytest.mark.parametrize(
    ("fields", "image_px", "right"),
    [
        (
            info((1280, 960), (1000, 640, 480), (320, 240, 640, 480), (2, 2)),
            None,
            (320, 240, 500, 500, 159.75, 119.75),
        ),
        # Baxter: width and height are those of the part, without and with binning.
        (
            info((640, 400), (403.9, 631.0, 375.0), (320, 200, 640, 400), (1, 1)),
            None,
            (640, 400, 403.9, 403.9, 311.0, 175.0),
        ),
        (
            info((320, 200), (403.9, 631.0, 375.0), (320, 200, 640, 400), (2, 2)),
            None,
            (320, 200, 201.95, 201.95, 155.25, 87.25),
        ),
        # A part of an odd size: drivers round up or down.
        (ODD, (320, 240), (320, 240, 250, 250, 159.25, 119.75)),
        (ODD, (319, 240), (319, 240, 250, 250, 159.25, 119.75)),
        # Full images in spite of roi or binning.
        (info(roi=(160, 120, 320, 240)), (640, 480), (640, 480, 500, 500, 320, 240)),
        (info(binning=(2, 2)), (640, 480), (640, 480, 500, 500, 320, 240)),
    ],
)  # fmt: skip
def test_roi_and_binning_lead_to_the_delivered_images(fields, image_px, right) -> None:
    assert numbers(Camera.from_camera_info(fields, image_size_px=image_px)) == pytest.approx(right)


@pytest.mark.parametrize(
    ("fields", "image_px", "text"),
    [
        (info(roi=(160, 120, 320, 240)), (160, 120), "320 x 240 px, but the images have 160 x 120"),
        (info(roi=(400, 0, 320, 240)), None, r"\(400, 0, 320, 240\) px is not a part of the image"),
        (info(roi=(10, 10, 0, 0)), None, "is not a part"),
    ],
)
def test_images_that_are_not_the_delivered_ones_are_refused_with_the_sizes(
    fields, image_px, text
) -> None:
    with pytest.raises(PerceptionError, match=text):
        Camera.from_camera_info(fields, image_size_px=image_px)


@given(st.integers(0, 300), st.integers(0, 200), st.integers(1, 4), st.integers(1, 4))
def test_a_delivered_pixel_has_the_ray_of_the_full_one(x, y, over, down) -> None:
    part = (x, y, 320 // over * over, 240 // down * down)
    d = [-0.2, 0.05, 0.001, 0.0, 0.0]
    full = Camera.from_camera_info(info(d=d))
    cut = Camera.from_camera_info(info(roi=part, binning=(over, down), d=d))
    pixels = np.array([[0.0, 0.0], [cut.width_px - 1.0, cut.height_px - 1.0]])
    # The centre of a joined pixel is the middle of those that it joins.
    first = (pixels + 0.5) * (over, down) - 0.5 + (x, y)
    np.testing.assert_allclose(cut.normalise(pixels), full.normalise(first), atol=1e-6)


P = [380, 0, 325, 0, 0, 385, 238, 0, 0, 0, 1, 0]


@pytest.mark.parametrize(
    ("model", "d"), [("plumb_bob", [-0.35, 0.12, 0, 0, 0]), ("equidistant", [0.1, 0, 0, 0])]
)
def test_rectified_images_have_the_intrinsics_p_and_no_distortion(model, d) -> None:
    fields = info(distortion_model=model, d=d, p=P)
    camera = Camera.from_camera_info(fields, rectified=True)
    assert numbers(camera) == (640, 480, 380, 385, 325, 238)
    assert camera.distortion is None
    half = Camera.from_camera_info({**fields, "binning_x": 2, "binning_y": 2}, rectified=True)
    assert numbers(half) == (320, 240, 190, 192.5, 162.25, 118.75)


def test_rectified_images_without_p_are_refused_unless_they_were_never_distorted() -> None:
    assert Camera.from_camera_info(info(), rectified=True).fx_px == 500.0
    for changes in ({"d": [-0.3, 0, 0, 0, 0]}, {"distortion_model": "equidistant", "d": []}):
        with pytest.raises(PerceptionError, match="the projection matrix P is needed"):
            Camera.from_camera_info(info(**changes), rectified=True)


def test_a_file_is_read_as_a_message_is(tmp_path) -> None:
    """Messages of ROS 1 have their matrices in capitals; any object with the fields will do."""
    fields = info((1280, 960), (1000, 640, 480), (320, 240, 640, 480), (2, 2), p=P, d=[0.1] * 4)
    path = tmp_path / "echo.yaml"
    path.write_text(yaml.safe_dump(fields))
    capitals = {key.upper() if key in "kdp" else key: value for key, value in fields.items()}
    capitals["roi"] = SimpleNamespace(**fields["roi"])
    for rectified in (False, True):
        read = Camera.from_yaml(path, rectified=rectified)
        sent = Camera.from_camera_info(SimpleNamespace(**capitals), rectified=rectified)
        assert numbers(read) == numbers(sent)
        assert np.array_equal(read.distortion, sent.distortion) or rectified
    assert Camera.from_yaml(path, image_size_px=(1280, 960)).width_px == 1280


@pytest.mark.parametrize(
    "changes",
    [
        {"distortion_model": "equidistant", "d": [0.0] * 4},
        {"distortion_model": "kannala_brandt4", "d": []},
        {"distortion_model": "", "camera_model": "fisheye", "d": [0.1, 0, 0, 0]},
        {"distortion_model": "Fisheye", "camera_model": "pinhole", "d": [0.1, 0, 0, 0, 0]},
    ],
)
def test_a_fisheye_is_one_by_its_name_whatever_its_coefficients(tmp_path, changes) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(yaml.safe_dump(info(roi=(160, 120, 320, 240), **changes)))
    with pytest.raises(PerceptionError, match=r"'equidistant'.*perception\.surround"):
        Camera.from_yaml(path)
    lens = FisheyeLens.from_yaml(path)
    assert (lens.width_px, lens.cx_px, lens.cy_px) == (320, 160.0, 120.0)
    assert lens.coefficients.tolist() == [*changes["d"], *[0.0] * 4][:4]


@pytest.mark.parametrize("name", ["radtan", "Brown-Conrady", "none", None])
def test_a_pinhole_is_read_under_its_other_names(name) -> None:
    d = [0.0] if name in ("none", None) else [-0.3, 0.1, 0, 0, 0, 0, 0]
    camera = Camera.from_camera_info(info(distortion_model=name, d=d))
    wanted = None if name in ("none", None) else d[:5]
    assert (camera.distortion is None) == (wanted is None)
    assert wanted is None or camera.distortion.tolist() == wanted


F = "focal length"
UNREAD = "is not read: the coefficients of the lens distortion belong into"


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"d": None, "distCoeffs": [-0.3, 0.1, 0, 0, 0]}, f"distCoeffs {UNREAD}"),
        ({"d": None, "k1": -0.3, "k2": 0.1}, f"k1, k2 {UNREAD}"),
        ({"d": [0.0] * 5, "RadialDistortion": [-0.3, 0.1]}, f"RadialDistortion {UNREAD}"),
        ({"distortion_model": "none", "d": [0.1] * 4}, "name their model"),
        ({"distortion_model": "ftheta"}, "must be plumb_bob or rational_polynomial, got 'ftheta'"),
        ({"camera_model": "fisheye"}, "contradict each other"),
        ({"d": [-0.3, 0.1, 0.01]}, "must have 4, 5, 8, 12, 14 coefficients, got 3"),
        ({"k": [500, 0, 0, 0, 500, 0, 320, 240, 1]}, "is it transposed"),
        ({"k": [500, 0, 320, 0, 500, 240, 0, 0, 0]}, "must be .fx, 0, cx, 0, fy, cy, 0, 0, 1"),
        ({"k": [500, 25, 320, 0, 500, 240, 0, 0, 1]}, "must have no skew, got 25 px"),
        ({"k": [0.78, 0, 0.5, 0, 1.04, 0.5, 0, 0, 1]}, f"{F} of 0.78 for 640 px"),
        ({"k": [3.6, 0, 320, 0, 3.6, 240, 0, 0, 1]}, "or in millimetres"),
        ({"k": [1000, 0, 640, 0, 1000, 480, 0, 0, 1]}, "for images of this size"),
        ({"k": [500, 0, 0.5, 0, 500, 0.5, 0, 0, 1]}, "principal point, 0.5, 0.5, at a corner"),
        ({"k": [5e5, 0, 3.2e5, 0, 5e5, 2.4e5, 0, 0, 1]}, "is it in pixels"),
        ({"k": [500, 500, 320, 240]}, "camera_matrix must have 9 numbers, got 4"),
        ({"K": [250, 0, 160, 0, 250, 120, 0, 0, 1]}, "has camera_matrix twice"),
        ({"distortion_coefficients": [-0.3, 0.1, 0, 0]}, "has distortion_coefficients twice"),
        ({"binning_x": -2}, "binning_x must lie in"),
        ({"roi": [0, 0, 320, 240]}, "x_offset"),
        ({"width": 0}, "width_px must lie in"),
        ({"k": [0.0] * 9}, "calibrate the camera"),
    ],
)
def test_what_would_be_read_wrongly_is_refused_with_the_reason(tmp_path, changes, text) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(yaml.safe_dump(info() | changes))
    with pytest.raises(PerceptionError, match=text) as refusal:
        Camera.from_yaml(path)
    assert "camera.yaml" in str(refusal.value)


def test_a_part_may_have_its_principal_point_at_a_corner() -> None:
    """Lower right quarter of the image, with the numbers of the full image, or Baxter's."""
    for size in ((640, 480), (320, 240)):
        camera = Camera.from_camera_info(info(size, roi=(320, 240, 320, 240)))
        assert numbers(camera) == (320, 240, 500, 500, 0, 0)


def test_further_keys_of_a_calibrator_are_left_alone(tmp_path) -> None:
    fields = info(avg_reprojection_error=0.3, board_distance_m=1.2)
    assert Camera.from_camera_info(fields).fx_px == 500.0
    path = tmp_path / "pinhole.yaml"
    path.write_text(yaml.safe_dump(fields))
    with pytest.raises(PerceptionError, match=r"Camera\.from_yaml reads others"):
        FisheyeLens.from_yaml(path)


COPY = "FileStorage: copy its numbers into a ROS"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n", COPY),
        ("%YAML:1.0\n\nCamera.fx: 500.0\nCamera.k1: -0.3\n", COPY),
        ('<?xml version="1.0"?>\n<opencv_storage>\n<camera_matrix type_id="opencv-matrix">', COPY),
        ("image_width: 640\nimage_height: 480\n", "lacks the key 'camera_matrix'"),
        ("- 1\n", "must hold the keys"),
        ("a: [", "not valid YAML"),
    ],
)
def test_files_of_others_are_refused_with_what_to_do(tmp_path, text, message) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(PerceptionError, match=message) as refusal:
        Camera.from_yaml(path)
    assert "bad.yaml" in str(refusal.value)
