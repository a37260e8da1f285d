"""Range from several cues: least squares where they agree, outliers outvoted where not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from synthetic_people import person_at

from perception import Camera, FloorPlane, HeadPose, PersonDetection, PersonKeypoints
from perception._depth_cues import DepthCue, combined_range
from perception._placement import place_people

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
CAMERA_HEIGHT_M = 1.2
FLOOR = FloorPlane(np.array([0.0, -1.0, 0.0]), CAMERA_HEIGHT_M)
NO_OUTLIER = 1e-9

cue = st.builds(
    DepthCue,
    st.floats(-0.2, 0.2),
    st.floats(0.02, 0.2),
    st.floats(0.0, 0.01),
    st.floats(0.01, 0.3),
)


def combined(cues, unusual_probability=0.0):
    """Return the logarithm of the range and its standard deviation."""
    return combined_range(cues, unusual_probability)[:2]


# --- combination --------------------------------------------------------------------------------


def test_without_outliers_the_result_is_generalised_least_squares():
    cues = [
        DepthCue(0.02, 0.06, 0.05, NO_OUTLIER),
        DepthCue(-0.01, 0.05, 0.016, NO_OUTLIER),
        DepthCue(0.0, 0.04, 0.0, NO_OUTLIER),
    ]
    stature = np.array([0.05, 0.016, 0.0])
    covariance = np.outer(stature, stature) + np.diag(
        [0.06**2 - 0.05**2, 0.05**2 - 0.016**2, 0.04**2]
    )
    weight = np.linalg.inv(covariance)
    mean, std = combined(cues)
    assert mean == pytest.approx(weight.sum(axis=0) @ [0.02, -0.01, 0.0] / weight.sum(), abs=1e-6)
    assert std == pytest.approx(1.0 / math.sqrt(weight.sum()), rel=1e-4)


@given(st.floats(0.4, 1.5))
def test_two_cues_that_agree_outvote_an_outlier(off):
    agreeing = [DepthCue(0.0, 0.06, 0.05, 0.03), DepthCue(0.01, 0.05, 0.016, 0.05)]
    mean, std = combined([*agreeing, DepthCue(off, 0.03, 0.0, 0.1)])
    assert abs(mean) < 0.03
    assert std < 0.08


@given(st.floats(0.3, 1.0))
def test_the_standard_deviation_spans_two_contradicting_cues(off):
    mean, std = combined([DepthCue(0.0, 0.05, 0.0, 0.1), DepthCue(off, 0.05, 0.0, 0.1)])
    assert mean == pytest.approx(0.5 * off, abs=1e-6)
    assert std > 0.45 * off


def test_the_standard_deviation_is_calibrated_over_a_population():
    """With random errors and outliers as in the model, 68 and 95 % intervals hold."""
    rng = np.random.default_rng(0)
    normalised = []
    for _ in range(3000):
        stature = rng.normal()
        cues = []
        for std, part, outlier in ((0.06, 0.05, 0.03), (0.05, 0.016, 0.05), (0.05, 0.0, 0.1)):
            own = math.sqrt(std**2 - part**2)
            value = part * stature + own * rng.normal()
            if rng.random() < outlier:
                value = rng.uniform(-1.0, 1.0)
            cues.append(DepthCue(value, std, part, outlier))
        mean, std = combined(cues)
        normalised.append(abs(mean) / std)
    assert 0.66 <= np.mean(np.array(normalised) < 1.0) <= 0.80
    assert 0.93 <= np.mean(np.array(normalised) < 1.96) <= 0.99


@pytest.mark.parametrize("log_ratio", [-0.5, -0.3, 0.3])
def test_one_cue_without_stature_outvotes_two_that_share_an_unusual_one(log_ratio):
    tall = [DepthCue(0.0, 0.05, 0.049, 0.03, 0.35), DepthCue(0.0, 0.05, 0.016, 0.05, 0.35)]
    measured = DepthCue(log_ratio, 0.02, 0.0, 0.005)
    assert combined([*tall, measured])[0] == pytest.approx(0.0, abs=0.02)
    mean, std = combined([*tall, measured], 0.05)
    assert mean == pytest.approx(log_ratio, abs=0.02)
    assert std < 0.5 * abs(log_ratio)
    # Somebody of usual stature is placed as before.
    near = [*tall, DepthCue(0.02, 0.02, 0.0, 0.005)]
    assert combined(near, 0.05)[0] == pytest.approx(combined(near)[0], abs=0.005)


# --- placement ----------------------------------------------------------------------------------


def seen_person(rng, *, stature_m=1.74, depth=4.0, across=0.0, lift_m=0.0, noise_px=1.0, yaw=0.0):
    """Return a person who stands ``lift_m`` above the floor, with keypoints and tight box."""
    scale = stature_m / 1.83
    hips_down = CAMERA_HEIGHT_M - lift_m - 0.93 * scale
    person = person_at((across, hips_down, depth), body_yaw_rad=yaw, stature_m=stature_m)
    keypoints = person.keypoints(CAMERA, noise_px, rng, lift_std_m=0.03, unit=1.0 / stature_m)
    soles = person.points_camera_m[15:17] + np.array([0.0, 0.081 * scale, 0.0])
    crown = person.points_camera_m[0] - np.array([0.0, 0.16 * scale, 0.0])
    extent = np.vstack([keypoints.keypoints_px, CAMERA.project([*soles, crown])])
    # Keypoints outside the image are not seen, and boxes end at its border.
    limits = (CAMERA.width_px - 1.0, CAMERA.height_px - 1.0)
    box = np.clip(np.r_[extent.min(axis=0), extent.max(axis=0)], 0.0, [*limits, *limits])
    inside = ((keypoints.keypoints_px >= 0.0) & (keypoints.keypoints_px <= limits)).all(axis=1)
    shown = PersonKeypoints(
        keypoints.keypoints_px, keypoints.keypoints_root_m, inside.astype(float), "coco"
    )
    return person, shown, PersonDetection(box, 0.9)


def head_of(person, rng=None, *, range_std=0.05, stature_m=1.74, factor=None):
    """Return a head pose with a range error as from an unknown head size."""
    if factor is None:
        factor = 1.0 + (rng.normal(0.0, range_std) if rng is not None else 0.0)
    nose = person.points_camera_m[0] * factor
    covariance = 0.05**2 * np.eye(6)
    return HeadPose(nose, person.rotation_camera_head, covariance, 0.5, 1.0, range_std)


def place(shown, detection, head=None, floor=None):
    (placed,) = place_people(CAMERA, (detection,), (shown,), (head,), floor, 1.0, 0.3)
    return placed.position_camera_m, placed.covariance_m2


def test_more_cues_lower_the_error_and_agree_with_the_covariance():
    """The people have the statures of a population."""
    rng = np.random.default_rng(1)
    errors = {name: [] for name in ("body", "head", "floor", "all")}
    within_95 = {name: [] for name in errors}
    for _ in range(250):
        stature = rng.normal(1.74, 0.05 * 1.74)
        person, shown, detection = seen_person(
            rng,
            stature_m=stature,
            depth=rng.uniform(3.0, 7.0),
            across=rng.uniform(-1.0, 1.0),
            yaw=rng.uniform(-math.pi, math.pi),
        )
        head = head_of(person, rng, range_std=0.04)
        given_cues = {
            "body": (None, None), "head": (head, None), "floor": (None, FLOOR), "all": (head, FLOOR)
        }  # fmt: skip
        for name, (with_head, with_floor) in given_cues.items():
            position, covariance = place(shown, detection, with_head, with_floor)
            error = position - person.chest_camera_m
            errors[name].append(np.linalg.norm(error) / np.linalg.norm(person.chest_camera_m))
            within_95[name].append(error @ np.linalg.solve(covariance, error) < 7.81)
    median = {name: np.median(values) for name, values in errors.items()}
    assert median["head"] < median["body"]
    assert median["floor"] < 0.7 * median["body"]
    assert median["all"] <= 1.1 * median["floor"]
    assert median["all"] < 0.02
    for name, values in within_95.items():
        assert 0.88 <= np.mean(values) <= 1.0, name


@pytest.mark.parametrize("lift_m", [0.0, 0.3, 0.6, 0.9])
@pytest.mark.parametrize("with_head", [True, False])
def test_the_covariance_includes_the_error_for_a_person_on_a_ladder(lift_m, with_head):
    rng = np.random.default_rng(2)
    inside = []
    for _ in range(25):
        person, shown, detection = seen_person(rng, depth=4.0, lift_m=lift_m)
        head = head_of(person, rng, range_std=0.05) if with_head else None
        position, covariance = place(shown, detection, head, FLOOR)
        error = position - person.chest_camera_m
        inside.append(error @ np.linalg.solve(covariance, error) < 11.3)
    assert np.mean(inside) >= 0.9


def test_a_person_behind_a_bench_is_not_placed_farther_away():
    """Neither the ankles nor the lower edge of the box show the floor."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        person, shown, detection = seen_person(rng, depth=4.0)
        scores = np.array(shown.scores)
        scores[13:17] = 0.0
        hidden = PersonKeypoints(shown.keypoints_px, shown.keypoints_root_m, scores, "coco")
        box = np.array(detection.box_xyxy_px)
        box[3] = shown.keypoints_px[11:13, 1].mean() + 15.0
        position, covariance = place(hidden, PersonDetection(box, 0.9), head_of(person, rng), FLOOR)
        error = position - person.chest_camera_m
        assert error @ np.linalg.solve(covariance, error) < 11.3
        assert np.linalg.norm(error) < 0.15 * 4.0


