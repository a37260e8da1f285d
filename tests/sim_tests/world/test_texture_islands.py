"""A texture cut to what a mesh uses looks the same on it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_tests.world.hall import WarehouseLayout, scenery, scenery_texture
from sim_tests.world.render._backend_tiny import cut_texture


def _colours(uv: np.ndarray, texture: np.ndarray) -> np.ndarray:
    """Return the texel that each coordinate (N, 2) falls on."""
    height, width = texture.shape[:2]
    column = np.clip((uv[:, 0] * width).astype(int), 0, width - 1)
    row = np.clip(((1.0 - uv[:, 1]) * height).astype(int), 0, height - 1)
    return texture[row, column]


def _inside(uv: np.ndarray, indices: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return twenty points in every triangle, away from its edges."""
    weights = rng.dirichlet((2.0, 2.0, 2.0), (len(indices) // 3, 20))
    return np.einsum("tpk,tkc->tpc", weights, uv[indices.reshape(-1, 3)]).reshape(-1, 2)


def _same_look(
    uv: np.ndarray, indices: np.ndarray, texture: np.ndarray
) -> tuple[float, np.ndarray]:
    """Return the share of points with the same colour before and after, and the cut texture."""
    cut_uv, cut = cut_texture(uv, indices, texture)
    before = _colours(_inside(uv, indices, np.random.default_rng(0)), texture)
    after = _colours(_inside(cut_uv, indices, np.random.default_rng(0)), cut)
    return float((before == after).all(axis=1).mean()), cut


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 30), st.floats(0.01, 0.3), st.integers(3, 90), st.integers(3, 90), st.integers(0)
)
def test_scattered_triangles_keep_their_colours(
    triangles: int, extent: float, height: int, width: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    texture = rng.integers(0, 256, (height, width, 3)).astype(np.uint8)
    centres = rng.uniform(extent, 1.0 - extent, (triangles, 1, 2))
    uv = centres + rng.uniform(-extent, extent, (triangles, 3, 2))
    share, cut = _same_look(uv.reshape(-1, 2), np.arange(3 * triangles), texture)
    # A point on the border of two texels may round to either.
    assert share > 0.999
    assert cut.size <= texture.size


@pytest.mark.parametrize(
    "uv", [[(0.0, 0.0), (3.0, 0.0), (0.0, 3.0)], [(-0.1, 0.0), (0.2, 0.0), (0.0, 0.2)]]
)
def test_a_repeated_texture_is_left_alone(uv: list[tuple[float, float]]) -> None:
    texture = np.zeros((50, 50, 3), np.uint8)
    coordinates = np.array(uv)
    same_uv, same = cut_texture(coordinates, np.array((0, 1, 2)), texture)
    assert same is texture
    assert same_uv is coordinates


def test_racks_look_the_same_with_a_part_of_the_texture() -> None:
    sizes = []
    for chunk in scenery(WarehouseLayout.named("crossing")):
        if chunk.texture is not None and chunk.texture.startswith("goods"):
            texture = scenery_texture(chunk.texture)
            share, cut = _same_look(chunk.mesh.uv, chunk.mesh.indices.ravel(), texture)
            assert share > 0.999
            sizes.append(cut.size / texture.size)
    assert len(sizes) > 10
    assert np.mean(sizes) < 0.6
