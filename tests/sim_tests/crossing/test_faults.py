"""Faults do what they describe, and a fault of strength zero does nothing."""

import math

import numpy as np
import pytest
import yaml
from watching_cameras import Watching, world_at

from nav_adapter import RobotState
from perception import Camera, PersonObservation
from sim_tests import Scenario, SimError, run_crossing
from sim_tests.crossing._sensing import Odometry
from sim_tests.crossing.faults import EpisodeFaults, Fault, shipped_faults
from sim_tests.crossing.sensors import Delivery, OdometryReading, Sighting

CAMERA = Camera.from_fov(640, 480, math.radians(90.0))
# Looks along odom x, 1 m above the floor.
T_ODOM_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]]
)
ATTENTIVE = Scenario.shipped("crossing_attentive").model_copy(update={"duration_s": 4.0})


def observation(stamp_s=0.0, awareness=0.5, std=0.1, x_m=4.0):
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=[0.0, 0.0, x_m],
        position_covariance_m2=0.01 * np.eye(3),
        gaze_camera=None,
        awareness=awareness,
        awareness_std=None if awareness is None else std,
        score=0.9,
    )


class Walker:
    """Sees one person, who approaches at 1 m/s from 100 m."""

    def observe(self, world):
        return ((observation(world.t_s, x_m=100.0 - world.t_s), 0),)


def looks(fault, seconds=30.0, rate_hz=20.0, seed=0):
    """Return time and sightings of each tick of faulty eyes."""
    faults = EpisodeFaults(fault, seed, CAMERA)
    camera = Watching(Walker(), faults)
    ticks = np.arange(round(seconds * rate_hz)) / rate_hz
    return [(float(t), camera.look(world_at(float(t), T_ODOM_CAMERA))) for t in ticks]


def detections(fault, seed=0):
    """Return a function of true observations and a time that gives the faulty ones."""
    change = EpisodeFaults(fault, seed, CAMERA).images()

    def apply(observations, t_s):
        sighting = Sighting(t_s, T_ODOM_CAMERA, tuple(observations))
        return change(Delivery(sighting, t_s, t_s, T_ODOM_CAMERA)).message.observations

    return apply


def trace(result):
    return [
        (
            frame.t_s,
            frame.command,
            frame.robot_state.position_odom_m.tobytes(),
            [
                (track.id, track.awareness, track.position_odom_m.tobytes())
                for track in frame.tracks
            ],
            frame.constraints.speed_limit_mps,
        )
        for frame in result.frames
    ]


@pytest.mark.parametrize("perception", ["truth", "keypoints"])
def test_a_fault_of_strength_zero_changes_nothing_bit_for_bit(perception):
    zero = Fault(
        name="zero",
        miss_rate=0.0,
        bursts={"for_s": 0.0, "every_s": 1.0},
        ghosts={"rate_hz": 0.0, "for_s": 5.0},
        awareness_bias=0.0,
        frozen_camera={"for_s": 0.0, "every_s": 0.1},
        latency_s=0.0,
        odometry_delay_s=0.0,
        lost_odometry={"for_s": 0.0, "every_s": 0.1},
    )
    assert len(zero.faults) == 8
    options = {"policy": "balanced", "perception": perception, "seed": 3}
    scenario = ATTENTIVE.model_copy(update={"duration_s": 1.5})
    plain = trace(run_crossing(scenario, **options))
    assert trace(run_crossing(scenario, fault=zero, **options)) == plain
    assert trace(run_crossing(scenario, fault=Fault(miss_rate=0.9), **options)) != plain


def test_a_fault_depends_on_its_seed_alone():
    fault = Fault(name="half", miss_rate=0.5, drop_rate=0.2, ghosts={"rate_hz": 1.0})

    def seen(seed):
        return [[s.stamp_s for s in sightings] for _, sightings in looks(fault, 3.0, seed=seed)]

    assert seen(1) == seen(1)
    assert seen(1) != seen(2)


