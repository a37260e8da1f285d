"""OpenGL without a window draws the same pictures as the software renderer, to the pixel."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from camera_poses import level_pose
from picture_actors import CHECKS, Shown, ball, upright_square

from perception import Camera
from sim_tests._errors import SimError
from sim_tests._warehouse import Warehouse
from sim_tests.hall._layout import WarehouseLayout
from sim_tests.hall._lighting import Lighting
from sim_tests.hall._meshes import Mesh, box
from sim_tests.pictures import _visual_backends
from sim_tests.pictures._egl_probe import egl_works
from sim_tests.pictures._renderer import CameraRenderer, RenderedView
from sim_tests.pictures._view import View
from sim_tests.pictures._visuals import Visuals

CAMERA = Camera(320, 240, 270.0, 260.0, 171.3, 110.6)
AHEAD = level_pose((0.0, 0.0, 1.4), 0.05, 0.08)


@pytest.fixture(scope="module", autouse=True)
def _needs_egl() -> None:
    if not egl_works():
        pytest.skip("EGL draws nothing here: install libEGL (Mesa's will do)")


def _actors() -> list[Shown]:
    return [
        ball(0.35, position_m=(2.3, 0.5, 1.1), colour=(0.9, 0.6, 0.2), kind="person"),
        Shown(upright_square(0.4), (3.0, -0.6, 1.2), texture_rgb=CHECKS),
        Shown(box((0.0, 0.0, 0.0), (0.3, 0.5, 1.6)), (4.5, 0.3, 0.8), (0.2, 0.5, 0.9)),
    ]


@pytest.fixture(scope="module")
def halls() -> Iterator[tuple[Warehouse, Warehouse]]:
    layout = WarehouseLayout.crossing()
    with Warehouse(layout) as tiny, Warehouse(layout, renderer="egl") as egl:
        assert (tiny.visuals.renderer, egl.visuals.renderer) == ("tiny", "egl")
        for hall in (tiny, egl):
            for actor in _actors():
                hall.visuals.add_actor(actor)
        yield tiny, egl


def _pair(halls: tuple[Warehouse, Warehouse], *args: object, **light: object) -> list[RenderedView]:
    lighting = Lighting(**light)  # type: ignore[arg-type]
    return [CameraRenderer(hall, lighting=lighting).render(*args) for hall in halls]


# The tests before the first that asks for ``halls`` have EGL to themselves.
@pytest.mark.parametrize("width", [64, 65, 70])
def test_textures_of_any_width_lie_straight(width: int) -> None:
    """Also those of which only a part is used."""
    right, down = np.meshgrid(np.linspace(0.0, 250.0, width), np.linspace(0.0, 250.0, 50))
    picture = np.stack([right, down, 250.0 - right], axis=-1).astype(np.uint8)
    square = upright_square(0.5)
    part = Mesh(
        square.vertices_m, square.normals, square.indices, 0.2 + 0.5 * np.asarray(square.uv)
    )
    view = View.of_rectangle(CAMERA, level_pose((-2.0, 0.0, 0.0), 0.0))
    even = Lighting(ambient=1.0, diffuse=0.0)
    for mesh in (square, part):
        drawings = []
        for renderer in ("tiny", "egl"):
            with Visuals(renderer=renderer) as visuals:  # type: ignore[arg-type]
                visuals.add_static(mesh, texture=visuals.texture(picture))
                drawings.append(visuals.draw(view, even, visuals.prepare(view)).rgb.astype(int))
        # Half a texel's step apart at most, as one of them blends neighbours; at the rim it blends
        # the picture's two ends.
        inside = (drawings[0] != 255).all(axis=2) & (drawings[1] != 255).all(axis=2)
        assert inside.sum() > 10_000
        assert np.quantile(np.abs(drawings[0] - drawings[1])[inside], 0.95) <= 6.0


def test_masks_agree(halls: tuple[Warehouse, Warehouse]) -> None:
    for heading in (0.05, -0.1, 0.2):
        tiny, egl = _pair(halls, CAMERA, level_pose((0.2, 0.1, 1.4), heading, 0.05))
        for number in range(3):
            first, second = tiny.actors == number, egl.actors == number
            assert first.any()
            assert (first & second).sum() / (first | second).sum() >= 0.98
            # No shift of even a few hundredths of a pixel between the two.
            offset = np.argwhere(first).mean(axis=0) - np.argwhere(second).mean(axis=0)
            assert np.abs(offset).max() < 0.05


def test_depth_agrees(halls: tuple[Warehouse, Warehouse]) -> None:
    tiny, egl = _pair(halls, CAMERA, AHEAD)
    same = tiny.body_ids == egl.body_ids
    assert same.mean() > 0.98
    near = same & (tiny.depth_m < 3.5)
    assert near.sum() > 5000
    error = np.abs(tiny.depth_m - egl.depth_m)[near]
    # On a surface seen edge-on a rounded sample is a little deeper.
    assert np.quantile(error, 0.99) < 1e-3


def test_depth_of_a_plane_is_exact(halls: tuple[Warehouse, Warehouse]) -> None:
    # The square with the checks faces the camera, 3 m along odom x.
    T = level_pose((0.0, -0.4, 1.2), 0.0)
    view = CameraRenderer(halls[1]).render(CAMERA, T)
    assert (view.actors == 1).sum() > 1000
    np.testing.assert_allclose(view.depth_m[view.actors == 1], 3.0, atol=1e-3)


@pytest.mark.parametrize(
    "light",
    [
        {},
        {"ambient": 0.3, "diffuse": 0.6, "direction_odom": (-6.0, 5.0, 3.0)},
        {"ambient": 0.4, "diffuse": 0.5, "colour_rgb": (1.0, 0.8, 0.6)},
    ],
)
def test_colours_agree(halls: tuple[Warehouse, Warehouse], light: dict[str, object]) -> None:
    tiny, egl = _pair(halls, CAMERA, AHEAD, **light)
    difference = egl.rgb.astype(int) - tiny.rgb
    # No tint anywhere, and the picture as a whole is as bright.
    assert np.abs(difference.mean(axis=(0, 1))).max() < 3.0
    for number in (0, 2):  # plain colours, differently lit
        inside = (tiny.actors == number) & (egl.actors == number)
        assert np.abs(difference[inside].mean(axis=0)).max() < 6.0
        assert np.abs(np.median(difference[inside], axis=0)).max() <= 4.0
    checks = (tiny.actors == 1) & (egl.actors == 1)
    assert np.abs(np.median(difference[checks], axis=0)).max() <= 4.0


def test_a_rectangle_is_that_part_of_the_whole(halls: tuple[Warehouse, Warehouse]) -> None:
    renderer = CameraRenderer(halls[1])
    whole = renderer.render(CAMERA, AHEAD)
    for u0, v0, u1, v1 in ((100, 40, 220, 200), (0, 0, 77, 33)):
        part = renderer.render(CAMERA, AHEAD, (u0, v0, u1, v1))
        assert (part.body_ids == whole.body_ids[v0:v1, u0:u1]).mean() > 0.97


def test_pictures_larger_than_the_plugins_window_have_no_seams(
    halls: tuple[Warehouse, Warehouse],
) -> None:
    camera = Camera(1300, 900, 1100.0, 1100.0, 650.0, 450.0)
    tiny, egl = _pair(halls, camera, AHEAD)
    assert egl.rgb.shape == (900, 1300, 3)
    same = tiny.body_ids == egl.body_ids
    assert same.mean() > 0.98
    for band in (same[:, 1014:1034], same[758:778]):  # around the tiles' common edges
        assert band.mean() > 0.97


def test_what_is_hidden_is_in_no_buffer(halls: tuple[Warehouse, Warehouse]) -> None:
    renderer = CameraRenderer(halls[1])
    alone = renderer.render(CAMERA, AHEAD, only={0})
    assert set(np.unique(alone.actors)) == {-1, 0}
    assert (alone.rgb[alone.actors < 0] == 255).all()
    assert np.isinf(alone.depth_m[alone.actors < 0]).all()
    again = renderer.render(CAMERA, AHEAD)
    assert set(np.unique(again.actors)) == {-1, 0, 1, 2}


def test_one_egl_world_at_a_time_and_auto_falls_back(
    halls: tuple[Warehouse, Warehouse], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_visual_backends, "gl_works", lambda: False)
    assert halls[1].visuals.renderer == "egl"
    with pytest.raises(SimError, match="one world with EGL at a time"):
        Visuals(renderer="egl")
    with Visuals(renderer="auto") as other:
        assert other.renderer == "tiny"
    # The refusals have not disturbed the world that is open.
    assert (CameraRenderer(halls[1]).render(CAMERA, AHEAD).actors == 0).any()


def test_where_egl_does_not_draw_it_is_refused_and_auto_is_tiny(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_visual_backends, "gl_works", lambda: False)
    monkeypatch.setattr(_visual_backends, "egl_works", lambda: False)
    monkeypatch.setattr(_visual_backends.EglBackend, "in_use", False)
    with pytest.raises(SimError, match="libEGL"):
        Visuals(renderer="egl")
    with Visuals(renderer="auto") as visuals:
        assert visuals.renderer == "tiny"


def test_egl_is_silent_starts_again_and_leaves_no_files(tmp_path: Path) -> None:
    program = (
        "import numpy as np\n"
        "from sim_tests.pictures._visuals import Visuals\n"
        "from sim_tests.pictures._view import View\n"
        "from sim_tests.hall._lighting import Lighting\n"
        "from sim_tests.hall._meshes import box\n"
        "from perception import Camera\n"
        "view = View.of_rectangle(Camera(64, 48, 60.0, 60.0, 31.5, 23.5), np.eye(4))\n"
        "for _ in range(2):\n"
        "    with Visuals(renderer='egl') as visuals:\n"
        "        visuals.add_static(box((0.0, 0.0, 2.0), (0.5, 0.5, 0.5)), (0.9, 0.2, 0.2))\n"
        "        visuals.texture(np.zeros((4, 4, 3), np.uint8))\n"
        "        least = visuals.prepare(view)\n"
        "        assert (visuals.draw(view, Lighting(), least).body_ids == 0).sum() > 100\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=False,
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
            "TMPDIR": str(tmp_path),
        },
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert list(tmp_path.iterdir()) == []


def test_the_length_of_the_lights_direction_does_not_matter(
    halls: tuple[Warehouse, Warehouse],
) -> None:
    near, far = ((-3e-3, 4e-3, 8e-3), (-3e3, 4e3, 8e3))
    for one, other in zip(
        _pair(halls, CAMERA, AHEAD, direction_odom=near),
        _pair(halls, CAMERA, AHEAD, direction_odom=far),
        strict=True,
    ):
        np.testing.assert_array_equal(one.rgb, other.rgb)
