"""The hooks run what `make lint` runs, from .venv, and download nothing."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from paths import ROOT

CONFIG: dict[str, Any] = yaml.safe_load(
    (ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8")
)
HOOKS: list[dict[str, Any]] = [hook for repo in CONFIG["repos"] for hook in repo["hooks"]]
#: In no recipe of the Makefile where codespell is run by a test.
SPELLING = ".venv/bin/python -m codespell_lib"


def lint_commands() -> set[str]:
    """The commands of the target `lint`, with the Makefile's variables put in."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    variables = dict(re.findall(r"^(\w+) := (.*)$", makefile, re.MULTILINE))
    (recipe,) = re.findall(r"^lint:.*\n((?:\t.*\n)+)", makefile, re.MULTILINE)
    commands = recipe.replace("\t", "").splitlines()
    for _ in range(2):  # one variable names another
        commands = [
            re.sub(r"\$\((\w+)\)", lambda found: variables[found[1]], line) for line in commands
        ]
    return set(commands)


def commands(stage: str) -> set[str]:
    return {
        " ".join([hook["entry"], *hook.get("args", [])])
        for hook in HOOKS
        if stage in hook.get("stages", CONFIG["default_stages"])
    }


def test_the_hooks_of_a_commit_are_the_commands_of_make_lint() -> None:
    wanted = lint_commands()
    assert len(wanted) >= 4
    assert wanted | {SPELLING} == commands("pre-commit")


def test_the_hook_of_a_push_runs_tests_that_exist() -> None:
    (entry,) = commands("pre-push")
    words = entry.split()
    assert words[:3] == [".venv/bin/python", "-m", "pytest"]
    paths = [word for word in words if word.startswith("tests")]
    assert paths
    assert all((ROOT / path).exists() for path in paths)
    assert "not slow" in entry
    assert {"pre-commit", "pre-push"} == set(CONFIG["default_install_hook_types"])


def test_no_hook_is_downloaded() -> None:
    assert [repo["repo"] for repo in CONFIG["repos"]] == ["local"]
    for hook in HOOKS:
        assert hook["language"] == "system"
        assert hook["entry"].startswith(".venv/bin/")
        assert hook["pass_filenames"] is False


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A small repository with the hooks, the settings, and this environment as its .venv."""
    shutil.copy2(ROOT / ".pre-commit-config.yaml", tmp_path)
    shutil.copy2(ROOT / "pyproject.toml", tmp_path)
    (tmp_path / ".venv").symlink_to(sys.prefix)
    (tmp_path / ".gitignore").write_text(".venv\n.ruff_cache/\n", encoding="utf-8")
    (tmp_path / "good.py").write_text('"""A module."""\n\nVALUE = 1\n', encoding="utf-8")
    git(tmp_path, "init", "--quiet")
    git(tmp_path, "add", "--all")
    return tmp_path


def git(folder: Path, *arguments: str) -> None:
    subprocess.run(["git", *arguments], cwd=folder, check=True, capture_output=True)


def hook(folder: Path, name: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "pre_commit", "run", name, "--all-files"],
        capture_output=True,
        text=True,
        cwd=folder,
        check=False,
        env=os.environ | {"PRE_COMMIT_HOME": str(folder / "home")},
    )


def test_hooks_pass_good_code_and_refuse_bad_code(repository: Path) -> None:
    pytest.importorskip("pre_commit", reason="the extra dev is not up to date")
    for name in ("ruff-check", "ruff-format"):
        done = hook(repository, name)
        assert done.returncode == 0, done.stdout + done.stderr
    (repository / "bad.py").write_text("import os\nVALUE = {  'a':1 }\n", encoding="utf-8")
    git(repository, "add", "bad.py")
    check, style = (hook(repository, name) for name in ("ruff-check", "ruff-format"))
    assert check.returncode == 1
    assert "F401" in check.stdout
    assert style.returncode == 1
    assert "bad.py" in style.stdout
