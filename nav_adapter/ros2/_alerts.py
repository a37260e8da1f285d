"""Alerts, answers and the state of the speed limit as diagnostics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .._constraints import NavConstraints
from ..alerts import Alert, Answer
from .conversions import header
from .messages.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue

_NAME = "awarenav"


def alerts(
    constraints: NavConstraints,
    *,
    frame_id: str = "",
    details: Mapping[str, str] | None = None,
    sensors: DiagnosticStatus | None = None,
) -> DiagnosticArray:
    """Return ``diagnostic_msgs/DiagnosticArray``: the limit's state, alerts and answers.

    The first status is always there: ``"awarenav: speed limit"``, with ``limited_by`` as its
    message. Its level is ERROR if full braking from now on comes too late (``braking_suffices`` is
    False), WARN if the data are stale, else OK. The warnings of a collision given now follow as
    WARN, the most urgent first, named ``"awarenav: horn"``, ``"awarenav: voice"`` or
    ``"awarenav: light"``. A request to look at the robot is ``"awarenav: attention"`` and a look
    that answers one is ``"awarenav: answer"``, both OK, since they are no fault. Each alert and
    each answer is in one message only: sound the horn once per status.

    Args:
        constraints: the alerts, the answers and the limit.
        frame_id: of the header; diagnostics do not use it.
        details: more values of the first status, by name.
        sensors: the second status, from :func:`sensor_status`; None to leave it out.
    """
    states = (_limit(constraints, details or {}), *(() if sensors is None else (sensors,)))
    return DiagnosticArray(
        header(constraints.stamp_s, frame_id),
        (
            *states,
            *(_alert(each) for each in constraints.alerts),
            *(_answer(each) for each in constraints.answers),
        ),
    )


def sensor_status(ages_s: Mapping[str, float], lost: Sequence[str]) -> DiagnosticStatus:
    """Return the status ``"awarenav: sensors"``: which sensors are lost.

    Its level is OK if none is, WARN if some are, and ERROR if all are.

    Args:
        ages_s: age of the latest frame of every sensor; infinite before the first.
        lost: names of those that are lost.
    """
    level, text = DiagnosticStatus.OK, "all sensors are at work"
    if lost:
        level = DiagnosticStatus.WARN if len(lost) < len(ages_s) else DiagnosticStatus.ERROR
        text = f"lost: {', '.join(lost)}"
    values = {f"{name}_age_s": f"{age_s:.3f}" for name, age_s in ages_s.items()}
    return _status(level, "sensors", text, **values)


def _limit(constraints: NavConstraints, details: Mapping[str, str]) -> DiagnosticStatus:
    level, text = DiagnosticStatus.OK, constraints.limited_by
    if constraints.stale:
        level = DiagnosticStatus.WARN
    if not constraints.braking_suffices:
        level, text = DiagnosticStatus.ERROR, f"braking comes too late: {text}"
    return _status(
        level,
        "speed limit",
        text,
        speed_limit_mps=f"{constraints.speed_limit_mps:.3f}",
        reachable_speed_limit_mps=f"{constraints.reachable_speed_limit_mps:.3f}",
        braking_suffices=str(constraints.braking_suffices).lower(),
        stale=str(constraints.stale).lower(),
        **details,
    )


def _alert(alert: Alert) -> DiagnosticStatus:
    asks = alert.kind == "attention"
    request = {"means": str(alert.means), "wins_s": f"{alert.wins_s:.3f}"} if asks else {}
    return _status(
        DiagnosticStatus.OK if asks else DiagnosticStatus.WARN,
        alert.kind,
        alert.reason,
        track_id=str(alert.track_id),
        **request,
        time_to_closest_s=f"{alert.time_to_closest_s:.3f}",
        closest_gap_m=f"{alert.closest_gap_m:.3f}",
    )


def _answer(answer: Answer) -> DiagnosticStatus:
    return _status(
        DiagnosticStatus.OK,
        "answer",
        f"track {answer.track_id} looked {answer.after_s:.1f} s after the request",
        track_id=str(answer.track_id),
        after_s=f"{answer.after_s:.3f}",
    )


def _status(level: int, name: str, text: str, **values: str) -> DiagnosticStatus:
    pairs = tuple(KeyValue(key, value) for key, value in values.items())
    return DiagnosticStatus(level, f"{_NAME}: {name}", text, _NAME, pairs)
