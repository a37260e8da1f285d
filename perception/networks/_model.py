"""ONNX networks: load a file, describe its inputs and outputs, run it with ONNX Runtime."""

from __future__ import annotations

import hashlib
import os
import pickle
import struct
import threading
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, thread_time
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._manifest import (
    shipped_model,
    shipped_model_path,
    training_domain_of,
    verify_shipped_model,
)
from ..errors import PerceptionError
from ._settings import PROVIDERS, OnnxSettings, short_name

# The newer Linux wheels of ONNX Runtime report processes, sessions and models to their maker from
# the import on (microsoft/onnxruntime#27379) and store an identifier on disk. This turns both off,
# unless the environment variable is already set.
os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")

import onnxruntime as ort  # type: ignore[import-untyped]

_DTYPES: Final[dict[str, str]] = {
    "float": "float32",
    "float16": "float16",
    "double": "float64",
    "uint8": "uint8",
    "int8": "int8",
    "uint16": "uint16",
    "int16": "int16",
    "int32": "int32",
    "int64": "int64",
    "uint32": "uint32",
    "uint64": "uint64",
    "bool": "bool",
}
_LOG_ERRORS_ONLY: Final = 3
# Errors of readers of ZIP files and pickles about another file.
_WRONG_FILE: Final = (zipfile.BadZipFile, zlib.error, pickle.UnpicklingError, struct.error)

_Parsed = TypeVar("_Parsed")


class NetworkTime(threading.local):
    """Time that the calling thread has spent in networks since the thread began.

    Attributes:
        elapsed_s: wall-clock time.
        processor_s: processor time of the calling thread; the worker threads of ONNX Runtime are
            not included.
    """

    elapsed_s: float = 0.0
    processor_s: float = 0.0


#: Every run of an :class:`~perception.networks.OnnxModel` adds to it.
NETWORK_TIME = NetworkTime()


@dataclass(frozen=True, slots=True)
class OnnxTensor:
    """An input or output of a network.

    Attributes:
        name: name in the graph.
        shape: extents; None where the graph leaves an extent free.
        dtype: NumPy's name of the number type, or ONNX Runtime's where NumPy has none.
    """

    name: str
    shape: tuple[int | None, ...]
    dtype: str

    def __str__(self) -> str:
        extents = ", ".join("any" if extent is None else str(extent) for extent in self.shape)
        return f"{self.name} ({extents}) {self.dtype}"


# What people have under the name of a network, by how it begins, in lower case.
_NO_NETWORKS: Final = (
    (
        (b"version https://git-lfs",),
        "it is the pointer of a file in git-lfs: `git lfs pull` fetches the network",
    ),
    (
        (b"<!doctype", b"<html", b"<?xml", b'{"'),
        "it is a page or an answer of a web server, not the file: fetch it from the address that "
        "its download button has",
    ),
    (
        (b"pk\x03\x04", b"\x80\x02", b"\x80\x03", b"\x80\x04"),
        "it is a ZIP or pickle file, such as a PyTorch checkpoint (.pt) or a packed download: "
        "unpack it, or export the network to ONNX",
    ),
    ((b"\x1f\x8b", b"bzh", b"\xfd7zxz"), "it is compressed: unpack it"),
    ((b"\x89hdf",), "it is a Keras file (HDF5): export the network to ONNX"),
)


class NetworkFile:
    """The words of messages about a network, whatever its format.

    Attributes:
        path: of the file; None if the content was given.
        inputs, outputs: in the order of the graph.
    """

    path: Path | None
    inputs: tuple[OnnxTensor, ...]
    outputs: tuple[OnnxTensor, ...]

    @property
    def name(self) -> str:
        """Name for messages: the path, or a note that the model was given as bytes."""
        return "model given as bytes" if self.path is None else str(self.path)

    @property
    def layout(self) -> str:
        """Inputs and outputs with shapes and types, for messages."""
        sides = (", ".join(map(str, tensors)) for tensors in (self.inputs, self.outputs))
        return " -> ".join(sides)


