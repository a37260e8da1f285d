"""Random things before and behind people: boxes, cylinders, lumps, chairs, and piles of them."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray
from sim_tests.world import Warehouse
from sim_tests.world.hall import Mesh, box, merge
from sim_tests.world.render import RenderView, Visuals
from training.round_meshes import ellipsoid, tube

from ._textures import random_texture

_TEXTURE_PX: Final = 128
_FAR_M: Final = -9.0


class Clutter:
    """A thing with a random shape and texture; the visual actor of a ``"prop"``.

    Args:
        warehouse: the hall.
        mesh: the shape about its own origin.
        rng: draws the texture.

    Attributes:
        kind: ``"prop"``.
        actor: number of the actor.
    """

    kind = "prop"

    def __init__(self, warehouse: Warehouse, mesh: Mesh, rng: np.random.Generator) -> None:
        self._mesh = mesh
        self._texture = random_texture(rng, (_TEXTURE_PX, _TEXTURE_PX))
        self._radius_m = float(np.linalg.norm(mesh.vertices_m, axis=1).max())
        self._outside = np.array([warehouse.layout.x_min_m + _FAR_M, 0.0, 0.0])
        self._body: int | None = None
        self.remove()
        self.actor: int = warehouse.add_actor(self)

    @property
    def radius_m(self) -> float:
        """Radius of a sphere about the origin that holds the shape."""
        return self._radius_m

    def place(self, position_odom_m: Any, rotation: Rotation) -> None:
        """Move the origin of the thing to a point (3,) and turn it."""
        self._position = np.asarray(position_odom_m, dtype=np.float64)
        self._rotation = rotation

    def remove(self) -> None:
        """Move the thing out of the hall."""
        self.place(self._outside, Rotation.identity())

    def bounds_odom_m(self) -> FloatArray:
        """Return (2, 3) the low and high corner of a box that holds the thing."""
        return np.array([self._position - self._radius_m, self._position + self._radius_m])

    def bodies(
        self, visuals: Visuals, samples_per_m: float, view: RenderView
    ) -> tuple[list[int], FloatArray]:
        """Return the body, made when it is first needed, and its pose."""
        if self._body is None:
            self._body = visuals.add_body(self._mesh, texture=visuals.texture(self._texture))
        T_odom_body = np.eye(4)
        T_odom_body[:3, :3] = self._rotation.as_matrix()
        T_odom_body[:3, 3] = self._position
        return [self._body], T_odom_body[None]


def random_thing(rng: np.random.Generator) -> Mesh:
    """Return a random shape, 0.2 to 2 m large, about the middle of its base."""
    kind = rng.random()
    if kind < 0.15:
        return _on_base(random_chair(rng))
    count = 1 if kind < 0.5 else int(rng.integers(2, 7))
    size = float(np.exp(rng.uniform(math.log(0.2), math.log(1.1))))
    parts = []
    for _ in range(count):
        part = _primitive(rng, size)
        turn = Rotation.from_rotvec([0.0, 0.0, rng.uniform(0.0, math.tau)])
        if rng.random() < 0.25:
            turn = Rotation.random(rng=rng)
        away = rng.normal(0.0, 0.45 * size, 3) if count > 1 else np.zeros(3)
        parts.append(part.transformed(turn.as_matrix(), away.tolist()))
    return _on_base(merge(parts))


def random_chair(rng: np.random.Generator) -> Mesh:
    """Return a chair, stool, bench or crate; the top of its seat has z = 0, and it faces x."""
    depth, width = rng.uniform(0.3, 0.55), rng.uniform(0.35, 0.9)
    if rng.random() < 0.35:
        seat = [box((0.0, 0.0, -0.5), (depth, width, 1.0))]
    else:
        thick, leg = rng.uniform(0.02, 0.1), rng.uniform(0.02, 0.06)
        seat = [box((0.0, 0.0, -0.5 * thick), (depth, width, thick))]
        seat += [
            box((0.5 * x * (depth - leg), 0.5 * y * (width - leg), -0.5), (leg, leg, 1.0))
            for x in (-1.0, 1.0)
            for y in (-1.0, 1.0)
        ]
    if rng.random() < 0.5:
        tall = rng.uniform(0.2, 0.6)
        seat.append(box((-0.5 * depth - 0.02, 0.0, 0.5 * tall), (0.04, width, tall)))
    return merge(seat)


def _primitive(rng: np.random.Generator, size_m: float) -> Mesh:
    """Return a box, a cylinder or tapered tube, an ellipsoid or a lump about its middle."""
    extent = size_m * np.exp(rng.normal(0.0, 0.5, 3))
    kind = rng.random()
    if kind < 0.4:
        return box((0.0, 0.0, 0.0), extent.tolist())
    if kind < 0.7:
        count = int(rng.integers(2, 6))
        radii = 0.35 * extent[0] * rng.uniform(0.4, 1.2, (count, 2))
        if rng.random() < 0.5:
            radii[:] = radii[0, 0]
        heights = np.linspace(0.5, -0.5, count) * 1.4 * extent[2]
        rows = [
            (0.0, 0.0, z, a, b) for z, (a, b) in zip(heights.tolist(), radii.tolist(), strict=True)
        ]
        return tube(rows)
    lump = ellipsoid((0.0, 0.0, 0.0), (0.5 * extent).tolist())
    if kind < 0.85:
        return lump
    # Waves of random directions over the surface; equal points move alike, so it stays closed.
    waves = rng.normal(0.0, 4.0 / size_m, (5, 3))
    phases = rng.uniform(0.0, math.tau, 5)
    height = np.sin(lump.vertices_m @ waves.T + phases).sum(axis=1) * 0.08
    return Mesh(lump.vertices_m * (1.0 + height[:, None]), lump.normals, lump.indices, lump.uv)


def _on_base(mesh: Mesh) -> Mesh:
    """Return the shape moved so that its lowest point has z = 0."""
    return mesh.transformed(None, (0.0, 0.0, -float(mesh.vertices_m[:, 2].min())))
