"""The registry of measures: columns of ``episodes.csv``, and numbers of episodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

if TYPE_CHECKING:
    from ...crossing import CrossingResult

#: Titles and meanings of :attr:`CrossingResult.noticed`.
NOTICED: Final = {
    "never": ("never noticed", "who have never noticed the robot"),
    "past": ("noticed before", "whose last look at the robot was more than 1 s ago"),
    "looking": ("looking", "who look at the robot, or have within 1 s"),
}
#: The same, and people whom the others hold, too: whose first look was an answer.
CONTACT_PEOPLE: Final = {
    **NOTICED,
    "asked": ("noticed when asked", "who looked at the robot only once it had asked them to"),
}
#: The first with the sum of them.
EVERYBODY: Final = {**NOTICED, "all": ("all", "of whatever they have noticed")}
#: The same, and people who have answered, whom the others hold, too.
STEP_OUT_PEOPLE: Final = {
    **EVERYBODY,
    "answered": ("after an answer", "who have answered a request of the robot"),
}

Better = Literal["lower", "higher", "neither"]
#: The kind of a column's values; a number may be None, where the column does not apply.
Kind = Literal["text", "flag", "count", "number"]
#: By what a measure returns, and what an episode without a log has.
KINDS: Final[dict[str, Kind]] = {
    "str": "text",
    "Awareness": "text",
    "bool": "flag",
    "int": "count",
    "float": "number",
    "float | None": "number",
}
DEFAULTS: Final[dict[Kind, Any]] = {"text": "", "flag": False, "count": 0, "number": None}
UNITS: Final = {"s": "s", "m": "m", "mps": "m/s", "mps2": "m/s²", "mps3": "m/s³"}


@dataclass(frozen=True, slots=True)
class Metric:
    """A number of episodes: its name, its unit and its better direction.

    Attributes:
        name: column of ``episodes.csv``, or name of a figure of many episodes.
        title: for headings.
        unit: empty for a count or a ratio.
        better: the better direction.
        meaning: its definition.
        decimals: to print.
        share: a share of episodes, printed in per cent.
    """

    name: str
    title: str
    unit: str
    better: Better
    meaning: str
    decimals: int = 2
    share: bool = False


@dataclass(frozen=True, slots=True)
class Column:
    """A column of ``episodes.csv``."""

    name: str
    kind: Kind
    meaning: str
    of: Callable[[CrossingResult], Any] | None
    default: Any
    required: bool = False


def _percent(name: str, title: str, better: Better, meaning: str) -> Metric:
    return Metric(name, title, "%", better, meaning, share=True)


#: Shares of episodes, in per cent.
SHARES: Final = {
    each.name: each
    for each in (
        _percent(
            "success",
            "Arrived, touching nobody",
            "higher",
            "Share of episodes in which the goal was reached and the robot moved into nobody; one "
            "that failed counts as not reached.",
        ),
        _percent(
            "moving_contacts",
            "Contacts with a moving robot",
            "lower",
            "Share of episodes in which a moving robot and a person touched, by any cause.",
        ),
        _percent(
            "robot_contacts",
            "Contacts caused by the robot",
            "lower",
            "Share of episodes in which the robot moved into a person.",
        ),
        _percent(
            "person_contacts",
            "People who walked into the robot",
            "lower",
            "Share of episodes in which a person walked into the robot.",
        ),
    )
}


@dataclass(frozen=True, slots=True)
class Ratio:
    """A ratio of two columns of ``episodes.csv``, each summed over the episodes.

    Attributes:
        metric: name, title and direction of the figure.
        column: the column that is summed.
        over: the column whose sum it is divided by; an episode without a number is left out.
        factor: multiplies the ratio.
    """

    metric: Metric
    column: str
    over: str
    factor: float = 1.0


#: Ratios of sums by the name of their figure, as docs/measures.md defines them.
RATIOS: Final = {
    each.metric.name: each
    for each in (
        Ratio(
            Metric(
                "requests_per_hour",
                "Requests per hour",
                "",
                "lower",
                "Requests for attention, divided by the simulated time.",
                decimals=1,
            ),
            "requests",
            "duration_s",
            3600.0,
        ),
        Ratio(
            _percent(
                "answered_share",
                "Share of requests answered",
                "higher",
                "Share of requests whose person began to look at the robot within 2.5 s.",
            ),
            "requests_answered",
            "requests",
        ),
        Ratio(
            _percent(
                "needless_share",
                "Share of needless requests",
                "lower",
                "Share of requests to somebody who, a second later, neither set the speed limit "
                "nor had looked.",
            ),
            "requests_needless",
            "requests",
        ),
    )
}
