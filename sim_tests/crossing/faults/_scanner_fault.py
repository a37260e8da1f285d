"""Faults of the laser scanners as data."""

from __future__ import annotations

from typing import Final, Literal

from pydantic import Field

from ...world.config import SimConfig
from ._outage import Onset, Outage

#: What a driver publishes for a ray without an answer.
NO_ANSWERS: Final = ("inf", "minus_inf", "nan", "zero", "below_min", "above_max")


class BlindSector(Onset):
    """A sector in which no ray returns, as behind dirt on the window; the default has none.

    It begins as an :class:`Onset` does, at the same time for all scanners.

    Attributes:
        width_deg: width of the sector; 0 for none, 360 for a scanner that sees nothing.
        at_deg: direction of its middle from the robot's heading, left positive; None draws it in
            each episode, evenly over the circle. All scanners are blind in the same direction, so
            that none of them replaces another.
        returns: ``"inf"``: no return, as from empty space; ``"max"``: the longest range, as some
            drivers write it; ``"nan"``: an invalid measurement; ``"zero"``: 0; ``"minus_inf"``: too
            near; ``"below_min"``, ``"above_max"``: half the shortest and twice the longest range.
            ``"any"`` draws one of all but ``"max"`` in each episode.
    """

    width_deg: float = Field(default=0.0, ge=0.0, le=360.0)
    at_deg: float | None = Field(default=None, ge=-180.0, le=180.0)
    returns: Literal["inf", "max", "nan", "zero", "minus_inf", "below_min", "above_max", "any"] = (
        "inf"
    )


class Appearances(SimConfig):
    """False returns that appear as a Poisson process; the default has none.

    Attributes:
        rate_hz: new ones per second; 0 for none.
        for_s: mean lifetime, exponentially distributed.
    """

    rate_hz: float = Field(default=0.0, ge=0.0, le=100.0)
    for_s: float = Field(default=1.0, gt=0.0, le=600.0)


class ScannerFault(SimConfig):
    """A fault of the laser scanners; the default changes nothing, bit for bit.

    Attributes:
        only: number of the one scanner with the fault, from 1; None for all of them.
        frozen: the last scan is delivered again and again. With fresh stamps everything seems to
            move with the robot; with old ones the scanner falls silent.
        dies_within_s: from a time on, evenly distributed from 0 to this, no scan arrives any more;
            0 for a scanner that is dead from the start, None for one that lives.
        drop_rate: share of the scans that never arrive.
        latency_s: delay of every scan; the stamps stay true.
        clock_error_s: the scanner's clock is ahead by this; negative is behind. The robot looks up
            its own pose at the wrong time as well.
        yaw_error_deg: the robot assumes that its scanners are turned this much farther to the left
            than they are.
        blind: a sector without returns.
        reflections: surfaces that reflect rays like a mirror, 0.8 m wide, where the scanner
            measured something within 8 m. Beyond them the scan shows people, posts and racks a
            second time, mirrored; images of people move as the people do.
        ghosts: pairs of legs that do not exist, 0.8 m to 6 m away. Half of them stand; the others
            walk at up to 1.5 m/s. They hide what is behind them.
    """

    only: int | None = Field(default=None, ge=1)
    frozen: Outage = Outage()
    dies_within_s: float | None = Field(default=None, ge=0.0, le=600.0)
    drop_rate: float = Field(default=0.0, ge=0.0, le=1.0)
    latency_s: float = Field(default=0.0, ge=0.0, le=10.0)
    clock_error_s: float = Field(default=0.0, ge=-10.0, le=10.0)
    yaw_error_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    blind: BlindSector = BlindSector()
    reflections: Appearances = Appearances()
    ghosts: Appearances = Appearances()