def test_the_planted_foot_counts_in_a_step():
    rng = np.random.default_rng(4)
    _, shown, detection = seen_person(rng, depth=4.0, noise_px=0.2)
    pixels, root = np.array(shown.keypoints_px), np.array(shown.keypoints_root_m)
    pixels[15, 1] -= 0.25 * CAMERA.fx_px / 4.0
    root[15, 1] -= 0.25 / 1.74
    step = PersonKeypoints(pixels, root, shown.scores, "coco")
    position, _ = place(step, detection, None, FLOOR)
    standing, _ = place(shown, detection, None, FLOOR)
    assert np.linalg.norm(position - standing) < 0.12


def test_a_floor_improves_the_placement_by_a_box():
    rng = np.random.default_rng(5)
    person, shown, detection = seen_person(rng, depth=5.0, stature_m=1.5)
    unseen = PersonKeypoints(shown.keypoints_px, shown.keypoints_root_m, np.zeros(17), "coco")
    (rough, wide), (fine, tight) = place(unseen, detection), place(unseen, detection, None, FLOOR)
    truth = person.chest_camera_m
    assert np.linalg.norm(fine - truth) < 0.5 * np.linalg.norm(rough - truth)
    # No smaller σ is asked for: an edge that is a shelf's is wrong in the same way as the height.
    for place_m, spread in ((rough, wide), (fine, tight)):
        off = place_m - truth
        assert off @ np.linalg.solve(spread, off) < 7.81
    # A box that is cut off by the lower border does not show the feet.
    lower = CAMERA.height_px - 1.0
    cut = PersonDetection([300.0, 200.0, 360.0, lower], 0.9)
    with_floor, without = place(unseen, cut, None, FLOOR), place(unseen, cut)
    np.testing.assert_array_equal(with_floor[0], without[0])


