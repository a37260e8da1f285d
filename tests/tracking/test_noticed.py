"""``PersonTrack.noticed``: what feeds it, how long it lasts, and what ends it at once."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest
from fusion_scenes import (
    LASER,
    MEMORY_S,
    REMEMBERS,
    Rig,
    Scene,
    both,
    laser_at,
    play,
    seen_by_camera,
    seen_by_laser,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_scenes import as_bytes, camera_at, observe

from perception import AttentionCone
from tracking import PersonTrack, PersonTracker, SensorConfig

CAMERA_S = 0.1
OF_LOOKS = ("noticed", "aware_for_s", "departed_mps")


def attentive(look_s: float = 0.6) -> Scene:
    """Return a scene in which a standing person has looked at the robot and looks no more."""
    scene = Scene()
    scene.run(1.0)
    assert scene.run(look_s, alpha=0.9).noticed >= 0.5
    assert scene.run(0.3, camera=False).noticed >= 0.5
    return scene


def test_half_a_second_of_looking_gives_a_half() -> None:
    scene = Scene()
    scene.run(1.0)
    values = [scene.run(0.1, alpha=0.9).noticed for _ in range(10)]
    assert values == sorted(values)
    assert 0.45 <= values[4] <= 0.52
    assert values[9] > 0.7


@settings(max_examples=12, deadline=None)
@given(
    aside_deg=st.floats(12.0, 38.0),
    side=st.sampled_from([-1.0, 1.0]),
    from_deg=st.floats(-30.0, 30.0),
    speed_mps=st.floats(0.8, 2.0),
)
def test_who_looks_where_they_walk_does_not_look_at_a_robot_beside_their_way(
    aside_deg, side, from_deg, speed_mps
):
    """Whoever turns the head to it does, and so does somebody who stands with the same face."""

    def noticed(turned: bool, walks: bool) -> float:
        scene, way = Scene(), math.radians(from_deg + 180.0 + side * aside_deg)
        ahead = np.array([math.cos(way), math.sin(way)])
        here = math.radians(from_deg)
        scene.place = 7.0 * np.array([math.cos(here), math.sin(here)])
        velocity = tuple((speed_mps * walks * ahead).tolist())
        scene.run(0.8, velocity=velocity)
        most = 0.0
        for _ in range(15):
            gaze = -scene.place if turned else ahead
            alpha = AttentionCone().score_of((*scene.place, 0.0), (*gaze, 0.0), (0.0, 0.0, 0.0))
            most = max(most, scene.run(0.1, alpha=alpha, velocity=velocity).noticed)
        return most

    assert noticed(turned=False, walks=True) < 0.5
    assert noticed(turned=True, walks=True) > 0.5
    if aside_deg < 30.0:
        assert noticed(turned=False, walks=False) > 0.5


def test_noise_about_a_gaze_along_the_way_seldom_adds_up_to_a_belief() -> None:
    """Somebody who walks slowly past a robot beside their way, and looks ahead."""
    believed = 0
    for seed in range(12):
        for aside_deg in (18.0, 26.0):
            scene, way = Scene(seed=seed), math.radians(180.0 + aside_deg)
            ahead = np.array([math.cos(way), math.sin(way)])
            scene.place, velocity = np.array([6.0, 0.0]), tuple((0.6 * ahead).tolist())
            scene.run(0.5, velocity=velocity)
            most = 0.0
            for _ in range(45):
                alpha = AttentionCone().score_of(
                    (*scene.place, 0.0), (*ahead, 0.0), (0.0, 0.0, 0.0)
                )
                noisy = float(np.clip(alpha + 0.05 * scene.rng.normal(), 0.01, 0.99))
                most = max(most, scene.run(0.1, alpha=noisy, velocity=velocity).noticed)
            believed += most >= 0.5
    assert believed <= 5  # of 24


@pytest.mark.parametrize(("speed_mps", "aside_deg"), [(0.5, 20.0), (0.8, 24.0)])
def test_glances_of_somebody_who_walks_add_up(speed_mps: float, aside_deg: float) -> None:
    """Between them they look at the floor: not along their way, so nothing speaks against them."""
    scene, way = Scene(), math.radians(180.0 + aside_deg)
    scene.place = np.array([6.0, 0.0])
    velocity = speed_mps * math.cos(way), speed_mps * math.sin(way)
    scene.run(0.6, velocity=velocity)
    for _ in range(2):
        scene.run(0.3, alpha=0.97, velocity=velocity)
        scene.run(0.3, alpha=0.1, velocity=velocity)
    assert scene.run(0.3, alpha=0.97, velocity=velocity).noticed >= 0.5


def test_glances_within_seconds_add_up_and_old_ones_fade() -> None:
    scene = Scene()
    scene.run(1.0)
    for _ in range(4):
        scene.run(0.2, alpha=0.9)
        track = scene.run(0.2)
    assert track.noticed > 0.5
    faded = scene.run(2.5)
    assert 0.1 < faded.noticed < track.noticed


def test_it_lasts_for_the_memory_and_no_longer() -> None:
    scene = Scene()
    scene.run(1.0)
    looked = scene.run(1.0, alpha=0.9)
    kept = scene.run(MEMORY_S - 0.2, camera=False)
    assert kept.noticed == pytest.approx(looked.noticed)
    assert kept.awareness_lower == 0.0
    assert scene.run(0.3, camera=False).noticed == 0.0
    assert scene.run(0.3, camera=False).status == "confirmed"
    # A new look counts from the start.
    scene.run(0.2)
    assert 0.1 < scene.run(0.2, alpha=0.9).noticed < 0.4


def test_it_is_off_by_default_and_then_changes_nothing() -> None:
    rig = Rig([lambda _now: (3.0, 0.5)], faces=lambda _person, _now: 0.9)
    off, on = both(), both(REMEMBERS)
    own = [tuple(PersonTrack.__slots__).index(each) for each in OF_LOOKS]
    for event in rig.events(2.0):
        without, with_memory = play(off, [event]), play(on, [event])
        assert [track.noticed for track in without] == [0.0] * len(without)
        rest = [
            [[each for at, each in enumerate(row) if at not in own] for row in as_bytes(tracks)]
            for tracks in (without, with_memory)
        ]
        assert rest[0] == rest[1]
        assert all(track.aware_for_s == math.inf for track in without)
    assert with_memory[0].noticed > 0.5


def test_while_the_other_sensor_is_silent_it_ends_with_the_look() -> None:
    scene = Scene()
    for tick in range(20):
        now = 0.1 * tick
        seen = seen_by_camera((3.0, 0.5), now, awareness=0.9 if tick < 12 else None)
        (track,) = scene.tracker.update([seen], now, camera_at())
        if 8 < tick < 12:
            assert track.noticed > 0.5
    assert track.noticed == 0.0


def test_a_camera_alone_has_no_memory() -> None:
    tracker, plain = PersonTracker(REMEMBERS), PersonTracker()
    for tick in range(20):
        seen = seen_by_camera((3.0, 0.5), 0.1 * tick, awareness=0.9)
        (track,) = tracker.update([seen], 0.1 * tick, camera_at())
        (other,) = plain.update([seen], 0.1 * tick, camera_at())
        assert track.noticed == 0.0
        assert track.awareness_lower == other.awareness_lower


def test_what_is_known_lasts_for_as_long_as_was_said() -> None:
    """It grows with looks from 0 on, and falls by a second per second: no belief ends in a step."""
    scene = Scene()
    assert scene.run(1.0).aware_for_s == 0.0
    before, said_s = 0.0, []
    for _ in range(16):
        track = scene.run(0.1, alpha=0.9)
        assert (track.aware_for_s > 0.0) is (track.noticed > 0.5)
        assert track.aware_for_s >= before
        before = track.aware_for_s
    for alpha in [None, 0.05, *[None] * 40]:
        said_s.append(scene.run(0.1, alpha=alpha).aware_for_s)
        assert (said_s[-1] > 0.0) is (scene.track.noticed >= 0.5)
    assert said_s[0] > 2.5
    # But for the face that looked away, after which it lasts for a second and a half.
    falls = -np.diff(said_s)[1:]
    assert falls.max() <= 0.1 + 1e-6
    assert said_s[-1] == 0.0


@settings(max_examples=12, deadline=None)
@given(
    cameras=st.integers(1, 2),
    period_s=st.floats(0.04, 0.24),
    looks_s=st.floats(0.7, 1.6),
    missed=st.sampled_from([0, 3, 4]),
)
def test_what_is_known_never_grows_without_a_look_and_falls_by_a_second_per_second(
    cameras, period_s, looks_s, missed
):
    """However many cameras there are, how fast, and whichever of their pictures miss the person."""
    front, place = SensorConfig(sees_faces=True, measures_range=False), (3.0, 0.5)
    more = {"second": front} if cameras == 2 else {}
    tracker = PersonTracker(REMEMBERS, sensors={LASER: SensorConfig(), **more})
    events = [(0.04 * count, LASER, count) for count in range(175)]
    for phase, name in enumerate(["camera", *more]):
        pictures = range(math.floor(7.0 / period_s))
        events += [(0.007 + (0.3 * phase + count) * period_s, name, count) for count in pictures]
    before_s, before = 0.0, 0.0
    for stamp_s, sensor, count in sorted(events):
        alpha = 0.9 if 1.0 <= stamp_s < 1.0 + looks_s else None
        if sensor == LASER:
            seen, at = [seen_by_laser(place, stamp_s)], laser_at()
        else:
            seen, at = [seen_by_camera(place, stamp_s, awareness=alpha)], camera_at()
            seen = [] if missed and count % missed == 0 else seen
        (track,) = tracker.update(seen, stamp_s, at, sensor=sensor)
        if alpha is None or sensor == LASER:
            assert before - (stamp_s - before_s) - 1e-6 <= track.aware_for_s <= before + 1e-9
        before_s, before = stamp_s, track.aware_for_s
    assert before == 0.0


@pytest.mark.parametrize("ratio", [1.0, 1.6], ids=["same_range", "other_range"])
@pytest.mark.parametrize("velocity", [(0.0, 0.0), (0.8, 0.0)], ids=["stands", "walks"])
def test_a_face_that_looks_away_leaves_a_second_and_a_half(ratio, velocity) -> None:
    scene = Scene()
    scene.run(1.0, velocity=velocity)
    assert scene.run(1.6, alpha=0.9, velocity=velocity).aware_for_s > 2.5
    seen = seen_by_camera(scene.place, scene.now + CAMERA_S, ratio=ratio, awareness=0.05)
    copied = copy.deepcopy(scene.tracker)
    scan = [seen_by_laser(scene.place, scene.now + 0.06)]
    copied.update(scan, scene.now + 0.06, laser_at(), sensor=LASER)
    (track,) = copied.update([seen], scene.now + CAMERA_S, camera_at())
    assert 1.4 <= track.aware_for_s <= 1.5
    assert scene.run(1.3, alpha=0.05, velocity=velocity).noticed > 0.5
    assert scene.run(0.4, alpha=0.05, velocity=velocity).noticed == 0.0


@pytest.mark.parametrize(("alphas", "kept"), [((0.0,), True), ((0.0, 0.0), False)])
def test_one_frame_of_a_fast_camera_may_be_wrong(alphas: tuple[float, ...], kept: bool) -> None:
    scene = attentive(1.6)
    for number, alpha in enumerate(alphas):
        now = scene.now + 0.05 * (number + 1)
        seen = seen_by_camera(scene.place, now, awareness=alpha)
        (track,) = scene.tracker.update([seen], now, camera_at())
    assert (track.aware_for_s > 1.5) is kept


def test_who_yields_with_a_step_and_looks_on_is_still_believed() -> None:
    """A step of 0.6 m/s counts as that until it is over."""
    scene = attentive(2.0)
    scene.run(0.2, alpha=0.9)
    departed = []
    for _ in range(6):
        track = scene.run(0.1, alpha=0.9, velocity=(0.0, 0.6))
        departed.append(track.departed_mps)
        assert track.noticed > 0.5
    assert 0.4 < max(departed) < 0.75
    assert scene.run(2.0, alpha=0.9).departed_mps < 0.25


def test_who_looks_and_sets_off_is_as_fast_as_they_show() -> None:
    scene = attentive(2.0)
    scene.run(0.2, alpha=0.9)
    fastest = 0.0
    for _ in range(10):
        track = scene.run(0.1, alpha=0.9, velocity=(0.0, 1.4))
        if track.noticed < 0.5:
            break
        fastest = max(fastest, track.departed_mps)
    assert track.noticed < 0.5
    assert fastest > 0.5


def test_who_halts_keeps_to_their_motion() -> None:
    scene = Scene()
    scene.place = np.array([6.0, -2.0])
    scene.run(1.0, velocity=(-1.0, 0.3))
    scene.run(1.0, alpha=0.9, velocity=(-1.0, 0.3))
    for _ in range(9):
        track = scene.run(0.1, camera=False)
        assert track.noticed > 0.5
        assert track.departed_mps < 0.3


@pytest.mark.parametrize("alpha", [0.42, None], ids=["corner of the eye", "no usable face"])
def test_what_shows_no_look_elsewhere_ends_nothing(alpha: float | None) -> None:
    """A head 45 degrees off the robot has α = 0.42: no look, but the robot is in sight."""
    assert attentive().run(0.5, alpha=alpha).noticed > 0.4


@pytest.mark.parametrize(
    ("speed_mps", "limit_s", "direction"),
    [(0.6, 0.6, math.pi), (1.2, 0.36, 0.5 * math.pi), (1.6, 0.32, math.pi)],
)
def test_a_person_who_sets_off_ends_it(speed_mps: float, limit_s: float, direction: float) -> None:
    scene = attentive()
    start_s = scene.now
    velocity = (speed_mps * math.cos(direction), speed_mps * math.sin(direction))
    scene.run(2.0, camera=False, velocity=velocity, until=lambda track: track.noticed == 0.0)
    assert scene.track.noticed == 0.0
    assert scene.now - start_s <= limit_s
    assert scene.run(1.0, camera=False).noticed == 0.0


@pytest.mark.parametrize(
    ("start_m", "velocity", "later"),
    [
        ((6.0, -2.0), (-0.5, 0.2), [(1.5, (-0.5, 0.2), True), (0.8, (-1.4, 0.5), False)]),
        ((3.0, -3.5), (0.0, 1.2), [(1.0, (0.0, 1.2), True)]),
        ((3.0, -3.5), (0.0, 1.2), [(1.0, (-0.94, 0.75), False)]),
        ((6.0, -2.0), (-1.0, 0.3), [(0.9, (0.0, 0.0), True), (0.6, (-1.0, 0.3), False)]),
    ],
    ids=["comes faster", "passes", "turns", "stops and sets off"],
)
def test_a_walker_keeps_it_on_their_course_alone(start_m, velocity, later) -> None:
    """The speed towards the robot changes while they pass: not who walks on comes faster."""
    scene = Scene()
    scene.place = np.array(start_m)
    scene.run(1.0, velocity=velocity)
    assert scene.run(0.8, alpha=0.9, velocity=velocity).noticed > 0.5
    for seconds, then, kept in later:
        noticed = scene.run(seconds, camera=False, velocity=then).noticed
        assert noticed > 0.5 if kept else noticed == 0.0


def test_a_gap_in_the_scans_ends_it_for_good() -> None:
    scene = attentive()
    # One scan may miss them, two in a row are a gap.
    assert scene.run(0.04, camera=False, laser=False).noticed > 0.5
    assert scene.run(0.04, camera=False).noticed > 0.5
    assert scene.run(0.16, camera=False, laser=False).noticed == 0.0
    assert scene.run(1.0, camera=False).noticed == 0.0


def test_a_scanner_that_falls_silent_ends_it_also_in_predictions() -> None:
    scene = attentive()
    last_s = scene.tracker.last_stamp_s
    assert last_s is not None
    assert scene.tracker.predict(last_s + 0.05)[0].noticed > 0.5
    assert scene.tracker.predict(last_s + 0.2)[0].noticed == 0.0
    # No frame at all in between, and then the scanner goes on as if nothing had happened.
    scene.tick += 15
    assert scene.run(0.5, camera=False).noticed == 0.0


@settings(max_examples=10, deadline=None)
@given(
    direction=st.floats(-math.pi, math.pi),
    speed_mps=st.floats(0.8, 1.6),
    behind_m=st.floats(0.3, 0.36),
)
def test_the_other_leg_of_somebody_who_walks_is_nobody_and_ends_nothing(
    direction, speed_mps, behind_m
):
    way = np.array([math.cos(direction), math.sin(direction)])
    scene, velocity = Scene(), tuple((speed_mps * way).tolist())
    scene.place = np.array([5.0, 0.0]) - 1.5 * speed_mps * way
    scene.run(0.7, alpha=0.97, velocity=velocity)
    assert scene.run(0.7, alpha=0.97, velocity=velocity).noticed >= 0.5
    for _ in range(4):  # a leg stays where it is while the other one swings
        leg = tuple((scene.place - behind_m * way).tolist())
        track = scene.run(0.06, alpha=0.97, velocity=velocity, others=(leg,))
        assert len(scene.tracks) == 1
        assert track.noticed >= 0.5
        scene.run(0.2, alpha=0.97, velocity=velocity)


@pytest.mark.parametrize("offset_m", [(0.0, 0.45), (0.7, 0.0), (-0.7, 0.0)])
def test_somebody_beside_or_a_headway_from_who_walks_is_found(offset_m) -> None:
    scene = Scene()
    scene.place = np.array([3.0, 0.0])
    scene.run(1.0, velocity=(1.0, 0.0))
    for _ in range(10):
        other = tuple((scene.place + offset_m).tolist())
        scene.run(0.04, velocity=(1.0, 0.0), others=(other,))
    assert len(scene.tracks) == 2


def test_an_ambiguous_match_ends_it_and_takes_awareness() -> None:
    scene = attentive()
    before = scene.run(0.1, alpha=0.9)
    assert before.awareness_lower > 0.2
    for y in np.arange(1.4, 0.6, -0.03):  # somebody else comes as near as a body allows
        scene.run(0.04, alpha=0.9, others=((3.05, y),))
    scene.run(0.1, camera=False, others=((3.05, 0.6),))
    assert scene.track.noticed == 0.0
    assert scene.track.awareness_lower == 0.0


@pytest.mark.parametrize(("alpha", "kept"), [(0.9, True), (None, False)])
def test_of_two_who_may_be_exchanged_each_keeps_what_both_have(alpha, kept) -> None:
    """Two people come so close that scans cannot tell them apart; nobody looks any more."""
    tracker = both(REMEMBERS)
    places = np.array([[3.0, 0.4], [3.0, -0.4]])
    for tick in range(1, 170):
        now = 0.02 * tick
        if 75 < tick < 165:  # slowly towards each other, to 0.1 m
            places = places + 0.02 * np.array([[0.0, -0.2], [0.0, 0.2]])
        if tick % 5 == 0:
            scores = (0.9, alpha)
            seen = [
                seen_by_camera(place, now, awareness=score)
                for place, score in zip(places, scores, strict=True)
            ]
            tracker.update(seen if tick <= 75 else [], now, camera_at())
        if tick % 2 == 0:
            scan = [seen_by_laser(place, now) for place in places]
            tracks = tracker.update(scan, now, laser_at(), sensor=LASER)
        if tick == 76:
            first = {track.id: track.noticed for track in tracks}
    # Each is matched surely at first, then ambiguously.
    assert max(first.values()) > 0.5
    assert (min(first.values()) > 0.5) is kept
    held = [track.noticed for track in tracks if track.id in first]
    assert len(held) == 2
    assert (min(held) > 0.4) is kept
    assert (max(held) > 0.4) is kept
    assert all(track.awareness_lower == 0.0 for track in tracks)


def test_without_images_nobody_has_noticed() -> None:
    """A camera that is silent would not see a face that looks away."""
    scene = attentive()
    for tick in range(1, 40):
        now = scene.now + 0.04 * tick
        seen = [seen_by_laser(scene.place, now)]
        (track,) = scene.tracker.update(seen, now, laser_at(), sensor=LASER)
        assert (track.noticed > 0.0) is (0.04 * tick < 0.45) or 0.45 <= 0.04 * tick <= 0.6
    assert track.noticed == 0.0


def test_a_place_that_jumps_ends_it() -> None:
    scene = attentive()
    for jump_m, kept in ((0.1, True), (0.31, False)):
        tracker = copy.deepcopy(scene.tracker)
        place = scene.track.position_odom_m + np.array([0.0, jump_m])
        seen = seen_by_laser(place, scene.now + 0.04)
        (track,) = tracker.update([seen], scene.now + 0.04, laser_at(), sensor=LASER)
        assert (track.noticed > 0.5) is kept


def test_nobody_inherits_it_from_somebody_who_vanished() -> None:
    scene = attentive()
    known = scene.track.id
    scene.run(4.0, camera=False, laser=False, others=((-3.0, 0.0),))
    scene.place = np.array([3.0, 0.5])
    track = scene.run(1.0, camera=False)
    assert track.noticed == 0.0
    assert track.id >= known


@pytest.mark.parametrize("alpha", [None, 0.0, 0.5])
def test_without_looks_nobody_has_noticed(alpha: float | None) -> None:
    scene = Scene()
    for _ in range(40):
        assert scene.run(0.1, alpha=alpha).noticed == 0.0


ALPHAS = st.lists(st.sampled_from([None, None, 0.05, 0.45, 0.7, 0.95]), min_size=20, max_size=40)


@settings(max_examples=4, deadline=None)
@given(alphas=ALPHAS, extra=st.sets(st.integers(0, 39), max_size=8), seen_until=st.integers(10, 40))
def test_more_looks_never_give_less(alphas, extra, seen_until) -> None:
    # The same people and frames, but some frames without a face have a look instead.
    more = [0.95 if a is None and i in extra else a for i, a in enumerate(alphas)]
    few, many = both(REMEMBERS), both(REMEMBERS)
    rng = np.random.default_rng(seen_until)
    for tick in range(60):
        now = 0.1 * tick
        noise, place = rng.normal(size=(3, 2)), (4.0 - 0.02 * tick, 0.5)
        for tracker, looks in ((few, alphas), (many, more)):
            alpha = looks[tick] if tick < min(len(looks), seen_until) else None
            seen = [seen_by_camera(place, now, noise_m=noise[0], awareness=alpha)]
            tracker.update(seen if tick < seen_until else [], now, camera_at())
            for part in (1, 2):
                at_s = now + 0.03 * part
                scan = [seen_by_laser(place, at_s, noise_m=noise[part])]
                tracks = tracker.update(scan, at_s, laser_at(), sensor=LASER)
            if tracker is few:
                least = {track.id: track.noticed for track in tracks}
        assert {track.id for track in tracks} == set(least)
        assert all(track.noticed >= least[track.id] - 1e-12 for track in tracks)


@pytest.mark.parametrize("pause_s", [0.9, 2.9])
def test_after_a_pause_of_all_sensors_one_glance_is_one_glance(pause_s: float) -> None:
    """Nobody knows that it is the same person. The looks before the pause do not come back."""
    tracker = both(REMEMBERS)
    for k in range(20):
        tracker.update([observe((3.0, 0.0), 0.1 * k, awareness=0.97)], 0.1 * k, camera_at())
    assert tracker.predict(1.95)[0].noticed > 0.8
    now = 1.9 + pause_s
    tracks = tracker.update([observe((3.3, 0.3), now, awareness=0.97)], now, camera_at())
    assert max(track.noticed for track in tracks) < 0.2
