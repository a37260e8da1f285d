"""The generated pages of the site's reference."""

from __future__ import annotations

from typing import Final

from nav_adapter import AwarenessPolicy, InflationPolicy, SpeedPolicy
from nav_adapter.policies import InterpolatedHumanSpeed, InterpolatedInflation
from nav_adapter.ros2 import RobotFile
from sim_tests.crossing.faults import Fault
from sim_tests.dataset import RenderConfig
from sim_tests.scenario import Scenario
from tracking import TrackerConfig

from .api_pages import PACKAGES, front_door_page, package_page
from .command_page import commands_page
from .config_pages import ConfigPage
from .table_pages import metrics_page, topics_page

_INDEX: Final = """# Reference

Everything here is made from the code of this version.

- **Python**: [perception](perception.md) (with [laser](perception.laser.md),
  [surround](perception.surround.md), [networks](perception.networks.md)),
  [tracking](tracking.md), [nav_adapter](nav_adapter.md) (with
  [alerts](nav_adapter.alerts.md), [policies](nav_adapter.policies.md),
  [exporters](nav_adapter.exporters.md), [ros2](nav_adapter.ros2.md)), [awarenav](awarenav.md),
  [sim_tests](sim_tests.md)
- **[Commands](commands.md)** of `awarenav`, with every option
- **Files**: keys of a [policy](policy-keys.md), a [scenario](scenario-keys.md), a
  [tracker](tracker-keys.md), a [fault](fault-keys.md), the [bridge's robot](robot-keys.md)
  and [rendered sets](render-keys.md)
- **[Metrics](metrics.md)** and columns of `episodes.csv`, and their
  [definitions](../metrics.md)
- **[ROS 2 topics](topics.md)** of the bridge
"""
_KEYS: Final = """The suffix of a key is its unit. An unknown key is refused with the nearest valid
one. A key that is left out has its default; "null" stands for nothing in YAML."""

CONFIG_PAGES: Final = {
    "policy-keys": ConfigPage(
        "Policy keys",
        f"The keys of a policy's file, for [policies](../policies.md). {_KEYS}",
        AwarenessPolicy,
        alternatives={
            InflationPolicy: (InterpolatedInflation,),
            SpeedPolicy: (InterpolatedHumanSpeed,),
        },
    ),
    "scenario-keys": ConfigPage(
        "Scenario keys",
        f"The keys of a scenario's file, for [scenarios](../scenarios.md). {_KEYS} Any number "
        "under `people`, `workers` and `robot` may be a [distribution](../scenarios.md).",
        Scenario,
    ),
    "tracker-keys": ConfigPage(
        "Tracker keys", f"Settings of the tracker, for [tracking](../tracking.md). {_KEYS}",
        TrackerConfig,
    ),
    "fault-keys": ConfigPage(
        "Fault keys", f"The keys of a fault, for [runs and faults](../runs.md). {_KEYS}", Fault
    ),
    "robot-keys": ConfigPage(
        "Robot file of the bridge",
        f"The file that `awarenav bridge --robot` reads, for [Nav2](../nav2.md). {_KEYS}",
        RobotFile,
    ),
    "render-keys": ConfigPage(
        "Settings of rendered sets",
        f"The settings of `awarenav render`, for [rendered images](../rendering.md). {_KEYS}",
        RenderConfig,
    ),
}  # fmt: skip


def pages() -> dict[str, str]:
    """Return the Markdown of every generated page of the reference, by its path on the site."""
    return {
        "reference/index.md": _INDEX,
        **{f"reference/{package}.md": package_page(package) for package in PACKAGES},
        "reference/awarenav.md": front_door_page(),
        "reference/commands.md": commands_page(),
        **{f"reference/{name}.md": page.markdown() for name, page in CONFIG_PAGES.items()},
        "reference/metrics.md": metrics_page(),
        "reference/topics.md": topics_page(),
    }
