"""The picture of the comparison: its headline, its curves and its marks."""

from dataclasses import replace

import pytest

from awarenav.figures import Image
from sim_tests import Scenario, run_crossing
from sim_tests.demo import _comparison_plot as plot
from sim_tests.demo._comparison_plot import headline, plot_comparison


@pytest.fixture(scope="module")
def rows():
    attentive = Scenario.shipped("crossing_attentive")

    def run(scenario, policy):
        return run_crossing(scenario, policy=policy, perception="truth")

    aware = run(attentive, "balanced")
    return (
        ("nobody there", run(attentive.without_people(), "balanced")),
        ("today's AMR", replace(aware, policy="scanner")),
        ("awareness-blind", replace(aware, policy="blind")),
        ("aware, attentive worker", aware),
        ("aware, distracted worker", run(Scenario.shipped("crossing_distracted"), "balanced")),
    )


def test_the_headline_gives_the_time_that_each_worker_costs(rows):
    free, attentive, distracted = (rows[place][1].time_to_goal_s for place in (0, 3, 4))
    text = headline(rows)
    assert f"loses {attentive - free:.1f} s to a worker\nwho watches it" in text
    assert f"{distracted - free:.1f} s to one who looks away" in text


def test_a_robot_that_does_not_arrive_has_no_time_in_the_headline(rows):
    late = [(label, replace(result, time_to_goal_s=None)) for label, result in rows[3:]]
    assert "does not reach" in headline([*rows[:3], *late])


def test_the_picture_can_be_read_on_a_phone(rows, tmp_path):
    plot_comparison(tmp_path / "crossings.png", rows)
    with Image.open(tmp_path / "crossings.png") as picture:
        assert picture.format == "PNG"
        # Text of 13 points at 110 dots per inch is 9 px high in 390 px only up to this width.
        assert picture.width <= 860
        assert picture.height > picture.width


def test_robots_that_never_arrive_are_drawn_too(rows, tmp_path):
    late = [(label, replace(result, time_to_goal_s=None)) for label, result in rows]
    plot_comparison(tmp_path / "crossings.png", late)
    assert (tmp_path / "crossings.png").stat().st_size > 10_000


def test_awareness_is_drawn_for_robots_that_use_it_alone(rows, tmp_path, monkeypatch):
    """The curves of each panel, as they are handed to matplotlib."""
    drawn = []
    genuine = plot._plot_curves

    def spy(axes, curves, texts):
        drawn.append([curve.label for curve in curves])
        genuine(axes, curves, texts)

    monkeypatch.setattr(plot, "_plot_curves", spy)
    plot_comparison(tmp_path / "crossings.png", rows)
    speed, awareness, radius = drawn
    assert len(speed) == 5
    assert awareness == ["aware, attentive worker", "aware, distracted worker"]
    assert len(radius) == 4
