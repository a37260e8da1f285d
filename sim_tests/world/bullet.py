"""PyBullet, imported in this module only, when something first needs it.

PyBullet is the optional dependency ``awarenav[sim]``: scenarios, planners and finished runs are
listed, compared and reported without it. Its extension module writes its build time to standard
error when it is loaded; that line is dropped, so a command prints only its own output.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator
from typing import Any

from perception.installation import install_command

from .errors import MissingSimulatorError

__all__ = ["pybullet", "require_pybullet"]

_STDERR = 2
# The newest Python for which PyBullet has wheels; pyproject.toml leaves it out on later ones.
_NEWEST = (3, 11)


@contextlib.contextmanager
def _muted_stderr() -> Iterator[None]:
    """Send the process's standard error to the null device; C code bypasses ``sys.stderr``."""
    copy: int | None = None
    _flush_c_streams()
    # A process may have been started without the stream: then there is nothing to mute.
    with contextlib.suppress(OSError):
        copy = os.dup(_STDERR)
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        if copy is not None:
            os.dup2(null, _STDERR)
        yield
    finally:
        # Buffered output of C code must not appear later.
        _flush_c_streams()
        if copy is not None:
            os.dup2(copy, _STDERR)
            os.close(copy)
        os.close(null)


def _flush_c_streams() -> None:
    with contextlib.suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).fflush(None)


def require_pybullet() -> None:
    """Import PyBullet, if that has not been done."""
    pybullet.connect  # noqa: B018 - the first look-up of a name imports it


def missing_pybullet(python: tuple[int, int]) -> str:
    """Return the message about a missing PyBullet, with the way out for a version of Python."""
    if python <= _NEWEST:
        cure = f"it is the extra 'sim': {install_command('sim')}"
    else:
        cure = (
            f"it has no wheel for this Python {'.'.join(map(str, python))}. One with 3.11 beside "
            "it (`pipx install uv` brings uv): `uv venv --python 3.11 && . .venv/bin/activate && "
            f"uv {install_command('sim')}`"
        )
    return f"the simulation needs PyBullet, which is not installed; {cure}"


class _PyBullet:
    """The module, with all its names once one of them has been looked up."""

    def __getattr__(self, name: str) -> Any:
        try:
            with _muted_stderr():
                import pybullet as module  # noqa: PLC0415 - lazy on purpose
        except ImportError as cause:
            raise MissingSimulatorError(missing_pybullet(sys.version_info[:2])) from cause
        vars(self).update(vars(module))
        return getattr(module, name)


#: The module ``pybullet``.
pybullet: Any = _PyBullet()
