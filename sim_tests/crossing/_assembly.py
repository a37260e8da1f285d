"""The one place that puts an episode together: for the API, the commands and Gymnasium."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from awarenav.errors import not_one_of
from nav_adapter import AwarenessPolicy, NavAdapter, NavError
from perception import AwarenessPipeline
from perception.documents import parse_yaml

from ..actors.robot import RobotModel
from ..conditions import (
    NO_FAULT,
    REFERENCE_PLANNER,
    Conditions,
    Perception,
    changed_scenario,
    refuse_unused_networks,
    table_name,
)
from ..scenario import SCENARIO_SETS, Scenario, shipped_scenarios
from ..world.config import checked_seed
from ..world.errors import SimError
from ..world.render import RendererName
from ._command import check_planner
from ._fields import SCANNER_WARNING, FieldsAdapter
from ._sensing import Sensing
from ._stage import Stage
from .faults import EpisodeFaults, Fault
from .planner import LocalPlanner, make_planner, planner_label
from .sensors import STREAMS, KeypointNoise, SensorSetup


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Setup:
    """An episode that can be driven: its conditions, and what their names stand for.

    Attributes:
        conditions: by their names in tables.
        scenario: drawn by the seed, with the camera, the robot and the population.
        policy: of the adapter.
        planner: a planner; or its name, as for :func:`make_planner`.
        fault: a fault of sensors, detections or odometry; None for none.
        noise: noise of the keypoint camera; None for the default.
        pipeline: pipeline for ``"pixels"``; None for the scenario's networks.
        renderer: renderer of the images.
    """

    conditions: Conditions
    scenario: Scenario
    policy: AwarenessPolicy
    planner: LocalPlanner | str = ""
    fault: Fault | None = None
    noise: KeypointNoise | None = None
    pipeline: AwarenessPipeline | None = None
    renderer: RendererName = "auto"

    @classmethod
    def of(
        cls,
        scenario: Scenario | str,
        *,
        policy: AwarenessPolicy | str | Path,
        planner: LocalPlanner | str | None = None,
        perception: str = "truth",
        seed: int = 0,
        fault: Fault | str | None = None,
        noise: KeypointNoise | None = None,
        pipeline: AwarenessPipeline | None = None,
        renderer: RendererName = "auto",
        **axes: Any,
    ) -> Setup:
        """Return the episode of some arguments of :func:`run_crossing`.

        Raises:
            SimError: an unknown or unusable argument.
            NavError: an unknown preset or unusable policy file.
        """
        seed = checked_seed(seed)
        sight = Perception.named(perception)
        refuse_unused_networks(axes, sight.kind)
        drawn = changed(scenario, axes).draw(seed)
        policy_name, own_policy = named_policy(policy)
        driver = "" if planner in (None, REFERENCE_PLANNER) else planner
        own_fault = named_fault(fault)
        return cls(
            conditions=Conditions(
                drawn.name,
                seed,
                policy_name,
                planner_label(driver, drawn)
                if isinstance(driver, str)
                else type(check_planner(driver)).__name__,
                sight.name,
                fault=own_fault.name if own_fault else "",
                **axis_names(axes),
            ),
            scenario=drawn,
            policy=own_policy,
            planner=driver,
            fault=own_fault,
            noise=noise,
            pipeline=pipeline,
            renderer=renderer,
        )

    def driver(self) -> LocalPlanner:
        """Return the planner, or make the one of that name."""
        if isinstance(self.planner, str):
            return make_planner(self.planner, self.scenario, self.conditions.seed)
        return self.planner

    def assembled(self) -> tuple[Stage, Sensing, NavAdapter | FieldsAdapter]:
        """Return stage, senses with their tracker, and adapter; the stage must be closed.

        Raises:
            SimError: a perception with scanners and a scenario without any.
            PerceptionError: for ``"pixels"``, when the shipped networks cannot be loaded.
        """
        scenario, seed = self.scenario, self.conditions.seed
        _, _, _, people_rng = np.random.default_rng(seed).spawn(STREAMS)
        stage = Stage(scenario, people_rng, renderer=self.renderer)
        try:
            sensors = SensorSetup(
                stage=stage,
                seed=seed,
                faults=EpisodeFaults(self.fault, seed, scenario.camera.camera()),
                noise=self.noise or KeypointNoise(),
                pipeline=self.pipeline,
            )
            sensing = Sensing(sensors, Perception.named(self.conditions.perception), self.policy)
        except BaseException:
            stage.close()
            raise
        adapter = FieldsAdapter if self.conditions.policy == SCANNER_WARNING else NavAdapter
        return stage, sensing, adapter(self.policy, scenario.robot_profile)


def changed(scenario: Scenario | str, axes: Mapping[str, Any]) -> Scenario:
    """Return a scenario as the camera, the robot, the population and the like change it.

    Args:
        scenario: a scenario, a shipped name or a YAML file.
        axes: by name; None and empty ones keep the scenario's own.

    Raises:
        SimError: an unknown scenario, camera, robot or population.
    """
    if isinstance(scenario, str):
        scenario = Scenario.named(scenario)
    return changed_scenario(scenario, axes)


def named_policy(policy: AwarenessPolicy | str | Path) -> tuple[str, AwarenessPolicy]:
    """Return the name and the policy.

    Args:
        policy: a policy, whose name is then ``"custom"``; the name of a preset of the library;
            ``"scanner"``, today's AMR with a safety laser scanner, for comparisons only, or
            ``"scanner_warning"``, the same with :class:`FieldsAdapter`; or a ``.yaml`` or ``.yml``
            file.

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
        if policy in {name for each in SCENARIO_SETS for name in shipped_scenarios(each)}:
            raise NavError(f"{policy!r} is a scenario, not a policy; give it with --scenario")
        known = sorted(names | set(own))
        raise NavError(not_one_of("policy", policy, known, or_else="a .yaml file"))
    return policy, AwarenessPolicy.preset(policy)


@cache
def _own_presets() -> dict[str, AwarenessPolicy]:
    """Return the simulator's own presets by name; they are frozen, so one reading serves all."""
    folder = resources.files("sim_tests.crossing") / "policies"
    found = {
        (name := file.name.removesuffix(".yaml")): AwarenessPolicy.model_validate(
            parse_yaml(file.read_text("utf-8"), name, NavError)
        )
        for file in folder.iterdir()
    }
    return {**found, SCANNER_WARNING: found["scanner"]}


def named_fault(fault: Fault | str | None) -> Fault | None:
    """Return a fault, the one of a name or a file, or None for ``"none"``, empty and None."""
    if isinstance(fault, str):
        return None if fault in ("", NO_FAULT) else Fault.of(fault)
    return fault


def axis_names(axes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the names in tables of the values of axes; a robot may be a model or a profile."""
    robot = axes.get("robot")
    named = dict(axes)
    if robot is not None and not isinstance(robot, str | Path):
        named["robot"] = RobotModel.of(robot).name
    return {name: table_name(value) for name, value in named.items()}
