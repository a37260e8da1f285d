"""The watch over the sensors: what is lost, and whether the rest sees what the camera saw."""

from __future__ import annotations

import math

import numpy as np
import pytest
from bridge_scenes import Listener
from hypothesis import given, settings
from hypothesis import strategies as st
from scan_scenes import planar

from nav_adapter import NavError
from nav_adapter.ros2 import CameraMount, ScannerInput
from nav_adapter.ros2._sensor_watch import SensorWatch
from perception import Camera
from perception.laser import LaserScan, Scanner, sight_of

CAMERA = Camera.from_fov(640, 480, math.radians(90.0))
AHEAD = CameraMount(position_base_m=[0.2, 0.0, 1.4]).T_base_camera()


def looking(yaw_deg: float = 0.0, pitch_deg: float = 0.0) -> SensorWatch:
    """Return a watch over two scanners and a camera that has sent one image at 0 s."""
    watch = SensorWatch(("one", "two"), with_camera=True, lost_after_s=0.5)
    mount = CameraMount(position_base_m=[0, 0, 1.4], yaw_deg=yaw_deg, pitch_down_deg=pitch_deg)
    watch.saw_image(0.0, CAMERA, mount.T_base_camera())
    return watch


def scanned(
    watch: SensorWatch,
    number: int,
    stamp_s: float,
    yaw_deg: float,
    field_deg: float,
    dead_deg: tuple[float, float] | None = None,
) -> None:
    """Note a scan; the rays between two angles from its middle have no answer."""
    rays = math.ceil(2.0 * field_deg)
    step_deg = field_deg / rays
    angles_deg = step_deg * (np.arange(rays) + 0.5) - 0.5 * field_deg
    ranges = np.full(rays, 5.0)
    if dead_deg is not None:
        ranges[(angles_deg >= dead_deg[0]) & (angles_deg <= dead_deg[1])] = 0.0
    scan = LaserScan(
        stamp_s, math.radians(angles_deg[0]), math.radians(step_deg), ranges, 0.05, 20.0
    )
    scanner = Scanner(planar(0.3, 0.2, math.radians(yaw_deg)))
    watch.saw_scan(number, stamp_s, sight_of(scan, scanner))


@settings(max_examples=40)
@given(st.floats(-180.0, 180.0), st.floats(-180.0, 180.0), st.floats(1.0, 360.0))
def test_one_scanner_replaces_the_camera_if_it_sees_all_of_its_field(yaw, other, field) -> None:
    watch = looking(yaw)
    scanned(watch, 0, 5.0, other, field)
    off = abs(math.remainder(math.radians(other - yaw), math.tau))
    slack = 0.5 * math.radians(field) - off - math.radians(45.0)
    if field >= 359.9 or slack > 1e-3:
        assert watch.stamp_s == 5.0
    elif slack < -math.radians(1.0):
        assert watch.stamp_s == 0.0


@pytest.mark.parametrize(("pitch_deg", "covered"), [(0.0, True), (30.0, False), (85.0, False)])
def test_a_camera_that_looks_down_sees_more_directions(pitch_deg: float, covered: bool) -> None:
    watch = looking(pitch_deg=pitch_deg)
    scanned(watch, 0, 5.0, 0.0, 92.0)
    assert (watch.stamp_s == 5.0) is covered
    scanned(watch, 0, 5.0, 0.0, 360.0)
    assert watch.stamp_s == 5.0


def test_two_scanners_together_are_as_old_as_the_older() -> None:
    watch = looking()
    scanned(watch, 0, 7.0, 40.0, 90.0)
    assert watch.stamp_s == 0.0
    scanned(watch, 1, 6.0, -40.0, 90.0)
    assert watch.stamp_s == 6.0
    # One that sees everything needs no second.
    scanned(watch, 0, 7.0, 40.0, 350.0)
    assert watch.stamp_s == 7.0
    # A late scan makes nothing older.
    scanned(watch, 0, 6.5, 40.0, 350.0)
    assert watch.stamp_s == 7.0
    # The camera itself is always enough.
    watch.saw_image(9.0, CAMERA, AHEAD)
    assert watch.stamp_s == 9.0


def test_without_a_camera_scanners_must_see_ahead() -> None:
    watch = SensorWatch(("one", "two"), with_camera=False, lost_after_s=0.5)
    scanned(watch, 0, 1.0, 180.0, 230.0)
    assert watch.stamp_s is None
    scanned(watch, 1, 1.5, 0.0, 130.0)
    assert watch.stamp_s == 1.5