def test_shipped_faults_are_named_after_their_files_and_round_trip(tmp_path):
    assert {
        "misses_30", "latency_300ms", "frozen_camera", "wrong_pitch_5deg", "biased_alpha", "ghosts",
        "bursts", "lost_odometry", "overconfident_alpha",
    } <= set(shipped_faults())  # fmt: skip
    for name in shipped_faults():
        fault = Fault.shipped(name)
        assert fault.name == name
        assert fault.description
        assert fault != Fault(name=name, description=fault.description)
        assert Fault.model_validate(yaml.safe_load(fault.to_text())) == fault
        fault.to_yaml(tmp_path / "fault.yaml")
        assert Fault.of(str(tmp_path / "fault.yaml")) == fault


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"text": "mis_rate: 0.3"}, "did you mean 'miss_rate'"),
        ({"text": "miss_rate: 1.3"}, "less than or equal to 1"),
        ({"text": "frozen_camera: {for_s: 3.0, every_s: 2.0}"}, "for_s must be shorter than"),
        ({"text": "name: a b"}, "name"),
        ({"text": "scanner: {blind: {returns: nothing}}"}, "returns"),
        ({"name": "misses_3"}, "did you mean 'misses_30'"),
        ({"name": "ghosts+scanner_lat"}, "did you mean 'scanner_late'"),
        ({"text": "scanner: {blind: {width: 3.0}}"}, "scanner.blind: unknown key 'width'"),
        ({"text": "scanner: {late_s: 3.0}"}, "unknown key 'late_s' in scanner"),
        ({"text": "scanner: 3"}, "scanner must be a mapping"),
        ({"text": "faults: {ghosts: {}}"}, "faults must be a list"),
        ({"text": "faults: [{gosts: {}}]"}, "did you mean 'ghosts'"),
        ({"text": "bursts: 3"}, "bursts: .*got 3"),
        ({"text": "drop_rate: yes"}, "drop_rate must be a number"),
    ],
)
def test_impossible_faults_are_refused(given, message, tmp_path):
    path = tmp_path / "fault.yaml"
    path.write_text(given.get("text", ""))
    with pytest.raises(SimError, match=message):
        Fault.of(given.get("name", str(path)))


@pytest.mark.parametrize(
    "names",
    [
        "ghosts+scanner_late",
        "scanner_late+ghosts",
        "ghosts+ghosts",
        "scanner_one_dead+scanner_late",
        "scanner_frozen+scanner_frozen_old_stamps+misses_30",
        "FILE+scanner_late",
    ],
)
def test_several_faults_act_one_after_the_other(names, tmp_path):
    path = tmp_path / "mine.yaml"
    Fault(name="mine", latency_s=0.1, scanner={"only": 2, "drop_rate": 0.1}).to_yaml(path)
    joined = Fault.of(names.replace("FILE", str(path)))
    parts = [Fault.of(part.replace("FILE", str(path))) for part in names.split("+")]
    assert joined.name == names.replace("FILE", "mine")
    assert joined.faults == tuple(each for part in parts for each in part.faults)
    assert Fault.model_validate(yaml.safe_load(joined.to_text())) == joined


def test_faults_of_one_kind_add_up_and_draw_from_streams_of_their_own():
    fault = Fault(name="third", miss_rate=1.0 / 3.0)
    seen = [(observation(), index) for index in range(1000)]
    (once, twice) = (detections(each)(seen, 0.0) for each in (fault, fault.then(fault)))
    assert {index for _, index in twice} < {index for _, index in once}
    assert len(twice) / 1000 == pytest.approx(4.0 / 9.0, abs=4.0 * math.sqrt(0.25 / 1000))


def test_the_order_of_two_faults_counts():
    """A biased α is clipped before or after another bias."""
    up, down = Fault(name="up", awareness_bias=0.9), Fault(name="down", awareness_bias=-0.5)
    for fault, expected in ((up.then(down), 0.5), (down.then(up), 0.9)):
        ((seen, _),) = detections(fault)([(observation(awareness=0.5), 0)], 0.0)
        assert seen.awareness == pytest.approx(expected)


def test_a_fault_draws_the_same_beside_others():
    ghosts, misses = Fault.shipped("ghosts"), Fault.shipped("misses_30")
    alone, beside = detections(ghosts), detections(misses.then(ghosts))
    seen = [(observation(), 0)]
    for n in range(200):
        shown = [
            [each.position_camera_m.tolist() for each, index in apply(seen, 0.05 * n) if index < 0]
            for apply in (alone, beside)
        ]
        assert shown[0] == shown[1]


