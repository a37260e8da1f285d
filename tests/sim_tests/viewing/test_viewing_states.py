"""States of a real crossing: they say what the frames say, small and valid as JSON."""

from __future__ import annotations

import base64
import json
import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from viewed_crossing import SHORT, record

from sim_tests.crossing import draw_camera_view, run_crossing
from sim_tests.scenario import Scenario
from sim_tests.viewing import CameraPictures, outcome_text, page_text, state_of, write_page
from sim_tests.world.errors import SimError


def test_every_state_says_what_its_frame_says(recorded):
    recorder, _, frames = recorded
    assert len(recorder.states) == len(frames)
    for state, frame in zip(recorder.states, frames, strict=True):
        assert state["t_s"] == pytest.approx(frame.t_s, abs=5e-4)
        assert state["robot_odom"][:2] == pytest.approx(frame.robot_state.position_odom_m, abs=5e-4)
        assert state["limit_mps"] == pytest.approx(frame.constraints.speed_limit_mps, abs=5e-4)
        assert state["limited_by"] == frame.constraints.limited_by
        assert [each["id"] for each in state["tracks"]] == [each.id for each in frame.tracks]
        for shown, track in zip(state["tracks"], frame.tracks, strict=True):
            assert shown["awareness_lower"] == pytest.approx(track.awareness_lower, abs=5e-4)
            assert shown["odom"][:2] == pytest.approx(track.position_odom_m, abs=5e-4)
        for shown, kept in zip(state["obstacles"], frame.constraints.obstacles, strict=True):
            assert shown["radius_m"] == pytest.approx(kept.radius_m, abs=5e-4)
        (person,), (truth,) = state["people"], frame.truth
        assert person["awareness"] == pytest.approx(truth.awareness, abs=5e-4)
        gaze = frame.T_odom_camera[:3, :3] @ truth.gaze_camera
        assert math.cos(person["odom"][2] - math.atan2(gaze[1], gaze[0])) > 0.9999


def test_states_are_valid_json_and_small(recorder):
    text = json.dumps([recorder.begin, recorder.states], allow_nan=False)
    bare = [{**state, "picture": None} for state in recorder.states]
    assert json.loads(text)[1] == recorder.states
    assert len(json.dumps(bare)) / len(bare) < 2000


def test_fast_control_gives_twenty_states_a_second():
    fast, _, frames = record(
        camera=False, text=SHORT.replace("control_hz: 20.0", "control_hz: 60.0"), perception="truth"
    )
    times = [state["t_s"] for state in fast.states]
    assert len(frames) > 2.5 * len(times)
    assert np.diff(times) == pytest.approx(0.05, abs=1.1e-3)
    assert fast.begin["step_s"] == pytest.approx(0.05)
    assert fast.note == "Recorded without the robot's camera."


def test_pictures_are_small_and_show_the_person_ahead_on_the_right(recorder):
    pictures = [state["picture"] for state in recorder.states if "picture" in state]
    assert 2 <= len(pictures) <= 4
    for picture in pictures:
        data = base64.b64decode(picture)
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        assert image.shape[1] == 480
        assert len(data) < 60_000


def test_boxes_are_drawn_where_the_person_is():
    drawn = {}

    def with_boxes(frame, box):
        seen = (replace(each, box_xyxy_px=box(each.box_xyxy_px)) for each in frame.observations)
        return replace(frame, observations=tuple(seen))

    def observe(frame, stage):
        if drawn or not frame.observations:
            return
        camera = stage.scenario.camera.camera(1.0)
        picture = np.full((camera.height_px, camera.width_px, 3), 90, dtype=np.uint8)
        for name, box, scale in (
            ("own", lambda box: box, 1.0),
            ("of smaller images", lambda box: 0.5 * box, 0.5),
            ("of another view", lambda box: box - [400.0, 0.0, 400.0, 0.0], 1.0),
            ("none", lambda box: None, 1.0),
        ):
            drawn[name] = draw_camera_view(
                picture, camera, with_boxes(frame, box), stage, box_scale=scale, captions=False
            )

    scenario = Scenario.from_text(SHORT).draw(0)
    run_crossing(scenario, policy="balanced", perception="keypoints", observer=observe)
    assert np.array_equal(drawn["own"], drawn["of smaller images"])
    assert np.array_equal(drawn["of another view"], drawn["none"])
    _, columns = np.nonzero((drawn["own"] != drawn["none"]).any(axis=2))
    assert columns.min() > 320  # the person stands ahead on the right


