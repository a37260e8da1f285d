"""The end of a command that failed, with a message for the user instead of a traceback."""

from __future__ import annotations

from typing import Final

import click

# The modules that the extra "sim" installs.
_SIMULATOR_MODULES: Final = ("av", "matplotlib", "moderngl", "pybullet")


class CommandFailure(click.ClickException):
    """A command that could not do its work.

    Args:
        context: of the command, whose name begins the message.
        message: one line for the user.
        status: exit status of the program.
    """

    def __init__(self, context: click.Context, message: str, status: int) -> None:
        super().__init__(message)
        self.command_path = context.command_path
        self.status = status


def user_message(error: Exception) -> str | None:
    """Return the message that an error has for the user; None for an error of the program."""
    if isinstance(error, ModuleNotFoundError):
        if error.name not in _SIMULATOR_MODULES:
            return None
        from perception.installation import install_command  # noqa: PLC0415 - as below

        return (
            f"needs {error.name}, which is not installed; it is part of the extra 'sim': "
            + install_command("sim")
        )
    # This import loads the networks, which help does not need.
    from perception.errors import AwarenavError  # noqa: PLC0415

    return str(error) if isinstance(error, AwarenavError) else None