def test_a_blind_sector_is_as_old_as_the_last_scan_that_saw_it() -> None:
    watch = SensorWatch(("one", "two"), with_camera=False, lost_after_s=0.5)
    scanned(watch, 0, 1.0, 0.0, 270.0)
    scanned(watch, 1, 1.0, 180.0, 270.0)
    assert watch.stamp_s == 1.0
    scanned(watch, 0, 1.2, 0.0, 270.0, (-70.0, -30.0))
    scanned(watch, 1, 1.2, 180.0, 270.0)
    assert watch.stamp_s == 1.0
    assert watch.blind_text == "one: blind from -70° to -30°"
    assert watch.lost(1.2) == ()
    # Beside what must be seen it changes nothing.
    scanned(watch, 0, 1.4, 0.0, 270.0, (80.0, 110.0))
    assert watch.stamp_s == 1.4
    # Another scanner that sees there is enough.
    scanned(watch, 0, 1.6, 0.0, 270.0, (-70.0, -30.0))
    scanned(watch, 1, 1.5, 0.0, 270.0)
    assert watch.stamp_s == 1.5


@pytest.mark.parametrize(
    "names", [("camera",), ("depth images",), ("scan", "scan"), ("front", "camera")]
)
def test_a_scanner_with_the_name_of_another_sensor_is_refused(names) -> None:
    for with_camera in (False, True):
        with pytest.raises(NavError, match=f"name of its own.*got {names[-1]!r} again"):
            SensorWatch(names, with_camera=with_camera, lost_after_s=0.5)
    with pytest.raises(NavError, match="name of its own"):
        Listener(scanners=[ScannerInput(name) for name in names])


scans = st.lists(
    st.tuples(st.integers(0, 2), st.floats(0.0, 9.0), st.floats(-180.0, 180.0)), max_size=8
)


@settings(max_examples=30)
@given(scans, st.permutations(["one", "two", "three"]), st.text("/_", min_size=1), st.randoms())
def test_order_and_names_of_the_sensors_do_not_matter(seen, order, prefix, random) -> None:
    """Nor does the order of scans with their stamps: what is seen depends on the stamps alone."""
    found = []
    for names in (["one", "two", "three"], [prefix + name for name in order]):
        watch = SensorWatch(names, with_camera=True, lost_after_s=0.5)
        plain = {name.removeprefix(prefix): name for name in names} if names[0] != "one" else {}
        notes = [("camera", 4.0, 0.0), *seen]
        random.shuffle(notes)
        for who, stamp_s, yaw_deg in notes:
            if who == "camera":
                watch.saw_image(stamp_s, CAMERA, AHEAD)
            else:
                name = ["one", "two", "three"][who]
                scanned(watch, names.index(plain.get(name, name)), stamp_s, yaw_deg, 120.0)
        sectors = [watch.seen.stamp_s(0.3 * k - 3.0, 0.2) for k in range(20)]
        lost = {name.removeprefix(prefix) if plain else name for name in watch.lost(5.0)}
        found.append((watch.stamp_s, sectors, lost))
    assert found[0] == found[1]


def test_the_loss_of_every_sensor_is_seen_and_its_return() -> None:
    watch = SensorWatch(("one", "two"), with_camera=True, with_depth=True, lost_after_s=0.5)

    def all_but(silent: str, now_s: float) -> None:
        if silent != "camera":
            watch.saw_image(now_s, CAMERA, AHEAD)
        if silent != "depth images":
            watch.saw_depth(now_s)
        for number, name in enumerate(("one", "two")):
            if silent != name:
                scanned(watch, number, now_s, 0.0, 360.0)

    all_but("", 0.0)
    for start_s, silent in enumerate(("camera", "depth images", "one", "two")):
        all_but(silent, start_s + 0.9)
        assert watch.lost(start_s + 0.9) == (silent,)
        (line,) = watch.news(start_s + 0.9)
        has, is_ = ("have", "are") if silent == "depth images" else ("has", "is")
        assert line.startswith(f"{silent} {has} been silent for")
        assert watch.news(start_s + 0.9) == []
        all_but("", start_s + 1.0)
        assert watch.news(start_s + 1.0) == [f"{silent} {is_} back"]


@given(st.floats(-180.0, 180.0), st.floats(-math.pi, math.pi), st.floats(0.0, 1.0))
def test_a_direction_is_seen_by_the_sensors_that_look_there(yaw_deg, bearing, half) -> None:
    """The field of the camera is noted as that of a scanner is."""
    watch = looking(yaw_deg)
    off = abs(math.remainder(bearing - math.radians(yaw_deg), math.tau))
    slack = math.radians(45.0) - off - half
    seen_s = watch.seen.stamp_s(bearing, half)
    if abs(slack) > math.radians(1.0):
        assert seen_s == (0.0 if slack > 0.0 else None)
    scanned(watch, 0, 3.0, 0.0, 360.0)
    assert watch.seen.stamp_s(bearing, half) == 3.0
