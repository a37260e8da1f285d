"""Which versions a run's results depend on."""

from __future__ import annotations

import platform
from importlib import metadata
from typing import Final

_PACKAGES: Final = ("awarenav", "numpy", "scipy", "opencv-python-headless", "pybullet")


def versions() -> dict[str, str]:
    """What results depend on, beside the jobs themselves."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # pragma: no cover - a checkout on the path
            found[name] = "unknown"
    return found
