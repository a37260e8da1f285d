"""Places of the code that may be changed, what may stand there instead, and the draw."""

from __future__ import annotations

import ast
import copy
import functools
import random
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

SOURCES: Final = ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests")
#: Code whose mistakes can hurt: limit and reach, trust in people, who is present and aware, clocks.
SAFETY: Final = re.compile(
    r"nav_adapter/\w*(limit|reach|contact|adapter|people|trust|separation|governor)\w*\.py"
    r"|nav_adapter/policies/\w+\.py"
    r"|tracking/\w*(match|presence|noticed|step|admission|awareness|clock)\w*\.py"
    r"|perception/\w*(attention|awareness)\w*\.py"
)
#: Changes that cannot be noticed: file, what the change says, and why it changes nothing.
EQUIVALENT: Final = (
    (
        "perception/awareness.py",
        "self._axes[:, ::-1] * _TURNING_SIGNS → self._axes[:, ::-1] / _TURNING_SIGNS",
        "the signs are ±1",
    ),
    (
        "perception/awareness.py",
        "self._rotation[rows][:, :, ::2] * [-1.0, 1.0] → "
        "self._rotation[rows][:, :, ::2] / [-1.0, 1.0]",
        "the signs are ±1",
    ),
)
_BOUNDARY: Final[dict[type, type]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
}
_OPPOSITE: Final[dict[type, type]] = {
    **{ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt},
    **{ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is},
    **{ast.In: ast.NotIn, ast.NotIn: ast.In, ast.And: ast.Or, ast.Or: ast.And},
    **{ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult},
    **{ast.Pow: ast.Mult, ast.FloorDiv: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd},
}
_TO_READERS: Final = re.compile(r"(_?log(ger|ging)?|warnings|cast|TypeVar)\b", re.IGNORECASE)
_FIRST_ARGUMENT: Final = ("min", "max", "abs", "clip", "minimum", "maximum", "fabs")


class Site(NamedTuple):
    """A node of a file's syntax tree, and what may take its place."""

    node: Any
    statement: ast.stmt
    function: ast.FunctionDef | None  # None: runs when the module is imported
    variants: tuple[ast.AST, ...]


class Mutant(NamedTuple):
    """One change of one place: ``variant`` of the ``site``-th site of a file."""

    file: str
    site: int
    variant: int
    line: int
    change: str

    @property
    def safety(self) -> bool:
        """True if the place belongs to safety code."""
        return SAFETY.fullmatch(self.file) is not None

    @property
    def source(self) -> str:
        """The one of SOURCES that the place belongs to."""
        return next(each for each in SOURCES if self.file.startswith(f"{each}/"))


def sites(tree: ast.Module) -> list[Site]:
    """Return the places of a file that may be changed, in their order.

    Annotations, decorators, texts, errors raised, logging and what only type checkers read are
    left out: a change there is none of behaviour.
    """
    found: list[Site] = []

    def visit(node: ast.AST, statement: ast.stmt, function: ast.FunctionDef | None) -> None:
        if _is_left_out(node):
            return
        if isinstance(node, ast.stmt):
            statement = node
        if variants := tuple(_variants(node, function)):
            found.append(Site(node, statement, function, variants))
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list", "bases", "type_comment"):
                continue
            inner = node if isinstance(node, ast.FunctionDef) and name != "name" else function
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    visit(child, statement, inner)

    for each in tree.body:
        visit(each, each, None)
    return found


def _is_left_out(node: ast.AST) -> bool:
    match node:
        case ast.Raise() | ast.Assert() | ast.JoinedStr() | ast.Import() | ast.ImportFrom():
            return True
        case ast.FunctionDef(name="__repr__" | "__str__") | ast.If(test=ast.Name("TYPE_CHECKING")):
            return True
        case ast.Assign(targets=[ast.Name(id=name)]):
            return name in ("__all__", "__version__", "__slots__", "model_config")
        case ast.keyword(arg=name):
            return name in ("strict", "description", "stacklevel", "maxsize", "repr")
        case ast.Call(func=func):
            return _TO_READERS.match(ast.unparse(func)) is not None
    return False


