"""Commands whose options stand in groups, and options that take several values."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol, TypeVar

import click
from click.core import ParameterSource

_Function = TypeVar("_Function", bound=Callable[..., Any])


class Decorator(Protocol):
    """What adds a parameter to the function of a command."""

    def __call__(self, function: _Function, /) -> _Function:
        """Return the function with the parameter."""
        ...


_SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 100, "show_default": True}


class Option(click.Option):
    """An option of a command.

    Args:
        group: heading under which help lists it; None for "Options".
        many: takes one or more values after one another (``--policy blind balanced``), or is given
            again for each (``--policy blind --policy balanced``).
        excludes: another option, which must not be given beside this one.
    """

    def __init__(
        self,
        *args: Any,
        group: str | None = None,
        many: bool = False,
        excludes: str | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(*args, **{"multiple": many, **kwargs})
        self.group = group
        self.many = many
        self.excludes = excludes


class Command(click.Command):
    """A command of ``awarenav``; its callback returns the exit status."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse, with the values of an option that takes many taken one by one."""
        many = {
            name
            for parameter in self.params
            if isinstance(parameter, Option) and parameter.many
            for name in parameter.opts
        }
        rest = super().parse_args(ctx, list(_one_by_one(args, many)))
        given = {
            name
            for parameter in self.params
            if parameter.name is not None
            and ctx.get_parameter_source(parameter.name) is ParameterSource.COMMANDLINE
            for name in parameter.opts
        }
        for parameter in self.params:
            other = parameter.excludes if isinstance(parameter, Option) else None
            if other in given and given.intersection(parameter.opts):
                ctx.fail(f"{parameter.opts[0]} and {other} exclude each other")
        return rest

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options under the headings of their groups, in the order of declaration."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None and not isinstance(parameter, click.Argument):
                heading = getattr(parameter, "group", None) or "Options"
                groups.setdefault(heading, []).append(record)
        for heading, records in groups.items():
            with formatter.section(heading):
                formatter.write_dl(records)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; a closed output, as behind ``head``, is no error."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0


class CommandGroup(click.Group):
    """A command that has commands of its own, as ``awarenav models list``."""

    command_class = Command


def _one_by_one(args: Sequence[str], many: set[str]) -> Iterator[str]:
    """``--policy a b`` as ``--policy a --policy b``."""
    name, given = None, False
    for number, word in enumerate(args):
        if word == "--":
            yield from args[number:]
            return
        if word.startswith("-") and word != "-":
            stem, equals, _ = word.partition("=")
            name, given = (stem if stem in many else None), bool(equals)
        elif name is not None:
            if given:
                yield name
            given = True
        yield word


def command(name: str, **settings: Any) -> Callable[[Callable[..., Any]], click.Command]:
    """Return a decorator that makes a command of a function; the arguments are click's."""
    return click.command(name, cls=Command, context_settings=_SETTINGS, **settings)


def group(name: str, **settings: Any) -> Callable[[Callable[..., Any]], CommandGroup]:
    """Return a decorator that makes a group of commands of a function."""
    return click.group(name, cls=CommandGroup, context_settings=_SETTINGS, **settings)


def option(*names: str, **settings: Any) -> Decorator:
    """Return a decorator that adds an :class:`Option`; the other arguments are click's."""
    return click.option(*names, cls=Option, **settings)


def argument(name: str, **settings: Any) -> Decorator:
    """Return a decorator that adds a positional argument; the arguments are click's."""
    return click.argument(name, **settings)
