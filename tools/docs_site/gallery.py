"""The gallery: a generated page with every shipped scenario and every example.

The texts come from the scenarios' files and the examples' docstrings.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Final

from sim_tests.scenario import SCENARIO_SETS, Scenario, shipped_scenarios
from sim_tests.scenario._files import shipped_text

from .example_pictures import PLANNERS, ROOT, example_names

PAGE: Final = "gallery.md"
_HEAD: Final = """# Gallery

Every scenario that comes with the package, as a film from above, and every example with what it
passes to its planner.

The robot (blue) has a camera ahead and two laser scanners. It drives with the policy `balanced` and
seed 0; the films run at twice the real speed. A circle is the obstacle that the adapter makes of a
person: red for an unaware person, green for an aware one. A sector is the person's true gaze, in
the colour of the true α. The line below each film gives the robot's speed and limit, and the lower
bound of α and the radius of the nearest person.

`awarenav crossings --scenario NAME --policy balanced --sensors camera+scanner` runs a scenario;
`awarenav watch NAME --sensors camera+scanner` shows it in the browser while it runs;
`awarenav scenario show NAME` prints its file. With reduced motion set in your browser,
you see plans instead of films."""
_SETS: Final = {
    "all": "## Scenarios",
    "guidelines": """## The guidelines' situations

A set of their own, `--scenario guidelines`.""",
    "step_out": """## People who step out

A set of their own too, `--scenario step_out`.""",
    "at_work": """## People at work

The commonest meeting in a warehouse, `--scenario at_work`.""",
}
_OPEN, _CLOSE = '<div class="gallery" markdown>', "</div>"
_FILM: Final = """<picture>
<source media="(prefers-reduced-motion: reduce)" srcset="images/scenarios/{name}.png">
<img src="images/films/{name}.webp" alt="Film of {name} from above" loading="lazy">
</picture>"""
_ENTRY: Final = """<div markdown>

{}

</div>"""
_YAML: Final = """<details markdown>
<summary>{name}.yaml</summary>

```yaml
{text}
```

</details>"""
_EXAMPLES: Final = """## Examples

On the left the way of the robot, with the obstacles at seven instants. On the right its speed, the
speed limit and the largest radius over time. [Planners](planners.md) explains the forms."""


def gallery_page() -> str:
    """Return the Markdown of the gallery."""
    parts = [_HEAD]
    for scenario_set in SCENARIO_SETS:
        parts += [_SETS[scenario_set], _OPEN]
        parts += [_scenario(name) for name in shipped_scenarios(scenario_set)]
        parts.append(_CLOSE)
    parts += [_EXAMPLES, _OPEN, *(_example(name) for name in example_names()), _CLOSE]
    return "\n\n".join(parts) + "\n"


def _scenario(name: str) -> str:
    """Return the entry of a scenario: its description, film and file."""
    scenario = Scenario.shipped(name)
    about = f"### {name}\n\n{scenario.description} ({scenario.attention})"
    _, text = shipped_text(name)
    return _ENTRY.format(
        "\n\n".join([about, _FILM.format(name=name), _YAML.format(name=name, text=text.rstrip())])
    )


def _example(name: str) -> str:
    """Return the entry of an example: its first sentence and its picture."""
    path = f"examples/{'planners/' if name in PLANNERS else ''}{name}.py"
    return _ENTRY.format(
        f"### {name}\n\n{_first_sentence(ROOT / path)}\n[`{path}`](../{path})\n\n"
        f"![What the example {name} gives its planner](images/examples/{name}.png)"
    )


def _first_sentence(path: Path) -> str:
    """Return the first sentence of a module's docstring, as Markdown."""
    about = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    first = " ".join(about.partition("\n\n")[0].split())
    return re.sub(r"``([^`]+)``", r"`\1`", first)
