"""Files of a worker, in the quantised form that ``sim_tests`` loads."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from sim_tests.actors.body import MESH_UNITS

from ._atlas import Baked
from ._body import Body
from ._capsules import Row
from ._person import Person

_JPEG: Final = (
    cv2.IMWRITE_JPEG_QUALITY, 88,
    cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
    cv2.IMWRITE_JPEG_OPTIMIZE, 1,
)  # fmt: skip


def pack(folder: Path, person: Person, body: Body, levels: list[Baked], capsules: list[Row]) -> int:
    """Write ``<name>.npz`` and one JPEG per level; return the bytes written.

    Meshes are stored as whole numbers of ``sim_tests.actors.body.MESH_UNITS``.
    """
    arrays: dict[str, np.ndarray] = {
        "description": np.array(person.description),
        "stature_m": np.array(round(body.scalp_z_m, 4)),
        "joints_m": body.joints_m,
        "keypoints_m": body.keypoints_m,
        "keypoint_weights": body.keypoint_weights,
        "capsule_joints": np.array([row[0] for row in capsules], dtype=np.int64),
        "capsules_m": np.array([[*row[1], *row[2], row[3]] for row in capsules]),
    }
    total = 0
    for level, mesh in enumerate(levels):
        if len(mesh.vertices_m) > np.iinfo(np.uint16).max:
            raise ValueError(
                f"level {level} has {len(mesh.vertices_m)} vertices, at most 65535 fit"
            )
        arrays |= {
            f"lod{level}_vertices": _stored(mesh.vertices_m, "vertices", np.int16),
            f"lod{level}_normals": _stored(mesh.normals, "normals", np.int8),
            f"lod{level}_uv": _stored(np.clip(mesh.uv, 0, 1), "uv", np.uint16),
            f"lod{level}_triangles": mesh.triangles.astype(np.uint16),
            f"lod{level}_weights": _stored(mesh.weights, "weights", np.uint8),
        }
        done, picture = cv2.imencode(".jpg", mesh.texture_rgb[..., ::-1], list(_JPEG))
        if not done:
            raise RuntimeError("the texture could not be encoded")
        (folder / f"{person.name}_lod{level}.jpg").write_bytes(picture.tobytes())
        total += len(picture)
    file = folder / f"{person.name}.npz"
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, array in arrays.items():
            buffer = io.BytesIO()
            np.save(buffer, array, allow_pickle=False)
            # A fixed date keeps the file the same from run to run.
            archive.writestr(
                zipfile.ZipInfo(f"{name}.npy", (2020, 1, 1, 0, 0, 0)),
                buffer.getvalue(),
                zipfile.ZIP_DEFLATED,
                9,
            )
    return total + file.stat().st_size


def _stored(values: np.ndarray, key: str, dtype: type[np.integer]) -> np.ndarray:
    """Return an array of a mesh as whole numbers of its unit."""
    return np.round(values / MESH_UNITS[key]).astype(dtype)
