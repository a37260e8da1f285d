"""Training goes on from an exported network: its weights, with normalisation put back.

Export folds batch normalisation into convolutions. Here each convolution keeps the folded weights,
and its normalisation gets the statistics of data with the scale and shift that undo them: the
network is the same function, and can be trained.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn


def start_from(net: nn.Module, path: Path, inputs: Iterable[Tensor]) -> None:
    """Give a network the weights of its exported file.

    Args:
        net: the network, whose layers are registered in the order in which they run.
        path: ``.onnx`` file that :mod:`._export` wrote of such a network.
        inputs: normalised batches (N, 3, H, W) for the statistics of the normalisation.

    Raises:
        ValueError: for a file of another network.
    """
    named, folded, multiplied = _weights(path)
    state = net.state_dict()
    for name, array in named.items():
        if name not in state or tuple(state[name].shape) != array.shape:
            raise ValueError(f"{path} is not a file of {type(net).__name__}: {name} {array.shape}")
        state[name] = torch.from_numpy(array)
    net.load_state_dict(state)
    pairs = _normalised_convolutions(net)
    linear = [
        module
        for name, module in net.named_modules()
        if isinstance(module, nn.Linear) and f"{name}.weight" not in named
    ]
    if len(pairs) != len(folded) or len(linear) != len(multiplied):
        raise ValueError(
            f"{path} is not a file of {type(net).__name__}: {len(folded)} convolutions and "
            f"{len(multiplied)} matrices for {len(pairs)} and {len(linear)} layers"
        )
    with torch.no_grad():
        for module, matrix in zip(linear, multiplied, strict=True):
            module.weight.copy_(torch.from_numpy(matrix.T.copy()))
        for (conv, norm), (weight, bias) in zip(pairs, folded, strict=True):
            conv.weight.copy_(torch.from_numpy(weight))
            norm.weight.fill_(1.0)
            norm.bias.copy_(torch.from_numpy(bias))
            norm.running_mean.zero_()
            norm.running_var.fill_(1.0 - norm.eps)
    _normalise(net, pairs, inputs)


def _normalise(
    net: nn.Module, pairs: list[tuple[nn.Conv2d, nn.BatchNorm2d]], inputs: Iterable[Tensor]
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


def _normalised_convolutions(net: nn.Module) -> list[tuple[nn.Conv2d, nn.BatchNorm2d]]:
    """Return the convolutions with the normalisation that follows, in the order of the layers."""
    modules = [module for module in net.modules() if not list(module.children())]
    return [
        (conv, norm)
        for conv, norm in pairwise(modules)
        if isinstance(conv, nn.Conv2d) and isinstance(norm, nn.BatchNorm2d)
    ]


def _weights(
    path: Path,
) -> tuple[dict[str, np.ndarray], list[tuple[np.ndarray, np.ndarray]], list[np.ndarray]]:
    """Return parameters with a name, folded convolutions and unnamed matrices in order."""
    graph = onnx.load(str(path)).graph
    arrays = {
        each.name: numpy_helper.to_array(each).astype(np.float32) for each in graph.initializer
    }
    # Weights stored in half precision are cast first.
    stored = {
        node.output[0]: node.input[0]
        for node in graph.node
        if node.op_type == "Cast" and node.input[0] in arrays
    }
    named = {
        name.removeprefix("net.").removesuffix("_half"): array
        for name, array in arrays.items()
        if name.startswith("net.")
    }
    folded, multiplied = [], []
    for node in graph.node:
        if node.op_type not in ("Conv", "MatMul"):
            continue
        name = stored.get(node.input[1], node.input[1])
        if name.startswith("net.") or name not in arrays:
            continue
        if node.op_type == "Conv":
            folded.append((arrays[name], arrays[stored.get(node.input[2], node.input[2])]))
        else:
            multiplied.append(arrays[name])
    return named, folded, multiplied
