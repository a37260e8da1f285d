"""The parsing of command lines: several values, exclusions, suggestions, shared options."""

from __future__ import annotations

from collections import defaultdict

import click
import pytest
from command_line import COMMANDS, options_of

from awarenav.cli import OneOf, Option, command, main, option
from awarenav.judge import JudgeConfig

# `render` names the people who appear by an option that elsewhere counts processes.
OTHER_MEANING = {("render", "--workers")}
SHARED = (
    "--seed",
    "--out",
    "--workers",
    "--resume",
    "--overwrite",
    "--planner",
    "--policy",
    "--perception",
)


def parsed(path, *words):
    with COMMANDS[path].make_context(path[-1], list(words)) as context:
        return context.params


def test_several_values_after_an_option_equal_the_option_given_several_times():
    path = ("crossings",)
    expected = parsed(path, "--policy", "blind", "--policy", "mine.yaml", "--episodes", "3")
    assert expected["policy"] == ("blind", "mine.yaml")
    for words in (
        ["--policy", "blind", "mine.yaml", "--episodes", "3"],
        ["--policy=blind", "mine.yaml", "--episodes=3"],
        ["--policy=blind", "--episodes", "3", "--policy=mine.yaml"],
        ["--episodes", "3", "--policy", "blind", "mine.yaml"],
    ):
        assert parsed(path, *words) == expected


def test_a_word_after_an_option_of_one_value_belongs_to_no_option(capsys):
    assert main(["crossings", "--episodes", "3", "4"]) == 2
    assert "unexpected extra argument (4)" in capsys.readouterr().err


def test_words_after_two_dashes_are_arguments():
    @command("either")
    @option("--name", many=True, help="Names.")
    @click.argument("rest", nargs=-1)
    def either(**values):
        return values

    with either.make_context("either", ["--name", "a", "b", "--", "--name", "c"]) as context:
        assert context.params == {"name": ("a", "b"), "rest": ("--name", "c")}


def test_no_command_takes_positional_arguments_beside_an_option_of_several_values():
    """Otherwise the argument behind such an option would become one of its values."""
    for path, each in COMMANDS.items():
        many = [one for one in each.params if isinstance(one, Option) and one.many]
        arguments = [one for one in each.params if isinstance(one, click.Argument)]
        assert not (many and arguments), path


EXCLUSIVE = [
    (path, name, each.excludes)
    for path, one in COMMANDS.items()
    for name, each in options_of(one).items()
    if isinstance(each, Option) and each.excludes is not None
]


@pytest.mark.parametrize(("path", "name", "other"), EXCLUSIVE, ids=str)
def test_options_that_exclude_each_other_are_refused_together(path, name, other, capsys):
    both = options_of(COMMANDS[path])
    words = []
    for each in (other, name):
        words += [each] if both[each].is_flag else [each, "0.1" if each.endswith("-s") else "1"]
    required = ["x" for each in COMMANDS[path].params if isinstance(each, click.Argument)]
    for each in COMMANDS[path].params:
        if isinstance(each, click.Option) and each.required:
            required += [each.opts[0], "x"]
    assert main([*path, *required, *words]) == 2
    error = capsys.readouterr().err
    assert f"awarenav {' '.join(path)}: {name} and {other} exclude each other" in error


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["estimat"], "awarenav: No such command 'estimat'. Did you mean 'estimate'?"),
        (["models", "lst"], "awarenav models: No such command 'lst'. Did you mean 'list'?"),
        (["crossings", "--workrs", "x"], "No such option '--workrs'. Did you mean '--workers'?"),
        (["--versio"], "No such option '--versio'. Did you mean '--version'?"),
        (["demo", "--perception", "pixel"], "got 'pixel'; did you mean 'pixels'?"),
        (["completion", "bsh"], "got 'bsh'; did you mean 'bash'?"),
        (["crossings", "--scenario", "blind_corne"], "did you mean 'blind_corner'?"),
        (["crossings", "--policy", "balancd"], "did you mean 'balanced'?"),
        (["crossings", "--fault", "ghost"], "did you mean 'ghosts'?"),
        (["policy", "show", "balancd"], "did you mean 'balanced'?"),
        (["models", "fetch", "yolox-tny"], "did you mean 'yolox-tiny'?"),
    ],
)
def test_a_wrong_word_is_refused_with_the_nearest_right_one(words, message, tmp_path, capsys):
    out = ["--out", str(tmp_path / "out")] if words[0] == "crossings" else []
    assert main([*words, *out]) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert message in last
    assert last.startswith("awarenav")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["crossings", "--episodes", "0"], "'--episodes': 0 is not in the range x>=1"),
        (["crossings", "--episodes", "2.5"], "'2.5' is not a valid integer"),
        (["bridge", "--robot", "x", "--domain", "300"], "300 is not in the range 0<=x<=232"),
        (["estimate", "x", "--min-score", "2"], "2.0 is not in the range 0.0<=x<=1.0"),
        (["judge", "a", "b", "--max-occlusion", "half"], "'half' is not a valid float"),
        (["crossings", "--policy"], "Option '--policy' requires an argument"),
        (["estimate"], "Missing argument 'SOURCE'"),
        (["bridge"], "Missing option '--robot'"),
    ],
)
def test_a_value_that_is_not_valid_is_refused_with_the_help_to_read(words, message, capsys):
    assert main(words) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"Usage: awarenav {words[0]} ")
    assert f"Try 'awarenav {words[0]} --help' for help." in error
    assert error.splitlines()[-1].startswith(f"awarenav {words[0]}: ")
    assert message in error.splitlines()[-1]


def first_sentence(text):
    return text.split(". ")[0].rstrip(".")


@pytest.mark.parametrize("name", SHARED)
def test_a_shared_option_means_the_same_in_every_command(name):
    found = defaultdict(list)
    for path, each in COMMANDS.items():
        shared = options_of(each).get(name)
        if shared is None or (path[0], name) in OTHER_MEANING:
            continue
        # One value or several, a file or a folder: the metavar says which. Beside arguments, an
        # option with several values is given several times and has no dots.
        dots = (shared.metavar or "").endswith("...")
        kind = "DIR" if shared.metavar == "DIR" else (shared.multiple, dots)
        found[kind].append(shared)
    assert found
    assert sum(map(len, found.values())) > 1
    for alike in found.values():
        assert len({type(each.type) for each in alike}) == 1
        assert len({each.is_flag for each in alike}) == 1
        if name != "--out":  # what is written differs, and so does its help
            assert len({each.metavar for each in alike}) == 1
            assert len({first_sentence(each.help) for each in alike}) == 1
        if isinstance(alike[0].type, OneOf):
            widest = max((each.type.choices for each in alike), key=len)
            assert all(set(each.type.choices) <= set(widest) for each in alike)
        else:
            assert len({tuple(sorted(vars(each.type).items(), key=str)) for each in alike}) == 1


def test_every_seed_is_zero_unless_it_is_given():
    defaults = {
        path: options_of(each)["--seed"].default
        for path, each in COMMANDS.items()
        if "--seed" in options_of(each)
    }
    assert defaults.pop(("scenario", "show")) is None  # the whole scenario, not one episode of it
    assert set(defaults.values()) == {0}


def test_defaults_of_judge_are_those_of_its_config():
    values = parsed(("judge",), "truth.jsonl", "estimates.jsonl")
    fields = JudgeConfig().model_dump()
    assert {name: values[name] for name in fields} == fields
