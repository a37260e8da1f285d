"""Drawing with OpenGL without a window, through PyBullet's EGL plugin; Mesa's software EGL will do.

What the plugin does differently from the software renderer, and what is done about it here:

* It takes meshes from files only (vertices make it crash) and textures from their materials only.
* It cannot hide a body from the segmentation: a hidden body is moved far below the floor.
* It draws at most 1024 × 768 samples: larger views are drawn in tiles.
* Its depth buffer may have 16 bits: the near plane is moved out as far as the view allows.
* Its shader has a light of its own, with a highlight. Two pictures lit from opposite sides give
  each sample's albedo and n·l, from which the light asked for is computed.
* A second world in one process draws nothing: there is one at a time.
"""

from __future__ import annotations

import importlib.util
import tempfile
from pathlib import Path
from typing import ClassVar, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from .._bullet import muted, pybullet
from .._errors import SimError
from ..hall._lighting import Lighting
from ..hall._meshes import Mesh
from ._view import View
from ._visual_backend import BACKGROUND_RGB, BackendName, Drawing
from ._visual_backend_tiny import write_picture

_PLUGIN: Final = "eglRenderer"
_ROW_TEXELS: Final = 4
_MAX_WIDTH: Final = 1024
_MAX_HEIGHT: Final = 768
# The near plane lies this much before the nearest thing that may be seen.
_NEAR_SHARE: Final = 0.95
# Beyond this nearest distance a farther near plane makes depth no better that matters.
_NEAR_MOST_M: Final = 4.0
_UNDERGROUND_M: Final = -1.0e4
# The plugin's shader multiplies the albedo by 0.75 + 0.25 x where a surface faces the lamp (plus a
# highlight) and by 0.675 − 0.175 x where it faces away; x is |n·l|.
_LIT: Final = (0.75, 0.25)
_BACKLIT: Final = (0.675, -0.175)


