"""Settings for the tests of nav_adapter."""

from __future__ import annotations

from importlib.util import find_spec

from hypothesis import HealthCheck, settings

# A busy computer must not fail a property for being slow.
settings.register_profile(
    "nav_adapter", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("nav_adapter")

WITH_ROS2 = all(find_spec(name) is not None for name in ("cyclonedds", "mcap", "rosbags"))
collect_ignore_glob = [] if WITH_ROS2 else ["test_ros2_*.py"]


def pytest_report_header() -> list[str]:
    """Say which tests are left out."""
    return [] if WITH_ROS2 else ["without tests of ROS 2: the extra ros2 is not installed"]
