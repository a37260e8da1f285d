"""Commands and options: groups of options, several values, options that exclude each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from typing import Any, Final, Protocol, TypeVar

import click
from click.core import ParameterSource

from perception.errors import AwarenavError

BAD_INPUT: Final = 2
INTERRUPTED: Final = 130

_SETTINGS: Final = {
    "help_option_names": ["-h", "--help"],
    "max_content_width": 100,
    "show_default": True,
}
# The modules that the extra "sim" installs.
_SIMULATOR_MODULES: Final = ("av", "filelock", "joblib", "moderngl", "pybullet")

_Function = TypeVar("_Function", bound=Callable[..., Any])


class Decorator(Protocol):
    """Adds a parameter to the function of a command."""

    def __call__(self, function: _Function, /) -> _Function:
        """Return the function with the parameter."""
        ...


class CommandFailure(click.ClickException):
    """A command that could not do its work, with a message for the user instead of a traceback.

    Args:
        context: of the command, whose name begins the message.
        message: one line for the user.
        status: exit status of the program.
    """

    def __init__(self, context: click.Context, message: str, status: int) -> None:
        super().__init__(message)
        self.command_path = context.command_path
        self.status = status
        #: Whether the same command with ``--resume`` goes on.
        self.can_resume = False


class Option(click.Option):
    """An option of a command.

    Args:
        group: heading under which the help lists it; None for "Options".
        many: whether it takes several values: ``--policy blind balanced`` or
            ``--policy blind --policy balanced``.
        excludes: name of another option that cannot be combined with this one.
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
        if excludes is not None:
            self.help = f"{self.help} Not with {excludes}."


class Command(click.Command):
    """A command of ``awarenav``; its callback returns the exit status.

    Args:
        examples: command lines, listed at the end of the help.
        exit_status: meaning of each exit status, listed at the end of the help.
    """

    def __init__(
        self,
        *args: Any,
        examples: Sequence[str] = (),
        exit_status: Mapping[int, str] | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(*args, **kwargs)
        self.examples = tuple(examples)
        self.exit_status = dict(exit_status or {})
        #: Commands that this one has besides its own work, such as ``awarenav tracks calibrate``.
        self.parts: dict[str, click.Command] = {}

    def add_part(self, part: click.Command) -> None:
        """Add a command of this command; its name must not be that of a file to work on."""
        self.parts[str(part.name)] = part

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """Return the context of the command, or of the part that the first word names."""
        part = self.parts.get(args[0]) if args else None
        if part is None:
            return super().make_context(info_name, args, parent, **extra)
        return part.make_context(f"{info_name} {part.name}", args[1:], parent, **extra)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments; split the values of options that take several."""
        options = [each for each in self.params if isinstance(each, Option)]
        many = {name for option in options if option.many for name in option.opts}
        try:
            rest = super().parse_args(ctx, _split_values(args, many))
        except click.UsageError as error:
            error.ctx = error.ctx or ctx  # click gives none where an option lacks its value
            raise
        if not ctx.resilient_parsing:
            _refuse_excluded(ctx, options)
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
            _write_list(formatter, heading, records)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the parts, the examples, the exit status and the closing remark."""
        parts = [(name, part.get_short_help_str(80)) for name, part in self.parts.items()]
        _write_list(formatter, "Commands", parts)
        if self.examples:
            with formatter.section("Examples"):
                for line in self.examples:
                    formatter.write(f"{'':{formatter.current_indent}}{line}\n")
        write_exit_status(formatter, self.exit_status)
        super().format_epilog(ctx, formatter)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command.

        Raises:
            CommandFailure: the command was interrupted, or failed with a message for the user.
        """
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            can_resume = any(each.name == "resume" for each in self.params)
            said = "interrupted; partial results kept" if can_resume else "interrupted"
            failure = CommandFailure(ctx, said, INTERRUPTED)
            failure.can_resume = can_resume
            raise failure from None
        except AwarenavError as error:
            raise CommandFailure(ctx, str(error), BAD_INPUT) from error
        except ModuleNotFoundError as error:
            if error.name not in _SIMULATOR_MODULES:
                raise
            from perception.installation import missing_simulator  # noqa: PLC0415 - for help's sake

            raise CommandFailure(ctx, missing_simulator(error.name), BAD_INPUT) from error


class CommandGroup(click.Group):
    """A command with commands of its own, such as ``awarenav models list``."""

    command_class = Command

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the commands in the order in which they were added."""
        return list(self.commands)


def write_exit_status(formatter: click.HelpFormatter, meanings: Mapping[int, str]) -> None:
    """Write the meaning of each exit status into a help."""
    _write_list(formatter, "Exit status", [(str(key), text) for key, text in meanings.items()])


def _write_list(
    formatter: click.HelpFormatter, heading: str, rows: Sequence[tuple[str, str]]
) -> None:
    if rows:
        with formatter.section(heading):
            formatter.write_dl(rows)


def _split_values(words: Sequence[str], many: Set[str]) -> list[str]:
    """Rewrite ``--policy a b`` as ``--policy a --policy b``.

    Args:
        words: of the command line.
        many: names of the options that take several values.
    """
    split: list[str] = []
    name: str | None = None
    has_value = False
    for index, word in enumerate(words):
        if word == "--":
            return [*split, *words[index:]]
        if word.startswith("-") and word != "-":
            stem, equals, _ = word.partition("=")
            name, has_value = (stem if stem in many else None), bool(equals)
        elif name is not None:
            if has_value:
                split.append(name)
            has_value = True
        split.append(word)
    return split


def _refuse_excluded(ctx: click.Context, options: Sequence[Option]) -> None:
    """Fail if two options were given that cannot be combined."""
    given = {
        name
        for option in options
        if option.name is not None
        and ctx.get_parameter_source(option.name) is ParameterSource.COMMANDLINE
        for name in option.opts
    }
    for option in options:
        if option.excludes in given and given.intersection(option.opts):
            ctx.fail(f"{option.opts[0]} and {option.excludes} exclude each other")


def command(name: str, **settings: Any) -> Callable[[Callable[..., Any]], click.Command]:
    """Return a decorator that makes a :class:`Command` of a function.

    The settings are those of the class and of :func:`click.command`.
    """
    return click.command(name, cls=Command, context_settings=_SETTINGS, **settings)


def group(name: str, **settings: Any) -> Callable[[Callable[..., Any]], CommandGroup]:
    """Return a decorator that makes a :class:`CommandGroup` of a function."""
    return click.group(name, cls=CommandGroup, context_settings=_SETTINGS, **settings)


def option(*names: str, **settings: Any) -> Decorator:
    """Return a decorator that adds an :class:`Option`.

    The settings are those of the class and of :func:`click.option`.
    """
    return click.option(*names, cls=Option, **settings)


argument = click.argument
