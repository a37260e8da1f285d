"""The simulated camera of a robot: renderer, image sensor and frame timing together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from perception import Camera
from perception.arrays import FloatArray, finite_number, rigid_transform

from .._warehouse import Warehouse
from ..errors import SimError
from ._motion_blur import motion_blur, motion_field
from ._renderer import CameraRenderer, RenderedView
from ._sensor import SensorConfig, expose
from ._timing import CameraTiming, FrameClock, FrameQueue

# Motion is estimated from the last capture, unless it is older than this.
_MAX_GAP_S: Final = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class CameraFrame:
    """One frame, with the truth of each pixel.

    Attributes:
        stamp_s: the middle of the exposure.
        T_odom_camera: (4, 4) at that instant.
        rgb: (H, W, 3) uint8 as the sensor delivers it.
        depth_m: (H, W) true depth, infinite where there is nothing.
        actors: (H, W) number of the actor in each pixel, −1 for scenery and nothing.
        people: numbers of the actors that are people.
    """

    stamp_s: float
    T_odom_camera: FloatArray
    rgb: NDArray[np.uint8]
    depth_m: FloatArray
    actors: NDArray[np.int32]
    people: tuple[int, ...]

    @property
    def person_mask(self) -> NDArray[np.bool_]:
        """The pixels (H, W) that show a person."""
        return np.isin(self.actors, self.people)


class ImageRenderer(Protocol):
    """Renders the image of a camera."""

    def render(self, camera: Camera, T_odom_camera: Any) -> RenderedView:
        """Return the whole image."""
        ...


class SimulatedCamera:
    """Takes frames of a warehouse and delivers them with the delay of a real camera.

    Args:
        warehouse: the warehouse that the camera sees.
        camera: without distortion.
        sensor: exposure, noise, vignetting, motion blur.
        timing: frame rate, losses and delays.
        rng: draws noise, losses and delays; needed unless the camera is perfect.
        renderer: None is a :class:`CameraRenderer` with its defaults.

    Raises:
        SimError: for noise, losses or delays without ``rng``.
    """

    def __init__(
        self,
        warehouse: Warehouse,
        camera: Camera,
        *,
        sensor: SensorConfig | None = None,
        timing: CameraTiming | None = None,
        rng: np.random.Generator | None = None,
        renderer: ImageRenderer | None = None,
    ) -> None:
        self._warehouse = warehouse
        self._camera = camera
        self._sensor = SensorConfig() if sensor is None else sensor
        timing = CameraTiming() if timing is None else timing
        noisy = self._sensor.shot_noise or self._sensor.read_noise_e > 0.0
        if rng is None and (noisy or not timing.perfect):
            raise SimError("rng must be given for a camera with noise, losses or delays")
        # Noise and timing have a generator each, so that one never changes the other.
        self._noise_rng, timing_rng = (rng or np.random.default_rng(0)).spawn(2)
        self._clock = FrameClock(timing, timing_rng)
        self._renderer: ImageRenderer = CameraRenderer(warehouse) if renderer is None else renderer
        self._queue: FrameQueue[CameraFrame] = FrameQueue()
        self._last: tuple[float, FloatArray, dict[int, FloatArray]] | None = None

    def tick(self, now_s: float, T_odom_camera: Any) -> tuple[CameraFrame, ...]:
        """Take a frame if one is due at ``now_s``; return the frames that have arrived by then.

        A frame is taken at the first tick at or after its time, and stamped with that tick. A frame
        that will be lost is not rendered.
        """
        now = finite_number("now_s", now_s, SimError)
        due, delivery_s = self._clock.tick(now)
        if due and delivery_s is not None:
            self._queue.put(now, delivery_s, self.capture(now, T_odom_camera))
        return self._queue.take(now)

    def capture(
        self,
        stamp_s: float,
        T_odom_camera: Any,
        velocities_odom_mps: Mapping[int, Any] | None = None,
    ) -> CameraFrame:
        """Take a frame now, independent of the timing.

        Args:
            stamp_s: the middle of its exposure.
            T_odom_camera: (4, 4) at that instant.
            velocities_odom_mps: (2,) velocity of each actor that moves, by its number, for motion
                blur. None estimates it from the last capture, as is the camera's own motion, if
                that is at most 0.25 s old.
        """
        stamp = finite_number("stamp_s", stamp_s, SimError)
        T = rigid_transform("T_odom_camera", T_odom_camera, SimError)
        view = self._renderer.render(self._camera, T)
        rgb = view.rgb
        if self._sensor.motion_blur:
            centres = self._actor_centres()
            rgb = self._blurred(stamp, T, view, centres, velocities_odom_mps)
            self._last = stamp, T, centres
        people = [
            number
            for number, actor in enumerate(self._warehouse.visuals.actors)
            if actor.kind == "person"
        ]
        return CameraFrame(
            stamp,
            T,
            expose(rgb, self._sensor, self._noise_rng),
            view.depth_m,
            view.actors,
            tuple(people),
        )

    def _actor_centres(self) -> dict[int, FloatArray]:
        """Return the centre (2,) of each actor in odom."""
        return {
            number: actor.bounds_odom_m()[:, :2].mean(axis=0)
            for number, actor in enumerate(self._warehouse.visuals.actors)
        }

    def _blurred(
        self,
        stamp_s: float,
        T_odom_camera: FloatArray,
        view: RenderedView,
        centres: dict[int, FloatArray],
        velocities_odom_mps: Mapping[int, Any] | None,
    ) -> NDArray[np.uint8]:
        """Return the view's image with motion blur."""
        exposure_s = self._sensor.exposure_s
        T_open = T_close = T_odom_camera
        velocities = velocities_odom_mps or {}
        if self._last is not None and 0.0 < stamp_s - self._last[0] <= _MAX_GAP_S:
            last_s, T_last, last_centres = self._last
            share = exposure_s / (stamp_s - last_s)
            T_open, T_close = _poses_around(T_last, T_odom_camera, share)
            if velocities_odom_mps is None:
                velocities = {
                    number: (centre - last_centres[number]) / (stamp_s - last_s)
                    for number, centre in centres.items()
                    if number in last_centres
                }
        field = motion_field(
            self._camera, view.depth_m, T_open, T_close, view.actors, velocities, exposure_s
        )
        return motion_blur(view.rgb, field, view.actors)


def _poses_around(
    T_last: FloatArray, T_now: FloatArray, share: float
) -> tuple[FloatArray, FloatArray]:
    """Return the poses half of ``share`` of the last motion before and after the present pose."""
    turn, _ = cv2.Rodrigues(T_last[:3, :3].T @ T_now[:3, :3])
    shift = T_now[:3, 3] - T_last[:3, 3]
    poses = []
    for half in (-0.5 * share, 0.5 * share):
        pose = np.array(T_now)
        pose[:3, :3] = T_now[:3, :3] @ cv2.Rodrigues(half * turn)[0]
        pose[:3, 3] += half * shift
        poses.append(pose)
    return poses[0], poses[1]
