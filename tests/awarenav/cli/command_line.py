"""The commands of the command line, and runs of it in a process of its own."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import click
from paths import ROOT

from awarenav.cli import Command, app

SHORT_SCENARIO = """
name: short
description: Half a second.
duration_s: 0.5
robot: {goal_x_m: 1.0}
people:
  - {name: stands, route: [{x_m: 3.0, y_m: -1.0}], social: false}
"""


def walk(
    group: click.Group = app, path: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    """Yield every command with the words that call it."""
    with click.Context(group) as context:
        for name in group.list_commands(context):
            command = group.get_command(context, name)
            assert command is not None
            yield (*path, name), command
            if isinstance(command, Command):
                for part, each in command.parts.items():
                    yield (*path, name, part), each
            if isinstance(command, click.Group):
                yield from walk(command, (*path, name))


COMMANDS = dict(walk())


def options_of(command: click.Command) -> dict[str, click.Option]:
    return {
        name: each
        for each in command.params
        if isinstance(each, click.Option)
        for name in each.opts
    }


def run_python(code: str, *arguments: str, timeout_s: float = 60.0) -> subprocess.CompletedProcess:
    """Run Python code in a new process that imports this checkout."""
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )
