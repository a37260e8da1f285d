"""The view of a camera whose picture is cut into several flat ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from perception.arrays import FloatArray, rigid_transform, rotation_matrix, set_fields

from ._errors import TrackingError
from ._view import View


@dataclass(frozen=True, slots=True, eq=False)
class SurroundView:
    """People who should be seen in any of several views about one optical centre.

    Attributes:
        views: V, each of its own optical frame; a :class:`CameraView` for each flat camera.
        rotations_camera_view: V rotations (3, 3) from each view's optical frame to the camera's, as
            :class:`perception.surround.FlatView` has them.
    """

    views: tuple[View, ...]
    rotations_camera_view: tuple[FloatArray, ...]

    def __post_init__(self) -> None:
        views = tuple(self.views)
        rotations = tuple(
            rotation_matrix(f"rotations_camera_view[{index}]", rotation, TrackingError)
            for index, rotation in enumerate(self.rotations_camera_view)
        )
        if not views or len(views) != len(rotations):
            raise TrackingError(
                "views and rotations_camera_view must be of one length, at least 1, got "
                f"{len(views)} and {len(rotations)}"
            )
        for view in views:
            if not isinstance(view, View):
                raise TrackingError(
                    "views must have a method visibility(positions_odom_m, T_odom_camera), "
                    f"got {type(view).__name__}"
                )
        set_fields(self, views=views, rotations_camera_view=rotations)

    def visibility(self, positions_odom_m: Any, T_odom_camera: Any) -> FloatArray:
        """Return (N,) in [0, 1]: of each person in the view that shows them best.

        Raises:
            TrackingError: as the views do, and for a ``T_odom_camera`` that is no rigid transform.
        """
        T_odom_camera = rigid_transform("T_odom_camera", T_odom_camera, TrackingError)
        shown = []
        for view, rotation in zip(self.views, self.rotations_camera_view, strict=True):
            T_odom_view = np.array(T_odom_camera)
            T_odom_view[:3, :3] = T_odom_camera[:3, :3] @ rotation
            shown.append(view.visibility(positions_odom_m, T_odom_view))
        return np.asarray(np.max(shown, axis=0))