def test_the_miss_rate_is_the_share_of_lost_observations():
    apply = detections(Fault(miss_rate=0.3))
    seen = ((observation(), 0), (observation(), 1))
    remaining = [len(apply(seen, 0.05 * n)) for n in range(4000)]
    share = 1.0 - np.mean(remaining) / 2.0
    assert share == pytest.approx(0.3, abs=4.0 * math.sqrt(0.3 * 0.7 / 8000))
    # Losses are independent: the number lost of two is binomial.
    assert remaining.count(0) / 4000 == pytest.approx(0.09, abs=4.0 * math.sqrt(0.09 * 0.91 / 4000))


def test_bursts_hide_a_person_for_their_share_of_the_time_independent_of_others():
    fault = Fault(bursts={"for_s": 0.5, "every_s": 2.0})

    def hidden(people):
        apply = detections(fault, seed=1)
        seen = tuple((observation(), index) for index in people)
        frames = (apply(seen, 0.05 * n) for n in range(40_000))
        return np.array([all(index != people[-1] for _, index in frame) for frame in frames])

    alone, beside = hidden((4,)), hidden((1, 4))
    np.testing.assert_array_equal(alone, beside)
    # 2000 s hold 800 cycles of mean 2.5 s; the share's deviation follows from both exponentials.
    assert alone.mean() == pytest.approx(0.2, abs=4.0 * math.sqrt(2.0 * 0.16**2 / 800))
    stretches = np.split(alone, np.flatnonzero(np.diff(alone.astype(int))) + 1)
    lengths_s = [0.05 * len(stretch) for stretch in stretches if stretch[0]]
    assert np.mean(lengths_s) == pytest.approx(0.5, abs=4.0 * 0.5 / math.sqrt(700))


def test_the_number_of_ghosts_follows_littles_law_and_they_stand_in_view():
    fault = Fault(ghosts={"rate_hz": 2.0, "for_s": 0.5})
    apply = detections(fault, seed=2)
    frames = [apply((), 0.05 * n) for n in range(20_000)]
    # At each time a Poisson number of mean 1 is present; it is correlated over about 2 · 0.5 s.
    assert np.mean([len(frame) for frame in frames]) == pytest.approx(
        1.0, abs=4.0 / math.sqrt(1000)
    )
    ghosts = [ghost for frame in frames for ghost in frame]
    assert {index for _, index in ghosts} == {-1}
    positions = np.array([ghost.position_camera_m for ghost, _ in ghosts])
    assert (np.abs(positions[:, 0]) <= positions[:, 2] + 1e-9).all()
    ranges = np.hypot(positions[:, 0], positions[:, 2])
    assert ranges.min() > 0.7
    assert ranges.max() < 8.3
    np.testing.assert_allclose(positions[:, 1], 1.0 - 1.3, atol=0.3)
    faces = [ghost.awareness is not None for ghost, _ in ghosts]
    assert 0.4 < np.mean(faces) < 0.6


@pytest.mark.parametrize(
    ("awareness", "bias", "expected"),
    [(0.5, 0.3, 0.8), (0.9, 0.3, 1.0), (0.1, -0.3, 0.0), (None, 0.3, None)],
)
def test_a_bias_is_added_and_clipped_but_creates_no_evidence(awareness, bias, expected):
    fault = Fault(awareness_bias=bias, awareness_std_factor=0.5)
    ((seen, _),) = detections(fault)([(observation(awareness=awareness), 0)], 0.0)
    assert seen.awareness == (None if expected is None else pytest.approx(expected))
    assert seen.awareness_std == (None if expected is None else pytest.approx(0.05))


def test_latency_delays_every_image_and_keeps_its_stamp():
    for t_s, sightings in looks(Fault(latency_s=0.3), 5.0):
        assert [s.stamp_s for s in sightings] == ([] if t_s < 0.299 else [pytest.approx(t_s - 0.3)])


def test_dropped_images_never_arrive():
    arrived = sum(len(sightings) for _, sightings in looks(Fault(drop_rate=0.3), 200.0))
    assert arrived / 4000 == pytest.approx(0.7, abs=4.0 * math.sqrt(0.21 / 4000))


