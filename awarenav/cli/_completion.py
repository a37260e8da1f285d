"""The command ``awarenav completion``."""

from __future__ import annotations

from typing import Final

import click
from click.shell_completion import get_completion_class

from ._command import argument, command
from ._types import OneOf

_SHELLS: Final = ("bash", "zsh", "fish")
_VARIABLE: Final = "_AWARENAV_COMPLETE"


@command(
    "completion",
    short_help="Print the completion script for a shell.",
    epilog='bash: eval "$(awarenav completion bash)" in ~/.bashrc; '
    'zsh: eval "$(awarenav completion zsh)" in ~/.zshrc; '
    "fish: awarenav completion fish > ~/.config/fish/completions/awarenav.fish",
)
@argument("shell", type=OneOf(_SHELLS), help="The shell.")
def completion(shell: str) -> int:
    """Print a script that completes commands, options, scenarios and policies in your shell."""
    kind = get_completion_class(shell)
    if kind is None:  # pragma: no cover - click knows the three
        raise click.UsageError(f"no completion for {shell}")
    root = click.get_current_context().find_root().command
    print(kind(root, {}, "awarenav", _VARIABLE).source())
    return 0
