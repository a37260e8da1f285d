"""The wheel of this checkout, and bare virtual environments to install it into."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from paths import ROOT

# A checkout on the caller's path would stand in for the installed wheel and hide what is missing.
_ENVIRONMENT = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}


def _run(*command: str | Path, cwd: Path, **extra: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=_ENVIRONMENT | extra,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@dataclass(frozen=True)
class Environment:
    """A virtual environment of the interpreter that runs the tests."""

    folder: Path

    @classmethod
    def make(cls, folder: Path) -> Environment:
        done = _run(sys.executable, "-m", "venv", "--without-pip", folder, cwd=folder.parent)
        assert done.returncode == 0, done.stdout + done.stderr
        return cls(folder)

    @property
    def bin(self) -> Path:
        return self.folder / "bin"

    @property
    def site(self) -> Path:
        version = f"python{sys.version_info.major}.{sys.version_info.minor}"
        return self.folder / "lib" / version / "site-packages"

    def pip(self, *arguments: str | Path) -> None:
        """Run the test environment's pip on this one; a failure, also of the network, fails."""
        # Compiling every module takes as long as installing it.
        quick = ["--no-compile"] if arguments[0] == "install" else []
        done = _run(
            sys.executable,
            *("-m", "pip", "--python", self.bin / "python", "--disable-pip-version-check"),
            *("--no-input", *arguments, *quick),
            cwd=self.folder,
        )
        if done.returncode != 0:
            pytest.fail(f"pip {' '.join(map(str, arguments))} failed:\n{done.stdout}{done.stderr}")

    def borrow_dependencies(self) -> None:
        """Let this environment import what the tests' own has installed (not the checkout)."""
        folders = [path for path in sys.path if Path(path).name == "site-packages"]
        (self.site / "borrowed.pth").write_text("\n".join(folders) + "\n")

    def python(self, code: str, **extra: str) -> subprocess.CompletedProcess[str]:
        return _run(self.bin / "python", "-W", "error", "-c", code, cwd=self.folder, **extra)

    def command(self, name: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        return _run(self.bin / name, *arguments, cwd=self.folder)


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built with the pinned hatchling."""
    folder = tmp_path_factory.mktemp("wheel")
    # fmt: off
    done = _run(
        sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT,
        cwd=folder,
    )
    # fmt: on
    assert done.returncode == 0, done.stdout + done.stderr
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="session")
def root() -> Path:
    """The root of the checkout."""
    return ROOT


@pytest.fixture
def environment(tmp_path: Path) -> Environment:
    """An empty virtual environment."""
    return Environment.make(tmp_path / "venv")


@pytest.fixture(scope="session")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """An environment with our wheel; dependencies come from the one that runs the tests."""
    environment = Environment.make(tmp_path_factory.mktemp("installed") / "venv")
    environment.borrow_dependencies()
    environment.pip("install", "--quiet", "--no-deps", wheel)
    return environment
