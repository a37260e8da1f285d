"""Exit statuses and messages: success, a failed check, bad input, interruption, a closed pipe."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from command_line import COMMANDS
from paths import ROOT

from awarenav.cli import main
from awarenav.errors import AwarenavError, MissingExtraError
from perception.installation import install_command


@pytest.fixture
def failing(monkeypatch):
    """Make ``awarenav policy show`` raise an error."""

    def fail_with(error):
        def show(**values):
            raise error

        monkeypatch.setattr(COMMANDS["policy", "show"], "callback", show)
        return main(["policy", "show", "balanced"])

    return fail_with


def test_success_is_0(capsys):
    assert main(["policy", "show", "balanced", "--out", "none"]) == 0
    assert capsys.readouterr().err == ""


NO_SIMULATOR = (
    "awarenav policy show: the simulator needs pybullet, which is not installed; it is part of "
    f"the extra 'sim': {install_command('sim,bench')}\n"
)


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (AwarenavError("radius must be > 0 m"), 2, "awarenav policy show: radius must be > 0 m\n"),
        (MissingExtraError("needs 'viz'"), 2, "awarenav policy show: needs 'viz'\n"),
        (ModuleNotFoundError("No module named 'pybullet'", name="pybullet"), 2, NO_SIMULATOR),
        (KeyboardInterrupt(), 130, "\nawarenav policy show: interrupted\n"),
    ],
)
def test_an_error_is_one_line_and_its_status(failing, error, status, said, capsys):
    assert failing(error) == status
    assert capsys.readouterr().err == said


@pytest.mark.parametrize(
    "error",
    [
        ValueError("an error in the program"),
        ModuleNotFoundError("No module named 'nowhere'", name="nowhere"),
        TypeError("an error in the program"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_an_error_of_the_program_keeps_its_traceback(failing, error):
    with pytest.raises(type(error), match=str(error)):
        failing(error)


@pytest.mark.parametrize(
    "words",
    [[], ["judge", "--help"], ["completion", "zsh"]],
    ids=" ".join,
)
def test_an_output_that_nobody_reads_is_no_error(words):
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "awarenav", *words],
            cwd=ROOT,
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
            check=False,
        )
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_reader_that_stops_after_a_line_is_no_error():
    command = f"set -o pipefail; {sys.executable} -m awarenav completion zsh | head -n 1"
    done = subprocess.run(
        ["bash", "-c", command], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "#compdef awarenav\n"
