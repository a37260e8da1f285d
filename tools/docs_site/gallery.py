"""The gallery: a page with every shipped scenario and every example.

    python -m tools.docs_site.gallery        # writes docs/gallery.md

The texts come from the scenarios' files and the examples' docstrings.
"""

from __future__ import annotations

import ast
import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from sim_tests.scenario import ScenarioTemplate, shipped_scenarios

from .example_pictures import PLANNERS, ROOT, example_names

PAGE: Final = ROOT / "docs" / "gallery.md"
_COLUMNS: Final = 100
_HEAD: Final = """# Gallery

Every scenario that comes with the package, as a film from above, and every example with what it
passes to its planner.

## Scenarios

The robot (blue) has a camera ahead and two laser scanners. It drives with the policy `balanced` and
seed 0; the films run at twice the real speed. A circle is the obstacle that the adapter makes of a
person: red for an unaware person, green for an aware one. A sector is the person's true gaze, in
the colour of the true α. The line below each film gives the robot's speed and limit, and the lower
bound of α and the radius of the nearest person.

`awarenav crossings --scenario NAME --policy balanced --perception keypoints+scanner` runs a
scenario; [Scenarios](scenarios.md) says what varies in each. With reduced motion set in your
browser, you see plans instead of films.

<div class="gallery" markdown>"""
_GUIDELINES: Final = """## The guidelines' situations

These scenarios are a set of their own, `--scenario guidelines`.
[Scenarios](scenarios.md#the-guidelines-situations) says where they come from.

<div class="gallery" markdown>"""
_STEP_OUT: Final = """## People who step out

These scenarios are a set of their own too, `--scenario step_out`.
[Scenarios](scenarios.md#people-who-step-out) says when the people set off.

<div class="gallery" markdown>"""
_FILM: Final = """<picture>
<source media="(prefers-reduced-motion: reduce)" srcset="images/scenarios/{name}.png">
<img src="images/films/{name}.webp" alt="Film of {name} from above" loading="lazy">
</picture>"""
_ENTRY: Final = """<div markdown>

{}

</div>"""
_EXAMPLES: Final = """## Examples

On the left the way of the robot, with the obstacles at seven instants. On the right its speed, the
speed limit and the largest radius over time. [Planners](planners.md) explains the forms.

<div class="gallery" markdown>"""


def gallery_page() -> str:
    """Return the Markdown of the gallery."""
    parts = [_HEAD, *_films("all"), "</div>\n", _GUIDELINES, *_films("guidelines")]
    parts += ["</div>\n", _STEP_OUT, *_films("step_out"), "</div>\n", _EXAMPLES]
    for name in example_names():
        folder = "examples/planners" if name in PLANNERS else "examples"
        path = f"{folder}/{name}.py"
        entry = (
            f"### {name}\n\n{_wrapped(_first_sentence(ROOT / path))}\n"
            f"[`{path}`](../{path})\n\n"
            f"![What the example {name} gives its planner](images/examples/{name}.png)"
        )
        parts.append(_ENTRY.format(entry))
    return "\n".join([*parts, "</div>\n"])


def _films(scenario_set: str) -> Iterator[str]:
    """Yield an entry for every scenario of a set."""
    for name in shipped_scenarios(scenario_set):
        template = ScenarioTemplate.shipped(name)
        about = f"{template.median().description} ({template.attention})"
        yield _ENTRY.format(f"### {name}\n\n{_wrapped(about)}\n\n{_FILM.format(name=name)}")


def _first_sentence(path: Path) -> str:
    """Return the first sentence of a module's docstring, as Markdown."""
    about = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    first = " ".join(about.partition("\n\n")[0].split())
    return re.sub(r"``([^`]+)``", r"`\1`", first)


def _wrapped(text: str) -> str:
    return textwrap.fill(text, _COLUMNS, break_long_words=False, break_on_hyphens=False)


def main() -> int:
    """Write the page."""
    PAGE.write_text(gallery_page(), encoding="utf-8")
    print(f"written: {PAGE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
