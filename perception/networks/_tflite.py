"""TFLite networks, run by LiteRT, of the extra ``awarenav[litert]``."""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping
from time import perf_counter, thread_time
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from .._manifest import TrainingDomain
from ..errors import PerceptionError
from ..installation import install_command
from ._model import NETWORK_TIME, NetworkFile, OnnxTensor, looks_like, read_model
from ._settings import OnnxSettings

_IDENTIFIER: Final = b"TFL3"


class TfliteModel(NetworkFile):
    """A network loaded from a TFLite file.

    Several threads may share a model; their runs follow one another.

    Args:
        path_or_bytes: the file, or its content.
        settings: threads; the only provider is ``"cpu"``.
        sha256: expected SHA-256 of the content, 64 hexadecimal digits; None takes any.

    Attributes:
        path: of the file; None if the content was given.
        inputs, outputs: in the order of the graph.
        training_domain: None, since the format has no place for it.

    Raises:
        PerceptionError: for a file that is missing, cannot be read, has another SHA-256 or is not
            a network that LiteRT can load, for another provider, and without LiteRT.
    """

    training_domain: TrainingDomain | None = None

    def __init__(
        self,
        path_or_bytes: str | os.PathLike[str] | bytes,
        *,
        settings: OnnxSettings | None = None,
        sha256: str | None = None,
    ) -> None:
        settings = OnnxSettings() if settings is None else settings
        self.path, content = read_model(path_or_bytes, sha256)
        if settings.provider_names != ("cpu",):
            raise PerceptionError(
                f"{self.name} is a TFLite network, which runs on the provider 'cpu' only, "
                f"got {', '.join(map(repr, settings.provider_names))}"
            )
        if not is_tflite(content):
            raise self._unusable(content, "it does not begin as a TFLite file")
        try:
            from ai_edge_litert.interpreter import Interpreter  # noqa: PLC0415 - an extra
        except ImportError as cause:
            raise PerceptionError(
                f"{self.name} is a TFLite network, which needs LiteRT, of the extra 'litert': "
                f"{install_command('litert')}"
            ) from cause
        threads = settings.intra_op_threads or max((os.cpu_count() or 2) // 2, 1)
        try:
            self._interpreter = Interpreter(model_content=content, num_threads=threads)
            self._interpreter.allocate_tensors()
        except Exception as cause:  # LiteRT's errors share no base of their own
            raise self._unusable(content, _last_line(cause)) from cause
        ends = self._interpreter.get_input_details(), self._interpreter.get_output_details()
        self.inputs, self.outputs = (tuple(map(_tensor, each)) for each in ends)
        if len(self.inputs) != 1 or len(self.inputs[0].shape) != 4:
            raise self._unusable(
                content, f"one input (1, height, width, 3) is wanted, found {self.inputs}"
            )
        self._input = ends[0][0]["index"]
        self._results = {each["name"]: each["index"] for each in ends[1]}
        self._lock = threading.Lock()

    def __repr__(self) -> str:
        return f"TfliteModel({self.name}: {self.layout})"

    def run(self, batch: NDArray[Any]) -> Mapping[str, NDArray[Any]]:
        """Run the network on its only input (1, height, width, 3); return outputs by name.

        Raises:
            PerceptionError: for an input of another shape or type, and when the network fails.
        """
        wanted = self.inputs[0]
        if batch.shape != wanted.shape or batch.dtype != wanted.dtype:
            raise PerceptionError(
                f"{self.name} takes {wanted}, got {batch.shape} {batch.dtype.name}"
            )
        began, processor_began = perf_counter(), thread_time()
        try:
            with self._lock:
                self._interpreter.set_tensor(self._input, batch)
                self._interpreter.invoke()
                results = {
                    name: self._interpreter.get_tensor(index)
                    for name, index in self._results.items()
                }
        except Exception as cause:  # as above
            raise PerceptionError(f"{self.name} could not be run: {_last_line(cause)}") from cause
        NETWORK_TIME.elapsed_s += perf_counter() - began
        NETWORK_TIME.processor_s += thread_time() - processor_began
        return results

    def _unusable(self, content: bytes, reason: str) -> PerceptionError:
        return PerceptionError(
            f"{self.name} is not a TFLite network that can be loaded "
            f"({len(content)} bytes): {looks_like(content) or reason}"
        )


def is_tflite(content: bytes | bytearray) -> bool:
    """Return whether these are the first bytes of a TFLite file."""
    return content[4:8] == _IDENTIFIER


def _tensor(details: Mapping[str, Any]) -> OnnxTensor:
    kind = np.dtype(details["dtype"]).name
    return OnnxTensor(details["name"], tuple(map(int, details["shape"])), kind)


def _last_line(cause: Exception) -> str:
    lines = str(cause).strip().splitlines()
    return lines[-1][:300] if lines else type(cause).__name__
