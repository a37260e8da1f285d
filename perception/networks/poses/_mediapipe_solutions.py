"""MediaPipe's solutions: import, warnings, and the base of the estimators that run them.

They need the extra ``awarenav[mediapipe]``.
"""

from __future__ import annotations

import warnings
from abc import abstractmethod
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any, Final, TypeVar

from ...errors import PerceptionError
from ...installation import install_command

#: Smallest confidence of a person in a box, and of a face in a square about a head.
CONFIDENCE: Final = 0.4

_E = TypeVar("_E", bound="MediaPipeEstimator")


class MediaPipeEstimator(AbstractContextManager[Any]):
    """Base of the estimators that own solutions of MediaPipe, and release them when closed.

    A class makes its solutions in ``_made``. An estimator serves one thread.

    Raises:
        PerceptionError: if MediaPipe is not installed; the message names the extra.
    """

    def __init__(self) -> None:
        face_mesh, pose = mediapipe_solutions(type(self).__name__)
        with without_protobuf_warnings():
            self._solutions = self._made(face_mesh, pose)

    @abstractmethod
    def _made(self, face_mesh: Any, pose: Any) -> tuple[Any, ...]:
        """Return the solutions, from MediaPipe's modules ``face_mesh`` and ``pose``."""

    def __enter__(self: _E) -> _E:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Release MediaPipe's memory; the estimator cannot be used afterwards."""
        solutions, self._solutions = self._solutions, ()
        for solution in solutions:
            solution.close()

    def _require_open(self) -> None:
        if not self._solutions:
            raise PerceptionError(f"the {type(self).__name__} has been closed")


def mediapipe_solutions(asker: str) -> tuple[Any, Any]:
    """Return MediaPipe's modules ``face_mesh`` and ``pose``, for the class ``asker``.

    Raises:
        PerceptionError: if MediaPipe is not installed; the message names the extra.
    """
    try:
        with without_protobuf_warnings():
            from mediapipe.python.solutions import face_mesh, pose  # noqa: PLC0415
    except ImportError as cause:
        raise PerceptionError(
            f"{asker} needs mediapipe 0.10.14, which cannot be imported ({cause}); "
            f"it is the extra 'mediapipe': {install_command('mediapipe')}"
        ) from cause
    return face_mesh, pose


@contextmanager
def without_protobuf_warnings() -> Iterator[None]:
    """Silence protobuf: MediaPipe 0.10.14 calls deprecated functions of it for each result."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=r"google\.protobuf\..*")
        warnings.filterwarnings("ignore", message=r"SymbolDatabase\.GetPrototype")
        yield
