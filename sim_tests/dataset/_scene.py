"""One randomised scene: a hall, its light, its workers, images of them, and the truth about them.

The truth about a person is a record of box, keypoints, gaze, position and awareness.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from awarenav.records import Record
from perception import AttentionCone, Camera
from perception.arrays import FloatArray
from perception.layouts import COCO_NAMES, FOOT_NAMES

from ..actors.body import MAX_HEAD_PITCH_RAD, MAX_HEAD_YAW_RAD, Worker, load_worker, worker_names
from ..world import Warehouse, crosses_boxes, keypoints_in_front, sees
from ..world.camera import CameraRenderer, RenderedView, expose
from ..world.errors import SimError
from ..world.hall import LAYOUTS, LIGHTINGS, Lighting, WarehouseLayout
from ..world.render import RendererName
from ._config import RenderConfig

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
) -> list[Record]:
    """Return one record per worker who is visible in ``view``."""
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
                **_geometry(camera, T_odom_camera, view, worker),
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
    renderer: CameraRenderer, camera: Camera, T_odom_camera: FloatArray, worker: Worker
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
    camera: Camera, T_odom_camera: FloatArray, view: RenderedView, worker: Worker
) -> dict[str, Any]:
    rotation, origin = T_odom_camera[:3, :3], T_odom_camera[:3, 3]
    body = np.concatenate([worker.keypoints_odom_m, worker.neck_odom_m[None]])
    points = (body - origin) @ rotation
    pixels = camera.project(points)
    seen = keypoints_in_front(points, pixels, view.depth_m)
    gaze = worker.gaze_odom
    up = -worker.rotation_odom_head[:, 0]
    awareness = float(AttentionCone().scores(worker.eyes_odom_m, gaze, origin, up))
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


_CAMERA_CLEARANCE_M: Final = 0.6
_PERSON_CLEARANCE_M: Final = 0.40
_PERSON_SPACING_M: Final = 0.8
# Straight ahead the view of the camera is free for at least this distance.
_OPEN_AHEAD_M: Final = 3.0
# Half width of a person that must fit into the image.
_HALF_WIDTH_M: Final = 0.28
# Share of the people who may stand behind a rack or a pallet, out of the camera's line of sight.
_HIDDEN_SHARE: Final = 0.08
# Share of the people who may stand in front of or behind another person.
_OVERLAP_SHARE: Final = 0.15
_TRIES: Final = 40
_CAMERA_TRIES: Final = 500
_ACTIVITIES: Final = ("none", "carry_box", "phone")
_ACTIVITY_SHARES: Final = (0.64, 0.18, 0.18)


# The place of a person: x, y (m) in odom.
_Place = tuple[float, float]


class RenderScene(AbstractContextManager["RenderScene"]):
    """A hall with workers; :meth:`snapshot` places them at random and renders an image.

    Args:
        config: settings of the set of images.
        number: number of the scene, from 0.
        renderer: renderer of the images, as for :class:`~sim_tests.world.Warehouse`; images of
            ``"tiny"`` are the same on every computer.

    Attributes:
        warehouse: the hall.
        workers: the workers of this scene.
        renderer: the renderer of the camera.
    """

    def __init__(
        self, config: RenderConfig, number: int, *, renderer: RendererName = "tiny"
    ) -> None:
        self._config = config
        self.number = number
        rng = np.random.default_rng([config.seed, 1, number])
        halls = config.layouts or tuple(LAYOUTS)
        self.layout_name = halls[number % len(halls)]
        lights = np.random.default_rng([config.seed, 4]).permutation(list(LIGHTINGS)).tolist()
        self.lighting_name = str(lights[number % len(lights)])
        first, last = config.variants
        self.warehouse = Warehouse(
            WarehouseLayout.named(self.layout_name),
            variant=int(rng.integers(first, last + 1)),
            renderer=renderer,
        )
        try:
            self.workers = tuple(
                Worker(self.warehouse, _stature_m(look, rng), look=look)
                for look in _worker_names(config, number)
            )
            self.renderer = CameraRenderer(
                self.warehouse,
                lighting=Lighting.preset(self.lighting_name),
                shadows=True,
                supersampling=config.supersampling,
            )
        except BaseException:
            self.warehouse.close()
            raise

    def close(self) -> None:
        """Close the warehouse."""
        self.warehouse.close()

    def __exit__(self, *exception: object) -> None:
        self.close()

    @property
    def camera(self) -> Camera:
        """Camera of every image."""
        return self._config.camera

    def snapshot(self, frame: int) -> tuple[NDArray[np.uint8], Record]:
        """Return image number ``frame`` (H, W, 3) and its truth; reproducible."""
        rng = np.random.default_rng([self._config.seed, 2, frame])
        T_odom_camera = self.arrange(rng)
        camera = self._config.camera
        view = self.renderer.render(camera, T_odom_camera)
        people = frame_truth(self.renderer, camera, T_odom_camera, view, self.workers)
        record: Record = {
            "frame": f"{frame:06d}.png",
            # Images are independent: one second apart, a tracker does not join them to one track.
            "stamp_s": float(frame),
            "T_odom_camera": np.round(T_odom_camera, 6).tolist(),
            "people": people,
            "scene": self.number,
            "layout": self.layout_name,
            "lighting": self.lighting_name,
        }
        return expose(view.rgb, self._config.sensor, rng), record

    def clear(self) -> None:
        """Move all workers out of the hall."""
        for worker in self.workers:
            worker.place((self.warehouse.layout.x_min_m - 9.0, 0.0), 0.0)

    def arrange(self, rng: np.random.Generator) -> FloatArray:
        """Place camera and workers at random; return T_odom_camera (4, 4)."""
        config = self._config
        wanted = int(rng.integers(1, len(self.workers) + 1))
        chosen = rng.permutation(len(self.workers))[:wanted]
        self.clear()
        places: list[_Place] = []
        for _ in range(_CAMERA_TRIES):
            T_odom_camera, heading = self._camera_pose(rng)
            places = self._free_places(T_odom_camera[:3, 3], heading, wanted, rng)
            if places:
                break
        else:
            raise SimError(
                f"hall {self.layout_name!r} has no free place {config.min_range_m:g} to "
                f"{config.max_range_m:g} m in front of a camera; use shorter ranges"
            )
        for row, place in zip(chosen.tolist(), places, strict=False):
            random_pose(self.workers[row], place, T_odom_camera[:3, 3], rng, config.eyes)
        return T_odom_camera

    def _camera_pose(self, rng: np.random.Generator) -> tuple[FloatArray, float]:
        layout = self.warehouse.layout
        low = np.array([layout.x_min_m, layout.y_min_m])
        high = np.array([layout.x_max_m, layout.y_max_m])
        while True:
            x, y = rng.uniform(low, high)
            heading = float(rng.uniform(-math.pi, math.pi))
            ahead = x + _OPEN_AHEAD_M * math.cos(heading), y + _OPEN_AHEAD_M * math.sin(heading)
            boxes = self.warehouse.obstacle_boxes_odom
            if _clearance_m(boxes, x, y) > _CAMERA_CLEARANCE_M and not _blocked(
                boxes, (x, y), ahead
            ):
                break
        height = float(np.clip(rng.normal(1.4, 0.06), 1.2, 1.6))
        pitch, roll = rng.normal(0.0, np.radians([3.0, 0.7]))
        return _pose_matrix((x, y, height), heading, float(pitch), float(roll)), heading

    def _free_places(
        self, origin: FloatArray, heading: float, wanted: int, rng: np.random.Generator
    ) -> list[_Place]:
        """Return up to ``wanted`` free places in view that do not collide."""
        config, boxes = self._config, self.warehouse.obstacle_boxes_odom
        layout = self.warehouse.layout
        half_fov = 0.5 * math.radians(config.horizontal_fov_deg)
        places: list[_Place] = []
        for _ in range(_TRIES):
            distance = rng.uniform(config.min_range_m, config.max_range_m)
            margin = math.asin(min(_HALF_WIDTH_M / distance, 0.9 * math.sin(half_fov)))
            azimuth = heading + rng.uniform(-1.0, 1.0) * (half_fov - margin)
            may_hide = bool(places) and rng.random() < _HIDDEN_SHARE
            x = float(origin[0] + distance * math.cos(azimuth))
            y = float(origin[1] + distance * math.sin(azimuth))
            inside = layout.x_min_m < x < layout.x_max_m and layout.y_min_m < y < layout.y_max_m
            if not inside or _clearance_m(boxes, x, y) < _PERSON_CLEARANCE_M:
                continue
            may_overlap = rng.random() < _OVERLAP_SHARE
            if any(_collide(place, (x, y), origin, may_overlap) for place in places):
                continue
            if not may_hide and _blocked(boxes, (float(origin[0]), float(origin[1])), (x, y)):
                continue
            places.append((x, y))
            if len(places) == wanted:
                break
        return places


def _worker_names(config: RenderConfig, number: int) -> list[str]:
    """Return the workers of a scene; over the scenes all workers take turns, in shuffled order."""
    names = list(config.workers or worker_names())
    order = np.random.default_rng([config.seed, 3]).permutation(len(names)).tolist()
    first = number * config.people
    return [names[order[(first + k) % len(names)]] for k in range(config.people)]


def _stature_m(look: str, rng: np.random.Generator) -> float:
    """Return the worker's stature with a random variation of 1.2 %."""
    stature = load_worker(look).stature_m
    return float(np.clip(stature * rng.normal(1.0, 0.012), 1.45, 2.05))


