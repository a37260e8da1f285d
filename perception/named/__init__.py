"""Networks by their names, those that pictures get by default, and those they are refused.

The catalogue, the folder of fetched networks, and the one rule of which networks see which pictures
(:func:`default_networks`, :func:`admit_networks`).
"""

from __future__ import annotations

from ._catalogue import DEFAULT_SET, Catalogue, NetworkSet, RealModel, Source
from ._choice import NetworkChoice, admit_networks, default_networks
from ._folder import NetworkFolder, default_folder, sha256_of
from ._load import EYES, Networks, choose_networks

__all__ = [
    "DEFAULT_SET",
    "EYES",
    "Catalogue",
    "NetworkChoice",
    "NetworkFolder",
    "NetworkSet",
    "Networks",
    "RealModel",
    "Source",
    "admit_networks",
    "choose_networks",
    "default_folder",
    "default_networks",
    "sha256_of",
]
