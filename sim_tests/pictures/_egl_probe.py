"""Finds out whether EGL draws right pictures here, in a process of its own since it may crash."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import lru_cache
from typing import Final

import numpy as np

from perception import Camera

from .._bullet import pybullet
from ..hall._lighting import Lighting
from ..hall._meshes import Mesh, quad
from ._view import View
from ._visual_backend_egl import EglBackend
from ._visual_backend_tiny import TinyBackend

_VERDICT: Final = "EGL draws as it should"
_PATIENCE_S: Final = 60.0


@lru_cache(maxsize=1)
def egl_works() -> bool:
    """Whether pictures drawn through EGL are right; found out once a process, in about 2 s."""
    here = os.pathsep.join(entry for entry in sys.path if entry)
    try:
        done = subprocess.run(
            [sys.executable, "-c", f"from {__name__} import probe; probe()"],
            capture_output=True,
            text=True,
            timeout=_PATIENCE_S,
            check=False,
            env={**os.environ, "PYTHONPATH": here},
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0 and _VERDICT in done.stdout


def probe() -> None:
    """Draw two squares, one textured, with both renderers; print the verdict if they agree."""
    flat = quad([(-0.41, -0.31, 0.0), (0.41, -0.31, 0.0), (0.41, 0.31, 0.0), (-0.41, 0.31, 0.0)])
    uv = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    picture = np.zeros((32, 32, 3), np.uint8)
    picture[:16, :16], picture[16:, 16:] = (210, 60, 40), (40, 90, 220)
    T_odom_camera = np.diag([1.0, -1.0, -1.0, 1.0])
    T_odom_camera[:3, 3] = (0.0, 0.0, 2.0)
    view = View.of_rectangle(Camera(64, 48, 50.0, 50.0, 31.5, 23.5), T_odom_camera)
    drawings = []
    for make in (TinyBackend, EglBackend):
        backend = make()
        for shift, colour, image in ((-0.45, (0.8, 0.6, 0.4), None), (0.45, (1.0,) * 3, picture)):
            number = None if image is None else backend.texture(image)
            mesh = Mesh(flat.vertices_m, flat.normals, flat.indices, uv)
            shape = backend.shape(mesh.transformed(None, (shift, 0.0, 0.0)), colour, number)
            body = pybullet.createMultiBody(0.0, -1, shape, physicsClientId=backend.client)
            backend.dress(body, -1, shape, number)
        drawings.append(backend.draw(view, Lighting(), 1.9))
        backend.close()
    tiny, egl = drawings
    same = tiny.body_ids == egl.body_ids
    shown = (tiny.body_ids >= 0) & same
    if (
        same.mean() > 0.98
        and np.abs(tiny.rgb[shown].astype(int) - egl.rgb[shown]).mean() < 8.0
        and np.abs(tiny.depth_m[shown] - egl.depth_m[shown]).max() < 1e-3
    ):
        print(_VERDICT)
