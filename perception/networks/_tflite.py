"""TFLite networks: read a file's inputs and outputs, run it with LiteRT or with OpenCV.

LiteRT (the extra ``awarenav[litert]``) runs them two to seven times as fast. Without it OpenCV's
importer runs them, with the same results.

Source of the format: TensorFlow's ``schema.fbs``, version 3.
"""

from __future__ import annotations

import os
import struct
import tempfile
import threading
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from time import perf_counter, thread_time
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from .._manifest import TrainingDomain
from ..errors import PerceptionError
from ..installation import install_command
from ._model import NETWORK_TIME, NetworkFile, OnnxTensor, looks_like, read_model
from ._settings import OnnxSettings

if TYPE_CHECKING:
    from flatbuffers.table import Table

#: Runs a network on one batch, from the input to the outputs by name.
_Run: TypeAlias = Callable[[NDArray[Any]], Mapping[str, NDArray[Any]]]

_IDENTIFIER: Final = b"TFL3"
# Number types of the schema, by number.
_DTYPES: Final = {0: "float32", 1: "float16", 2: "int32", 3: "uint8", 4: "int64", 9: "int8"}


class TfliteModel(NetworkFile):
    """A network loaded from a TFLite file.

    Several threads may share a model; their runs follow one another.

    Args:
        path_or_bytes: the file, or its content.
        settings: threads; the only provider is ``"cpu"``. OpenCV shares its threads with the whole
            process (``cv2.setNumThreads``), so the number is LiteRT's only.
        sha256: expected SHA-256 of the content, 64 hexadecimal digits; None takes any.

    Attributes:
        path: of the file; None if the content was given.
        inputs, outputs: in the order of the graph.
        engine: ``"LiteRT"`` or ``"OpenCV"``.
        training_domain: None, since the format has no place for it.

    Raises:
        PerceptionError: for a file that is missing, cannot be read, has another SHA-256 or is not
            a network that the engine can load, and for another provider.
    """

    training_domain: TrainingDomain | None = None

    def __init__(
        self,
        path_or_bytes: str | os.PathLike[str] | bytes,
        *,
        settings: OnnxSettings | None = None,
        sha256: str | None = None,
    ) -> None:
        self._settings = settings = OnnxSettings() if settings is None else settings
        self.path, self._content = read_model(path_or_bytes, sha256)
        content = self._content
        if settings.provider_names != ("cpu",):
            raise PerceptionError(
                f"{self.name} is a TFLite network, which runs on the provider 'cpu' only, "
                f"got {', '.join(map(repr, settings.provider_names))}"
            )
        try:
            self.inputs, self.outputs = _ends(content)
            self.engine, self._run = _loaded(content, self.inputs, self.outputs, settings)
        except Exception as cause:  # both engines' errors share no base of their own
            raise PerceptionError(
                f"{self.name} is not a TFLite network that can be loaded "
                f"({len(content)} bytes): {looks_like(content) or _last_line(cause)}"
            ) from cause
        self._lock = threading.Lock()

    def __repr__(self) -> str:
        return f"TfliteModel({self.name}: {self.layout}, {self.engine})"

    def with_outputs(self, names: Collection[str]) -> TfliteModel:
        """Return the network with these outputs only; what they do not need is not computed.

        A network of bodies spends two fifths of its time on masks, for example.
        """
        reduced = TfliteModel(_reduced(self._content, names), settings=self._settings)
        reduced.path = self.path
        return reduced

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
                results = self._run(batch)
        except Exception as cause:  # as above
            raise PerceptionError(f"{self.name} could not be run: {_last_line(cause)}") from cause
        NETWORK_TIME.elapsed_s += perf_counter() - began
        NETWORK_TIME.processor_s += thread_time() - processor_began
        return results


def is_tflite(content: bytes | bytearray) -> bool:
    """Return whether these are the first bytes of a TFLite file."""
    return content[4:8] == _IDENTIFIER


def _loaded(
    content: bytes,
    inputs: tuple[OnnxTensor, ...],
    outputs: tuple[OnnxTensor, ...],
    settings: OnnxSettings,
) -> tuple[str, _Run]:
    if len(inputs) != 1 or len(inputs[0].shape) != 4:
        raise ValueError(f"one input (1, height, width, 3) is wanted, found {inputs}")
    try:
        from ai_edge_litert.interpreter import Interpreter  # noqa: PLC0415 - an extra
    except ImportError:
        return "OpenCV", _opencv(content, outputs)
    return "LiteRT", _litert(Interpreter, content, settings)


def _litert(interpreter_class: Any, content: bytes, settings: OnnxSettings) -> _Run:
    interpreter = interpreter_class(
        model_content=content, num_threads=settings.intra_op_threads or _default_threads()
    )
    interpreter.allocate_tensors()
    place = interpreter.get_input_details()[0]["index"]
    results = {each["name"]: each["index"] for each in interpreter.get_output_details()}

    def run(batch: NDArray[Any]) -> Mapping[str, NDArray[Any]]:
        interpreter.set_tensor(place, batch)
        interpreter.invoke()
        return {name: interpreter.get_tensor(index) for name, index in results.items()}

    return run


