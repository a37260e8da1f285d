"""The truth about the people in one image: boxes, keypoints, gaze, position, awareness."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from awarenav.records import Record
from perception import AttentionCone, Camera
from perception.arrays import FloatArray
from perception.layouts import COCO_NAMES, FOOT_NAMES

from ..actors.body import Worker
from ..world import keypoints_in_front, sees
from ..world.camera import CameraRenderer, RenderedView

_NAMES: Final = (*COCO_NAMES, *FOOT_NAMES, "neck")
# A person with fewer visible pixels than this gets no record.
_LEAST_PIXELS: Final = 12
# Corners of a person's bounding box are moved at least this far in front of the camera.
_NEAR_M: Final = 0.2


def frame_truth(
    renderer: CameraRenderer,
    camera: Camera,
    T_odom_camera: FloatArray,
    view: RenderedView,
    workers: Sequence[Worker],
    cone: AttentionCone | None = None,
) -> list[Record]:
    """Return one record per worker who is visible in ``view``.

    Args:
        renderer: draws each worker alone, to measure how much of them is hidden.
        camera: camera of the image.
        T_odom_camera: (4, 4) pose of the camera.
        view: the rendered image.
        workers: all workers of the warehouse.
        cone: scores awareness; None for the default cone.
    """
    cone = AttentionCone() if cone is None else cone
    people = []
    for index, worker in enumerate(workers):
        mask = view.actors == worker.actor
        visible = int(np.count_nonzero(mask))
        if visible < _LEAST_PIXELS:
            continue
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        box = [int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1]
        inside, total = _silhouette_pixels(renderer, camera, T_odom_camera, worker)
        people.append(
            {
                "id": index,
                "box_xyxy_px": [float(edge) for edge in box],
                **_geometry(camera, T_odom_camera, view, worker, cone),
                "score": 1.0,
                "occlusion": round(1.0 - min(visible / max(inside, visible), 1.0), 4),
                "truncation": round(1.0 - inside / max(total, 1), 4),
                "look": Path(worker.asset.name).stem,
                "stature_m": round(worker.stature_m, 4),
                "heading_odom_rad": round(worker.heading_odom_rad, 5),
                "holds": worker.held,
            }
        )
    return people


def _silhouette_pixels(
    renderer: CameraRenderer,
    camera: Camera,
    T_odom_camera: FloatArray,
    worker: Worker,
) -> tuple[int, int]:
    """Return the pixels of the worker drawn alone: inside the image, and in total."""
    low, high = worker.skin.bounds_odom_m()
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    points = (corners - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3]
    points[:, 2] = np.maximum(points[:, 2], _NEAR_M)
    pixels = camera.project(points)
    first = np.floor(pixels.min(axis=0)) - 1.0
    last = np.ceil(pixels.max(axis=0)) + 2.0
    # One image size beyond the image on every side is enough for people at its border.
    size = np.array([camera.width_px, camera.height_px])
    first, last = np.maximum(first, -size), np.minimum(last, 2 * size)
    if (last <= first).any():
        return 0, 0
    alone = renderer.render(
        camera, T_odom_camera, [*first.tolist(), *last.tolist()], only={worker.actor}
    )
    rows, columns = np.nonzero(alone.actors == worker.actor)
    u, v = columns + first[0], rows + first[1]
    inside = (u >= 0) & (u < camera.width_px) & (v >= 0) & (v < camera.height_px)
    return int(inside.sum()), len(u)


def _geometry(
    camera: Camera,
    T_odom_camera: FloatArray,
    view: RenderedView,
    worker: Worker,
    cone: AttentionCone,
) -> dict[str, Any]:
    rotation, origin = T_odom_camera[:3, :3], T_odom_camera[:3, 3]
    body = np.concatenate([worker.keypoints_odom_m, worker.neck_odom_m[None]])
    points = (body - origin) @ rotation
    pixels = camera.project(points)
    seen = keypoints_in_front(points, pixels, view.depth_m)
    gaze = worker.gaze_odom
    awareness = float(cone.scores(worker.eyes_odom_m, gaze, origin))
    if awareness > 0.0 and not sees(worker, origin):
        awareness = 0.0
    return {
        "position_camera_m": np.round((worker.chest_odom_m - origin) @ rotation, 5).tolist(),
        "gaze_camera": np.round(gaze @ rotation, 6).tolist(),
        "head_forward_camera": np.round(worker.rotation_odom_head[:, 1] @ rotation, 6).tolist(),
        "awareness": round(awareness, 6),
        "awareness_std": 0.0,
        "keypoints": {
            name: [round(float(u), 2), round(float(v), 2), 1.0 if visible else 0.0]
            for name, (u, v), visible in zip(_NAMES, pixels, seen, strict=True)
            if np.isfinite((u, v)).all()
        },
        "keypoints_camera_m": {
            name: np.round(point, 4).tolist() for name, point in zip(_NAMES, points, strict=True)
        },
    }
