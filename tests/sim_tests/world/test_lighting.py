"""Lighting presets are valid and distinct, and images follow their formula."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from perception import Camera
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.hall import LIGHTINGS, Lighting, Mesh, WarehouseLayout, quad

_COLOUR = np.array([0.7, 0.5, 0.3])
# A level camera at eye height that looks along odom y.
_T_ODOM_CAMERA = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 1.4], [0.0, 0.0, 0.0, 1.0]]
)


@pytest.fixture(scope="module")
def hall_with_face() -> Iterator[tuple[Warehouse, Mesh]]:
    """Return a hall with a tilted face in front of the camera, and the face."""
    tilt = 0.4
    up = np.array([0.0, np.sin(tilt), np.cos(tilt)])
    centre, side = np.array([0.0, 2.0, 1.4]), np.array([0.5, 0.0, 0.0])
    corners = [centre - side - up, centre + side - up, centre + side + up, centre - side + up]
    face = quad([tuple(corner) for corner in corners])
    with Warehouse(WarehouseLayout.named("open")) as warehouse:
        warehouse.visuals.add_static(face, tuple(_COLOUR.tolist()))
        yield warehouse, face


@pytest.mark.parametrize("name", LIGHTINGS)
def test_a_lit_face_has_the_colour_of_the_formula(hall_with_face, name) -> None:
    hall, face = hall_with_face
    light = Lighting.preset(name)
    view = CameraRenderer(hall, lighting=light, shadows=False).render(
        Camera.from_fov(32, 24, 0.3), _T_ODOM_CAMERA
    )
    towards = np.asarray(light.direction_odom) / np.linalg.norm(light.direction_odom)
    cosine = max(0.0, float(face.normals[0] @ towards))
    expected = 255.0 * _COLOUR * light.colour_rgb * (light.ambient + light.diffuse * cosine)
    np.testing.assert_allclose(view.rgb[12, 16], expected, atol=3.0)
