"""References of docstrings (``:class:`~perception.Camera```) as links; types without metadata.

MkDocs loads this file by its path, as an extension of griffe, which reads the source code.
"""

from __future__ import annotations

import re
from typing import Any, Final

import griffe

_ROLE: Final = re.compile(r":(?:class|func|meth|mod|data|attr|exc|obj):`(~?)([\w.]+)`")
#: A paragraph that ends with ``::`` announces an indented block of code.
_LITERAL_BLOCK: Final = re.compile(r"::(?=\n\n? {4})")


def plain(text: str) -> str:
    """Return a docstring's text with its references as code, without links."""
    return _ROLE.sub(lambda role: f"`{_shown(role)}`", text)


def linked(text: str, home: str) -> str:
    """Return a docstring's text with its references as links where the site has the name.

    Args:
        text: the docstring.
        home: dotted path of the documented object's module, for names without a dot.
    """

    def link(role: re.Match[str]) -> str:
        target = role.group(2)
        path = target if "." in target else f"{home}.{target}"
        # "optional": a name without an entry stays code, and is no warning.
        return f'<autoref identifier="{path}" optional><code>{_shown(role)}</code></autoref>'

    return _LITERAL_BLOCK.sub(":", _ROLE.sub(link, text))


def _shown(role: re.Match[str]) -> str:
    """Return what is shown: the last part of the name after ``~``, else all of it."""
    return role.group(2).rpartition(".")[2] if role.group(1) else role.group(2)


def without_metadata(annotation: griffe.Expr | str | None) -> griffe.Expr | str | None:
    """Return ``X`` for ``Annotated[X, ...]``, whose rest is for the model's own reading."""
    if isinstance(annotation, griffe.ExprSubscript) and str(annotation.left) == "Annotated":
        inner = annotation.slice
        return inner.elements[0] if isinstance(inner, griffe.ExprTuple) else inner
    return annotation


class LinkedRoles(griffe.Extension):
    """Rewrites the references in every docstring that is read, and the types of attributes."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite the docstring of an object within a package, and its type."""
        _rewrite(obj)
        if isinstance(obj, griffe.Attribute):
            obj.annotation = without_metadata(obj.annotation)

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        """Rewrite the docstring of a package, which is no object within another."""
        _rewrite(pkg)


def _rewrite(documented: griffe.Object) -> None:
    if documented.docstring is not None:
        home = _page_of(documented.module.path)
        documented.docstring.value = linked(documented.docstring.value, home)


def _page_of(module: str) -> str:
    """Return the package whose page names a private module's objects."""
    parts = module.split(".")
    while len(parts) > 1 and parts[-1].startswith("_"):
        parts.pop()
    return ".".join(parts)
