"""How near an episode came to harm, as the number that is made small."""

from __future__ import annotations

from typing import Final

from ..measures._episode_record import EpisodeRecord

#: A contact that the robot caused lies so far below every margin.
CONTACT: Final = -10.0
#: The robot never moved near anybody, or the episode has no result.
NOTHING: Final = 10.0


def score(record: EpisodeRecord) -> float:
    """The smallest separation margin at a moving robot, in metres, within (−10, 10].

    A contact caused by the robot gives −10 less the robot's speed in m/s, so that harder ones are
    worse. An episode without a result gives 10: it shows nothing.
    """
    if record.error:
        return NOTHING
    if record.robot_contacts > 0:
        return CONTACT - (record.contact_speed_mps or 0.0)
    if record.min_margin_m is None:
        return NOTHING
    return min(max(record.min_margin_m, CONTACT + 0.001), NOTHING)