def _opencv(content: bytes, outputs: tuple[OnnxTensor, ...]) -> _Run:
    # OpenCV 5's other engine returns one output of several. The reader of a buffer takes that one
    # whatever it is told, so the content goes through a file.
    engine = getattr(cv2.dnn, "ENGINE_CLASSIC", None)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "network.tflite"
        path.write_bytes(content)
        net = cv2.dnn.readNetFromTFLite(str(path), *([] if engine is None else [engine]))
    names = [tensor.name for tensor in outputs]
    # OpenCV's own order of the axes of pictures is no use here: such outputs are not computed.
    flat = [tensor.name for tensor in outputs if _is_flat(tensor)] or names

    shapes = {tensor.name: [extent or 1 for extent in tensor.shape] for tensor in outputs}

    def run(batch: NDArray[Any]) -> Mapping[str, NDArray[Any]]:
        planes = np.ascontiguousarray(batch.transpose(0, 3, 1, 2), dtype=np.float32)
        net.setInput(planes)
        return {
            name: result.reshape(shapes[name])
            for name, result in zip(flat, net.forward(flat), strict=True)
        }

    return run


def _is_flat(tensor: OnnxTensor) -> bool:
    """Return whether a tensor has no more than one axis of places."""
    return len(tensor.shape) < 4 or tensor.shape[1:3] == (1, 1)


def _default_threads() -> int:
    return max((os.cpu_count() or 2) // 2, 1)


def _ends(content: bytes) -> tuple[tuple[OnnxTensor, ...], tuple[OnnxTensor, ...]]:
    """Return inputs and outputs of the file's only graph.

    Raises:
        ValueError, struct.error: for something else than a TFLite file.
    """
    graph = _graph(content)
    tensors = _tables(graph, 0)
    return (
        tuple(_tensor(tensors[row]) for row in _integers(graph, 1)),
        tuple(_tensor(tensors[row]) for row in _integers(graph, 2)),
    )


def _graph(content: bytes | bytearray) -> Table:
    if not is_tflite(content):
        raise ValueError("it does not begin as a TFLite file")
    try:
        from flatbuffers.table import Table  # noqa: PLC0415 - an extra
    except ImportError as cause:
        command = install_command("litert")
        raise ImportError(f"flatbuffers is missing, of the extra 'litert': {command}") from cause
    root = Table(content, int.from_bytes(content[:4], "little"))
    graphs = _tables(root, 2)
    if len(graphs) != 1:
        raise ValueError(f"one graph is wanted, found {len(graphs)}")
    return graphs[0]


def _reduced(content: bytes, names: Collection[str]) -> bytes:
    """Return a file with the named outputs and the operators that they need.

    The lists of outputs and operators become shorter in their place; all else stays.
    """
    changed = bytearray(content)
    graph = _graph(changed)
    tensors, operators = _tables(graph, 0), _tables(graph, 3)
    kept = [row for row in _integers(graph, 2) if _tensor(tensors[row]).name in names]
    needed, used = set(kept), []
    for operator in reversed(operators):
        if needed.intersection(_integers(operator, 2)):
            needed.update(_integers(operator, 1))
            used.append(operator.Pos)
    start = graph.Vector(graph.Offset(_slot(2)))
    struct.pack_into(f"<I{len(kept)}i", changed, start - 4, len(kept), *kept)
    start = graph.Vector(graph.Offset(_slot(3)))
    # Places of tables count from the entry itself.
    places = [place - (start + 4 * row) for row, place in enumerate(reversed(used))]
    struct.pack_into(f"<I{len(places)}I", changed, start - 4, len(places), *places)
    return bytes(changed)


def _tensor(table: Table) -> OnnxTensor:
    place = table.Offset(_slot(1))
    number = table.Bytes[place + table.Pos] if place else 0
    name = table.String(table.Offset(_slot(3)) + table.Pos).decode()
    return OnnxTensor(name, tuple(_integers(table, 0)), _DTYPES.get(number, f"type {number}"))


def _tables(table: Table, field: int) -> list[Table]:
    """Return the tables of a field that is a vector of them."""
    place = table.Offset(_slot(field))
    start = table.Vector(place) if place else 0
    return [
        type(table)(table.Bytes, table.Indirect(start + 4 * row))
        for row in range(table.VectorLen(place) if place else 0)
    ]


def _integers(table: Table, field: int) -> list[int]:
    place = table.Offset(_slot(field))
    if not place:
        return []
    start = table.Vector(place)
    return list(struct.unpack_from(f"<{table.VectorLen(place)}i", table.Bytes, start))


def _slot(field: int) -> int:
    """Return a field's place in the table of offsets."""
    return 4 + 2 * field


def _last_line(cause: Exception) -> str:
    lines = str(cause).strip().splitlines()
    return lines[-1][:300] if lines else type(cause).__name__
