"""Cameras that are rolled: their pictures are turned, and nothing downstream notices."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_people import person_at

from perception import (
    AwarenessPipeline,
    Camera,
    FloorPlane,
    PersonDetection,
    PersonKeypoints,
)
from perception.surround import PanoramaLens, SurroundPipeline, ring_of_views
from perception.turn import QuarterTurn

LEVEL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
QUARTERS = st.integers(1, 3)
DISTORTIONS = {
    "none": [],
    "plumb_bob": [-0.28, 0.07, 0.004, -0.003, 0.01],
    "rational": [0.4, -0.1, 0.002, 0.003, 0.01, 0.6, 0.02, 0.01],
    "prisms": [-0.2, 0.05, 0.003, -0.002, 0.0, 0.0, 0.0, 0.0, 0.01, 0.002, -0.012, 0.001],
    "tilted": [-0.2, 0.05, 0.003, -0.002, *[0.0] * 8, 0.02, -0.03],
}


def rolled(camera: Camera, quarters: int) -> Camera:
    """The same lens and sensor behind a body that is rolled against the picture."""
    return QuarterTurn(-quarters % 4).camera(camera)


@pytest.mark.parametrize("model", DISTORTIONS)
@given(
    quarters=QUARTERS,
    u=st.integers(0, 639),
    v=st.integers(0, 479),
    off=st.tuples(st.floats(-30, 30), st.floats(-30, 30), st.floats(0.9, 1.1)),
)
@settings(max_examples=40, deadline=None)
def test_a_pixel_and_its_ray_stay_together(model, quarters, u, v, off):
    camera = Camera(
        640, 480, 520.0, 520.0 * off[2], 319.5 + off[0], 239.5 + off[1], DISTORTIONS[model] or None
    )
    turn = QuarterTurn(quarters)
    view = turn.camera(camera)
    marked = np.zeros((480, 640), bool)
    marked[v, u] = True
    picture = turn.picture(marked)
    assert picture.shape == (view.height_px, view.width_px)
    (ray,) = camera.normalise([[float(u), float(v)]])
    (pixel,) = view.project([turn.rotation_camera_view.T @ [*ray, 1.0]])
    # A turn within a tilted sensor is of the second order.
    assert np.argwhere(picture)[0, ::-1] == pytest.approx(
        pixel, abs=0.4 if model == "tilted" else 1e-3
    )


@given(
    roll_deg=st.floats(-44.0, 44.0), pitch_deg=st.floats(-60.0, 60.0), quarters=st.integers(0, 3)
)
def test_the_turn_is_the_nearest_one_whatever_the_pitch(roll_deg, pitch_deg, quarters):
    roll, pitch = math.radians(roll_deg), math.radians(pitch_deg)
    up = math.cos(pitch) * np.array([-math.sin(roll), -math.cos(roll), 0.0])
    up[2] = math.sin(pitch)
    assert QuarterTurn.upright(up) == QuarterTurn(0)
    back = QuarterTurn(quarters).rotation_camera_view
    assert QuarterTurn.upright(back @ up) == QuarterTurn(quarters)


def test_nothing_is_turned_where_up_is_unknown_or_not_in_the_picture():
    assert QuarterTurn.upright(None) == QuarterTurn(0)
    assert QuarterTurn.upright(np.array([0.0, 0.1, -0.995])) == QuarterTurn(0)


class Marks:
    """Networks that read the people's keypoints from the colours of a picture's pixels.

    They know people upright only: of others they see as much as a real network, nothing.
    """

    def __init__(self, *people: PersonKeypoints) -> None:
        self.people = people

    def drawn(self, camera: Camera) -> np.ndarray:
        image = np.full((camera.height_px, camera.width_px, 3), 255, np.uint8)
        for number, person in enumerate(self.people):
            for row, (u, v) in enumerate(np.rint(person.keypoints_px).astype(int).tolist()):
                if 0 <= u < camera.width_px and 0 <= v < camera.height_px:
                    image[v, u] = (number, row, 0)
        return image

    def _found(self, image_rgb):
        for number in range(len(self.people)):
            pixels, scores = np.zeros((17, 2)), np.zeros(17)
            for v, u in np.argwhere((image_rgb[..., 2] == 0) & (image_rgb[..., 0] == number)):
                pixels[image_rgb[v, u, 1]], scores[image_rgb[v, u, 1]] = (u, v), 1.0
            seen = pixels[scores > 0.0]
            if len(seen) and pixels[5:7, 1].mean() < pixels[11:13, 1].mean() - 20.0:
                yield number, pixels, scores, seen

    def detect(self, image_rgb):
        return tuple(
            PersonDetection(np.concatenate([seen.min(axis=0) + 0.5, seen.max(axis=0) + 0.5]), 0.9)
            for *_, seen in self._found(image_rgb)
        )

    def estimate(self, image_rgb, detections):
        return tuple(
            PersonKeypoints(pixels, self.people[number].keypoints_root_m, scores, "coco")
            for number, pixels, scores, _ in self._found(image_rgb)
        )


@given(
    quarters=QUARTERS,
    x=st.floats(0.3, 0.9),
    z=st.floats(3.0, 5.0),
    yaw=st.floats(-0.6, 0.6),
    points=st.sampled_from([None, [[0.4, 0.3, -0.2], [-0.2, 0.6, 0.1]]]),
    with_depth=st.booleans(),
)
@settings(max_examples=12, deadline=None)
def test_the_same_people_stand_in_the_base_frame_however_the_camera_is_rolled(
    quarters, x, z, yaw, points, with_depth
):
    camera = Camera(640, 480, 500.0, 510.0, 310.0, 250.0, DISTORTIONS["plumb_bob"])
    rng = np.random.default_rng(1)
    networks = Marks(
        *(
            person_at(place, head_yaw_rad=yaw).keypoints(camera, 0.0, rng)
            for place in ((x, 0.2, z), (x - 1.4, 0.2, z + 0.5))
        )
    )
    image = networks.drawn(camera)
    depth = np.full(image.shape[:2], z - 0.1, np.float32) if with_depth else None
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = LEVEL, (0.2, 0.1, 1.2)
    upright = AwarenessPipeline(camera, networks, networks, robot_points_camera_m=points).process(
        image, 0.0, FloorPlane.from_pose(T), depth_m=depth
    )
    assert len(upright) == 2
    turn = QuarterTurn(quarters)
    hung, R = rolled(camera, quarters), turn.rotation_camera_view
    T_hung = T.copy()
    T_hung[:3, :3] = T[:3, :3] @ R.T
    pipeline = AwarenessPipeline(
        hung,
        networks,
        networks,
        robot_points_camera_m=None if points is None else points @ R.T,
        detect_every_s=0.2,
    )
    picture = np.ascontiguousarray(np.rot90(image, -quarters))
    floor = FloorPlane.from_pose(T_hung)
    if depth is not None:
        depth = np.ascontiguousarray(np.rot90(depth, -quarters))
    assert not pipeline.process(picture, -1.0)  # without the mount, nobody
    seen = pipeline.process(picture, 0.0, floor, depth_m=depth)
    for one, other in zip(upright, seen, strict=True):
        np.testing.assert_allclose(
            T_hung[:3, :3] @ other.position_camera_m, LEVEL @ one.position_camera_m, atol=1e-6
        )
        np.testing.assert_allclose(
            R.T @ other.position_covariance_m2 @ R, one.position_covariance_m2, atol=1e-6
        )
        np.testing.assert_allclose(R.T @ other.gaze_camera, one.gaze_camera, atol=1e-6)
        assert other.awareness == pytest.approx(one.awareness, abs=1e-6)
        # Pixels are those of the camera's own picture: each keypoint lies on its mark.
        pixels = np.rint(other.keypoints.keypoints_px).astype(int)
        shown = other.keypoints.scores > 0.0
        assert [picture[v, u, 1] for u, v in pixels[shown]] == np.flatnonzero(shown).tolist()
        low, high = pixels[shown].min(axis=0), pixels[shown].max(axis=0)
        np.testing.assert_allclose(other.box_xyxy_px, [*low + 0.5, *high + 0.5])


@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
def test_views_of_a_panorama_that_is_rolled_are_turned_too(quarters):
    view = Camera(320, 320, 190.0, 190.0, 159.5, 159.5)
    rng = np.random.default_rng(2)
    networks = Marks(person_at((0.2, 0.3, 3.0)).keypoints(view, 0.0, rng))

    class Flat(SurroundPipeline):
        """The lens's part is tested elsewhere: here the views show the marks."""

        def flat_pictures(self, image_rgb):
            blank = np.full_like(image_rgb, 255)
            return image_rgb, blank

    ring = ring_of_views(view, [0.0, 1.2])
    surround = Flat(
        PanoramaLens(640, 320), ring, lambda camera: AwarenessPipeline(camera, networks, networks)
    )
    picture = np.rot90(networks.drawn(view), -quarters)
    R = QuarterTurn(quarters).rotation_camera_view
    (flat,) = AwarenessPipeline(view, networks, networks).process(networks.drawn(view), 0.0)
    (seen,) = surround.process(picture, 0.0, up_camera=-R[:, 1])
    np.testing.assert_allclose(R.T @ seen.position_camera_m, flat.position_camera_m, atol=1e-6)
    assert seen.awareness == pytest.approx(flat.awareness, abs=1e-6)
