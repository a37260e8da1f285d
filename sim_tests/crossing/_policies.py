"""Policies by name: the library's presets, and ``scanner``, which only the simulator has."""

from __future__ import annotations

from functools import cache
from importlib import resources
from pathlib import Path

from awarenav.errors import not_one_of
from nav_adapter import AwarenessPolicy, NavError
from perception.documents import parse_yaml

from ..world.errors import SimError


def named_policy(policy: AwarenessPolicy | str | Path) -> tuple[str, AwarenessPolicy]:
    """Return the name and the policy.

    Args:
        policy: a policy, whose name is then ``"custom"``; the name of a preset of the library;
            ``"scanner"``, today's AMR with a safety laser scanner, for comparisons only; or a
            ``.yaml`` or ``.yml`` file.

    Raises:
        NavError: for a name that is not a preset, or a file that cannot be used.
        SimError: for a path to another kind of file.
    """
    if isinstance(policy, AwarenessPolicy):
        return "custom", policy
    path = Path(policy)
    if path.suffix.lower() in (".yaml", ".yml"):
        return path.stem, AwarenessPolicy.from_yaml(path)
    if not isinstance(policy, str):
        raise SimError(f"policy must be a preset's name or a .yaml file, got {policy}")
    own = _own_presets()
    if policy in own:
        return policy, own[policy]
    shipped = {path.name for path in resources.files("nav_adapter.policies").iterdir()}
    if f"{policy}.yaml" not in shipped:
        names = {name.removesuffix(".yaml") for name in shipped if name.endswith(".yaml")}
        raise NavError(not_one_of("preset", policy, sorted(names | set(own))))
    return policy, AwarenessPolicy.preset(policy)


@cache
def _own_presets() -> dict[str, AwarenessPolicy]:
    """Return the simulator's own presets by name; they are frozen, so one reading serves all."""
    folder = resources.files("sim_tests.crossing") / "policies"
    return {
        (name := file.name.removesuffix(".yaml")): AwarenessPolicy.model_validate(
            parse_yaml(file.read_text("utf-8"), name, NavError)
        )
        for file in folder.iterdir()
    }
