"""Pose networks: graphs whose keypoints are known in closed form, their peaks and their lifting."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from onnx_graphs import Graph, fixed, red_point_movenet, red_point_pose, simcc
from scipy.spatial.transform import Rotation

from perception import Camera, PerceptionError, PersonDetection, PersonKeypoints, PoseEstimator
from perception.anthropometry import LIMBS
from perception.body import place_bodies
from perception.networks import OnnxModel, OnnxPoseEstimator
from perception.networks.poses import (
    PersonCrops,
    lift_keypoints,
    metres_per_pixel,
    simcc_peaks,
)

IMAGE = np.zeros((480, 640, 3), np.uint8)
MIDDLE = PersonDetection(np.array([220.0, 60.0, 380.0, 440.0]), 0.9)


def red_dot(u: float, v: float, size: tuple[int, int] = (480, 640)) -> np.ndarray:
    """Return an image with a smooth red dot of 4 px at u, v, and green and blue dots elsewhere."""
    rows, columns = np.mgrid[: size[0], : size[1]]
    image = np.zeros((*size, 3), np.uint8)
    for channel, (at_u, at_v) in enumerate(((u, v), (u + 40, v - 30), (u - 40, v + 30))):
        reach = (columns - at_u) ** 2 + (rows - at_v) ** 2
        image[..., channel] = np.rint(255 * np.exp(-0.5 * reach / 4.0**2))
    return image


def network(
    keypoints: int,
    size: tuple[int, int],
    *,
    depth: bool,
    batch: int | str = "batch",
) -> tuple[bytes, np.ndarray, np.ndarray]:
    """Return a graph with random keypoints, their places (axes, K) in bins and their heights."""
    rng = np.random.default_rng(0)
    height, width = size
    bins = np.array([2 * width, 2 * height, 2 * width])[: 3 if depth else 2]
    places = rng.uniform(0.3, 0.7, (len(bins), keypoints)) * bins[:, None]
    heights = rng.uniform(0.4, 0.95, places.shape)
    graph = simcc(places, heights, [int(n) for n in bins], size, batch=batch)
    return graph, places, heights


@pytest.mark.parametrize(
    ("keypoints", "size", "depth"),
    [
        (17, (256, 192), False),  # RTMPose
        (133, (256, 192), False),  # RTMW
        (133, (384, 288), True),  # RTMW3D
        (17, (192, 144), True),  # the shipped network
    ],
)
def test_networks_of_known_layouts_are_decoded(
    keypoints: int, size: tuple[int, int], depth: bool
) -> None:
    graph, places, heights = network(keypoints, size, depth=depth)
    estimator = OnnxPoseEstimator(graph)
    assert isinstance(estimator, PoseEstimator)
    assert estimator.layout == {17: "coco", 133: "coco_wholebody"}[keypoints]
    assert estimator.has_depth == depth
    (person,) = estimator.estimate(IMAGE, (MIDDLE,))
    assert person.lifted == depth
    crops = PersonCrops(MIDDLE.box_xyxy_px[None], *size)
    wanted = crops.to_image(places[None, :2].transpose(0, 2, 1) / 2.0, np.array([0]))[0]
    np.testing.assert_allclose(person.keypoints_px, wanted, atol=0.01)
    # The third axis does not count, as in OpenMMLab's code.
    np.testing.assert_allclose(person.scores, heights[:2].min(axis=0), rtol=0.01)
    depths = person.keypoints_root_m[:, 2]
    if depth:
        wanted_z = (places[2] / 2 / (size[1] / 2) - 1) * 2.1744869
        np.testing.assert_allclose(depths, wanted_z, atol=1e-4)
    else:
        assert (depths == 0.0).all()
    hips = person.keypoints_root_m[11:13].mean(axis=0)
    np.testing.assert_allclose(hips[:2], 0.0, atol=1e-9)


def test_metadata_may_give_padding_and_depth_range() -> None:
    places, heights = np.full((3, 17), 20.0), np.full((3, 17), 0.9)
    metadata = {"box_padding": "1.5", "z_range_m": "1.0"}
    graph = simcc(places, heights, [96, 128, 96], (64, 48), metadata=metadata)
    (person,) = OnnxPoseEstimator(graph).estimate(IMAGE, (MIDDLE,))
    crops = PersonCrops(MIDDLE.box_xyxy_px[None], 64, 48, padding=1.5)
    wanted = crops.to_image(np.array([[[10.0, 10.0]]]), np.array([0]))[0, 0]
    np.testing.assert_allclose(person.keypoints_px[0], wanted, atol=0.01)
    np.testing.assert_allclose(person.keypoints_root_m[:, 2], 20 / 48 - 1, atol=1e-4)
    wrong = simcc(places, heights, [96, 128, 96], (64, 48), metadata={"z_range_m": "-1"})
    with pytest.raises(PerceptionError, match="metadata z_range_m of model given as bytes must"):
        OnnxPoseEstimator(wrong)


@pytest.mark.parametrize(
    "box",
    [
        (220.0, 60.0, 380.0, 440.0),
        (280.0, 190.0, 700.0, 600.0),  # over the border
        (-200.0, -300.0, 800.0, 900.0),
    ],
)
@pytest.mark.parametrize("batch", [1, "batch"])
def test_a_red_dot_is_found_at_its_pixel(box: tuple[float, ...], batch: int | str) -> None:
    """The test covers all steps: crop, channels, mean and standard deviation, peaks, way back."""
    estimator = OnnxPoseEstimator(red_point_pose(192, 144, batch=batch))
    step = float(PersonCrops(np.array([box]), 192, 144).step_px.max())
    (person,) = estimator.estimate(red_dot(318.4, 231.7), (PersonDetection(np.array(box), 0.9),))
    np.testing.assert_allclose(
        person.keypoints_px, np.tile((318.4, 231.7), (17, 1)), atol=0.4 + 0.3 * step
    )
    assert person.scores.min() > 0.8


def test_outputs_are_found_by_name_and_otherwise_by_order() -> None:
    image, people = red_dot(318.4, 231.7), (MIDDLE,)
    (wanted,) = OnnxPoseEstimator(red_point_pose(192, 144)).estimate(image, people)
    for graph in (
        red_point_pose(192, 144, order="yx"),
        red_point_pose(192, 144, named=False),
    ):
        (person,) = OnnxPoseEstimator(graph).estimate(image, people)
        np.testing.assert_array_equal(person.keypoints_px, wanted.keypoints_px)


@pytest.mark.parametrize("batch", [4, "batch"])
def test_people_are_in_the_order_of_their_boxes(batch: int | str) -> None:
    """With a free batch axis, 18 people need two batches."""
    estimator = OnnxPoseEstimator(red_point_pose(96, 72, batch=batch))
    image = np.zeros((600, 820, 3), np.uint8)
    detections, wanted = [], []
    for number in range(18):
        u, v = 90.0 + 125.0 * (number % 6) + number, 110.0 + 170.0 * (number // 6) + number
        image = np.maximum(image, red_dot(u, v, (600, 820)) * np.array([1, 0, 0], np.uint8))
        detections.append(PersonDetection(np.array([u - 30, v - 60, u + 20, v + 70]), 0.9))
        wanted.append((u, v))
    people = estimator.estimate(image, tuple(detections))
    nose = np.array([person.keypoints_px[0] for person in people])
    np.testing.assert_allclose(nose, wanted, atol=0.7)


def test_an_export_that_works_with_one_crop_only_is_run_for_each_crop() -> None:
    """The batch axis is declared as free, but the outputs are always those of one crop."""
    rows = np.exp(-0.5 * ((np.arange(128) - 50.0) / 6.0) ** 2) * np.ones((1, 17, 1))
    graph = fixed(
        {"simcc_x": rows[..., :96], "simcc_y": rows},
        (64, 48),
        batch="batch",
        declared=dict.fromkeys(("simcc_x", "simcc_y"), ("batch", 17, "bins")),
    )
    people = OnnxPoseEstimator(graph).estimate(IMAGE, (MIDDLE, MIDDLE))
    assert len(people) == 2
    np.testing.assert_array_equal(people[0].keypoints_px, people[1].keypoints_px)


def test_without_detections_the_network_does_not_run() -> None:
    estimator = OnnxPoseEstimator(red_point_pose(192, 144))
    estimator.model = OnnxModel(red_point_pose(32, 32))  # fails for these crops
    assert estimator.estimate(red_dot(300, 200), ()) == ()
    with pytest.raises(PerceptionError, match="could not be run"):
        estimator.estimate(red_dot(300, 200), (MIDDLE,))


def test_people_whose_crops_lie_outside_the_image_have_scores_of_0() -> None:
    estimator = OnnxPoseEstimator(network(17, (192, 144), depth=True)[0])
    beside = PersonDetection(np.array([900.0, 10.0, 990.0, 200.0]), 0.9)
    point = PersonDetection(np.array([50.0, 50.0, 50.0, 50.0]), 0.9)
    people = estimator.estimate(IMAGE, (beside, MIDDLE, point))
    assert [float(person.scores.max()) > 0.0 for person in people] == [False, True, False]
    np.testing.assert_allclose(people[0].keypoints_px, np.tile((944.5, 104.5), (17, 1)))
    (only,) = estimator.estimate(IMAGE, (beside,))
    assert (only.scores == 0.0).all()


@pytest.mark.parametrize("invalid", [np.nan, np.inf])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_keypoint_with_a_non_finite_axis_has_a_score_of_0(invalid: float, axis: int) -> None:
    rows = [
        np.exp(-0.5 * ((np.arange(n) - n / 2) / 6.0) ** 2) * np.ones((1, 17, 1))
        for n in (288, 384, 288)
    ]
    rows[axis][0, 3, 10] = invalid
    graph = fixed({f"simcc_{name}": row for name, row in zip("xyz", rows, strict=True)}, (192, 144))
    (person,) = OnnxPoseEstimator(graph).estimate(IMAGE, (MIDDLE,))
    assert person.scores[3] == 0.0
    assert np.delete(person.scores, 3) == pytest.approx(1.0)


_SMALL_ESTIMATOR = OnnxPoseEstimator(red_point_pose(48, 36))


@given(
    st.tuples(*[st.floats(-3e3, 3e3)] * 2, *[st.floats(0, 5e3)] * 2),
    st.integers(1, 700),
    st.integers(1, 700),
)
def test_any_box_on_any_image_gives_one_person(
    box: tuple[float, ...], height: int, width: int
) -> None:
    left, top, across, down = box
    detection = PersonDetection(np.array([left, top, left + across, top + down]), 0.5)
    image = np.full((height, width, 3), 200, np.uint8)
    (person,) = _SMALL_ESTIMATOR.estimate(image, (detection,))
    seen = person.keypoints_px[person.scores > 0.0]
    crop = PersonCrops(detection.box_xyxy_px[None], 48, 36)
    slack = 0.5 + crop.step_px[0]
    assert (seen >= -slack).all()
    assert (seen <= np.array([width, height]) - 1.0 + slack).all()
    assert bool(len(seen)) <= bool(crop.inside(image)[0])


# --- MoveNet --------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", ["int32", "uint8", "float32"])
@pytest.mark.parametrize("batch", [1, "batch"])
def test_movenet_finds_a_red_dot_of_each_person_at_its_pixel(dtype: str, batch: int | str) -> None:
    """Its output is y, x; the picture that it sees is a square, black beyond the image's border."""
    scores = np.linspace(0.0, 1.0, 17)
    estimator = OnnxPoseEstimator(red_point_movenet(192, scores, dtype=dtype, batch=batch))
    assert isinstance(estimator, PoseEstimator)
    assert (estimator.layout, estimator.has_depth) == ("coco", False)
    assert estimator.input_size_hw_px == (192, 192)
    image = np.maximum(red_dot(100.0, 300.0), red_dot(500.0, 200.0))
    boxes = ([0.0, 60.0, 160.0, 440.0], [430.0, 60.0, 590.0, 440.0])
    people = estimator.estimate(image, tuple(PersonDetection(np.array(b), 0.9) for b in boxes))
    for person, wanted in zip(people, ((100.0, 300.0), (500.0, 200.0)), strict=True):
        # A pixel of the crop is 2.5 of the image.
        np.testing.assert_allclose(person.keypoints_px, [wanted] * 17, atol=1.5)
        np.testing.assert_allclose(np.diff(person.scores) > 0.0, [True] * 16)
        assert not person.lifted


