"""Small actors for tests of rendering."""

from __future__ import annotations

import numpy as np

from perception.arrays import FloatArray
from sim_tests.world.hall import Mesh, quad
from sim_tests.world.render import RenderView, Visuals
from training.round_meshes import ellipsoid

CHECKERBOARD = np.kron(np.indices((4, 4)).sum(axis=0) % 2, np.ones((8, 8)))[..., None] * np.array(
    [200, 40, 30]
) + np.array([30, 90, 60])


#: A place far below the floor, where no camera sees an actor and no lamp casts its shadow.
AWAY_M = (0.0, 0.0, -50.0)


class ShapeActor:
    """An actor of one shape; it records the levels of detail at which it was shown."""

    kind = "prop"

    def __init__(
        self,
        mesh: Mesh,
        position_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
        colour: tuple[float, float, float] = (1.0, 1.0, 1.0),
        texture_rgb: np.ndarray | None = None,
        kind: str = "prop",
    ) -> None:
        self.mesh = mesh
        self.position_m = np.array(position_m, dtype=float)
        self.kind = kind
        self.shown: list[float] = []
        self.body = -1
        self._colour = colour
        self._texture_rgb = texture_rgb

    def bounds_odom_m(self) -> FloatArray:
        vertices = self.mesh.vertices_m
        return np.array([vertices.min(axis=0), vertices.max(axis=0)]) + self.position_m

    def bodies(
        self, visuals: Visuals, samples_per_m: float, view: RenderView
    ) -> tuple[list[int], FloatArray]:
        self.shown.append(samples_per_m)
        if self.body < 0:
            texture = None
            if self._texture_rgb is not None:
                texture = visuals.texture(self._texture_rgb.astype(np.uint8))
            self.body = visuals.add_body(self.mesh, self._colour, texture)
        T_odom_body = np.eye(4)
        T_odom_body[:3, 3] = self.position_m
        return [self.body], T_odom_body[None]


def ball(radius_m: float = 0.06, **others: object) -> ShapeActor:
    """Return a round actor."""
    mesh = ellipsoid((0.0, 0.0, 0.0), (radius_m,) * 3, sides=24, rings=16)
    return ShapeActor(mesh, **others)  # type: ignore[arg-type]


def upright_square(half_m: float = 0.5) -> Mesh:
    """Return a square across odom x that faces −x, its texture upright."""
    corners = [
        (0.0, half_m, -half_m),
        (0.0, -half_m, -half_m),
        (0.0, -half_m, half_m),
        (0.0, half_m, half_m),
    ]
    flat = quad(corners)
    uv = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    return Mesh(flat.vertices_m, flat.normals, flat.indices, uv)
