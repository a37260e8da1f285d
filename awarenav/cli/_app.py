"""The command ``awarenav``: its table of commands, and ``main``, which runs one of them."""

from __future__ import annotations

import codecs
import io
import json
import os
import shlex
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Any, Final, NamedTuple

import click
from click.shell_completion import CompletionItem, get_completion_class, shell_complete

from .. import __version__
from ._command import (
    BAD_INPUT,
    INTERRUPTED,
    CommandFailure,
    CommandGroup,
    argument,
    command,
    write_exit_status,
)
from ._terminal import styled
from ._types import OneOf

_PROGRAM: Final = "awarenav"
_ESCAPE: Final = "awarenav.escape"
_SHELLS: Final = ("bash", "zsh", "fish")
#: The environment variable through which a shell asks for completions.
COMPLETION_VARIABLE: Final = "_AWARENAV_COMPLETE"


class _Entry(NamedTuple):
    """A command that is not imported yet: where it is defined, and its line in the list."""

    location: str
    help: str


_COMMANDS: Final[dict[str, dict[str, _Entry]]] = {
    "On a robot": {
        "estimate": _Entry(
            "awarenav.estimate.command:estimate",
            "Estimate position, gaze and awareness of people in images and videos.",
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
            "Read ROS 2 sensors; publish obstacles and a speed limit for Nav2.",
        ),
        "models": _Entry(
            "awarenav.models.command:models",
            "List, verify and download networks.",
        ),
        "doctor": _Entry(
            "awarenav.doctor.command:doctor",
            "Say what is wrong with an installation and a camera.",
        ),
        "policy": _Entry(
            "awarenav.policies.command:policy",
            "Show the radii and speed limits of a policy.",
        ),
    },
    "Simulation": {
        "demo": _Entry(
            "sim_tests.demo.command:demo",
            "Film four robots in an aisle in which somebody with a phone steps out.",
        ),
        "crossings": _Entry(
            "sim_tests.study.command:crossings",
            "Run closed-loop crossings: scenarios, policies, planners, faults.",
        ),
        "watch": _Entry(
            "sim_tests.study.command:watch",
            "Watch a crossing in the browser while it runs.",
        ),
        "replay": _Entry(
            "sim_tests.study.command:replay",
            "Run one episode of a run again, with video, map or page.",
        ),
        "compare": _Entry(
            "sim_tests.study.command:compare",
            "Print tables of finished runs, with confidence intervals.",
        ),
        "measures": _Entry(
            "sim_tests.study.command:measures",
            "Measure episodes as HuNavSim, SocNavGym and NavWareSet do.",
        ),
        "export": _Entry(
            "sim_tests.study.command:export",
            "Write episodes in the formats of other projects.",
        ),
        "report": _Entry(
            "sim_tests.study.report.command:report",
            "Write a run's report as one HTML page.",
        ),
        "planners": _Entry(
            "sim_tests.study.report.command:planners",
            "List local planners, and compare yours on one page.",
        ),
        "scenario": _Entry(
            "sim_tests.study.scenarios.command:scenario",
            "List, explain, draw and check scenarios.",
        ),
        "render": _Entry(
            "sim_tests.dataset.command:render",
            "Render images of people in warehouses, with the truth about them.",
        ),
        "frontier": _Entry(
            "sim_tests.study.command:frontier",
            "Draw what awareness is worth: time lost over step-out impacts.",
        ),
        "tune": _Entry(
            "sim_tests.search.command:tune",
            "Search for the policy that loses the least time at a given risk.",
        ),
        "falsify": _Entry(
            "sim_tests.search.command:falsify",
            "Search for the situations in which a policy does worst.",
        ),
    },
    "Development": {
        "completion": _Entry(
            "awarenav.cli._app:completion",
            "Print the completion script for a shell.",
        ),
    },
}
_ENTRIES: Final = {
    name: entry for commands in _COMMANDS.values() for name, entry in commands.items()
}
_EXIT_STATUS: Final = {
    0: "Success.",
    1: "A check failed, or part of the work could not be done.",
    2: "Bad input; nothing was done.",
    130: "Interrupted; partial results are kept.",
}


