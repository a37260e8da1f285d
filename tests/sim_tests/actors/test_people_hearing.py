"""People who hear a request for attention: the answer by a look, and the startle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sim_tests.actors.behaviour import Ears, Heard, Hearing, Request

VOICE = Request(t_s=1.0, means="voice", distance_m=3.0)
LIGHT = replace(VOICE, means="light")
PEOPLE = 2000
CALM = Hearing(startles=0.0)


def heard_by(hearing: Hearing, *requests: Request, people: int = PEOPLE) -> list[Heard | None]:
    """Return what each of many people does at the last of the requests."""
    streams = np.random.default_rng(5).spawn(people)
    everybody = [Ears(hearing, stream) for stream in streams]
    for request in requests:
        last = [ears.hear(request) for ears in everybody]
    return last


def look_share(hearing: Hearing, *requests: Request) -> float:
    return float(np.mean([h is not None and h.looks for h in heard_by(hearing, *requests)]))


@pytest.mark.parametrize("answers", [0.0, 0.3, 1.0])
def test_the_share_who_look_is_the_setting(answers: float) -> None:
    share = look_share(CALM.model_copy(update={"answers": answers}), VOICE)
    assert share == pytest.approx(answers, abs=0.04)


def test_by_default_every_other_person_looks_and_one_in_twenty_startles() -> None:
    heard = [h for h in heard_by(Hearing(), VOICE) if h is not None]
    assert sum(h.looks for h in heard) / PEOPLE == pytest.approx(0.5, abs=0.04)
    kinds = [h.startle for h in heard if h.startle]
    assert len(kinds) / PEOPLE == pytest.approx(0.05, abs=0.018)
    shares = [kinds.count(kind) / len(kinds) for kind in ("into_path", "stop", "aside")]
    assert shares == pytest.approx([0.5, 0.25, 0.25], abs=0.13)


def test_the_same_people_answer_at_a_higher_share_too() -> None:
    """With one seed the answers are coupled: when and for how long stays the same."""
    low, mid, high = (
        heard_by(CALM.model_copy(update={"answers": share}), VOICE, VOICE)
        for share in (0.3, 0.5, 0.8)
    )
    for few, more in ((low, mid), (mid, high)):
        assert all(b == a for a, b in zip(few, more, strict=True) if a is not None)
        assert sum(b is not None for b in more) > sum(a is not None for a in few)
    startled = heard_by(Hearing(answers=0.5, startles=1.0), VOICE, VOICE)
    for calm, other in zip(mid, startled, strict=True):
        assert calm is None or (other is not None and replace(other, startle="") == calm)


def test_delay_and_duration_have_their_quartiles() -> None:
    heard = [h for h in heard_by(CALM.model_copy(update={"answers": 1.0}), VOICE) if h is not None]
    delays = np.quantile([h.from_s - VOICE.t_s for h in heard], [0.25, 0.5, 0.75])
    assert delays == pytest.approx([0.7 / 1.4, 0.7, 0.7 * 1.4], rel=0.05)
    looks = np.quantile([h.looks_for_s for h in heard], [0.25, 0.5, 0.75])
    assert looks == pytest.approx([0.79, 1.0, 1.27], rel=0.05)
    always = Hearing(answers=1.0, delay_spread=1.0, look_spread=1.0)
    assert {h and (h.from_s, h.looks_for_s) for h in heard_by(always, VOICE, people=50)} == {
        (1.7, 1.0)
    }


def test_every_request_within_a_minute_is_heard_less_and_a_quiet_minute_restores_it() -> None:
    all_answer = CALM.model_copy(update={"answers": 1.0, "habituation": 0.5})
    beeps = [replace(VOICE, t_s=5.0 * n) for n in range(3)]
    assert look_share(all_answer, *beeps[:1]) == 1.0
    assert look_share(all_answer, *beeps[:2]) == pytest.approx(0.5, abs=0.04)
    assert look_share(all_answer, *beeps) == pytest.approx(0.5 * 0.5 + 0.5 * 0.25, abs=0.04)
    assert look_share(all_answer, *beeps, replace(VOICE, t_s=80.0)) == 1.0


@pytest.mark.parametrize(
    ("changes", "share"),
    [
        ({"distance_m": 6.0}, 1.0),
        ({"distance_m": 10.5}, 0.5),
        ({"distance_m": 15.0}, 0.0),
        ({"activity": "phone"}, 0.5),
        ({"activity": "carry_box"}, 0.9),
        ({"activity": "kneeling"}, 0.7),
        ({"addressed": False}, 0.3),
        ({"off_rad": np.pi}, 1.0),  # a voice is heard from behind
        ({"means": "light"}, 0.5),
        ({"means": "light", "off_rad": 1.7}, 0.5),
        ({"means": "light", "off_rad": -1.8}, 0.0),
        ({"means": "light", "sighted": False}, 0.0),
        ({"activity": "phone", "distance_m": 10.5}, 0.25),
    ],
)
def test_what_makes_a_request_less_likely_to_be_answered(changes: dict, share: float) -> None:
    all_answer = CALM.model_copy(update={"answers": 1.0})
    assert look_share(all_answer, replace(VOICE, **changes)) == pytest.approx(share, abs=0.04)


def test_a_light_startles_nobody_and_who_is_not_meant_startles_less() -> None:
    jumpy = Hearing(answers=0.0, startles=1.0)
    assert heard_by(jumpy, LIGHT, people=200) == [None] * 200
    bystander = heard_by(jumpy, replace(VOICE, addressed=False))
    assert np.mean([h is not None for h in bystander]) == pytest.approx(0.3, abs=0.04)
