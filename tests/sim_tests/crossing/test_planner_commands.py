"""Commands of a planner: what counts as one, and what is said about anything else."""

import numpy as np
import pytest

from sim_tests import Scenario, SimError, run_crossing

SCENARIO = Scenario.model_validate(
    {
        "name": "empty",
        "description": "Half a second in an empty hall.",
        "duration_s": 0.5,
        "control_hz": 10.0,
        "layout": {"x_min_m": -3.0, "y_min_m": -3.0, "x_max_m": 6.0, "y_max_m": 3.0},
        "robot": {"goal_x_m": 2.0},
        "workers": [],
    }
)


class Returns:
    """A planner that always returns the same."""

    def __init__(self, command):
        self.command = command

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return self.command


class Tensor:
    """As much of a torch tensor as a command needs."""

    def __repr__(self) -> str:
        """Without the address, which differs between the processes of one test run."""
        return "Tensor"

    def __init__(self, *values):
        self.values = values
        self.ndim = 1 if len(values) > 1 else 0

    def __len__(self):
        return len(self.values)

    def __getitem__(self, index):
        return Tensor(self.values[index])

    def __float__(self):
        return float(self.values[0])


def cross(planner):
    return run_crossing(SCENARIO, policy="blind", planner=planner)


@pytest.mark.parametrize(
    "command",
    [
        (0.5, 0.25),
        [0.5, 0.25],
        np.array([0.5, 0.25]),
        np.array([0.5, 0.25], dtype=np.float32),
        (np.float32(0.5), np.array(0.25)),
        Tensor(0.5, 0.25),
    ],
    ids=repr,
)
def test_two_numbers_are_a_command_in_any_array_type(command):
    frames = cross(Returns(command)).frames
    assert {frame.command for frame in frames} == {(0.5, 0.25)}
    assert all(type(cell) is float for cell in frames[0].command)


@pytest.mark.parametrize(
    ("command", "described"),
    [
        (None, r"None \(NoneType\)"),
        (0.5, r"0\.5 \(float\)"),
        ((0.5,), r"\(0\.5,\) \(tuple\)"),
        ((0.5, 0.0, 0.0), r"\(0\.5, 0\.0, 0\.0\) \(tuple\)"),
        ((0.5, None), r"\(0\.5, None\) \(tuple\)"),
        ((np.nan, 0.0), r"\(nan, 0\.0\) \(tuple\)"),
        ((0.5, np.inf), r"\(0\.5, inf\) \(tuple\)"),
        (("0.5", "0"), r"\('0\.5', '0'\) \(tuple\)"),
        ("12", r"'12' \(str\)"),
        ((True, False), r"\(True, False\) \(tuple\)"),
        ({"speed_mps": 0.5, "yaw_rate_radps": 0.0}, r"\{'speed_mps': .*\(dict\)"),
        ({0.5, 0.0}, r"\{.*\} \(set\)"),
        (np.zeros((2, 1)), r"\(ndarray of shape \(2, 1\)\)"),
        (np.zeros((3, 2)), r"\(ndarray of shape \(3, 2\)\)"),
        (0.5 + 1j, r"\(complex\)"),
        ([0.5, 1j], r"\(list\)"),
        (list(range(1000)), r"\[0, 1, .{60,80}… \(list\)"),
    ],
)
def test_any_other_command_is_refused_with_what_was_returned(command, described):
    message = (
        f"^planner Returns returned .*{described} at 0.00 s; plan must return "
        r"\(speed_mps, yaw_rate_radps\), two finite numbers in m/s and rad/s$"
    )
    with pytest.raises(SimError, match=message):
        cross(Returns(command))


def test_an_error_of_the_planner_itself_is_its_own():
    class Raises:
        def plan(self, *_):
            raise LookupError("lost")

    with pytest.raises(LookupError, match="lost"):
        cross(Raises())


def test_a_class_or_an_object_without_plan_is_refused():
    with pytest.raises(SimError, match=r"got the class Returns: make one with Returns\("):
        cross(Returns)
    with pytest.raises(SimError, match="must be an object with plan"):
        cross(0.5)
