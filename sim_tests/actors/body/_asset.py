"""The shipped workers: skinned meshes, joints and keypoints of a parametric body model.

The NOTICE beside the files says what made them. At rest a body stands upright with hanging arms,
straight knees and a level head. Its frame has x forward, y left, z up and its origin
on the floor below the midpoint of the hips. Joint rotations are written in axes parallel to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from awarenav.errors import not_one_of
from perception.arrays import FloatArray

from ...world.errors import SimError

#: Joints in the order of every array; parents come before their children.
JOINTS: Final = (
    "spine",
    "neck",
    "left_eye",
    "right_eye",
    "left_shoulder",
    "left_elbow",
    "left_wrist",
    "right_shoulder",
    "right_elbow",
    "right_wrist",
    "left_hip",
    "left_knee",
    "left_ankle",
    "right_hip",
    "right_knee",
    "right_ankle",
)
#: Parent of each joint in :data:`JOINTS`, −1 for the pelvis.
PARENTS: Final = (-1, 0, 1, 1, 0, 4, 5, 0, 7, 8, -1, 10, 11, -1, 13, 14)
#: Number of levels of detail; the finest comes first.
DETAIL_LEVELS: Final = 3
#: Unit of the whole numbers in which a file stores each array of a mesh: vertices in metres,
#: normals, texture coordinates and weights as shares of 1.
MESH_UNITS: Final = MappingProxyType(
    {"vertices": 1e-4, "normals": 1.0 / 127.0, "uv": 1.0 / 65535.0, "weights": 1.0 / 255.0}
)


_FOLDER: Final = resources.files("sim_tests.actors.body") / "workers"
# Name of the file with the irises of all workers.
_IRISES: Final = "irises"


@dataclass(frozen=True, eq=False)
class SkinMesh:
    """One level of detail of a body's surface at rest.

    Attributes:
        vertices_m: (V, 3).
        normals: (V, 3) unit.
        uv: (V, 2), (0, 0) at the lower left of the texture.
        triangles: (T, 3) rows of vertices, counter-clockwise as seen from outside.
        weights: (V, 16) in [0, 1]: the share of each joint's rotation that a vertex follows. It is
            1 beyond the joint and between 0 and 1 where the skin bends.
        texture_file: image of the texture.
        irises: rows and columns (2, N) of the texture's texels that show irises, and their (N, 3)
            colours, which replace those of the file; None on the coarser levels, whose people are
            too far away to show any.
    """

    vertices_m: FloatArray
    normals: FloatArray
    uv: FloatArray
    triangles: NDArray[np.int64]
    weights: FloatArray
    texture_file: Path
    irises: tuple[NDArray[np.uint16], NDArray[np.uint8]] | None = None

    @cached_property
    def texture_rgb(self) -> NDArray[np.uint8]:
        """(H, W, 3) texture; read when it is first asked for, since most episodes draw nothing."""
        data = np.frombuffer(self.texture_file.read_bytes(), np.uint8)
        bgr = cv2.imdecode(data, cv2.IMREAD_COLOR)
        rgb = np.ascontiguousarray(np.asarray(bgr, dtype=np.uint8)[..., ::-1])
        if self.irises is not None:
            (rows, columns), colours = self.irises
            rgb[rows, columns] = colours
        return rgb


@dataclass(frozen=True, eq=False)
class Capsule:
    """A collision shape at rest that moves with the body beyond ``joint`` (−1: the pelvis)."""

    joint: int
    start_m: tuple[float, float, float]
    end_m: tuple[float, float, float]
    radius_m: float


@dataclass(frozen=True, eq=False)
class WorkerAsset:
    """A worker as shipped.

    Attributes:
        name: name or file that it was loaded by.
        description: one line on the person's looks.
        stature_m: height with shoes, without hat or helmet.
        joints_m: (16, 3) at rest, in the order of :data:`JOINTS`.
        keypoints_m: (23, 3) at rest by the body model's own definitions: COCO's 17, then big toe,
            small toe and heel of the left and of the right foot.
        keypoint_weights: (23, 16), as :attr:`SkinMesh.weights`.
        capsules: collision shapes.
        levels: surfaces by level of detail, finest first.
    """

    name: str
    description: str
    stature_m: float
    joints_m: FloatArray
    keypoints_m: FloatArray
    keypoint_weights: FloatArray
    capsules: tuple[Capsule, ...]
    levels: tuple[SkinMesh, ...]


def worker_names() -> tuple[str, ...]:
    """Return the names of the shipped workers, sorted."""
    files = (entry.name for entry in _FOLDER.iterdir())
    found = (name.removesuffix(".npz") for name in files if name.endswith(".npz"))
    return tuple(sorted(set(found) - {_IRISES}))


@lru_cache(maxsize=64)
def load_worker(name: str) -> WorkerAsset:
    """Read a shipped worker by name, or one from an ``.npz`` file of the same format.

    Raises:
        SimError: for a name that is not shipped or a file that does not exist.
    """
    path = worker_file(name)
    with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
        arrays = {key: data[key] for key in data.files}
    joints_m = _read_only_copy(arrays["joints_m"])
    levels = tuple(
        _skin_mesh(arrays, level, path.with_name(f"{path.stem}_lod{level}.jpg"))
        for level in range(DETAIL_LEVELS)
    )
    capsules = tuple(
        Capsule(int(joint), tuple(row[:3]), tuple(row[3:6]), row[6])
        for joint, row in zip(
            arrays["capsule_joints"].tolist(), arrays["capsules_m"].tolist(), strict=True
        )
    )
    return WorkerAsset(
        name=name,
        description=str(arrays["description"]),
        stature_m=float(arrays["stature_m"]),
        joints_m=joints_m,
        keypoints_m=_read_only_copy(arrays["keypoints_m"]),
        keypoint_weights=_read_only_copy(arrays["keypoint_weights"]),
        capsules=capsules,
        levels=levels,
    )


@lru_cache(maxsize=64)
def worker_stature_m(name: str) -> float:
    """Return the stature of a worker, without reading the rest."""
    with worker_file(name).open("rb") as file, np.load(file, allow_pickle=False) as data:
        return float(data["stature_m"])


def worker_file(name: str) -> Path:
    """Return the file of a shipped worker, or the .npz file of that name; SimError for neither."""
    if name.endswith(".npz"):
        if not Path(name).is_file():
            raise SimError(f"there is no file {name}")
        return Path(name)
    if name not in worker_names():
        raise SimError(not_one_of("worker", name, worker_names(), or_else="an .npz file"))
    return Path(str(_FOLDER)) / f"{name}.npz"


@lru_cache(maxsize=64)
def _irises(name: str) -> tuple[NDArray[np.uint16], NDArray[np.uint8]] | None:
    """Return the irises of a shipped worker, see :class:`SkinMesh`; None for others.

    The body model's eyeballs are larger than human ones, and so are the irises on the textures,
    which fill the gap between the lids. These have the 11.7 mm of human ones.
    """
    with (_FOLDER / f"{_IRISES}.npz").open("rb") as file, np.load(file, allow_pickle=False) as data:
        if f"{name}_texels" not in data:
            return None
        return data[f"{name}_texels"], data[f"{name}_rgb"]


def _skin_mesh(arrays: dict[str, NDArray[np.generic]], level: int, texture: Path) -> SkinMesh:
    """Undo the quantisation of one level of detail."""

    def dequantised(key: str) -> FloatArray:
        stored = arrays[f"lod{level}_{key}"].astype(np.float64)
        return _read_only_copy(stored * MESH_UNITS[key])

    normals = dequantised("normals")
    lengths = np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    return SkinMesh(
        vertices_m=dequantised("vertices"),
        normals=_read_only_copy(normals / lengths),
        uv=dequantised("uv"),
        triangles=arrays[f"lod{level}_triangles"].astype(np.int64),
        weights=dequantised("weights"),
        texture_file=texture,
        irises=_irises(texture.name.split("_")[0]) if level == 0 else None,
    )


def _read_only_copy(array: NDArray[np.generic]) -> FloatArray:
    out = np.array(array, dtype=np.float64)
    out.setflags(write=False)
    return out
