"""The names of a robot's perception: how it sees faces, and the sensors that it has."""

from __future__ import annotations

from typing import Final, Literal, NamedTuple, get_args

from awarenav.errors import not_one_of

from ...world.errors import SimError

#: How the people in an image are perceived.
PerceptionKind = Literal["truth", "keypoints", "pixels"]
#: The sensors of the robot.
SensorSet = Literal["camera", "camera+scanner", "scanner"]
#: One more kind, for comparison: the truth about everybody who is not hidden by a rack.
ORACLE: Final = "oracle"

_KINDS: Final[tuple[str, ...]] = get_args(PerceptionKind)
_SENSOR_SETS: Final[tuple[str, ...]] = get_args(SensorSet)
_AND_SCANNER: Final = "+scanner"
_SCANNER: Final = "scanner"
# A scanner adds nothing to the truth.
_TRUTHS: Final = ("truth", ORACLE)


class Perception(NamedTuple):
    """The perception of a robot.

    Attributes:
        kind: one of :data:`PerceptionKind`, :data:`ORACLE`, or empty without a camera.
        has_scanners: whether the scenario's scanners are used.
    """

    kind: str
    has_scanners: bool = False

    @property
    def name(self) -> str:
        """The name in tables, such as ``"keypoints+scanner"``."""
        if not self.has_scanners:
            return self.kind
        return self.kind + _AND_SCANNER if self.kind else _SCANNER

    @property
    def sensors(self) -> SensorSet:
        """The set of sensors: with the kind, what :meth:`of` takes."""
        if not self.has_scanners:
            return "camera"
        return "camera+scanner" if self.kind else "scanner"

    @property
    def options(self) -> str:
        """The options of the command line, such as ``"--perception keypoints"``."""
        if not self.has_scanners:
            return f"--perception {self.kind}"
        if not self.kind:
            return "--sensors scanner"
        return f"--perception {self.kind} --sensors camera+scanner"

    @classmethod
    def named(cls, name: str) -> Perception:
        """Return the perception of a name in tables.

        Raises:
            SimError: for another name.
        """
        if name == _SCANNER:
            return cls("", has_scanners=True)
        kind = name.removesuffix(_AND_SCANNER)
        has_scanners = kind != name
        if kind in (*_KINDS, ORACLE) and not (has_scanners and kind in _TRUTHS):
            return cls(kind, has_scanners)
        seen = (kind for kind in _KINDS if kind not in _TRUTHS)
        names = (*_KINDS, *(kind + _AND_SCANNER for kind in seen), _SCANNER)
        raise SimError(not_one_of("perception", name, names))

    @classmethod
    def of(cls, kind: str, sensors: str) -> Perception:
        """Return the perception of a kind with a set of sensors.

        Args:
            kind: one of :data:`PerceptionKind`.
            sensors: one of :data:`SensorSet`; with the scanner alone, the kind does not matter.

        Raises:
            SimError: for other names, and for the truth with a scanner.
        """
        if kind not in _KINDS:
            raise SimError(not_one_of("perception", kind, _KINDS))
        if sensors not in _SENSOR_SETS:
            raise SimError(not_one_of("sensors", sensors, _SENSOR_SETS))
        if sensors == "camera":
            return cls(kind)
        if sensors == "scanner":
            return cls("", has_scanners=True)
        if kind in _TRUTHS:
            raise SimError(
                f"perception {kind!r} has no use for a scanner: sensors must be 'camera', got "
                f"{sensors!r}; or perception must be 'keypoints' or 'pixels'"
            )
        return cls(kind, has_scanners=True)
