"""Quarter turns of pictures: networks know people who stand upright, cameras hang as they like."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ._camera import Camera
from ._observation import PersonObservation
from ._stages import PersonKeypoints
from .arrays import FloatArray

# Where up has less of its length in the picture (a view that is steeper than 80°), no turn is
# better than another.
_LEAST_IN_PICTURE: Final = math.sin(math.radians(10.0))
# Pairs of OpenCV's coefficients that turn with the picture as x and y do: tangential distortion,
# and that of thin prisms.
_VECTORS: Final = ((3, 2), (8, 10), (9, 11))
_TILT: Final = slice(12, 14)


@dataclass(frozen=True, slots=True)
class QuarterTurn:
    """The turn of a camera's picture that brings it nearest to upright, and the way back.

    The turned picture is that of another camera, a view of this one: its frame is the camera's,
    rolled. Everything between picture and observations happens there.

    Attributes:
        quarters: turns of the picture by 90° counter-clockwise, 0 to 3.
    """

    quarters: int

    @classmethod
    def upright(cls, up_camera: FloatArray | None) -> QuarterTurn:
        """Return the turn for a direction up (3,) in the camera frame; none where it is unknown."""
        if up_camera is None:
            return cls(0)
        right, down, _ = up_camera.tolist()
        if math.hypot(right, down) < _LEAST_IN_PICTURE:
            return cls(0)
        return cls(round(math.atan2(right, -down) / (0.5 * math.pi)) % 4)

    @property
    def rotation_camera_view(self) -> FloatArray:
        """Rotation (3, 3) from the frame of the turned picture to that of the camera."""
        cos, sin = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[self.quarters]
        return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])

    @property
    def up_camera(self) -> FloatArray:
        """Direction up (3,) in the frame of a camera whose picture is upright when turned so."""
        return -self.rotation_camera_view[:, 1]

    @property
    def roll_deg(self) -> int:
        """Angle by which such a camera is rolled, clockwise as seen from behind it."""
        return (0, -90, 180, 90)[self.quarters]

    def picture(self, picture: NDArray[Any]) -> NDArray[Any]:
        """Return an image (H, W, …) turned."""
        return np.ascontiguousarray(np.rot90(picture, self.quarters)) if self.quarters else picture

    def camera(self, camera: Camera) -> Camera:
        """Return the camera of the turned picture.

        Its distortion is the same to the first order of a tilted sensor's angles, and exactly for
        every other model.
        """
        if not self.quarters:
            return camera
        back = self.rotation_camera_view
        size, focal = [camera.width_px, camera.height_px], [camera.fx_px, camera.fy_px]
        if self.quarters % 2:
            size, focal = size[::-1], focal[::-1]
        centre = [camera.cx_px, camera.cy_px] - self._corner(size, 1.0)
        distortion = camera.distortion
        if distortion is not None:
            distortion = distortion.copy()
            for pair in _VECTORS:
                if max(pair) < distortion.size:
                    distortion[list(pair)] = distortion[list(pair)] @ back[:2, :2]
            if distortion.size > _TILT.start:
                distortion[_TILT] = _turned_tilt(distortion[_TILT], back)
        (width, height), (fx, fy), (cx, cy) = size, focal, (centre @ back[:2, :2]).tolist()
        return Camera(width, height, fx, fy, cx, cy, distortion)

    def in_camera(self, observation: PersonObservation, camera: Camera) -> PersonObservation:
        """Return an observation of the turned picture in the frame and the picture of a camera."""
        if not self.quarters:
            return observation
        back, size = self.rotation_camera_view, [camera.width_px, camera.height_px]
        if self.quarters % 2:
            size = size[::-1]
        box, person = observation.box_xyxy_px, observation.keypoints
        if box is not None:
            corners = box.reshape(2, 2) @ back[:2, :2].T + self._corner(size, 0.0)
            box = np.concatenate([corners.min(axis=0), corners.max(axis=0)])
        if person is not None:
            person = _turned_keypoints(person, back, self._corner(size, 1.0))
        return replace(observation.rotated(back), box_xyxy_px=box, keypoints=person)

    def _corner(self, size_view_px: list[int], pixel: float) -> FloatArray:
        """Return where the turned picture's origin lies in the camera's: a pixel, or a corner."""
        far = self.rotation_camera_view[:2, :2] @ (np.array(size_view_px) - pixel)
        return np.maximum(-far, 0.0)


def _turned_keypoints(person: PersonKeypoints, back: FloatArray, corner: FloatArray) -> Any:
    return replace(
        person,
        keypoints_px=person.keypoints_px @ back[:2, :2].T + corner,
        keypoints_root_m=person.keypoints_root_m @ back.T,
        irises_px=None if person.irises_px is None else back[:2, :2] @ person.irises_px,
    )


def _turned_tilt(angles_rad: FloatArray, back: FloatArray) -> tuple[float, float]:
    """Return the angles of a tilted sensor about x and y in the turned picture."""
    about_x_rad, about_y_rad = angles_rad.tolist()
    # The sensor's normal turns; what remains is a turn within it, of the second order.
    x, y = math.sin(about_y_rad), -math.cos(about_y_rad) * math.sin(about_x_rad)
    z = math.cos(about_y_rad) * math.cos(about_x_rad)
    x, y = (np.array([x, y]) @ back[:2, :2]).tolist()
    return math.atan2(-y, z), math.asin(x)
