"""The work of ``awarenav scenario list`` and ``show``."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from awarenav.files import json_text

from ...actors.behaviour import PersonSpec
from ...world.errors import SimError
from .._distributions import Choice, Distribution
from .._files import SCENARIO_SETS, shipped_scenarios
from .._template import ScenarioTemplate, shipped_templates
from ._plans import CONFLICT_M, approach_statistics

_FORMATS: Final = (".png", ".svg", ".pdf")


def list_command(*, as_json: bool = False) -> int:
    """Print the shipped scenarios, set by set."""
    sets = {name: shipped_templates(name) for name in SCENARIO_SETS}
    if as_json:
        rows = [_list_row(each, name) for name, templates in sets.items() for each in templates]
        print(json_text(rows), end="")
        return 0
    width = max(len(template.id) for templates in sets.values() for template in templates)
    for name, templates in sets.items():
        print(f"{'' if name == SCENARIO_SETS[0] else chr(10)}--scenario {name}")
        print(f"{'scenario':{width}}  attention  people  varies")
        for template in templates:
            scenario = template.median()
            people = len(scenario.people)
            print(f"{template.id:{width}}  {template.attention:9}  {people:6}", end="")
            print(f"  {len(template.parameters()):6}")
            print(textwrap.indent(textwrap.fill(template.description, 88), "    "))
    return 0


def _list_row(template: ScenarioTemplate, scenario_set: str) -> dict[str, Any]:
    """Return a row of the list as plain data."""
    scenario = template.median()
    return {
        "set": scenario_set,
        "name": template.name,
        "version": template.version,
        "attention": template.attention,
        "people": len(scenario.people),
        "varies": len(template.parameters()),
        "description": template.description,
    }


def show_command(name: str, *, yaml: bool, seed: int | None, out: Path | None) -> int:
    """Print one scenario, in words or as YAML, and draw it."""
    template = ScenarioTemplate.named(name)
    if seed is not None and not yaml:
        raise SimError("--seed needs --yaml: the description covers all draws of a scenario")
    if yaml:
        text = template.to_text() if seed is None else template.for_seed(seed).to_text()
        print(text, end="")
        return 0
    print("\n".join(description_lines(template)))
    if out is not None:
        if out.suffix.lower() not in _FORMATS:
            raise SimError(f"--out must end in {', '.join(_FORMATS)}, got {out}")
        from awarenav.figures import save_figure  # noqa: PLC0415 - needs matplotlib

        from ._drawing import scenario_figure  # noqa: PLC0415

        save_figure(scenario_figure(template), out)
        print(f"\nWritten: {out}")
    return 0


def description_lines(template: ScenarioTemplate) -> list[str]:
    """Return the description: the task, the people, what varies, and the closest approach."""
    scenario = template.median()
    task = scenario.robot
    lines = [
        f"{template.id} ({template.attention})",
        template.description,
        "",
        f"robot   from ({task.start_x_m:g}, {task.start_y_m:g}) m to ({task.goal_x_m:g}, "
        f"{task.goal_y_m:g}) m within {scenario.duration_s:g} s",
        *(f"person  {_person_text(person)}" for person in scenario.people),
    ]
    if scenario.replay_csv is not None:
        lines.append(f"replay  {scenario.replay_csv}")
    if template.parameters():
        lines += ["", "varies"]
        width = max(map(len, template.parameters()))
        lines += [
            f"  {path:{width}}  {distribution_text(distribution)}"
            for path, distribution in template.parameters().items()
        ]
    statistics = approach_statistics(template)
    if statistics is not None:
        draws = "the scenario" if statistics.draws == 1 else f"{statistics.draws} draws"
        lines += [
            "",
            f"if nobody reacted: centres nearer than {CONFLICT_M:g} m in "
            f"{statistics.conflict_share:.0%} of {draws}, {statistics.median_distance_m:.2f} m at "
            f"{statistics.median_time_s:.1f} s in the median",
        ]
    return lines


def distribution_text(distribution: Distribution) -> str:
    """Return a short description of a distribution."""
    low, high = distribution.bounds
    if isinstance(distribution, Choice):
        return f"one of {', '.join(f'{value:g}' for value in distribution.values)}"
    kind = type(distribution).__name__.lower()
    return f"{low:g} to {high:g}, median {distribution.median:.3g} ({kind})"


def names_of_sets(names: Sequence[str]) -> list[str]:
    """Return names and files with the names of a set's scenarios in place of the set's."""
    return [
        each
        for name in names
        for each in (shipped_scenarios(name) if name in SCENARIO_SETS else [name])
    ]


def _start_text(spec: PersonSpec) -> str:
    if spec.sets_off_within_m is None:
        return f"{spec.start_s:.1f} s"
    return f"when the robot is {spec.sets_off_within_m:.1f} m from that line"


def _person_text(spec: PersonSpec) -> str:
    first, last = spec.route[0], spec.route[-1]
    walks = (
        f"stands at ({first.x_m:.3g}, {first.y_m:.3g}) m"
        if len(spec.route) == 1
        else f"walks from ({first.x_m:.3g}, {first.y_m:.3g}) to ({last.x_m:.3g}, {last.y_m:.3g}) m "
        f"at {spec.speed_mps:.2f} m/s from {_start_text(spec)}"
    )
    glances = spec.glances
    if spec.gaze:
        looks = "looks as planned"
    elif glances.notices_within_m <= 0.0:
        looks = "never looks at the robot"
    else:
        looks = "watches" if glances.watches else "glances at"
        looks += f" the robot within {glances.notices_within_m:g} m"
    extras = [
        text
        for text, holds in (
            ("backwards", spec.backwards),
            ("pauses", bool(spec.pauses)),
            ("turns back", spec.turns_back_at_m is not None),
            (spec.activity.replace("_", " "), spec.activity != "none"),
        )
        if holds
    ]
    return ", ".join([f"{spec.name}: {walks}", *extras, looks])
