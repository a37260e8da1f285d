"""A wrong import of every kind breaks the contract that forbids it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT

PACKAGES = ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests")
SCRIPTS = ("training", "benchmarks", "tools")

#: By the name of a contract: a module and an import that does not belong into it.
PLANTED = {
    "packages: sim_tests > awarenav > nav_adapter > tracking > perception": (
        "tracking/_size.py",
        "from nav_adapter import NavError",
    ),
    "sim_tests: search | demo > study > viewing | learning > crossing > "
    "scenario | dataset > actors > conditions > world": (
        "sim_tests/world/_visibility.py",
        "from ..crossing import run_crossing",
    ),
    "sim_tests.world: scanner > camera > warehouse > render | sightlines > hall": (
        "sim_tests/world/hall/_layout.py",
        "from ..camera import CameraRenderer",
    ),
    "sim_tests.actors: behaviour > body, robot apart": (
        "sim_tests/actors/body/_asset.py",
        "from ..behaviour import Person",
    ),
    "sim_tests.study: command > frontier > report > social > runs | scenarios > measures": (
        "sim_tests/study/measures/_summary.py",
        "from ..runs import run_jobs",
    ),
    "awarenav: tools > command line > files": (
        "awarenav/models/_sources.py",
        "from ..tracks import command",
    ),
    "no module imports another package's private module": (
        "awarenav/tracks/_run.py",
        "from ..estimate._camera import CameraChoice",
    ),
    "no circles": ("perception/_camera.py", "from ._pipeline import AwarenessPipeline"),
    "a robot needs neither PyBullet nor sim_tests": ("awarenav/files.py", "import pybullet"),
    "the core draws no plots, films or progress bars": ("nav_adapter/_robot.py", "import tqdm"),
    "awarenav compare runs without the simulator": (
        "sim_tests/study/measures/_statistics.py",
        "import pybullet",
    ),
}


def lint(folder: Path) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-c", "from importlinter.cli import lint_imports_command as run; run()",
         "--no-cache"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(folder), "COLUMNS": "200", "NO_COLOR": "1"},
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """The modules alone, without data."""
    for name in (*PACKAGES, *SCRIPTS):
        shutil.copytree(
            ROOT / name,
            tmp_path / name,
            ignore=lambda folder, names: [
                each
                for each in names
                if each == "__pycache__"
                or (not each.endswith(".py") and (Path(folder) / each).is_file())
            ],
        )
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def test_every_contract_notices_an_import_that_it_forbids(copy: Path) -> None:
    for module, line in PLANTED.values():
        path = copy / module
        text = path.read_text(encoding="utf-8")
        marker = "from __future__ import annotations\n"
        assert marker in text, module
        path.write_text(text.replace(marker, f"{marker}{line}\n", 1), encoding="utf-8")
    status, output = lint(copy)
    assert status == 1, output
    verdicts = dict(re.findall(r"^(\S.*?) (KEPT|BROKEN)\b", output, flags=re.MULTILINE))
    assert set(verdicts) == set(PLANTED)
    assert {name for name, verdict in verdicts.items() if verdict == "KEPT"} == set()
    # Each names the module that was planted for it, and not only one planted for another.
    details = re.split(
        r"^(\S.*)\n-+\n", output.partition("Broken contracts")[2], flags=re.MULTILINE
    )
    reasons = dict(zip(details[1::2], details[2::2], strict=True))
    for name, (module, _) in PLANTED.items():
        dotted = module.removesuffix(".py").replace("/", ".")
        package = dotted.partition(".")[0]
        named = dotted in reasons[name] or (name == "no circles" and package in reasons[name])
        assert named, f"{name}:\n{reasons[name]}"