def random_pose(
    worker: Worker,
    position_odom_m: tuple[float, float],
    camera_odom_m: FloatArray,
    rng: np.random.Generator,
    eyes: str = "wander",
) -> None:
    """Place a worker with random heading, activity, gait, head pose and gaze."""
    x, y = position_odom_m
    heading = float(rng.uniform(-math.pi, math.pi))
    activity = str(rng.choice(_ACTIVITIES, p=_ACTIVITY_SHARES))
    speed = 0.0 if rng.random() < 0.4 else float(rng.uniform(0.5, 2.0))
    walked = float(rng.uniform(0.0, 4.0))
    kind = rng.random()
    yaw, pitch = rng.normal(0.0, math.radians(25.0)), rng.normal(-0.05, math.radians(10.0))
    if activity == "phone":
        yaw, pitch = 0.3 * yaw, math.radians(-30.0) + 0.6 * pitch
    elif kind < 0.3:  # at the robot, as far as the neck turns
        away = math.atan2(camera_odom_m[1] - y, camera_odom_m[0] - x)
        yaw = math.remainder(away - heading, math.tau) + 0.2 * yaw
    elif kind < 0.5:
        yaw = rng.uniform(-MAX_HEAD_YAW_RAD, MAX_HEAD_YAW_RAD)
    eye_yaw = float(np.clip(rng.normal(0.0, 0.12), -0.5, 0.5))
    eye_pitch = float(np.clip(rng.normal(0.0, 0.06), -0.3, 0.3))
    wander = float(eyes == "wander")
    worker.place(
        (x, y),
        heading,
        walked_m=walked,
        speed_mps=speed,
        head_yaw_rad=float(np.clip(yaw, -MAX_HEAD_YAW_RAD, MAX_HEAD_YAW_RAD)),
        head_pitch_rad=float(np.clip(pitch, -MAX_HEAD_PITCH_RAD, MAX_HEAD_PITCH_RAD)),
        eye_yaw_rad=wander * eye_yaw,
        eye_pitch_rad=wander * eye_pitch,
        activity=activity,
    )


