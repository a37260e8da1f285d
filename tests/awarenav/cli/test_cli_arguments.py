"""The parsing of command lines: several values, exclusions, suggestions, shared options."""

from __future__ import annotations

import click
import pytest
from command_line import COMMANDS, options_of

from awarenav.cli import Option, main


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
        (
            ["crossings", "--overwrit", "x"],
            "No such option '--overwrit'. Did you mean '--overwrite'?",
        ),
        (["--versio"], "No such option '--versio'. Did you mean '--version'?"),
        (["demo", "--perception", "pixel"], "'pixel' is unknown; did you mean 'pixels'?"),
        (["completion", "bsh"], "'bsh' is unknown; did you mean 'bash'?"),
        (["crossings", "--scenario", "blind_corne"], "did you mean 'blind_corner'?"),
        (["crossings", "--policy", "balancd"], "did you mean 'balanced'?"),
        (["crossings", "--scenario", "balanced"], "'balanced' is a policy, not a scenario"),
        (["crossings", "--policy", "late_glance"], "'late_glance' is a scenario, not a policy"),
        (["crossings", "--fault", "ghost"], "did you mean 'ghosts'?"),
        (["crossings", "--policy", "brave"], "or a .yaml file, got 'brave'"),
        (["crossings", "--planner", "costmp"], "did you mean 'costmap'?"),
        (["crossings", "--planner", "nowhere:X"], "or name that folder in PYTHONPATH"),
        (["policy", "show", "balancd"], "did you mean 'balanced'?"),
        (["render", "--layouts", "aisle"], "did you mean 'aisles'?"),
        (["render", "--bodies", "gone.npz"], "there is no file gone.npz"),
        (["estimate", "http://127.0.0.1:9/x"], "is its address right"),
        (["models", "fetch", "yolox-tny"], "did you mean 'yolox-tiny'?"),
        (["doctor", "nowhere"], "no such file or folder: nowhere"),
        (["doctor", "nowhere", "--fov-deg", "60", "--camera", "a.yaml"], "exclude each other"),
        (["judge", "x", "y", "--out", "report.txt"], "must end in .json or .md"),
    ],
)
def test_a_wrong_word_is_refused_with_what_is_right(words, message, tmp_path, capsys):
    out = ["--out", str(tmp_path / "out")] if words[0] in ("crossings", "render") else []
    assert main([*words, *out]) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert message in last
    assert last.startswith("awarenav")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["crossings", "--episodes", "0"], "'--episodes': 0 is not in the range x>=1"),
        (["crossings", "--episodes", "2.5"], "'2.5' is not a valid whole number"),
        (["bridge", "--robot", "x", "--domain", "300"], "300 is not in the range 0<=x<=232"),
        (["estimate", "x", "--min-score", "2"], "2.0 is not in the range 0.0<=x<=1.0"),
        (["bridge", "--robot", "x", "--rate", "half"], "'half' is not a valid number"),
        (["crossings", "--policy"], "Option '--policy' requires an argument"),
        (["estimate"], "Missing argument 'SOURCE'"),
        (["bridge"], "Missing option '--robot'"),
    ],
)
def test_a_value_that_is_not_valid_is_refused_in_one_line_with_the_help_to_read(
    words, message, capsys
):
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"awarenav {words[0]}: ")
    assert message in line
    assert line.endswith(f"(see `awarenav {words[0]} --help`)")


NUMBERS = {
    (path, name): each.type
    for path, command in COMMANDS.items()
    for name, each in options_of(command).items()
    if isinstance(each.type, click.FloatRange) or each.type is click.FLOAT
}


@pytest.mark.parametrize("word", ["nan", "inf", "-inf"])
def test_no_option_takes_a_number_that_is_not_finite(word):
    assert len(NUMBERS) > 20
    for number in NUMBERS.values():
        with pytest.raises(click.BadParameter, match=r"must be finite|not in the range"):
            number.convert(word, None, None)


def test_no_option_takes_a_count_that_no_computer_finishes():
    counts = [
        each.type
        for command in COMMANDS.values()
        for each in options_of(command).values()
        if each.type.name in ("whole number", "seeds", "integer range")
    ]
    assert len(counts) > 20
    for count in counts:
        with pytest.raises(click.BadParameter, match=r"must be|not in the range"):
            count.convert(str(10**20), None, None)


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_every_command_refuses_an_unknown_option_in_one_line(path, capsys):
    assert main([*path, "--no-such-option"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"awarenav {' '.join(path)}: ")


def test_every_seed_is_zero_unless_it_is_given():
    defaults = {
        path: options_of(each)["--seed"].default
        for path, each in COMMANDS.items()
        if "--seed" in options_of(each)
    }
    assert defaults.pop(("scenario", "show")) is None  # the whole scenario, not one episode of it
    assert defaults.pop(("demo",)) is None  # the median one of the reported seeds
    assert set(defaults.values()) == {0}
