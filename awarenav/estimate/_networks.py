"""The networks of a command's options."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from perception.named import DEFAULT_SET, EYES, NetworkChoice, Networks, admit_networks
from perception.networks import OnnxSettings, parse_provider_options


def choice_of_options(
    options: Any, *, rendered: bool, log: Callable[[str], None] | None = None
) -> NetworkChoice:
    """Return the choice of a command's options: that of ``networks``, else of the other ones.

    An option that is not given leaves the value of ``networks``, or without it that of
    :meth:`~perception.named.NetworkChoice.default`.

    Args:
        options: with ``networks``, a set, a path or None, and an attribute for each name of the
            choice; None for an option that is not given.
        rendered: the pictures are renders of this package.
        log: gets one message if the fetched set is used.

    Raises:
        AwarenavError: for a file that cannot be read.
    """
    values = {name: getattr(options, name, None) for name in NetworkChoice.model_fields}
    given = {name: value for name, value in values.items() if value is not None}
    if options.networks is not None:
        return NetworkChoice.of(options.networks).model_copy(update=given)
    # Whoever allows networks of renders has asked for them.
    simulator = rendered or getattr(options, "allow_simulator_networks", False)
    default = NetworkChoice.default(simulator=simulator)
    chosen = default.model_copy(update=given)
    if log is not None and default != NetworkChoice():
        used = chosen.model_dump(exclude_none=True).items()
        named = ", ".join(f"{role} {name}" for role, name in used if name not in EYES)
        log(f"networks of the fetched set {DEFAULT_SET}: {named}")
    return chosen


def running_options(options: Any) -> dict[str, Any]:
    """Return what a command's options say of how networks run, for :meth:`NetworkChoice.load`."""
    provider = options.provider, parse_provider_options(options.provider_options.split())
    return {
        "settings": OnnxSettings((provider,), options.threads),
        "detect_every_s": options.detect_every_s,
    }


def admit_options(networks: Networks, options: Any, *, rendered: bool) -> tuple[str, ...]:
    """Return the roles of networks that see such pictures for the first time, if a command may.

    Raises:
        PerceptionError: as :func:`~perception.named.admit_networks`.
    """
    return admit_networks(
        networks,
        rendered=rendered,
        allowed=options.allow_simulator_networks,
        or_else="add --allow-simulator-networks",
    )
