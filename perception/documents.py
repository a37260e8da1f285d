"""YAML and JSON from files, with unique keys, and limits on size, nesting and aliases.

All packages read their files through these functions, and pass the error class of their own
package. A hostile or damaged file is refused before it costs much time, memory or stack: PyYAML in
C overflows the stack on 100 000 nested brackets, and 236 bytes of nested aliases stand for 10⁹
values.

A key that a mapping has twice is refused with both lines: parsers take the last without a word.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import yaml

from .errors import PerceptionError

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
#: Most lists and mappings within each other.
MAX_DEPTH: Final = 64

# Numbers such as 5e-2 and 1E5, which ROS reads as numbers and YAML 1.1 as texts.
_FLOAT: Final = "tag:yaml.org,2002:float"
_EXPONENT: Final = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+$")
_STARTS: Final = list("-+.0123456789")
_MERGE: Final = "tag:yaml.org,2002:merge"
_NAMES: Final = (_MERGE, "tag:yaml.org,2002:value")  # << and =, which PyYAML cannot construct
# Of the scanner of JSON that finds the lines of a repeated key.
_JSON_TOKEN: Final = re.compile(r'"[^"\\]*(?:\\.[^"\\]*)*"|[{}:]', re.DOTALL)
# PyYAML needs quadratic time for numbers to the base 60, such as 1:00:00.
_LONG_NUMBER: Final = re.compile(r"[-+0-9_:.]{65,}")
# Styles of scalars that are texts, whatever they look like.
_QUOTES: Final = ("'", '"', "|", ">")
# What PyYAML raises for scalars that are not of their type, such as !!bool 3 or 2001-99-99.
_WRONG_SCALARS: Final = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError)


class _RepeatedKeyError(Exception):
    """A mapping has a key twice, of which a parser would take the last."""

    def __init__(self, key: Any, first_line: int, second_line: int) -> None:
        self.key = key
        self.lines = first_line, second_line

    def message(self, source: str, text: str) -> str:
        first, second = self.lines
        where = f", in lines {first} and {second}" if first != second else f" in line {first}"
        return f"{source} has the key {self.key!r} twice" + (where if "\n" in text.strip() else "")


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
                    raise _RepeatedKeyError(key, lines[key], line)
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
        raise error(cause.message(source, text)) from None
    except (yaml.YAMLError, RecursionError, *_WRONG_SCALARS) as cause:
        raise error(f"{source} is not valid YAML: {cause}") from cause


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
        value = json.loads(text, parse_constant=constant, object_pairs_hook=_unique)
    except _RepeatedKeyError:
        raise error(_repeated_in(str(text)).message(source, str(text))) from None
    except RecursionError as cause:
        raise error(_too_deep(source)) from cause
    except ValueError as cause:
        raise error(f"{source} is not valid JSON: {cause}") from cause
    if _is_deeper(value, MAX_DEPTH):
        raise error(_too_deep(source))
    return value


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
        raise error(f"cannot read {path}: {cause.strerror or cause}") from cause
    if len(data) > most_bytes:
        raise error(_too_large(str(path), most_bytes))
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as cause:
        raise error(f"{path} is not valid {kind}: {cause}") from cause


def _excess(text: str) -> str:
    """Return which limit the first document of a YAML text exceeds; empty for none.

    Events come one by one, so that the work ends at the limit.
    """
    extent = _Extent()
    for event in yaml.parse(text, _SafeLoader):
        if isinstance(event, yaml.DocumentEndEvent):
            break
        excess = extent.add(event) or extent.excess
        if excess:
            return excess
    return ""


class _Extent:
    """The number of values and their depth in a YAML document, from its events."""

    def __init__(self) -> None:
        self._values = 0
        self._anchors: dict[str | None, int | None] = {}  # number of values; None while open
        self._open: list[tuple[str | None, int]] = []  # anchor, and the values before it

    @property
    def excess(self) -> str:
        """Return the limit that is exceeded; empty for none."""
        if len(self._open) > MAX_DEPTH:
            return _too_deep("").strip()
        if self._values > MAX_YAML_VALUES:
            return (
                f"has more than {MAX_YAML_VALUES} values, each alias (*name) counted as what it "
                "stands for"
            )
        return ""

    def add(self, event: yaml.Event) -> str:
        """Count an event; return why it is refused, empty if it is not."""
        if isinstance(event, yaml.AliasEvent):
            size = self._anchors.get(event.anchor, 0)  # an unknown name is an error of the loader
            if size is None:
                return f"has an alias *{event.anchor} within the value that it stands for"
            self._values += size
        elif isinstance(event, yaml.CollectionStartEvent):
            self._open.append((event.anchor, self._values))
            self._anchors[event.anchor] = None
            self._values += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = self._open.pop()
            self._anchors[anchor] = self._values - before
        elif isinstance(event, yaml.ScalarEvent):
            self._anchors[event.anchor] = 1
            self._values += 1
            quoted = event.style in _QUOTES and event.tag is None
            if not quoted and _LONG_NUMBER.fullmatch(event.value):
                return f"has a number of {len(event.value)} characters; at most 64 are allowed"
        return ""


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the object of JSON that has these pairs."""
    value = dict(pairs)
    if len(value) < len(pairs):
        raise _RepeatedKeyError("", 0, 0)  # the parser does not tell lines
    return value


def _repeated_in(text: str) -> _RepeatedKeyError:
    """Return the first repeated key of a JSON text that has one."""
    objects: list[dict[str, int]] = []
    line, read = 1, 0
    before = ""
    for token in _JSON_TOKEN.finditer(text):
        line += text.count("\n", read, token.start())
        read = token.start()
        if token[0] == "{":
            objects.append({})
        elif token[0] == "}":
            objects.pop()
        elif token[0] == ":":
            key = json.loads(before)
            if key in objects[-1]:
                return _RepeatedKeyError(key, objects[-1][key], line)
            objects[-1][key] = line
        before = token[0]
    raise AssertionError("no key is repeated")


def _is_deeper(value: Any, depth: int) -> bool:
    """Return True if lists and mappings lie more than ``depth`` deep within each other."""
    level = [value] if isinstance(value, dict | list) else []
    for _ in range(depth):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer)
            if isinstance(inner, dict | list)
        ]
        if not level:
            return False
    return True


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is not a finite number")


def _too_deep(source: str) -> str:
    return f"{source} is nested too deeply: more than {MAX_DEPTH} lists and mappings in each other"


def _too_large(source: str, most_bytes: int) -> str:
    limit = f"{most_bytes >> 20} MiB" if most_bytes >= 1 << 20 else f"{most_bytes} bytes"
    return f"{source} is too large: at most {limit} are read"
