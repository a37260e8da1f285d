"""Parameters of how a varied person answers a robot that asks for attention."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from ._variation import Parameter

_EARLIEST_S: Final = 0.2
_LATEST_S: Final = 3.0


def hearing_parameters(hearing: Mapping[str, Any]) -> dict[str, Parameter]:
    """Return the parameters: whether the person answers, when, and a step into the robot's path.

    Args:
        hearing: the person's, the YAML of :class:`~sim_tests.actors.behaviour.Hearing`.
    """
    return {
        "answers": Parameter.of(0.0, 1.0, 0.5),
        "answer_delay_s": Parameter.of(_EARLIEST_S, _LATEST_S, float(hearing["delay_median_s"])),
        "startles_into_path": Parameter.of(0.0, 1.0, 0.0),
    }


def changed_hearing(
    own: Mapping[str, Any] | None, scenarios: Mapping[str, Any], values: Mapping[str, float]
) -> dict[str, Any] | None:
    """Return how the person hears with the given values; as written where nothing changes.

    Args:
        own: as written for the person; None as the scenario says.
        scenarios: the scenario's.
        values: of the parameters.
    """
    hearing = scenarios if own is None else own
    changes: dict[str, float] = {}
    if not 1.0 / 3.0 <= values["answers"] <= 2.0 / 3.0:  # never or always; else the seed draws
        changes["answers"] = float(values["answers"] > 0.5)
    if values["answer_delay_s"] != hearing["delay_median_s"]:
        changes |= {"delay_median_s": values["answer_delay_s"], "delay_spread": 1.0}
    if values["startles_into_path"] >= 0.5:
        changes |= {"startles": 1.0, "startles_into_path": 1.0}
    if not changes:
        return None if own is None else dict(own)
    return {**hearing, **changes}
