"""Rigid pieces of a skin bend like skin: no part is missing, and no gap opens."""

from __future__ import annotations

import numpy as np
import pytest

from sim_tests.actors.body import JOINTS, load_worker, worker_names
from sim_tests.actors.body._skin import PELVIS, skin_pieces


def keys(corners_uv: np.ndarray) -> list[tuple[float, ...]]:
    """Return an identifier for each triangle: its centre in the texture."""
    return [tuple(row) for row in corners_uv.mean(axis=1).round(9).tolist()]


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
