"""The simulated camera: renderer, sensor and timing together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from camera_poses import level_pose
from visual_actors import ball

from perception import Camera
from sim_tests import SimError
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer, CameraTiming, SensorConfig, SimulatedCamera
from sim_tests.world.hall import WarehouseLayout

CAMERA = Camera(96, 72, 90.0, 90.0, 47.5, 35.5)


@pytest.fixture(scope="module")
def hall() -> Iterator[Warehouse]:
    with Warehouse(WarehouseLayout.open_floor()) as warehouse:
        warehouse.visuals.add_actor(ball(0.25, position_m=(2.0, 0.3, 1.4), kind="person"))
        warehouse.visuals.add_actor(ball(0.25, position_m=(2.0, -0.3, 1.4)))
        yield warehouse


def test_a_perfect_camera_shows_what_the_renderer_draws(hall: Warehouse) -> None:
    pose = level_pose((0.0, 0.0, 1.4), 0.0)
    (frame,) = SimulatedCamera(hall, CAMERA).tick(3.0, pose)
    view = CameraRenderer(hall).render(CAMERA, pose)
    assert frame.stamp_s == 3.0
    np.testing.assert_array_equal(frame.T_odom_camera, pose)
    np.testing.assert_array_equal(frame.rgb, view.rgb)
    np.testing.assert_array_equal(frame.depth_m, view.depth_m)
    # Both balls are visible, and one of them is a person.
    np.testing.assert_array_equal(frame.person_mask, view.actors == 0)
    assert frame.person_mask.any()
    assert (view.actors == 1).any()


def test_a_late_frame_keeps_the_stamp_and_the_pose_of_its_capture(hall: Warehouse) -> None:
    timing = CameraTiming(rate_hz=10.0, latency_s=0.12, drop_rate=0.3)
    camera = SimulatedCamera(hall, CAMERA, timing=timing, rng=np.random.default_rng(4))
    received = []
    for tick in range(60):
        now = tick / 20.0
        for frame in camera.tick(now, level_pose((0.01 * tick, 0.0, 1.4), 0.0)):
            assert now - frame.stamp_s == pytest.approx(0.15)  # the tick after 0.12 s
            assert frame.T_odom_camera[0, 3] == pytest.approx(0.01 * 20.0 * frame.stamp_s)
            received.append(frame.stamp_s)
    assert received == sorted(received)
    assert 12 <= len(received) < 29  # of 29 that had time to arrive


def test_a_turning_camera_smears_along_the_turn_only(hall: Warehouse) -> None:
    sensor = SensorConfig(motion_blur=True, exposure_s=0.03)
    camera = SimulatedCamera(hall, CAMERA, sensor=sensor)
    sharp = camera.capture(0.0, level_pose((0.0, 0.0, 1.4), 0.0))  # there is no earlier capture
    still = camera.capture(0.05, level_pose((0.0, 0.0, 1.4), 0.0))
    np.testing.assert_array_equal(sharp.rgb, still.rgb)
    camera.capture(0.10, level_pose((0.0, 0.0, 1.4), -0.06))
    turning = camera.capture(0.15, level_pose((0.0, 0.0, 1.4), 0.0))

    def detail(rgb: np.ndarray, axis: int) -> float:
        return float(np.abs(np.diff(rgb.astype(float), axis=axis)).mean())

    # 0.06 rad in 0.05 s is 3 px in the 0.03 s of the exposure.
    across, along = (detail(turning.rgb, axis) / detail(sharp.rgb, axis) for axis in (0, 1))
    assert along < 0.7
    assert along < 0.9 * across
    # Depth and masks are those of the middle of the exposure.
    np.testing.assert_array_equal(turning.depth_m, sharp.depth_m)


def test_the_velocity_of_an_actor_is_estimated_between_frames() -> None:
    with Warehouse(WarehouseLayout.open_floor()) as hall:
        actor = ball(0.25, position_m=(2.0, 0.0, 1.4), colour=(0.9, 0.1, 0.1))
        hall.visuals.add_actor(actor)
        sensor = SensorConfig(motion_blur=True, exposure_s=0.05)
        pose = level_pose((0.0, 0.0, 1.4), 0.0)
        camera = SimulatedCamera(hall, CAMERA, sensor=sensor)
        actor.position_m[1] = -0.1
        camera.capture(0.0, pose)
        actor.position_m[1] = 0.0
        estimated = camera.capture(0.1, pose)
        given = SimulatedCamera(hall, CAMERA, sensor=sensor).capture(0.1, pose, {0: (0.0, 1.0)})
        np.testing.assert_array_equal(estimated.rgb, given.rgb)
        sharp = SimulatedCamera(hall, CAMERA).capture(0.1, pose)
        changed = (estimated.rgb != sharp.rgb).any(axis=2)
        assert changed.any()
        # The ball reaches 11.25 px from the middle and moves by 2.25 px.
        rows, columns = np.nonzero(changed)
        assert np.abs(columns - 47.5).max() < 11.25 + 4.0
        assert np.abs(rows - 35.5).max() < 11.25 + 2.0


def test_noise_and_delays_are_seeded_and_independent(hall: Warehouse) -> None:
    pose = level_pose((0.0, 0.0, 1.4), 0.0)
    noise = SensorConfig(shot_noise=True, read_noise_e=4.0)

    def stamps_and_images(sensor: SensorConfig) -> tuple[list[float], list[bytes]]:
        camera = SimulatedCamera(
            hall,
            CAMERA,
            sensor=sensor,
            timing=CameraTiming(drop_rate=0.5),
            rng=np.random.default_rng(9),
        )
        frames = [frame for k in range(20) for frame in camera.tick(0.1 * k, pose)]
        return [frame.stamp_s for frame in frames], [frame.rgb.tobytes() for frame in frames]

    noisy, again, clean = (
        stamps_and_images(noise),
        stamps_and_images(noise),
        stamps_and_images(SensorConfig()),
    )
    assert noisy == again
    assert noisy[0] == clean[0]
    assert len(set(noisy[1])) == len(noisy[1])
    assert len(set(clean[1])) == 1


def test_noise_and_delays_without_a_generator_are_refused(hall: Warehouse) -> None:
    with pytest.raises(SimError, match="rng"):
        SimulatedCamera(hall, CAMERA, sensor=SensorConfig(shot_noise=True))
    with pytest.raises(SimError, match="rng"):
        SimulatedCamera(hall, CAMERA, timing=CameraTiming(drop_rate=0.1))
