"""Policies of Stable-Baselines3 that NumPy runs alone, as planners."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nav_adapter import RobotProfile

from ..actors.robot import NOVA_CARTER
from ..world.errors import SimError
from ._policy_planner import NO_BOXES, Observation, ObservationEncoder, PolicyPlanner

#: The policy that comes with the package; docs/learning.md says how it was made.
_SHIPPED: Final = Path(__file__).with_name("crossing.npz")


@dataclass(frozen=True, slots=True, eq=False)
class NetworkPolicy:
    """A policy of fully connected layers, with tanh between them.

    Its input are the arrays of an observation, one after the other, in the order of their names,
    less their means, over their deviations, and clipped.

    Attributes:
        weights: one (outputs, inputs) per layer.
        biases: one (outputs,) per layer.
        mean: (inputs,) of the first layer.
        deviation: (inputs,) > 0.
        clip: largest absolute input.
        people_slots: as in the environment in which it was trained.
        scan_rays: as there.
    """

    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]
    mean: NDArray[np.float64]
    deviation: NDArray[np.float64]
    clip: float
    people_slots: int
    scan_rays: int

    def __post_init__(self) -> None:
        encoder = ObservationEncoder(self.people_slots, self.scan_rays)
        size = self.people_slots + sum(low.size for low, _ in encoder.bounds().values())
        if {self.mean.shape, self.deviation.shape} != {(size,)} or not (self.deviation > 0).all():
            raise SimError(f"mean and deviation must have {size} numbers, got {self.mean.size}")
        for weight, bias in zip(self.weights, self.biases, strict=True):
            if weight.shape != (bias.size, size) or not np.isfinite(weight).all():
                raise SimError(
                    f"a layer must have finite weights of shape {(bias.size, size)}, got "
                    f"{weight.shape}"
                )
            size = bias.size
        if size != 2:
            raise SimError(f"the last layer must have 2 outputs, got {size}")

    def __call__(self, observation: Observation) -> NDArray[Any]:
        """Return the action (2,) for an observation."""
        given = np.concatenate([observation[name].ravel() for name in sorted(observation)])
        signal = np.clip((given - self.mean) / self.deviation, -self.clip, self.clip)
        *hidden, last = zip(self.weights, self.biases, strict=True)
        for weight, bias in hidden:
            signal = np.tanh(weight @ signal + bias)
        weight, bias = last
        return np.asarray(weight @ signal + bias)

    @classmethod
    def of_sb3(cls, model: Any) -> NetworkPolicy:
        """Return the policy of a trained PPO or A2C of Stable-Baselines3, without its noise.

        The normalisation of a ``VecNormalize`` becomes part of it.

        Args:
            model: made with ``"MultiInputPolicy"`` for the environment of crossings.

        Raises:
            SimError: for layers that are not those of the default network.
        """
        named = {name: each.cpu().numpy() for name, each in model.policy.state_dict().items()}
        actor = [name for name in named if name.startswith("mlp_extractor.policy_net.")]
        names = [name.removesuffix(".weight") for name in actor if name.endswith(".weight")]
        if not names or model.policy.activation_fn.__name__ != "Tanh" or model.policy.squash_output:
            raise SimError("the policy must be that of a PPO or A2C with tanh between its layers")
        names.append("action_net")
        weights, biases = ([named[f"{each}.{part}"] for each in names] for part in _PARTS)
        shapes = {name: box.shape for name, box in model.observation_space.spaces.items()}
        means = {name: np.zeros(shape) for name, shape in shapes.items()}
        deviations, clip = {name: np.ones(shape) for name, shape in shapes.items()}, np.inf
        envs = model.get_vec_normalize_env()
        if envs is not None and envs.norm_obs:
            clip = envs.clip_obs
            for name in envs.norm_obs_keys:
                seen = envs.obs_rms[name]
                means[name], deviations[name] = seen.mean, np.sqrt(seen.var + envs.epsilon)
        mean, deviation = (
            np.concatenate([arrays[name].ravel() for name in sorted(shapes)])
            for arrays in (means, deviations)
        )
        scan = shapes.get("scan", (0,))
        return cls(
            *(tuple(weights), tuple(biases), mean, deviation, float(clip)),
            people_slots=shapes["mask"][0],
            scan_rays=scan[0],
        )

    def save(self, path: str | Path) -> None:
        """Write the policy as a file of NumPy arrays (``.npz``)."""
        arrays: dict[str, Any] = {
            f"{part}_{number}": layer
            for part, layers in zip(_PARTS, (self.weights, self.biases), strict=True)
            for number, layer in enumerate(layers)
        }
        arrays |= {name: np.asarray(getattr(self, name)) for name in _OTHERS}
        np.savez_compressed(path, **arrays)

    @classmethod
    def load(cls, path: str | Path) -> NetworkPolicy:
        """Read a policy that :meth:`save` wrote.

        Raises:
            SimError: it cannot be read, or is no policy.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                arrays = dict(file)
            count = sum(name.startswith(_PARTS[0]) for name in arrays)
            weights, biases = (
                tuple(arrays[f"{part}_{number}"] for number in range(count)) for part in _PARTS
            )
            mean, deviation, *numbers = (arrays[name] for name in _OTHERS)
            clip, people_slots, scan_rays = (each.item() for each in numbers)
            return cls(weights, biases, mean, deviation, clip, people_slots, scan_rays)
        except OSError as cause:
            raise SimError(f"cannot read {path}: {cause.strerror or cause}") from cause
        except (KeyError, ValueError, EOFError, BadZipFile) as cause:
            raise SimError(f"{path} is no policy that NetworkPolicy.save wrote") from cause


_PARTS: Final = ("weight", "bias")
_OTHERS: Final = ("mean", "deviation", "clip", "people_slots", "scan_rays")


class LearnedPlanner(PolicyPlanner):
    """Drives with a policy that NumPy runs alone: ``--planner sim_tests.learning:LearnedPlanner``.

    Args:
        robot: the robot, whose limits are the bounds of the actions.
        static_boxes_odom_m: (N, 4) boxes of the scan.
        file: what :meth:`NetworkPolicy.save` wrote; by default the policy of the package, which
            was trained for six minutes and touches people (docs/learning.md).

    Raises:
        SimError: the file cannot be read, or is no policy.
    """

    def __init__(
        self,
        robot: RobotProfile = NOVA_CARTER,
        static_boxes_odom_m: ArrayLike = NO_BOXES,
        file: str | Path = _SHIPPED,
    ) -> None:
        policy = NetworkPolicy.load(file)
        super().__init__(
            policy,
            robot,
            people_slots=policy.people_slots,
            scan_rays=policy.scan_rays,
            static_boxes_odom_m=static_boxes_odom_m,
        )
