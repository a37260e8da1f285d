"""People of a population who take the place of scripted workers keep their waits."""

import pytest

from sim_tests import Scenario


def people_of(*path: tuple[float, float, float]) -> tuple[float, list[tuple[float, float]], float]:
    """Return start, pauses and speed of the person with the task of a script of (t, x, y)."""
    script = {"path": [{"t_s": t, "x_m": x, "y_m": y} for t, x, y in path]}
    data = {"name": "s", "duration_s": 9.0, "layout": "open", "workers": [script]}
    data["robot"] = {"goal_x_m": 9.0}
    (person,) = Scenario.model_validate(data).with_population("recorded").people
    return person.start_s, [(each.at_m, each.for_s) for each in person.pauses], person.speed_mps


def test_somebody_who_stands_first_starts_after_that():
    start_s, pauses, speed = people_of((0, 3, 2), (4, 3, 2), (7, 3, -1))
    assert (start_s, pauses) == (4.0, [])
    assert speed == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("path", "start_s", "pauses"),
    [
        (((1, 3, 2), (2, 3, 2), (6, 3, 2), (8, 3, 0)), 6.0, []),  # two waits at the first point
        (((-5, 3, 2), (2.5, 3, 2), (5, 3, 0)), 2.5, []),  # it began before the episode
        (((-5, 3, 2), (-2, 3, 2), (5, 3, 0)), 0.0, []),
        (((1, 3, 2), (3, 3, 0), (5, 3, 0), (7, 3, -2)), 1.0, [(2.0, 2.0)]),
        (((0, 3, 2), (3, 3, 2), (5, 3, 0), (8, 3, 0), (9, 3, -1)), 3.0, [(2.0, 3.0)]),
        (((0, 3, 2), (9, 3, 2)), 0.0, []),  # stands all the time
    ],
)
def test_waits_are_kept_where_they_are(path, start_s, pauses):
    found_s, found, _ = people_of(*path)
    assert found_s == start_s
    assert found == pauses
