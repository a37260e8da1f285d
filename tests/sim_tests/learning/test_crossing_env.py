"""The Gymnasium environment: the loop of run_crossing, step by step."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from paths import ROOT

gymnasium = pytest.importorskip("gymnasium", reason="needs the extra awarenav[gym]")

from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402

from sim_tests import ReferencePlanner, SimError, run_crossing  # noqa: E402
from sim_tests.actors.robot import NOVA_CARTER  # noqa: E402
from sim_tests.crossing import CrossingFrame  # noqa: E402
from sim_tests.learning import CrossingEnv, PolicyPlanner  # noqa: E402
from sim_tests.scenario import Scenario  # noqa: E402
from sim_tests.world.bullet import pybullet  # noqa: E402


def make(**kwargs: Any) -> CrossingEnv:
    env = gymnasium.make("awarenav/Crossing-v0", **kwargs).unwrapped
    assert isinstance(env, CrossingEnv)
    return env


def signature(frame: CrossingFrame) -> tuple[Any, ...]:
    """Return the numbers of a frame, for comparisons to the bit."""
    limits = frame.constraints
    return (
        frame.t_s,
        frame.robot_state.position_odom_m.tobytes(),
        frame.T_odom_camera.tobytes(),
        [
            (each.position_odom_m.tobytes(), each.gaze_camera.tobytes(), each.awareness)
            for each in frame.truth
        ],
        [(each.id, each.position_odom_m.tobytes(), each.awareness) for each in frame.tracks],
        (limits.speed_limit_mps, limits.limited_by, limits.fastest_point_limit_mps),
        [(each.center_odom_m.tobytes(), each.radius_m) for each in limits.obstacles],
        frame.command,
        frame.margins_m,
        frame.separations_m,
    )


def test_the_reference_planner_drives_the_crossing_of_run_crossing() -> None:
    result = run_crossing("crossing_from_left", policy="balanced", seed=3)
    env = make(scenarios="crossing_from_left", normalised_actions=False)
    _, info = env.reset(seed=3)
    planner = ReferencePlanner(NOVA_CARTER, env.crossing.scenario.planner_boxes_odom_m)
    frames, ended = [], False
    while not ended:
        now = env.situation
        action = planner.plan(
            now.known_state, env.crossing.goal_odom_m, now.constraints, env.crossing.dt_s
        )
        _, _, terminated, truncated, info = env.step(np.array(action))
        assert env.frame is not None
        frames.append(env.frame)
        ended = terminated or truncated
    # The last frame of run_crossing has a command that is never driven: the robot is at its goal.
    assert len(frames) == len(result.frames) - 1
    assert list(map(signature, frames)) == list(map(signature, result.frames[:-1]))
    assert info["end"] == "goal"
    assert info["is_success"]
    assert info["t_s"] == result.time_to_goal_s
    assert info["min_margin_m"] == result.min_margin_m
    assert info["min_separation_m"] == result.min_separation_m
    assert info["violation_time_s"] == result.violation_time_s
    env.close()


def test_a_policy_drives_the_same_in_the_environment_and_as_a_planner() -> None:
    def policy(observation: dict[str, Any]) -> np.ndarray:
        x, y = observation["goal"]
        limit = observation["robot"][2]
        return np.array([0.6 * limit / 1.5, np.clip(np.arctan2(y, x), -1, 1)], np.float32)

    scenario = Scenario.shipped("blind_corner").draw(1)
    scenario = scenario.model_copy(update={"duration_s": 3.0})
    env = make(scenarios=scenario, scan_rays=12)
    observation, _ = env.reset(seed=1)
    planner = PolicyPlanner(policy, scan_rays=12, static_boxes_odom_m=scenario.planner_boxes_odom_m)
    result = run_crossing(scenario, policy="balanced", planner=planner, seed=1)
    frames, truncated = [], False
    while not truncated:
        observation, _, _, truncated, info = env.step(policy(observation))
        assert observation in env.observation_space
        frames.append(env.frame)
    assert info["end"] == "time"
    assert list(map(signature, frames)) == list(map(signature, result.frames))
    assert info["min_margin_m"] == result.min_margin_m
    env.close()


def test_a_new_process_makes_it_by_module_and_name() -> None:
    """As the workers of a vector environment do, which have imported nothing."""
    code = "import gymnasium; print(gymnasium.make('sim_tests.learning:awarenav/Crossing-v0').spec)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=ROOT
    )
    assert "awarenav/Crossing-v0" in done.stdout, done.stderr


def test_a_worker_of_a_fork_server_knows_the_name_alone(tmp_path: Path) -> None:
    """As the workers of Stable-Baselines3's SubprocVecEnv, whatever the main module imports."""
    script = tmp_path / "train.py"
    script.write_text(
        "import gymnasium, multiprocessing, sys\n"
        "if __name__ == '__main__':\n"
        "    import sim_tests.learning\n"
        "    context = multiprocessing.get_context('forkserver')\n"
        "    worker = context.Process(target=gymnasium.make, args=('awarenav/Crossing-v0',))\n"
        "    worker.start()\n"
        "    worker.join()\n"
        "    sys.exit(worker.exitcode)\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("kwargs", [{}, {"scan_rays": 16, "render_view": "camera"}])
def test_gymnasiums_own_check_passes_without_warnings(kwargs: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make("awarenav/Crossing-v0", render_mode="rgb_array", **kwargs)
        check_env(env.unwrapped)
    env.close()


def test_the_same_seed_gives_the_same_episode_and_no_seed_a_new_one() -> None:
    env = make(scenarios=["crossing_from_left", "blind_corner"])

    def episode(**kwargs: Any) -> list[Any]:
        observation, info = env.reset(**kwargs)
        rows = [info["scenario"], info["seed"], observation["people"].tobytes()]
        for _ in range(20):
            observation, reward, *_ = env.step(np.array([0.7, 0.2]))
            rows += [reward, *(each.tobytes() for each in observation.values())]
        return rows

    first, second = episode(seed=5), episode()
    assert second != first
    assert episode(seed=5) == first
    assert episode() == second
    assert episode(seed=5, options={"scenario": "blind_corner"})[0] == "blind_corner"
    with pytest.raises(SimError, match="options of reset must be 'scenario' alone, got speed"):
        env.reset(options={"speed": 1.0})
    env.close()


def test_a_contact_that_the_robot_causes_ends_the_episode() -> None:
    env = make(scenarios="stops_midway")
    env.reset(seed=0)
    for _ in range(400):
        _, reward, terminated, truncated, info = env.step(np.array([0.6, 0.0]))
        if terminated or truncated:
            break
    assert (terminated, truncated, info["end"], info["contact"]) == (
        True,
        False,
        "contact",
        "robot",
    )
    assert info["reward_parts"]["contact"] == -20.0
    assert reward == pytest.approx(sum(info["reward_parts"].values()))
    with pytest.raises(SimError, match="the episode has ended: call reset"):
        env.step(np.zeros(2))
    env.close()


def test_exceeding_the_limit_costs_what_the_weights_say() -> None:
    env = make(scenarios="crossing_from_left", reward={"over_limit_per_m": -7.0, "time_per_s": 0.0})
    env.reset(seed=0)
    _, _, _, _, info = env.step(np.array([1.0, 1.0]))
    limits = env.frame.constraints if env.frame is not None else None
    assert limits is not None
    over = 1.5 + 1.5 * NOVA_CARTER.circumscribed_radius_m - limits.fastest_point_limit_mps
    over = max(over, 1.5 - limits.speed_limit_mps, 0.0)
    assert info["reward_parts"]["over_limit"] == pytest.approx(-7.0 * over / 20.0)
    assert info["reward_parts"]["time"] == 0.0
    env.close()


def test_actions_are_checked_and_clipped() -> None:
    env = make()
    env.reset(seed=0)
    assert env.step(np.array([5.0, -5.0]))[4]["command"] == [1.5, -1.5]
    for wrong in ([np.nan, 0.0], [1.0], "fast"):
        with pytest.raises(SimError, match="an action must be two finite numbers"):
            env.step(wrong)
    env.close()
    with pytest.raises(SimError, match="call reset first"):
        env.step(np.zeros(2))


def test_a_copy_has_the_arguments_and_no_episode() -> None:
    env = make(scenarios="blind_corner", control_hz=10.0)
    env.reset(seed=0)
    for other in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        with pytest.raises(SimError, match="call reset first"):
            other.step(np.zeros(2))
        _, info = other.reset(seed=0)
        assert info["scenario"] == "blind_corner"
        assert other.crossing.dt_s == 0.1
        other.close()
    env.close()


def test_every_physics_world_is_closed() -> None:
    env = make()
    clients = []
    for seed in range(3):
        env.reset(seed=seed)
        clients.append(env.crossing.stage.warehouse.client)
    env.close()
    env.close()
    assert not any(pybullet.isConnected(client) for client in clients)


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_vectors_of_environments(mode: str) -> None:
    short = Scenario.shipped("crossing_from_left").draw(0)
    short = short.model_copy(update={"duration_s": 0.2})
    envs = gymnasium.make_vec("awarenav/Crossing-v0", 2, vectorization_mode=mode, scenarios=short)
    observation, info = envs.reset(seed=4)
    assert observation["people"].shape == (2, 8, 6)
    single = make(scenarios=short)
    alone, _ = single.reset(seed=5)
    assert np.array_equal(observation["people"][1], alone["people"])
    for _ in range(6):
        observation, reward, _, _, info = envs.step(np.zeros((2, 2), np.float32))
    assert reward.shape == (2,)
    assert info["margins_m"].shape == (2,)
    assert AutoresetMode.NEXT_STEP in (envs.metadata["autoreset_mode"],)
    envs.close()
    single.close()
    assert mode == "async" or isinstance(envs.unwrapped, SyncVectorEnv)
