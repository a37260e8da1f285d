"""More shapes of heads than bodies: copies of random workers with other heads.

A body is expensive to make, and a network that has seen few heads reads the shape of a new one as a
turn of it. A copy has its head warped by a smooth field, symmetric in left and right, so that the
head still looks along its own x axis. Joints, keypoints and stature move with the skin.

Depth, width and height vary by 4 % (1 standard deviation), and the surface by 2.5 mm over lengths
of 45 mm. Both are judgements, about the spread of adults' heads.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray
from sim_tests.actors.body import DETAIL_LEVELS, JOINTS, MESH_UNITS

_SCALE_STD: Final = 0.04
_FIELD_STD_M: Final = 2.5e-3
_FIELD_LENGTH_M: Final = 0.045
_WAVES: Final = 48
_NECK: Final = JOINTS.index("neck")
_EYES: Final = [JOINTS.index("left_eye"), JOINTS.index("right_eye")]
_STEP_M: Final = 1e-4


@dataclass(frozen=True, eq=False)
class HeadWarp:
    """A smooth displacement of points about a neck, symmetric in y.

    Attributes:
        neck_m: (3,) joint that the scales leave in its place.
        scales: (3,) factors of depth, width and height.
        waves: (K, 3) wave vectors of the field, rad/m.
        phases: (K, 3) phases of each component.
        amplitude_m: amplitude of each wave.
    """

    neck_m: FloatArray
    scales: FloatArray
    waves: FloatArray
    phases: FloatArray
    amplitude_m: float

    @classmethod
    def random(cls, neck_m: FloatArray, rng: np.random.Generator) -> HeadWarp:
        """Draw a warp: scales, and a Gaussian field by random Fourier features."""
        return cls(
            neck_m,
            1.0 + _SCALE_STD * np.clip(rng.normal(size=3), -2.5, 2.5),
            rng.normal(0.0, 1.0 / _FIELD_LENGTH_M, (_WAVES, 3)),
            rng.uniform(0.0, 2.0 * np.pi, (_WAVES, 3)),
            _FIELD_STD_M * float(np.sqrt(2.0 / _WAVES)),
        )

    def displacement_m(self, points_m: FloatArray) -> FloatArray:
        """Return the displacements (N, 3) of points (N, 3)."""
        mirror = np.array([1.0, -1.0, 1.0])
        field = 0.5 * (self._field_m(points_m) + mirror * self._field_m(points_m * mirror))
        return np.asarray((self.scales - 1.0) * (points_m - self.neck_m) + field)

    def _field_m(self, points_m: FloatArray) -> FloatArray:
        angles = (points_m @ self.waves.T)[..., None] + self.phases
        return np.asarray(self.amplitude_m * np.cos(angles).sum(axis=1))

    def normals(self, points_m: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the normals (N, 3) of the warped surface: the cross product of its tangents."""
        aside = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
        first = np.cross(normals, aside)
        first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-9)
        tangents = [first, np.cross(normals, first)]
        here = points_m + self.displacement_m(points_m)
        warped = [
            (there := points_m + _STEP_M * tangent) + self.displacement_m(there) - here
            for tangent in tangents
        ]
        out = np.cross(*warped)
        return np.asarray(out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-20))


def bodies(folder: Path) -> list[Path]:
    """Return the files of the workers in a folder, without copies that have another head."""
    return [path for path in sorted(folder.glob("*.npz")) if "_shape" not in path.stem]


def add_head_shapes(folder: Path, copies: int, seed: int) -> None:
    """Write the copies that are missing of every worker in a folder."""
    for number, path in enumerate(bodies(folder)):
        for copy in range(1, copies + 1):
            out = path.with_name(f"{path.stem}_shape{copy}.npz")
            if not out.exists():
                _write_copy(path, out, np.random.default_rng([seed, 41, number, copy]))


def _write_copy(path: Path, out: Path, rng: np.random.Generator) -> None:
    with np.load(path, allow_pickle=False) as data:
        arrays: dict[str, NDArray[Any]] = {key: data[key] for key in data.files}
    joints_m = arrays["joints_m"].astype(np.float64)
    warp = HeadWarp.random(joints_m[_NECK], rng)
    for level in range(DETAIL_LEVELS):
        share = arrays[f"lod{level}_weights"][:, _NECK].astype(np.float64) * MESH_UNITS["weights"]
        rows = np.flatnonzero(share > 0.0)
        vertices = arrays[f"lod{level}_vertices"]
        points_m = vertices[rows].astype(np.float64) * MESH_UNITS["vertices"]
        moved_m = points_m + share[rows, None] * warp.displacement_m(points_m)
        vertices[rows] = np.rint(moved_m / MESH_UNITS["vertices"]).astype(vertices.dtype)
        normals = arrays[f"lod{level}_normals"]
        old = normals[rows].astype(np.float64) * MESH_UNITS["normals"]
        new = (1.0 - share[rows, None]) * old + share[rows, None] * warp.normals(points_m, old)
        normals[rows] = np.rint(new / MESH_UNITS["normals"]).astype(normals.dtype)
    joints_m[_EYES] += warp.displacement_m(joints_m[_EYES])
    keypoints_m = arrays["keypoints_m"].astype(np.float64)
    follows = arrays["keypoint_weights"][:, _NECK].astype(np.float64)[:, None]
    keypoints_m += follows * warp.displacement_m(keypoints_m)
    top_m = np.array([[joints_m[_NECK, 0], 0.0, float(arrays["stature_m"])]])
    arrays["stature_m"] = arrays["stature_m"] + warp.displacement_m(top_m)[0, 2]
    arrays["joints_m"] = joints_m.astype(arrays["joints_m"].dtype)
    arrays["keypoints_m"] = keypoints_m.astype(arrays["keypoints_m"].dtype)
    for level in range(DETAIL_LEVELS):
        image = f"_lod{level}.jpg"
        shutil.copyfile(path.with_name(path.stem + image), out.with_name(out.stem + image))
    unfinished = out.with_suffix(".part")
    with unfinished.open("wb") as file:
        np.savez_compressed(file, **arrays)
    unfinished.replace(out)
