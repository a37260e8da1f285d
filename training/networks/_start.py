"""Training goes on from an exported network: its weights, with normalisation put back.

Export folds batch normalisation into convolutions. Here each convolution keeps the folded weights,
and its normalisation gets the statistics of data with the scale and shift that undo them: the
network is the same function, and can be trained.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import chain, pairwise
from pathlib import Path
from typing import Final

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn

# Batches for the statistics of the normalisation.
_BATCHES: Final = 16
# Number of the first of them, beyond those that are trained on.
_BEYOND: Final = 2**31


def unseen(batch_of: Callable[[int], Tensor]) -> Iterator[Tensor]:
    """Yield batches beyond those that are trained on, for the statistics of the normalisation."""
    return (batch_of(_BEYOND + number) for number in range(_BATCHES))


def start_from(net: nn.Module, path: Path, inputs: Iterable[Tensor]) -> None:
    """Give a network the weights of its exported file.

    Args:
        net: the network.
        path: ``.onnx`` file that :mod:`._export` wrote of such a network.
        inputs: normalised batches (N, 3, H, W), at least one, for the order in which the layers
            run and the statistics of the normalisation.

    Raises:
        ValueError: for a file of another network.
    """
    arrays, named, folded, multiplied = _weights(path)
    state = net.state_dict()
    for name, array in named.items():
        if name not in state or tuple(state[name].shape) != array.shape:
            raise ValueError(f"{path} is not a file of {type(net).__name__}: {name} {array.shape}")
        state[name] = torch.from_numpy(array)
    for name, parameter in net.named_parameters(recurse=False):
        if name not in named:
            state[name] = _parameter_of_shape(path, arrays, tuple(parameter.shape))
    net.load_state_dict(state)
    batches = iter(inputs)
    first = next(batches)
    running = _running_order(net, first)
    norm_of = _normalised_convolutions(net)
    pairs = [(each, norm_of[each]) for each in running if each in norm_of]
    known = {module for name, module in net.named_modules() if f"{name}.weight" in named}
    linear = [each for each in running if isinstance(each, nn.Linear) and each not in known]
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
    _normalise(net, pairs, chain([first], batches))


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


def _running_order(net: nn.Module, batch: Tensor) -> list[nn.Module]:
    """Return the layers in the order in which they run, as the nodes of an exported file stand."""
    running: list[nn.Module] = []
    hooks = [
        module.register_forward_hook(lambda module, _, __: running.append(module))
        for module in net.modules()
        if not list(module.children())
    ]
    net.eval()
    with torch.no_grad():
        net(batch)
    for hook in hooks:
        hook.remove()
    return running


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
) -> tuple[
    list[np.ndarray],
    dict[str, np.ndarray],
    list[tuple[np.ndarray, np.ndarray]],
    list[np.ndarray],
]:
    """Return all arrays, those with a name, folded convolutions and unnamed matrices in order."""
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
    return list(arrays.values()), named, folded, multiplied
