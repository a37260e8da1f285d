"""Numbers about people and their looks that several rules share."""

from __future__ import annotations

from typing import Final

#: From this α on, and by this much of its lower bound, a person looks at the robot: within the
#: attention cone, at half its weight.
LOOKING_AWARENESS: Final = 0.5
#: A face of at most this α looks away: with the default cone it points more than 57° off the robot.
#: Whoever passes the robot and looks ahead still has it in the corner of the eye.
AVERTED_AWARENESS: Final = 0.1
#: Nobody runs faster.
FASTEST_MPS: Final = 12.0
