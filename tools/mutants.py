"""Change one constant of safety or geometry at a time, and check that a test fails.

    python -m tools.mutants            every mutant
    python -m tools.mutants brisk z_   those whose name holds one of the words

Each line of MUTANTS names a file, its text, another text, and the tests that must notice. A copy of
the checkout is changed, never the checkout. Exit status: 0 every mutant died, 1 one survived, 2 the
table does not fit the code or the tests fail without any change.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

ROOT: Final = Path(__file__).resolve().parents[1]
COPIED: Final = (
    *("perception", "tracking", "nav_adapter", "awarenav", "sim_tests", "benchmarks", "tests"),
    *("docs", "examples", "pyproject.toml", "README.md"),
)
_LIMIT: Final = "tests/nav_adapter/test_limit.py"
_SEPARATION: Final = "tests/nav_adapter/test_separation.py"


class Mutant(NamedTuple):
    """One change of one place."""

    name: str
    file: str
    text: str
    changed: str
    tests: str


# fmt: off
MUTANTS: Final = (
    # Reach and limit: every term of the model is needed.
    Mutant("reach_delay", "nav_adapter/_contact.py", "since_s = t1_s + elapsed_s + delay_s", "since_s = t1_s + elapsed_s", _LIMIT),
    Mutant("reach_age", "nav_adapter/_contact.py", "m1 = tau * -_expm1(-(t1_s + elapsed_s) / tau)", "m1 = tau * -_expm1(-t1_s / tau)", _LIMIT),
    Mutant("time_constant", "nav_adapter/_contact.py", "reach = U * (since_s + tau * _expm1(-since_s / tau))", "reach = U * (since_s + 2.0 * tau * _expm1(-since_s / tau))", _LIMIT),
    Mutant("way_between_steps", "nav_adapter/_contact.py", "reach += 0.5 * (m1 - m0)", "reach += 0.0 * (m1 - m0)", _LIMIT),
    Mutant("other_courses", "nav_adapter/_contact.py", "low_x, low_y = cos * x + sin * y, cos * y - sin * x", "low_x, low_y = x, y", _LIMIT),
    Mutant("corner", "nav_adapter/_contact.py", "if beyond > half:", "if beyond > 1e9:", _LIMIT),
    Mutant("braking_way", "nav_adapter/limit.py", "braked1_m = 0.5 * a * (t1 - T) * (t1 - T)", "braked1_m = 0.6 * a * (t1 - T) * (t1 - T)", _LIMIT),
    Mutant("reaction", "nav_adapter/limit.py", "a, T = course.deceleration_mps2, course.reaction_s + person.elapsed_s", "a, T = course.deceleration_mps2, person.elapsed_s", _LIMIT),
    Mutant("walking_on", "nav_adapter/reach.py", "> self.speed_mps + SAME_MPS", "> 9.0 + SAME_MPS", "tests/nav_adapter/test_safety_pages.py"),
    Mutant("reaction_way", "nav_adapter/_separation.py", "b = a * T + v_h", "b = v_h", _SEPARATION),
    Mutant("slowest_speed_limit", "nav_adapter/ros2/_speed_limit.py", "SLOWEST_MPS: Final = 0.01", "SLOWEST_MPS: Final = 0.0", "tests/nav_adapter/test_ros2_conversions.py"),
    # Policies.
    Mutant("least_clearance", "nav_adapter/policies/_settings.py", "Field(default=0.10, ge=0.10, le=2.0)", "Field(default=0.10, ge=0.05, le=2.0)", "tests/nav_adapter/test_policy.py"),
    Mutant("unseen_sigmas", "nav_adapter/policies/_settings.py", "unseen_sigmas: float = Field(default=2.5", "unseen_sigmas: float = Field(default=2.0", "tests/nav_adapter"),
    Mutant("unaware_human_speed", "nav_adapter/policies/_awareness.py", "unaware_human_speed_mps: float = Field(default=1.5", "unaware_human_speed_mps: float = Field(default=1.2", "tests/nav_adapter/test_policy_docs.py"),
    Mutant("stale_after", "nav_adapter/policies/_settings.py", "stale_after_s: float = Field(default=0.5", "stale_after_s: float = Field(default=1.0", "tests/nav_adapter"),
    # Bodies and heads.
    Mutant("body_radius", "perception/anthropometry.py", "BODY_RADIUS_M: Final = 0.30", "BODY_RADIUS_M: Final = 0.25", "tests/nav_adapter tests/perception/test_body.py"),
    Mutant("head_stature", "perception/_placement.py", "_HEAD_STATURE_STD: Final = 0.4 * 0.04", "_HEAD_STATURE_STD: Final = 0.0", "tests/perception/test_head_range.py"),
    Mutant("head_template", "perception/anthropometry.py", "[-0.012, -0.110, -0.078]", "[-0.012, -0.090, -0.078]", "tests/perception/test_head_pose.py"),
    Mutant("cone", "perception/awareness.py", "DEFAULT_HALF_ANGLE_RAD: Final = math.radians(60.0)", "DEFAULT_HALF_ANGLE_RAD: Final = math.radians(75.0)", "tests/perception/test_attention.py"),
    Mutant("z_range", "perception/networks/poses/_simcc.py", "Z_RANGE_M: Final = 2.1744869", "Z_RANGE_M: Final = 2.1", "tests/perception/networks"),
    Mutant("crop_padding", "perception/networks/poses/_crops.py", "BOX_PADDING: Final = 1.25", "BOX_PADDING: Final = 1.15", "tests/perception/networks"),
    # Tracks.
    Mutant("acceleration_density", "tracking/_config.py", "acceleration_density_m2ps3: float = Field(default=0.05", "acceleration_density_m2ps3: float = Field(default=0.005", "tests/tracking"),
    Mutant("gate_distance", "tracking/_config.py", "gate_distance_m: float = Field(default=1.0", "gate_distance_m: float = Field(default=3.0", "tests/tracking"),
    Mutant("standing_chi2", "tracking/_track_management.py", "_STANDING_CHI2: Final = 4.605", "_STANDING_CHI2: Final = 46.05", "tests/tracking"),
    Mutant("lower_bound", "tracking/_config.py", "lower_bound_confidence: float = Field(default=0.9", "lower_bound_confidence: float = Field(default=0.6", "tests/tracking"),
    Mutant("no_evidence", "tracking/_config.py", "unseen_time_constant_s: float = Field(default=0.3", "unseen_time_constant_s: float = Field(default=3.0", "tests/tracking"),
)
# fmt: on


def main(words: Sequence[str]) -> int:
    """Run the mutants and return the exit status."""
    chosen = [each for each in MUTANTS if not words or any(word in each.name for word in words)]
    if not chosen:
        print(f"no mutant's name holds one of {', '.join(words)}", file=sys.stderr)
        return 2
    if misfits := [misfit for each in MUTANTS if (misfit := _misfit(each))]:
        print("\n".join(misfits), file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "copy"
        copy.mkdir()
        _copy_to(copy)
        tests = sorted({test for each in chosen for test in each.tests.split()})
        if _run(copy, tests, stop=True):
            print("the tests fail without any change", file=sys.stderr)
            return 2
        survivors = [each for each in chosen if not _dies(copy, each)]
    print(f"{len(chosen) - len(survivors)} of {len(chosen)} mutants died")
    return 1 if survivors else 0


def _misfit(mutant: Mutant) -> str:
    """Return what is wrong with a line of the table; empty if it fits the code."""
    count = (ROOT / mutant.file).read_text(encoding="utf-8").count(mutant.text)
    return "" if count == 1 else f"{mutant.name}: {mutant.file} has {mutant.text!r} {count} times"


def _copy_to(folder: Path) -> None:
    for name in COPIED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(
                source, folder / name, ignore=shutil.ignore_patterns("__pycache__", "*.part")
            )
        else:
            shutil.copy(source, folder / name)


def _dies(folder: Path, mutant: Mutant) -> bool:
    path = folder / mutant.file
    original = path.read_text(encoding="utf-8")
    path.write_text(original.replace(mutant.text, mutant.changed), encoding="utf-8")
    try:
        status = _run(folder, mutant.tests.split(), stop=True)
    finally:
        path.write_text(original, encoding="utf-8")
    # 1: tests failed; 2: they could not be collected, which notices the change as well.
    died = status in (1, 2)
    print(f"{'died    ' if died else 'SURVIVED'}  {mutant.name:24s}{mutant.changed}", flush=True)
    return died


def _run(folder: Path, tests: Sequence[str], *, stop: bool) -> int:
    """Run tests of the copy and return pytest's exit status."""
    return subprocess.run(
        [
            sys.executable,
            *("-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "auto", "--no-header"),
            *(["-x"] if stop else []),
            *tests,
        ],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder), "CI": "1"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=False,
    ).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
