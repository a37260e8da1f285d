"""PyBullet, imported in this module only.

PyBullet is the optional dependency ``awarenav[sim]``. Its extension module writes its build time to
standard error when it is loaded; that line is dropped, so a command prints only its own output.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
from collections.abc import Iterator

from perception.installation import install_command

from .errors import MissingSimulatorError

__all__ = ["pybullet"]

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


try:
    with _muted_stderr():
        import pybullet
except ImportError as cause:
    raise MissingSimulatorError(
        "the simulation needs PyBullet, which is not installed; it is the extra 'sim': "
        f"{install_command('sim')} (wheels exist for Python 3.10 and 3.11)"
    ) from cause
