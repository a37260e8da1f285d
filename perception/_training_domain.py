"""The images that a network has seen in training: renders, or photographs of real people."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

from ._manifest import TRAINING_DOMAIN_KEY, TRAINING_DOMAINS, TrainingDomain, shipped_models
from .errors import PerceptionError


def training_domain_of(content: bytes, metadata: Mapping[str, str]) -> TrainingDomain | None:
    """Return what a network has seen in training; None if nothing says so.

    Its metadata say it under ``training_domain``. A copy of a shipped network is known by its
    SHA-256.

    Args:
        content: of the ONNX file.
        metadata: of the ONNX file.
    """
    told = metadata.get(TRAINING_DOMAIN_KEY)
    for domain in TRAINING_DOMAINS:
        if told == domain:
            return domain
    try:
        alike = [model for model in shipped_models() if model.size_bytes == len(content)]
    except PerceptionError:  # a damaged installation: loading a shipped network says so
        return None
    sha256 = hashlib.sha256(content).hexdigest() if alike else ""
    return next((model.training_domain for model in alike if model.sha256 == sha256), None)


def simulator_networks(domains: Mapping[str, TrainingDomain | None]) -> tuple[str, ...]:
    """Return the roles whose networks have seen renders only.

    Args:
        domains: training domain of each network by its role: ``"detector"``, ``"pose"``, …
    """
    return tuple(role for role, domain in domains.items() if domain == "renders")


def simulator_networks_warning(roles: tuple[str, ...]) -> str:
    """Return a sentence about networks that have seen renders only, without a full stop."""
    if len(roles) == 1:
        return f"the {roles[0]} network has seen renders only, and no photograph of a person"
    listed = f"{', '.join(roles[:-1])} and {roles[-1]}"
    return f"the {listed} networks have seen renders only, and no photograph of a person"
