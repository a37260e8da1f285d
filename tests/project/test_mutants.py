"""The measurement of what tests notice, on a checkout of two small files."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT

from tools.mutants._changes import SAFETY, Mutant, changed_text, draw, sites

LIMIT = '''
"""A limit, at least 1.0."""
from typing import Final, Literal
__all__ = ["limit"]
__version__ = "1"
NEAR_M: Final = 2.0


def limit(distance_m: "Literal[3]", most: float = 5.0) -> Literal[4]:
    """Return 0 if near."""
    if distance_m < NEAR_M and not most > 9.0:
        raise ValueError(f"{distance_m + 1} is below 7")
    note(6)
    return min(distance_m, most)


def note(number):
    pass
'''
CLOCK = """
def later(before_s, after_s):
    return after_s - before_s > 0.5
"""
TESTS = """
import pytest
from tracking.clock import later


@pytest.fixture(scope="module")
def answer():
    return later(1.0, 3.0)


def test_first(answer):
    pass


def test_answer(answer):
    assert answer
"""


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Return a checkout with one file of safety code and its tests, and one without tests."""
    for name, text in {
        "nav_adapter/limit.py": LIMIT,
        "tracking/clock.py": CLOCK,
        "tests/tracking/test_clock.py": TESTS,
        "pyproject.toml": "",
    }.items():
        path = tmp_path / "checkout" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return tmp_path / "checkout"


def run(tree: Path, tmp_path: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Return how the measurement of a checkout ended."""
    return subprocess.run(
        [sys.executable, "-m", "tools.mutants", "--tree", str(tree), *options],
        cwd=ROOT,
        env={**os.environ, "TMPDIR": str(tmp_path), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        text=True,
        check=False,
    )


def test_every_change_is_one_of_behaviour(tree: Path) -> None:
    changes = draw(tree, 1000, 0)
    texts = {file: (tree / file).read_text(encoding="utf-8") for file in {c.file for c in changes}}
    for change in changes:
        old, new = (
            ast.parse(texts[change.file]),
            ast.parse(changed_text(texts[change.file], change)),
        )
        assert ast.dump(old) != ast.dump(new), change
        assert ast.get_docstring(old) == ast.get_docstring(new)
    said = {each.change for each in changes if each.file == "nav_adapter/limit.py"}
    assert said <= {
        "2.0 → 3.0",
        "5.0 → 7.5",
        "9.0 → 13.5",
        "6 → 7",
        "note(6) → pass",
        "distance_m < NEAR_M → distance_m <= NEAR_M",
        "distance_m < NEAR_M → distance_m >= NEAR_M",
        "most > 9.0 → most >= 9.0",
        "most > 9.0 → most <= 9.0",
        "not most > 9.0 → most > 9.0",
        "distance_m < NEAR_M and (not most > 9.0) → distance_m < NEAR_M or not most > 9.0",
        "min(distance_m, most) → distance_m",
    }
    assert {"2.0 → 3.0", "note(6) → pass", "min(distance_m, most) → distance_m"} <= said


def test_draws_are_repeatable_and_at_least_half_of_them_safety_code(tmp_path: Path) -> None:
    (tmp_path / "nav_adapter").symlink_to(ROOT / "nav_adapter")
    drawn = draw(tmp_path, 40, 3)
    assert drawn == draw(tmp_path, 40, 3)
    assert drawn != draw(tmp_path, 40, 4)
    assert len(set(drawn)) == 40
    assert sum(each.safety for each in drawn) == 20
    assert all(each.safety for each in draw(tmp_path, 10, 3, only_safety=True))
    for file in ("nav_adapter/limit.py", "tracking/clock.py", "perception/awareness.py"):
        assert SAFETY.fullmatch(file)
        assert (ROOT / file).exists()


def test_other_statements_that_change() -> None:
    text = "def f(x) -> int | None:\n    x += 1\n    return ~x if x is None else abs(x) * -2"
    tree = ast.parse(text)
    changed = {
        changed_text(text, Mutant("", site, variant, 0, "")).partition("\n")[2]
        for site, each in enumerate(sites(tree))
        for variant in range(len(each.variants))
    }
    end = "return ~x if x is None else abs(x) * -2"
    assert changed == {
        f"    x -= 1\n    {end}",
        f"    x += 0\n    {end}",
        "    x += 1\n    return None",
        *(
            f"    x += 1\n    {end.replace(old, new)}"
            for old, new in (
                ("~x", "x"),
                ("is", "is not"),
                ("abs(x) * -2", "x * -2"),
                ("*", "/"),
                ("-2", "2"),
                ("-2", "-3"),
            )
        ),
    }


def test_changes_die_where_a_test_notices_and_survive_where_none_does(
    tree: Path, tmp_path: Path
) -> None:
    ran = run(tree, tmp_path, "--count", "100", "--safety")
    assert ran.returncode == 1, ran.stderr
    line = re.compile(r"^(died|SURVIVED) +s (\S+):\d+ +(.*?)   \[(.*)\]$", re.M)
    outcome = {(file, change): (end, by) for end, file, change, by in line.findall(ran.stdout)}
    opposite = "after_s - before_s > 0.5 → after_s - before_s <= 0.5"
    assert outcome["tracking/clock.py", opposite] == ("died", "test_clock.py::test_answer")
    assert outcome["tracking/clock.py", "0.5 → 0.75"] == ("SURVIVED", "2 tests passed")
    assert outcome["nav_adapter/limit.py", "2.0 → 3.0"] == ("SURVIVED", "0 tests passed")
    assert re.search(r"^safety +1 of +\d+ died", ran.stdout, re.M)
    # The checkout is as before.
    assert (tree / "tracking/clock.py").read_text(encoding="utf-8") == CLOCK


def test_tests_that_fail_without_any_change_are_named(tree: Path, tmp_path: Path) -> None:
    (tree / "tests/tracking/test_clock.py").write_text("def test_no():\n    assert 0\n")
    ran = run(tree, tmp_path, "--count", "1")
    assert ran.returncode == 2
    assert "test_clock.py::test_no" in ran.stderr
