"""The shipped network that judges hypotheses about people in a scan."""

from __future__ import annotations

from pathlib import Path
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from .._manifest import LEGS
from ..errors import PerceptionError
from ..networks import OnnxModel, OnnxSettings
from ._hypotheses import HYPOTHESIS_FEATURES

#: Values that a classifier returns for each hypothesis.
JUDGEMENT_SIZE: Final = 5


class LegClassifier(Protocol):
    """Judges hypotheses about people."""

    def __call__(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (H, 5) for features (H, 79).

        They are: the probability of a person; the person's place from the middle of the clusters,
        away from the scanner and to its left; and the standard deviations of both, in metres.
        """
        ...


class OnnxLegClassifier:
    """A classifier from an ONNX file.

    Args:
        path: file with one input (any, 79) and one output (any, 5), both float32; None for the
            shipped network, whose SHA-256 is checked.

    Raises:
        PerceptionError: for a file that cannot be loaded or has another layout.
    """

    def __init__(self, path: str | Path | None = None) -> None:
        settings = OnnxSettings(intra_op_threads=1)
        self._model = (
            OnnxModel.shipped(LEGS, settings)
            if path is None
            else OnnxModel(path, settings=settings)
        )
        inputs, outputs = self._model.inputs, self._model.outputs
        shapes = [tensor.shape for tensor in (*inputs, *outputs)]
        if shapes != [(None, HYPOTHESIS_FEATURES), (None, JUDGEMENT_SIZE)]:
            raise PerceptionError(
                f"a leg classifier has the layout (any, {HYPOTHESIS_FEATURES}) -> "
                f"(any, {JUDGEMENT_SIZE}), got {self._model.layout}"
            )
        self._input = inputs[0].name

    def __call__(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (H, 5) for features (H, 79); see :class:`LegClassifier`."""
        if not len(features):
            return np.zeros((0, JUDGEMENT_SIZE), dtype=np.float32)
        (judged,) = self._model.run({self._input: features}, timed=False)
        return judged
