"""Reference of YAML files: a table of keys for every pydantic model, made from the model."""

from __future__ import annotations

import ast
import inspect
import json
import re
import textwrap
import types
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

import griffe
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from .roles import plain

#: Suffix of a key, and the unit that it stands for.
_UNITS: Final = {
    "m": "m",
    "m2": "m²",
    "mps": "m/s",
    "mps2": "m/s²",
    "mps3": "m/s³",
    "rad": "rad",
    "radps": "rad/s",
    "deg": "°",
    "s": "s",
    "hz": "Hz",
    "px": "px",
    "m2ps3": "m²/s³",
}
_WORDS: Final = {float: "number", int: "whole number", bool: "true or false", str: "text"}


@dataclass(frozen=True)
class ConfigPage:
    """A page of keys.

    Attributes:
        title: heading of the page.
        intro: Markdown before the first table.
        model: the model of the whole file.
        alternatives: for a protocol that a key names, the models that a file can give.
        closing: Markdown after the last table.
    """

    title: str
    intro: str
    model: type[BaseModel]
    alternatives: dict[type, tuple[type[BaseModel], ...]] = field(default_factory=dict)
    closing: str = ""

    def markdown(self) -> str:
        """Return the page."""
        parts = [f"# {self.title}", self.intro]
        for path, model in self.models():
            heading = f"{path}: {model.__name__}" if path else "The file"
            parts += [f"## {heading} {{ #{_anchor(model)} }}", *self._section(model)]
        return "\n\n".join([*parts, self.closing]).rstrip() + "\n"

    def models(self) -> Iterator[tuple[str, type[BaseModel]]]:
        """Yield every model once, with the path of the first key that holds it."""
        seen: set[type[BaseModel]] = set()
        waiting: list[tuple[str, type[BaseModel]]] = [("", self.model)]
        while waiting:
            path, model = waiting.pop(0)
            if model in seen:
                continue
            seen.add(model)
            yield path, model
            inside = [
                (f"{path}.{name}" if path else name, found)
                for name, info in model.model_fields.items()
                for found in self._held(info.annotation)
            ]
            waiting = inside + waiting

    def _held(self, annotation: Any) -> tuple[type[BaseModel], ...]:
        """Return the models in an annotation."""
        if isinstance(annotation, type):
            if annotation in self.alternatives:
                return self.alternatives[annotation]
            if issubclass(annotation, BaseModel):
                return (annotation,)
        return tuple(model for part in get_args(annotation) for model in self._held(part))

    def _section(self, model: type[BaseModel]) -> list[str]:
        docstring = griffe.Docstring(model.__doc__ or "", lineno=1)
        sections = docstring.parse("google", warnings=False)
        text = [part.value for part in sections if part.kind is griffe.DocstringSectionKind.text]
        meanings = attribute_meanings(model)
        rows = ["| key | value | default | meaning |", "| --- | --- | --- | --- |"]
        rows += [
            f"| `{name}` | {self._value(name, info)} | {_default(info)} | {meanings[name]} |"
            for name, info in model.model_fields.items()
        ]
        return [plain(text[0] if text else ""), "\n".join(rows)]

    def _value(self, name: str, info: FieldInfo) -> str:
        """Return the kind of value, its limits and its unit."""
        unit = unit_of(name)
        value = self._words(info.annotation) + _range(info.metadata)
        return _cell(f"{value}; {unit}" if unit else value)

    def _words(self, annotation: Any) -> str:
        """Return an annotation in words."""
        if annotation is type(None):
            return "null"
        if get_origin(annotation) is not None:
            return self._composed(get_origin(annotation), get_args(annotation))
        if models := self._held(annotation):
            return " or ".join(f"[{each.__name__}](#{_anchor(each)})" for each in models)
        return _WORDS.get(annotation, getattr(annotation, "__name__", str(annotation)))

    def _composed(self, origin: Any, arguments: tuple[Any, ...]) -> str:
        """Return an annotation of several parts in words."""
        if origin is Literal:
            return " or ".join(f"`{each}`" for each in arguments)
        if origin is Annotated:
            return self._words(arguments[0]) + _range(arguments[1:])
        words = [self._words(each) for each in arguments if each is not Ellipsis]
        if origin in (Union, types.UnionType):
            return " or ".join(words)
        if origin is tuple and Ellipsis not in arguments:
            return f"[{', '.join(words)}]"
        if origin is not dict:
            return f"list of {words[0]}"
        return f"mapping of {words[0]} to {words[1]}"


