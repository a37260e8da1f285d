"""The conditions of an episode: every axis of an experiment, from the command line to the table.

A new axis is one field of :class:`Conditions`, and the code that gives it a meaning. The options of
the commands, the column of ``episodes.csv``, the key of an episode, the keys of ``jobs.jsonl`` and
the words of ``run.json`` follow from the field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple, TypeVar, get_args

from awarenav.cli import OneOf, Whole, WordAndNumbers, option
from awarenav.cli.options import completion_of
from awarenav.errors import not_one_of

from .world.errors import SimError

#: Names of the sets of shipped scenarios. ``"all"`` is the set that published figures are over.
#: ``"guidelines"`` adds the situations of Francis et al. that it lacks, ``"step_out"`` people who
#: stand beside the robot's way and set off across it as it comes, ``"at_work"`` people who work in
#: the robot's aisle.
SCENARIO_SETS: Final = ("all", "guidelines", "step_out", "at_work")
#: The same in help texts.
SETS_TEXT: Final = ", ".join(map(repr, SCENARIO_SETS))
#: What perceives the people in the images of the camera.
PerceptionKind = Literal["truth", "keypoints", "pixels"]
#: One more kind, for comparison: the truth about everybody who is not hidden by a rack.
ORACLE: Final = "oracle"
#: Cameras by name, of which a robot has one at most, and its other sensors. Each is the class of
#: this name in ``crossing/sensors/_NAME.py``.
CAMERAS: Final = ("truth", ORACLE, "keypoints", "pixels", "depth")
OTHER_SENSORS: Final = ("scanner",)
#: The command line's name of the reference planner, which is empty elsewhere.
REFERENCE_PLANNER: Final = "reference"
#: The same planner's name in tables of episodes.
REFERENCE_IN_TABLES: Final = "ReferencePlanner"
#: The name that stands for "without a fault".
NO_FAULT: Final = "none"
#: The name of the habits that people have.
PopulationName = Literal["classic", "recorded"]
#: All of them.
POPULATIONS: Final[tuple[PopulationName, ...]] = get_args(PopulationName)

#: Settings of ``--sensors`` for the commands that show what the library wins: the robot has all of
#: its sensors, but for the truth, to which scanners add nothing.
USUAL_SENSORS: Final = {
    "default": None,
    "show_default": "camera+scanner; camera with --perception truth",
}
#: Completion of scenarios on the command line.
COMPLETE_SCENARIOS: Final = completion_of(
    "sim_tests", "scenario/shipped", *SCENARIO_SETS, sets=SCENARIO_SETS[1:]
)
#: Completion of the policies of crossings, which have today's AMR besides.
COMPLETE_SIMULATED_POLICIES: Final = completion_of(
    "nav_adapter", "policies", "scanner", "scanner_warning"
)

_KINDS: Final[tuple[str, ...]] = get_args(PerceptionKind)
# In --sensors, the camera of --perception.
_CAMERA: Final = "camera"
_SCANNER: Final = "scanner"
# Another sensor adds nothing to the truth.
_TRUTHS: Final = ("truth", ORACLE)

_ScenarioT = TypeVar("_ScenarioT")


class Perception(tuple[str, ...]):
    """The sensors of a robot: names of :data:`CAMERAS` and :data:`OTHER_SENSORS`, in this order."""

    __slots__ = ()

    @property
    def name(self) -> str:
        """The name in tables, such as ``"keypoints+scanner"``."""
        return "+".join(self)

    @property
    def kind(self) -> str:
        """The name of the camera; empty without one."""
        return self[0] if self[0] in CAMERAS else ""

    @property
    def is_a_set(self) -> bool:
        """True if they go together: one camera that is not the truth, and others."""
        return self[0] not in _TRUTHS and not set(self[1:]) & set(CAMERAS)

    @property
    def sensors(self) -> str:
        """The list of sensors: with the kind, what :meth:`of` takes."""
        return "+".join(_CAMERA if each in (*_KINDS, ORACLE) else each for each in self)

    @property
    def options(self) -> str:
        """The options of ``awarenav crossings``, such as ``"--perception keypoints …"``."""
        if self.kind == ORACLE:
            return f"--policy {ORACLE}"
        kind = f"--perception {self.kind} " if self.kind in _KINDS else ""
        return f"{kind}--sensors {self.sensors}"

    @classmethod
    def named(cls, name: str) -> Perception:
        """Return the perception of a name in tables; raise SimError for another name."""
        parts = set(name.split("+"))
        found = cls(each for each in (*CAMERAS, *OTHER_SENSORS) if each in parts)
        if name and found.name == name and (found[1:] == () or found.is_a_set):
            return found
        seen = [each for each in CAMERAS if each not in _TRUTHS]
        both = [f"{camera}+{other}" for camera in seen for other in OTHER_SENSORS]
        names = (*_KINDS, *(each for each in seen if each not in _KINDS), *both, *OTHER_SENSORS)
        raise SimError(not_one_of("perception", name, names))

    @classmethod
    def of(cls, kind: str, sensors: str) -> Perception:
        """Return the perception of a kind with a list of sensors.

        Args:
            kind: one of :data:`PerceptionKind`.
            sensors: names joined by ``+``, of which ``"camera"`` is the camera of this kind.

        Raises:
            SimError: for other names, for two cameras, and for the truth with another sensor.
        """
        if kind not in _KINDS:
            raise SimError(not_one_of("perception", kind, _KINDS))
        own = [each for each in CAMERAS if each not in (*_KINDS, ORACLE)]
        for each in sensors.split("+"):
            if each not in (known := (_CAMERA, *own, *OTHER_SENSORS)):
                raise SimError(not_one_of("sensors", each, known, or_else="several joined by '+'"))
        if kind in _TRUTHS and sensors != _CAMERA:
            raise SimError(
                f"perception {kind!r} has no use for other sensors: sensors must be 'camera', got "
                f"{sensors!r}; or perception must be 'keypoints' or 'pixels'"
            )
        parts = [kind if each == _CAMERA else each for each in sensors.split("+")]
        found = cls(each for each in (*CAMERAS, *OTHER_SENSORS) if each in parts)
        if len(found) < len(parts) or not (found[1:] == () or found.is_a_set):
            raise SimError(f"sensors must be one camera and others, each once, got {sensors!r}")
        return found


class AxisOption(NamedTuple):
    """An option of the command line that gives an axis its value.

    Attributes:
        settings: of :func:`awarenav.cli.option`, for one value.
        several: settings that differ for several values to compare; None where there are never
            several.
    """

    settings: Mapping[str, Any]
    several: Mapping[str, Any] | None = None


def _axis(
    meaning: str,
    *,
    several: Mapping[str, Any] | None = None,
    also: Mapping[str, AxisOption] | None = None,
    empty: bool = False,
    changes_scenario: bool = False,
    **option: Any,
) -> Any:
    """Return a field of the conditions.

    Args:
        meaning: of its column in ``episodes.csv``.
        several: as for :class:`AxisOption`.
        also: further options that the value is made of, by name.
        empty: the value may be empty, and a table may lack the column.
        changes_scenario: the value is given to ``with_NAME`` of the scenario.
        option: settings of the option of the same name, for one value.
    """
    about = {
        "meaning": meaning,
        "option": AxisOption(option, several),
        "also": also or {},
        "changes_scenario": changes_scenario,
    }
    return field(default="" if empty else MISSING, metadata=about)


def _without_reference(context: Any, parameter: Any, value: Any) -> Any:
    """Return the value of ``--planner`` with '' for 'reference'."""
    if isinstance(value, tuple):
        return tuple("" if each == REFERENCE_PLANNER else each for each in value)
    return "" if value == REFERENCE_PLANNER else value


@dataclass(frozen=True, slots=True)
class Conditions:
    """The conditions of one episode, each by its name in tables.

    Jobs have these fields, tables these columns. The metadata of a field
    are those of :func:`_axis`.
    """

    scenario: str = _axis(
        "Name of the scenario.",
        help="A shipped scenario, or a YAML file.",
        metavar="NAME|FILE",
        shell_complete=COMPLETE_SCENARIOS,
        several={
            "help": "Scenarios: shipped ones, YAML files, or a set of shipped ones that have a "
            f"planner: {SETS_TEXT}.",
            "default": ["all"],
        },
    )
    seed: int = _axis(
        "Of the episode.",
        help="Seed of the random numbers.",
        type=Whole(0),
        default=0,
        metavar="N",
    )
    policy: str = _axis(
        "Name of the policy.",
        help="Policy: a preset, or a YAML file.",
        default="balanced",
        metavar="NAME|FILE",
        shell_complete=COMPLETE_SIMULATED_POLICIES,
        several={
            "help": "Policies: presets, 'scanner' (today's AMR), 'scanner_warning' (the same with "
            "a warning field), YAML files, or 'oracle' (balanced with true awareness).",
            "default": ["balanced"],
            "shell_complete": completion_of(
                "nav_adapter", "policies", "scanner", "scanner_warning", ORACLE
            ),
        },
    )
    planner: str = _axis(
        "Name of the planner.",
        help="Local planner: 'reference' (it plans with the limit there and then), "
        "'costmap' (that of today's AMR), 'straight_on', 'ros2' (a stack outside, such as your "
        "Nav2), or a class of your own, which gets the robot's profile, and static_boxes_odom_m if "
        "it accepts it.",
        default=REFERENCE_PLANNER,
        metavar="MODULE:CLASS",
        callback=_without_reference,
        several={"default": [REFERENCE_PLANNER]},
    )
    perception: str = _axis(
        'Names of the sensors, joined by ``+``: ``"truth"``, ``"keypoints"``, ``"pixels"`` or '
        '``"depth"``, and ``"scanner"``.',
        help="How the robot perceives people.",
        type=OneOf(_KINDS),
        default="keypoints",
        also={
            "sensors": AxisOption(
                {
                    "help": "Sensors of the robot, joined by '+': its camera, or a camera that "
                    "measures depth, and its laser scanners; such as 'camera+scanner'. With "
                    "scanners, --perception is keypoints or pixels.",
                    "metavar": "NAME[+NAME...]",
                    "shell_complete": completion_of(
                        "sim_tests", "crossing/sensors", _CAMERA, "depth", *OTHER_SENSORS
                    ),
                    "default": _CAMERA,
                },
                several={"default": [_CAMERA], "note": " Several lists are compared."},
            )
        },
    )
    camera: str = _axis(
        "Name of another camera on the robot, empty for the scenario's own.",
        empty=True,
        changes_scenario=True,
        help="Another camera on the robot: 'forward' (120 degrees, as in the shipped scenarios), "
        "'surround' (360 degrees), or a YAML file.",
        default="",
        show_default="each scenario's own",
        metavar="NAME|FILE",
        shell_complete=completion_of("sim_tests", "scenario/shipped/cameras"),
    )
    networks: str = _axis(
        "Name of the set or file of other networks, empty for the shipped ones.",
        empty=True,
        changes_scenario=True,
        help="Other networks for --perception pixels: as for --networks of awarenav estimate.",
        default="",
        show_default="the shipped ones",
        metavar="SET|FILE",
    )
    robot: str = _axis(
        "Name of another robot, empty for the scenario's own.",
        empty=True,
        changes_scenario=True,
        help="Another robot: 'forklift' (it steers), 'omni' (it moves sideways), 'delivery' "
        "(small), or a YAML file. The scenarios are fitted to it in space and time.",
        default="",
        show_default="nova_carter",
        metavar="NAME|FILE",
        shell_complete=completion_of("sim_tests", "actors/robot/shipped", "nova_carter"),
    )
    population: str = _axis(
        "Habits of the people, empty for the scenario's own.",
        empty=True,
        changes_scenario=True,
        help="Habits of the people: 'classic', or 'recorded' as fitted to recorded people; and how "
        "they hear a request for attention: 'answers=0.3', or "
        "'recorded,answers=0.8,startles=0.2'.",
        type=WordAndNumbers(POPULATIONS),
        default=None,
        show_default="each scenario's own",
        metavar="NAME|KEY=VALUE,...",
        several={"note": " Several are compared."},
    )
    fault: str = _axis(
        "Name of the fault, empty for none.",
        empty=True,
        help="Fault: a shipped one, a YAML file, several joined by '+', or 'none'.",
        default=NO_FAULT,
        metavar="NAME|FILE",
        shell_complete=completion_of("sim_tests", "crossing/faults", "none"),
        several={
            "help": "Faults: shipped ones, YAML files, several joined by '+', or 'none'; every "
            "combination runs with each. 'scanner_*' stands for all shipped ones that fit.",
            "default": [NO_FAULT],
        },
    )

    @property
    def conditions(self) -> Conditions:
        """The conditions alone, of a job that has more: the key of its episode."""
        return Conditions(**{name: getattr(self, name) for name in AXES})

    @property
    def text(self) -> str:
        """The conditions in words; those that are empty are left out."""
        named = {"scenario": ""}
        words = [
            f"{named.get(name, f'{name} ')}{planner_name(value) if name == 'planner' else value}"
            for name in AXES
            if (value := getattr(self, name)) != ""
        ]
        return ", ".join(words)


#: Names of the axes, in the order of the columns of tables.
AXES: Final = tuple(each.name for each in fields(Conditions))
#: Options of the command line by name, in the order of the help.
OPTIONS: Final[dict[str, AxisOption]] = {
    name: each
    for axis in sorted(fields(Conditions), key=lambda axis: axis.name == "seed")
    for name, each in {axis.name: axis.metadata["option"], **axis.metadata["also"]}.items()
}
#: Options that may have several values, which a command's episodes combine.
COMBINED: Final = tuple(name for name, each in OPTIONS.items() if each.several is not None)
_CHANGES: Final = tuple(
    each.name for each in fields(Conditions) if each.metadata["changes_scenario"]
)


def changed_scenario(scenario: _ScenarioT, values: Mapping[str, Any]) -> _ScenarioT:
    """Return a scenario as the axes among some values change it.

    Args:
        scenario: one with a method ``with_NAME`` for each of these axes.
        values: by the name of the axis; None and empty ones change nothing.
    """
    for name in _CHANGES:
        if values.get(name) not in (None, ""):
            scenario = getattr(scenario, f"with_{name}")(values[name])
    return scenario


def refuse_unused_networks(values: Mapping[str, Any], kind: str) -> None:
    """Raise SimError if there are networks among the values of axes, and no pictures for them."""
    if values.get("networks") and kind != "pixels":
        raise SimError(
            f"networks see pictures: they need perception 'pixels', got {kind or _SCANNER!r}"
        )


def planner_name(in_table: str) -> str:
    """Return the name of a planner on the command line, from that in tables of episodes."""
    return REFERENCE_PLANNER if in_table == REFERENCE_IN_TABLES else in_table


def table_name(value: Any) -> str:
    """Return the name in tables of the value of an axis: a file's is that of its stem."""
    path = Path(str(value or ""))
    return path.stem if path.suffix in (".yaml", ".yml") else str(value or "")


