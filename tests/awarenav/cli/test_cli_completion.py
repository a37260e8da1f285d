"""Shell completion: the scripts, and what a shell offers at a place of the line."""

from __future__ import annotations

import shutil

import pytest
from click.shell_completion import ShellComplete
from command_line import GROUPS, run_python

from awarenav.cli import app, main


def offered(*words):
    """Return the completions of the last word, as the shell gets them."""
    *before, incomplete = words
    shell = ShellComplete(app, {}, "awarenav", "_AWARENAV_COMPLETE")
    return shell.get_completions(before, incomplete)


def values(*words):
    return [item.value for item in offered(*words)]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_a_shell_is_printed(shell, capsys):
    if shell == "bash" and shutil.which("bash") is None:
        pytest.skip("bash is not installed")
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert "_AWARENAV_COMPLETE" in script
    assert f"{shell}_complete" in script


def test_commands_are_completed_with_their_help_and_without_importing_them():
    items = {item.value: item.help for item in offered("")}
    assert [each for each in items if not each.startswith("-")] == [
        name for names in GROUPS.values() for name in names
    ]
    assert items["judge"] == "Compare estimates with the truth."
    assert values("re") == ["replay", "report", "render"]
    code = (
        "import sys; from click.shell_completion import ShellComplete; "
        "from awarenav.cli import app; "
        "ShellComplete(app, {}, 'awarenav', 'X').get_completions([], ''); "
        "print([each for each in sys.modules if each.endswith('.command')])"
    )
    assert run_python(code).stdout == "[]\n"


def test_nested_commands_and_options_are_completed():
    assert values("models", "") == ["list", "verify", "fetch"]
    assert values("models", "fetch", "--sh") == ["--sha256"]
    assert "--policy" in values("crossings", "--")


@pytest.mark.parametrize(
    ("words", "names"),
    [
        (
            ["crossings", "--scenario", "crossing_from"],
            ["crossing_from_left", "crossing_from_right"],
        ),
        (["crossings", "--scenario", "blind_corner", "crowd"], ["crowd_of_eight"]),
        (["crossings", "--policy", "b"], ["balanced", "blind"]),
        (["crossings", "--policy", "blind", "o"], ["oracle"]),
        (["crossings", "--policy", "blind", "sc"], ["scanner"]),
        (["falsify", "--policy", "s"], ["scanner"]),
        (["crossings", "--policy", "blind", "--fault", "gh"], ["ghosts"]),
        (["crossings", "--camera", "su"], ["surround"]),
        (["crossings", "--perception", "k"], ["keypoints"]),
        (["watch", "late_glance", "--population", "r"], ["recorded"]),
        (["falsify", "--robot", "fork"], ["forklift"]),
        (["demo", "--robot", "del"], ["delivery"]),
        (["tune", "--policy", "o"], None),
        (["scenario", "show", "runs"], ["runs_out"]),
        (["scenario", "draw", "runs_out", "late"], ["late_glance"]),
        (["policy", "show", "cons"], ["conservative"]),
        (["policy", "show", "blind", "ba"], ["balanced"]),
        (["completion", "z"], ["zsh"]),
    ],
)
def test_names_are_completed_by_their_beginning(words, names):
    if names is None:  # no such name: perhaps a file
        assert [(item.type, item.value) for item in offered(*words)] == [("file", words[-1])]
    else:
        assert values(*words) == names


@pytest.mark.parametrize(
    ("words", "kind"),
    [
        (["crossings", "--policy", "./mi"], "file"),
        (["estimate", "x", "--camera", ""], "file"),
        (["crossings", "--out", ""], "dir"),
        (["report", ""], "dir"),
    ],
)
def test_paths_are_left_to_the_shell(words, kind):
    assert [item.type for item in offered(*words)] == [kind]


def test_a_line_that_is_not_valid_yet_is_completed_without_a_complaint():
    assert "--out" in values("estimate", "x", "--resume", "--overwrite", "--o")
    assert values("nowhere", "x") == []
    assert values("crossings", "--episodes", "none", "--see") == ["--seed"]


def test_a_shell_is_answered_by_the_program(monkeypatch, capsys):
    monkeypatch.setenv("_AWARENAV_COMPLETE", "zsh_complete")
    monkeypatch.setenv("COMP_WORDS", "awarenav judg")
    monkeypatch.setenv("COMP_CWORD", "1")
    assert main([]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "plain",
        "judge",
        "Compare estimates with the truth.",
    ]
