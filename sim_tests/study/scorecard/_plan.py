"""The plan of a comparison: its planners, its policies, and the episodes that each question needs.

Beside every planner with every policy there are two probes. Wider radii, with everything else the
same, tell whether a planner uses radii. A planner that accepts ``use_speed_field`` also runs with
the other value of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

from nav_adapter import AwarenessPolicy
from perception.documents import read_json

from ...crossing.eyes import ORACLE
from ...scenario import Scenario, ScenarioTemplate
from ...world.errors import SimError
from ..measures import BASELINE
from ..runs import (
    Job,
    RunFiles,
    named_templates,
    plan_jobs,
    planner_label,
    planner_parameters,
    policy_of,
)

#: The command line's name of the reference planner, whose name in jobs is empty.
REFERENCE: Final = "reference"
#: Radii of the probe, as a multiple of the policy's.
RADII_FACTOR: Final = 2.0
#: The probe of radii runs the first seeds only, at most so many.
PROBED_SEEDS: Final = 5
# The argument by which a planner says that it can use the speed field.
_USES_FIELD: Final = "use_speed_field"
# Key of the plan in run.json.
_KEY: Final = "scorecard"
_LARGEST_RADIUS_M: Final = 10.0


@dataclass(frozen=True, slots=True)
class Entrant:
    """One planner of the comparison, or its variant with or without the speed field.

    Attributes:
        name: name on the page.
        planner: name as it was given; with the arguments of a variant.
        label: name in ``episodes.csv``.
        speed_field: whether it uses the speed field; None for a planner that cannot.
        variant_of: name of the planner that it is a variant of; empty for none.
    """

    name: str
    planner: str
    label: str
    speed_field: bool | None = None
    variant_of: str = ""

    @property
    def job_planner(self) -> str:
        """The planner as jobs name it."""
        return "" if self.planner == REFERENCE else self.planner


@dataclass(frozen=True, slots=True)
class ComparisonPlan:
    """The questions of a comparison, as plain data.

    Attributes:
        entrants: the planners, the reference planner first, each followed by its variant.
        policies: names of the policies, ``blind`` first.
        probed_policy: name of the policy that verdicts speak of; its radii are scaled.
        wide_policy: name of that policy with wider radii.
    """

    entrants: tuple[Entrant, ...]
    policies: tuple[str, ...]
    probed_policy: str
    wide_policy: str

    def about(self) -> dict[str, Any]:
        """Return the entry for ``run.json``."""
        return {_KEY: asdict(self)}

    @classmethod
    def read(cls, folder: Path) -> ComparisonPlan:
        """Return the plan of the comparison in a folder.

        Raises:
            SimError: the folder holds none.
        """
        path = RunFiles(folder).run
        try:
            content = read_json(path, SimError)[_KEY]
            return cls(
                tuple(Entrant(**each) for each in content["entrants"]),
                tuple(map(str, content["policies"])),
                str(content["probed_policy"]),
                str(content["wide_policy"]),
            )
        except (KeyError, TypeError, AttributeError) as cause:
            raise SimError(
                f"{folder} holds no comparison of planners: {path.name} has no usable entry "
                f"{_KEY!r}"
            ) from cause


def plan_comparison(
    planners: Sequence[str],
    scenarios: Sequence[str | ScenarioTemplate],
    policies: Sequence[str | tuple[str, AwarenessPolicy]],
    seeds: Sequence[int],
    *,
    perception: str,
    sensors: str = "camera",
    camera: str = "",
    robot: str = "",
    population: str = "",
) -> tuple[ComparisonPlan, tuple[Job, ...]]:
    """Return the plan of a comparison and its episodes.

    The reference planner and the policy ``blind`` are added where they are missing, because times
    are compared with theirs.

    Args:
        planners: ``"module:NAME"``, or names of known planners.
        scenarios: templates, shipped names, YAML files, or ``"all"``.
        policies: as for :func:`sim_tests.study.runs.plan_jobs`.
        seeds: seeds of the episodes.
        perception: as for :func:`sim_tests.study.runs.plan_jobs`.
        sensors: likewise.
        camera: likewise.
        robot: likewise.
        population: likewise.

    Raises:
        SimError: an unknown or unusable argument, or a scenario that needs no planner.
        NavError: an unknown preset or unusable policy file.
    """
    if not seeds:
        raise SimError("seeds must be at least one, got none")
    templates = _driven(scenarios, camera, population, robot)
    entrants = _entrants(planners, templates[0].median())
    own = [each for each in entrants if not each.variant_of]
    conditions: dict[str, Any] = {"perception": perception, "sensors": (sensors,)}
    given = list(dict.fromkeys(policies)) if all(isinstance(p, str) for p in policies) else policies
    wanted = [BASELINE, *(each for each in given if each != BASELINE)]
    main = plan_jobs(
        templates, wanted, seeds, planners=[each.job_planner for each in own], **conditions
    )
    policy_texts = {job.policy_name: job.policy for job in main}
    names = tuple(policy_texts)
    adaptive = [each for each in names if each not in (BASELINE, ORACLE)]
    probed = adaptive[0] if adaptive else BASELINE
    wide = f"{probed}, radii × {RADII_FACTOR:g}"
    probes = plan_jobs(
        templates,
        [(wide, _with_wider_radii(policy_of(policy_texts[probed])))],
        seeds[:PROBED_SEEDS],
        planners=[each.job_planner for each in own],
        **conditions,
    )
    variants = [each.job_planner for each in entrants if each.variant_of]
    others = [each for each in wanted if each != BASELINE] or wanted
    fields = plan_jobs(templates, others, seeds, planners=variants, **conditions)
    plan = ComparisonPlan(entrants, names, probed, wide)
    return plan, (*main, *fields, *probes)


def _driven(
    scenarios: Sequence[str | ScenarioTemplate], camera: str, population: str, robot: str
) -> tuple[ScenarioTemplate, ...]:
    """Return the scenarios, each of which must need a planner."""
    found: list[ScenarioTemplate] = []
    for each in scenarios:
        if isinstance(each, ScenarioTemplate):
            changed = each.with_camera(camera).with_population(population)
            found.append(changed.with_robot(robot))
        else:
            found += named_templates([each], camera, population, robot)
    if not found:
        raise SimError("scenarios must be at least one, got none")
    for template in found:
        if template.median().robot.straight_on_speed_mps is not None:
            raise SimError(
                f"scenario {template.name!r} drives straight on without a planner, so it cannot "
                "compare planners"
            )
    return tuple(found)


def _entrants(planners: Sequence[str], scenario: Scenario) -> tuple[Entrant, ...]:
    """Return the planners in the given order, the reference planner first."""
    wanted = list(dict.fromkeys([REFERENCE, *(each or REFERENCE for each in planners)]))
    found: list[Entrant] = []
    for planner in wanted:
        text = "" if planner == REFERENCE else planner
        choice = planner_parameters(text).get(_USES_FIELD)
        label = planner_label(text, scenario)
        own = Entrant(REFERENCE if not text else label, planner, label)
        if choice is None or not text:
            found.append(own)
            continue
        given = f"{_USES_FIELD}=" in text
        uses = f"{_USES_FIELD}=False" not in text if given else choice.default is not False
        found.append(replace(own, speed_field=uses))
        other = _with_setting(planner, not uses)
        if not given and other not in wanted:
            name = f"{own.name}, {'without' if uses else 'with'} the speed field"
            label = planner_label(other, scenario)
            found.append(Entrant(name, other, label, not uses, own.name))
    return tuple(found)


def _with_setting(planner: str, use_speed_field: bool) -> str:
    """Return a planner with the argument ``use_speed_field``."""
    begun = planner[:-1] + ", " if planner.endswith(")") else planner + "("
    return f"{begun}{_USES_FIELD}={use_speed_field})"


def _with_wider_radii(policy: AwarenessPolicy) -> AwarenessPolicy:
    """Return a policy whose radii are larger, and which is otherwise the same."""
    data = policy.model_dump(mode="json")
    data["inflation"] = _scaled(data["inflation"])
    data["margins"] = _scaled(data["margins"])
    return AwarenessPolicy.model_validate(data)


def _scaled(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with every radius multiplied by :data:`RADII_FACTOR`."""

    def wider(radius_m: float) -> float:
        return min(RADII_FACTOR * radius_m, _LARGEST_RADIUS_M)

    scaled = dict(settings)
    for name, value in settings.items():
        if name.endswith("radius_m") and value is not None:
            scaled[name] = wider(value)
        elif name == "table_m":
            scaled[name] = [[alpha, wider(radius_m)] for alpha, radius_m in value]
    return scaled