def _pose_matrix(
    position_odom_m: tuple[float, float, float], heading: float, pitch: float, roll: float
) -> FloatArray:
    """Return T_odom_camera (4, 4) of a camera that looks down by ``pitch``."""
    ch, sh, cp, sp = math.cos(heading), math.sin(heading), math.cos(pitch), math.sin(pitch)
    forward = np.array([cp * ch, cp * sh, -sp])
    right = np.array([sh, -ch, 0.0])
    down = np.cross(forward, right)
    cr, sr = math.cos(roll), math.sin(roll)
    pose = np.eye(4)
    pose[:3, 0] = cr * right + sr * down
    pose[:3, 1] = -sr * right + cr * down
    pose[:3, 2] = forward
    pose[:3, 3] = position_odom_m
    return pose


def _collide(first: _Place, second: _Place, origin: FloatArray, may_overlap: bool) -> bool:
    """Return whether two people stand too close, or overlap as seen from the camera."""
    if math.dist(first, second) < _PERSON_SPACING_M:
        return True
    a, b = (
        (
            math.atan2(y - origin[1], x - origin[0]),
            _HALF_WIDTH_M / math.hypot(x - origin[0], y - origin[1]),
        )
        for x, y in (first, second)
    )
    return not may_overlap and abs(math.remainder(a[0] - b[0], math.tau)) < a[1] + b[1]


def _clearance_m(boxes: FloatArray, x: float, y: float) -> float:
    """Return the distance from a point to the nearest of (N, 4) boxes; 0 inside one."""
    dx = np.maximum(np.maximum(boxes[:, 0] - x, x - boxes[:, 2]), 0.0)
    dy = np.maximum(np.maximum(boxes[:, 1] - y, y - boxes[:, 3]), 0.0)
    return float(np.hypot(dx, dy).min())


def _blocked(boxes: FloatArray, start: tuple[float, float], end: tuple[float, float]) -> bool:
    """Return whether the straight line between two points crosses one of (N, 4) boxes."""
    return bool(crosses_boxes(boxes, start, end)[0])
