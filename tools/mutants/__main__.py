"""Change the code in one place at a time, and count how many changes a test notices.

    python -m tools.mutants                       150 changes, at least half of them in safety code
    python -m tools.mutants --count 20 --seed 7   other changes, fewer
    python -m tools.mutants --safety              safety code only
    python -m tools.mutants --tree ../other       the code and tests of another checkout
    python -m tools.mutants --list                only print what would be changed
    python -m tools.mutants --old-map --count 20  a sample that takes a minute or two

A copy of the checkout is changed, never the checkout. One run of the tests with coverage, in that
copy, says which tests run which lines; its result serves until the code or the tests change, and
longer with ``--old-map``. Each change then meets the tests that run its line, those that run little
else first, up to 10 s of CPU time as that run measured them. A change dies if a test fails, if
nothing can be imported any more, or if the tests take far longer than before. A line that no test
runs survives.

Exit status: 0 all of safety code died, 1 a change of safety code survived, 2 tests fail without
any change.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import pytest

from tools.mutants._changes import SOURCES, Mutant, changed_text, draw
from tools.mutants._copy import ARGUMENTS, ROOT, Copy, forked

_MOST_S: Final = 10.0
_FIRST_S: Final = 3.0


class Chosen:
    """The part of pytest that runs the chosen tests in their order, and notes what fails."""

    def __init__(self, tests: Sequence[str]) -> None:
        """Run these tests."""
        self.order = {test: place for place, test in enumerate(tests)}
        self.failed: list[str] = []

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Leave out all others."""
        items[:] = [item for item in items if item.nodeid in self.order]
        items.sort(key=lambda item: self.order[item.nodeid])

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note a test that fails."""
        if report.failed:
            self.failed.append(report.nodeid)


def failing(made: Copy, tests: list[str], *, stop: bool = True) -> list[str]:
    """Return the tests that fail in the copy as it is, or why they could not be run."""
    chosen = Chosen(tests)
    failures = made.store / "failures.json"
    failures.unlink(missing_ok=True)

    def run() -> int:
        files = list(dict.fromkeys(test.partition("::")[0] for test in tests))
        status = pytest.main([*ARGUMENTS, *(["-x"] if stop else []), *files], [chosen])
        failures.write_text(json.dumps(chosen.failed))
        return int(status)

    planned_s = sum(made.tests[test] for test in tests)
    status = forked(made, run, 30.0 + 3.0 * planned_s)
    if failures.exists() and (failed := json.loads(failures.read_text())):
        return list(failed)
    if status is None:
        return ["it took too long, or crashed"]
    # 0: all passed; 5: no test of these is left.
    return [] if status in (0, 5) else ["nothing could be imported"]


def killed_by(made: Copy, mutant: Mutant, mark: int) -> tuple[list[str], int]:
    """Return the tests that fail with a change, and how many tests were chosen."""
    tests = made.tests_of(mutant)
    chosen: list[list[str]] = [[], []]
    seconds = 0.0
    for test in tests:
        if seconds + made.tests[test] <= _MOST_S:
            seconds += made.tests[test]
            chosen[seconds > _FIRST_S].append(test)
    path = made.folder / mutant.file
    text, stat = path.read_text(encoding="utf-8"), path.stat()
    path.write_text(changed_text(text, mutant), encoding="utf-8")
    # Compiled files are known by whole seconds: each change has one of its own.
    os.utime(path, (mark, mark))
    try:
        failed = next((failed for part in chosen if part and (failed := failing(made, part))), [])
    finally:
        path.write_text(text, encoding="utf-8")
        os.utime(path, (stat.st_atime, stat.st_mtime))
    return failed, sum(map(len, chosen))


def main(arguments: Sequence[str]) -> int:
    """Draw, run and count the changes, and return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.mutants",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--count", type=int, default=150, help="number of changes (150)")
    parser.add_argument("--seed", type=int, default=0, help="of the draw (0)")
    parser.add_argument("--tree", type=Path, default=ROOT, help="the checkout (this one)")
    parser.add_argument("--safety", action="store_true", help="only change safety code")
    parser.add_argument("--list", action="store_true", help="print the changes, run nothing")
    parser.add_argument(
        "--old-map",
        action="store_true",
        help="keep what a run with coverage said about an older state, if there was one",
    )
    asked = parser.parse_args(arguments)
    tree = asked.tree.resolve()
    drawn = draw(tree, asked.count, asked.seed, only_safety=asked.safety)
    if asked.list:
        print("\n".join(_line("", each) for each in drawn))
        return 0
    made = Copy(tree, may_be_old=asked.old_map)
    if made.failed:
        print("fail without any change:", *made.failed, sep="\n  ", file=sys.stderr)
        return 2
    print(_coverage(made), flush=True)
    began = time.monotonic()
    died: dict[Mutant, bool] = {}
    noticed: set[str] = set()
    for number, mutant in enumerate(drawn):
        failed, run = killed_by(made, mutant, 1_000_000_000 + number)
        if made.old and not run:
            continue  # a new file
        died[mutant] = bool(failed)
        noticed.update(failed[:1])
        by = failed[0].rpartition("/")[2] if failed else f"{run} tests passed"
        print(f"{_line('died' if failed else 'SURVIVED', mutant)}   [{by}]", flush=True)
    made.keep()
    # What failed must pass in the same way without a change.
    if again := failing(made, [test for test in noticed if test in made.tests], stop=False):
        print("fail without any change:", *again, sep="\n  ", file=sys.stderr)
        return 2
    print(f"\n{time.monotonic() - began:.0f} s for {len(drawn)} changes, seed {asked.seed}")
    print(_shares(died))
    return int(any(mutant.safety and not dead for mutant, dead in died.items()))


def _coverage(made: Copy) -> str:
    parts = [f"{len(made.tests)} tests, {sum(made.tests.values()):.0f} s of CPU time; lines run:"]
    for source in SOURCES:
        files = [counts for file, counts in made.covered.items() if file.startswith(f"{source}/")]
        run, lines = sum(count for count, _ in files), sum(count for _, count in files)
        parts.append(f"{source} {100.0 * run / max(lines, 1):.1f} % of {lines}")
    return "\n  ".join(parts)


def _shares(died: dict[Mutant, bool]) -> str:
    lines = []
    for name in ("all", "safety", *SOURCES):
        group = [
            dead
            for mutant, dead in died.items()
            if name == "all" or (name == "safety" and mutant.safety) or name == mutant.source
        ]
        if group:
            share = 100.0 * sum(group) / len(group)
            lines.append(f"{name:24s}{sum(group):4d} of {len(group):3d} died{share:6.1f} %")
    return "\n".join(lines)


def _line(outcome: str, mutant: Mutant) -> str:
    where = f"{mutant.file}:{mutant.line}"
    return f"{outcome:9s}{'s' if mutant.safety else ' '} {where:44s} {mutant.change}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
