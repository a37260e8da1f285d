"""The one place that imports Jinja: the page out of its parts."""

from __future__ import annotations

from importlib import resources
from typing import Any

from .._errors import SimError

try:
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise SimError(
        "a report needs jinja2, which is not installed; it is part of the extra 'bench': "
        "pip install 'awarenav[bench]'"
    ) from cause


def render_page(**parts: Any) -> str:
    """The HTML of a page; every text of its parts is escaped.

    Args:
        parts: what ``templates/report.html`` asks for.
    """
    environment = Environment(
        loader=PackageLoader("sim_tests.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    folder = resources.files("sim_tests.report") / "templates"
    own = {
        name: Markup((folder / f"report.{ending}").read_text("utf-8"))
        for name, ending in (("style", "css"), ("script", "js"))
    }
    page: str = environment.get_template("report.html").render(**own, **parts)
    return page
