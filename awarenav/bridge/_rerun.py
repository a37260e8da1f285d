"""Recordings of the bridge for the viewer Rerun; no other module imports ``rerun``."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Final

import numpy as np

from nav_adapter import NavConstraints
from nav_adapter.ros2 import AwarenessBridge
from perception.arrays import FloatArray
from perception.installation import install_command

from ..drawing import awareness_colour
from ..errors import AwarenavError, MissingExtraError

try:
    import rerun as rr
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise MissingExtraError(
        "--rerun needs the package rerun-sdk, which is not installed; it is the extra 'viz' (on "
        f"Python 3.11 or later): {install_command('viz')}"
    ) from cause

_SEEN_SCORE: Final = 0.3
_JPEG_QUALITY: Final = 80
_CONE_LENGTH_M: Final = 1.0
_RIM_ANGLES: Final = np.linspace(0.0, 2.0 * np.pi, 25)
_EYE_HEIGHT_M: Final = 1.6


class RerunRecorder(AbstractContextManager["RerunRecorder"]):
    """Writes image, keypoints, cones, tracks, radii and speed limit to an ``.rrd`` file.

    Frames and constraints may be drawn in different threads.

    Args:
        path: of the file; an existing one is replaced.
        half_angle_rad: of the attention cone.

    Raises:
        AwarenavError: for a path in a folder that does not exist.
    """

    def __init__(self, path: Path, half_angle_rad: float) -> None:
        if not path.parent.is_dir():
            raise AwarenavError(f"cannot write {path}: there is no folder {path.parent}")
        self._stream = rr.RecordingStream("awarenav")
        self._stream.save(path)
        self._stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self._half_angle_rad = half_angle_rad

    def draw(self, bridge: AwarenessBridge, constraints: NavConstraints) -> None:
        """Record the constraints."""
        self._stream.set_time("stamp", timestamp=constraints.stamp_s)
        self._stream.log("speed/limit_mps", rr.Scalars(constraints.speed_limit_mps))
        if bridge.robot_state is not None:
            self._stream.log("speed/robot_mps", rr.Scalars(bridge.robot_state.speed_mps))
        self._stream.log("speed/reason", rr.TextLog(constraints.limited_by))
        rings, colors, labels = [], [], []
        for each in constraints.obstacles:
            ring = np.asarray(each.polygon.exterior.coords)[:, :2]
            rings.append(np.column_stack([ring, np.full(len(ring), 0.02)]))
            aware = each.awareness_lower
            colors.append(awareness_colour(aware))
            labels.append(f"{each.track_id}: r {each.radius_m:.2f} m, α ≥ {aware:.2f}")
            self._stream.log(f"radius_m/{each.track_id}", rr.Scalars(each.radius_m))
            self._stream.log(f"awareness_lower/{each.track_id}", rr.Scalars(aware))
        self._stream.log("world/obstacles", rr.LineStrips3D(rings, colors=colors, labels=labels))

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Write what is buffered and close the file."""
        self._stream.disconnect()

    def draw_frame(self, bridge: AwarenessBridge) -> None:
        """Record the latest image with keypoints, cones and tracks, at the image's stamp."""
        frame, camera = bridge.frame, bridge.camera
        if frame is None or camera is None:
            return
        self._stream.set_time("stamp", timestamp=frame.stamp_s)
        T = frame.T_odom_camera
        self._stream.log("world/camera", rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3]))
        self._stream.log(
            "world/camera/image",
            rr.Pinhole(
                image_from_camera=camera.matrix, resolution=[camera.width_px, camera.height_px]
            ),
        )
        self._stream.log(
            "world/camera/image", rr.Image(frame.image).compress(jpeg_quality=_JPEG_QUALITY)
        )
        keypoints: list[FloatArray] = []
        cones: list[FloatArray] = []
        for seen in frame.observations:
            person = seen.keypoints
            if person is not None:
                keypoints.append(np.asarray(person.keypoints_px)[person.scores >= _SEEN_SCORE])
            if seen.gaze_camera is not None:
                apex = T[:3, :3] @ seen.position_camera_m + T[:3, 3]
                apex[2] = _EYE_HEIGHT_M
                cones += cone_lines(apex, T[:3, :3] @ seen.gaze_camera, self._half_angle_rad)
        points: Any = np.concatenate(keypoints) if keypoints else np.empty((0, 2))
        self._stream.log("world/camera/image/keypoints", rr.Points2D(points, radii=2.0))
        self._stream.log("world/cones", rr.LineStrips3D(cones))
        tracks = frame.tracks
        self._stream.log(
            "world/tracks",
            rr.Arrows3D(
                origins=[[*track.position_odom_m, 0.1] for track in tracks],
                vectors=[[*track.velocity_odom_mps, 0.0] for track in tracks],
                labels=[f"{track.id} {track.status} α {track.awareness:.2f}" for track in tracks],
            ),
        )


def cone_lines(apex: FloatArray, gaze: FloatArray, half_angle_rad: float) -> list[FloatArray]:
    """Return rim, four edges and axis of an attention cone of 1 m."""
    gaze = gaze / np.linalg.norm(gaze)
    side = np.cross(gaze, [0.0, 0.0, 1.0] if abs(gaze[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    up = np.cross(side, gaze)
    around = np.cos(_RIM_ANGLES)[:, None] * side + np.sin(_RIM_ANGLES)[:, None] * up
    rim = apex + _CONE_LENGTH_M * (np.cos(half_angle_rad) * gaze + np.sin(half_angle_rad) * around)
    edges = [np.stack([apex, rim[index]]) for index in (0, 6, 12, 18)]
    return [rim, *edges, np.stack([apex, apex + _CONE_LENGTH_M * gaze])]
