"""The shipped textures and meshes are those that training/hall makes."""

from __future__ import annotations

import json
import math
from importlib import resources

import numpy as np
import pytest

from sim_tests import SimError
from sim_tests.actors.robot import amr_meshes
from sim_tests.world.hall import TEXTURE_NAMES, Mesh, read_meshes, scenery_texture
from training.hall import (
    atlases,
    base_pieces,
    ellipsoid,
    prop_meshes,
    robot_meshes,
    textures,
    tube,
)

HALL = resources.files("sim_tests.world.hall")


def volume_m3(mesh: Mesh) -> float:
    """Return the volume by the divergence theorem; positive if the triangles face outwards."""
    a, b, c = (mesh.vertices_m[mesh.indices.reshape(-1, 3)[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def test_shipped_textures_are_those_that_are_painted() -> None:
    painted = dict(textures())
    assert tuple(painted) == TEXTURE_NAMES
    for name, texture in painted.items():
        shipped = scenery_texture(name)
        assert not shipped.flags.writeable
        # Versions of OpenCV may draw letters and blend edges a little differently.
        assert np.abs(shipped.astype(int) - texture).mean() < 0.5
    with pytest.raises(SimError, match="did you mean 'goods0'"):
        scenery_texture("good0")
    assert json.loads((HALL / "textures" / "atlases.json").read_text("utf-8")) == atlases()


def test_shipped_meshes_are_those_that_are_made() -> None:
    made = {**prop_meshes(), **robot_meshes()}
    shipped = {**read_meshes((HALL / "props.npz").read_bytes()), **amr_meshes()}
    assert made.keys() == shipped.keys()
    for name, mesh in made.items():
        for field in ("vertices_m", "normals", "indices", "uv"):
            ours, theirs = getattr(mesh, field), getattr(shipped[name], field)
            np.testing.assert_allclose(ours, theirs, atol=1e-12)
    assert sum(piece.triangles for piece in base_pieces()) == shipped["base_link"].triangles


def test_volumes_are_those_of_the_solids() -> None:
    # An inscribed prism of n sides has n/2 sin(2π/n) of its circle's r².
    drum = tube([(0, 0, 1.0, 0.3, 0.3), (0, 0, 0.0, 0.3, 0.3)], 20)
    assert volume_m3(drum) == pytest.approx(10 * math.sin(math.tau / 20) * 0.09)
    egg = ellipsoid((1.0, 0.0, 0.0), (0.3, 0.2, 0.1), 40, 30)
    assert volume_m3(egg) == pytest.approx(4.0 / 3.0 * math.pi * 0.006, rel=0.02)
