"""Text for a terminal: tables that fit its width, colours that can be turned off, Ctrl-C."""

from __future__ import annotations

import io
import shlex

import pytest

from awarenav.cli import main, styled, table_text


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_columns_that_do_not_fit_follow_below_beside_the_first_again(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    header = ("policy", *(f"column {number} of a wide table" for number in range(5)))
    rows = [(name, *(f"{name}{number}" for number in range(5))) for name in ("blind", "mine")]
    text = table_text(header, rows)
    assert max(map(len, text.splitlines())) <= 80
    parts = text.split("\n\n")
    assert len(parts) == 3
    assert all(part.splitlines()[2].startswith("blind") for part in parts)
    assert all(f"mine{number}" in text for number in range(5))
    monkeypatch.setenv("COLUMNS", "200")
    assert "\n\n" not in table_text(header, rows)


def test_a_column_wider_than_the_terminal_stands_alone(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    text = table_text(("a", "b" * 90, "c"), [("1", "2", "3")])
    assert [part.split()[0] for part in text.split("\n\n")] == ["a", "a"]


def test_a_terminal_has_colours_unless_somebody_wants_none(monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    assert styled("text", Terminal(), bold=True) == "\x1b[1mtext\x1b[0m"
    assert styled("text", io.StringIO(), bold=True) == "text"
    monkeypatch.setenv("NO_COLOR", "1")
    assert styled("text", Terminal(), bold=True) == "text"


def test_an_interruption_prints_the_command_that_goes_on(monkeypatch, tmp_path, capsys):
    pytest.importorskip("pybullet", reason="the command runs crossings (extra sim)")

    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sim_tests.study._commands.run_jobs", interrupt)
    words = ["crossings", "--scenario", "late_glance", "--out", str(tmp_path / "my run")]
    assert main([*words, "--overwrite"]) == 130
    said = capsys.readouterr().err.splitlines()
    assert said[-3:] == [
        "awarenav crossings: interrupted; partial results kept",
        "Go on with:",
        f"  {shlex.join(['awarenav', *words, '--resume'])}",
    ]


def test_a_folder_above_a_new_one_is_named(tmp_path, capsys):
    out = tmp_path / "new" / "run"
    assert main(["crossings", "--scenario", "nowhere", "--out", str(out)]) == 2
    assert f"makes the new folder {out.parent}, too" in capsys.readouterr().err