@given(st.floats(0.3, 3.0))
def test_the_covariance_includes_the_error_for_a_false_head_range(factor):
    rng = np.random.default_rng(6)
    person, shown, detection = seen_person(rng, depth=4.0, stature_m=1.74, noise_px=0.3)
    position, covariance = place(shown, detection, head_of(person, factor=factor))
    truth = person.chest_camera_m
    error = position - truth
    assert error @ np.linalg.solve(covariance, error) < 9.0


def test_flat_skeletons_have_wider_ranges():
    rng = np.random.default_rng(7)
    person, shown, detection = seen_person(rng, depth=4.0)
    root = np.array(shown.keypoints_root_m)
    root[:, 2] = 0.0
    flat = PersonKeypoints(shown.keypoints_px, root, shown.scores, "coco", lifted=False)
    position, covariance = place(flat, detection)
    _, lifted = place(shown, detection)
    # On top of the spread of statures, 12 % of 4 m.
    assert covariance[2, 2] - lifted[2, 2] > (0.12 * 4.0) ** 2
    error = position - person.chest_camera_m
    assert error @ np.linalg.solve(covariance, error) < 7.81


# --- people of any size -------------------------------------------------------------------------


def test_a_single_cue_has_the_standard_deviation_of_the_mixture():
    """Drawn from the mixture, errors about the adult have the deviation that is reported."""
    rng = np.random.default_rng(8)
    unusual = rng.random(200_000) < 0.2
    size = np.where(unusual, 0.3 + 0.2 * rng.normal(size=200_000), 0.05 * rng.normal(size=200_000))
    drawn = size + 0.04 * rng.normal(size=200_000)
    one = combined_range([DepthCue(0.0, math.hypot(0.05, 0.04), 0.05, 0.03, 0.2, 0.3)], 0.2)
    assert one.log_range == 0.0
    assert one.log_std == pytest.approx(math.sqrt(np.mean(drawn**2)), rel=0.01)
    assert one.lasting_std == pytest.approx(math.sqrt(np.mean(size**2)), rel=0.01)


