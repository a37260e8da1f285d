"""A shadow lies on the floor where the lamp's rays put it, darkened by the missing light."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from camera_poses import level_pose, pixel_rays
from visual_actors import ball

from perception import Camera
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.hall import Lighting, WarehouseLayout
from sim_tests.world.render import gl_works

CAMERA = Camera(240, 180, 160.0, 160.0, 119.5, 89.5)
ABOVE = level_pose((0.5, 0.0, 4.5), 0.0, 0.5 * math.pi - 1e-3)  # looks straight down
LAMPS = [(0.4, -0.9, 1.5), (-1.0, 0.6, 2.0)]
RADIUS_M = 0.3


@pytest.fixture(scope="module", params=["tiny", "gl"])
def hall_with_ball(request: pytest.FixtureRequest) -> Iterator[tuple[Warehouse, int]]:
    """Return a hall with a ball at (0.4, 0.1, 0.8), and the ball's number."""
    if request.param == "gl" and not gl_works():
        pytest.skip("no OpenGL here: install moderngl and libEGL (Mesa's will do)")
    with Warehouse(WarehouseLayout.named("open"), renderer=request.param) as hall:
        yield hall, hall.visuals.add_actor(ball(RADIUS_M, position_m=(0.4, 0.1, 0.8)))


def _loss(hall: Warehouse, light: Lighting, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the share of the light that each pixel loses, and the actors."""
    lit = CameraRenderer(hall, lighting=light, shadows=False).render(CAMERA, pose)
    shaded = CameraRenderer(hall, lighting=light, shadows=True).render(CAMERA, pose)
    np.testing.assert_array_equal(lit.depth_m, shaded.depth_m)
    np.testing.assert_array_equal(lit.actors, shaded.actors)
    return 1.0 - shaded.rgb.sum(axis=2) / lit.rgb.sum(axis=2).astype(float), lit.actors


@pytest.mark.parametrize("direction", LAMPS)
def test_the_shadow_of_a_ball_is_where_the_rays_put_it(hall_with_ball, direction) -> None:
    hall, number = hall_with_ball
    light = Lighting(ambient=0.3, diffuse=0.6, direction_odom=direction)
    centre = np.array([0.4, 0.1, 0.8])
    loss, actors = _loss(hall, light, ABOVE)
    towards = np.array(direction) / np.linalg.norm(direction)
    spot = centre - towards * centre[2] / towards[2]
    # The floor under each pixel, and the distance of its ray to the lamp from the ball's centre.
    rays = pixel_rays(CAMERA) @ ABOVE[:3, :3].T
    floor = ABOVE[:3, 3] - rays * (ABOVE[2, 3] / rays[..., 2:])
    off = floor - spot
    off -= (off @ towards)[..., None] * towards
    distance = np.linalg.norm(off, axis=-1)
    seen = actors != number
    full = 0.6 * towards[2] / (0.3 + 0.6 * towards[2])
    inside, outside = seen & (distance < RADIUS_M - 0.14), seen & (distance > RADIUS_M + 0.14)
    assert outside.sum() > 1000
    assert np.abs(loss[outside]).max() < 1e-9
    assert inside.sum() > 50
    assert np.median(loss[inside]) == pytest.approx(full, abs=0.02)
    assert loss[inside].min() > 0.9 * full
    # Half of the light is missing on the outline itself.
    outline = seen & (np.abs(distance - RADIUS_M) < 0.02)
    assert outline.sum() > 50
    assert loss[outline].mean() == pytest.approx(0.5 * full, abs=0.12 * full)
    assert (loss[actors == number] == 0.0).all()
