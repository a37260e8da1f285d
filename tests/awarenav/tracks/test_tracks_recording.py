"""Estimates files as frames for the tracker: what is refused, left out, assumed, and said."""

from __future__ import annotations

import json

import numpy as np
import pytest
from track_lines import lines, pose, recorded, standing

from awarenav.errors import AwarenavError
from awarenav.tracks._recording import ASSUMED_POSITION_STD_M, read_recording

RECORDS = lines([standing(4.0, 1.0)], frames=4)


def test_a_person_lands_where_they_stand(tmp_path):
    records = lines([standing(4.0, 1.0)], frames=3, camera=lambda t: pose(t, -t, 0.4 * t))
    for frame in recorded(tmp_path, records).frames:
        np.testing.assert_allclose(frame.positions_odom_m(), [[4.0, 1.0]], atol=1e-12)


def test_an_incomplete_last_line_is_left_out_with_a_remark_and_blank_ones_without(tmp_path):
    path = tmp_path / "estimates.jsonl"
    text = "\n" + "\n\n".join(json.dumps(each) for each in RECORDS)
    for end, count, remarks in (
        ("\n \n", len(RECORDS), ()),
        ("\n{", len(RECORDS), ("the last line is incomplete and is left out",)),
    ):
        path.write_text(text + end, "utf-8")
        recording = read_recording(path)
        assert (len(recording.frames), recording.remarks) == (count, remarks)


def test_without_any_pose_the_camera_is_fixed_and_a_frame_without_one_is_left_out(tmp_path):
    recording = recorded(tmp_path, [{**each, "T_odom_camera": None} for each in RECORDS])
    assert all((each.T_odom_camera[:2, 3] == 0.0).all() for each in recording.frames)
    # Level and looking along odom x: the camera's right is odom's −y, its forward is odom's x.
    np.testing.assert_allclose(recording.frames[0].T_odom_camera[:3, :3], pose()[:3, :3])
    assert "assumed to be fixed" in recording.remarks[0]
    recording = recorded(
        tmp_path, [RECORDS[0], {**RECORDS[1], "T_odom_camera": None}, *RECORDS[2:]]
    )
    assert [each.stamp_s for each in recording.frames] == [0.0, 0.2, 0.3]
    assert recording.remarks == (
        "1 frame without T_odom_camera left out, since other frames have one",
    )


def with_person(**change):
    person = {**RECORDS[0]["people"][0], **change}
    return [{**RECORDS[0], "people": [person]}]


def test_values_that_a_person_lacks_are_assumed_or_no_evidence_or_leave_the_person_out(tmp_path):
    recording = recorded(tmp_path, with_person(position_covariance_m2=None, awareness_std=0.0))
    (seen,) = recording.frames[0].observations
    assert (seen.score, seen.awareness, seen.awareness_std) == (1.0, 0.9, 0.0)
    np.testing.assert_allclose(seen.position_covariance_m2, ASSUMED_POSITION_STD_M**2 * np.eye(3))
    assert recording.without_covariance == 1
    recording = recorded(tmp_path, with_person(awareness=1.0, awareness_std=None))
    (seen,) = recording.frames[0].observations
    assert (seen.awareness, seen.awareness_std) == (None, None)
    assert "counts as no evidence" in recording.remarks[0]
    recording = recorded(tmp_path, with_person(position_camera_m=None))
    assert recording.frames[0].observations == ()
    assert recording.remarks == ("1 observation without position_camera_m left out",)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stamp_s": "soon"}, ": stamp_s must be a number"),
        ({"T_odom_camera": (2.0 * np.eye(4)).tolist()}, ": T_odom_camera"),
        ({"people": {}}, ": people must be a list"),
        ({"people": [3]}, ", person 0: a person must be a mapping"),
        ({"tracks": "none"}, ": tracks must be a list"),
        *(
            ({"people": [{**RECORDS[0]["people"][0], **person}]}, f", person 0: {message}")
            for person, message in (
                ({"awareness": 1.5}, "awareness must lie in"),
                ({"position_camera_m": [0.0, 1.0]}, "position_camera_m"),
                ({"position_covariance_m2": (-np.eye(3)).tolist()}, "position_covariance_m2"),
                ({"id": "bob"}, "id must be a whole number or null"),
                ({"id": True}, "id must be a whole number or null"),
                ({"size_range_m": 0.0, "size_range_relative_std": 0.1}, "size_range_m"),
                ({"size_range_m": 3.0}, "size_range_m .*must both be given"),
                (
                    {"awareness": None, "awareness_reason": "face to small"},
                    "awareness_reason .*did you mean",
                ),
                ({"awareness_reason": "no head pose"}, "awareness_reason must be null with"),
                ({"eyes_seen": 1}, "eyes_seen must be true or false"),
            )
        ),
    ],
)
def test_an_invalid_value_is_refused_with_its_frame_and_person(tmp_path, change, message):
    with pytest.raises(AwarenavError, match=f"estimates.jsonl, frame '000000'{message}"):
        recorded(tmp_path, [{**RECORDS[0], **change}])