def test_movenets_keypoints_that_are_not_finite_or_outside_the_image_have_scores_of_0() -> None:
    scores = np.full(17, 0.8)
    scores[3], scores[4] = math.nan, 1.5
    estimator = OnnxPoseEstimator(red_point_movenet(64, scores))
    (person,) = estimator.estimate(red_dot(300.0, 200.0), (MIDDLE,))
    assert (person.scores[3], person.scores[4]) == (0.0, 1.0)
    # In a picture without red, the network's keypoints lie in the corner of its crop.
    corner = PersonDetection(np.array([0.0, 0.0, 100.0, 100.0]), 0.9)
    (person,) = estimator.estimate(IMAGE, (corner,))
    assert (person.keypoints_px < -5.0).all()
    assert (person.scores == 0.0).all()


@pytest.mark.parametrize(
    ("shape", "output", "reason"),
    [
        ((1, 256, 256, 3), (1, 6, 56), "only MoveNet for one person is known"),
        ((1, 256, 192, 3), (1, 1, 17, 3), "only MoveNet for one person is known"),
    ],
)
def test_other_networks_with_the_channels_last_are_refused(
    shape: tuple[int, ...], output: tuple[int, ...], reason: str
) -> None:
    graph = Graph("input", shape, dtype="int32")
    graph.output(graph.node("Add", graph.constant(np.zeros(output)), graph.zero()), "out", output)
    with pytest.raises(PerceptionError, match=reason) as refused:
        OnnxPoseEstimator(graph.bytes())
    assert "MoveNet: (1, size, size, 3)" in str(refused.value)