class OnnxModel(NetworkFile):
    """A network loaded from an ONNX file.

    Args:
        path_or_bytes: the file, or its content.
        settings: providers with their options, and threads.
        sha256: expected SHA-256 of the content, 64 hexadecimal digits. It is checked on the same
            bytes that are loaded. It does not cover weights in separate files, so networks with
            such files are then refused.

    Attributes:
        path: of the file; None if the content was given.
        inputs, outputs: in the order of the graph.
        metadata: of the file.
        training_domain: what the network has seen in training, one of
            :data:`~perception.shipped.TRAINING_DOMAINS`; None if the file does not say it.

    Raises:
        PerceptionError: for a file that is missing, cannot be read, has another SHA-256 or is not
            a network that ONNX Runtime can load, and for a provider that is not present.
    """

    def __init__(
        self,
        path_or_bytes: str | os.PathLike[str] | bytes,
        *,
        settings: OnnxSettings | None = None,
        sha256: str | None = None,
    ) -> None:
        self.settings = OnnxSettings() if settings is None else settings
        self._source = path_or_bytes
        self.path, content = read_model(path_or_bytes, sha256)
        self._session = self._load(content, sealed=sha256 is not None)
        self.inputs = tuple(_tensor(entry) for entry in self._session.get_inputs())
        self.outputs = tuple(_tensor(entry) for entry in self._session.get_outputs())
        self.metadata: dict[str, str] = dict(self._session.get_modelmeta().custom_metadata_map)
        self.training_domain = training_domain_of(content, self.metadata)
        self._names = [tensor.name for tensor in self.outputs]

    @classmethod
    def shipped(
        cls, name: str, settings: OnnxSettings | None = None, folder: Path | None = None
    ) -> OnnxModel:
        """Load a shipped network; its SHA-256 is checked on the same bytes that are loaded.

        Args:
            name: name in the manifest, for example ``"person_detector"``.
            settings: providers and threads.
            folder: folder of the manifest; default that of this package.

        Raises:
            PerceptionError: for an unknown name, a missing or altered file, and when ONNX Runtime
                cannot run the network with these settings.
        """
        path = shipped_model_path(name, folder)
        try:
            return cls(path, settings=settings, sha256=shipped_model(name, folder).sha256)
        except PerceptionError:
            # If the file is the cause, this raises an error that says the remedy.
            verify_shipped_model(name, folder)
            raise

    def __repr__(self) -> str:
        return f"OnnxModel({self.name}: {self.layout})"

    @property
    def providers(self) -> tuple[str, ...]:
        """Providers in use, in order of preference, with the names of :class:`OnnxSettings`."""
        return tuple(map(short_name, self._session.get_providers()))

    @property
    def provider_options(self) -> dict[str, dict[str, str]]:
        """Options of each provider in use that differ from none, as ONNX Runtime reports them."""
        found: dict[str, dict[str, str]] = self._session.get_provider_options()
        return {short_name(name): options for name, options in found.items() if options}

    def holds_any(self, words: Iterable[str]) -> bool:
        """Return whether the file holds one of some words, such as a part of a weight's name."""
        _, content = read_model(self._source)
        return any(word.encode() in content for word in words)

    def run(self, feeds: Mapping[str, NDArray[Any]], *, timed: bool = True) -> list[NDArray[Any]]:
        """Run the network on its named inputs and return the outputs in the order of ``outputs``.

        Args:
            feeds: inputs by name.
            timed: add to :data:`NETWORK_TIME`. Asking for the time may take longer than a network
                of a few microseconds.

        Raises:
            PerceptionError: for inputs of the wrong name, shape or type, and when the network
                fails, with ONNX Runtime's message.
        """
        began, processor_began = (perf_counter(), thread_time()) if timed else (0.0, 0.0)
        try:
            results: list[NDArray[Any]] = self._session.run(self._names, feeds)
        except Exception as cause:  # onnxruntime's errors share no base of their own
            given = ", ".join(f"{name} {np.shape(feed)}" for name, feed in feeds.items())
            raise PerceptionError(
                f"{self.name} could not be run on {given}; it takes "
                f"{', '.join(map(str, self.inputs))}: {_first_line(cause)}"
            ) from cause
        if timed:
            NETWORK_TIME.elapsed_s += perf_counter() - began
            NETWORK_TIME.processor_s += thread_time() - processor_began
        return results

    def _load(self, content: bytes, *, sealed: bool) -> Any:
        names = self.settings.provider_names
        present = ort.get_available_providers()
        if missing := [name for name in names if PROVIDERS[name] not in present]:
            here = [short_name(name) for name in present if short_name(name) in PROVIDERS]
            raise PerceptionError(
                f"provider {missing[0]!r} is not present in this onnxruntime {ort.__version__}, "
                f"which has {', '.join(map(repr, here))}; onnxruntime-gpu has CUDA and TensorRT, "
                "onnxruntime-openvino OpenVINO, and the wheel for macOS Core ML"
            )
        wanted = [(PROVIDERS[name], self.settings.provider_options(name)) for name in names]
        options = ort.SessionOptions()
        options.log_severity_level = _LOG_ERRORS_ONLY
        if self.settings.intra_op_threads is not None:
            options.intra_op_num_threads = self.settings.intra_op_threads
        # Idle threads that spin save microseconds, and take whole cores from other programs.
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        if "cpu" not in names:
            wanted.append((PROVIDERS["cpu"], {}))
        # Some exporters write the weights into files next to the graph. ONNX Runtime finds them
        # only when it loads the graph by its path.
        source = content if self.path is None or sealed else str(self.path)
        try:
            # Without enable_fallback=0, ONNX Runtime prints a failure of the GPU and uses the CPU.
            session = ort.InferenceSession(source, options, providers=wanted, enable_fallback=0)
        except Exception as cause:  # onnxruntime's errors share no base of their own
            given = "".join(f", {name} with {chosen}" for name, chosen in wanted if chosen)
            raise PerceptionError(
                f"{self.name} is not an ONNX network that onnxruntime {ort.__version__} can load "
                f"({len(content)} bytes{given}): {looks_like(content) or _first_line(cause)}"
            ) from cause
        used = session.get_providers()
        if idle := [name for name in names if PROVIDERS[name] not in used]:
            raise PerceptionError(
                f"provider {idle[0]!r} is built into this onnxruntime {ort.__version__} but could "
                "not start: its driver or libraries are missing or of another version"
            )
        return session


