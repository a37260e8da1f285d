"""Triangle meshes are closed, face outwards and carry textures upright on their sides."""

from __future__ import annotations

import numpy as np
import pytest

from sim_tests.world.hall import BOX_FACES, Mesh, box, merge, quad


@pytest.mark.parametrize("face", BOX_FACES[:4])
def test_a_texture_stands_upright_on_each_side_of_a_box(face: str) -> None:
    side = box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), {face: (0.25, 0.5, 0.75, 1.0)})
    assert side.uv is not None
    assert side.triangles == 2
    axis, sign = "xyz".index(face[1]), 1.0 if face[0] == "+" else -1.0
    outward = np.zeros(3)
    outward[axis] = sign
    np.testing.assert_array_equal(side.vertices_m[:, axis], 0.5 * sign)
    np.testing.assert_array_equal(side.normals, np.tile(outward, (4, 1)))
    right = np.cross([0.0, 0.0, 1.0], outward)  # to the right, seen from outside
    np.testing.assert_allclose(side.uv[:, 0], 0.5 + 0.5 * side.vertices_m @ right, atol=1e-12)
    np.testing.assert_allclose(side.uv[:, 1], 0.75 + 0.5 * side.vertices_m[:, 2], atol=1e-12)


def test_merging_keeps_every_triangle_and_its_texture() -> None:
    parts = [box((0, 0, 0), (1, 1, 1)), quad([(0, 0, 2), (1, 0, 2), (1, 1, 2), (0, 1, 2)])]
    both = merge(parts)
    assert both.triangles == 14
    assert both.uv is not None
    corners = both.vertices_m[both.indices[-6:]]
    np.testing.assert_array_equal(corners, parts[1].vertices_m[parts[1].indices])
    plain = Mesh(parts[1].vertices_m, parts[1].normals, parts[1].indices)
    assert merge([parts[0], plain]).uv is None
