"""A copy of a checkout, and which of its tests run which of its lines."""

from __future__ import annotations

import ast
import contextlib
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
TESTS: Final = (
    *("tests/perception", "tests/tracking", "tests/nav_adapter", "tests/sim_tests/crossing"),
    "tests/sim_tests/study/test_measures*.py",
)
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
        folder: the copy.
        tests: time in seconds of each test.
        failed: tests that fail without any change.
    """

    def __init__(self, tree: Path) -> None:
        """Read the map that was made before, or run the tests to make one."""
        name = hashlib.sha256(str(tree).encode()).hexdigest()[:12]
        store = Path(tempfile.gettempdir()) / f"awarenav_mutants_{name}"
        self.folder, self._data, notes = store / "copy", store / "lines", store / "tests.json"
        state = _state(tree)
        if not notes.exists() or json.loads(notes.read_text())["state"] != state:
            shutil.rmtree(store, ignore_errors=True)
            shutil.copytree(tree, self.folder, ignore=shutil.ignore_patterns(*_NOT_COPIED))
            print(f"running the tests with coverage in {self.folder}", file=sys.stderr)
            tests = [str(path) for each in TESTS for path in sorted(self.folder.glob(each))]
            forked(self.folder, store, lambda: _record(self.folder, self._data, notes, tests))
            if not notes.exists():
                raise SystemExit((store / "log.txt").read_text())
            written = json.loads(notes.read_text())
            notes.write_text(json.dumps({"state": state, **written}))
        noted = json.loads(notes.read_text())
        self.tests: dict[str, float] = noted["seconds"]
        self.failed: list[str] = noted["failed"]
        self.covered: dict[str, list[int]] = noted["covered"]
        self.store = store
        for module in noted["loaded"]:
            importlib.import_module(module)
        self._users = defaultdict(list)
        for test, fixtures in noted["fixtures"].items():
            for fixture in fixtures:
                self._users[fixture].append(test)
        with contextlib.closing(sqlite3.connect(self._data)) as database:
            rows = database.execute(
                "select context, numbits from line_bits join context on context_id = context.id"
            )
            self._lines: Counter[str] = Counter()
            for context, bits in rows:
                self._lines[context] += int.from_bytes(bits, "little").bit_count()

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

    @functools.cache  # noqa: B019 - one map a run
    def _by_line(self, file: str) -> dict[int, set[str]]:
        data = coverage.CoverageData(str(self._data))
        data.read()
        return {
            line: {
                test
                for context in contexts
                for test in self._users.get(context, [context])
                if test in self.tests
            }
            for line, contexts in data.contexts_by_lineno(str(self.folder / file)).items()
        }

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
    for folder in ("tests", "perception", "tracking", "nav_adapter", "awarenav", "sim_tests"):
        for path in sorted((tree / folder).rglob("*.py")):
            state.update(path.relative_to(tree).as_posix().encode())
            state.update(path.read_bytes())
    return state.hexdigest()


def _record(folder: Path, data: Path, notes: Path, tests: list[str]) -> int:
    """Run tests with coverage, and write which test runs which line."""
    measured = coverage.Coverage(
        data_file=str(data),
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
    noted = {name: getattr(recorder, name) for name in ("seconds", "fixtures", "failed")}
    loaded = [name for name in _WARM if name in sys.modules]
    notes.write_text(json.dumps({**noted, "covered": covered, "loaded": loaded}))
    return int(status)


def forked(folder: Path, store: Path, run: Callable[[], int], most_s: float = 1e6) -> int | None:
    """Run in a process of its own that imports from a copy; None if it took too long."""
    if (child := os.fork()) == 0:
        status = 3
        try:
            os.setsid()
            log = os.open(store / "log.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(log, 1)
            os.dup2(log, 2)
            os.chdir(folder)
            sys.path[:] = [str(folder), *(p for p in sys.path if Path(p or ".").resolve() != ROOT)]
            os.environ.update(PYTHONPATH=str(folder), CI="1")
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
