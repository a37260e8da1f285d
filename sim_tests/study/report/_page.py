"""Pages from templates, with one style sheet and one script; the only module that imports Jinja."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Any, Final

from awarenav.files import write_text
from perception.installation import install_command

from ...world.errors import SimError

try:
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise SimError(
        "a report needs jinja2, which is not installed; it is part of the extra 'bench': "
        + install_command("bench")
    ) from cause

_HOME: Final = "sim_tests.study.report"


def write_page(path: Path, template: str, *, package: str = _HOME, **parts: Any) -> None:
    """Write an HTML page without other files; it appears whole or not at all.

    A template has the variables ``style`` and ``script`` of the report, beside its parts, and may
    import the macros of ``parts.html``.

    Args:
        path: of the page.
        template: name of the template in the folder ``templates`` of its package.
        package: the package that holds it.
        parts: variables of the template; every text of them is escaped.

    Raises:
        SimError: the page cannot be written.
    """
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(each) for each in dict.fromkeys((package, _HOME))]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    folder = resources.files(_HOME) / "templates"
    assets = {
        name: Markup((folder / f"report.{ending}").read_text("utf-8"))
        for name, ending in (("style", "css"), ("script", "js"))
    }
    write_text(path, environment.get_template(template).render(**assets, **parts), SimError)
