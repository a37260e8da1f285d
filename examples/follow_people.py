"""Track the people in a file of estimates, or in made-up estimates.

``python examples/follow_people.py FILE.jsonl`` reads the output of ``awarenav estimate``, with a
camera pose in every line. Without a file, a person walks past a standing camera, looks at it, is
hidden for a second and looks away. The lower bound, which navigation uses, rises while the person
is seen looking and falls as soon as nothing is seen.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from perception import PersonObservation
from tracking import PersonTrack, PersonTracker

# A camera 1.4 m above the floor that looks along odom x.
T_ODOM_CAMERA = [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.4], [0, 0, 0, 1]]


def made_up() -> Iterator[dict[str, Any]]:
    """Yield four seconds of one person at 10 frames/s, as lines of a file of estimates."""
    for tick in range(41):
        stamp_s = 0.1 * tick
        person = {
            "position_camera_m": [1.5 - 0.7 * stamp_s, 0.1, 3.5],
            "position_covariance_m2": np.diag([0.0009, 0.0009, 0.01]).tolist(),
            "gaze_camera": None,
            "awareness": 0.9 if stamp_s < 3.0 else 0.0,
            "awareness_std": 0.1,
            "score": 0.9,
        }
        hidden = 1.5 < stamp_s < 2.5
        yield {
            "stamp_s": stamp_s,
            "T_odom_camera": T_ODOM_CAMERA,
            "people": [] if hidden else [person],
        }


def follow(lines: Iterable[dict[str, Any]]) -> Iterator[tuple[PersonTrack, ...]]:
    """Yield the tracks after every frame."""
    tracker = PersonTracker()
    for line in lines:
        stamp_s = line["stamp_s"]
        observations = [
            PersonObservation(
                stamp_s=stamp_s,
                position_camera_m=person["position_camera_m"],
                position_covariance_m2=person["position_covariance_m2"],
                gaze_camera=person["gaze_camera"],
                awareness=person["awareness"],
                awareness_std=person["awareness_std"],
                score=person["score"],
            )
            for person in line["people"]
        ]
        yield tracker.update(observations, stamp_s, line["T_odom_camera"])


def main() -> None:
    """Print one line per track and frame."""
    lines = made_up()
    if len(sys.argv) > 1:
        text = Path(sys.argv[1]).read_text(encoding="utf-8")
        lines = (json.loads(line) for line in text.splitlines())
    for tracks in follow(lines):
        for track in tracks:
            x, y = track.position_odom_m
            print(
                f"{track.stamp_s:6.2f} s  track {track.id} {track.status:9} at "
                f"({x:5.2f}, {y:5.2f}) m, awareness {track.awareness:4.2f}, "
                f"at least {track.awareness_lower:4.2f}"
            )


if __name__ == "__main__":
    main()