@pytest.mark.parametrize("fresh", [True, False])
def test_a_frozen_camera_repeats_its_last_image(fresh):
    fault = Fault(frozen_camera={"for_s": 1.0, "every_s": 10.0, "fresh_stamps": fresh})
    frozen = 0
    last_true_s = None
    for t_s, (sighting,) in looks(fault, 40.0, seed=1):  # the last outage ends before 40 s
        ((seen, _),) = sighting.observations
        taken_s = 100.0 - seen.position_camera_m[2]
        assert seen.stamp_s == sighting.stamp_s
        if taken_s == pytest.approx(t_s):
            last_true_s = t_s
            assert sighting.stamp_s == t_s
        else:
            frozen += 1
            assert taken_s == pytest.approx(last_true_s)
            assert sighting.stamp_s == (t_s if fresh else last_true_s)
    assert frozen == 4 * 20


def known_states(fault, seconds=25.0):
    odometry = Odometry(EpisodeFaults(fault, 5, CAMERA).odometry())
    for n in range(round(seconds * 20)):
        t_s = n / 20
        state = RobotState(t_s, [t_s, 0.0], 0.0, 1.0, 0.0)
        T = np.array(T_ODOM_CAMERA)
        T[0, 3] = t_s
        yield t_s, odometry.take(OdometryReading(state, T))


def test_delayed_odometry_has_its_true_stamp():
    for t_s, known in known_states(Fault(odometry_delay_s=0.2)):
        assert known.state.stamp_s == pytest.approx(max(t_s - 0.2, 0.0))
        assert known.state.position_odom_m[0] == pytest.approx(max(t_s - 0.2, 0.0))
        assert known.T_odom_camera[0, 3] == known.state.position_odom_m[0]


@pytest.mark.parametrize("fresh", [True, False])
def test_lost_odometry_stays_at_the_last_known_pose(fresh):
    fault = Fault(lost_odometry={"for_s": 2.0, "every_s": 10.0, "fresh_stamps": fresh})
    lost = [
        (t_s, known)
        for t_s, known in known_states(fault, 20.0)
        if known.state.position_odom_m[0] != t_s
    ]
    # The first instant of an outage may coincide with the last message.
    assert 2 * 38 <= len(lost) <= 2 * 40
    for t_s, known in lost:
        assert known.T_odom_camera[0, 3] == known.state.position_odom_m[0]
        assert known.state.stamp_s == (t_s if fresh else known.state.position_odom_m[0])


@pytest.mark.parametrize(
    ("pitch_deg", "yaw_deg", "axis"),
    [
        (5.0, 0.0, [math.cos(math.radians(5)), 0.0, math.sin(math.radians(5))]),
        (0.0, 5.0, [math.cos(math.radians(5)), math.sin(math.radians(5)), 0.0]),
    ],
)
def test_a_mounting_error_turns_the_assumed_camera_up_and_left(pitch_deg, yaw_deg, axis):
    fault = Fault(pitch_error_deg=pitch_deg, yaw_error_deg=yaw_deg)
    odometry = Odometry(EpisodeFaults(fault, 0, CAMERA).odometry())
    state = RobotState(0.0, [0.0, 0.0], 0.0, 0.0, 0.0)
    assumed = odometry.take(OdometryReading(state, T_ODOM_CAMERA)).T_odom_camera
    np.testing.assert_allclose(assumed[:3, 2], axis, atol=1e-12)
    np.testing.assert_allclose(assumed[:3, 3], T_ODOM_CAMERA[:3, 3])
    np.testing.assert_allclose(assumed[:3, :3] @ assumed[:3, :3].T, np.eye(3), atol=1e-12)


def test_the_robot_acts_on_faulty_odometry_and_frames_keep_the_truth():
    """After a second without odometry everybody counts as unaware and the robot stops."""
    fault = Fault(lost_odometry={"for_s": 9.9, "every_s": 10.0, "fresh_stamps": False})
    options = {"policy": "balanced", "seed": 0}
    plain, broken = (
        run_crossing(ATTENTIVE, **options),
        run_crossing(ATTENTIVE, fault=fault, **options),
    )
    stale = [frame for frame in broken.frames if frame.constraints.stale]
    assert stale
    assert stale[-1].constraints.speed_limit_mps == 0.0
    assert not any(frame.constraints.stale for frame in plain.frames)
    for frame in broken.frames:
        assert frame.robot_state.stamp_s == frame.t_s
