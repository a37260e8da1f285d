"""The controls for the situation in the policy explorer: one person, and the robot's motion."""

from __future__ import annotations

from typing import Any, Final


def _number(
    key: str, label: str, unit: str, slider: tuple[float, float, float], default: float, text: str
) -> dict[str, Any]:
    return {
        "key": key,
        "label": label,
        "unit": unit,
        "kind": "number",
        "slider": list(slider),
        "default": default,
        "text": text,
        "nullable": False,
        "low": slider[0],
        "high": slider[1],
        "low_open": False,
        "high_open": False,
    }


#: The controls under the heading of each group. The range of a slider is that of its number too.
SITUATION: Final[dict[str, list[dict[str, Any]]]] = {
    "Person": [
        _number(
            "gap_m",
            "distance",
            "m",
            (0.0, 10.0, 0.05),
            2.0,
            "From the robot's outline to the person's body (radius 0.30 m).",
        ),
        _number(
            "bearing_deg",
            "bearing",
            "°",
            (-180.0, 180.0, 1.0),
            0.0,
            "Direction of the person, to the left of the robot's heading.",
        ),
        {
            "key": "awareness_from",
            "label": "awareness given as",
            "unit": "",
            "kind": "choice",
            "choices": ["lower bound of α", "α and its σ"],
            "default": "lower bound of α",
            "nullable": False,
            "text": "The policy uses the lower bound alone. With α and σ, the bound is that after "
            "one such measurement, with nothing remembered; a tracker that has seen many frames "
            "is surer.",
        },
        _number(
            "awareness_lower",
            "lower bound of α",
            "",
            (0.0, 1.0, 0.01),
            0.6,
            "`PersonTrack.awareness_lower`: 0 is unaware.",
        ),
        _number("awareness", "α", "", (0.0, 1.0, 0.01), 0.8, "Measured awareness."),
        _number(
            "awareness_std", "σ of α", "", (0.0, 0.5, 0.005), 0.1, "Standard deviation of that α."
        ),
        _number(
            "walking_mps", "walking speed", "m/s", (0.0, 3.0, 0.05), 0.0, "Speed of the track."
        ),
        _number(
            "walking_deg",
            "walking direction",
            "°",
            (-180.0, 180.0, 1.0),
            0.0,
            "0 is straight at the robot, 90 across to the person's left, 180 away from the robot.",
        ),
    ],
    "Track": [
        {
            "key": "track",
            "label": "state of the track",
            "unit": "",
            "kind": "choice",
            "choices": ["confirmed", "coasting", "tentative", "first sight"],
            "default": "confirmed",
            "nullable": False,
            "text": "Coasting: not in the latest frame. Tentative: not confirmed yet. First sight: "
            "confirmed, in the adapter's first update with this person.",
        },
        _number(
            "noticed",
            "has noticed the robot",
            "",
            (0.0, 1.0, 0.01),
            0.0,
            "`PersonTrack.noticed`: the belief that the person noticed the robot in the last "
            "seconds. It needs a laser scanner.",
        ),
        {
            "key": "was_aware",
            "label": "was aware before",
            "unit": "",
            "kind": "boolean",
            "default": False,
            "nullable": False,
            "text": "Whether α was 1 before. It matters only between the two levels of the shape "
            "two_level.",
        },
        _number(
            "sigma_m",
            "σ of the position",
            "m",
            (0.0, 1.0, 0.01),
            0.05,
            "Standard deviation of the position, the same in all directions.",
        ),
        _number(
            "velocity_sigma_mps",
            "σ of the velocity",
            "m/s",
            (0.0, 1.0, 0.01),
            0.1,
            "Standard deviation of the velocity, the same in all directions. Matters for "
            "`rules.standing` and `rules.walking`, and for old data.",
        ),
        _number(
            "unseen_s",
            "time since last seen",
            "s",
            (0.0, 3.0, 0.01),
            0.0,
            "Time from the last frame that showed the person to the track. The tracker predicts.",
        ),
        _number(
            "data_age_s",
            "age of the data",
            "s",
            (0.0, 3.0, 0.01),
            0.0,
            "Time since perception last gave anything. The robot's state stays fresh.",
        ),
        {
            **_number(
                "moved_m",
                "moved since standing",
                "m",
                (0.0, 1.0, 0.01),
                0.0,
                "`PersonTrack.moved_m`, for rules.standing with delay_from_tracks; off: not known.",
            ),
            "nullable": True,
            "default": None,
        },
        _number(
            "moved_age_s",
            "age of that bound",
            "s",
            (0.0, 1.0, 0.01),
            0.0,
            "`PersonTrack.moved_age_s`.",
        ),
    ],
    "Robot's motion": [
        _number(
            "speed_mps",
            "speed",
            "m/s",
            (-3.0, 3.0, 0.05),
            1.0,
            "Forward is positive. Its direction decides who is ahead. Below 0.05 m/s the robot "
            "counts as standing: everybody is ahead then.",
        ),
        _number(
            "lateral_mps",
            "speed to the left",
            "m/s",
            (-2.0, 2.0, 0.05),
            0.0,
            "Of a robot that can move sideways. Up to 0.1 m/s counts as noise.",
        ),
    ],
}

#: Settings that act over time: the page has controls for them, and its answer does not use them.
OVER_TIME: Final = (
    "alerts.repeat_after_s",
    "alerts.quiet_s",
    "timing.shrink_rate_mps",
    "timing.hold_s",
    "timing.lost_rise_mps2",
    "timing.new_clock_after_s",
    "filter.prior_awareness",
    "filter.prior_std_logit",
    "filter.evidence_time_constant_s",
    "filter.unseen_time_constant_s",
    "filter.missed_frame_s",
    "filter.no_face_time_constant_s",
    "filter.max_evidence_gap_s",
    "filter.evidence_correlation_s",
    "filter.typical_evidence_std",
    "filter.reported_std_weight",
    "filter.memory_s",
    "filter.noticed_memory_s",
)
