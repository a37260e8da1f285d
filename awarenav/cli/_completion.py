"""The command ``awarenav completion``."""

from __future__ import annotations

from typing import Final

import click
from click.shell_completion import get_completion_class

from ._app import COMPLETION_VARIABLE
from ._command import argument, command
from ._types import OneOf

_SHELLS: Final = ("bash", "zsh", "fish")


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
    if kind is None:  # pragma: no cover - click knows the three
        raise click.UsageError(f"no completion for {shell}")
    root = click.get_current_context().find_root().command
    print(kind(root, {}, "awarenav", COMPLETION_VARIABLE).source())
    return 0
