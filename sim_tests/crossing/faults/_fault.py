"""Faults as files and names, joined, and in one episode."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from importlib import resources
from pathlib import Path
from typing import Any, Final

from pydantic import Field, ValidationError, model_serializer, model_validator

from awarenav.errors import not_one_of
from perception import Camera
from perception.arrays import FloatArray, ImageRgb
from perception.documents import parse_yaml, yaml_text
from perception.errors import did_you_mean
from tracking.config import complaint

from ...world.config import SimConfig
from ...world.errors import SimError
from ...world.scanner import ScannerSpec
from .._messages import Change, Delivery, MountedScan, OdometryReading, Sighting
from ._camera import CAMERA_FAULTS
from ._scans import SCAN_FAULTS
from ._sensor_fault import ImageFault, OdometryFault, PictureFault, ScanFault, SensorFault, Start

#: Every kind of fault; those of one mapping act in this order.
FAULT_KINDS: Final = (*CAMERA_FAULTS, *SCAN_FAULTS)
_SCANNER: Final = "scanner"
_JOINT: Final = "+"


class Fault(SimConfig):
    """The faults of a robot's sensors; the default is none at all.

    Sensors and odometry follow the scenario; the faults are added to them, one after the other.
    Each draws from random streams of its own, so that everything else in an episode stays the same,
    bit for bit.

    A file gives the keys of its faults beside ``name``, those of the scanners below ``scanner``;
    the order of such keys does not matter. ``faults`` is a list of mappings with such keys, which
    act one after the other.

    Attributes:
        name: name in tables.
        description: one sentence.
        faults: the faults, in the order in which they act.
    """

    name: str = Field(default="none", min_length=1, pattern=r"^[A-Za-z0-9_.+-]+$")
    description: str = ""
    faults: tuple[SensorFault, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any) -> Any:
        """Turn the keys of faults into faults."""
        if not isinstance(data, Mapping):
            return data
        own = {key: data[key] for key in ("name", "description") if key in data}
        listed = data.get("faults", ())
        if not isinstance(listed, list | tuple):
            raise ValueError(f"faults must be a list, got {listed!r:.80}")
        faults = list(_faults_of({key: data[key] for key in data if key not in cls.model_fields}))
        for each in listed:
            faults += [each] if isinstance(each, SensorFault) else _faults_of(each)
        return {**own, "faults": tuple(faults)}

    @model_serializer
    def _as_keys(self) -> dict[str, Any]:
        """Return name, description and the keys of the faults that differ from their defaults."""
        head = {"name": self.name} | ({"description": self.description} if self.description else {})
        mappings = list(_mappings(self.faults))
        return head | (mappings[0] if len(mappings) == 1 else {"faults": mappings})

    @classmethod
    def shipped(cls, name: str) -> Fault:
        """Load a fault that comes with the package; raises SimError for other names."""
        if name not in (names := shipped_faults()):
            raise SimError(not_one_of("fault", name, names))
        text = (resources.files("sim_tests.crossing.faults") / f"{name}.yaml").read_text("utf-8")
        return cls.model_validate(parse_yaml(text, name, SimError))

    @classmethod
    def of(cls, name: str) -> Fault:
        """Load a shipped fault, one from a ``.yaml`` or ``.yml`` file, or several at once.

        Args:
            name: a name or a file; several are joined by ``+``, as in ``ghosts+scanner_late``, and
                act in this order.
        """
        if name.endswith((".yaml", ".yml")) and (Path(name).exists() or _JOINT not in name):
            return cls.from_yaml(name)
        if _JOINT in name:
            return reduce(cls.then, map(cls.of, name.split(_JOINT)))
        return cls.shipped(name)

    def then(self, other: Fault) -> Fault:
        """Return a fault of which these faults act first, then the others."""
        return Fault(
            name=f"{self.name}{_JOINT}{other.name}",
            description=" ".join(filter(None, (self.description, other.description))),
            faults=self.faults + other.faults,
        )

    def to_text(self) -> str:
        """Return the fault as YAML, without default values."""
        return yaml_text(self.model_dump())


def shipped_faults() -> tuple[str, ...]:
    """Return the names of the faults that come with the package, sorted."""
    folder = resources.files("sim_tests.crossing.faults")
    names = (entry.name for entry in folder.iterdir() if entry.name.endswith(".yaml"))
    return tuple(sorted(name.removesuffix(".yaml") for name in names))


class EpisodeFaults:
    """The faults of one episode, as changes of what the sensors deliver."""

    def __init__(self, fault: Fault | None, seed: int, camera: Camera) -> None:
        self._faults: list[tuple[SensorFault, Start]] = []
        counts: Counter[str] = Counter()
        for each in () if fault is None else fault.faults:
            name = type(each).__name__
            self._faults.append((each, Start(seed, camera, name, counts[name])))
            counts[name] += 1

    def pictures(self) -> Change[ImageRgb] | None:
        """Return the change of the camera's pictures; None without one."""
        return _chain(self._begun(PictureFault))

    def images(self) -> Change[Sighting] | None:
        """Return the change of the camera's images; None without one."""
        return _chain(self._begun(ImageFault))

    def odometry(self) -> Change[OdometryReading] | None:
        """Return the change of the robot's odometry; None without one."""
        return _chain(self._begun(OdometryFault))

    def scans(
        self, number: int, scanner: ScannerSpec, body_base_m: FloatArray
    ) -> Change[MountedScan] | None:
        """Return the change of the scans of a scanner, counted from 0; None without one."""
        mount = {"number": number, "scanner": scanner, "body_base_m": body_base_m}
        return _chain(self._begun(ScanFault, **mount))

    def _begun(self, kind: Any, **mount: Any) -> list[Change[Any]]:
        """Return the changes of the faults of a kind; those of another scanner are left out."""
        return [
            each.begin(replace(start, **mount))
            for each, start in self._faults
            if isinstance(each, kind)
            and not (isinstance(each, ScanFault) and each.only not in (None, mount["number"] + 1))
        ]


