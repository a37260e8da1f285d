"""Workflows: pinned actions, least rights, no secret, and commands that the checkout has."""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import pytest
import yaml
from paths import ROOT

FOLDER = ROOT / ".github" / "workflows"
TEXTS = {path.name: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("*.yml"))}
#: YAML 1.1 reads the key `on` as true.
WORKFLOWS: dict[str, dict[Any, Any]] = {name: yaml.safe_load(text) for name, text in TEXTS.items()}
SETUP = (ROOT / "tools" / "setup_venv.sh").read_text(encoding="utf-8")
PYPROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")


def steps(workflow: str) -> Iterator[dict[str, Any]]:
    for job in WORKFLOWS[workflow]["jobs"].values():
        yield from job.get("steps", ())


def commands(workflow: str) -> str:
    return "\n".join(step["run"] for step in steps(workflow) if "run" in step)


def test_the_workflows_are_there() -> None:
    assert set(WORKFLOWS) == {"ci.yml", "nightly.yml", "release.yml"}


@pytest.mark.parametrize("name", TEXTS)
def test_actions_are_pinned_to_a_version(name: str) -> None:
    used = [step["uses"] for step in steps(name) if "uses" in step]
    used += [job["uses"] for job in WORKFLOWS[name]["jobs"].values() if "uses" in job]
    assert used
    for action in used:
        if action.startswith("./"):
            assert (ROOT / action).is_file()
        else:
            assert re.fullmatch(r"[\w-]+(/[\w-]+)+@v\d+\.\d+\.\d+", action), action


@pytest.mark.parametrize("name", TEXTS)
def test_there_is_no_secret_and_no_right_to_write_by_default(name: str) -> None:
    assert "secrets." not in TEXTS[name]
    assert "password" not in TEXTS[name]
    assert WORKFLOWS[name]["permissions"] == {"contents": "read"}


def test_each_right_to_write_is_where_it_is_used() -> None:
    jobs = WORKFLOWS["release.yml"]["jobs"]
    assert "permissions" not in str(WORKFLOWS["ci.yml"]["jobs"])
    rights = {
        name: {right for right, kind in job.get("permissions", {}).items() if kind == "write"}
        for name, job in jobs.items()
    }
    assert rights == {
        "test": set(),
        "build": {"id-token", "attestations"},
        "index": {"id-token"},
        "page": {"contents"},
        "site": {"contents"},
    }


@pytest.mark.parametrize("name", TEXTS)
def test_jobs_wait_for_jobs_that_exist_and_end_by_themselves(name: str) -> None:
    jobs = WORKFLOWS[name]["jobs"]
    for job in jobs.values():
        needs = job.get("needs", [])
        assert set([needs] if isinstance(needs, str) else needs) <= set(jobs)
        assert "uses" in job or job["timeout-minutes"] <= 60


def test_nothing_is_published_before_all_tests_have_passed() -> None:
    jobs = WORKFLOWS["release.yml"]["jobs"]
    assert jobs["test"] == {"uses": "./.github/workflows/ci.yml"}
    assert jobs["build"]["needs"] == "test"
    assert jobs["index"]["needs"] == "build"
    assert jobs["page"]["needs"] == jobs["site"]["needs"] == "index"
    assert "workflow_call" in WORKFLOWS["ci.yml"][True]


def test_ci_runs_everything_on_every_python_that_has_the_simulator() -> None:
    job = WORKFLOWS["ci.yml"]["jobs"]["all"]
    pythons = job["strategy"]["matrix"]["python"]
    assert [tuple(map(int, each.split("."))) for each in pythons] == [(3, 10), (3, 11)]
    assert "not in ((3, 10), (3, 11))" in SETUP
    (run,) = (step for step in job["steps"] if "run" in step)
    assert run["run"] == ".ci/run"
    assert run["env"] == {"PYTHON": "python${{ matrix.python }}"}
    other = TEXTS["ci.yml"].count('python-version: "3.12"')
    classified = re.findall(r"Python :: (3\.\d+)", PYPROJECT)
    assert classified == [*pythons, *["3.12"] * other]


@pytest.mark.parametrize("name", TEXTS)
def test_commands_are_those_of_the_checkout(name: str) -> None:
    text = commands(name)
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"\bmake (\w+)", text):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
    for module in re.findall(r"-m (tools\.\w+)", text):
        assert find_spec(module) is not None, module
    extras = set(re.findall(r"^(\w+) = \[$", PYPROJECT, re.MULTILINE))
    for chosen in re.findall(r"'\.\[([\w,]+)\]'", text):
        assert set(chosen.split(",")) <= extras


def test_a_release_is_checked_built_signed_and_published_in_this_order() -> None:
    order = [
        step.get("run", "") + step.get("uses", "")
        for step in WORKFLOWS["release.yml"]["jobs"]["build"]["steps"]
    ]
    wanted = (
        "-m tools.release",
        "-m build",
        "twine check --strict",
        "pip install --constraint requirements.lock dist/*.whl",
        "attest-build-provenance",
        "upload-artifact",
    )
    places = [next(i for i, each in enumerate(order) if part in each) for part in wanted]
    assert places == sorted(places)
    (publish,) = (
        step for step in steps("release.yml") if "gh-action-pypi-publish" in step.get("uses", "")
    )
    assert publish["with"] == {"attestations": True}
    assert WORKFLOWS["release.yml"]["jobs"]["index"]["environment"] == "index"
