"""PyBullet, imported in this module only, when something first needs it.

PyBullet is the optional dependency ``awarenav[sim]``: scenarios, planners and finished runs are
listed, compared and reported without it. Its extension module writes its build time to standard
error when it is loaded; that line is dropped, so a command prints only its own output.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
from collections.abc import Iterator
from typing import Any

from perception.installation import missing_simulator

from .errors import MissingSimulatorError

__all__ = ["pybullet", "require_pybullet"]

_STDERR = 2


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


class _PyBullet:
    """The module, with all its names once one of them has been looked up."""

    def __getattr__(self, name: str) -> Any:
        try:
            with _muted_stderr():
                import pybullet as module  # noqa: PLC0415 - lazy on purpose
        except ImportError as cause:
            raise MissingSimulatorError(missing_simulator("pybullet")) from cause
        vars(self).update(vars(module))
        return getattr(module, name)


#: The module ``pybullet``.
pybullet: Any = _PyBullet()
