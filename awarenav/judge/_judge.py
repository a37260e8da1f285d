"""Who counts when estimates are judged, and what good estimates are.

``awarenav judge``: estimates of people against the truth about them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Final

from pydantic import Field, ValidationError

from tracking.config import StrictConfig

from ..errors import AwarenavError
from ..records import PersonRecord, people_by_frame, read_records
from ._figures import PersonFrame, person_figures
from ._matching import average_precision, match_frame


class JudgeConfig(StrictConfig):
    """Who had to be found: people at least so tall, at most so hidden and so cut off.

    Everybody else is neither a miss when overlooked nor a mistake when found.

    Attributes:
        min_height_px: of the true box.
        max_occlusion: share of the person that something else hides, exclusive.
        max_truncation: share of the person outside the picture, exclusive.
    """

    error: ClassVar[type[ValueError]] = AwarenavError

    min_height_px: float = Field(default=40.0, ge=0.0)
    max_occlusion: float = Field(default=0.5, gt=0.0, le=1.0)
    max_truncation: float = Field(default=0.5, gt=0.0, le=1.0)

    @classmethod
    def checked(cls, **values: Any) -> JudgeConfig:
        """Validate settings given one by one; raises AwarenavError that names each wrong one."""
        try:
            return cls(**values)
        except ValidationError as cause:
            wrong = (
                f"{'.'.join(map(str, each['loc']))}: {each['msg']}, got {each['input']!r}"
                for each in cause.errors()
            )
            raise AwarenavError("; ".join(wrong)) from cause


class JudgeLimits(StrictConfig):
    """What the project asks of its own networks on rendered people; ``--gate`` holds them to it.

    Attributes:
        min_ap50: average precision of detection at IoU ≥ 0.5.
        max_gaze_median_deg: error of the head's direction.
        max_gaze_p90_deg: its 90th percentile.
        max_position_median: error of position as a share of range.
        max_awareness_mae: mean absolute error of α.
        max_false_aware: share of α ≥ 0.5 among estimated α whose truth is 0.
        within_1sigma: share of |α error| within one reported standard deviation (a normal
            distribution has 0.68), for a truth or an estimate strictly between 0 and 1.
        within_1sigma_tolerance: by how much it may differ.
    """

    error: ClassVar[type[ValueError]] = AwarenavError

    min_ap50: float = 0.97
    max_gaze_median_deg: float = 5.0
    max_gaze_p90_deg: float = 15.0
    max_position_median: float = 0.04
    max_awareness_mae: float = 0.08
    max_false_aware: float = 0.005
    within_1sigma: float = 0.68
    within_1sigma_tolerance: float = 0.08


#: Which way the head faces, by the angle between its forward axis and the way to the camera.
FACINGS: Final = (("front", 0.0, 60.0), ("profile", 60.0, 120.0), ("back", 120.0, 180.1))
#: Bins of range; the lower edge belongs to the bin.
RANGES_M: Final = ((0.0, 1.5), (1.5, 3.0), (3.0, 4.5), (4.5, 6.0), (6.0, math.inf))

Frames = dict[str, list[PersonRecord]]


def judge_files(
    truth: Path, estimates: Path, config: JudgeConfig | None = None, *, common: bool = False
) -> dict[str, Any]:
    """Judge one JSON Lines file by another; see :func:`judge`.

    Raises:
        AwarenavError: for files that cannot be read or share no frame.
    """
    known, guessed = (people_by_frame(read_records(path), path) for path in (truth, estimates))
    if not known:
        raise AwarenavError(f"{truth} holds no frame")
    if not known.keys() & guessed.keys():
        some = [", ".join(map(repr, list(frames)[:2])) for frames in (known, guessed)]
        raise AwarenavError(
            f"{truth} (frames {some[0]}, …) and {estimates} (frames {some[1] or 'none'}, …) "
            "share no frame: are they of the same pictures?"
        )
    return judge(known, guessed, config, common=common)


def judge(
    truth: Frames, estimates: Frames, config: JudgeConfig | None = None, *, common: bool = False
) -> dict[str, Any]:
    """All figures: of detection, of everybody who had to be found, by facing, by range.

    Args:
        truth: the people of every frame.
        estimates: of every frame; a frame that is missing counts as one in which nobody was
            found, and a frame that the truth lacks is left out.
        config: who had to be found.
        common: leaves out frames that ``estimates`` lacks.
    """
    config = JudgeConfig() if config is None else config
    judged = [name for name in truth if name in estimates or not common]
    detection_frames = []
    wanted_people: list[PersonFrame] = []
    all_people: list[PersonFrame] = []
    surplus = 0
    for name in judged:
        people, guesses = truth[name], estimates.get(name, [])
        wanted = [_had_to_be_found(person, config) for person in people]
        detection_frames.append((people, wanted, guesses))
        match = match_frame(people, wanted, guesses)
        surplus += len(match.surplus)
        partner = dict(match.pairs)
        for index, person in enumerate(people):
            guess = guesses[partner[index]] if index in partner else None
            all_people.append(PersonFrame(person, guess))
            if wanted[index]:
                wanted_people.append(all_people[-1])
    overall = person_figures(wanted_people)
    everyone = person_figures(all_people)
    return {
        "settings": config.model_dump(),
        "frames": {
            "judged": len(judged),
            "without_estimates": sum(name not in estimates for name in judged),
            "unknown": sum(name not in truth for name in estimates),
        },
        "detection": {
            "ap50": average_precision(detection_frames),
            "recall": overall["recall"],
            "false_positives": surplus,
            "false_positives_per_frame": surplus / len(judged) if judged else None,
        },
        "overall": overall,
        "hidden_and_small_too": {
            name: everyone[name]
            for name in ("people", "found", "unaware_judged", "false_aware_count", "false_aware")
        },
        "by_facing": {
            name: person_figures(_between(wanted_people, _facing_deg, low, high))
            for name, low, high in FACINGS
        },
        "by_range_m": {
            f"{low:g} to {high:g}" if math.isfinite(high) else f"{low:g} and more": person_figures(
                _between(wanted_people, _range_m, low, high)
            )
            for low, high in RANGES_M
        },
    }


def _had_to_be_found(person: PersonRecord, config: JudgeConfig) -> bool:
    return (
        person.height_px >= config.min_height_px
        and person.occlusion < config.max_occlusion
        and person.truncation < config.max_truncation
    )


def _facing_deg(person: PersonRecord) -> float | None:
    facing = person.facing_rad
    return None if facing is None else math.degrees(facing)


def _range_m(person: PersonRecord) -> float | None:
    return person.range_m


def _between(people: Sequence[PersonFrame], of: Any, low: float, high: float) -> list[PersonFrame]:
    values = ((each, of(each.truth)) for each in people)
    return [each for each, value in values if value is not None and low <= value < high]
