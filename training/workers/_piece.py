"""Pieces of a worker: labelled surfaces with the weights of the joints that they follow."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Triangles = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Piece:
    """A surface of one material at rest, in the body frame.

    Attributes:
        label: material, which chooses its paint: "skin", "eye", "shirt", …
        vertices_m: (V, 3).
        triangles: (T, 3), counter-clockwise as seen from outside.
        weights: (V, 16) of the joints.
        canon_m: (V, 3) the same place on the average body, where paint is laid out, so that brows
            and pockets sit right on every body. Pieces off the skin use their own frame.
        detail: (V,) density of the surface after simplification, 1 on average.
        budget: triangles at each level of detail; 0 leaves the piece out.
        lip_m: depth of the inward fold of open edges; 0 leaves them open.
    """

    label: str
    vertices_m: Array
    triangles: Triangles
    weights: Array
    canon_m: Array
    budget: tuple[int, int, int]
    lip_m: float = 0.0

    def normals(self) -> Array:
        """Return unit normals (V, 3): means of the triangles about a vertex, weighted by area."""
        return vertex_normals(self.vertices_m, self.triangles)

    def moved(self, offset_m: Array) -> Piece:
        """Return the same surface with every vertex moved."""
        return replace(self, vertices_m=self.vertices_m + offset_m)


def vertex_normals(vertices_m: Array, triangles: Triangles) -> Array:
    """Return unit normals (V, 3): means of the triangles about a vertex, weighted by area."""
    corners = vertices_m[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros_like(vertices_m)
    for corner in range(3):
        np.add.at(total, triangles[:, corner], area)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)


def smoothstep(value: Array, low: float, high: float) -> Array:
    """Return 0 below ``low``, 1 above ``high``, a cubic between; ``low`` may exceed ``high``."""
    share = np.clip((value - low) / (high - low), 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)
