"""ROS camera_info files, of whatever distortion model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml

from .arrays import FloatArray
from .errors import PerceptionError

# Fields of sensor_msgs/Calibration (ROS 2 in lower case, ROS 1 in upper) by the calibrator's names.
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
    """What a file says; only its shapes are checked.

    Attributes:
        width_px: as written.
        height_px: as written.
        matrix: (3, 3) intrinsics.
        coefficients: (N,) of the distortion model.
        model: its name, ``"plumb_bob"`` where the file names none.
    """

    width_px: int
    height_px: int
    matrix: FloatArray
    coefficients: FloatArray
    model: str

    @property
    def intrinsics(self) -> tuple[int, int, float, float, float, float]:
        """Width, height, fx, fy, cx, cy, in the order of the camera models' arguments."""
        (fx, _, cx), (_, fy, cy), _ = self.matrix.tolist()
        return self.width_px, self.height_px, fx, fy, cx, cy


def read_camera_info(path: str | Path) -> Calibration:
    """Read the file that ``camera_calibration`` writes, or a message as ``ros2 topic echo`` does.

    Raises:
        PerceptionError: naming the file and what is missing.
    """
    path = Path(path)
    try:
        # Echoed messages end in "---"; the first one counts.
        data = next(yaml.safe_load_all(path.read_text(encoding="utf-8")), None)
    except OSError as cause:
        raise PerceptionError(f"cannot read {path}: {cause.strerror or cause}") from cause
    except (yaml.YAMLError, UnicodeDecodeError) as cause:
        raise PerceptionError(f"{path} is not valid YAML: {cause}") from cause
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
    """The numbers of a ROS matrix, written as a mapping with ``data`` or as a plain list."""
    return np.asarray(value["data"] if isinstance(value, dict) else value, dtype=np.float64)
