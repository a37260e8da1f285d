"""Reference of the Python interface: one page for each package that users import from."""

from __future__ import annotations

from importlib import import_module
from typing import Final

#: Packages with a page of their own.
PACKAGES: Final = (
    "perception",
    "perception.laser",
    "perception.surround",
    "perception.networks",
    "tracking",
    "nav_adapter",
    "nav_adapter.alerts",
    "nav_adapter.policies",
    "nav_adapter.exporters",
    "nav_adapter.ros2",
    "sim_tests",
)
_DIRECTIVE: Final = """# {package}

::: {package}
    options:
      members: [{names}]
"""
_FRONT_DOOR: Final = """# awarenav

{about}

| name | documented on |
| --- | --- |
{rows}
"""


def package_page(package: str) -> str:
    """Return the page of a package, with every name of its ``__all__``."""
    names = import_module(package).__all__
    return _DIRECTIVE.format(package=package, names=", ".join(names))


def front_door_page() -> str:
    """Return the page of ``awarenav``, whose names are those of other packages."""
    front = import_module("awarenav")
    homes = {
        name: package for package in reversed(PACKAGES) for name in import_module(package).__all__
    }
    rows = []
    for name in front.__all__:
        home = homes.get(name)
        where = f"[{home}]({home}.md#{home}.{name})" if home else "the base of every error"
        rows.append(f"| `awarenav.{name}` | {where} |")
    about = (front.__doc__ or "").partition("\n\n")[0]
    about += "\n\nThe main names of three packages, imported when they are first used."
    return _FRONT_DOOR.format(about=about, rows="\n".join(rows))
