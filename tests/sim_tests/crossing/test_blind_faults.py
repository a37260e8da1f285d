"""Scanners without answers and black pictures: what arrives at the robot, and when it begins."""

import math

import numpy as np
import pytest
from watching_cameras import Watching, world_at

from perception import Camera
from perception.laser import LaserScan
from sim_tests import Scenario, run_crossing
from sim_tests.crossing.faults import EpisodeFaults, Fault
from sim_tests.crossing.sensors import Delivery, MountedScan
from sim_tests.world.camera import CameraTiming
from sim_tests.world.scanner import ScannerSpec

ROUND = ScannerSpec(x_m=0.0, field_of_view_deg=(-180.0, 180.0), resolution_deg=1.0)
CAMERA = Camera.from_fov(640, 480, math.radians(90.0))
NO_ANSWERS = {
    "inf": math.inf,
    "minus_inf": -math.inf,
    "nan": math.nan,
    "zero": 0.0,
    "below_min": 0.025,
    "above_max": 40.0,
}


def scans_of(fault: Fault, seed: int = 0, seconds: float = 11.0) -> dict[int, list[np.ndarray]]:
    """Return the ranges of each scan of two scanners, ten a second; all rays measure 5 m."""
    faults = EpisodeFaults(fault, seed, CAMERA)
    changes = [faults.scans(number, ROUND, np.zeros((0, 2))) for number in (0, 1)]
    found: dict[int, list[np.ndarray]] = {0: [], 1: []}
    for n in range(round(seconds * 10)):
        t_s = 0.1 * n
        scan = LaserScan(t_s, -math.pi, math.radians(1.0), np.full(360, 5.0), 0.05, 20.0)
        for number, change in enumerate(changes):
            taken = Delivery(MountedScan(scan, ROUND.scanner()), t_s, t_s, np.eye(4))
            changed = taken if change is None else change(taken)
            assert changed is not None, "a blind scanner goes on publishing"
            found[number].append(changed.message.scan.ranges_m)
    return found


def begins(ranges: list[np.ndarray]) -> int:
    return next(n for n, each in enumerate(ranges) if not (each == 5.0).all())


def test_from_a_drawn_time_on_no_ray_of_any_scanner_has_an_answer():
    starts, forms = [], set()
    for seed in range(30):
        first, second = scans_of(Fault.shipped("scanner_blind"), seed).values()
        start = begins(first)
        assert begins(second) == start
        for each in (*first[start:], *second[start:]):
            np.testing.assert_array_equal(each, np.full(360, first[start][0]))
        forms |= {
            name
            for name, value in NO_ANSWERS.items()
            if np.array_equal(first[start], np.full(360, value), equal_nan=True)
        }
        starts.append(start)
    assert forms == set(NO_ANSWERS)
    assert min(starts) < 15
    assert max(starts) > 85


@pytest.mark.parametrize("form", NO_ANSWERS)
def test_time_form_and_scanner_can_be_set(form):
    blind = {"width_deg": 360.0, "returns": form, "after_s": 2.0}
    first, second = scans_of(Fault(scanner={"only": 2, "blind": blind}), 5).values()
    assert all((each == 5.0).all() for each in first)
    assert begins(second) == 20
    np.testing.assert_array_equal(second[20], np.full(360, NO_ANSWERS[form]))
    # None of them is a measurement.
    scan = LaserScan(0.0, -math.pi, math.radians(1.0), second[20], 0.05, 20.0)
    assert not scan.measured.any()


def test_a_sector_is_blind_from_its_time_on():
    blind = {"width_deg": 90.0, "at_deg": 0.0, "returns": "nan", "after_s": 1.0}
    (ranges, _) = scans_of(Fault(scanner={"blind": blind})).values()
    assert [int(np.isnan(each).sum()) for each in ranges[9:12]] == [0, 91, 91]


class Watcher:
    """Sees nobody, and counts its images."""

    def __init__(self) -> None:
        self.images = 0

    def observe(self, world):
        self.images += 1
        return ()


def arrivals(fault: Fault, seed: int = 0, seconds: float = 11.0) -> list[float]:
    """Return the stamps of the images that arrive."""
    faults = EpisodeFaults(fault, seed, CAMERA)
    camera = Watching(Watcher(), faults, CameraTiming(latency_s=0.3))
    stamps = []
    for n in range(round(seconds * 10)):
        seen = camera.look(world_at(0.1 * n))
        stamps += [each.stamp_s for each in seen]
    return stamps


def test_from_a_drawn_time_on_no_image_arrives():
    lasts = [arrivals(Fault.shipped("black_camera"), seed)[-1] for seed in range(30)]
    assert min(lasts) < 2.0
    assert 8.0 < max(lasts) <= 10.0
    assert arrivals(Fault(black_camera={"after_s": 4.0}))[-1] == pytest.approx(3.9)
    assert arrivals(Fault(black_camera={})) == []
    assert arrivals(Fault())[-1] == pytest.approx(10.6)


MET = Scenario.shipped("head_on_in_aisle")


@pytest.mark.parametrize("views_deg", [(0.0,), pytest.param((0.0, 90.0), marks=pytest.mark.full)])
def test_a_black_picture_is_no_view_for_the_judgement_of_real_pictures(views_deg):
    camera = MET.camera.model_copy(update={"views_deg": views_deg})
    scenario = MET.model_copy(update={"duration_s": 2.0, "camera": camera})
    fault = Fault(name="black", black_camera={"after_s": 0.5})
    result = run_crossing(scenario, policy="balanced", perception="pixels", fault=fault)
    assert not any(frame.constraints.stale for frame in result.frames if 0.1 < frame.t_s < 0.5)
    assert result.frames[-1].constraints.stale
    assert result.frames[-1].constraints.speed_limit_mps == 0.0


def stops(result):
    """Assert that the robot drove, and stands 3.5 s after it went blind at 2 s."""
    assert max(frame.robot_state.speed_mps for frame in result.frames) > 0.5
    late = [frame for frame in result.frames if frame.t_s > 3.6]
    assert all(frame.constraints.speed_limit_mps == 0.0 for frame in late)
    assert result.frames[-1].robot_state.travel_mps < 0.05
    assert not any(frame.observations for frame in late)


@pytest.mark.parametrize("perception", ["truth", "keypoints"])
def test_the_robot_stops_once_its_only_camera_shows_nothing(perception):
    scenario = MET.model_copy(update={"duration_s": 5.5})
    fault = Fault(name="black", black_camera={"after_s": 2.0})
    stops(run_crossing(scenario, policy="balanced", perception=perception, fault=fault))


@pytest.mark.parametrize(
    ("width_deg", "form"), [(360.0, "inf"), (360.0, "zero"), (360.0, "above_max"), (100.0, "nan")]
)
def test_a_robot_with_scanners_that_are_blind_ahead_stops(width_deg, form):
    """Whatever a driver writes for no answer: it is not a view of nobody."""
    blind = {"width_deg": width_deg, "at_deg": 0.0, "returns": form, "after_s": 2.0}
    result = run_crossing(
        MET.model_copy(update={"duration_s": 5.5}),
        policy="balanced",
        perception="scanner",
        fault=Fault(name="blind", scanner={"blind": blind}),
    )
    stops(result)
