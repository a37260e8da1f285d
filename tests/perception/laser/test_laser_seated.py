"""People who sit: candidates go to the trunk that images show, and only for as long as they sit."""

from __future__ import annotations

import numpy as np
import pytest

from perception import PersonObservation
from perception.errors import PerceptionError
from perception.laser import PersonCandidate, SeatedPeople

# Camera 1.2 m up that looks along x of odom.
T_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.2], [0.0, 0.0, 0.0, 1.0]]
)
SMALL = 0.05**2 * np.eye(2)
ANKLES_M, CHEST_ABOVE_M = 0.1, 0.75


def image(
    stamp_s: float, trunk: tuple[float, float], legs: tuple[float, float], ratio: float = 1.0
) -> PersonObservation:
    """Return a person ``ratio`` times smaller than the camera assumes, who seems so far away."""

    def camera(x: float, y: float, z: float) -> np.ndarray:
        return ratio * (T_CAMERA[:3, :3].T @ (np.array([x, y, z]) - T_CAMERA[:3, 3]))

    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=camera(*trunk, ANKLES_M + CHEST_ABOVE_M / ratio),
        position_covariance_m2=0.1**2 * np.eye(3),
        gaze_camera=None,
        awareness=None,
        awareness_std=None,
        score=0.9,
        legs_camera_m=camera(*legs, ANKLES_M),
    )


def met(
    stamp_s: float, legs: tuple[float, float], kind: str = "two_legs", score: float = 0.9
) -> PersonCandidate:
    """Return legs that a scan met, as those of somebody who stands."""
    place = None if kind == "trolley" else np.array(legs)
    return PersonCandidate(stamp_s, np.array(legs), SMALL, score, kind, place)  # type: ignore[arg-type]


def seen(people: SeatedPeople, *args: object, images: int = 6, until_s: float = 0.0) -> None:
    for number in range(images):
        stamp_s = until_s - 0.1 * (images - 1 - number)
        people.see([image(stamp_s, *args)], T_CAMERA)  # type: ignore[arg-type]


@pytest.mark.parametrize("ratio", [1.0, 1.3, 1.6])
def test_the_place_is_the_trunk_at_the_measured_range_and_size(ratio: float) -> None:
    people = SeatedPeople()
    seen(people, (3.4, 0.3), (3.0, 0.3), ratio)
    (placed,) = people.placed([met(0.0, (3.0, 0.3))], 0.0)
    np.testing.assert_allclose(placed.position_odom_m, [3.4, 0.3], atol=1e-6)
    assert placed.kind == "two_legs"
    assert np.array_equal(placed.legs_odom_m, [3.0, 0.3])


def test_people_who_stand_or_were_hardly_seen_stay_where_the_scan_puts_them() -> None:
    legs = met(0.0, (3.0, 0.3))
    standing = SeatedPeople()
    seen(standing, (3.1, 0.3), (3.0, 0.3))
    glimpsed = SeatedPeople()
    seen(glimpsed, (3.4, 0.3), (3.0, 0.3), images=3)
    for people in (SeatedPeople(), standing, glimpsed):
        assert people.placed([legs], 0.0) == (legs,)


def test_other_people_and_trolleys_are_left_alone() -> None:
    people = SeatedPeople()
    seen(people, (3.4, 0.3), (3.0, 0.3))
    others = [met(0.0, (3.2, 1.1)), met(0.0, (5.6, 0.5)), met(0.0, (1.5, 0.1), "trolley")]
    placed = people.placed([met(0.0, (3.0, 0.3)), *others], 0.0)
    assert placed[1:] == tuple(others)
    np.testing.assert_allclose(placed[0].position_odom_m, [3.4, 0.3], atol=1e-6)


def test_the_seat_is_no_second_person_and_either_leg_is_the_same_one() -> None:
    people = SeatedPeople()
    seen(people, (3.4, 0.3), (3.0, 0.3))
    stool = met(0.0, (3.35, 0.5), "one_leg", 0.7)
    assert len(people.placed([met(0.0, (3.0, 0.3)), stool], 0.0)) == 1
    (left,) = people.placed([met(0.04, (3.0, 0.5), "one_leg")], 0.04)
    np.testing.assert_allclose(left.position_odom_m, [3.4, 0.5], atol=0.01)


def test_two_people_side_by_side_keep_their_own_postures() -> None:
    people = SeatedPeople()
    for number in range(6):
        stamp = 0.1 * number
        sits = image(stamp, (3.4, 0.0), (3.0, 0.0))
        stands = image(stamp, (3.05, 0.6), (3.0, 0.6))
        people.see([stands, sits] if number % 2 else [sits, stands], T_CAMERA)
    placed = people.placed([met(0.5, (3.0, 0.0)), met(0.5, (3.0, 0.6))], 0.5)
    np.testing.assert_allclose([each.position_odom_m for each in placed], [[3.4, 0.0], [3.0, 0.6]])


def test_without_images_it_holds_while_the_legs_stay_and_no_longer() -> None:
    people = SeatedPeople()
    seen(people, (3.4, 0.3), (3.0, 0.3))
    stamps = np.arange(0.0, 8.0, 0.04).tolist()
    for stamp in stamps:
        (placed,) = people.placed([met(stamp, (3.0, 0.3))], stamp)
    np.testing.assert_allclose(placed.position_odom_m, [3.4, 0.3], atol=1e-6)
    # They get up and walk: the posture does not walk along.
    shifts = []
    for step in range(60):
        stamp = stamps[-1] + 0.04 * (step + 1)
        legs = (3.0 - 0.04 * step, 0.3)
        (placed,) = people.placed([met(stamp, legs)], stamp)
        shifts.append(placed.position_odom_m[0] - legs[0])
    assert shifts[13:] == [0.0] * (60 - 13)
    # And nobody who comes to the seat much later sits because of it.
    late = stamps[-1] + 0.04 * 60
    (placed,) = people.placed([met(late + 3.0, (3.0, 0.3))], late + 3.0)
    np.testing.assert_array_equal(placed.position_odom_m, [3.0, 0.3])


def test_images_that_show_them_standing_end_it() -> None:
    people = SeatedPeople()
    seen(people, (3.4, 0.3), (3.0, 0.3))
    people.placed([met(0.0, (3.0, 0.3))], 0.0)
    seen(people, (3.05, 0.3), (3.0, 0.3), images=12, until_s=1.2)
    (placed,) = people.placed([met(1.2, (3.0, 0.3))], 1.2)
    np.testing.assert_array_equal(placed.position_odom_m, [3.0, 0.3])


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(PerceptionError, match="T_odom_camera"):
        SeatedPeople().see([], np.eye(3))
    with pytest.raises(PerceptionError, match="PersonObservation, got str"):
        SeatedPeople().see(["somebody"], T_CAMERA)  # type: ignore[list-item]
