"""Ellipsoids and tubes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sim_tests.world.hall import Mesh
from training.round_meshes import ellipsoid, tube


def volume_m3(mesh: Mesh) -> float:
    """Return the volume by the divergence theorem; positive if the triangles face outwards."""
    a, b, c = (mesh.vertices_m[mesh.indices.reshape(-1, 3)[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def test_volumes_are_those_of_the_solids() -> None:
    # An inscribed prism of n sides has n/2 sin(2π/n) of its circle's r².
    drum = tube([(0, 0, 1.0, 0.3, 0.3), (0, 0, 0.0, 0.3, 0.3)], 20)
    assert volume_m3(drum) == pytest.approx(10 * math.sin(math.tau / 20) * 0.09)
    egg = ellipsoid((1.0, 0.0, 0.0), (0.3, 0.2, 0.1), 40, 30)
    assert volume_m3(egg) == pytest.approx(4.0 / 3.0 * math.pi * 0.006, rel=0.02)