@pytest.mark.parametrize(
    ("outputs", "reason"),
    [
        ({"heatmaps": (1, 17, 64, 48)}, "does not have two or three outputs"),
        ({"simcc_x": (1, 17, 96)}, "does not have two or three outputs"),
        ({"simcc_x": (1, 26, 96), "simcc_y": (1, 26, 128)}, "26 keypoints are not known"),
        ({"simcc_x": (1, 17, 96), "simcc_y": (1, 133, 128)}, "17 and 133 keypoints"),
        ({"simcc_x": (1, 17, 96), "simcc_y": (1, 17, 96)}, "96 bins along x and 96 along y"),
        ({"simcc_x": (1, 17, 24), "simcc_y": (1, 17, 32)}, "24 bins along x"),
    ],
)
def test_unknown_layouts_are_refused_with_what_was_found_and_what_is_known(
    outputs: dict[str, tuple[int, ...]], reason: str
) -> None:
    graph = fixed({name: np.zeros(shape) for name, shape in outputs.items()}, (64, 48))
    with pytest.raises(PerceptionError, match=reason) as refused:
        OnnxPoseEstimator(graph)
    assert "Found input (N, 3, 64, 48) ->" in str(refused.value)
    assert "Known: RTMPose" in str(refused.value)
    free = fixed({"simcc_x": np.zeros((1, 17, 96))}, ("h", "w"))
    with pytest.raises(PerceptionError, match="input_size_hw_px"):
        OnnxPoseEstimator(free)