def test_a_renderer_that_fails_ends_the_pictures_and_not_the_crossing(monkeypatch):
    from sim_tests.world.camera import CameraRenderer  # noqa: PLC0415

    def fail(*_: object) -> None:
        raise RuntimeError("no EGL display")

    monkeypatch.setattr(CameraRenderer, "rgb", fail)
    recorder, result, _ = record()
    assert result.frames
    assert len(recorder.states) == len(result.frames)
    assert not any("picture" in state for state in recorder.states)
    assert recorder.note == "The camera cannot be rendered here: no EGL display"


def test_rendering_takes_no_more_than_its_share_of_the_time(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("sim_tests.viewing._recorder.time.monotonic", lambda: now[0])
    pictures = CameraPictures(1000.0, share=0.25)
    taken = []

    def observe(frame, stage):
        render = stage.warehouse.visuals.draw

        def slow(*arguments):
            now[0] += 0.3
            return render(*arguments)

        monkeypatch.setattr(stage.warehouse.visuals, "draw", slow)
        taken.append(pictures.take(frame, stage) is not None)
        monkeypatch.setattr(stage.warehouse.visuals, "draw", render)
        now[0] += 0.1

    scenario = Scenario.from_text(SHORT).draw(0)
    run_crossing(scenario, policy="blind", perception="truth", observer=observe)
    # A picture takes 0.3 s, so the next one begins 1.2 s after the beginning of the last.
    first, second = [index for index, each in enumerate(taken) if each][:2]
    assert second - first == pytest.approx(9, abs=1)


def test_scans_are_thinned_to_cells_within_the_plan(recorded):
    recorder, _, frames = recorded
    stage_like = type("StageLike", (), {"scenario": Scenario.from_text(SHORT).draw(0)})
    points = np.array([[1.0, 1.0], [1.004, 1.001], [2.0, -1.0], [90.0, 0.0]])
    state = state_of(frames[0], stage_like, points)
    assert state["scan_odom_cm"] == [100, 100, 200, -100]
    many = np.random.default_rng(0).uniform(-2.0, 2.0, (5000, 2))
    assert len(state_of(frames[0], stage_like, many)["scan_odom_cm"]) <= 800
    assert recorder.states[0]["scan_odom_cm"] == []


def test_the_outcome_is_a_sentence(recorded):
    _, result, _ = recorded
    text = outcome_text(result)
    assert text.startswith(f"Goal reached after {result.time_to_goal_s:.2f} s, least separation ")
    assert "contact" not in text


def test_a_page_keeps_within_its_size_and_escapes_its_data(recorder, tmp_path, monkeypatch):
    monkeypatch.setattr("sim_tests.viewing._page.MOST_PICTURE_CHARACTERS", 30_000)
    begin = {**recorder.begin, "scenario": "</script><b>"}
    write_page(tmp_path / "page.html", begin, recorder.states, "Over")
    text = (tmp_path / "page.html").read_text()
    assert 1 <= text.count('"picture":') < sum("picture" in state for state in recorder.states)
    assert text.count("</script>") == 2
    assert "&lt;/script&gt;&lt;b&gt;, seed 0" in text


def test_a_page_without_states_or_a_place_is_refused(recorder, tmp_path):
    with pytest.raises(SimError, match="has no states"):
        write_page(tmp_path / "page.html", recorder.begin, [], "Over")
    with pytest.raises(SimError, match="cannot write"):
        write_page(tmp_path, recorder.begin, recorder.states, "Over")


def test_the_page_of_a_live_crossing_holds_no_states():
    assert '<script type="application/json" id="data">null</script>' in page_text("x")
