"""The command line: one table of commands, and the options that they share.

A command is imported when it is called, so ``awarenav --help`` imports none of them. The commands
of the simulator come from :mod:`sim_tests`, which the table names and never imports.
"""

from __future__ import annotations

from . import options
from ._app import main
from ._command import Command, CommandGroup, argument, command, group, option
from ._types import POSITIVE, SHARE, FilePath, FolderPath, OneOf

__all__ = [
    "POSITIVE",
    "SHARE",
    "Command",
    "CommandGroup",
    "FilePath",
    "FolderPath",
    "OneOf",
    "argument",
    "command",
    "group",
    "main",
    "option",
    "options",
]
