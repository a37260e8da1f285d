"""docs/nav2.md and its files agree with the code."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any, get_args, get_type_hints

import yaml
from paths import ROOT

from awarenav.bridge.command import bridge
from nav_adapter import Alert, NavConstraints
from nav_adapter.alerts import Answer
from nav_adapter.ros2 import MASK_TOPICS, PUBLISHED, READ, SLOWEST_MPS, RobotFile, Topic, alerts
from nav_adapter.ros2.messages import ros_type

DOCS = ROOT / "docs"
TEXT = (DOCS / "nav2.md").read_text(encoding="utf-8")


def row(topic: Topic) -> tuple[str, str, str]:
    reliability = "reliable" if topic.reliable else "best effort"
    durability = "transient local" if topic.transient_local else "volatile"
    kind = ros_type(topic.message).replace("/msg/", "/")
    return f"/{topic.name}", kind, f"{reliability}, {durability}, {topic.depth}"


def test_the_table_of_topics_agrees_with_the_code() -> None:
    found = re.findall(r"^\| `(/\S+)`[^|]*\| `(\S+)` \| ([^|]+?) \|", TEXT, re.MULTILINE)
    known = (*PUBLISHED.values(), *MASK_TOPICS.values(), *READ.values())
    assert found == [row(topic) for topic in known]


def test_nav2_reads_the_published_topics() -> None:
    parameters = yaml.safe_load((DOCS / "nav2" / "nav2_params.yaml").read_text())
    names = {f"/{topic.name}": topic for topic in PUBLISHED.values()}
    controller = parameters["controller_server"]["ros__parameters"]
    costmap = parameters["local_costmap"]["local_costmap"]["ros__parameters"]
    monitor = parameters["collision_monitor"]["ros__parameters"]
    assert f"/{controller['speed_limit_topic']}" in names
    people = costmap[costmap["plugins"][0]]
    assert names[people["map_topic"]].message.__name__ == "OccupancyGrid"
    assert names[people["map_topic"]].transient_local == people["map_subscribe_transient_local"]
    # Nav2's static layer reads these from the costmap, and ignores them under its own name.
    assert costmap["use_maximum"] is True
    assert not {"use_maximum", "transform_tolerance"} & set(people)
    (source,) = monitor["observation_sources"]
    assert names[monitor[source]["topic"]].message.__name__ == "PolygonInstanceStamped"
    (zone,) = monitor["polygons"]
    assert names[monitor[zone]["polygon_sub_topic"]].message.__name__ == "PolygonStamped"
    # Silence must stop the robot, and the default rate must not count as silence.
    assert 2.0 / _default("rate") < monitor["source_timeout"] <= 1.0
    robot = RobotFile.from_yaml(DOCS / "nav2" / "robot.yaml")
    assert controller["FollowPath"]["vx_max"] == robot.max_speed_mps
    assert -controller["FollowPath"]["ax_min"] == robot.max_deceleration_mps2
    assert str(SLOWEST_MPS) in TEXT


def test_alerts_have_the_documented_names() -> None:
    kinds = get_args(get_type_hints(Alert)["kind"])
    means = {kind: "voice" if kind == "attention" else kind for kind in kinds}
    given = tuple(Alert(1, kind, 1.0, 0.0, "why", means=means[kind]) for kind in kinds)
    answers = (Answer(1, 0.9),)
    message = alerts(NavConstraints(0.0, (), 0.0, "why", False, alerts=given, answers=answers))
    assert [status.name for status in message.status if f"`{status.name}`" not in TEXT] == []


def test_the_launch_file_starts_an_existing_command() -> None:
    launch = yaml.safe_load((DOCS / "nav2" / "awarenav.launch.yaml").read_text())["launch"]
    (program,) = [entry["executable"] for entry in launch if "executable" in entry]
    defaults = {entry["arg"]["name"]: entry["arg"]["default"] for entry in launch if "arg" in entry}
    command = re.sub(r"\$\(var (\w+)\)", lambda match: defaults[match[1]], program["cmd"])
    name, *words = shlex.split(command)[1:]
    assert name == "bridge"
    assert _options(words)["robot"] == Path("robot.yaml")


def _default(name: str) -> Any:
    return _options(["--robot", "x"])[name]


def _options(words: list[str]) -> dict[str, Any]:
    with bridge.make_context("bridge", words) as context:
        return context.params
