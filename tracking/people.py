"""Numbers about people and their looks that several rules share."""

from __future__ import annotations

import math
from typing import Final

#: From this α on, and by this much of its lower bound, a person looks at the robot: within the
#: attention cone, at half its weight.
LOOKING_AWARENESS: Final = 0.5
#: A face of at most this α looks away: with the default cone it points more than 57° off the robot.
#: Whoever passes the robot and looks ahead still has it in the corner of the eye.
AVERTED_AWARENESS: Final = 0.1
#: Of people who look at a robot, half have taken it in after half a second: the probability after
#: looks of t seconds in all is 1 − exp(−t / NOTICING_S).
NOTICING_S: Final = 0.5 / math.log(2.0)
#: What is known of somebody lasts so long at most once their face looks away. Anybody may look away
#: at any moment, so a limit that never counts on more does not fall in a step when they do.
AVERTED_LEFT_S: Final = 1.5
#: Nobody runs faster.
FASTEST_MPS: Final = 12.0
#: Somebody walks at this speed or faster: three standard deviations of a velocity from scans.
WALKING_MPS: Final = 0.4
