"""The table of commands, and ``main``, which runs one of them."""

from __future__ import annotations

import difflib
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Any, Final, NamedTuple

import click

from .. import __version__
from ._command import CommandGroup

# What the extra "sim" installs.
_SIMULATOR_MODULES: Final = ("av", "matplotlib", "moderngl", "pybullet")
_PROGRAM: Final = "awarenav"
_INTERRUPTED: Final = 130


class _Entry(NamedTuple):
    """A command before it is imported: where it is, and its line in the list."""

    home: str
    help: str


_COMMANDS: Final[dict[str, dict[str, _Entry]]] = {
    "On a robot": {
        "estimate": _Entry(
            "awarenav.estimate.command:estimate",
            "People in images, videos, cameras and recordings: position, gaze, awareness.",
        ),
        "judge": _Entry(
            "awarenav.judge.command:judge",
            "Compare estimates with the truth.",
        ),
        "tracks": _Entry(
            "awarenav.tracks.command:tracks",
            "Track the people of an estimates file; plot paths and awareness.",
        ),
        "bridge": _Entry(
            "awarenav.bridge.command:bridge",
            "Read a camera over ROS 2, publish obstacles and a speed limit for Nav2.",
        ),
        "models": _Entry(
            "awarenav.models.command:models",
            "List, verify and download networks.",
        ),
        "policy": _Entry(
            "awarenav.policies.command:policy",
            "Show a policy's radii and speed limits.",
        ),
    },
    "Simulation": {
        "demo": _Entry(
            "sim_tests.demo.command:demo",
            "The paper's encounter, and what awareness saves in a crossing.",
        ),
        "crossings": _Entry(
            "sim_tests.study.command:crossings",
            "Run closed-loop crossings: scenarios, policies, planners, faults.",
        ),
        "replay": _Entry(
            "sim_tests.study.runs.command:replay",
            "Run one episode of a run again, with video and map.",
        ),
        "compare": _Entry(
            "sim_tests.study.measures.command:compare",
            "Tables of finished runs, with confidence intervals.",
        ),
        "report": _Entry(
            "sim_tests.study.report.command:report",
            "Write a run's report as one HTML page.",
        ),
        "scenario": _Entry(
            "sim_tests.scenario.catalogue.command:scenario",
            "List, explain, draw and check scenarios.",
        ),
        "render": _Entry(
            "sim_tests.dataset.command:render",
            "Render pictures of people in warehouses, with the truth about them.",
        ),
        "tune": _Entry(
            "sim_tests.search.tune.command:tune",
            "Search for policies that lose less time and keep the separation margin.",
        ),
        "falsify": _Entry(
            "sim_tests.search.falsify.command:falsify",
            "Search for the situations in which a policy does worst.",
        ),
    },
    "Development": {
        "bench": _Entry(
            "sim_tests.demo.command:bench",
            "Measure how fast crossings run.",
        ),
        "completion": _Entry(
            "awarenav.cli._completion:completion",
            "Print the completion script for a shell.",
        ),
    },
}
_ENTRIES: Final = {
    name: entry for commands in _COMMANDS.values() for name, entry in commands.items()
}


class _Application(CommandGroup):
    """The command ``awarenav``: imports the command that is called, and no other."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_ENTRIES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        entry = _ENTRIES.get(cmd_name)
        if entry is None:
            return None
        module, _, name = entry.home.partition(":")
        found = getattr(import_module(module), name)
        if not isinstance(found, click.Command):
            raise TypeError(f"{entry.home} must be a command, got {type(found).__name__}")
        return found

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and not args[0].startswith("-") and args[0] not in _ENTRIES:
            near = difflib.get_close_matches(args[0], _ENTRIES, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            ctx.fail(f"there is no command {args[0]!r}{hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for heading, commands in _COMMANDS.items():
            with formatter.section(heading):
                formatter.write_dl([(name, entry.help) for name, entry in commands.items()])


@click.group(
    _PROGRAM,
    cls=_Application,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Exit status: 0 success; 1 a check failed, or part of the work could not be done; "
    "2 bad input, nothing done; 130 interrupted, partial results kept. "
    "`awarenav COMMAND --help` explains a command.",
)
@click.version_option(__version__, prog_name=_PROGRAM, message="%(prog)s %(version)s")
def _application() -> None:
    """Awareness-aware navigation: see who has noticed the robot, and move accordingly."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: words behind ``awarenav``; default those of the process.

    Returns:
        Exit status: 0 success, 1 a check failed or part of the work could not be done, 2 bad input,
        130 interrupted.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    called = f"{_PROGRAM} {words[0]}" if words and words[0] in _ENTRIES else _PROGRAM
    try:
        status: Any = _application.main(args=words, prog_name=_PROGRAM, standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        print(error.message)
        return 2
    except click.UsageError as error:
        _complain(error)
        return 2
    except click.exceptions.Abort:
        print(f"\n{called}: interrupted; partial results kept", file=sys.stderr)
        return _INTERRUPTED
    except ModuleNotFoundError as error:
        if error.name not in _SIMULATOR_MODULES:
            raise
        print(
            f"{called}: needs {error.name}, which is not installed; it is part of the extra 'sim': "
            "pip install 'awarenav[sim]'",
            file=sys.stderr,
        )
        return 2
    except ValueError as error:
        if not _is_ours(error):
            raise
        print(f"{called}: {error}", file=sys.stderr)
        return 2
    return int(status or 0)


def _is_ours(error: ValueError) -> bool:
    from perception.errors import AwarenavError  # noqa: PLC0415 - imports networks, which help needs not

    return isinstance(error, AwarenavError)


def _complain(error: click.UsageError) -> None:
    """Print what is wrong with the command line, and which help explains it."""
    context = error.ctx
    path = _PROGRAM if context is None else context.command_path
    if context is not None:
        print(context.get_usage(), file=sys.stderr)
        print(f"Try '{path} --help' for help.\n", file=sys.stderr)
    print(f"{path}: {error.format_message()}", file=sys.stderr)
