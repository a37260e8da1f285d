"""An observer of a crossing that hands on its states, live or to a list."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from nav_adapter import Alert
from nav_adapter.alerts import Answer

from ..conditions import Conditions
from ..crossing import CrossingFrame, Stage
from ._pictures import CameraPictures
from ._states import begin_of, cycles_per_state, state_of

# A scan older than this is not drawn.
_SCAN_AGE_S: Final = 0.2


class CrossingRecorder:
    """Turns the control cycles of a crossing into states for a page.

    Give it to :func:`~sim_tests.crossing.run_crossing` as ``observer``.

    Args:
        conditions: the names that the page shows.
        pictures: of the robot's camera; None for none.
        on_begin: called once, before the first state, with the hall and the robot.
        on_state: called with every state.

    Attributes:
        begin: hall, robot and names; empty before the first control cycle.
        states: the states so far.
    """

    def __init__(
        self,
        conditions: Conditions,
        *,
        pictures: CameraPictures | None = None,
        on_begin: Callable[[dict[str, Any]], None] | None = None,
        on_state: Callable[[dict[str, Any]], None] | None = None,
    ) -> None:
        self._conditions = conditions
        self._pictures = pictures
        self._on_begin = on_begin
        self._on_state = on_state
        self._cycles = 0
        self._scan = np.zeros((0, 2))
        self._scan_s = 0.0
        self._alerts: tuple[Alert, ...] = ()
        self._answers: tuple[Answer, ...] = ()
        self.begin: dict[str, Any] = {}
        self.states: list[dict[str, Any]] = []

    def __call__(self, frame: CrossingFrame, stage: Stage) -> None:
        """Take one control cycle."""
        if not self.begin:
            self.begin = begin_of(self._conditions, stage)
            if self._on_begin is not None:
                self._on_begin(self.begin)
        if len(frame.scan_points_odom_m):
            self._scan, self._scan_s = frame.scan_points_odom_m, frame.t_s
        elif frame.t_s - self._scan_s > _SCAN_AGE_S:
            self._scan = np.zeros((0, 2))
        number, self._cycles = self._cycles, self._cycles + 1
        # An alert is in one control cycle only, which may be one between two states.
        limit = frame.constraints
        self._alerts += limit.alerts
        self._answers += limit.answers
        if number % cycles_per_state(stage.scenario.control_hz):
            return
        limit = replace(limit, alerts=self._alerts, answers=self._answers)
        self._alerts, self._answers = (), ()
        state = state_of(replace(frame, constraints=limit), stage, self._scan)
        picture = None if self._pictures is None else self._pictures.take(frame, stage)
        if picture is not None:
            state["picture"] = picture
        self.states.append(state)
        if self._on_state is not None:
            self._on_state(state)

    @property
    def note(self) -> str:
        """The reason for which there are no pictures; empty where there are."""
        if self._pictures is None:
            return "Recorded without the robot's camera."
        return self._pictures.trouble