# --- peaks of SimCC outputs -----------------------------------------------------------------------


def gaussian(place: float, bins: int, sigma: float = 6.0, height: float = 0.8) -> np.ndarray:
    reach = np.arange(bins) - place
    return (height * np.exp(-0.5 * (reach / sigma) ** 2)).astype(np.float32).reshape(1, 1, bins)


@example(1.5, 1.0, 3.0)  # midway between two bins, where rounding decides which is higher
@given(st.floats(1.0, 286.0), st.floats(1.0, 12.0), st.floats(0.05, 20.0))
def test_the_position_of_a_gaussian_is_exact(place: float, sigma: float, height: float) -> None:
    places, heights = simcc_peaks([gaussian(place, 288, sigma, height)])
    assert places[0, 0, 0] == pytest.approx(place, abs=2e-3)
    assert heights[0, 0, 0] <= height * (1 + 1e-6)
    assert heights[0, 0, 0] >= height * np.exp(-0.5 * (0.5 / sigma) ** 2) * (1 - 1e-5)


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
@pytest.mark.parametrize("end", [0, 63])
def test_a_peak_at_the_end_of_an_axis_stays_there(end: int, dtype: type) -> None:
    places, heights = simcc_peaks([gaussian(end, 64).astype(dtype)])
    assert places[0, 0, 0] == end
    assert heights[0, 0, 0] == pytest.approx(0.8, rel=1e-3)


@pytest.mark.parametrize("rows", [np.zeros((2, 3, 9)), np.full((2, 3, 9), -2.0)])
def test_a_constant_row_has_a_position_and_causes_no_warning(rows: np.ndarray) -> None:
    places, heights = simcc_peaks([rows])
    assert ((places >= 0) & (places <= 8)).all()
    np.testing.assert_array_equal(heights[0], rows[..., 0])