@given(st.floats(0.2, 0.8))
def test_feet_that_seem_nearer_are_believed_and_feet_that_seem_farther_are_not(off):
    body = DepthCue(0.0, 0.06, 0.05, 0.03, 0.2, 0.3)
    nearer, farther = (
        combined_range([body, DepthCue(value, 0.04, 0.0, 0.1, outlier_farther=0.9)], 0.2)
        for value in (-off, off + 0.2)
    )
    assert nearer.log_range == pytest.approx(-off, abs=0.05)
    assert abs(farther.log_range) < 0.05
    assert farther.log_std > 0.1 * off


@pytest.mark.parametrize("stature_m", [1.0, 1.15, 1.3, 1.5, 1.74, 1.9])
def test_feet_on_a_known_floor_place_people_of_any_stature(stature_m):
    rng, off, inside = np.random.default_rng(10), [], []
    for _ in range(30):
        where = {"depth": rng.uniform(3.0, 6.0), "yaw": rng.uniform(-3.1, 3.1)}
        person, shown, detection = seen_person(rng, stature_m=stature_m, **where)
        position, covariance = place(shown, detection, None, FLOOR)
        error = position - person.chest_camera_m
        off.append(np.linalg.norm(position) / np.linalg.norm(person.chest_camera_m) - 1.0)
        inside.append(error @ np.linalg.solve(covariance, error) < 7.81)
    assert np.median(np.abs(off)) <= 0.08
    assert np.mean(inside) >= 0.9


@pytest.mark.parametrize("stature_m", [1.1, 1.4, 1.74])
def test_knees_place_people_whose_feet_are_hidden(stature_m):
    rng, off = np.random.default_rng(11), []
    for _ in range(20):
        person, shown, detection = seen_person(rng, stature_m=stature_m, depth=4.0)
        scores = np.array(shown.scores)
        scores[15:17] = 0.0
        hidden = PersonKeypoints(shown.keypoints_px, shown.keypoints_root_m, scores, "coco")
        box = np.array(detection.box_xyxy_px)
        box[3] = shown.keypoints_px[13:15, 1].mean()
        position, _ = place(hidden, PersonDetection(box, 0.9), None, FLOOR)
        off.append(np.linalg.norm(position) / np.linalg.norm(person.chest_camera_m) - 1.0)
    assert np.median(np.abs(off)) <= 0.08


