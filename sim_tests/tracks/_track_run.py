"""Everything that a plot of tracks shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from perception.arrays import FloatArray

from ._track_history import TrackHistory


@dataclass(frozen=True, slots=True, eq=False)
class TrackRun:
    """Tracks and the camera that saw them.

    Attributes:
        histories: in the order of their ids.
        camera_stamps_s: (N,) of the frames, ascending.
        camera_poses: (N, 3) x, y (m) and heading (rad) of the camera's view in odom.
        remarks: sentences about frames that were refused.
        source: what the identities are, for the title.
    """

    histories: tuple[TrackHistory, ...]
    camera_stamps_s: FloatArray
    camera_poses: FloatArray
    remarks: tuple[str, ...]
    source: str

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last stamp; (0, 0) without a frame."""
        if not len(self.camera_stamps_s):
            return 0.0, 0.0
        return float(self.camera_stamps_s[0]), float(self.camera_stamps_s[-1])


def camera_jump_m(run: TrackRun) -> float:
    """How far the camera goes from frame to frame, the median (m); 0 for fewer than three frames.

    Metres mean single pictures of many places, as ``awarenav render`` makes, and not a drive.
    """
    if len(run.camera_poses) < 3:
        return 0.0
    steps = np.diff(run.camera_poses[:, :2], axis=0)
    return float(np.median(np.hypot(steps[:, 0], steps[:, 1])))


def camera_pose(T_odom_camera: FloatArray) -> tuple[float, float, float]:
    """Where a camera is and looks to on the floor plane: x, y (m), heading (rad)."""
    x, y = T_odom_camera[:2, 3].tolist()
    ahead = T_odom_camera[:2, 2]
    return x, y, float(np.arctan2(ahead[1], ahead[0]))
