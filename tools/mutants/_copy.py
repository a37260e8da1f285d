"""A copy of a checkout, and which of its tests run which of its lines."""

from __future__ import annotations

import ast
import contextlib
import difflib
import functools
import hashlib
import importlib
import json
import os
import resource
import shutil
import signal
import sqlite3
import sys
import tempfile
import time
import traceback
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import coverage
import pytest

from tools.mutants._changes import SOURCES, Mutant, parsed, source_files

ROOT: Final = Path(__file__).resolve().parents[2]
TESTS: Final = tuple(f"tests/{source}" for source in SOURCES)
_NOT_COPIED: Final = (".git", ".venv", "__pycache__", ".*_cache", ".hypothesis", "site", "build")
# Loaded once, before the process forks for each change.
_WARM: Final = (
    *("numpy", "numpy.testing", "scipy.optimize", "scipy.spatial", "scipy.stats", "scipy.linalg"),
    *("cv2", "onnxruntime", "pybullet", "shapely", "pydantic", "yaml", "click", "mcap", "av"),
    *("matplotlib.figure", "pandas", "cyclonedds", "moderngl", "onnx"),
)
ARGUMENTS: Final = ("-q", "--no-header", "-p", "no:cacheprovider", "-p", "no:xdist", "--tb=short")


class Recorder:
    """The part of pytest that notes the tests' names, times and fixtures, and whose lines run."""

    def __init__(self, measured: coverage.Coverage) -> None:
        """Begin with no tests."""
        self.measured = measured
        self.seconds: dict[str, float] = {}
        self.fixtures: dict[str, list[str]] = {}
        self.failed: list[str] = []

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Count the lines of a test as its own, as if it ran alone."""
        _forget_cached_results()
        name, before = item.nodeid, sum(os.times()[:4])
        defined = item._fixtureinfo.name2fixturedefs.values()  # type: ignore[attr-defined]
        shared = [each for several in defined for each in several if each.scope != "function"]
        self.fixtures[name] = [_context(each) for each in shared]
        self.measured.switch_context(name)
        result = yield
        self.seconds[name] = sum(os.times()[:4]) - before
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: Any) -> Iterator[None]:
        """Count the lines of a fixture that tests share for all of them."""
        shared = fixturedef.scope != "function"
        if shared:
            self.measured.switch_context(_context(fixturedef))
        result = yield
        if shared:
            self.measured.switch_context(request.node.nodeid)
        return result

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note a test that fails."""
        if report.failed:
            self.failed.append(report.nodeid)


def _context(fixture: Any) -> str:
    return f"fixture {fixture.argname} of {fixture.baseid}"


def _forget_cached_results() -> None:
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if file and file.startswith(str(Path.cwd())):
            for each in list(vars(module).values()):
                if isinstance(each, functools._lru_cache_wrapper) and each.__module__ == name:
                    each.cache_clear()


class Copy:
    """A copy of a checkout, and which tests run which of its lines.

    Attributes:
        store: the folder beside the copy.
        folder: the copy.
        tests: CPU time in seconds of each test.
        failed: tests that fail without any change.
        covered: of each file, the number of lines that run, and of all.
        old: True if the tests ran on an older state of the checkout.
    """

    def __init__(self, tree: Path, *, may_be_old: bool = False) -> None:
        """Copy a checkout, and run its tests unless that was done before.

        Args:
            tree: the checkout.
            may_be_old: what is known of an older state of the checkout will do.
        """
        name = hashlib.sha256(str(tree).encode()).hexdigest()[:12]
        self.store = store = Path(tempfile.gettempdir()) / f"awarenav_mutants_{name}"
        self.folder, self._measured = store / "copy", store / "measured"
        self._data, notes = store / "lines", store / "tests.json"
        self._copied, self._state = store / "state", _state(tree)
        copied, state = self._copied, self._state
        known = json.loads(notes.read_text()) if notes.exists() else {}
        if known.get("state") != state and not (known and may_be_old):
            shutil.rmtree(store, ignore_errors=True)
        if not copied.exists() or copied.read_text() != state:
            if self.folder.exists() and not self._measured.exists():
                self.folder.rename(self._measured)
            shutil.rmtree(self.folder, ignore_errors=True)
            shutil.copytree(tree, self.folder, ignore=shutil.ignore_patterns(*_NOT_COPIED))
        # A run that is killed may leave a change behind: the next one copies again.
        copied.unlink(missing_ok=True)
        if not notes.exists():
            print(f"running the tests with coverage in {self.folder}", file=sys.stderr)
            forked(self, lambda: _record(self, state, notes))
        if not notes.exists():
            raise SystemExit((store / "log.txt").read_text())
        known = json.loads(notes.read_text())
        self.old = known["state"] != state
        self.tests: dict[str, float] = known["seconds"]
        self.failed: list[str] = known["failed"]
        self.covered: dict[str, list[int]] = known["covered"]
        for module in known["loaded"]:
            importlib.import_module(module)
        self._users = defaultdict(list)
        for test, fixtures in known["fixtures"].items():
            for fixture in fixtures:
                self._users[fixture].append(test)
        with contextlib.closing(sqlite3.connect(self._data)) as database:
            rows = database.execute(
                "select context, numbits from line_bits join context on context_id = context.id"
            )
            self._lines: Counter[str] = Counter()
            for context, bits in rows:
                self._lines[context] += int.from_bytes(bits, "little").bit_count()

    def keep(self) -> None:
        """Say that the copy is as it was: the next run need not copy again."""
        self._copied.write_text(self._state)

    def tests_of(self, mutant: Mutant) -> list[str]:
        """Return the tests that a change has to pass, those that run little else first."""
        site = parsed(self.folder / mutant.file)[1][mutant.site]
        own = self._by_line(mutant.file)
        found: set[str] = set()
        if site.function is None:
            for name in _names_set_by(site.statement):
                for file, line in self._uses(name):
                    found.update(self._by_line(file).get(line, ()))
            lines = set() if found else set(own)
        elif site.node in (site.function, *ast.walk(site.function.args)):
            lines = set(_lines(site.function))
        else:
            lines = {site.statement.lineno, *_lines(site.node)}
        for line in lines:
            found.update(own.get(line, ()))
        hits = Counter(test for tests in own.values() for test in tests)
        cost = {
            test: self.tests[test] * max(self._lines[test], 1) / max(hits[test], 1)
            for test in found
        }
        return sorted(cost, key=lambda test: (cost[test], test))

    @functools.cache  # noqa: B019 - one copy a run
    def _by_line(self, file: str) -> dict[int, set[str]]:
        data = coverage.CoverageData(str(self._data))
        data.read()
        found = {
            line: {
                test
                for context in contexts
                for test in self._users.get(context, [context])
                if test in self.tests
            }
            for line, contexts in data.contexts_by_lineno(str(self.folder / file)).items()
        }
        return self._moved(file, found) if self.old else found

    def _moved(self, file: str, found: dict[int, set[str]]) -> dict[int, set[str]]:
        """Return the tests by line of today's file; a new line has those of the line before."""
        if not (self._measured / file).exists():
            return {}
        before, now = (
            (folder / file).read_text(encoding="utf-8").splitlines()
            for folder in (self._measured, self.folder)
        )
        blocks = difflib.SequenceMatcher(None, before, now, autojunk=False).get_matching_blocks()
        old = {b + each + 1: a + each + 1 for a, b, size in blocks for each in range(size)}
        moved: dict[int, set[str]] = {}
        last: set[str] = set()
        for line in range(1, len(now) + 1):
            moved[line] = found.get(old[line], set()) if line in old else last
            last = moved[line] or last
        return moved

    def _uses(self, name: str) -> Iterator[tuple[str, int]]:
        node: Any
        for file in source_files(self.folder):
            for node in ast.walk(parsed(self.folder / file)[0]):
                if name in (getattr(node, "id", None), getattr(node, "attr", None)):
                    yield file, node.lineno


