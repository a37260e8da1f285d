"""Requests for attention and their answers on the page, in plans and in films."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from viewed_crossing import CONDITIONS, SHORT

from nav_adapter import Alert
from nav_adapter.alerts import Answer
from sim_tests.crossing import CrossingFrame, RequestMemory, Stage, TopView, run_crossing
from sim_tests.scenario import Scenario
from sim_tests.viewing import CrossingRecorder, write_page

ASKED_S, LOOKED_S = 0.5, 1.2
LONGER = "goal_x_m: 3.0"
REASON = "track 1: limits the robot to 0.6 m/s, has not looked"
ASKS, LOOKED = "asks by voice: wins 2.1 s", "looked after 0.7 s"


def at(frame: CrossingFrame, t_s: float, step_s: float) -> bool:
    """Return whether this is the one control cycle at a time."""
    return abs(frame.t_s - t_s) < 0.5 * step_s


def asking(frame: CrossingFrame, step_s: float) -> CrossingFrame:
    """Return the frame as of a robot that asks the first person, who looks later."""
    (track,) = frame.tracks[:1] or (None,)
    limit, alerts, answers = frame.constraints, (), ()
    if track is not None and at(frame, ASKED_S, step_s):
        warning = Alert(track.id, "horn", 1.0, 0.2, "track: 1.0 s to contact")
        request = Alert(track.id, "attention", 0.0, 1.5, REASON, means="voice", wins_s=2.1)
        alerts = (warning, request)
    if track is not None and at(frame, LOOKED_S, step_s):
        answers = (Answer(track.id, 0.7),)
    return replace(frame, constraints=replace(limit, alerts=alerts, answers=answers))


def run(*observers, control_hz: float = 20.0, duration_s: float = 3.6) -> None:
    text = SHORT.replace("control_hz: 20.0", f"control_hz: {control_hz}")
    text = text.replace("duration_s: 2.0", f"duration_s: {duration_s}")
    text = text.replace("goal_x_m: 0.6", LONGER)

    def observe(frame: CrossingFrame, stage: Stage) -> None:
        for each in observers:
            each(asking(frame, 1.0 / control_hz), stage)

    scenario = Scenario.from_text(text)
    run_crossing(scenario.draw(0), policy="balanced", perception="truth", observer=observe)


@dataclass
class Asked:
    """Records of observers of one crossing with a request and an answer."""

    recorder: CrossingRecorder = field(default_factory=lambda: CrossingRecorder(CONDITIONS))
    memory: RequestMemory = field(default_factory=RequestMemory)
    shown: list[tuple[float, list[tuple[str, bool]]]] = field(default_factory=list)
    views: dict[str, TopView] = field(default_factory=dict)
    plans: dict[str, np.ndarray] = field(default_factory=dict)

    def remember(self, frame: CrossingFrame, stage: Stage) -> None:
        self.memory.take(frame)
        texts = [(each.text, each.answered) for each in self.memory.shown(frame)]
        self.shown.append((frame.t_s, texts))

    def plan(self, frame: CrossingFrame, stage: Stage) -> None:
        """Draw a plan shortly after the request, with it and without."""
        silent = replace(frame, constraints=replace(frame.constraints, alerts=(), answers=()))
        for name, each in (("asks", frame), ("silent", silent)):
            if name not in self.views:
                self.views[name] = TopView(stage, (440, 260), (-3.0, -3.0, 6.0, 3.0))
            self.views[name].watch(each)
            if at(frame, ASKED_S + 0.25, 0.05):
                drawn = self.views[name].draw(each, stage)
                self.plans[name] = drawn.astype(int)


@pytest.fixture(scope="module")
def asked() -> Asked:
    found = Asked()
    run(found.recorder, found.remember, found.plan)
    return found


@pytest.mark.parametrize("control_hz", [20.0, 60.0])
def test_states_have_each_request_and_answer_once_whatever_the_rate_of_control(control_hz, asked):
    recorder = asked.recorder
    if control_hz != 20.0:
        recorder = CrossingRecorder(CONDITIONS)
        run(recorder, control_hz=control_hz, duration_s=1.5)
    ((t_s, request),) = [(s["t_s"], e) for s in recorder.states for e in s["requests"]]
    ((looked, answer),) = [(s["t_s"], e) for s in recorder.states for e in s["answers"]]
    assert request == {"id": request["id"], "means": "voice", "wins_s": 2.1, "reason": REASON}
    assert answer == {"id": request["id"], "after_s": 0.7}
    assert t_s == pytest.approx(ASKED_S, abs=0.06)
    assert looked == pytest.approx(LOOKED_S, abs=0.06)
    # Warnings of a collision are no requests, and requests no warnings.
    assert [e for s in recorder.states for e in s["alerts"]] == [request["id"]]


def test_a_request_is_shown_for_two_seconds_and_an_answer_takes_its_place(asked):
    asks = [t_s for t_s, each in asked.shown if (ASKS, False) in each]
    looked = [t_s for t_s, each in asked.shown if (LOOKED, True) in each]
    assert (asks[0], asks[-1]) == pytest.approx((ASKED_S, LOOKED_S - 0.05))
    assert (looked[0], looked[-1]) == pytest.approx((LOOKED_S, LOOKED_S + 2.0), abs=0.051)


def test_a_plan_marks_the_person_even_if_the_request_was_in_a_cycle_that_is_not_drawn(asked):
    difference = np.abs(asked.plans["asks"] - asked.plans["silent"]).sum(axis=2)
    rows, columns = np.nonzero(difference > 60)
    # The person is at x = 3.7 m, y = −0.8 m, in a plan of 260 / 6 pixels per metre.
    u, v = 220 + (3.7 - 1.5) * 260 / 6, 130 + 0.8 * 260 / 6
    near = np.hypot(columns - u, rows - v) < 0.75 * 260 / 6
    assert near.sum() > 200
    assert rows.min() >= 0
    assert columns.max() < 440


def test_the_page_says_whom_the_robot_asks_and_who_has_looked(chromium, asked, tmp_path: Path):
    recorder = asked.recorder
    path = tmp_path / "asks.html"
    write_page(path, recorder.begin, recorder.states, "Goal reached after 3.40 s")
    chromium.open(path)
    (track,) = {each["id"] for state in recorder.states for each in state["requests"]}

    def said(t_s: float) -> str:
        at = next(n for n, state in enumerate(recorder.states) if state["t_s"] >= t_s - 1e-6)
        chromium.evaluate(f"crossing.play(false), crossing.seek({at}), true")
        chromium.drawn()
        return chromium.evaluate("document.getElementById('requests').textContent")

    assert said(ASKED_S - 0.05) == "–"
    assert said(ASKED_S + 0.3) == f"asks track {track} by voice: wins 2.1 s"
    assert said(LOOKED_S + 0.3) == f"track {track} looked after 0.7 s"
    assert said(LOOKED_S + 2.1) == "–"
    # Back again, as by scrubbing.
    assert said(ASKED_S + 0.3) == f"asks track {track} by voice: wins 2.1 s"
    assert chromium.complaints() == []
