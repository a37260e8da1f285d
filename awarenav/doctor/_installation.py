"""Findings about an installation: packages, networks and extras."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from typing import Final

import onnxruntime  # type: ignore[import-untyped]

from perception import PerceptionError
from perception.installation import reinstall_command
from perception.named import NetworkFolder
from perception.shipped import shipped_models, verify_shipped_model

from .. import __version__
from ..errors import AwarenavError
from ._findings import Finding

# Packages that both provide the module cv2: whichever was installed last overwrote the other.
_OPENCV: Final = (
    "opencv-python",
    "opencv-python-headless",
    "opencv-contrib-python",
    "opencv-contrib-python-headless",
)
# A module of each extra, and what needs it.
_EXTRAS: Final = (
    ("sim", "pybullet", "crossings"),
    ("ros2", "cyclonedds", "the bridge"),
    ("rosbag", "rosbags", "recordings"),
    ("litert", "ai_edge_litert", "TFLite networks, as those of the set real"),
    ("fetch", "pooch", "networks that no package index has"),
    ("movenet", "onnx", "fetching MoveNet"),
)


def installation_findings() -> list[Finding]:
    """Return the findings about packages, shipped and fetched networks, and extras."""
    return [*_packages(), *_shipped(), *_fetched(), _extras()]


def _packages() -> list[Finding]:
    providers = ", ".join(
        name.removesuffix("ExecutionProvider") for name in onnxruntime.get_available_providers()
    )
    found = [
        Finding.fine(
            "packages",
            f"awarenav {__version__}, Python {platform.python_version()}, onnxruntime "
            f"{onnxruntime.__version__} ({providers})",
        )
    ]
    several = [name for name in _OPENCV if _is_installed(name)]
    if len(several) > 1:
        found.append(
            Finding.warning(
                "packages",
                f"{' and '.join(several)} overwrite each other's files",
                f"pip uninstall {' '.join(several)}, then pip install opencv-python-headless",
            )
        )
    return found


def _is_installed(package: str) -> bool:
    try:
        version(package)
    except PackageNotFoundError:
        return False
    return True


def _shipped() -> list[Finding]:
    try:
        names = [model.name for model in shipped_models()]
        for name in names:
            verify_shipped_model(name)
    except PerceptionError as error:
        return [Finding.error("shipped networks", str(error), reinstall_command())]
    return [Finding.fine("shipped networks", f"{', '.join(names)}: unaltered, for renders only")]


def _fetched() -> list[Finding]:
    try:
        store = NetworkFolder()
        here = [each.name for each in store.catalogue.models if store.is_fetched(each.name)]
    except AwarenavError as error:
        return [Finding.error("fetched networks", str(error))]
    found = []
    for name in here:
        try:
            store.path(name)
        except AwarenavError as error:
            remedy = f"awarenav models fetch {name}"
            found.append(Finding.error("fetched networks", str(error), remedy))
    if found:
        return found
    if here:
        return [Finding.fine("fetched networks", f"{', '.join(here)}: unaltered")]
    return [
        Finding.warning(
            "fetched networks",
            "none: there is no network for photographs",
            "awarenav models fetch real",
        )
    ]


def _extras() -> Finding:
    here = [extra for extra, module, _ in _EXTRAS if find_spec(module)]
    missing = [f"{extra} ({use})" for extra, module, use in _EXTRAS if not find_spec(module)]
    words = [
        f"{state}: {', '.join(names)}"
        for state, names in (("installed", here), ("not installed", missing))
        if names
    ]
    return Finding.fine("extras", "; ".join(words))
