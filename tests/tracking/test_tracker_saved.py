"""A saved and restored tracker continues bit for bit."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_tracker_late_frames import delayed, make_frames, play
from tracking_scenes import CAMERA, as_bytes

from perception import Camera
from tracking import CameraView, PersonTracker, TrackerConfig, TrackingError

VIEW = CameraView(Camera.from_fov(640, 480, 1.2))


@pytest.mark.parametrize("stop", [0, 1, 2, 17, 40, 59])
def test_a_restored_tracker_continues_bit_for_bit(tmp_path: Path, stop: int) -> None:
    # There are late frames before and after the stop, so the frames kept for replay matter.
    frames = delayed(make_frames(6), np.random.default_rng(0), share=0.9)
    tracker = PersonTracker(TrackerConfig(max_coast_s=2.0), view=VIEW)
    play(tracker, frames[:stop])
    tracker.save(tmp_path / "tracker.json")
    restored = PersonTracker.load(tmp_path / "tracker.json", view=VIEW)
    assert restored.config == tracker.config
    assert restored.last_stamp_s == tracker.last_stamp_s
    assert restored.state() == tracker.state()
    for frame in frames[stop:]:
        assert as_bytes(play(restored, [frame])) == as_bytes(play(tracker, [frame]))
    assert restored.state() == tracker.state()
    assert [path.name for path in tmp_path.iterdir()] == ["tracker.json"]


def test_a_state_is_plain_json() -> None:
    tracker = PersonTracker()
    play(tracker, make_frames(2))
    state = tracker.state()
    text = json.dumps(state, allow_nan=False)
    assert json.loads(text) == json.loads(json.dumps(PersonTracker.from_state(state).state()))
    assert PersonTracker.from_state(json.loads(text)).state() == tracker.state()


def test_the_count_of_refused_frames_is_saved() -> None:
    tracker = PersonTracker()
    tracker.update([], 10.0, CAMERA)
    with pytest.raises(TrackingError):
        tracker.update([], 1.0, CAMERA)
    assert PersonTracker.from_state(tracker.state()).refused_late_frames == 1


def broken(change: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
    tracker = PersonTracker()
    play(tracker, make_frames(2))
    state: dict[str, Any] = json.loads(json.dumps(tracker.state()))
    assert state["latest"]["tracks"]["ids"]
    change(state)
    return state


def tracks(state: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = state["latest"]["tracks"]
    return found


WRONG: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "another format": (lambda s: s.update(format="pickle"), "must have format 'awarenav-tracker'"),
    "another version": (lambda s: s.update(version=2), "must have version 3.*got 2"),
    "a missing part": (lambda s: s.pop("latest"), "latest"),
    "an unknown part": (lambda s: s.update(lates=1), "unknown key 'lates'"),
    "a column cut short": (lambda s: tracks(s)["states"].pop(), "one entry per track"),
    "text for a number": (
        lambda s: tracks(s)["states"].__setitem__(0, ["a", 0, 0, 0]),
        r"latest\.tracks\.states\.0\.0",
    ),
    "an id used twice": (
        lambda s: tracks(s)["ids"].__setitem__(-1, tracks(s)["ids"][0] - 1),
        "ids must be above 0 and increase|next_id",
    ),
    "an id that would be used again": (lambda s: s["latest"].update(next_id=1), "next_id must be"),
    "an id too large": (
        lambda s: s["latest"].update(next_id=2**70),
        r"latest\.next_id",
    ),
    "a hit in the future": (
        lambda s: tracks(s)["hit_stamps_s"][0].__setitem__(-1, 1e9),
        "hit_stamps_s must end in a stamp of at most",
    ),
    "a matrix that is not a covariance": (
        lambda s: tracks(s)["covariances"][0][0].__setitem__(0, -1.0),
        r"latest\.tracks\.covariances\[0\] must be positive semi-definite",
    ),
    "a variance of 0": (
        lambda s: tracks(s)["awareness_variances"].__setitem__(0, 0.0),
        "awareness_variances must be above 0",
    ),
    "stamps that go back": (lambda s: s["frames"].reverse(), "must not go back"),
    "another last stamp": (lambda s: s["latest"].update(stamp_s=1e3), r"latest\.stamp_s must be"),
    "another number of hits": (
        lambda s: s["config"].update(confirm_hits=7),
        "must hold confirm_hits = 7 stamps",
    ),
    "a bad config": (lambda s: s["config"].update(max_cost_s=1), "did you mean 'max_coast_s'"),
    "a camera that mirrors": (
        lambda s: s["frames"][0]["T_odom_camera"].__setitem__(0, [0, 0, -1, 0]),
        r"frames\[0\].T_odom_camera",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_broken_state_is_refused_by_name(tmp_path: Path, case: str) -> None:
    change, message = WRONG[case]
    state = broken(change)
    with pytest.raises(TrackingError, match=message):
        PersonTracker.from_state(state)
    path = tmp_path / "broken.json"
    path.write_text(json.dumps(state), encoding="utf-8")
    with pytest.raises(TrackingError, match=r"broken\.json: "):
        PersonTracker.load(path)


def test_an_unusable_file_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(TrackingError, match=r"cannot read .*nothing\.json: No such file"):
        PersonTracker.load(tmp_path / "nothing.json")
    tracker = PersonTracker()
    with pytest.raises(TrackingError, match=r"cannot write .*tracker\.json: No such file"):
        tracker.save(tmp_path / "nowhere" / "tracker.json")
    play(tracker, make_frames(2))
    path = tmp_path / "half.json"
    tracker.save(path)
    whole = path.read_bytes()
    for rest in (b"", whole[: len(whole) // 2], b"\xff\xfe", b"[" * 100_000, b"[1]", b"null"):
        path.write_bytes(rest)
        with pytest.raises(TrackingError, match=r"half\.json"):
            PersonTracker.load(path)


def test_a_state_that_is_not_a_mapping_is_refused() -> None:
    with pytest.raises(TrackingError, match="state must be a mapping, got list"):
        PersonTracker.from_state([])  # type: ignore[arg-type]
