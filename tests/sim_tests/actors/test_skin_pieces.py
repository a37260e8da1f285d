"""Rigid pieces of a skin bend like skin: no part is missing, and no gap opens."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_tests.actors.body import JOINTS, SkinMesh, load_worker, worker_names
from sim_tests.actors.body._skin import PELVIS, skin_pieces

KNEE = JOINTS.index("left_knee")
HIP = JOINTS.index("left_hip")
RADIUS_M, HALF_M, BLEND_M = 0.06, 0.30, 0.05


def leg(rings: int = 61, sides: int = 16) -> SkinMesh:
    """Return a tube along z whose lower half follows the knee, which lies at the origin."""
    z = np.linspace(HALF_M, -HALF_M, rings)
    around = np.linspace(0.0, 2.0 * math.pi, sides, endpoint=False)
    ring = np.stack([np.cos(around), np.sin(around)], axis=-1)
    vertices = np.concatenate(
        [np.column_stack([RADIUS_M * ring, np.full(sides, height)]) for height in z]
    )
    normals = np.column_stack([np.tile(ring, (rings, 1)), np.zeros(len(vertices))])
    weights = np.zeros((len(vertices), len(JOINTS)))
    weights[:, HIP] = 1.0
    weights[:, KNEE] = np.clip(0.5 - vertices[:, 2] / (2.0 * BLEND_M), 0.0, 1.0)
    triangles = []
    for row in range(rings - 1):
        for side in range(sides):
            a, b = row * sides + side, row * sides + (side + 1) % sides
            triangles += [(a, a + sides, b + sides), (a, b + sides, b)]
    return SkinMesh(
        vertices,
        normals,
        # Every vertex has its own texture coordinate, by which triangles are identified.
        np.random.default_rng(0).random((len(vertices), 2)),
        np.array(triangles),
        weights,
        Path("no texture is drawn"),
    )


def keys(corners_uv: np.ndarray) -> list[tuple[float, ...]]:
    """Return an identifier for each triangle: its centre in the texture."""
    return [tuple(row) for row in corners_uv.mean(axis=1).round(9).tolist()]


def rows_by_texture(corners_uv: np.ndarray) -> dict[tuple[float, ...], int]:
    return {key: row for row, key in enumerate(keys(corners_uv))}


def turned(points: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """Return points rotated about y through the knee, each by its own angle."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = points.T
    return np.stack([cos * x + sin * z, y, cos * z - sin * x], axis=-1)


@given(bands=st.integers(0, 4), angle=st.floats(0.0, math.radians(70.0)))
def test_all_skin_lies_near_a_piece_and_pieces_overlap_where_it_bends(
    bands: int, angle: float
) -> None:
    skin = leg()
    step = 1.0 / (bands + 1)
    centres = skin.vertices_m[skin.triangles].mean(axis=1)
    weight = skin.weights[skin.triangles][..., KNEE].mean(axis=1)
    truth = turned(centres, angle * weight)
    nearest = np.full(len(centres), np.inf)
    cover = np.zeros(len(centres), dtype=int)
    row_of = rows_by_texture(skin.uv[skin.triangles])
    for piece in skin_pieces(skin, bands):
        share = piece.share if piece.joint == KNEE else 0.0
        corners = piece.mesh.indices.reshape(-1, 3)
        rest = piece.mesh.vertices_m[corners].mean(axis=1)
        assert piece.mesh.uv is not None
        rows = np.array([row_of[key] for key in keys(piece.mesh.uv[corners])])
        # A rim sinks inwards, never outwards.
        assert (
            np.linalg.norm(rest[:, :2], axis=1) < np.linalg.norm(centres[rows, :2], axis=1) + 1e-9
        ).all()
        gaps = np.linalg.norm(turned(rest, angle * share) - truth[rows], axis=1)
        nearest[rows] = np.minimum(nearest[rows], gaps)
        cover[rows] += 1
    # One step of rotation at the farthest bending skin, plus the depth of a sunk corner.
    reach = math.hypot(RADIUS_M, BLEND_M)
    assert nearest.max() <= angle * step * reach + 0.007
    assert cover.min() >= 1
    bending = (weight > 0.05) & (weight < 0.95)
    assert (cover[bending] >= 2).all()


@pytest.mark.parametrize("name", worker_names()[:4])
def test_the_pieces_of_a_worker_show_all_its_skin(name: str) -> None:
    for level, skin in enumerate(load_worker(name).levels):
        pieces = skin_pieces(skin, 2)
        shown = {
            key
            for piece in pieces
            for key in keys(np.asarray(piece.mesh.uv)[piece.mesh.indices.reshape(-1, 3)])
        }
        assert shown == set(keys(skin.uv[skin.triangles]))
        joints = {piece.joint for piece in pieces}
        assert PELVIS in joints
        assert level == 2 or joints >= {JOINTS.index("neck"), JOINTS.index("left_eye")}
