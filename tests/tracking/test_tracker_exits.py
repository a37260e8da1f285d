"""Exits: without a view, the tracker learns where people walk out of it."""

from __future__ import annotations

import numpy as np
import pytest
from tracking_scenes import PERIOD_S, FloatArray, camera_at, observe

from tracking import PersonTracker, TrackerConfig

CONFIG = TrackerConfig()
SPEED_MPS = 1.2


class Passage:
    """People who walk along x one after the other, and what the tracker says of the last one."""

    def __init__(self, rng: np.random.Generator, camera: FloatArray | None = None) -> None:
        self.tracker = PersonTracker()
        self.camera = camera_at() if camera is None else camera
        self._rng = rng
        self._now = 0.0

    def empty(self, seconds: float) -> None:
        for _ in range(round(seconds / PERIOD_S)):
            self._now += PERIOD_S
            self.tracker.update((), self._now, self.camera)

    def walk(
        self,
        from_m: float,
        to_m: float,
        *,
        y_m: float = 0.0,
        hidden_m: tuple[float, float] = (9e9, 9e9),
    ) -> list[int]:
        """Walk and return the ids, one for each frame that shows the person as confirmed."""
        ids = []
        steps = round(abs(to_m - from_m) / SPEED_MPS / PERIOD_S)
        for x in np.linspace(from_m, to_m, steps):
            self._now += PERIOD_S
            place = np.array([x, y_m]) + self._rng.normal(0.0, 0.03, 2)
            hidden = hidden_m[0] <= x <= hidden_m[1]
            shown = [] if hidden else [observe(place, self._now, T_odom_camera=self.camera)]
            tracks = self.tracker.update(shown, self._now, self.camera)
            ids += [track.id for track in tracks if track.status == "confirmed"]
        return ids

    def kept_s(self) -> float:
        """Return how long somebody who is not seen any more is kept."""
        left_s = self._now
        while self.tracker.update((), self._now + PERIOD_S, self.camera):
            self._now += PERIOD_S
            assert self._now < left_s + 60.0
        self._now += PERIOD_S
        return self._now - left_s


def passage(seed: int, camera: FloatArray | None = None) -> Passage:
    """Return a passage whose tracker has started already."""
    place = Passage(np.random.default_rng(seed), camera)
    place.empty(2.0)
    return place


@pytest.mark.parametrize("seed", range(2))
def test_an_exit_is_learned_from_those_who_vanish_there(seed: int) -> None:
    people = passage(seed)
    kept = []
    for _ in range(6):
        people.walk(3.0, 8.0)
        kept.append(people.kept_s())
    # The first ones may be hidden, as far as the tracker knows.
    assert kept[:3] == pytest.approx([CONFIG.max_coast_s] * 3, abs=0.11)
    assert kept[3:] == pytest.approx([CONFIG.max_missed_s] * 3, abs=0.11)


def test_people_who_appear_at_a_place_make_it_an_exit_too() -> None:
    people = passage(0)
    for _ in range(4):
        people.walk(8.0, 4.0)
        people.kept_s()
    people.walk(4.0, 8.0)
    assert people.kept_s() == pytest.approx(CONFIG.max_missed_s, abs=0.11)


@pytest.mark.parametrize("seed", range(2))
def test_people_who_are_only_hidden_keep_their_ids_where_others_were_hidden(seed: int) -> None:
    """A rack hides everybody for 2.5 s, always at the same place; they come out again."""
    people = passage(seed)
    for _ in range(4):
        ids = people.walk(3.0, 11.0, hidden_m=(5.0, 5.0 + 2.5 * SPEED_MPS))
        assert len(set(ids)) == 1
        people.kept_s()


def test_people_beside_the_robot_are_kept_wherever_others_have_left() -> None:
    people = passage(1)
    for _ in range(6):
        people.walk(4.0, 1.5)
        assert people.kept_s() == pytest.approx(CONFIG.max_coast_s, abs=0.11)


def test_an_exit_holds_for_those_who_leave_by_it_only() -> None:
    people = passage(2)
    for _ in range(5):
        people.walk(3.0, 8.0)
        people.kept_s()
    people.walk(3.0, 8.0, y_m=4.0)  # elsewhere
    assert people.kept_s() == pytest.approx(CONFIG.max_coast_s, abs=0.11)
    people.walk(12.0, 8.0)
    assert people.kept_s() == pytest.approx(CONFIG.max_coast_s, abs=0.11)  # comes nearer


def test_exits_move_with_the_camera() -> None:
    """The view is the camera's, so the same place in the image is an exit after a turn."""
    people = passage(3)
    for _ in range(4):
        people.walk(3.0, 8.0)
        people.kept_s()
    people.camera = camera_at(2.0, 1.0)
    people.walk(5.0, 10.0, y_m=1.0)
    assert people.kept_s() == pytest.approx(CONFIG.max_missed_s, abs=0.11)
    people.walk(3.0, 8.0, y_m=1.0)  # 6 m ahead of the camera now, nobody has left there
    assert people.kept_s() == pytest.approx(CONFIG.max_coast_s, abs=0.11)