# --- lifting to metres ----------------------------------------------------------------------------


FOCAL_PX = 500.0
FAR_M = 200.0  # weak perspective holds
DOWN, AHEAD = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -1.0])


def body(yaw_rad: float = 0.0) -> np.ndarray:
    """Return a body (17, 3) relative to the mid-hip; every limb has the average length."""
    points = np.zeros((17, 3))
    length = {limb.name: limb.length_m for limb in LIMBS}
    for side, sign in ((0, 1.0), (1, -1.0)):
        shoulder = np.array([sign * 0.5 * length["shoulder span"], -length["torso"], 0.0])
        elbow = shoulder + length["left upper arm"] * DOWN
        hip = np.array([sign * 0.5 * length["hip span"], 0.0, 0.0])
        knee = hip + length["left thigh"] * DOWN
        points[5 + side], points[7 + side] = shoulder, elbow
        points[9 + side] = elbow + length["left forearm"] * AHEAD
        points[11 + side], points[13 + side] = hip, knee
        points[15 + side] = knee + length["left shank"] * DOWN
    points[:5] = points[5:7].mean(axis=0) - 0.2 * DOWN + 0.1 * AHEAD
    return Rotation.from_euler("y", yaw_rad).apply(points)


@pytest.mark.parametrize("yaw_deg", [0, 60, 250])
def test_a_distant_body_is_recovered_at_any_heading(yaw_deg: float) -> None:
    points = body(math.radians(yaw_deg))
    pixels = points[:, :2] * FOCAL_PX / FAR_M + (320.0, 240.0)
    skeleton = lift_keypoints(pixels[None], points[None, :, 2], np.ones((1, 17)))[0]
    np.testing.assert_allclose(skeleton, points, atol=1e-9)


def test_without_depths_the_skeleton_is_flat_and_has_the_right_scale() -> None:
    points = body(math.radians(40))
    pixels = points[:, :2] * FOCAL_PX / FAR_M
    skeleton = lift_keypoints(pixels[None], None, np.ones((1, 17)))[0]
    assert (skeleton[:, 2] == 0.0).all()
    np.testing.assert_allclose(skeleton[:, :2], points[:, :2], atol=1e-9)


def test_unseen_limbs_vote_only_if_no_limb_is_seen_and_an_outlier_does_not_count() -> None:
    points = body()
    pixels = points[None, :, :2] * FOCAL_PX / FAR_M
    wrong = pixels.copy()
    wrong[:, 11:] *= 3.0  # unseen legs, three times too large
    scores = np.ones((1, 17))
    scores[:, 11:] = 0.1
    shown = metres_per_pixel(wrong, points[None, :, 2], scores)
    assert shown[0] == pytest.approx(FAR_M / FOCAL_PX)
    guessed = metres_per_pixel(pixels, points[None, :, 2], np.zeros((1, 17)))
    assert guessed[0] == pytest.approx(FAR_M / FOCAL_PX)
    pixels[0, 9] += 0.5 * FOCAL_PX / FAR_M  # a wrist at a wrong place
    scale = metres_per_pixel(pixels, points[None, :, 2], np.ones((1, 17)))
    assert scale[0] == pytest.approx(FAR_M / FOCAL_PX)


@pytest.mark.parametrize(("yaw_deg", "distance_m"), [(0, 2.0), (45, 4.0), (110, 2.0)])
def test_the_pipeline_places_a_lifted_body(distance_m: float, yaw_deg: float) -> None:
    """At short distances weak perspective causes an error of some percent."""
    camera = Camera.from_fov(640, 480, math.radians(60.0))
    points = body(math.radians(yaw_deg))
    root = np.array([0.2, 0.1, distance_m])
    pixels = camera.project(points + root)
    true = root + 0.7 * points[5:7].mean(axis=0)
    for depths, limit in ((points[None, :, 2], 0.06), (None, 0.12)):
        skeleton = lift_keypoints(pixels[None], depths, np.ones((1, 17)))[0]
        person = PersonKeypoints(pixels, skeleton, np.ones(17), "coco")
        (found,) = place_bodies(camera, (person,), 1.0)
        assert found is not None
        assert np.linalg.norm(found.position_camera_m - true) < limit * distance_m