class EglBackend:
    """See :class:`PictureBackend`.

    Raises:
        SimError: when the plugin does not load, or another such world is open in this process.
    """

    name: BackendName = "egl"
    shares_textures = False
    in_use: ClassVar[bool] = False

    def __init__(self) -> None:
        self.client = -1
        if EglBackend.in_use:
            raise SimError(
                "PyBullet draws only one world with EGL at a time; close the other warehouse "
                "first, or use renderer='tiny' or 'auto'"
            )
        spec = importlib.util.find_spec(_PLUGIN)
        if spec is None or spec.origin is None:
            raise SimError("this PyBullet comes without its EGL plugin; use renderer='tiny'")
        client: int = pybullet.connect(pybullet.DIRECT)
        if client < 0:
            raise SimError("PyBullet could not start another picture world")
        with muted():
            plugin = pybullet.loadPlugin(spec.origin, f"_{_PLUGIN}Plugin", physicsClientId=client)
        if plugin < 0:
            pybullet.disconnect(physicsClientId=client)
            raise SimError("PyBullet's EGL plugin did not start; use renderer='tiny'")
        EglBackend.in_use = True
        self.client = client
        self._folder = tempfile.TemporaryDirectory(prefix="awarenav-")
        self._files = 0
        self._textures: list[Path] = []
        self._poses: dict[int, tuple[tuple[float, ...], tuple[float, ...]]] = {}

    def close(self) -> None:
        """End the client and remove its files."""
        if self.client >= 0:
            with muted():
                pybullet.disconnect(physicsClientId=self.client)
            self.client = -1
            self._folder.cleanup()
            EglBackend.in_use = False

    def texture(self, rgb: NDArray[np.uint8]) -> int:
        """Write a picture (H, W, 3) for the materials of later meshes."""
        height, width = rgb.shape[:2]
        if width % _ROW_TEXELS:  # the plugin would shear it
            wider = (width + -width % _ROW_TEXELS, height)
            rgb = np.asarray(cv2.resize(rgb, wider, interpolation=cv2.INTER_NEAREST), np.uint8)
        self._textures.append(write_picture(self._new_file(".bmp"), rgb))
        return len(self._textures) - 1

    def shape(self, mesh: Mesh, colour: tuple[float, float, float], texture: int | None) -> int:
        """Register a visual shape with its texture."""
        path = self._new_file(".obj")
        material = ["newmtl m", "Kd 1 1 1", "Ks 0 0 0"]
        if texture is not None:
            material.append(f"map_Kd {self._textures[texture].name}")
        path.with_suffix(".mtl").write_text("\n".join(material) + "\n", encoding="ascii")
        path.write_text(_wavefront(mesh, path.with_suffix(".mtl").name), encoding="ascii")
        with muted():
            return int(
                pybullet.createVisualShape(
                    pybullet.GEOM_MESH,
                    fileName=str(path),
                    rgbaColor=[*colour, 1.0],
                    specularColor=[0.0, 0.0, 0.0],
                    physicsClientId=self.client,
                )
            )

    def dress(self, body: int, link: int, shape: int, texture: int | None) -> None:
        """Do nothing: the shape's material has the texture already."""

    def hide(self, body: int) -> None:
        """Move a body far below the floor."""
        if body not in self._poses:
            position, turn = pybullet.getBasePositionAndOrientation(
                body, physicsClientId=self.client
            )
            self._poses[body] = position, turn
            self._put(body, (position[0], position[1], _UNDERGROUND_M), turn)

    def reveal(self, body: int) -> None:
        """Move a body back to where it was hidden."""
        pose = self._poses.pop(body, None)
        if pose is not None:
            self._put(body, *pose)

    def _put(self, body: int, position_m: tuple[float, ...], turn: tuple[float, ...]) -> None:
        pybullet.resetBasePositionAndOrientation(
            body, position_m, turn, physicsClientId=self.client
        )

    def draw(self, view: View, light: Lighting, least_depth_m: float) -> Drawing:
        """Draw the view as if the light were white, in tiles of the plugin's window."""
        near_m = min(max(view.near_m, _NEAR_SHARE * least_depth_m), _NEAR_MOST_M)
        near_m = max(view.near_m, min(near_m, 0.5 * view.far_m))
        shape = view.height, view.width
        out = Drawing(np.empty((*shape, 3), np.uint8), np.empty(shape), np.empty(shape, np.int32))
        for rows, columns, tile in view.tiles(_MAX_WIDTH, _MAX_HEIGHT):
            piece = self._draw_tile(tile, light, near_m)
            out.rgb[rows, columns] = piece.rgb
            out.depth_m[rows, columns] = piece.depth_m
            out.body_ids[rows, columns] = piece.body_ids
        return out

    def _draw_tile(self, view: View, light: Lighting, near_m: float) -> Drawing:
        towards = np.asarray(light.direction_odom, dtype=np.float64)
        # The shader takes the direction as the lamp's place: far away, the light is parallel.
        lamp = towards * (1.0e6 / float(np.linalg.norm(towards)))
        lit, depth, bodies = self._shoot(view, lamp, near_m)
        backlit, _, _ = self._shoot(view, -lamp, near_m, ids=False)
        nothing = bodies < 0
        lit_sum = lit.sum(axis=2)
        backlit_sum = backlit.sum(axis=2)
        towards_lamp = lit_sum >= backlit_sum
        bright = np.maximum(np.where(towards_lamp, lit_sum, backlit_sum), 1.0)
        ratio = np.where(towards_lamp, backlit_sum, lit_sum) / bright
        incline = (_BACKLIT[0] - _LIT[0] * ratio) / (_LIT[1] * ratio - _BACKLIT[1])
        # Only a highlight makes the bright side brighter than a lamp straight above can: then the
        # other side tells the albedo, else both together, which is less noisy.
        glossy = incline > 1.0
        incline = np.clip(incline, 0.0, 1.0)
        share = _LIT[0] + _BACKLIT[0] + (_LIT[1] + _BACKLIT[1]) * incline
        albedo = np.where(
            glossy[..., None],
            np.minimum(lit, backlit) / sum(_BACKLIT),
            (lit + backlit) / share[..., None],
        )
        facing = np.where(towards_lamp, incline, 0.0)
        rgb = albedo * (light.ambient + light.diffuse * facing)[..., None]
        rgb[nothing] = BACKGROUND_RGB
        depth_m = view.far_m * near_m / (view.far_m - (view.far_m - near_m) * depth)
        depth_m[nothing] = np.inf
        return Drawing(np.clip(rgb + 0.5, 0.0, 255.0).astype(np.uint8), depth_m, bodies)

    def _shoot(
        self,
        view: View,
        lamp_odom_m: FloatArray,
        near_m: float,
        *,
        ids: bool = True,
    ) -> tuple[NDArray[np.float32], FloatArray, NDArray[np.int32]]:
        """One picture (h, w, 3) with its depth buffer and body ids as the plugin gives them."""
        width, height = view.width, view.height
        # The plugin prints a line with some of its pictures.
        with muted(1):
            _, _, rgba, depth, bodies = pybullet.getCameraImage(
                width,
                height,
                view.view_matrix(),
                # It samples in the middle of each cell, as it should.
                view.projection_matrix(near_m=near_m),
                lightDirection=lamp_odom_m.tolist(),
                shadow=0,
                renderer=pybullet.ER_BULLET_HARDWARE_OPENGL,
                flags=0 if ids else pybullet.ER_NO_SEGMENTATION_MASK,
                physicsClientId=self.client,
            )
        return (
            np.asarray(rgba, dtype=np.uint8).reshape(height, width, 4)[..., :3].astype(np.float32),
            np.asarray(depth, dtype=np.float64).reshape(height, width),
            np.asarray(bodies, dtype=np.int32).reshape(height, width),
        )

    def _new_file(self, suffix: str) -> Path:
        self._files += 1
        return Path(self._folder.name) / f"{self._files:05d}{suffix}"


def _wavefront(mesh: Mesh, material_file: str) -> str:
    """The mesh in Wavefront's format."""
    uv = np.zeros((len(mesh.vertices_m), 2)) if mesh.uv is None else mesh.uv
    lines = [f"mtllib {material_file}"]
    lines += ["v {:.6f} {:.6f} {:.6f}".format(*row) for row in mesh.vertices_m.tolist()]
    lines += ["vt {:.6f} {:.6f}".format(*row) for row in uv.tolist()]
    lines += ["vn {:.5f} {:.5f} {:.5f}".format(*row) for row in mesh.normals.tolist()]
    lines.append("usemtl m")
    lines += [
        "f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2}".format(*row)
        for row in (mesh.indices.reshape(-1, 3) + 1).tolist()
    ]
    return "\n".join(lines) + "\n"