class _Application(CommandGroup):
    """The command ``awarenav``; it imports the command that is called, and no other."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_ENTRIES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        entry = _ENTRIES.get(cmd_name)
        if entry is None:
            return None
        module, _, name = entry.location.partition(":")
        found = getattr(import_module(module), name)
        if not isinstance(found, click.Command):
            raise TypeError(f"{entry.location} must be a command, got {type(found).__name__}")
        return found

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args[0] not in _ENTRIES and not args[0].startswith("-") and not ctx.resilient_parsing:
            raise click.exceptions.NoSuchCommand(args[0], possibilities=_ENTRIES, ctx=ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for heading, commands in _COMMANDS.items():
            with formatter.section(heading):
                formatter.write_dl([(name, entry.help) for name, entry in commands.items()])

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        write_exit_status(formatter, _EXIT_STATUS)
        super().format_epilog(ctx, formatter)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        commands = [
            CompletionItem(name, help=entry.help)
            for name, entry in _ENTRIES.items()
            if name.startswith(incomplete)
        ]
        return [*commands, *click.Command.shell_complete(self, ctx, incomplete)]


@click.group(
    _PROGRAM,
    cls=_Application,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="`awarenav COMMAND --help` explains a command.",
)
@click.version_option(__version__, prog_name=_PROGRAM, message="%(prog)s %(version)s")
def app() -> None:
    """Awareness-aware navigation: estimate who has noticed the robot, and adapt its speed."""


@command(
    "completion",
    examples=[
        'eval "$(awarenav completion bash)"    # in ~/.bashrc',
        'eval "$(awarenav completion zsh)"     # in ~/.zshrc',
        "awarenav completion fish > ~/.config/fish/completions/awarenav.fish",
    ],
    exit_status={0: "Success.", 2: "Bad input."},
)
@argument("shell", type=OneOf(_SHELLS), metavar="SHELL", help="One of bash, zsh and fish.")
def completion(shell: str) -> int:
    """Print a script that completes commands, options, scenarios and policies in your shell."""
    kind = get_completion_class(shell)
    assert kind is not None  # click knows the three
    print(kind(app, {}, _PROGRAM, COMPLETION_VARIABLE).source())
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: words after ``awarenav``; default: those of the process.

    Returns:
        Exit status: 0 success, 1 a check failed or part of the work could not be done, 2 bad input,
        130 interrupted.
    """
    if instruction := os.environ.get(COMPLETION_VARIABLE):
        return shell_complete(app, {}, _PROGRAM, COMPLETION_VARIABLE, instruction)
    words = list(sys.argv[1:] if arguments is None else arguments)
    _escape_what_cannot_be_printed()
    try:
        status = _run(words)
        if sys.stdout is not None:  # a daemon may have none
            sys.stdout.flush()
    except BrokenPipeError:  # the reader has closed the pipe, as `head` does: no error
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return status


def _escape_what_cannot_be_printed() -> None:
    """Print escapes where an output has no α, ×, → or a letter of a file name.

    They are those of JSON, so that the output of ``--json`` stays the same document.
    """
    codecs.register_error(_ESCAPE, _escaped)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=_ESCAPE)


def _escaped(error: UnicodeError) -> tuple[str, int]:
    """Return the escapes of the letters that could not be encoded, and where to go on."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return json.dumps(error.object[error.start : error.end])[1:-1], error.end


def _run(words: list[str]) -> int:
    """Run the command of a command line; return the exit status."""
    try:
        with app.make_context(_PROGRAM, words) as context:
            status: Any = app.invoke(context)
        return int(status or 0)
    except click.exceptions.Exit as done:  # --help and --version
        return done.exit_code
    except click.exceptions.NoArgsIsHelpError as error:
        print(error.message)
        return BAD_INPUT
    except click.UsageError as error:
        _print_usage_error(error)
        return BAD_INPUT
    except CommandFailure as failure:
        if failure.status == INTERRUPTED:
            print(file=sys.stderr)  # after the terminal's ^C
        _print_error(failure.command_path, failure.message)
        if failure.can_resume:
            same = [word for word in words if word not in ("--resume", "--overwrite")]
            print(f"Go on with:\n  {shlex.join([_PROGRAM, *same, '--resume'])}", file=sys.stderr)
        return failure.status
    except KeyboardInterrupt:
        print(f"\n{_PROGRAM}: interrupted", file=sys.stderr)
        return INTERRUPTED


def _print_usage_error(error: click.UsageError) -> None:
    """Print what is wrong with the command line, and which help explains it, in one line."""
    path = _PROGRAM if error.ctx is None else error.ctx.command_path
    _print_error(path, f"{error.format_message().rstrip('.')} (see `{path} --help`)")


def _print_error(path: str, message: str) -> None:
    print(f"{styled(f'{path}:', sys.stderr, fg='red', bold=True)} {message}", file=sys.stderr)