def attribute_meanings(model: type[BaseModel]) -> dict[str, str]:
    """Return what each key means, from the docstrings of the model, its fields and its bases."""
    found: dict[str, str] = {}
    for each in reversed(model.__mro__):
        if not issubclass(each, BaseModel) or each is BaseModel or not each.__doc__:
            continue
        for part in griffe.Docstring(each.__doc__, lineno=1).parse("google", warnings=False):
            if part.kind is griffe.DocstringSectionKind.attributes:
                found |= {one.name: one.description for one in part.value}
        found |= _field_docstrings(each)
    # A file says null where Python says None.
    return {name: _cell(re.sub(r"\bNone\b", "null", plain(text))) for name, text in found.items()}


def _field_docstrings(model: type[BaseModel]) -> dict[str, str]:
    """Return the docstrings that stand below the fields of a model."""
    (definition,) = ast.parse(textwrap.dedent(inspect.getsource(model))).body
    body = definition.body if isinstance(definition, ast.ClassDef) else []
    return {
        field_.target.id: below.value.value
        for field_, below in pairwise(body)
        if isinstance(field_, ast.AnnAssign)
        and isinstance(field_.target, ast.Name)
        and isinstance(below, ast.Expr)
        and isinstance(below.value, ast.Constant)
        and isinstance(below.value.value, str)
    }


def unit_of(name: str) -> str:
    """Return the unit that the suffix of a name stands for; empty for none."""
    _, underscore, suffix = name.rpartition("_")
    return _UNITS.get(suffix, "") if underscore else ""


def _anchor(model: type[BaseModel]) -> str:
    return model.__name__.lower()


def _range(metadata: Any) -> str:
    """Return the limits among a field's metadata, as an interval or as a length."""
    limits = {
        name: getattr(each, name)
        for each in metadata
        for name in ("ge", "gt", "le", "lt", "min_length", "max_length")
        if getattr(each, name, None) is not None
    }
    text = ""
    low, high = limits.get("ge", limits.get("gt")), limits.get("le", limits.get("lt"))
    if low is not None and high is not None:
        text = f" in {'[' if 'ge' in limits else '('}{low:g}, {high:g}"
        text += "]" if "le" in limits else ")"
    elif low is not None:
        text = f" {'≥' if 'ge' in limits else '>'} {low:g}"
    elif high is not None:
        text = f" {'≤' if 'le' in limits else '<'} {high:g}"
    if limits.get("min_length"):
        text += f", at least {limits['min_length']} long"
    if limits.get("max_length"):
        text += f", at most {limits['max_length']} long"
    return text


def _default(info: FieldInfo) -> str:
    """Return the default as it would stand in a file."""
    if info.is_required():
        return "required"
    value = info.get_default(call_default_factory=True)
    if isinstance(value, BaseModel):
        changed = value.model_dump(mode="json", exclude_defaults=True)
        if any(each.is_required() for each in type(value).model_fields.values()):
            return _code(changed)
        return f"its defaults, but {_code(changed)}" if changed else "its defaults"
    if isinstance(value, tuple) and any(isinstance(each, BaseModel) for each in value):
        return _code([each.model_dump(mode="json", exclude_defaults=True) for each in value])
    if value in ((), ""):
        return "none"
    return _code(list(value) if isinstance(value, tuple) else value)


def _code(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False, default=str).replace('"', "")
    return _cell(f"`{text}`") if len(text) <= 60 else "a shipped value"


def _cell(text: str) -> str:
    """Return text for one cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")
