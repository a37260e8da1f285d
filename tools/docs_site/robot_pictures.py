"""The picture of the page on robots: every shipped robot beside a worker, rendered.

python -m tools.docs_site.robot_pictures                 # into docs/images/robots.png
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

import numpy as np

from perception import Camera
from perception.arrays import FloatArray
from sim_tests import CameraRenderer, Warehouse, Worker
from sim_tests.actors.robot import Amr, AmrLook, KinematicLook, KinematicRobot, RobotModel
from sim_tests.world.hall import WarehouseLayout

FILE: Final = Path(__file__).parents[2] / "docs" / "images" / "robots.png"
#: Robots in the picture from left to right, and their places.
PLACES_M: Final = {
    "delivery": (3.6, 2.2),
    "nova_carter": (3.6, 1.05),
    "omni": (3.7, -0.3),
    "forklift": (4.4, -2.45),
}
_HEADING_RAD: Final = math.radians(215.0)
_WIDTH_PX: Final = 1440
_HEIGHT_PX: Final = 560
_COLOURS: Final = 240


def look_at(eye_m: FloatArray, target_m: FloatArray) -> FloatArray:
    """Return T_odom_camera (4, 4) of a camera at ``eye_m`` that looks at ``target_m``."""
    forward = (target_m - eye_m) / np.linalg.norm(target_m - eye_m)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = eye_m
    return pose


def main() -> int:
    """Render the picture; return 0."""
    from PIL import Image  # noqa: PLC0415 - a development dependency

    with Warehouse(WarehouseLayout.named("open"), renderer="auto") as warehouse:
        for name, place in PLACES_M.items():
            model = RobotModel.shipped(name)
            if model.body == "nova_carter":
                warehouse.add_actor(
                    AmrLook.of(warehouse, Amr(warehouse, place, _HEADING_RAD, model.profile))
                )
            else:
                robot = KinematicRobot(warehouse, model, place, _HEADING_RAD)
                warehouse.add_actor(KinematicLook(robot))
        worker = Worker(warehouse, 1.75)
        worker.place(np.array([3.4, 3.2]), math.radians(200.0), 0.0, 0.0, 0.0, 0.0)
        camera = Camera.from_fov(_WIDTH_PX, _HEIGHT_PX, math.radians(66.0))
        pose = look_at(np.array([-2.0, -0.4, 2.3]), np.array([3.6, 0.0, 0.62]))
        image = CameraRenderer(warehouse, supersampling=2).rgb(camera, pose)
    picture = Image.fromarray(image).quantize(_COLOURS, dither=Image.Dither.NONE)
    picture.save(FILE, "PNG", optimize=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
