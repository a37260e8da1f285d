"""ROS camera_info files, for any distortion model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from .arrays import FloatArray
from .documents import read_yaml
from .errors import PerceptionError

# Fields of sensor_msgs/CameraInfo (ROS 2 in lower case, ROS 1 in upper case) and the names that
# camera_calibration gives them.
_MESSAGE_KEYS: Final = {
    "width": "image_width",
    "height": "image_height",
    "k": "camera_matrix",
    "K": "camera_matrix",
    "d": "distortion_coefficients",
    "D": "distortion_coefficients",
}


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """Content of a camera_info file; only the shapes are checked.

    Attributes:
        width_px: image width.
        height_px: image height.
        matrix: (3, 3) intrinsic matrix.
        coefficients: (N,) coefficients of the distortion model.
        model: name of the distortion model; ``"plumb_bob"`` if the file names none.
    """

    width_px: int
    height_px: int
    matrix: FloatArray
    coefficients: FloatArray
    model: str

    @property
    def intrinsics(self) -> tuple[int, int, float, float, float, float]:
        """Width, height, fx, fy, cx, cy: the first arguments of the camera models."""
        (fx, _, cx), (_, fy, cy), _ = self.matrix.tolist()
        return self.width_px, self.height_px, fx, fy, cx, cy


def read_camera_info(path: str | Path) -> Calibration:
    """Read a file that ``camera_calibration`` writes, or a message that ``ros2 topic echo`` prints.

    Raises:
        PerceptionError: for a file that cannot be read or is not complete; the message names it.
    """
    path = Path(path)
    # Each echoed message ends with "---"; the first message counts.
    data = read_yaml(path, first_document=True)
    if not isinstance(data, dict):
        raise PerceptionError(f"{path} must hold the keys of a ROS camera_info file")
    data = {_MESSAGE_KEYS.get(key, key): value for key, value in data.items()}
    try:
        return Calibration(
            data["image_width"],
            data["image_height"],
            np.reshape(_entries(data["camera_matrix"]), (3, 3)),
            np.ravel(_entries(data.get("distortion_coefficients", []))),
            data.get("distortion_model") or "plumb_bob",
        )
    except KeyError as missing:
        raise PerceptionError(
            f"{path} lacks the key {missing}; a camera_info file has image_width, "
            "image_height, camera_matrix and distortion_coefficients"
        ) from None
    except (TypeError, ValueError) as cause:
        raise PerceptionError(f"{path}: {cause}") from cause


def _entries(value: Any) -> Any:
    """Return the numbers of a ROS matrix: a mapping with ``data``, or a plain list."""
    return np.asarray(value["data"] if isinstance(value, dict) else value, dtype=np.float64)
