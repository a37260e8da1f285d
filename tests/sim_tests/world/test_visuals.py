"""The render world: actors, textures, hidden bodies, renderers, and physics that never changes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from camera_poses import level_pose
from visual_actors import CHECKERBOARD, ShapeActor, ball, upright_square

from perception import Camera
from sim_tests import SimError
from sim_tests.actors.robot import Amr
from sim_tests.world import Warehouse
from sim_tests.world.bullet import pybullet
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.hall import Lighting, Mesh
from sim_tests.world.render import Visuals

CAMERA = Camera(160, 120, 150.0, 150.0, 79.5, 59.5)
AHEAD = level_pose((0.0, 0.0, 1.4), 0.0)


def test_an_actor_is_asked_for_its_bodies_only_while_it_is_in_view(hall, add_actor) -> None:
    actor = ball(position_m=(3.0, 0.0, 1.4))
    number = add_actor(actor)
    renderer = CameraRenderer(hall)
    view = renderer.render(CAMERA, AHEAD)
    assert (view.actors == number).sum() == (view.body_ids == actor.body).sum() > 20
    assert set(np.unique(view.actors)) == {-1, number}
    away = renderer.render(CAMERA, level_pose((0.0, 0.0, 1.4), math.pi))
    assert not (away.actors == number).any()
    renderer.render(CAMERA, level_pose((0.0, 0.0, 1.4), math.pi))
    back = renderer.render(CAMERA, AHEAD)
    np.testing.assert_array_equal(back.rgb, view.rgb)
    # 150 px across a metre at 1 m distance.
    assert actor.shown == [pytest.approx(50.0), pytest.approx(50.0)]


def test_only_shows_silhouettes_through_everything(hall, add_actor) -> None:
    near = ball(0.3, position_m=(2.0, 0.0, 1.4))
    far = ball(0.3, position_m=(4.0, 0.0, 1.4))
    in_the_rack = ball(0.3, position_m=(5.0, 5.9, 1.0))
    first, second, third = (add_actor(actor) for actor in (near, far, in_the_rack))
    renderer = CameraRenderer(hall)
    whole = renderer.render(CAMERA, AHEAD)
    assert not (whole.actors == second).any()  # wholly behind the nearer one
    alone = renderer.render(CAMERA, AHEAD, only={second})
    assert set(np.unique(alone.actors)) == {-1, second}
    assert (alone.actors == second).sum() == pytest.approx(
        math.pi * (0.3 / 4.0 * 150) ** 2, rel=0.05
    )
    # Everything outside the silhouette is infinitely far and white.
    assert np.isinf(alone.depth_m[alone.actors < 0]).all()
    assert (alone.rgb[alone.actors < 0] == 255).all()
    sideways = level_pose((5.0, 0.0, 1.4), 0.5 * math.pi)
    assert (renderer.render(CAMERA, sideways, only={first, third}).actors == third).any()
    np.testing.assert_array_equal(renderer.render(CAMERA, AHEAD).rgb, whole.rgb)


def test_a_texture_lies_as_its_coordinates_say_and_multiplies_the_colour(hall, add_actor) -> None:
    quarters = np.zeros((8, 8, 3), np.uint8)
    quarters[:4, :4], quarters[:4, 4:] = (200, 0, 0), (0, 200, 0)
    quarters[4:, :4], quarters[4:, 4:] = (0, 0, 200), (200, 200, 200)
    even = Lighting(ambient=1.0, diffuse=0.0)
    add_actor(ShapeActor(upright_square(), (2.0, 0.0, 1.4), (1.0, 1.0, 0.5), quarters))
    rgb = CameraRenderer(hall, lighting=even).rgb(CAMERA, AHEAD)
    seen = rgb[[45, 45, 75, 75], [65, 95, 65, 95]].astype(int)
    wanted = [[200, 0, 0], [0, 200, 0], [0, 0, 100], [200, 200, 100]]
    np.testing.assert_allclose(seen, wanted, atol=2)


def test_equal_textures_are_kept_once_and_unusable_ones_are_refused() -> None:
    with Visuals() as visuals:
        first = visuals.texture(CHECKERBOARD.astype(np.uint8))
        assert visuals.texture(CHECKERBOARD.astype(np.uint8).copy()) == first
        assert visuals.texture(np.zeros((32, 32, 3), np.uint8)) != first
        with pytest.raises(SimError, match="uint8"):
            visuals.texture(CHECKERBOARD)
        with pytest.raises(SimError, match="uint8"):
            visuals.texture(np.zeros((8, 8), np.uint8))
        square = upright_square()
        bare = Mesh(square.vertices_m, square.normals, square.indices)
        with pytest.raises(SimError, match="uv"):
            visuals.add_body(bare, texture=first)


def test_rendering_never_changes_the_physics() -> None:
    def drive(look: bool) -> bytes:
        with Warehouse() as hall:
            amr = Amr(hall)
            amr.command(1.0, 0.3)
            bodies = pybullet.getNumBodies(physicsClientId=hall.client)
            for step in range(60):
                if look and step % 20 == 0:
                    hall.visuals.add_actor(ball(position_m=(1.0, 0.0, 0.2)))
                    CameraRenderer(hall).rgb(CAMERA, amr.T_odom_camera)
                amr.advance(hall.physics_dt_s)
                hall.step()
            assert pybullet.getNumBodies(physicsClientId=hall.client) == bodies
            return amr.T_odom_base.tobytes()

    assert drive(True) == drive(False)