#: An ONNX file, its content, or a model that is already loaded.
ModelSource: TypeAlias = OnnxModel | str | os.PathLike[str] | bytes


def as_onnx_model(model: ModelSource, settings: OnnxSettings | None) -> OnnxModel:
    """Return the model, after loading it if needed.

    Raises:
        PerceptionError: as :class:`OnnxModel`, and for settings given with a loaded model.
    """
    if not isinstance(model, OnnxModel):
        return OnnxModel(model, settings=settings)
    if settings is not None:
        raise PerceptionError(
            "settings are for loading a model: give them to OnnxModel, "
            f"not together with {model.name}, which is loaded already"
        )
    return model


def output_shapes(model: OnnxModel, outputs: Sequence[NDArray[Any]]) -> str:
    """Return the names and shapes of the outputs of a run, for messages."""
    return ", ".join(
        f"{tensor.name} {output.shape}"
        for tensor, output in zip(model.outputs, outputs, strict=True)
    )


def read_model(path_or_bytes: Any, sha256: str | None = None) -> tuple[Path | None, bytes]:
    """Return path and content of a model, given by its path or its content.

    Args:
        path_or_bytes: of the model; with bytes the path is None.
        sha256: expected SHA-256 of the content, 64 hexadecimal digits; None takes any.

    Raises:
        PerceptionError: for a file that cannot be read, and for another SHA-256.
    """
    if isinstance(path_or_bytes, (bytes, bytearray, memoryview)):
        path, content = None, bytes(path_or_bytes)
    else:
        try:
            path = Path(path_or_bytes)
            content = path.read_bytes()
        except TypeError:
            raise PerceptionError(
                "a model must be a path to a file or its bytes, got "
                f"{type(path_or_bytes).__name__}: {path_or_bytes!r:.80}"
            ) from None
        except (OSError, ValueError) as cause:  # ValueError: a path with a null character
            reason = getattr(cause, "strerror", None) or cause
            raise PerceptionError(f"cannot read the model {path}: {reason}") from cause
    if sha256 is not None:
        _check_sha256(path or "model given as bytes", content, sha256)
    return path, content


def read_as(
    what: str, parse: Callable[[bytes], _Parsed], path_or_bytes: Any, sha256: str | None
) -> tuple[str, _Parsed]:
    """Return the name of a file for messages, and what is made of its content.

    Args:
        what: the file that it should be, for the message.
        parse: makes something of the content; of another file it may raise any of the errors of
            ZIP files and pickles.
        path_or_bytes: as for :func:`read_model`.
        sha256: as for :func:`read_model`.

    Raises:
        PerceptionError: for a file that cannot be read, and for another file.
    """
    path, content = read_model(path_or_bytes, sha256)
    name = "the model given as bytes" if path is None else str(path)
    try:
        return name, parse(content)
    except (*_WRONG_FILE, LookupError, ValueError, EOFError) as cause:
        raise PerceptionError(f"{name} is not {what}: {cause!r:.200}") from cause


def looks_like(content: bytes) -> str:
    """Return what a file is that is often taken for a network, and the cure; empty if unknown."""
    start = content[:64].lstrip().lower()
    for beginnings, words in _NO_NETWORKS:
        if start.startswith(beginnings):
            return words
    return "" if content else "it is empty: fetch it again"


def _check_sha256(name: Any, content: bytes, wanted: str) -> None:
    digits = str(wanted).strip().lower()
    if len(digits) != 64 or set(digits) - set("0123456789abcdef"):
        raise PerceptionError(f"sha256 must be 64 hexadecimal digits, got {wanted!r}")
    found = hashlib.sha256(content).hexdigest()
    if found != digits:
        raise PerceptionError(
            f"{name} is not the file it should be: its sha256 is {found}, "
            f"wanted {digits} ({len(content)} bytes)"
        )


def _tensor(entry: Any) -> OnnxTensor:
    shape = tuple(extent if isinstance(extent, int) else None for extent in entry.shape)
    number_type = entry.type.removeprefix("tensor(").removesuffix(")")
    return OnnxTensor(entry.name, shape, _DTYPES.get(number_type, entry.type))


def _first_line(cause: Exception) -> str:
    lines = str(cause).strip().splitlines()
    return lines[0][:300] if lines else type(cause).__name__
