"""The work of ``awarenav scenario list``, ``show`` and ``draw``."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from awarenav.files import json_text

from ...actors.behaviour import PersonSpec
from ...world.errors import SimError
from .._distributions import Choice, Distribution
from .._files import shipped_scenarios
from .._template import ScenarioTemplate, shipped_templates
from ._plans import CONFLICT_M, approach_statistics

_FORMATS: Final = (".png", ".svg", ".pdf")


def list_command(*, as_json: bool = False) -> int:
    """Print the shipped scenarios."""
    templates = shipped_templates()
    if as_json:
        print(json_text([_list_row(template) for template in templates]), end="")
        return 0
    width = max(len(template.id) for template in templates)
    print(f"{'scenario':{width}}  attention  people  varies")
    for template in templates:
        scenario = template.median()
        people = len(scenario.people) + len(scenario.workers)
        print(f"{template.id:{width}}  {template.attention:9}  {people:6}", end="")
        print(f"  {len(template.parameters()):6}")
        print(textwrap.indent(textwrap.fill(template.description, 88), "    "))
    return 0


def _list_row(template: ScenarioTemplate) -> dict[str, Any]:
    """Return a row of the list as plain data."""
    scenario = template.median()
    return {
        "name": template.name,
        "version": template.version,
        "attention": template.attention,
        "people": len(scenario.people) + len(scenario.workers),
        "varies": len(template.parameters()),
        "description": template.description,
    }


def show_command(name: str, *, yaml: bool, seed: int | None) -> int:
    """Print one scenario: in words, or as YAML."""
    template = ScenarioTemplate.named(name)
    if seed is not None and not yaml:
        raise SimError("--seed needs --yaml: the description covers all draws of a scenario")
    if yaml:
        text = template.to_text() if seed is None else template.for_seed(seed).to_text()
        print(text, end="")
        return 0
    print("\n".join(description_lines(template)))
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
        *(
            f"worker  scripted, from {script.path[0].t_s:g} to {script.path[-1].t_s:g} s"
            for script in scenario.workers
        ),
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


def draw_command(names: Sequence[str], out: str) -> int:
    """Draw scenarios into a file or a folder."""
    from ._drawing import save_drawing, scenario_figure  # noqa: PLC0415 - needs matplotlib

    chosen = [each for name in names for each in (shipped_scenarios() if name == "all" else [name])]
    templates = [ScenarioTemplate.named(name) for name in chosen]
    path = Path(out)
    is_file = path.suffix.lower() in _FORMATS
    if is_file and len(templates) > 1:
        raise SimError(
            f"--out must be a folder for {len(templates)} scenarios, got the file {path}"
        )
    if not is_file and path.suffix:
        raise SimError(f"--out must end in {', '.join(_FORMATS)} or be a folder, got {path}")
    if is_file and path.resolve() in {Path(name).resolve() for name in chosen}:
        raise SimError(f"--out {path} would overwrite a scenario")
    for template in templates:
        file = path if is_file else path / f"{template.name}.png"
        save_drawing(scenario_figure(template), file)
        print(file)
    return 0


def _person_text(spec: PersonSpec) -> str:
    first, last = spec.route[0], spec.route[-1]
    walks = (
        f"stands at ({first.x_m:.3g}, {first.y_m:.3g}) m"
        if len(spec.route) == 1
        else f"walks from ({first.x_m:.3g}, {first.y_m:.3g}) to ({last.x_m:.3g}, {last.y_m:.3g}) m "
        f"at {spec.speed_mps:.2f} m/s from {spec.start_s:.1f} s"
    )
    glances = spec.glances
    if glances.notices_within_m <= 0.0:
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