def test_agreeing_box_cues_hold_that_the_lower_part_may_be_hidden():
    box = DepthCue(0.0, 0.26, 0.05, 0.05, 0.2, 0.3, hidden_offset=0.7)
    edge = DepthCue(0.0, 0.1, 0.0, 0.3, hidden_offset=math.inf)
    plain = [replace(box, hidden_offset=0.0), replace(edge, hidden_offset=0.0)]
    held, taken = combined_range([box, edge]), combined_range(plain)
    assert held.log_range == pytest.approx(taken.log_range, abs=0.05)
    # The edge of a shelf puts the person 0.7 too far in both cues.
    assert held.log_std > taken.log_std + 0.01


# --- the floor as a cue ---------------------------------------------------------------------------


LEVEL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # camera to odom


def pose(height_m=1.2, pitch_rad=0.0, roll_rad=0.0, yaw_rad=0.0):
    T = np.eye(4)
    turn = Rotation.from_euler("zyx", [yaw_rad, pitch_rad, roll_rad]).as_matrix()
    T[:3, :3] = turn @ LEVEL
    T[:3, 3] = (3.0, -2.0, height_m)
    return T


@given(
    pitch=st.floats(-0.3, 0.6), roll=st.floats(-0.3, 0.3), yaw=st.floats(-3.0, 3.0),
    ahead=st.floats(1.0, 12.0), left=st.floats(-3.0, 3.0), above=st.floats(0.0, 0.3),
)  # fmt: skip
def test_points_on_the_floor_are_found_at_their_depth(pitch, roll, yaw, ahead, left, above):
    T = pose(1.2, pitch, roll, yaw)
    floor = FloorPlane.from_pose(T)
    heading = np.array([math.cos(yaw), math.sin(yaw)])
    flat = T[:2, 3] + ahead * heading + left * np.array([-heading[1], heading[0]])
    point = np.linalg.inv(T) @ np.append(flat, [above, 1.0])
    assume(point[2] > 0.3)
    depth, std = floor.depth_of((point[:2] / point[2])[None], above, 0.0, 0.0)
    assert depth[0] == pytest.approx(point[2], rel=1e-9)
    assert std[0] > 0.0
    assert floor.normal_camera @ point[:3] + floor.height_m == pytest.approx(above, abs=1e-9)


def test_rays_at_the_horizon_and_points_above_the_camera_have_no_depth():
    floor = FloorPlane(np.array([0.0, -1.0, 0.0]), 1.0)
    depth, std = floor.depth_of(np.array([[0.0, 0.0], [0.0, -0.2], [0.1, 0.005]]), 0.0, 0.0, 0.0)
    assert np.isnan(depth).all()
    assert np.isnan(std).all()
    assert np.isnan(floor.depth_of(np.array([[0.0, 0.3]]), 1.4, 0.0, 0.0)[0]).all()


def test_the_standard_deviation_agrees_with_random_errors():
    floor = FloorPlane.from_pose(pose(1.1, 0.2), height_std_m=0.02, tilt_std_rad=0.01)
    ray, count = np.array([0.15, 0.12]), 40000
    rng = np.random.default_rng(0)
    turns = Rotation.from_rotvec(rng.normal(0.0, 0.01, (count, 3))).as_matrix()
    normals = turns @ floor.normal_camera
    rays = np.append(ray, 1.0) + np.column_stack(
        [rng.normal(0.0, 0.004, (count, 2)), np.zeros(count)]
    )
    heights = 1.1 + rng.normal(0.0, 0.02, count) - (0.07 + rng.normal(0.0, 0.03, count))
    drawn = np.log(heights / -np.einsum("ni,ni->n", normals, rays))
    depth, std = floor.depth_of(ray[None], 0.07, 0.03, 0.004)
    assert np.median(drawn) == pytest.approx(math.log(depth[0]), abs=0.005)
    assert std[0] == pytest.approx(drawn.std(), rel=0.1)
