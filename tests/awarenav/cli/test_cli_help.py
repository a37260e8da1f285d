"""The help: what it says, and how little it imports."""

from __future__ import annotations

import json
import shlex

import click
import pytest
from command_line import COMMANDS, run_python

from awarenav.cli import Command, main

HEAVY = ("cv2", "matplotlib", "numpy", "onnxruntime", "pybullet", "pydantic", "scipy", "shapely")
PRINT_MODULES = """
import json, sys
from awarenav.cli import main
for line in sys.argv[1:]:
    assert main(line.split()) == 0
print(json.dumps(sorted(sys.modules)), file=sys.stderr)
"""


def help_of(path, capsys):
    assert main([*path, "--help"]) == 0
    return capsys.readouterr().out


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
    assert "=None" not in text


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


def imported(*lines):
    """Return the modules that are loaded after command lines in one process."""
    done = run_python(PRINT_MODULES, *lines)
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stderr.splitlines()[-1]))


def test_the_list_of_commands_and_the_version_import_no_command():
    modules = imported("--help", "--version")
    assert modules.isdisjoint(HEAVY)
    assert not [each for each in modules if each.endswith(".command")]
    assert not [each for each in modules if each.split(".")[0] == "sim_tests"]


def test_help_of_commands_imports_neither_arrays_nor_networks_nor_the_simulator():
    assert imported(*(f"{' '.join(path)} --help" for path in COMMANDS)).isdisjoint(HEAVY)
