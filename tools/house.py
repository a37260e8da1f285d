"""The picture of the house, drawn from the imports: ``python -m tools.house``.

Each package is a box with its public modules; a module imports those below it, in its own package
and in the packages below that one.
"""

from __future__ import annotations

import sys
from importlib import util
from itertools import groupby
from pathlib import Path
from typing import Final
from xml.sax.saxutils import escape

from grimp import ImportGraph, build_graph

PICTURE: Final = Path(__file__).parents[1] / "docs" / "images" / "house.svg"
PACKAGES: Final = ("sim_tests", "awarenav", "nav_adapter", "tracking", "perception")

_WIDTH: Final = 840
_ROW: Final = 30
_STYLE: Final = (
    "text { font: 14px sans-serif; fill: #1b1f27 } .name { font-weight: bold } "
    ".package { fill: #f4f5f8; stroke: #9aa1ae } .module { fill: #ffffff; stroke: #c3c8d2 }"
)


def storeys(graph: ImportGraph, package: str) -> list[list[str]]:
    """Return the public modules of a package, the ones that import others above those."""
    names = {each for each in graph.find_children(package) if "._" not in each}
    imported = {
        name: {
            other
            for module in {name, *graph.find_descendants(name)}
            for target in graph.find_modules_directly_imported_by(module)
            for other in names - {name}
            if target == other or target.startswith(f"{other}.")
        }
        for name in names
    }

    def height(name: str) -> int:
        return 1 + max(map(height, imported[name]), default=0)

    rows = groupby(sorted(names, key=lambda name: (-height(name), name)), height)
    return [[name.removeprefix(f"{package}.") for name in row] for _, row in rows]


def imports() -> ImportGraph:
    """Return who imports whom."""
    return build_graph(*PACKAGES, cache_dir=None)


def picture(graph: ImportGraph) -> str:
    """Return the picture as SVG."""
    parts: list[str] = []
    top = 10
    for package in PACKAGES:
        rows = storeys(graph, package)
        height = _ROW * (1 + len(rows)) + 8
        parts.append(_box("package", 10, top, _WIDTH - 20, height))
        parts.append(f'<text class="name" x="22" y="{top + 21}">{package}</text>')
        parts.append(f'<text x="130" y="{top + 21}">{escape(_subject(package))}</text>')
        for number, row in enumerate(rows, start=1):
            wide = (_WIDTH - 44 - 6 * (len(row) - 1)) / len(row)
            for place, name in enumerate(row):
                left, y = 22 + place * (wide + 6), top + number * _ROW
                parts.append(_box("module", left, y, wide, _ROW - 6))
                middle = f'x="{left + wide / 2:.0f}" y="{y + 17}" text-anchor="middle"'
                parts.append(f"<text {middle}>{name}</text>")
        top += height + 10
    size = f'width="{_WIDTH}" height="{top}" viewBox="0 0 {_WIDTH} {top}"'
    ground = f'<rect width="{_WIDTH}" height="{top}" fill="#ffffff"/>'
    lines = (f'<svg xmlns="http://www.w3.org/2000/svg" {size}>', f"<style>{_STYLE}</style>", ground)
    return "\n".join((*lines, *parts, "</svg>\n"))


def _box(kind: str, left: float, top: float, wide: float, high: float) -> str:
    place = f'x="{left:.0f}" y="{top:.0f}" width="{wide:.0f}" height="{high:.0f}"'
    return f'<rect class="{kind}" {place} rx="4"/>'


def _subject(package: str) -> str:
    """Return the first sentence of a package's page."""
    spec = util.find_spec(package)
    text = Path(str(spec and spec.origin)).read_text(encoding="utf-8")
    sentence = text.split('"""')[1].partition("\n")[0].rstrip(".")
    return sentence.rpartition(": ")[2]


def main() -> int:
    """Write the picture."""
    PICTURE.write_text(picture(imports()), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
