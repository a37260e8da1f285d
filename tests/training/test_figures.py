"""Figures in every posture, their looks and backgrounds: the truth is that of the drawn body."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from perception.anthropometry import HEAD_TEMPLATE_M
from perception.layouts import LEFT_HIP, LEFT_SHOULDER, RIGHT_HIP, RIGHT_SHOULDER
from sim_tests.actors.body import JOINTS, Worker, load_worker
from sim_tests.dataset import RenderConfig
from sim_tests.world import Warehouse
from training.networks import random_background, random_texture
from training.networks._figures import Figure
from training.networks._looks import FEET, HANDS, HEAD, LOWER, UPPER, parts_of_texture
from training.networks._postures import POSTURES, random_posture
from training.networks._scenes import TrainingScene
from training.networks._textures import Backgrounds


@pytest.fixture(scope="module")
def warehouse():
    with Warehouse() as hall:
        yield hall


@pytest.fixture(scope="module")
def figure(warehouse):
    return Figure(warehouse, "amina")


def still(name="standing"):
    posture = random_posture(np.random.default_rng(0), name)
    return type(posture)(name, np.zeros(3), np.zeros_like(posture.joint_rotvecs))


def test_a_figure_at_rest_has_the_keypoints_and_the_head_of_a_standing_worker(warehouse, figure):
    worker = Worker(warehouse, look="amina", position_odom_m=(1.0, 0.5), heading_odom_rad=0.7)
    figure.place((1.0, 0.5), 0.7, still())
    face = slice(0, 5)
    own, theirs = figure.keypoints_odom_m[face], worker.keypoints_odom_m[face]
    np.testing.assert_allclose(own - own[0], theirs - theirs[0], atol=1e-6)
    np.testing.assert_allclose(figure.rotation_odom_head, worker.rotation_odom_head, atol=1e-6)
    assert own[0, 2] == pytest.approx(theirs[0, 2], abs=0.04)


@pytest.mark.parametrize("name", list(POSTURES))
def test_every_posture_touches_the_floor_and_turns_with_the_heading(figure, name):
    for seed in range(25):
        posture = random_posture(np.random.default_rng(seed), name)
        figure.place((0.0, 0.0), 0.0, posture)
        first = figure.keypoints_odom_m.copy()
        assert 0.0 <= first[:, 2].min() < 0.13
        turned = random_posture(np.random.default_rng(seed), name)
        figure.place((2.0, -1.0), 1.1, turned)
        turn = Rotation.from_rotvec([0.0, 0.0, 1.1])
        np.testing.assert_allclose(
            figure.keypoints_odom_m - [2.0, -1.0, 0.0], turn.apply(first), atol=1e-9
        )
        assert np.linalg.det(figure.rotation_odom_head) == pytest.approx(1.0)


@pytest.mark.parametrize("name", list(POSTURES))
def test_the_head_of_every_posture_looks_where_its_face_points(figure, name):
    """The face's keypoints, taken into the head frame, are the same as in any other posture."""
    figure.place((0.0, 0.0), 0.0, still())
    rest = (figure.keypoints_odom_m[:5] - figure.keypoints_odom_m[0]) @ figure.rotation_odom_head
    template = HEAD_TEMPLATE_M - HEAD_TEMPLATE_M[0]
    assert np.abs(rest - template).max() < 0.06
    for seed in range(10):
        figure.place((0.0, 0.0), 0.4, random_posture(np.random.default_rng(seed), name))
        face = figure.keypoints_odom_m[:5] - figure.keypoints_odom_m[0]
        np.testing.assert_allclose(face @ figure.rotation_odom_head, rest, atol=0.004)