def _lines(node: Any) -> range:
    return range(node.lineno, node.end_lineno + 1)


def _names_set_by(statement: ast.stmt) -> list[str]:
    targets = statement.targets if isinstance(statement, ast.Assign) else []
    if isinstance(statement, ast.AnnAssign):
        targets = [statement.target]
    return [node.id for each in targets for node in ast.walk(each) if isinstance(node, ast.Name)]


def _state(tree: Path) -> str:
    state = hashlib.sha256()
    for folder in ("tests", *SOURCES):
        for path in sorted((tree / folder).rglob("*.py")):
            state.update(path.relative_to(tree).as_posix().encode())
            state.update(path.read_bytes())
    return state.hexdigest()


def _record(made: Copy, state: str, notes: Path) -> int:
    """Run the tests of a copy with coverage, and write which test runs which line."""
    folder = made.folder
    tests = [str(path) for each in TESTS for path in sorted(folder.glob(each))]
    measured = coverage.Coverage(
        data_file=str(made.store / "lines"),
        config_file=False,
        source=[str(folder / source) for source in SOURCES],
        messages=False,
    )
    measured.set_option("run:disable_warnings", ["no-data-collected", "module-not-measured"])
    recorder = Recorder(measured)
    measured.start()
    status = pytest.main([*ARGUMENTS, "-m", "not slow and not full", *tests], [recorder])
    measured.stop()
    measured.save()
    covered: dict[str, list[int]] = {}
    for file in source_files(folder):
        _, statements, _, missing, _ = measured.analysis2(str(folder / file))
        covered[file] = [len(statements) - len(missing), len(statements)]
    known = {name: getattr(recorder, name) for name in ("seconds", "fixtures", "failed")}
    loaded = [name for name in _WARM if name in sys.modules]
    known.update(state=state, covered=covered, loaded=loaded)
    notes.write_text(json.dumps(known))
    return int(status)


def forked(made: Copy, run: Callable[[], int], most_s: float = 1e6) -> int | None:
    """Run in a process of its own that imports from a copy; None if it took too long."""
    if (child := os.fork()) == 0:
        status = 3
        try:
            os.setsid()
            log = os.open(made.store / "log.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(log, 1)
            os.dup2(log, 2)
            os.chdir(folder := made.folder)
            # From no other checkout: neither this one nor that of which an installation tells.
            others = [p for p in sys.path if not Path(p or ".", "nav_adapter").is_dir()]
            sys.path[:] = [str(folder), *others]
            sys.meta_path[:] = [f for f in sys.meta_path if "__editable__" not in f"{f!r}"]
            os.environ.update(PYTHONPATH=str(folder), CI="1")
            # Without compiled files, each process would compile all that it imports.
            sys.dont_write_bytecode = False
            os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
            resource.setrlimit(resource.RLIMIT_CPU, (int(most_s), int(most_s) + 5))
            status = run()
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            os._exit(status)
    until = time.monotonic() + 6.0 * most_s
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done or time.monotonic() > until:
            break
        time.sleep(0.02)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    if not done:
        os.waitpid(child, 0)
        return None
    return os.waitstatus_to_exitcode(status) if os.WIFEXITED(status) else None
