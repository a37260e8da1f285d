"""The picture of tracks: geometry that it must get right, and what it holds for 0 to 40 tracks."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.lines import Line2D
from matplotlib.patches import Wedge
from track_lines import lines, pose, recorded, standing, walking

from awarenav.tracks._plot import (
    covariance_ellipse,
    path_arrows,
    shown_tracks,
    track_colour,
    tracks_figure,
    view_edges_rad,
)
from awarenav.tracks._recording import read_positions
from awarenav.tracks._tracking import track_recording, tracks_in_file
from perception import Camera

CAMERA = Camera.from_fov(640, 480, math.radians(70.0))


def crowd(number):
    return [standing(3.0 + 2.0 * (k % 8), 2.0 * (k // 8)) for k in range(number)]


def texts(figure):
    found = [each.get_text() for each in figure.texts]
    for axes in figure.axes:
        found += [each.get_text() for each in axes.texts]
        found += [axes.get_title(where) for where in ("left", "right")]
    return [text for text in found if text]


@given(
    st.floats(0.01, 2.0),
    st.floats(0.01, 2.0),
    st.floats(0.0, math.pi),
    st.floats(0.0, 2.0 * math.pi),
)
def test_the_ellipse_is_two_standard_deviations_away_in_every_direction(first, second, turn, at):
    axis = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    covariance = axis @ np.diag([first**2, second**2]) @ axis.T
    drawn = covariance_ellipse(np.array([1.0, -2.0]), covariance, "k")
    rim = drawn.get_patch_transform().transform([math.cos(at), math.sin(at)])
    away = rim - [1.0, -2.0]
    assert math.sqrt(away @ np.linalg.solve(covariance, away)) == pytest.approx(2.0, rel=1e-6)


def test_the_field_of_view_is_that_of_the_camera(tmp_path):
    right, left = view_edges_rad(CAMERA)
    assert (right, left) == pytest.approx((-math.radians(35.0), math.radians(35.0)), abs=1e-3)
    # A principal point left of the middle sees farther to the right.
    aside = Camera(640, 480, 500.0, 500.0, 219.5, 239.5)
    right, left = view_edges_rad(aside)
    assert math.tan(left) == pytest.approx(220.0 / 500.0)
    assert math.tan(right) == pytest.approx(-420.0 / 500.0)
    # It is drawn where the camera looks.
    records = lines([], frames=20, camera=lambda stamp_s: pose(1.0, 2.0, 0.5))
    figure = tracks_figure(tracks_in_file(recorded(tmp_path, records)), "still", camera=CAMERA)
    (wedge,) = [each for each in figure.axes[0].patches if isinstance(each, Wedge)]
    assert wedge.center == pytest.approx((1.0, 2.0))
    assert 0.5 * (wedge.theta1 + wedge.theta2) == pytest.approx(math.degrees(0.5), abs=0.1)
    assert wedge.theta2 - wedge.theta1 == pytest.approx(70.0, abs=0.1)


def test_arrows_point_where_people_walk_and_the_standing_have_none(tmp_path):
    people = [walking(3.0, -2.0, 0.6, 0.8), standing(6.0, 2.0)]
    walker, other = track_recording(recorded(tmp_path, lines(people))).histories
    arrows = path_arrows(walker, 0.5)
    assert len(arrows) >= 4
    late = [heading for _, _, heading in arrows[2:]]
    assert late == pytest.approx([math.atan2(0.8, 0.6)] * len(late), abs=0.1)
    assert path_arrows(other, 0.5) == []


@pytest.mark.parametrize(("number", "columns"), [(1, 1), (7, 2), (13, 3)])
def test_every_track_has_a_panel_its_colour_and_its_number(tmp_path, number, columns):
    run = track_recording(recorded(tmp_path, lines(crowd(number), frames=12)))
    figure = tracks_figure(run, "crowd", camera=CAMERA)
    plan, *panels = figure.axes
    assert [each.get_title("left") for each in panels] == [f"track {k + 1}" for k in range(number)]
    assert len({round(each.get_position().x0, 6) for each in panels}) == columns
    assert {each.get_text() for each in plan.texts} >= {str(k + 1) for k in range(number)}
    assert len({track_colour(k) for k in range(number)}) == number
    figure.canvas.draw()
    boxes = [each.get_position() for each in figure.axes]
    for index, box in enumerate(boxes):
        assert 0.0 <= box.x0 < box.x1 <= 1.0
        assert 0.0 <= box.y0 < box.y1 <= 1.0
        assert not any(box.overlaps(other) for other in boxes[index + 1 :])


def test_a_metre_is_as_long_along_x_as_along_y_and_every_track_is_inside(tmp_path):
    run = track_recording(recorded(tmp_path, lines([walking(2.0, -9.0, 0.1, 4.0)], frames=45)))
    figure = tracks_figure(run, "tall")
    figure.canvas.draw()
    plan = figure.axes[0]
    box = plan.get_position()
    width, height = plan.figure.get_size_inches() * (box.width, box.height)
    (x_min, x_max), (y_min, y_max) = plan.get_xlim(), plan.get_ylim()
    assert width / (x_max - x_min) == pytest.approx(height / (y_max - y_min), rel=1e-6)
    for history in run.histories:
        x, y = history.positions_odom_m.T
        assert (x_min < x).all()
        assert (x < x_max).all()
        assert (y_min < y).all()
        assert (y < y_max).all()


def test_tracks_without_a_panel_are_counted_in_a_note(tmp_path):
    records = lines(crowd(9), frames=20, hidden=lambda k, who: who == 8 and k > 0)
    run = track_recording(recorded(tmp_path, records))
    shown, others = shown_tracks(run.histories, 5)
    assert [each.id for each in shown] == [1, 2, 3, 4, 5]
    assert {each.id for each in others} == {6, 7, 8, 9}
    note = "grey, without a panel: 1 never confirmed and 3 beyond the most that are shown"
    assert note in texts(tracks_figure(run, "crowd", most=5))


def test_nobody_and_one_frame_are_drawn_and_positions_have_no_panels_of_awareness(tmp_path):
    for frames, said in enumerate(("no people in 0 frames", "never confirmed")):
        run = track_recording(recorded(tmp_path, lines([standing(3, 0)], frames=frames)))
        figure = tracks_figure(run, "one")
        figure.canvas.draw()
        assert any(said in text for text in texts(figure))
    path = tmp_path / "people.csv"
    rows = [f"{0.1 * k:.1f},{id},{0.1 * k:.2f},{2.0 * id}" for k in range(20) for id in (1, 2)]
    path.write_text("\n".join(["t_s,id,x_m,y_m", *rows]) + "\n")
    figure = tracks_figure(track_recording(read_positions(path)), "positions")
    assert len(figure.axes) == 1
    assert [legend.get_title().get_text() for legend in figure.legends] == ["From above"]
    assert {"1", "2"} <= set(texts(figure))
    figure.canvas.draw()


def test_a_panel_has_the_lower_bound_one_standard_deviation_and_spans_without_sight(tmp_path):
    hidden = lines(
        [standing(3.0, 0.0)], awareness=lambda t: 0.7, hidden=lambda k, who: 15 <= k < 25
    )
    run = track_recording(recorded(tmp_path, hidden))
    (history,) = run.histories
    panel = tracks_figure(run, "one").axes[1]
    curves = [each for each in panel.lines if len(each.get_xdata()) == len(history.samples)]
    thickest = max(curves, key=Line2D.get_linewidth)
    np.testing.assert_array_equal(thickest.get_ydata(), history.values("awareness_lower"))
    (band,) = panel.collections
    stamp_s, alpha, std = (
        history.stamps_s[10],
        history.samples[10].awareness,
        history.samples[10].awareness_std,
    )
    edge = band.get_paths()[0].vertices
    rows = edge[np.isclose(edge[:, 0], stamp_s)][:, 1]
    assert (rows.min(), rows.max()) == pytest.approx((alpha - std, min(alpha + std, 1.0)))
    spans = [(each.get_x(), each.get_x() + each.get_width()) for each in panel.patches]
    assert spans == [pytest.approx((1.4, 2.5))]
