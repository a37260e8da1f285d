"""The command line: one table of commands, and the options that several of them share.

A command is imported when it is called, so ``awarenav --help`` imports none of them. The table
names the simulator's commands in :mod:`sim_tests` without importing them.
"""

from __future__ import annotations

from . import options
from ._app import app, main
from ._command import Command, CommandGroup, Option, argument, command, group, option
from ._terminal import styled, table_text
from ._types import (
    NUMBER,
    POSITIVE,
    SHARE,
    FilePath,
    FolderPath,
    Number,
    OneOf,
    Seeds,
    Whole,
    WordAndNumbers,
)

__all__ = [
    "NUMBER",
    "POSITIVE",
    "SHARE",
    "Command",
    "CommandGroup",
    "FilePath",
    "FolderPath",
    "Number",
    "OneOf",
    "Option",
    "Seeds",
    "Whole",
    "WordAndNumbers",
    "app",
    "argument",
    "command",
    "group",
    "main",
    "option",
    "options",
    "styled",
    "table_text",
]
