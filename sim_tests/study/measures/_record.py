"""An episode's row: made from its log, and in tables on disk, CSV or Parquet."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import Field, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, TypeVar, get_args

from awarenav.errors import did_you_mean
from awarenav.files import atomic_path

from ...conditions import AXES, Conditions
from ...world.errors import SimError, needs
from ._awareness import Awareness
from ._metrics import COLUMNS
from ._registry import Column, Kind

if TYPE_CHECKING:
    import pyarrow

    from ...crossing import CrossingResult

#: Decimals of numbers in files: micrometres.
DECIMALS: Final = 6
#: Columns of ``episodes.csv`` in their order.
RECORD_COLUMNS: Final = tuple(COLUMNS)
_TYPES: Final[dict[Kind, Any]] = {"text": str, "flag": bool, "count": int, "number": float | None}
_PARQUET: Final = ".parquet"
#: Columns of earlier versions, which took a head that faces the robot for a look: not read.
BY_THE_CONE: Final = frozenset(
    [f"step_out_{each}" for each in ("unaware", "unaware_fast", "aware", "aware_fast")]
    + ["step_out_worst_mps", "step_out_stress_unaware", "step_out_stress_worst_mps"]
    + ["moving_contacts_unaware", "moving_contact_unaware_mps", "min_margin_unaware_m"]
)
# That of sim_tests.crossing, whose import needs the simulator.
_STANDING_SPEED_MPS: Final = 0.03

_Row = TypeVar("_Row")


def _with_columns(row: type[_Row]) -> type[_Row]:
    """Give a class a field for each column of ``episodes.csv``; it becomes a frozen dataclass."""
    row.__annotations__ = {name: _TYPES[each.kind] for name, each in COLUMNS.items()}
    for name, each in COLUMNS.items():
        if not each.required:
            setattr(row, name, each.default)
    return dataclass(frozen=True, slots=True, repr=False)(row)


@_with_columns
class EpisodeRecord:
    """One row of ``episodes.csv``: an attribute for each of :data:`COLUMNS`, in their order.

    None means that a measure does not apply to the episode. With an ``error``, every measure keeps
    its default.
    """

    if TYPE_CHECKING:
        __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

        def __init__(self, *values: Any, **named: Any) -> None: ...

        def __getattr__(self, column: str) -> Any: ...

    def __repr__(self) -> str:
        """Return the columns that do not have their default."""
        cells = (
            f"{each.name}={getattr(self, each.name)!r}"
            for each in fields(self)
            if getattr(self, each.name) != each.default
        )
        return f"EpisodeRecord({', '.join(cells)})"

    def rounded(self) -> EpisodeRecord:
        """Return the row with its numbers as files keep them."""
        values = {name: getattr(self, name) for name in COLUMNS}
        numbers = {
            name: rounded(values[name]) for name, each in COLUMNS.items() if each.kind == "number"
        }
        return EpisodeRecord(**{**values, **numbers})

    @property
    def conditions(self) -> Conditions:
        """The conditions of the episode, which are its key."""
        return Conditions(**{name: getattr(self, name) for name in AXES})

    @property
    def versioned_scenario(self) -> str:
        """The scenario, followed by its version from 2 on."""
        version = "" if self.scenario_version == 1 else f" v{self.scenario_version}"
        return f"{self.scenario}{version}"

    @property
    def task(self) -> tuple[str, int, int]:
        """Scenario, version and seed: episodes that share them are a pair."""
        return self.scenario, self.scenario_version, self.seed

    @property
    def lasted_s(self) -> float | None:
        """Time to the goal; of an episode that never arrives, what it lasted."""
        arrived_s: float | None = self.time_to_goal_s
        return self.duration_s if arrived_s is None else arrived_s

    @property
    def moving_touched(self) -> bool:
        """True if a moving robot and a person touched, by any cause.

        Tables of earlier versions tell it by the robot's highest speed at a contact.
        """
        speed_mps = self.speed_at_min_separation_mps or 0.0
        return bool(
            self.moving_contacts > 0
            or self.robot_touched
            or (self.contact and speed_mps > _STANDING_SPEED_MPS)
        )

    @property
    def robot_touched(self) -> bool:
        """True if the robot moved into a person."""
        return bool(self.robot_contacts > 0 or self.contact_by == "robot")

    @property
    def person_touched(self) -> bool:
        """True if a person walked into the robot."""
        return bool(self.person_contacts > 0 or self.contact_by == "person")


def measure(result: CrossingResult, **conditions: Any) -> EpisodeRecord:
    """Return the row of a crossing: every measure, as docs/measures.md defines them.

    Numbers are rounded to the six decimals that files keep, so that a record read from a file is
    equal.

    Args:
        result: the crossing.
        conditions: columns that the log does not tell, such as ``scenario_version``, ``attention``
            and ``fault``; or that take the place of those of the result.

    Raises:
        SimError: a result without frames, or with frames that do not hold all people.
    """
    values = {
        "scenario": result.scenario,
        "seed": result.seed,
        "policy": result.policy,
        "planner": result.planner,
        "perception": result.perception,
        **{name: each.of(result) for name, each in COLUMNS.items() if each.of is not None},
    }
    return EpisodeRecord(**{**values, **conditions}).rounded()


def read_records(path: Path | str) -> tuple[EpisodeRecord, ...]:
    """Return the episodes of a CSV file, or of a file with the suffix ``.parquet``.

    Columns may come in any order. A column that an earlier version did not write takes its default;
    :data:`BY_THE_CONE` are left out.

    Raises:
        SimError: the file cannot be read, or is not a table of episodes.
    """
    path = Path(path)
    if path.suffix == _PARQUET:
        header, *body = _parquet_rows(path)
    else:
        try:
            # A spreadsheet may have written a byte order mark.
            text = io.StringIO(path.read_bytes().decode("utf-8-sig"), newline="")
            header, *body = list(csv.reader(text, strict=True)) or [[]]
        except OSError as cause:
            raise SimError(f"cannot read the episodes {path}: {cause.strerror or cause}") from cause
        except (UnicodeDecodeError, csv.Error) as cause:
            raise SimError(f"{path} is not a table of episodes: {cause}") from cause
    check_columns(header, str(path))
    return tuple(
        parse_row(header, cells, f"{path}, line {line}")
        for line, cells in enumerate(body, start=2)
        if cells
    )


def write_records(path: Path | str, records: Iterable[EpisodeRecord]) -> None:
    """Write episodes as CSV, or as Parquet to a file with the suffix ``.parquet``.

    The file appears whole or not at all. Parquet has typed columns, and None as null.

    Raises:
        SimError: the file cannot be written, or Parquet without the extra ``bench``.
    """
    path = Path(path)
    if path.suffix == _PARQUET:
        pq = _parquet()
        table = _parquet_table(tuple(records))
        # Given a path, pyarrow takes only names in UTF-8.
        with atomic_path(path, SimError) as part, part.open("wb") as data:
            pq.write_table(table, data)
        return
    if not path.parent.is_dir():
        raise SimError(f"cannot write the episodes {path}: there is no folder {path.parent}")
    with atomic_path(path, SimError) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(RECORD_COLUMNS)
        writer.writerows(record_row(record) for record in records)


def _parquet() -> Any:
    """Return the module that reads and writes Parquet."""
    with needs("Parquet", "pyarrow"):
        import pyarrow.parquet as pq  # noqa: PLC0415 - an optional dependency
    return pq


def _parquet_table(records: tuple[EpisodeRecord, ...]) -> pyarrow.Table:
    import pyarrow as pa  # noqa: PLC0415 - an optional dependency

    types = {"text": pa.string(), "flag": pa.bool_(), "count": pa.int64(), "number": pa.float64()}

    def value_of(value: Any) -> Any:
        if isinstance(value, str):
            return one_line(value)
        return rounded(value) if isinstance(value, float) else value

    cells = {name: [value_of(getattr(each, name)) for each in records] for name in COLUMNS}
    return pa.table(cells, schema=pa.schema([(c.name, types[c.kind]) for c in COLUMNS.values()]))


def _parquet_rows(path: Path) -> list[list[str]]:
    """Return header and rows of a Parquet file as the cells of the CSV file."""
    pq = _parquet()
    try:
        with path.open("rb") as file:
            table = pq.read_table(file)
    except (OSError, ValueError) as cause:  # ArrowInvalid is a ValueError
        raise SimError(f"cannot read the episodes {path}: {cause}") from cause

    def cell(value: Any) -> str:
        if value is None:
            return ""
        return str(value).lower() if isinstance(value, bool) else str(value)

    return [
        list(table.column_names),
        *([cell(v) for v in row.values()] for row in table.to_pylist()),
    ]


def rounded(value: float | None) -> float | None:
    """Return a number as it is read back from a file; None for None, NaN and infinity.

    A record in memory therefore equals the same record read from a file, and a resumed run gives
    the same records as an uninterrupted one.
    """
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{DECIMALS}f}") + 0.0  # no negative zero


def record_row(record: EpisodeRecord) -> list[str]:
    """Return the cells of one episode in the order of :data:`RECORD_COLUMNS`.

    Numbers have six decimals, and None is an empty cell. Line breaks in texts become spaces, so
    that an episode is always one line.
    """
    return [_cell_text(each.kind, getattr(record, name)) for name, each in COLUMNS.items()]


def one_line(text: str) -> str:
    """Return a text on one line and without NUL, which the csv module of Python 3.10 refuses."""
    return " ".join(text.replace("\0", "").splitlines())


def check_columns(columns: Sequence[str], source: str) -> None:
    """Check the header of a table of episodes.

    Raises:
        SimError: a column is unknown or there twice, or a required one is missing.
    """
    for name in columns:
        if name not in COLUMNS and name not in BY_THE_CONE:
            hint = did_you_mean(name, RECORD_COLUMNS)
            raise SimError(
                f"{source} is not a table of episodes: unknown column {name[:80]!r}{hint} "
                "(docs/measures.md lists all)"
            )
        if list(columns).count(name) > 1:
            raise SimError(f"{source} has the column {name!r} {list(columns).count(name)} times")
    missing = [each.name for each in COLUMNS.values() if each.required and each.name not in columns]
    if missing:
        raise SimError(f"{source} is not a table of episodes: it has no column {missing[0]!r}")


def parse_row(columns: Sequence[str], cells: Sequence[str], source: str) -> EpisodeRecord:
    """Return the episode of a row.

    Raises:
        SimError: a cell does not fit its column, or there are more or fewer cells than columns.
    """
    if len(cells) != len(columns):
        raise SimError(f"{source} has {len(cells)} cells, its header {len(columns)}")
    values = {
        name: _parse_cell(COLUMNS[name], cell, source)
        for name, cell in zip(columns, cells, strict=True)
        if name not in BY_THE_CONE
    }
    return EpisodeRecord(**values)


def _cell_text(kind: Kind, value: Any) -> str:
    if kind == "number":
        number = rounded(value)
        return "" if number is None else f"{number:.{DECIMALS}f}"
    if kind == "flag":
        return str(bool(value)).lower()
    if kind == "count":
        return str(int(value))
    return one_line(str(value))


def _parse_cell(column: Column, cell: str, source: str) -> Any:
    name, kind = column.name, column.kind
    if kind == "flag":
        if cell not in ("true", "false"):
            raise SimError(f"{source}: {name} must be true or false, got {cell[:80]!r}")
        return cell == "true"
    if kind == "text":
        if name == "awareness" and cell not in get_args(Awareness):
            known = ", ".join(map(repr, get_args(Awareness)))
            raise SimError(f"{source}: awareness must be one of {known}, got {cell[:80]!r}")
        return cell
    if kind == "number" and not cell:
        return None
    try:
        number = int(cell) if kind == "count" else float(cell)
    except ValueError as cause:
        what = "a whole number" if kind == "count" else "a number or empty"
        raise SimError(f"{source}: {name} must be {what}, got {cell[:80]!r}") from cause
    if not math.isfinite(number):
        raise SimError(f"{source}: {name} must be finite or empty, got {cell[:80]!r}")
    return number
