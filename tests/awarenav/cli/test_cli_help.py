"""The help: what it says, and how little it imports."""

from __future__ import annotations

import json
import re
import shlex

import click
import pytest
from command_line import COMMANDS, GROUPS, options_of, run_python

import awarenav
from awarenav.cli import Command, app, main

HEAVY = ("cv2", "matplotlib", "numpy", "onnxruntime", "pybullet", "pydantic", "scipy", "shapely")
PRINT_MODULES = """
import json, sys
from awarenav.cli import main
status = main(sys.argv[1:])
print(json.dumps(sorted(sys.modules)), file=sys.stderr)
sys.exit(status)
"""


def help_of(path, capsys):
    assert main([*path, "--help"]) == 0
    return capsys.readouterr().out


def test_the_list_of_commands_is_grouped(capsys):
    sections = re.split(r"^(\S.*):$", help_of([], capsys), flags=re.MULTILINE)
    listed = {
        heading: re.findall(r"^  (\w+)  ", text, re.MULTILINE)
        for heading, text in zip(sections[1::2], sections[2::2], strict=True)
    }
    assert {heading: listed[heading] for heading in GROUPS} == GROUPS


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_help_says_what_a_command_and_each_of_its_options_does(path, capsys):
    text = help_of(path, capsys)
    assert text.startswith(f"Usage: awarenav {' '.join(path)} ")
    command = COMMANDS[path]
    assert command.help
    for parameter in command.params:
        assert parameter.help, f"{parameter.name} has no help"
        assert parameter.help.endswith(".")
        for name in getattr(parameter, "opts", []) if isinstance(parameter, click.Option) else []:
            assert name in text
    if not isinstance(command, click.Group):
        assert "Examples:\n  " in text
        assert "Exit status:\n  0 " in text
    assert 'default: ""' not in text


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_the_examples_in_the_help_can_be_parsed(path):
    command = COMMANDS[path]
    for example in command.examples if isinstance(command, Command) else ():
        words = shlex.split(example.split(" > ")[0], comments=True)
        if words[0] != "awarenav":
            continue
        called = next(each for each in (tuple(words[1:3]), tuple(words[1:2])) if each in COMMANDS)
        with COMMANDS[called].make_context(called[-1], words[1 + len(called) :]):
            pass


def imported(*arguments):
    """Return the modules that are loaded after a command line."""
    done = run_python(PRINT_MODULES, *arguments)
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stderr.splitlines()[-1]))


def ours(modules):
    return {each for each in modules if each.split(".")[0] in ("awarenav", "sim_tests")}


@pytest.fixture(scope="module")
def light():
    """The modules that the list of commands needs."""
    modules = imported("--help")
    assert modules.isdisjoint(HEAVY)
    assert not [each for each in modules if each.endswith(".command")]
    assert not [each for each in modules if each.split(".")[0] == "sim_tests"]
    return ours(modules)


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_help_of_a_command_imports_that_command_and_no_other(path, light):
    modules = imported(*path, "--help")
    assert modules.isdisjoint(HEAVY)
    home = COMMANDS[path].callback.__module__
    parents = {home.rsplit(".", depth)[0] for depth in range(home.count(".") + 1)}
    # A page may use the function that makes it lazy, and the check for a foreign package.
    assert ours(modules) - light <= parents


def test_the_version_is_printed_and_imports_no_command(capsys, light):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"awarenav {awarenav.__version__}\n"
    modules = imported("--version")
    assert modules.isdisjoint(HEAVY)
    assert ours(modules) <= light


@pytest.mark.parametrize("words", [[], ["models"], ["policy"], ["scenario"]], ids=str)
def test_no_arguments_print_the_help_and_are_bad_input(words, capsys):
    assert main(words) == 2
    printed = capsys.readouterr().out
    assert main([*words, "--help"]) == 0
    assert printed == capsys.readouterr().out


def test_nested_commands_are_listed_in_a_useful_order(capsys):
    text = help_of(["models"], capsys)
    assert re.findall(r"^  (list|verify|fetch) ", text, re.MULTILINE) == ["list", "verify", "fetch"]


def test_options_that_exclude_each_other_are_named_in_the_help():
    text = options_of(COMMANDS["estimate",])["--overwrite"].help
    assert text == "Replace the work in --out. Not with --resume."
    assert app.name == "awarenav"
