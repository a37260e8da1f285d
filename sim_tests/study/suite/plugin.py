"""Options of the crossings' test-suite; pytest loads this wherever awarenav is installed.

So it must cost nothing and touch nothing: it adds options, and without ``--pyargs sim_tests``
nothing reads them.
"""

from __future__ import annotations

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options, all of which begin with ``--awarenav``."""
    group = parser.getgroup("awarenav", "crossings of awarenav (pytest --pyargs sim_tests)")
    for name, metavar, default, text in (
        ("planner", "MODULE:CLASS", "", "your planner (default: the reference planner)"),
        ("policy", "NAME|FILE", "balanced", "preset or policy YAML file (default: balanced)"),
        ("perception", "KIND", "keypoints", "truth, keypoints or pixels (default: keypoints)"),
        ("camera", "NAME|FILE", "", "forward, surround or YAML file (default: the scenarios')"),
        ("fault", "NAME|FILE", "none", "shipped fault or YAML file (default: none)"),
        ("episodes", "N", "3", "seeds a scenario (default: 3)"),
        ("seed", "N", "0", "the first of them (default: 0)"),
        ("workers", "N", "", "processes (default: one a core)"),
        ("thresholds", "FILE", "", "YAML of what to hold; docs/test-suite.md has the default"),
        ("out", "DIR", "awarenav-suite", "folder for the results (default: awarenav-suite)"),
    ):
        group.addoption(f"--awarenav-{name}", metavar=metavar, default=default, help=text)
    group.addoption(
        "--awarenav-scenario",
        metavar="NAME|FILE",
        action="append",
        default=[],
        help="shipped scenario or YAML file; may be given more than once (default: all)",
    )