def _chain(changes: Sequence[Change[Any]]) -> Change[Any] | None:
    """Return one change that makes several, one after the other; None for none."""
    if not changes:
        return None

    def change(taken: Delivery[Any]) -> Delivery[Any] | None:
        delivery: Delivery[Any] | None = taken
        for each in changes:
            if delivery is not None:
                delivery = each(delivery)
        return delivery

    return change


def _faults_of(keys: Any) -> Iterator[SensorFault]:
    """Yield the faults of a mapping with their keys."""
    given = _mapping("a fault", keys)
    below = _mapping(_SCANNER, given.pop(_SCANNER, {}))
    shared = {"only": below.pop("only")} if "only" in below else {}
    yield from _validated(given, CAMERA_FAULTS, (), {}, also=(*Fault.model_fields, _SCANNER))
    yield from _validated(below, SCAN_FAULTS, (_SCANNER,), shared, also=("only",))


def _mapping(name: str, keys: Any) -> dict[str, Any]:
    """Return a mapping without its keys of null, which is as if they were left out."""
    if not isinstance(keys, Mapping):
        raise ValueError(f"{name} must be a mapping of keys, got {keys!r:.80}")
    return {key: value for key, value in keys.items() if value is not None}


def _validated(
    given: Mapping[str, Any],
    kinds: Sequence[type[SensorFault]],
    path: tuple[str, ...],
    shared: Mapping[str, Any],
    also: Iterable[str],
) -> Iterator[SensorFault]:
    """Yield the faults that a mapping below a path has keys of, in the order of their kinds.

    ``shared`` are settings of all of them, ``also`` other keys that are valid in that place.
    """
    own = {kind: [each for each in kind.model_fields if each != "only"] for kind in kinds}
    kind_of = {key: kind for kind in kinds for key in ([kind.key] if kind.key else own[kind])}
    settings: dict[type[SensorFault], Any] = {}
    for key, value in given.items():
        if key not in kind_of:
            valid = [*also, *kind_of]
            hint = did_you_mean(key, valid, cutoff=0.5) or f"; valid keys: {', '.join(valid)}"
            raise ValueError(f"unknown key {key!r} in {'.'.join(path) or 'Fault'}{hint}")
        kind = kind_of[key]
        settings[kind] = value if kind.key else {**settings.get(kind, {}), key: value}
    for kind in (each for each in kinds if each in settings):
        data = settings[kind]
        try:
            yield kind.model_validate({**data, **shared} if isinstance(data, Mapping) else data)
        except ValidationError as cause:
            place = (*path, kind.key) if kind.key else path
            errors = cause.errors(include_url=False)
            for each in errors:
                each["loc"] = (*place, *each["loc"])
            raise ValueError("; ".join(map(complaint, errors))) from cause


def _mappings(faults: Iterable[SensorFault]) -> Iterator[dict[str, Any]]:
    """Yield as few mappings of keys as hold the faults in their order."""
    mapping: dict[str, Any] = {}
    rank = -1
    for each in faults:
        before, rank = rank, FAULT_KINDS.index(type(each))
        other_scanner = (
            isinstance(each, ScanFault)
            and _SCANNER in mapping
            and mapping[_SCANNER].get("only") != each.only
        )
        if rank <= before or other_scanner:
            yield mapping
            mapping = {}
        data = each.model_dump(mode="json", exclude_defaults=True)
        only = {key: data.pop(key) for key in ("only",) if key in data}
        keys = {each.key: data} if each.key else data
        if isinstance(each, ScanFault):
            mapping[_SCANNER] = {**mapping.get(_SCANNER, {}), **only, **keys}
        else:
            mapping.update(keys)
    yield mapping
