"""ROS 2 itself beside this project's own DDS; all is skipped where rclpy is not installed."""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from local_dds import own_domain

TESTS = Path(__file__).resolve().parents[1]
# The scenes of the bridge's own tests.
sys.path += [str(TESTS / "nav_adapter"), str(TESTS / "awarenav" / "bridge")]

if TYPE_CHECKING:
    from nav_adapter.ros2 import Topic

PATIENCE_S = 30.0


def until(condition: Callable[[], Any]) -> Any:
    """Return what the condition returns as soon as it holds, or at last."""
    end = time.monotonic() + PATIENCE_S
    while not (found := condition()) and time.monotonic() < end:
        pass
    return found


def qos(topic: Topic) -> Any:
    """Return a topic's quality of service for rclpy."""
    from nav_adapter.ros2.node import _qos  # noqa: PLC0415 - needs rclpy

    return _qos(topic)


@pytest.fixture(scope="session", autouse=True)
def _domain() -> Iterator[None]:
    """Keep both vendors' DDS on this computer, in a domain of their own."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        rclpy = pytest.importorskip("rclpy", reason="no rclpy: python -m tools.setup_ros2")
        import rosidl_generator_py  # noqa: F401, PLC0415 - its parser's old imports
    with pytest.MonkeyPatch.context() as patch:
        own_domain(patch)
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        rclpy.init()
        yield
        rclpy.shutdown()


@pytest.fixture
def peer() -> Iterator[Any]:
    """Return a node of rclpy."""
    import rclpy  # noqa: PLC0415 - skipped without it

    made = rclpy.create_node("peer")
    yield made
    made.destroy_node()


@pytest.fixture
def node() -> Iterator[Any]:
    """Return a DDS node of this project."""
    from nav_adapter.ros2 import DdsNode  # noqa: PLC0415 - needs the extra ros2

    made = DdsNode(int(os.environ["ROS_DOMAIN_ID"]))
    yield made
    made.close()
