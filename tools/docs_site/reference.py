"""The generated pages of the site's reference: Python, commands, settings, metrics, topics.

mkdocstrings documents packages, mkdocs-click the commands and griffe-pydantic the settings; the
pages here name what they shall show. Metrics and topics are tables of their registries.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, Final, get_args

from pydantic import BaseModel

from awarenav.files import markdown_table
from nav_adapter import AwarenessPolicy, InflationPolicy, SpeedPolicy
from nav_adapter.policies import InterpolatedHumanSpeed, InterpolatedInflation
from nav_adapter.ros2 import MASK_TOPICS, PUBLISHED, READ, RobotFile, Topic
from nav_adapter.ros2.messages import ros_type
from sim_tests.crossing.faults import FAULT_KINDS, Fault, SensorFault
from sim_tests.dataset import RenderConfig
from sim_tests.scenario import Scenario
from sim_tests.study.measures import COLUMNS, METRICS, RATIOS, SHARES, Metric
from tracking import TrackerConfig

from .roles import plain

#: Packages with a page of their own.
PACKAGES: Final = (
    "perception",
    "perception.laser",
    "perception.surround",
    "perception.networks",
    "tracking",
    "nav_adapter",
    "nav_adapter.alerts",
    "nav_adapter.policies",
    "nav_adapter.exporters",
    "nav_adapter.ros2",
    "sim_tests",
)
#: Names that a user meets first, and that begin the page of their package.
FIRST: Final = (
    "NavAdapter",
    "PersonTracker",
    "AwarenessPipeline",
    "AwarenessPolicy",
    "RobotProfile",
    "RobotState",
    "NavConstraints",
    "PersonObstacle",
    "TrackerConfig",
    "PersonTrack",
    "Camera",
    "PersonObservation",
    "run_crossing",
)
_INDEX: Final = """# Reference

