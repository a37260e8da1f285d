"""YAML and JSON from files, with unique keys, and limits on size, nesting and aliases.

All packages read their files through these functions, and pass the error class of their own
package. A hostile or damaged file is refused before it costs much time, memory or stack: PyYAML in
C overflows the stack on 100 000 nested brackets, and 236 bytes of nested aliases stand for 10⁹
values.

A key that a mapping has twice is refused: parsers take the last without a word.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import yaml

from .errors import PerceptionError, nearest_file

try:  # the safe loader in C, ten times as fast, where PyYAML was built with it
    from yaml import CSafeLoader as _SafeLoader
except ImportError:  # pragma: no cover - depends on how PyYAML was built
    from yaml import SafeLoader as _SafeLoader  # type: ignore[assignment]

#: Largest YAML document.
MAX_YAML_BYTES: Final = 1 << 20
#: Most values of a YAML document, with every alias (``*name``) replaced by what it stands for.
MAX_YAML_VALUES: Final = 200_000
#: Largest JSON document.
MAX_JSON_BYTES: Final = 64 << 20
#: Longest line of a JSON Lines file.
MAX_LINE_BYTES: Final = 16 << 20
#: Most lists and mappings within each other in YAML.
MAX_DEPTH: Final = 64
_DEPTH: Final = f"more than {MAX_DEPTH} lists and mappings in each other"

# Numbers such as 5e-2 and 1E5, which ROS reads as numbers and YAML 1.1 as texts.
_FLOAT: Final = "tag:yaml.org,2002:float"
_EXPONENT: Final = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+$")
_STARTS: Final = list("-+.0123456789")
_MERGE: Final = "tag:yaml.org,2002:merge"
_NAMES: Final = (_MERGE, "tag:yaml.org,2002:value")  # << and =, which PyYAML cannot construct
# PyYAML needs quadratic time for numbers to the base 60, such as 1:00:00.
_LONG_NUMBER: Final = re.compile(r"[-+0-9_:.]{65,}")
# Styles of scalars that are texts, whatever they look like.
_QUOTES: Final = ("'", '"', "|", ">")
# What PyYAML raises for scalars that are not of their type, such as !!bool 3 or 2001-99-99.
_WRONG_SCALARS: Final = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError)


class _RepeatedKeyError(Exception):
    """A mapping has a key twice, of which a parser would take the last."""


class _Loader(_SafeLoader):
    """The safe loader, with keys that are unique in their mapping, and numbers like 5e-2."""

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._unique: set[yaml.MappingNode] = set()

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """Check the keys that a mapping itself has, then add those that it merges (``<<``)."""
        if node not in self._unique:  # a second time it has the merged keys as well
            self._unique.add(node)
            lines: dict[Any, int] = {}
            for key_node, _ in node.value:
                if not isinstance(key_node, yaml.ScalarNode):
                    continue
                named = key_node.tag in _NAMES
                key = key_node.value if named else self.construct_object(key_node)
                line = key_node.start_mark.line + 1
                if key in lines:
                    raise _RepeatedKeyError(
                        f"the key {key!r} twice, in lines {lines[key]} and {line}"
                    )
                lines[key] = line
        super().flatten_mapping(node)


class _Dumper(yaml.SafeDumper):
    """The safe dumper, which quotes the texts that :class:`_Loader` would take for numbers."""


_Loader.add_implicit_resolver(_FLOAT, _EXPONENT, _STARTS)
_Dumper.add_implicit_resolver(_FLOAT, _EXPONENT, _STARTS)


def read_yaml(
    path: Path, error: type[ValueError] = PerceptionError, *, first_document: bool = False
) -> Any:
    """Return the value in a YAML file.

    Args:
        path: of the file.
        error: class of the errors.
        first_document: leave out further documents, which are an error otherwise.

    Raises:
        PerceptionError: or ``error``, naming the file: it cannot be read, is not valid YAML, has a
            key twice in one mapping, or is beyond a limit of this module.
    """
    text = _read_text(path, MAX_YAML_BYTES, "YAML", error)
    return parse_yaml(text, str(path), error, first_document=first_document)


def parse_yaml(
    text: str,
    source: str,
    error: type[ValueError] = PerceptionError,
    *,
    first_document: bool = False,
) -> Any:
    """Return the value of a YAML text.

    Args:
        text: YAML.
        source: name of the text in messages.
        error: class of the errors.
        first_document: leave out further documents, which are an error otherwise.

    Raises:
        PerceptionError: or ``error``, naming the source: as :func:`read_yaml`.
    """
    if len(text) > MAX_YAML_BYTES:
        raise error(_too_large(source, MAX_YAML_BYTES))
    try:
        reason = _excess(text)
        if reason:
            raise error(f"{source} {reason}")
        if first_document:
            return next(iter(yaml.load_all(text, _Loader)), None)
        return yaml.load(text, _Loader)
    except error:
        raise
    except _RepeatedKeyError as cause:
        raise error(f"{source} has {cause}") from None
    except (yaml.YAMLError, RecursionError, *_WRONG_SCALARS) as cause:
        raise error(f"{source} is not valid YAML: {_reason(cause, text)}") from cause


def _reason(cause: Exception, text: str) -> str:
    """Return why a text is no YAML, in one line."""
    if not isinstance(cause, yaml.MarkedYAMLError) or cause.problem_mark is None:
        return str(cause)
    mark = cause.problem_mark
    line = "".join(text.split("\n")[mark.line : mark.line + 1])
    spaces = "; indent with spaces, not with a tab" if line[mark.column :][:1] == "\t" else ""
    problem = ", ".join(filter(None, (cause.context, cause.problem)))
    return f"line {mark.line + 1}, column {mark.column + 1}: {problem}{spaces}"


def keys_of(data: Any, source: str, error: type[ValueError]) -> dict[str, Any]:
    """Return the mapping that a document holds, or raise ``error``, which names the source."""
    if not isinstance(data, dict):
        found = {type(None): "nothing", list: "a list"}.get(type(data), "a single value")
        raise error(f"{source} must hold lines of `key: value`, got {found}")
    return data


def yaml_text(value: Any, **settings: Any) -> str:
    """Return a value as YAML that :func:`parse_yaml` reads back, with its keys in their order.

    Args:
        value: mappings, lists, texts, numbers, booleans and None.
        settings: of PyYAML, such as ``width``.
    """
    return str(yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, **settings))


def read_json(path: Path, error: type[ValueError] = PerceptionError) -> Any:
    """Return the value in a JSON file.

    Raises:
        PerceptionError: or ``error``, naming the file: it cannot be read, is not valid JSON, has a
            key twice in one object, or is beyond a limit of this module.
    """
    return parse_json(_read_text(path, MAX_JSON_BYTES, "JSON", error), str(path), error)


def parse_json(
    text: str | bytes,
    source: str,
    error: type[ValueError] = PerceptionError,
    *,
    finite: bool = False,
) -> Any:
    """Return the value of a JSON text.

    Args:
        text: JSON.
        source: name of the text in messages.
        error: class of the errors.
        finite: refuse NaN and infinities, which JSON does not have.

    Raises:
        PerceptionError: or ``error``, naming the source: the text is not valid JSON, has a key
            twice in one object, or is beyond a limit of this module.
    """
    if len(text) > MAX_JSON_BYTES:
        raise error(_too_large(source, MAX_JSON_BYTES))
    try:
        if isinstance(text, bytes):
            text = text.decode("utf-8")
        constant = _refuse_constant if finite else None
        return json.loads(text, parse_constant=constant, object_pairs_hook=_unique)
    except _RepeatedKeyError as cause:
        raise error(f"{source} has {cause}") from None
    except RecursionError as cause:
        raise error(f"{source} is nested too deeply") from cause
    except ValueError as cause:
        raise error(f"{source} is not valid JSON: {cause}") from cause


def read_lines(path: Path, error: type[ValueError] = PerceptionError) -> Iterator[bytes]:
    """Yield the lines of a JSON Lines file, each with its line end if it has one.

    Raises:
        PerceptionError: or ``error``, naming the file: it cannot be read, or has a line that is
            longer than :data:`MAX_LINE_BYTES`.
    """
    try:
        with path.open("rb") as file:
            number = 0
            while line := file.readline(MAX_LINE_BYTES + 1):
                number += 1
                if len(line) > MAX_LINE_BYTES:
                    raise error(_too_large(f"{path}, line {number}", MAX_LINE_BYTES))
                yield line
    except OSError as cause:
        raise error(f"cannot read {path}: {cause.strerror or cause}") from cause


def _read_text(path: Path, most_bytes: int, kind: str, error: type[ValueError]) -> str:
    """Return the text of a file that is not larger than a limit; never read more than that."""
    try:
        with path.open("rb") as file:
            data = file.read(most_bytes + 1)
    except OSError as cause:
        reason = f"{cause.strerror or cause}{nearest_file(path)}"
        raise error(f"cannot read {path}: {reason}") from cause
    if len(data) > most_bytes:
        raise error(_too_large(str(path), most_bytes))
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as cause:
        raise error(
            f"{path} is not valid {kind}: its byte {cause.start} is not UTF-8; save it as UTF-8"
        ) from cause


def _excess(text: str) -> str:
    """Return which limit the first document of a YAML text exceeds; empty for none.

    Events come one by one, so that the work ends at the limit.
    """
    values = 0
    sizes: dict[str | None, int] = {}  # values of what each anchor stands for
    opened: list[tuple[str | None, int]] = []  # anchor of a collection, and the values before it
    for event in yaml.parse(text, _SafeLoader):
        if isinstance(event, yaml.DocumentEndEvent):
            break
        if isinstance(event, yaml.CollectionEndEvent):
            anchor, before = opened.pop()
            sizes[anchor] = values - before
        elif isinstance(event, yaml.AliasEvent):
            if any(anchor == event.anchor for anchor, _ in opened):
                return f"has an alias *{event.anchor} within the value that it stands for"
            values += sizes.get(event.anchor, 0)  # an unknown name is an error of the loader
        elif isinstance(event, yaml.NodeEvent):
            sizes[event.anchor] = 1
            if isinstance(event, yaml.CollectionStartEvent):
                opened.append((event.anchor, values))
            elif isinstance(event, yaml.ScalarEvent) and _is_long_number(event):
                return f"has a number of {len(event.value)} characters; at most 64 are allowed"
            values += 1
        if len(opened) > MAX_DEPTH:
            return f"is nested too deeply: {_DEPTH}"
        if values > MAX_YAML_VALUES:
            return (
                f"has more than {MAX_YAML_VALUES} values, each alias (*name) counted as what it "
                "stands for"
            )
    return ""


def _is_long_number(scalar: yaml.ScalarEvent) -> bool:
    is_text = scalar.style in _QUOTES and scalar.tag is None
    return not is_text and _LONG_NUMBER.fullmatch(scalar.value) is not None


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the object of JSON that has these pairs."""
    value: dict[str, Any] = {}
    for key, content in pairs:
        if key in value:
            raise _RepeatedKeyError(f"the key {key!r} twice")
        value[key] = content
    return value


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is not a finite number")


def _too_large(source: str, most_bytes: int) -> str:
    limit = f"{most_bytes >> 20} MiB" if most_bytes >= 1 << 20 else f"{most_bytes} bytes"
    return f"{source} is too large: at most {limit} are read"
