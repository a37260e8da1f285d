"""Policies of Stable-Baselines3 that NumPy runs alone."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sim_tests import NOVA_CARTER, Scenario, SimError, run_crossing
from sim_tests.learning import LearnedPlanner, NetworkPolicy, ObservationEncoder, PolicyPlanner

_SLOTS, _RAYS = 3, 4
_SIZE = 4 + 2 + 6 * _SLOTS + _SLOTS + _RAYS


def network(seed: int = 0) -> NetworkPolicy:
    rng = np.random.default_rng(seed)
    sizes = (_SIZE, 5, 2)
    weights = tuple(
        rng.normal(size=(after, before)).astype(np.float32)
        for before, after in itertools.pairwise(sizes)
    )
    return NetworkPolicy(
        *(weights, tuple(np.full(len(w), 0.1, np.float32) for w in weights)),
        *(rng.normal(size=_SIZE), rng.uniform(0.5, 2.0, _SIZE), 1.5, _SLOTS, _RAYS),
    )


def observation(seed: int = 1) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    drawn = {
        name: rng.uniform(np.maximum(low, -5.0), np.minimum(high, 5.0)).astype(np.float32)
        for name, (low, high) in ObservationEncoder(_SLOTS, _RAYS).bounds().items()
    }
    return {**drawn, "mask": np.array([1, 1, 0], np.int8)}


def test_a_policy_is_read_as_it_was_written(tmp_path: Path) -> None:
    policy, seen = network(), observation()
    policy.save(tmp_path / "policy.npz")
    read = NetworkPolicy.load(tmp_path / "policy.npz")
    assert (read.people_slots, read.scan_rays) == (_SLOTS, _RAYS)
    assert read(seen).tolist() == policy(seen).tolist()
    # By hand: the arrays in the order of their names.
    names = ("goal", "mask", "people", "robot", "scan")
    signal = np.concatenate([seen[name].ravel() for name in names])
    signal = np.clip((signal - policy.mean) / policy.deviation, -1.5, 1.5)
    hidden = np.tanh(policy.weights[0] @ signal + 0.1)
    assert read(seen) == pytest.approx(policy.weights[1] @ hidden + 0.1, rel=1e-5)


class _Tensor(np.ndarray):
    def cpu(self) -> _Tensor:
        return self

    def numpy(self) -> np.ndarray:
        return np.asarray(self)


def test_the_normalisation_becomes_part_of_the_policy() -> None:
    policy, seen = network(), observation()
    policy = replace(policy, mean=np.zeros(_SIZE), deviation=np.ones(_SIZE), clip=np.inf)
    rng = np.random.default_rng(2)
    normal = {
        name: SimpleNamespace(
            mean=rng.normal(size=seen[name].shape), var=rng.uniform(0.5, 2.0, seen[name].shape)
        )
        for name in ("goal", "people", "robot")
    }
    state = {
        f"{layer}.{part}": array.view(_Tensor)
        for layer, number in (("mlp_extractor.policy_net.0", 0), ("action_net", 1))
        for part, array in (("weight", policy.weights[number]), ("bias", policy.biases[number]))
    }
    model = SimpleNamespace(
        policy=SimpleNamespace(
            state_dict=lambda: state, activation_fn=type("Tanh", (), {}), squash_output=False
        ),
        observation_space=SimpleNamespace(spaces={name: seen[name] for name in seen}),
        get_vec_normalize_env=lambda: SimpleNamespace(
            norm_obs=True, norm_obs_keys=list(normal), obs_rms=normal, epsilon=1e-8, clip_obs=1.0
        ),
    )
    made = NetworkPolicy.of_sb3(model)
    scaled = {
        name: (array - normal[name].mean) / np.sqrt(normal[name].var) if name in normal else array
        for name, array in seen.items()
    }
    scaled = {name: np.clip(array, -1.0, 1.0) for name, array in scaled.items()}
    assert made(seen) == pytest.approx(policy(scaled), abs=1e-4)
    model.policy.activation_fn = type("ReLU", (), {})
    with pytest.raises(SimError, match="tanh between its layers"):
        NetworkPolicy.of_sb3(model)


def test_a_trained_model_gives_the_same_actions_as_its_copy() -> None:
    sb3 = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
    from stable_baselines3.common.env_util import make_vec_env  # noqa: PLC0415
    from stable_baselines3.common.vec_env import VecNormalize  # noqa: PLC0415

    envs = make_vec_env(
        "sim_tests.learning:awarenav/Crossing-v0", env_kwargs={"scan_rays": 4, "control_hz": 5}
    )
    envs = VecNormalize(envs, norm_obs_keys=["goal", "people", "robot", "scan"])
    model = sb3.PPO("MultiInputPolicy", envs, n_steps=32, batch_size=32, device="cpu")
    model.learn(64)
    seen = envs.reset()
    raw = {name: array[0] for name, array in envs.get_original_obs().items()}
    theirs, _ = model.predict(seen, deterministic=True)
    ours = np.clip(NetworkPolicy.of_sb3(model)(raw), -1.0, 1.0)
    assert ours == pytest.approx(theirs[0], abs=1e-4)


def test_the_policy_of_the_package_drives_to_the_goal() -> None:
    scenario = Scenario.shipped("crossing_from_left").draw(0)
    planner = LearnedPlanner(NOVA_CARTER, scenario.planner_boxes_odom_m)
    assert isinstance(planner, PolicyPlanner)
    result = run_crossing(scenario, policy="balanced", planner=planner, seed=0)
    assert result.success


@pytest.mark.parametrize("content", [b"", b"no arrays", None])
def test_other_files_are_refused_by_name(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "policy.npz"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(SimError, match=r"policy\.npz"):
        LearnedPlanner(file=path)


def test_layers_that_do_not_fit_are_refused() -> None:
    policy = network()
    with pytest.raises(SimError, match="last layer must have 2 outputs"):
        replace(policy, weights=policy.weights[:1], biases=policy.biases[:1])
    with pytest.raises(SimError, match="finite weights of shape"):
        replace(policy, weights=policy.weights[::-1], biases=policy.biases[::-1])
    with pytest.raises(SimError, match="mean and deviation must have"):
        replace(policy, people_slots=_SLOTS + 1)
