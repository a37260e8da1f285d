"""Training goes on from an exported network: its weights, with normalisation put back.

Export folds batch normalisation into convolutions. Here each convolution keeps the folded weights,
and its normalisation gets the statistics of data with the scale and shift that undo them: the
network is the same function, and can be trained.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn

from .quantise import dequantised

# Batches for the statistics of the normalisation.
_BATCHES: Final = 16
# Number of the first of them, beyond those that are trained on.
_BEYOND: Final = 2**31
# The exported module holds the network under this name.
_PREFIX: Final = "net."
# What quantisation adds to the name of a weight that is stored in 8 bits.
_DEQUANTISED: Final = "_DequantizeLinear_Output"


def unseen(batch_of: Callable[[int], Tensor]) -> Iterator[Tensor]:
    """Yield batches beyond those that are trained on, for the statistics of the normalisation."""
    return (batch_of(_BEYOND + number) for number in range(_BATCHES))


def start_from(net: nn.Module, path: Path, inputs: Iterable[Tensor]) -> None:
    """Give a network the weights of its exported file.

    Args:
        net: the network.
        path: ``.onnx`` file that :mod:`._export` wrote of such a network, in 8 bits or not.
        inputs: normalised batches (N, 3, H, W), at least one, for the statistics of the
            normalisation.

    Raises:
        ValueError: for a file of another network.
    """
    arrays, layers = _weights(path)
    state = net.state_dict()
    named = {
        name.removeprefix(_PREFIX): array
        for name, array in arrays.items()
        if name.startswith(_PREFIX)
    }
    for name, array in named.items():
        if name not in state or tuple(state[name].shape) != array.shape:
            raise ValueError(f"{path} is not a file of {type(net).__name__}: {name} {array.shape}")
        state[name] = torch.from_numpy(array)
    for name, parameter in net.named_parameters(recurse=False):
        if name not in named:
            state[name] = _parameter_of_shape(path, list(arrays.values()), tuple(parameter.shape))
    net.load_state_dict(state)
    modules, norm_of = dict(net.named_modules()), _normalised_convolutions(net)
    unknown = [name for name in layers if name not in modules]
    folded = {modules[name] for name in layers if name in modules} & set(norm_of)
    if unknown or len(folded) != len(norm_of):
        raise ValueError(
            f"{path} is not a file of {type(net).__name__}: it has {len(folded)} of "
            f"{len(norm_of)} normalised convolutions"
            + (f", and layers such as {unknown[0]}" if unknown else "")
        )
    with torch.no_grad():
        for name, (weight, bias) in layers.items():
            module = modules[name]
            if module not in norm_of:
                module.weight.copy_(torch.from_numpy(weight.T.copy()))
                continue
            norm = norm_of[module]
            module.weight.copy_(torch.from_numpy(weight))
            norm.weight.fill_(1.0)
            norm.bias.copy_(torch.from_numpy(bias))
            norm.running_mean.zero_()
            norm.running_var.fill_(1.0 - norm.eps)
    _normalise(net, list(norm_of.items()), inputs)


def _normalise(
    net: nn.Module, pairs: list[tuple[nn.Module, nn.BatchNorm2d]], inputs: Iterable[Tensor]
) -> None:
    """Give each normalisation the statistics of its input, and the scale and shift to match."""
    sums = [torch.zeros(3, norm.num_features, dtype=torch.float64) for _, norm in pairs]
    hooks = [
        conv.register_forward_hook(lambda _, __, out, total=total: _add_up(total, out))
        for (conv, _), total in zip(pairs, sums, strict=True)
    ]
    net.eval()
    with torch.no_grad():
        for batch in inputs:
            net(batch)
        for hook in hooks:
            hook.remove()
        for (_, norm), (count, first, second) in zip(pairs, sums, strict=True):
            mean = first / count
            variance = (second / count - mean**2).clamp(min=1e-6)
            norm.running_mean.copy_(mean)
            norm.running_var.copy_(variance)
            norm.weight.copy_((variance + norm.eps).sqrt())
            norm.bias.add_(mean.float())


def _add_up(total: Tensor, out: Tensor) -> None:
    values = out.double()
    total[0] += values.numel() / values.shape[1]
    total[1] += values.sum((0, 2, 3))
    total[2] += (values**2).sum((0, 2, 3))


def _normalised_convolutions(net: nn.Module) -> dict[nn.Module, nn.BatchNorm2d]:
    """Return the convolutions with the normalisation that follows each."""
    modules = [module for module in net.modules() if not list(module.children())]
    return {
        conv: norm
        for conv, norm in pairwise(modules)
        if isinstance(conv, nn.Conv2d) and isinstance(norm, nn.BatchNorm2d)
    }


def _parameter_of_shape(path: Path, arrays: list[np.ndarray], shape: tuple[int, ...]) -> Tensor:
    """Return a parameter that export stores without its name, with axes of one before it."""
    found = [
        array
        for array in arrays
        if array.ndim > len(shape) and array.shape == (1,) * (array.ndim - len(shape)) + shape
    ]
    if len(found) != 1:
        raise ValueError(f"{path} has {len(found)} parameters of shape {shape}, not one")
    return torch.from_numpy(found[0].reshape(shape))


def _weights(
    path: Path,
) -> tuple[dict[str, np.ndarray], dict[str, tuple[np.ndarray, np.ndarray | None]]]:
    """Return the arrays by name, and weights and bias by layer of those that have no name."""
    graph = onnx.load(str(path)).graph
    arrays = {each.name: numpy_helper.to_array(each) for each in graph.initializer}
    quantised: set[str] = set()
    for node in graph.node:
        if not node.input or node.input[0] not in arrays:
            continue
        if node.op_type == "Cast":  # weights in half precision
            arrays[node.output[0]] = arrays.pop(node.input[0])
        elif node.op_type == "Identity":  # two weights with the same numbers are stored once
            arrays[node.output[0]] = arrays[node.input[0]]
        elif node.op_type == "DequantizeLinear":  # weights in 8 bits
            quantised.update(node.input)
            arrays[node.output[0].removesuffix(_DEQUANTISED)] = dequantised(node, arrays)
    arrays = {
        name: array.astype(np.float32) for name, array in arrays.items() if name not in quantised
    }
    layers = {}
    for node in graph.node:
        if node.op_type not in ("Conv", "MatMul"):
            continue
        weight, *bias = (name.removesuffix(_DEQUANTISED) for name in node.input[1:])
        if weight in arrays and not weight.startswith(_PREFIX):
            layers[_layer(node.name)] = arrays[weight], arrays[bias[0]] if bias else None
    return arrays, layers


def _layer(node: str) -> str:
    """Return the name of the layer of a node: ``/net/a/a.2/b/b.0/Conv`` is layer ``a.2.b.0``."""
    parts = node.strip("/").split("/")[:-1]
    inner = [
        part
        for part, after in zip(parts, [*parts[1:], ""], strict=True)
        if not after.startswith(f"{part}.")
    ]
    return ".".join(inner).removeprefix(_PREFIX)
