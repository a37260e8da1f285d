"""The renderer "gl" draws the same images as "tiny", with several render worlds at a time."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from camera_poses import level_pose
from visual_actors import CHECKERBOARD, ShapeActor, ball, upright_square

from perception import Camera
from sim_tests import SimError
from sim_tests.actors.body import Worker
from sim_tests.world import Warehouse
from sim_tests.world.bullet import pybullet
from sim_tests.world.camera import CameraRenderer, RenderedView
from sim_tests.world.hall import Lighting, Mesh, WarehouseLayout, box
from sim_tests.world.render import RenderView, Visuals, gl_works

CAMERA = Camera(320, 240, 270.0, 260.0, 171.3, 110.6)
AHEAD = level_pose((0.0, 0.0, 1.4), 0.05, 0.08)


@pytest.fixture(scope="module", autouse=True)
def _needs_gl() -> None:
    if not gl_works():
        pytest.skip("no OpenGL here: install moderngl and libEGL (Mesa's will do)")


@pytest.fixture(scope="module")
def halls() -> Iterator[tuple[Warehouse, Warehouse]]:
    layout = WarehouseLayout.named("crossing")
    with Warehouse(layout) as tiny, Warehouse(layout, renderer="gl") as opengl:
        assert (tiny.visuals.renderer, opengl.visuals.renderer) == ("tiny", "gl")
        for hall in (tiny, opengl):
            for actor in (
                ball(0.35, position_m=(2.3, 0.5, 1.1), colour=(0.9, 0.6, 0.2), kind="person"),
                ShapeActor(upright_square(0.4), (3.0, -0.6, 1.2), texture_rgb=CHECKERBOARD),
                ShapeActor(box((0.0, 0.0, 0.0), (0.3, 0.5, 1.6)), (4.5, 0.3, 0.8), (0.2, 0.5, 0.9)),
            ):
                hall.visuals.add_actor(actor)
            Worker(hall, 1.75, position_odom_m=(3.4, 0.2), heading_odom_rad=2.5)
        yield tiny, opengl


def _pair(halls: tuple[Warehouse, Warehouse], *args: object, **light: object) -> list[RenderedView]:
    lighting = Lighting(**light)  # type: ignore[arg-type]
    return [CameraRenderer(hall, lighting=lighting).render(*args) for hall in halls]


@pytest.mark.parametrize("heading", [0.05, -0.1])
def test_bodies_and_depth_agree(halls: tuple[Warehouse, Warehouse], heading: float) -> None:
    tiny, opengl = _pair(halls, CAMERA, level_pose((0.2, 0.1, 1.4), heading, 0.05))
    same = tiny.body_ids == opengl.body_ids
    assert same.mean() > 0.99
    for number in np.unique(tiny.actors):
        first, second = tiny.actors == number, opengl.actors == number
        assert (first & second).sum() / (first | second).sum() >= 0.98
        if first.sum() > 1000:  # the two are not shifted by even a few hundredths of a pixel
            offset = np.argwhere(first).mean(axis=0) - np.argwhere(second).mean(axis=0)
            assert np.abs(offset).max() < 0.05
    np.testing.assert_array_equal(np.isinf(tiny.depth_m), tiny.body_ids < 0)
    np.testing.assert_array_equal(np.isinf(opengl.depth_m), opengl.body_ids < 0)
    error = np.abs(tiny.depth_m - opengl.depth_m)[same & (tiny.depth_m < 8.0)]
    assert np.quantile(error, 0.99) < 2e-3


def test_depth_of_a_plane_is_exact(halls: tuple[Warehouse, Warehouse]) -> None:
    view = CameraRenderer(halls[1]).render(CAMERA, level_pose((0.0, -0.6, 1.2), 0.0))
    assert (view.actors == 1).sum() > 1000
    np.testing.assert_allclose(view.depth_m[view.actors == 1], 3.0, atol=1e-5)


@pytest.mark.parametrize(
    "light",
    [
        {},
        {"ambient": 0.3, "diffuse": 0.6, "direction_odom": (-6.0, 5.0, 3.0)},
        {"ambient": 0.4, "diffuse": 0.5, "colour_rgb": (1.0, 0.8, 0.6)},
    ],
)
def test_colours_agree(halls: tuple[Warehouse, Warehouse], light: dict[str, object]) -> None:
    tiny, opengl = _pair(halls, CAMERA, AHEAD, **light)
    difference = np.abs(opengl.rgb.astype(int) - tiny.rgb)
    same = tiny.body_ids == opengl.body_ids
    # A texel's edge may fall on either side of a sample; elsewhere only rounding differs.
    assert np.quantile(difference[same], 0.9) <= 2.0
    assert difference.mean() < 3.0


def test_links_are_drawn_where_their_joints_turn_them() -> None:
    view = RenderView.of_rectangle(CAMERA, level_pose((-2.0, 0.0, 0.0), 0.0))
    drawings = []
    for renderer in ("tiny", "gl"):
        with Visuals(renderer=renderer) as visuals:  # type: ignore[arg-type]
            arm = visuals.shape(box((0.0, 0.0, 0.3), (0.1, 0.1, 0.6)), (0.8, 0.3, 0.2))
            body = visuals.add_body(
                visuals.shape(box((0.0, 0.0, 0.0), (0.2, 0.2, 0.2))), (arm,), np.zeros((1, 3))
            )
            pybullet.resetJointStateMultiDof(
                body, 0, [0.38, 0.0, 0.0, 0.92], physicsClientId=visuals.client
            )
            visuals.prepare(view)
            drawings.append(visuals.draw(view, Lighting()))
    tiny, opengl = (drawing.body_ids >= 0 for drawing in drawings)
    assert tiny.sum() > 1000
    assert (tiny & opengl).sum() / (tiny | opengl).sum() > 0.98


def test_worlds_do_not_disturb_each_other_and_can_be_closed_twice() -> None:
    view = RenderView.of_rectangle(CAMERA, level_pose((-2.0, 0.0, 0.0), 0.0))
    first, second = Visuals(renderer="gl"), Visuals(renderer="auto")
    assert second.renderer == "gl"
    first.add_static(box((0.0, 0.0, 0.0), (0.5, 0.5, 0.5)), (0.9, 0.1, 0.1))
    second.prepare(view)
    assert (second.draw(view, Lighting()).body_ids < 0).all()
    second.close()
    second.close()
    first.prepare(view)
    drawn = first.draw(view, Lighting())
    assert (drawn.body_ids == 0).sum() > 1000
    red = drawn.rgb[drawn.body_ids == 0].mean(axis=0)
    assert red[0] > 3.0 * red[1]
    first.close()
    with pytest.raises(SimError, match="closed"):
        first.prepare(view)


@pytest.mark.parametrize("width", [64, 65])
def test_textures_of_any_width_lie_straight(width: int) -> None:
    """A mesh shows the whole texture or a part of it."""
    right, down = np.meshgrid(np.linspace(0.0, 250.0, width), np.linspace(0.0, 250.0, 50))
    texture = np.stack([right, down, 250.0 - right], axis=-1).astype(np.uint8)
    square = upright_square(0.5)
    part = Mesh(
        square.vertices_m, square.normals, square.indices, 0.2 + 0.5 * np.asarray(square.uv)
    )
    view = RenderView.of_rectangle(CAMERA, level_pose((-2.0, 0.0, 0.0), 0.0))
    even = Lighting(ambient=1.0, diffuse=0.0)
    for mesh in (square, part):
        drawings = []
        for renderer in ("tiny", "gl"):
            with Visuals(renderer=renderer) as visuals:  # type: ignore[arg-type]
                visuals.add_static(mesh, texture=visuals.texture(texture))
                visuals.prepare(view)
                drawings.append(visuals.draw(view, even).rgb.astype(int))
        # A sample near a texel's edge may show either neighbour: one step of the ramp apart.
        inside = (drawings[0] != 255).all(axis=2) & (drawings[1] != 255).all(axis=2)
        assert inside.sum() > 10_000
        assert np.quantile(np.abs(drawings[0] - drawings[1])[inside], 0.95) <= 6.0


def test_opengl_is_silent_starts_again_and_leaves_no_files(tmp_path: Path) -> None:
    program = (
        "import numpy as np\n"
        "from sim_tests.world.render import RenderView, Visuals\n"
        "from sim_tests.world.hall import Lighting, box\n"
        "from perception import Camera\n"
        "view = RenderView.of_rectangle(Camera(64, 48, 60.0, 60.0, 31.5, 23.5), np.eye(4))\n"
        "for _ in range(2):\n"
        "    with Visuals(renderer='gl') as visuals:\n"
        "        visuals.add_static(box((0.0, 0.0, 2.0), (0.5, 0.5, 0.5)), (0.9, 0.2, 0.2))\n"
        "        visuals.texture(np.zeros((4, 4, 3), np.uint8))\n"
        "        visuals.prepare(view)\n"
        "        assert (visuals.draw(view, Lighting()).body_ids == 0).sum() > 100\n"
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
