"""The distributions in a scenario's data: find them by path, put numbers in their place."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from typing import Any, Final

from awarenav.errors import not_one_of
from perception.arrays import finite_number

from ..world.errors import SimError
from ._distributions import DISTRIBUTIONS, Distribution, read_distribution

# Keys whose numbers may vary. Hall, camera and duration are the same in every episode.
_VARIABLE: Final = ("people", "robot")


def find_parameters(data: Mapping[str, Any], source: str) -> dict[str, Distribution]:
    """Return the distributions in a scenario's data by dotted path, as ``"people.0.speed_mps"``.

    Args:
        data: the keys of a scenario, as read from YAML.
        source: name of the scenario in messages.

    Raises:
        SimError: for an impossible distribution, and for one outside people and robot.
    """
    found: dict[str, Distribution] = {}
    for path, kind, settings in _distributions_in(data, (), source):
        dotted = ".".join(path)
        if path[0] == "workers":
            continue  # scripts are refused with the scenario, see Scenario
        if path[0] not in _VARIABLE:
            raise SimError(
                f"{source}: {dotted}: only numbers under {', '.join(_VARIABLE)} may be "
                f"distributions, got {kind}"
            )
        found[dotted] = read_distribution(f"{source}: {dotted}", kind, settings)
    return found


def with_numbers(
    data: Mapping[str, Any],
    parameters: Mapping[str, Distribution],
    values: Mapping[str, float],
    source: str,
) -> dict[str, Any]:
    """Return the data with a number in place of each distribution.

    Args:
        data: the keys of a scenario.
        parameters: its distributions, from :func:`find_parameters`.
        values: numbers for some parameters; the others get their medians.
        source: name of the scenario in messages.

    Raises:
        SimError: for a path that is no parameter, and for a value that is not finite.
    """
    for path in values:
        if path not in parameters:
            raise SimError(f"{source}: {not_one_of('a parameter', path, parameters)}")
    filled = copy.deepcopy(dict(data))
    for path, distribution in parameters.items():
        value = values.get(path)
        if value is None:
            value = distribution.median
        _set_number(filled, path, finite_number(path, value, SimError))
    return filled


def _distributions_in(
    node: Any, path: tuple[str, ...], source: str
) -> Iterator[tuple[tuple[str, ...], str, Any]]:
    """Yield path, kind and settings of every distribution in a tree of mappings and lists."""
    if isinstance(node, Mapping):
        kinds = [key for key in node if key in DISTRIBUTIONS]
        if kinds and path:
            if len(node) > 1:
                raise SimError(
                    f"{source}: {'.'.join(path)}: a distribution must be the only key, got "
                    f"{', '.join(map(str, node))}"
                )
            yield path, kinds[0], node[kinds[0]]
            return
        for key, value in node.items():
            yield from _distributions_in(value, (*path, str(key)), source)
    elif isinstance(node, list | tuple):
        for number, value in enumerate(node):
            yield from _distributions_in(value, (*path, str(number)), source)


def _set_number(data: Any, path: str, value: float) -> None:
    *parents, last = path.split(".")
    node = data
    for key in parents:
        node = node[int(key) if isinstance(node, list) else key]
    node[int(last) if isinstance(node, list) else last] = value