def test_postures_look_like_their_names(figure):
    def measured(name):
        rows = []
        for seed in range(40):
            figure.place((0.0, 0.0), 0.0, random_posture(np.random.default_rng(seed), name))
            points = figure.keypoints_odom_m
            hips = points[[LEFT_HIP, RIGHT_HIP]].mean(axis=0)
            trunk = points[[LEFT_SHOULDER, RIGHT_SHOULDER]].mean(axis=0) - hips
            lean = math.degrees(math.atan2(trunk[0], trunk[2]))
            rows.append([hips[2], lean, points[[13, 14], 2].min()])
        return np.array(rows)

    standing, bent, sitting = measured("standing"), measured("bent"), measured("sitting")
    kneeling, crouching = measured("kneeling"), measured("crouching")
    assert standing[:, 0].min() > 0.7
    assert np.abs(standing[:, 1]).max() < 35.0
    assert bent[:, 1].min() > 20.0
    assert bent[:, 1].max() > 75.0
    assert np.median(sitting[:, 0]) == pytest.approx(0.5, abs=0.12)
    assert (kneeling[:, 2] < 0.1).mean() > 0.9
    assert crouching[:, 0].max() < 0.62


def test_a_training_scene_draws_people_in_their_boxes_and_is_repeatable():
    config = RenderConfig(
        frames=10, scenes=1, people=3, width_px=320, height_px=240, layouts=("open",)
    )
    shots = []
    for _ in range(2):
        with TrainingScene(config, 0, np.random.default_rng(5)) as scene:
            rng = np.random.default_rng(9)
            names = set()
            for _ in range(6):
                pose = scene.arrange(rng)
                for person in scene.people:
                    if isinstance(person, Figure) and person.posture is not None:
                        names.add(person.posture.name)
            view = scene.hall.renderer.render(scene.hall.camera, pose)
            shots.append((pose, view.rgb, sorted(names), len(scene.people)))
            scene.clear()
            assert not scene.people
    np.testing.assert_array_equal(shots[0][0], shots[1][0])
    assert np.array_equal(shots[0][1], shots[1][1])
    assert shots[0][2] == shots[1][2]
    assert len(shots[0][2]) >= 2
    assert 1 <= shots[0][3] <= 3


# --- backgrounds and looks ------------------------------------------------------------------------


@pytest.mark.parametrize("make", [random_texture, random_background])
def test_pictures_have_the_size_asked_and_the_same_seed_gives_the_same(make):
    for size in ((48, 64), (37, 21), (5, 9)):
        first, again, other = (make(np.random.default_rng(seed), size) for seed in (1, 1, 2))
        assert first.shape == (*size, 3)
        assert first.dtype == np.uint8
        assert np.array_equal(first, again)
        assert not np.array_equal(first, other)


def test_a_store_of_backgrounds_is_repeatable_and_seeds_do_not_share_pictures():
    first, again, other = Backgrounds(3, 5), Backgrounds(3, 5), Backgrounds(3, 6)
    draws = [store.random(np.random.default_rng(0)) for store in (first, again, other)]
    assert np.array_equal(draws[0], draws[1])
    assert not np.array_equal(draws[0], draws[2])
    rng = np.random.default_rng(1)
    taken = [first.sometimes(rng, 0.3) is not None for _ in range(500)]
    assert 0.22 < np.mean(taken) < 0.38
    with pytest.raises(ValueError, match="at least 1, got 0"):
        Backgrounds(0, 1)


@pytest.mark.parametrize("level", [1, 2])
def test_parts_of_a_texture_are_those_of_the_body(level):
    parts = parts_of_texture("amina", level)
    mesh = load_worker("amina").levels[level]
    height, width = parts.shape
    uv = mesh.uv[mesh.triangles].mean(axis=1)
    rows = np.clip(((1.0 - uv[:, 1]) * height).astype(int), 0, height - 1)
    columns = np.clip((uv[:, 0] * width).astype(int), 0, width - 1)
    z = mesh.vertices_m[mesh.triangles].mean(axis=1)[:, 2]
    at = parts[rows, columns]
    top = z.max()
    assert (at[z > 0.93 * top] == HEAD).mean() > 0.95
    assert (at[z < 0.04 * top] == FEET).mean() > 0.9
    assert set(np.unique(at)) == {HEAD, HANDS, UPPER, LOWER, FEET}
    knee = load_worker("amina").joints_m[JOINTS.index("left_knee"), 2]
    assert (at[np.abs(z - knee) < 0.03] == LOWER).mean() > 0.9
