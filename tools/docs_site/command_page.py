"""Reference of the command line: every command with its arguments and options, from click."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import click

from awarenav.cli import app

_INTRO: Final = """# Commands

Each command as `awarenav COMMAND --help` prints it. A mistyped command, option or name gets a
suggestion. The exit status is 0 for success, 1 when a check failed or part of the work could not
be done, 2 for bad input, and 130 when interrupted."""


def commands_page() -> str:
    """Return the page of all commands."""
    root = click.Context(app, info_name="awarenav")
    parts = [_INTRO]
    for name in app.list_commands(root):
        parts += _described(_command(app, root, name), root, name, depth=2)
    return "\n\n".join(parts) + "\n"


def _command(group: click.Group, context: click.Context, name: str) -> click.Command:
    found = group.get_command(context, name)
    if found is None:
        raise LookupError(f"the command line lists {name!r} and does not have it")
    return found


def _described(
    command: click.Command, parent: click.Context, name: str, depth: int
) -> Iterator[str]:
    """Yield the Markdown of a command, and that of its subcommands."""
    context = click.Context(command, info_name=name, parent=parent, **command.context_settings)
    path = context.command_path
    yield f"{'#' * depth} {path}"
    yield _prose(command.help or "")
    yield f"```text\n{_usage(command, context)}\n```"
    headings: dict[str, list[str]] = {}
    for parameter in command.get_params(context):
        record = parameter.get_help_record(context)
        if record is not None and not getattr(parameter, "hidden", False):
            group = getattr(parameter, "group", None) or "Options"
            if isinstance(parameter, click.Argument):
                group = "Arguments"
            headings.setdefault(group, []).append(f"`{record[0]}`\n:   {_prose(record[1])}")
    for heading, entries in headings.items():
        yield f"**{heading}**"
        yield from entries
    examples = getattr(command, "examples", ())
    if examples:
        yield "**Examples**"
        yield "```sh\n" + "\n".join(examples) + "\n```"
    status = getattr(command, "exit_status", {})
    if status:
        yield "**Exit status**"
        yield from (f"`{code}`\n:   {_prose(meaning)}" for code, meaning in status.items())
    if isinstance(command, click.Group):
        for each in command.list_commands(context):
            yield from _described(_command(command, context, each), context, each, depth + 1)


def _usage(command: click.Command, context: click.Context) -> str:
    return command.get_usage(context).removeprefix("Usage: ")


def _prose(text: str) -> str:
    """Return a help text as Markdown: no mark of click, no accidental HTML or emphasis."""
    paragraphs = text.replace("\b\n", "").strip().split("\n\n")
    joined = "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)
    return joined.replace("<", "&lt;").replace("*", "\\*").replace("[", "\\[")
