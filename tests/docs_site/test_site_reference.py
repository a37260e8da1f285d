"""The generated reference names every key, option, column, topic and public name."""

from __future__ import annotations

import importlib
import re
import sys

import click
import pytest
from paths import ROOT

pytest.importorskip("griffe", reason="the reference is made with the extra docs")
pytest.importorskip("pybullet", reason="the reference covers scenarios (extra sim)")
sys.path.insert(0, str(ROOT))

from awarenav.cli import app
from nav_adapter.ros2 import MASK_TOPICS, PUBLISHED, READ
from sim_tests.study.measures import METRICS, RECORD_COLUMNS, SHARES
from tools.docs_site import reference
from tools.docs_site.api_pages import PACKAGES
from tools.docs_site.config_pages import attribute_meanings, unit_of
from tools.docs_site.roles import linked, plain

PAGES = reference.pages()


def rows_of(page: str) -> dict[str, list[str]]:
    """The cells of every table row that begins with a name in code; later rows replace."""
    rows = re.findall(r"^\| `([^`]+)` \| (.*) \|$", PAGES[page], re.MULTILINE)
    return {name: re.split(r" (?<!\\)\| ", cells) for name, cells in rows}


@pytest.mark.parametrize("name", reference.CONFIG_PAGES)
def test_every_key_of_a_file_has_a_row_with_its_meaning(name: str) -> None:
    page = reference.CONFIG_PAGES[name]
    models = [model for _, model in page.models()]
    assert page.model in models
    rows = rows_of(f"reference/{name}.md")
    for model in models:
        meanings = attribute_meanings(model)
        for key in model.model_fields:
            assert key in rows, f"{model.__name__}.{key}"
            assert meanings.get(key), f"{model.__name__}.{key} has no docstring"


def test_rows_give_unit_range_default_and_choices() -> None:
    policy = rows_of("reference/policy-keys.md")
    assert policy["clearance_m"][:2] == ["number in [0.1, 2]; m", "`0.1`"]
    assert policy["lost_rise_mps2"][:2] == ["number or null in (0, 10]; m/s²", "`0.7`"]
    assert "[InterpolatedInflation](#interpolatedinflation)" in policy["inflation"][0]
    scenario = rows_of("reference/scenario-keys.md")
    assert scenario["attention"][:2] == ["`attentive` or `unaware` or `mixed`", "`mixed`"]
    assert scenario["duration_s"][:2] == ["number in (0, 600]; s", "required"]
    assert scenario["people"][0] == "list of [PersonSpec](#personspec)"
    assert unit_of("new_clock_after_s") == "s"
    assert unit_of("score") == ""


def commands(command: click.Command, path: str) -> dict[str, click.Command]:
    """All commands below one, by their words."""
    found = {path: command}
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None
            found |= commands(below, f"{path} {name}")
    return found


def test_every_command_and_option_is_listed_under_its_heading() -> None:
    sections = dict(
        re.findall(
            r"^#+ (awarenav .*)\n((?:(?!^#).*\n?)*)",
            PAGES["reference/commands.md"],
            re.MULTILINE,
        )
    )
    listed = {path: each for path, each in commands(app, "awarenav").items() if path != "awarenav"}
    assert len(listed) > 20
    assert sections.keys() == listed.keys()
    for path, command in listed.items():
        for parameter in command.params:
            if isinstance(parameter, click.Option) and not parameter.hidden:
                assert parameter.opts[0] in sections[path], f"{path} {parameter.opts[0]}"


def test_every_metric_column_and_topic_is_listed() -> None:
    metrics = rows_of("reference/metrics.md")
    assert {*RECORD_COLUMNS, *METRICS, *SHARES} <= metrics.keys()
    assert metrics["time_lost_s"][0] == "s"
    topics = rows_of("reference/topics.md")
    known = (*PUBLISHED.values(), *MASK_TOPICS.values(), *READ.values())
    assert {f"/{each.name}" for each in known} == topics.keys()
    assert topics["/speed_limit"] == ["`nav2_msgs/SpeedLimit`", "reliable", "volatile", "10"]


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_has_a_page_with_its_public_names(package: str) -> None:
    names = importlib.import_module(package).__all__
    assert f"members: [{', '.join(names)}]" in PAGES[f"reference/{package}.md"]
    assert f"reference/{package}.md" in (ROOT / "mkdocs.yml").read_text("utf-8")


def test_the_front_door_leads_to_the_page_of_each_name() -> None:
    rows = rows_of("reference/awarenav.md")
    assert rows["awarenav.NavAdapter"] == ["[nav_adapter](nav_adapter.md#nav_adapter.NavAdapter)"]
    awarenav = importlib.import_module("awarenav")
    assert rows.keys() == {f"awarenav.{name}" for name in awarenav.__all__}


def test_references_of_docstrings_become_links_or_code() -> None:
    text = "See :class:`~perception.Camera` and :func:`max_speed_mps`::\n\n    code\n"
    assert plain(":meth:`~a.B.c` and :data:`D`") == "`c` and `D`"
    assert linked(text, "nav_adapter") == (
        'See <autoref identifier="perception.Camera" optional><code>Camera</code></autoref> and '
        '<autoref identifier="nav_adapter.max_speed_mps" optional><code>max_speed_mps</code>'
        "</autoref>:\n\n    code\n"
    )
