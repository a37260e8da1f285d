"""``PersonTrack.moved_m``: an upper bound of how far a person is from where they stood."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

import numpy as np
import pytest
from fusion_scenes import everything, laser_at
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_scenes import FloatArray, camera_at, nearest, observe

from perception import PersonObservation
from tracking import PersonTrack, PersonTracker, SensorConfig, TrackerConfig, TrackingError

CONFIG = TrackerConfig(standing_window_s=1.0)
FRONT, REAR = "front", "rear"
RATE_HZ = 40.0
PLACE = np.array([2.0, 0.5])
Frame = tuple[float, list[PersonObservation], str]


def rig(config: TrackerConfig = CONFIG) -> PersonTracker:
    """Return a tracker with a camera and two scanners."""
    return PersonTracker(config, sensors={FRONT: SensorConfig(), REAR: SensorConfig()})


def seen(place_m: FloatArray, stamp_s: float) -> PersonObservation:
    return observe(place_m, stamp_s, T_odom_camera=laser_at(), covariance_odom_m2=0.02**2)


def update(tracker: PersonTracker, frame: Frame) -> tuple[PersonTrack, ...]:
    stamp_s, people, sensor = frame
    return tracker.update(people, stamp_s, laser_at(), sensor=sensor)


class Person:
    """Somebody who stands and starts with 2 m/s² up to 1.4 m/s, as two scanners measure them.

    The scanners are wrong by a constant each, by an error that drifts as the robot drives, and by
    noise, now and then by ten times as much.
    """

    def __init__(
        self,
        seed: int,
        *,
        noise_m: float = 0.008,
        start_s: float = 2.0,
        acceleration_mps2: float = 2.0,
        drift_m: float = 0.0,
        lost: float = 0.02,
    ) -> None:
        self.rng = np.random.default_rng([seed, 9])
        self.noise_m, self.start_s, self.lost = noise_m, start_s, lost
        self.acceleration_mps2 = acceleration_mps2
        angle = self.rng.uniform(0.0, math.tau)
        self.towards = np.array([math.cos(angle), math.sin(angle)])
        self.wrong = self.rng.normal(0.0, 0.01, (2, 2))
        self.drifts = drift_m * self.rng.normal(size=(2, 2))
        self.periods_s = self.rng.uniform(0.7, 3.0, 2)

    def way_m(self, stamp_s: float) -> float:
        since_s = max(stamp_s - self.start_s, 0.0)
        speeding_s = min(since_s, 1.4 / self.acceleration_mps2)
        way_m = 0.5 * self.acceleration_mps2 * speeding_s**2
        return way_m + self.acceleration_mps2 * speeding_s * (since_s - speeding_s)

    def measured(self, stamp_s: float, scanner: int) -> FloatArray | None:
        noise = self.rng.normal(0.0, self.noise_m, 2) * (10.0 if self.rng.random() < 0.002 else 1.0)
        if self.rng.random() < self.lost:
            return None
        phase = math.sin(math.tau * stamp_s / self.periods_s[scanner])
        drift = phase * self.drifts[scanner]
        return PLACE + self.way_m(stamp_s) * self.towards + self.wrong[scanner] + drift + noise

    def frames(self, until_s: float, sensors: Sequence[str] = (FRONT, REAR)) -> list[Frame]:
        found: list[Frame] = []
        for tick in range(round(until_s * RATE_HZ)):
            for number, sensor in enumerate(sensors):
                stamp_s = (tick + 0.5 * number) / RATE_HZ
                place = self.measured(stamp_s, number)
                people = [] if place is None else [seen(place, stamp_s)]
                found.append((stamp_s, people, sensor))
        return found


def standing(until_s: float = 1.5, seed: int = 0) -> tuple[PersonTracker, PersonTrack]:
    tracker = rig()
    for frame in Person(seed, start_s=math.inf).frames(until_s):
        tracks = update(tracker, frame)
    return tracker, tracks[0]


def delay_s(track: PersonTrack, acceleration_mps2: float = 2.0) -> float:
    return track.moved_age_s + math.sqrt(2.0 * track.moved_m / acceleration_mps2)


CASES = {
    "calm": {"noise_m": 0.008},
    "fine": {"noise_m": 0.004},
    "driving": {"noise_m": 0.010, "drift_m": 0.015},
    "coarse": {"noise_m": 0.015},
    "losses": {"noise_m": 0.008, "lost": 0.3},
    "gentle": {"noise_m": 0.008, "acceleration_mps2": 1.0},
}


@pytest.mark.parametrize(
    "case",
    # "fine" has less noise and "coarse" more.
    [pytest.param(case, marks=pytest.mark.full if case == "calm" else ()) for case in CASES],
)
def test_nobody_has_come_farther_than_the_bound_nor_begun_earlier(case: str) -> None:
    """Monte Carlo: at most one frame in a thousand, of those in which the person moves."""
    moving = bounded = farther = earlier = still = known = 0
    delays = []
    for seed in range(25):
        someone = Person(seed, start_s=1.6 + 0.01 * seed, **CASES[case])
        tracker = rig()
        for frame in someone.frames(someone.start_s + 0.5):
            tracks = update(tracker, frame)
            stamp_s = frame[0]
            if not tracks or stamp_s < 1.2:
                continue
            track = nearest(tracks, PLACE)
            since_s = stamp_s - someone.start_s
            if since_s <= 0.0:
                still += 1
                known += math.isfinite(track.moved_m)
                delays.append(delay_s(track))
                continue
            moving += 1
            if math.isfinite(track.moved_m):
                bounded += 1
                farther += track.moved_m < someone.way_m(stamp_s - track.moved_age_s)
                begun_s = since_s * math.sqrt(someone.acceleration_mps2 / 2.0)
                earlier += delay_s(track) < begun_s
    assert moving > 900
    assert bounded > 100
    assert farther <= 0.001 * moving
    assert earlier <= 0.001 * moving
    assert known > (0.6 if case in ("driving", "losses", "coarse") else 0.9) * still
    if case == "fine":
        assert np.median(delays) < 0.15
    if case == "calm":
        assert np.median(delays) < 0.18


def test_the_place_shows_a_start_much_sooner_than_the_velocity() -> None:
    noticed, shown = [], []
    for seed in range(20):
        someone, tracker = Person(seed), rig()
        for frame in someone.frames(2.8):
            tracks = update(tracker, frame)
            since_s = frame[0] - someone.start_s
            if since_s < 0.0:
                continue
            velocity = tracks[0].covariance_odom[2:, 2:]
            spread = math.hypot(
                *tracks[0].velocity_odom_mps, math.sqrt(np.linalg.eigvalsh(velocity)[-1])
            )
            if len(noticed) == len(shown) and not delay_s(tracks[0]) < 0.25:
                noticed.append(since_s)
            if spread > 0.2:
                shown.append(since_s)
                break
    assert len(noticed) == len(shown) == 20
    assert np.median(noticed) < np.median(shown) - 0.05


def test_it_is_off_by_default_and_changes_nothing_else() -> None:
    off, on = rig(TrackerConfig()), rig()
    own = tuple(PersonTrack.__slots__).index("moved_m")
    finite = 0
    for frame in Person(0).frames(2.5):
        without, with_bound = update(off, frame), update(on, frame)
        assert [row[:own] for row in everything(without)] == [
            row[:own] for row in everything(with_bound)
        ]
        assert all(track.moved_m == math.inf and track.moved_age_s == 0.0 for track in without)
        finite += math.isfinite(with_bound[0].moved_m) if with_bound else 0
    assert finite > 50
    state = off.state()["latest"]["tracks"]
    assert state["places"] == [[]] * len(state["ids"])


def test_a_walking_person_and_one_seen_for_too_short_have_no_bound() -> None:
    _, early = standing(0.6)
    assert early.moved_m == math.inf
    tracker = rig()
    for frame in Person(0, start_s=0.0).frames(2.0):
        tracks = update(tracker, frame)
    assert tracks[0].status == "confirmed"
    assert tracks[0].moved_m == math.inf


def test_the_age_goes_on_and_the_distance_stays_while_nobody_looks() -> None:
    tracker, track = standing()
    later = tracker.predict(track.stamp_s + 0.1)[0]
    assert later.moved_m == track.moved_m
    assert later.moved_age_s == pytest.approx(track.moved_age_s + 0.1)
    # Frames without the person are no better than no frames.
    for tick in range(1, 5):
        stamp_s = track.stamp_s + 0.025 * tick
        missed = tracker.update([], stamp_s, laser_at(), sensor=FRONT)[0]
    assert missed.moved_m == track.moved_m
    assert missed.moved_age_s == pytest.approx(later.moved_age_s)


@pytest.mark.parametrize("away_s", [0.1, 0.4])
def test_after_a_gap_it_starts_anew(away_s: float) -> None:
    tracker, track = standing()
    stamp_s = track.stamp_s + away_s
    again = update(tracker, (stamp_s, [seen(PLACE + 0.003, stamp_s)], FRONT))[0]
    assert again.id == track.id
    assert math.isfinite(again.moved_m) is (away_s < 0.25)


def test_a_frozen_sensor_is_no_measurement() -> None:
    """The same place again and again, to the bit: the age grows as without frames."""
    tracker, track = standing()
    place = PLACE + np.array([0.004, -0.002])
    first_s = track.stamp_s + 0.0125
    for tick in range(12):
        stamp_s = first_s + 0.0125 * tick
        frozen = update(tracker, (stamp_s, [seen(place, stamp_s)], FRONT))[0]
    assert frozen.moved_age_s > 0.0125 * 11 - 1e-9


def test_an_ambiguous_match_ends_it() -> None:
    tracker, track = standing()
    stamp_s = track.stamp_s + 0.0125
    people = [seen(PLACE + offset, stamp_s) for offset in ([0.15, 0.0], [-0.15, 0.0])]
    after = nearest(update(tracker, (stamp_s, people, FRONT)), PLACE)
    assert after.id == track.id
    assert after.moved_m == math.inf


def test_an_id_that_goes_to_somebody_else_has_no_bound() -> None:
    """Somebody steps before a standing person and takes the track; the scatter tells."""
    tracker, track = standing()
    rng, taken = np.random.default_rng(1), 0
    for tick in range(1, 30):
        stamp_s = track.stamp_s + 0.0125 * tick
        other = PLACE + np.array([-0.2, 0.05]) + rng.normal(0.0, 0.008, 2)
        after = nearest(update(tracker, (stamp_s, [seen(other, stamp_s)], FRONT)), other)
        if after.id == track.id:
            taken += 1
            assert after.moved_m == math.inf
    assert taken > 10


def test_somebody_who_sways_gets_a_longer_bound_or_none() -> None:
    _, calm = standing()
    tracker, someone = rig(), Person(0, start_s=math.inf)
    bounds = []
    for stamp_s, people, sensor in someone.frames(4.0):
        sway = 0.03 * math.sin(math.tau * 0.7 * stamp_s) * someone.towards
        moved = [seen(one.position_camera_m[:2] + sway, stamp_s) for one in people]
        tracks = update(tracker, (stamp_s, moved, sensor))
        if stamp_s > 1.2:
            bounds.append(tracks[0].moved_m)
    assert np.median(bounds) > 2.0 * calm.moved_m


def test_two_scanners_that_disagree_about_a_place_do_not_make_it_move() -> None:
    """Each is compared with itself. Under one name, what they disagree by counts as noise."""
    bounds = {}
    for name, sensors in (("own", (FRONT, REAR)), ("one", (FRONT, FRONT))):
        tracker, someone = rig(), Person(3, start_s=math.inf)
        someone.wrong = np.array([[0.03, 0.0], [-0.03, 0.0]])
        for frame in someone.frames(2.0, sensors):
            tracks = update(tracker, frame)
        bounds[name] = tracks[0].moved_m
    assert bounds["own"] < 0.03
    assert bounds["one"] > 1.5 * bounds["own"]


def test_a_camera_beside_the_scanners_takes_nothing_away() -> None:
    """Where sensors measure ranges, only their places count."""
    _, alone = standing()
    sensors = {FRONT: SensorConfig(), REAR: SensorConfig(), "eye": SensorConfig()}
    sensors["eye"] = SensorConfig(measures_range=False, sees_faces=True)
    tracker, rng = PersonTracker(CONFIG, sensors=sensors), np.random.default_rng(4)
    for tick, frame in enumerate(Person(0, start_s=math.inf).frames(1.5)):
        tracks = update(tracker, frame)
        if tick % 5 == 0 and tracks:
            place = PLACE + rng.normal(0.0, 0.1, 2)
            image = observe(place, frame[0], T_odom_camera=camera_at(), covariance_odom_m2=0.1**2)
            tracker.update([image], frame[0], camera_at(), sensor="eye")
    assert tracker.predict(frame[0])[0].moved_m == pytest.approx(alone.moved_m)


def test_late_frames_and_a_saved_state_give_the_same_to_the_bit() -> None:
    frames = Person(5).frames(2.1)
    in_order, late, saved = rig(), rig(), rig()
    delayed: list[Frame] = []
    for number, frame in enumerate(frames):
        expected = update(in_order, frame)
        if frame[2] == REAR:
            delayed.append(frame)
        else:
            update(late, frame)
        if len(delayed) > 2:
            update(late, delayed.pop(0))
        if number % 40 == 20:
            saved = PersonTracker.from_state(json.loads(json.dumps(saved.state())))
        assert everything(update(saved, frame)) == everything(expected)
    for frame in delayed:
        found = update(late, frame)
    assert everything(found) == everything(expected)
    assert any(math.isfinite(track.moved_m) for track in expected)


def test_a_state_from_before_has_no_places() -> None:
    tracker, track = standing()
    state = tracker.state()
    for part in ("base", "latest"):
        del state[part]["tracks"]["places"]
    again = PersonTracker.from_state(state).predict(track.stamp_s)[0]
    assert (again.id, again.moved_m) == (track.id, math.inf)


@settings(max_examples=20, deadline=None)
@given(turn=st.floats(-math.pi, math.pi), shift=st.floats(-50.0, 50.0))
def test_it_does_not_depend_on_where_odom_lies(turn: float, shift: float) -> None:
    cos, sin = math.cos(turn), math.sin(turn)
    R, moved = np.array([[cos, -sin], [sin, cos]]), []
    for rotation, offset in ((np.eye(2), 0.0), (R, shift)):
        tracker = rig()
        for stamp_s, people, sensor in Person(6, start_s=math.inf).frames(1.3):
            T = laser_at(*(rotation @ np.zeros(2) + offset), turn if offset or turn else 0.0)
            places = [rotation @ one.position_camera_m[:2] + offset for one in people]
            again = [
                observe(place, stamp_s, T_odom_camera=T, covariance_odom_m2=0.02**2)
                for place in places
            ]
            tracks = tracker.update(again, stamp_s, T, sensor=sensor)
        moved.append((tracks[0].moved_m, tracks[0].moved_age_s))
    np.testing.assert_allclose(moved[0], moved[1], rtol=1e-6)


def test_a_window_that_is_too_short_is_refused() -> None:
    with pytest.raises(TrackingError, match=r"greater than or equal to 0\.5"):
        TrackerConfig(standing_window_s=0.2)


@pytest.mark.parametrize("moved_m", [-0.1, math.nan])
def test_a_track_refuses_a_distance_that_is_none(moved_m: float) -> None:
    _, track = standing()
    values = {name: getattr(track, name) for name in PersonTrack.__slots__}
    assert PersonTrack(**{**values, "moved_m": math.inf}).moved_m == math.inf
    with pytest.raises(TrackingError, match="moved_m"):
        PersonTrack(**{**values, "moved_m": moved_m})