Everything here is made from the code of this version. From an image to a speed limit you need three
classes: [AwarenessPipeline](perception.md#perception.AwarenessPipeline),
[PersonTracker](tracking.md#tracking.PersonTracker) and
[NavAdapter](nav_adapter.md#nav_adapter.NavAdapter).

- **Python**: [perception](perception.md) (with [laser](perception.laser.md),
  [surround](perception.surround.md), [networks](perception.networks.md)),
  [tracking](tracking.md), [nav_adapter](nav_adapter.md) (with
  [alerts](nav_adapter.alerts.md), [policies](nav_adapter.policies.md),
  [exporters](nav_adapter.exporters.md), [ros2](nav_adapter.ros2.md)), [awarenav](awarenav.md),
  [sim_tests](sim_tests.md)
- **[Commands](commands.md)** of `awarenav`, with every option
- **Files**: keys of a [policy](policy-keys.md), a [scenario](scenario-keys.md), a
  [tracker](tracker-keys.md), a [fault](fault-keys.md), the [bridge's robot](robot-keys.md)
  and [rendered sets](render-keys.md)
- **[Metrics](../metrics.md)** and columns of `episodes.csv`
- **[ROS 2 topics](topics.md)** of the bridge
"""
_COMMANDS: Final = """# Commands

Each command as `awarenav COMMAND --help` prints it. A mistyped command, option or name gets a
suggestion. The exit status is 0 for success, 1 when a check failed or part of the work could not
be done, 2 for bad input, and 130 when interrupted.

::: mkdocs-click
    :module: awarenav.cli
    :command: app
    :prog_name: awarenav
    :depth: 1
"""
_PACKAGE: Final = """# {package}

::: {package}
    options:
      group_by_category: false
      members: [{names}]
"""
_FRONT_DOOR: Final = """# awarenav

{about}

The main names of three packages, imported when they are first used.

| name | documented on |
| --- | --- |
{rows}
"""
_KEYS: Final = """The suffix of a key is its unit. An unknown key is refused with the nearest valid
one. A key that is left out has its default; "null" stands for None in YAML."""
_MODEL: Final = """::: {path}
    options:
      extensions: [griffe_pydantic]
      heading_level: 3
      show_bases: false
      show_if_no_docstring: true
      inherited_members: true
      members: [{names}]
"""
_METRICS: Final = """# Metrics

The columns that `awarenav crossings` writes and `awarenav compare` prints, from the code that
defines them. An empty cell means that a figure does not apply, which is never the same as 0."""
_TOPICS: Final = """# ROS 2 topics

The topics of `awarenav bridge` with their types and quality of service, from the code that opens
them. [Nav2 and ROS 2](../nav2.md) says who reads which, and how to set up each reader. `--rename`
and the other options of [`awarenav bridge`](commands.md#awarenav-bridge) change names."""
_BETTER: Final = {"lower": "lower", "higher": "higher", "neither": "–"}
#: Suffix of a name, and the unit that it stands for.
_UNITS: Final = {
    "m": "m",
    "mps": "m/s",
    "mps2": "m/s²",
    "mps3": "m/s³",
    "rad": "rad",
    "deg": "°",
    "s": "s",
    "hz": "Hz",
}


@dataclass(frozen=True)
class SettingsPage:
    """A page of the keys of a file.

    Attributes:
        title: heading of the page.
        intro: Markdown before the first model.
        model: the model of the whole file.
        alternatives: for a protocol that a key names, the models that a file can give.
    """

    title: str
    intro: str
    model: type[BaseModel]
    alternatives: Mapping[type, tuple[type[BaseModel], ...]] = field(default_factory=dict)

    def markdown(self, name: str, homes: dict[type[BaseModel], str]) -> str:
        """Return the page: each model below the path of the first key that holds it.

        Args:
            name: of the page.
            homes: pages of models that other pages show, which get a link here; this page's own
                are added.
        """
        parts = [f"# {self.title}\n\n{self.intro} {_KEYS}\n"]
        for path, model in self.models():
            anchor = model.__name__.lower()
            heading = f"{path}: {model.__name__}" if path else "The file"
            parts.append(f"## {heading} {{ #{anchor} }}\n")
            home = homes.setdefault(model, name)
            if home != name:
                parts.append(f"See [{model.__name__}]({home}.md#{anchor}).\n")
                continue
            dotted = f"{model.__module__}.{model.__qualname__}"
            parts.append(_MODEL.format(path=dotted, names=", ".join(model.model_fields)))
        return "\n".join(parts)

    def models(self) -> Iterator[tuple[str, type[BaseModel]]]:
        """Yield every model once, with the path of the first key that holds it.

        A model with a ``key`` names its own.
        """
        seen: set[type[BaseModel]] = set()
        waiting: list[tuple[str, type[BaseModel]]] = [("", self.model)]
        while waiting:
            path, model = waiting.pop(0)
            if model in seen:
                continue
            seen.add(model)
            yield path, model
            inside = [
                (getattr(found, "key", "") or (f"{path}.{name}" if path else name), found)
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


SETTINGS_PAGES: Final = {
    "policy-keys": SettingsPage(
        "Policy keys",
        "The keys of a policy's file, for [policies](../policies.md).",
        AwarenessPolicy,
        {InflationPolicy: (InterpolatedInflation,), SpeedPolicy: (InterpolatedHumanSpeed,)},
    ),
    "scenario-keys": SettingsPage(
        "Scenario keys",
        "The keys of a scenario's file. Any number under `people` and `robot` may be a "
        "distribution.",
        Scenario,
    ),
    "tracker-keys": SettingsPage(
        "Tracker keys", "Settings of the tracker, for [tracking](../tracking.md).", TrackerConfig
    ),
    "fault-keys": SettingsPage(
        "Fault keys",
        "The keys of a fault's file. A heading below names the mapping that holds the keys; those "
        "under `faults` stand in the file itself, those of scanners below `scanner`.",
        Fault,
        {SensorFault: FAULT_KINDS},
    ),
    "robot-keys": SettingsPage(
        "Robot file of the bridge",
        "The file that `awarenav bridge --robot` reads, for [Nav2](../nav2.md).",
        RobotFile,
    ),
    "render-keys": SettingsPage(
        "Settings of rendered sets", "The settings of `awarenav render`.", RenderConfig
    ),
}


def pages() -> dict[str, str]:
    """Return the Markdown of every generated page of the reference, by its path on the site."""
    homes: dict[type[BaseModel], str] = {}
    settings = {
        f"reference/{name}.md": page.markdown(name, homes) for name, page in SETTINGS_PAGES.items()
    }
    return {
        "reference/index.md": _INDEX,
        **{f"reference/{package}.md": package_page(package) for package in PACKAGES},
        "reference/awarenav.md": front_door_page(),
        "reference/commands.md": _COMMANDS,
        **settings,
        "metrics.md": metrics_page(),
        "reference/topics.md": topics_page(),
    }


def package_page(package: str) -> str:
    """Return the page of a package, with every name of its ``__all__``."""
    names = first_names_first(import_module(package).__all__)
    return _PACKAGE.format(package=package, names=", ".join(names))


def first_names_first(names: Iterable[str]) -> list[str]:
    """Return names with those of ``FIRST`` before the others, which keep their order."""
    return sorted(names, key=lambda name: FIRST.index(name) if name in FIRST else len(FIRST))


def front_door_page() -> str:
    """Return the page of ``awarenav``, whose names are those of other packages."""
    front = import_module("awarenav")
    homes = {
        name: package for package in reversed(PACKAGES) for name in import_module(package).__all__
    }
    rows = []
    for name in first_names_first(front.__all__):
        home = homes.get(name)
        where = f"[{home}]({home}.md#{home}.{name})" if home else "the base of every error"
        rows.append(f"| `awarenav.{name}` | {where} |")
    about = (front.__doc__ or "").partition("\n\n")[0]
    return _FRONT_DOOR.format(about=about, rows="\n".join(rows))


def metrics_page() -> str:
    """Return the page of metrics and columns."""
    columns = [[f"`{n}`", unit_of(n), _cell(plain(each.meaning))] for n, each in COLUMNS.items()]
    return "\n\n".join(
        [
            _METRICS,
            "## Shares of episodes",
            _metric_table(SHARES),
            "## Means over episodes",
            _metric_table(METRICS),
            "## Ratios of sums over episodes",
            _metric_table({name: ratio.metric for name, ratio in RATIOS.items()}),
            "## Columns of episodes.csv",
            markdown_table(("column", "unit", "meaning"), columns) + "\n",
        ]
    )


def topics_page() -> str:
    """Return the page of topics."""
    return "\n\n".join(
        [
            _TOPICS,
            "## Published",
            _topic_table(PUBLISHED.values()),
            "## Published with `--speed-mask`",
            _topic_table(MASK_TOPICS.values()),
            "## Read",
            _topic_table(READ.values()) + "\n",
        ]
    )


def unit_of(name: str) -> str:
    """Return the unit that the suffix of a name stands for; empty for none."""
    _, underscore, suffix = name.rpartition("_")
    return _UNITS.get(suffix, "") if underscore else ""


def _metric_table(metrics: Mapping[str, Metric]) -> str:
    rows = (
        [f"`{name}`", each.title, each.unit, _BETTER[each.better], _cell(each.meaning)]
        for name, each in metrics.items()
    )
    return markdown_table(("metric", "title", "unit", "better", "meaning"), rows)


def _topic_table(topics: Iterable[Topic]) -> str:
    rows = (
        [
            *(f"`/{each.name}`", f"`{ros_type(each.message).replace('/msg/', '/')}`"),
            "reliable" if each.reliable else "best effort",
            "transient local" if each.transient_local else "volatile",
            str(each.depth),
        ]
        for each in topics
    )
    return markdown_table(("topic", "type", "reliability", "durability", "depth"), rows)


def _cell(text: str) -> str:
    """Return text for one cell of a table."""
    return " ".join(text.split())
