"""The pytest options of the test suite; pytest loads them wherever awarenav is installed.

This module therefore imports nothing heavy. Only the tests of ``--pyargs sim_tests`` read the
options.
"""

from __future__ import annotations

import pytest

#: Sentences to print after the tests.
NOTES = pytest.StashKey[tuple[str, ...]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options, which all begin with ``--awarenav``."""
    group = parser.getgroup("awarenav", "crossings of awarenav (pytest --pyargs sim_tests)")
    for name, metavar, default, text in (
        ("planner", "MODULE:CLASS", "", "your planner (default: the reference planner)"),
        ("policy", "NAME|FILE", "balanced", "preset or policy YAML file (default: balanced)"),
        ("perception", "KIND", "keypoints", "truth, keypoints or pixels (default: keypoints)"),
        ("sensors", "SET", "camera", "camera, camera+scanner or scanner (default: camera)"),
        ("camera", "NAME|FILE", "", "forward, surround or YAML file (default: the scenarios')"),
        ("robot", "NAME|FILE", "", "forklift, omni, delivery or YAML file (default: nova_carter)"),
        ("population", "TEXT", "", "people, as recorded,answers=0.3 (default: the scenarios')"),
        ("fault", "NAME|FILE", "none", "shipped fault or YAML file (default: none)"),
        ("episodes", "N", "3", "seeds per scenario (default: 3)"),
        ("seed", "N", "0", "first seed (default: 0)"),
        ("workers", "N", "", "worker processes (default: one per core)"),
        ("thresholds", "FILE", "", "YAML file of thresholds; docs/test-suite.md has the defaults"),
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


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Print what the episodes say about the planner beside passing or failing."""
    for note in config.stash.get(NOTES, ()):
        terminalreporter.write_line(f"awarenav: {note}", yellow=True)