def _variants(node: Any, function: ast.FunctionDef | None) -> Iterator[ast.AST]:
    """Yield what may stand instead of a node."""
    match node:
        case ast.Compare() | ast.BoolOp() | ast.BinOp() | ast.AugAssign():
            yield from _other_operators(node, function)
        case ast.UnaryOp(operand=operand):
            yield operand
        case ast.Constant(value=bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(value=int(value) | float(value)):
            # Guards against rounding, and bounds that nothing comes near, have no exact value.
            if value in (0, 1):
                yield ast.Constant(type(value)(1 - value))
            elif 1e-5 < value < 1e5:
                yield ast.Constant(value + 1 if isinstance(value, int) else value * 1.5)
        case ast.Call(func=func, args=[first, *_]) if _name(func) in _FIRST_ARGUMENT:
            if not isinstance(first, (ast.Starred, ast.GeneratorExp)):
                yield first
        case ast.Expr(value=ast.Call() as call) if not _is_left_out(call):
            yield ast.Pass()
        case ast.Return(value=ast.expr() as value) if function is not None and function.returns:
            may_be_none = ast.unparse(function.returns).endswith("None")
            if may_be_none and ast.unparse(value) != "None":
                yield ast.Return(ast.Constant(None))


def _other_operators(node: Any, function: ast.FunctionDef | None) -> Iterator[ast.AST]:
    if isinstance(node, ast.Compare):
        first = type(node.ops[0])
        for table in (_BOUNDARY, _OPPOSITE):
            if first in table:
                yield _changed(node, ops=[table[first](), *node.ops[1:]])
        return
    union_of_types = function is None and isinstance(node.op, ast.BitOr)
    if type(node.op) in _OPPOSITE and not union_of_types and not _has_text(node):
        yield _changed(node, op=_OPPOSITE[type(node.op)]())


def _has_text(node: ast.AST) -> bool:
    return any(
        isinstance(each, ast.JoinedStr)
        or (isinstance(each, ast.Constant) and isinstance(each.value, (str, bytes)))
        for each in ast.iter_child_nodes(node)
    )


def _name(function: ast.expr) -> str:
    return ast.unparse(function).rpartition(".")[2]


def _changed(node: Any, **fields: Any) -> Any:
    changed = copy.copy(node)
    for name, value in fields.items():
        setattr(changed, name, value)
    return changed


def draw(tree: Path, count: int, seed: int, *, only_safety: bool = False) -> list[Mutant]:
    """Return ``count`` different places to change, in the order of the files.

    At least half of them are in safety code. Each place is as likely as any other, and so is each
    of the changes that it allows.
    """
    chance = random.Random(seed)
    places: dict[bool, list[tuple[str, int, Site]]] = {True: [], False: []}
    for file in source_files(tree):
        for index, site in enumerate(parsed(tree / file)[1]):
            places[SAFETY.fullmatch(file) is not None].append((file, index, site))
    safe = count if only_safety else (count + 1) // 2
    drawn = []
    for safety, number in ((True, safe), (False, count - safe)):
        for file, index, site in chance.sample(places[safety], min(number, len(places[safety]))):
            variant = chance.randrange(len(site.variants))
            change = f"{_short(site.node)} → {_short(site.variants[variant])}"
            if (file, change) not in {each[:2] for each in EQUIVALENT}:
                drawn.append(Mutant(file, index, variant, site.node.lineno, change))
    return sorted(drawn)


def changed_text(text: str, mutant: Mutant) -> str:
    """Return the text of a file with one change; comments are lost."""
    tree = ast.parse(text)
    site = sites(tree)[mutant.site]
    old, new = site.node, site.variants[mutant.variant]

    class Exchange(ast.NodeTransformer):
        def visit(self, node: ast.AST) -> ast.AST:
            return new if node is old else self.generic_visit(node)

    return ast.unparse(ast.fix_missing_locations(Exchange().visit(tree)))


def source_files(tree: Path) -> list[str]:
    files = (path for source in SOURCES for path in (tree / source).rglob("*.py"))
    return sorted(path.relative_to(tree).as_posix() for path in files)


@functools.cache
def parsed(path: Path) -> tuple[ast.Module, list[Site]]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return tree, sites(tree)


def _short(node: ast.AST) -> str:
    text = " ".join(ast.unparse(node).split())
    return text if len(text) <= 70 else f"{text[:50]} … {text[-17:]}"
