"""Where a person truly was, and how aware."""

from __future__ import annotations

from dataclasses import dataclass

from perception.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class TruePerson:
    """The truth about one person, with a row for every frame that holds them.

    Attributes:
        id: of the person in the truth file.
        stamps_s: (N,) ascending.
        positions_odom_m: (N, 2).
        awareness: (N,) true α, NaN where the file does not say.
    """

    id: int
    stamps_s: FloatArray
    positions_odom_m: FloatArray
    awareness: FloatArray
