"""Light set-ups: valid, distinct, and shown by the renderer as their formula says."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from perception import Camera
from sim_tests import SimError
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.hall import LIGHTINGS, Lighting, WarehouseLayout, quad

# A camera at eye level that looks along odom y, without a tilt.
_T_ODOM_CAMERA = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 1.4], [0.0, 0.0, 0.0, 1.0]]
)


def test_there_are_at_least_six_and_no_two_alike() -> None:
    assert len(LIGHTINGS) >= 6
    assert len({repr(lighting) for lighting in LIGHTINGS.values()}) == len(LIGHTINGS)
    assert Lighting.preset("bright_led") == Lighting()
    brightness = {
        name: (light.ambient + light.diffuse) * np.mean(light.colour_rgb)
        for name, light in LIGHTINGS.items()
    }
    assert min(brightness, key=lambda name: brightness[name]) == "night"


@pytest.mark.parametrize("name", LIGHTINGS)
def test_a_lit_face_has_the_colour_of_the_formula(name: str) -> None:
    light = Lighting.preset(name)
    colour = np.array([0.7, 0.5, 0.3])
    tilt = 0.4
    up = np.array([0.0, np.sin(tilt), np.cos(tilt)])
    centre, side = np.array([0.0, 2.0, 1.4]), np.array([0.5, 0.0, 0.0])
    corners = [centre - side - up, centre + side - up, centre + side + up, centre - side + up]
    face = quad([tuple(corner) for corner in corners])
    with Warehouse(WarehouseLayout.open_floor()) as warehouse:
        warehouse.visuals.add_static(face, tuple(colour.tolist()))
        view = CameraRenderer(warehouse, lighting=light, shadows=False).render(
            Camera.from_fov(32, 24, 0.3), _T_ODOM_CAMERA
        )
    towards = np.asarray(light.direction_odom) / np.linalg.norm(light.direction_odom)
    cosine = max(0.0, float(face.normals[0] @ towards))
    expected = 255.0 * colour * light.colour_rgb * (light.ambient + light.diffuse * cosine)
    np.testing.assert_allclose(view.rgb[12, 16], expected, atol=3.0)


def test_unusable_light_is_refused_by_name() -> None:
    with pytest.raises(ValidationError, match="wash out"):
        Lighting(ambient=0.8, diffuse=0.4)
    with pytest.raises(ValidationError, match="direction_odom must point towards the light"):
        Lighting(direction_odom=(0.0, 0.0, 0.0))
    with pytest.raises(ValidationError, match="colour_rgb"):
        Lighting(colour_rgb=(1.2, 1.0, 1.0))
    with pytest.raises(ValidationError, match="did you mean 'ambient'"):
        Lighting(ambiant=0.5)
    with pytest.raises(SimError, match="did you mean 'warm_sodium'"):
        Lighting.preset("warm_sodum")
