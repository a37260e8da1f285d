"""Settings of ONNX Runtime: its execution providers with their options, and threads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from ..errors import PerceptionError

#: Execution providers by the names that are short for ONNX Runtime's own.
PROVIDERS: Final[dict[str, str]] = {
    "cpu": "CPUExecutionProvider",
    "cuda": "CUDAExecutionProvider",
    "tensorrt": "TensorrtExecutionProvider",
    "openvino": "OpenVINOExecutionProvider",
    "coreml": "CoreMLExecutionProvider",
}
_SHORT: Final = {long: short for short, long in PROVIDERS.items()}

#: Options of a provider as ONNX Runtime takes them, sorted by name.
ProviderOptions: TypeAlias = tuple[tuple[str, str], ...]
#: A provider, or a provider with its options (a mapping, or pairs of name and value).
Provider: TypeAlias = str | tuple[str, Mapping[str, Any] | Sequence[tuple[str, Any]]]


@dataclass(frozen=True, slots=True)
class OnnxSettings:
    """Settings with which ONNX Runtime runs a network.

    Attributes:
        providers: one or more of ``"cpu"``, ``"cuda"``, ``"tensorrt"``, ``"openvino"`` and
            ``"coreml"``, or ONNX Runtime's names of them, in order of preference. Each may be a
            pair of name and options, as ONNX Runtime takes them:
            ``("tensorrt", {"trt_fp16_enable": True, "trt_engine_cache_enable": True,
            "trt_engine_cache_path": "engines"})``. A provider that is not present is refused. The
            CPU runs the operators that the other providers do not support.
        intra_op_threads: threads per operator, ≥ 1; None for ONNX Runtime's default, one per
            physical core.
    """

    providers: tuple[Provider, ...] = ("cpu",)
    intra_op_threads: int | None = None

    def __post_init__(self) -> None:
        # tuple("cpu") would be three letters.
        given: Any = self.providers
        try:
            entries = (given,) if isinstance(given, str) else tuple(given)
            providers = tuple(map(_checked, entries))
        except (TypeError, ValueError):
            providers = ()
        names = [entry if isinstance(entry, str) else entry[0] for entry in providers]
        if not names or len(set(names)) < len(names):
            raise PerceptionError(
                f"providers must be one or more of {', '.join(map(repr, PROVIDERS))}, each once, "
                f"alone or as a pair of name and options, got {self.providers!r}"
            )
        threads = self.intra_op_threads
        if threads is not None and (
            isinstance(threads, bool) or not isinstance(threads, int) or threads < 1
        ):
            raise PerceptionError(
                f"intra_op_threads must be a whole number of at least 1 or None, got {threads!r}"
            )
        object.__setattr__(self, "providers", providers)

    @property
    def provider_names(self) -> tuple[str, ...]:
        """Names of the providers without their options."""
        return tuple(entry if isinstance(entry, str) else entry[0] for entry in self.providers)

    def provider_options(self, name: str) -> dict[str, str]:
        """Return the options of a provider; empty if it has none."""
        for entry in self.providers:
            if not isinstance(entry, str) and entry[0] == name:
                return {key: str(value) for key, value in dict(entry[1]).items()}
        return {}


def short_name(provider: str) -> str:
    """Return the short name of one of ONNX Runtime's providers; its own name if it has none."""
    return _SHORT.get(provider, provider)


def parse_provider_options(texts: Sequence[str]) -> dict[str, str]:
    """Return the options of ``KEY=VALUE`` texts.

    Raises:
        PerceptionError: for a text without key or ``=``, and a key that is given twice.
    """
    options: dict[str, str] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key.strip() or key.strip() in options:
            raise PerceptionError(
                "an option of a provider must be KEY=VALUE, each key once, for example "
                f"trt_fp16_enable=True, got {text!r}"
            )
        options[key.strip()] = value.strip()
    return options


def _checked(entry: Any) -> str | tuple[str, ProviderOptions]:
    """Return a provider by its short name, and its options as sorted texts.

    Raises:
        ValueError, TypeError: for something else.
    """
    if isinstance(entry, str):
        return _checked_name(entry)
    name, options = entry
    texts = {str(key): str(value) for key, value in dict(options).items()}
    return _checked_name(name), tuple(sorted(texts.items()))


def _checked_name(name: Any) -> str:
    short = short_name(name)
    if short not in PROVIDERS:
        raise ValueError(name)
    return short
