"""Alerts, and whether the robot can still obey, as diagnostics."""

from __future__ import annotations

from .._alert import Alert
from .._constraints import NavConstraints
from ._stamps import header
from .messages.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue

_FROM = "awarenav"


def alerts(constraints: NavConstraints, *, frame_id: str = "") -> DiagnosticArray:
    """``diagnostic_msgs/DiagnosticArray``: the state of the limit, and one status an alert.

    The first status is always there: ``"awarenav: speed limit"``, with ``limited_by`` as its
    message; ERROR when full braking from now on comes too late (``braking_suffices`` is False),
    WARN when the data are stale, else OK. Each alert asked for in this instant follows as a WARN
    named after what is asked for, ``"awarenav: horn"``, ``"awarenav: voice"`` or
    ``"awarenav: light"``, the most urgent first. An alert is in one message only: whoever drives
    the horn sounds it once a status.

    Args:
        constraints: the alerts, and the limit.
        frame_id: of the header; diagnostics have no place.
    """
    return DiagnosticArray(
        header(constraints.stamp_s, frame_id),
        (_limit(constraints), *(_alert(each) for each in constraints.alerts)),
    )


def _limit(constraints: NavConstraints) -> DiagnosticStatus:
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
    )


def _alert(alert: Alert) -> DiagnosticStatus:
    return _status(
        DiagnosticStatus.WARN,
        alert.kind,
        alert.reason,
        track_id=str(alert.track_id),
        time_to_closest_s=f"{alert.time_to_closest_s:.3f}",
        closest_gap_m=f"{alert.closest_gap_m:.3f}",
    )


def _status(level: int, name: str, text: str, **values: str) -> DiagnosticStatus:
    pairs = tuple(KeyValue(key, value) for key, value in values.items())
    return DiagnosticStatus(level, f"{_FROM}: {name}", text, _FROM, pairs)