def conditions_options(
    *,
    many: Sequence[str] = (),
    without: Sequence[str] = (),
    repeated: bool = False,
    **changes: Mapping[str, Any],
) -> Callable[[Any], Any]:
    """Return a decorator that adds the options of all axes to a command.

    Args:
        many: options that take several values.
        without: options that the command does not have.
        repeated: each of several values needs the option before it, as beside positional arguments.
        changes: other settings of an option, by its name; ``note`` is added to the help.
    """

    def decorate(function: Any) -> Any:
        for name, each in reversed(OPTIONS.items()):
            if name in without:
                continue
            settings = dict(each.settings)
            if name in many:
                settings |= {**(each.several or {}), "multiple" if repeated else "many": True}
                if repeated:
                    settings["help"] += " May be given more than once."
                elif "metavar" in settings:
                    settings["metavar"] += "..."
            settings |= changes.get(name, {})
            settings["help"] += settings.pop("note", "")
            function = option(f"--{name}", **settings)(function)
        return function

    return decorate


@dataclass(frozen=True, slots=True)
class Experiment:
    """The values that the options of a command give to the axes: one, or several to compare.

    Attributes:
        values: by the name of the option; a tuple where :data:`COMBINED` has the option.
        episodes: number of seeds; ``seed`` is the first.
    """

    values: Mapping[str, Any]
    episodes: int = 1

    @classmethod
    def taken_from(cls, values: dict[str, Any]) -> Experiment:
        """Return the experiment among the options of a command, and take them out of these."""
        episodes = values.pop("episodes", 1)
        found = {name: values.pop(name) for name in OPTIONS if name in values}
        if not found.get("sensors", True):  # not given, in a command with USUAL_SENSORS
            found["sensors"] = "camera" if found.get("perception") in _TRUTHS else "camera+scanner"
        return cls({}, episodes).replaced(**found)

    def replaced(self, **values: Any) -> Experiment:
        """Return the same experiment with other values."""
        tuples = {
            name: (value,) if name in COMBINED and isinstance(value, str) else value
            for name, value in values.items()
        }
        return Experiment({**self.values, **tuples}, self.episodes)

    def __getitem__(self, name: str) -> Any:
        """Return the value of an option, or the values of one in :data:`COMBINED`."""
        if name in self.values:
            return self.values[name]
        usual = OPTIONS[name].settings["default"]
        return ("" if usual == REFERENCE_PLANNER else usual,) if name in COMBINED else usual

    def one(self, name: str) -> Any:
        """Return the value of an option that has a single one."""
        value = self[name]
        if not isinstance(value, tuple):
            return value
        (only,) = value or (None,)
        return only

    @property
    def changes(self) -> dict[str, Any]:
        """The values of the axes that change scenarios; empty ones keep the scenario's own."""
        return {name: self.one(name) or "" for name in _CHANGES}

    def settings(self, **more: Any) -> dict[str, Any]:
        """Return the values as they are given on the command line.

        Without those that are None or empty. Commands differ in their usual sensors: these are
        always said.
        """
        found = {**self.values, "sensors": self["sensors"], "episodes": self.episodes, **more}
        if "planner" in found:
            found["planner"] = [each or REFERENCE_PLANNER for each in found["planner"]]
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in found.items()
            if value not in (None, "", ())
        }


def option_words(settings: Mapping[str, Any]) -> list[str]:
    """Return the words of a command line that give options these values, each after its name."""
    return [
        word
        for name, value in settings.items()
        for each in (value if isinstance(value, list) else [value])
        for word in (f"--{name}", f"{each}")
    ]
