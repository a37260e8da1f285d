"""A small network in NumPy: forward, gradient, training and ONNX export."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from perception.laser import CUTOUT, HYPOTHESIS_FEATURES

from ._samples import Samples

Weights = dict[str, NDArray[np.float64]]

HIDDEN: Final = 80
OUTPUTS: Final = 5
# Limits of the logarithm of the standard deviations in metres.
_LOG_STD: Final = (-4.5, -0.5)
_OPSET: Final = 17
_CLUSTER: Final = 11
# Weight of the place's likelihood beside the cross entropy.
_PLACE: Final = 0.1


def fresh_weights(samples: Samples, rng: np.random.Generator) -> Weights:
    """Return random weights behind a normalisation of the features."""
    mean, std = samples.features.mean(axis=0), samples.features.std(axis=0)
    sizes = [HYPOTHESIS_FEATURES, HIDDEN, HIDDEN, OUTPUTS]
    weights: Weights = {"mean": mean.astype(np.float64), "scale": 1.0 / (std + 1e-3)}
    for row, (inputs, outputs) in enumerate(pairwise(sizes)):
        scale = np.sqrt((2.0 if row < 2 else 1.0) / inputs)
        weights[f"w{row}"] = scale * rng.normal(size=(inputs, outputs))
        weights[f"b{row}"] = np.zeros(outputs)
    weights["b2"][3:] = -2.5
    return weights


def forward(weights: Weights, features: NDArray[Any]) -> tuple[NDArray[Any], list[NDArray[Any]]]:
    """Return (S, 5) logit, place and log standard deviations, and the layers' values."""
    layers = [(features - weights["mean"]) * weights["scale"]]
    for row in (0, 1):
        layers.append(np.maximum(layers[-1] @ weights[f"w{row}"] + weights[f"b{row}"], 0.0))
    return layers[-1] @ weights["w2"] + weights["b2"], layers


def gradients(
    weights: Weights, features: NDArray[Any], person: NDArray[Any], offset_m: NDArray[Any]
) -> tuple[float, Weights]:
    """Return the loss and its gradient: cross entropy, and the places' negative log likelihood."""
    out, layers = forward(weights, features)
    count = len(out)
    logit = out[:, 0]
    probability = 1.0 / (1.0 + np.exp(-np.clip(logit, -30.0, 30.0)))
    entropy = np.maximum(logit, 0.0) - logit * person + np.log1p(np.exp(-np.abs(logit)))
    log_std = np.clip(out[:, 3:], *_LOG_STD)
    error = (out[:, 1:3] - offset_m) * np.exp(-log_std)
    likelihood = person * (0.5 * error * error + log_std).sum(axis=1)
    d_out = np.zeros_like(out)
    d_out[:, 0] = probability - person
    d_out[:, 1:3] = _PLACE * person[:, None] * error * np.exp(-log_std)
    inside = (out[:, 3:] > _LOG_STD[0]) & (out[:, 3:] < _LOG_STD[1])
    d_out[:, 3:] = _PLACE * person[:, None] * (1.0 - error * error) * inside
    d_out /= count
    found: Weights = {}
    back = d_out
    for row in (2, 1, 0):
        found[f"w{row}"] = layers[row].T @ back
        found[f"b{row}"] = back.sum(axis=0)
        if row:
            back = (back @ weights[f"w{row}"].T) * (layers[row] > 0.0)
    return float((entropy + _PLACE * likelihood).mean()), found


def mirrored(features: NDArray[Any], offset_m: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return hypotheses as a mirror shows them: right and left are exchanged."""
    out = features.copy()
    pair = features[:, 2 * _CLUSTER] > 0.5
    one, other = features[:, :_CLUSTER], features[:, _CLUSTER : 2 * _CLUSTER]
    out[:, :_CLUSTER] = np.where(pair[:, None], other, one)
    out[:, _CLUSTER : 2 * _CLUSTER] = np.where(pair[:, None], one, other)
    for first in (0, _CLUSTER):
        steps = out[:, first + 7 : first + 9].copy()
        out[:, first + 7], out[:, first + 8] = steps[:, 1], steps[:, 0]
        out[:, first + 9] *= -1.0
    out[:, -CUTOUT:] = features[:, : -CUTOUT - 1 : -1]
    out[:, 2 * _CLUSTER + 2] *= -1.0  # the left cluster, formerly the right, farther along the ray
    return out, offset_m * (1.0, -1.0)


def export(weights: Weights, deviation_factors: NDArray[Any], path: Path) -> None:
    """Write the network as ONNX: features (any, 79) to probability, place and deviations (any, 5).

    ``deviation_factors`` (2,) multiply the standard deviations, as calibrated on held-out people.
    """
    constants = {name: value.astype(np.float32) for name, value in weights.items()}
    constants["factors"] = deviation_factors.astype(np.float32)
    constants["low"], constants["high"] = (np.float32(limit) for limit in _LOG_STD)
    constants["split"] = np.array([1, 2, 2], dtype=np.int64)
    steps = [
        helper.make_node("Sub", ["features", "mean"], ["centred"]),
        helper.make_node("Mul", ["centred", "scale"], ["x0"]),
    ]
    for row in (0, 1, 2):
        steps.append(helper.make_node("Gemm", [f"x{row}", f"w{row}", f"b{row}"], [f"y{row}"]))
        if row < 2:
            steps.append(helper.make_node("Relu", [f"y{row}"], [f"x{row + 1}"]))
    steps += [
        helper.make_node("Split", ["y2", "split"], ["logit", "place", "log_std"], axis=1),
        helper.make_node("Sigmoid", ["logit"], ["probability"]),
        helper.make_node("Clip", ["log_std", "low", "high"], ["limited"]),
        helper.make_node("Exp", ["limited"], ["raw_std"]),
        helper.make_node("Mul", ["raw_std", "factors"], ["std"]),
        helper.make_node("Concat", ["probability", "place", "std"], ["judged"], axis=1),
    ]
    graph = helper.make_graph(
        steps,
        "leg_classifier",
        [helper.make_tensor_value_info("features", TensorProto.FLOAT, ["H", HYPOTHESIS_FEATURES])],
        [helper.make_tensor_value_info("judged", TensorProto.FLOAT, ["H", OUTPUTS])],
        [numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", _OPSET)])
    model.ir_version = 8
    helper.set_model_props(model, {"training_domain": "simulated scans"})
    onnx.checker.check_model(model)
    path.write_bytes(model.SerializeToString())
