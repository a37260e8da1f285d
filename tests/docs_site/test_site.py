"""The site: it builds strictly, fetches nothing, and its generated pages name everything."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from paths import ROOT

pytest.importorskip("mkdocs", reason="the site is made with the extra docs")
pytest.importorskip("pybullet", reason="the site shows crossings (extra sim)")
sys.path.insert(0, str(ROOT))

from awarenav.figures import Image
from nav_adapter.ros2 import MASK_TOPICS, PUBLISHED, READ
from sim_tests import run_crossing
from sim_tests.study.measures import METRICS, RECORD_COLUMNS, SHARES
from tools.docs_site import films, reference
from tools.docs_site.example_pictures import FOLDER, PLANNERS, example_names, record_example
from tools.docs_site.gallery import gallery_page
from tools.docs_site.hooks import links_rewritten
from tools.docs_site.roles import linked, plain

PAGES = reference.pages()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as CI builds it; warnings are errors (``strict`` in mkdocs.yml)."""
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--site-dir", str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.mark.full
def test_nothing_is_fetched_from_other_hosts(site: Path) -> None:
    fetched = (
        r"""<(?:script|img|source|video|iframe|audio|embed)\b[^>]*(?:src|srcset)="(?:https?:)?//"""
    )
    styles = r"""<link\b[^>]*rel="(?:stylesheet|icon|preload|preconnect)[^>]*href="(?:https?:)?//"""
    pages = list(site.rglob("*.html"))
    assert len(pages) > 30
    for path in pages:
        text = path.read_text("utf-8")
        assert not re.search(f'{fetched}|{styles}|class="mermaid"', text), path.name
    for path in site.rglob("*.css"):
        assert not re.search(r"url\([\"']?(?:https?:)?//", path.read_text("utf-8")), path.name


@pytest.mark.full
def test_the_reference_shows_commands_settings_and_docstrings(site: Path) -> None:
    for path in (site / "reference").glob("*.html"):
        text = path.read_text("utf-8")
        assert not re.search(r":(?:class|func|meth|mod|data|attr|exc):", text), path.name
        assert "Annotated" not in text, path.name
    adapter = (site / "reference" / "nav_adapter.html").read_text("utf-8")
    assert 'id="nav_adapter.NavAdapter.update"' in adapter
    commands = (site / "reference" / "commands.html").read_text("utf-8")
    assert 'id="awarenav-bridge"' in commands
    assert "--perception" in commands
    policy = (site / "reference" / "policy-keys.html").read_text("utf-8")
    assert 'id="safetymargins"' in policy
    assert "uncertainty_sigmas" in policy


def rows_of(page: str) -> dict[str, list[str]]:
    """The cells of every table row that begins with a name in code; later rows replace."""
    rows = re.findall(r"^\| `([^`]+)` \| (.*) \|$", PAGES[page], re.MULTILINE)
    return {name: re.split(r" (?<!\\)\| ", cells) for name, cells in rows}


def test_every_metric_column_and_topic_is_listed() -> None:
    metrics = rows_of("metrics.md")
    assert {*RECORD_COLUMNS, *METRICS, *SHARES} <= metrics.keys()
    assert metrics["time_lost_s"][0] == "s"
    topics = rows_of("reference/topics.md")
    known = (*PUBLISHED.values(), *MASK_TOPICS.values(), *READ.values())
    assert {f"/{each.name}" for each in known} == topics.keys()
    assert topics["/speed_limit"] == ["`nav2_msgs/SpeedLimit`", "reliable", "volatile", "10"]


def test_every_key_of_a_file_is_on_one_page() -> None:
    shown = "".join(PAGES[f"reference/{name}.md"] for name in reference.SETTINGS_PAGES)
    for name, page in reference.SETTINGS_PAGES.items():
        models = [model for _, model in page.models()]
        assert page.model in models
        for model in models:
            path = f"::: {model.__module__}.{model.__qualname__}\n"
            assert shown.count(path) == 1, model.__name__
            assert f"{{ #{model.__name__.lower()} }}" in PAGES[f"reference/{name}.md"]
            assert f"members: [{', '.join(model.model_fields)}]" in shown, model.__name__


def test_packages_have_pages_and_the_front_door_leads_to_them() -> None:
    for package in reference.PACKAGES:
        shown = re.findall(r"members: \[(.*)\]", PAGES[f"reference/{package}.md"])[0].split(", ")
        assert sorted(shown) == sorted(importlib.import_module(package).__all__)
    # A page begins with what its users need first.
    for package, name in (
        ("nav_adapter", "NavAdapter"),
        ("tracking", "PersonTracker"),
        ("perception", "AwarenessPipeline"),
        ("sim_tests", "run_crossing"),
    ):
        assert f"members: [{name}, " in PAGES[f"reference/{package}.md"]
    rows = rows_of("reference/awarenav.md")
    assert rows["awarenav.NavAdapter"] == ["[nav_adapter](nav_adapter.md#nav_adapter.NavAdapter)"]
    awarenav = importlib.import_module("awarenav")
    assert rows.keys() == {f"awarenav.{name}" for name in awarenav.__all__}


def test_references_of_docstrings_become_links_or_code() -> None:
    text = "See :class:`~perception.Camera` and :func:`max_speed_mps`::\n\n    code\n"
    assert plain(":meth:`~a.B.c` and :data:`D`") == "`c` and `D`"
    assert linked(text, "nav_adapter") == (
        'See <autoref identifier="perception.Camera" optional><code>Camera</code></autoref> and '
        '<autoref identifier="nav_adapter.max_speed_mps" optional><code>max_speed_mps</code>'
        "</autoref>:\n\n    code\n"
    )


def test_links_out_of_docs_lead_to_the_repository_or_stay_text() -> None:
    text = (
        "[x](../../examples/x.py) [top](../../README.md#try) [web](https://example.org)\n\n"
        "[a](../a.md#b) [ten](../ten.ipynb) ![film](../film.webp)\n\n"
        "```md\n[x](../../examples/x.py)\n```\n"
    )
    stays = (
        " [web](https://example.org)\n\n[a](../a.md#b) [ten](../ten.md) ![film](../film.webp)\n\n"
        "```md\n[x](../../examples/x.py)\n```\n"
    )
    assert links_rewritten("tutorials/t.md", text, "") == f"x top{stays}"
    url = "https://git.example/awarenav"
    assert links_rewritten("tutorials/t.md", text, url) == (
        f"[x]({url}/blob/main/examples/x.py) [top]({url}/blob/main/README.md#try){stays}"
    )


def test_the_gallery_has_every_scenario_and_every_example() -> None:
    text = gallery_page()
    for name in films.filmed_scenarios():
        assert f"### {name}\n" in text
        assert f"images/films/{name}.webp" in text
        assert re.search(rf"```yaml\n(#.*\n)*name: {name}\n", text), name
    for name in example_names():
        assert f"/{name}.py)" in text
    assert "--sensors camera+scanner" in text
    assert "--perception keypoints+scanner" not in text  # --perception has no sensors
    third_party = {path.stem for path in (ROOT / "examples" / "planners").glob("[!_]*.py")}
    assert third_party == PLANNERS.keys()
    assert {path.stem for path in FOLDER.glob("*.png")} == set(example_names())


def test_every_scenario_has_a_film_that_moves_and_no_other_is_left() -> None:
    paths = sorted(films.FOLDER.glob("*.webp"))
    assert {path.stem for path in paths} == set(films.filmed_scenarios())
    assert sum(path.stat().st_size for path in paths) <= films.MAX_SUM_BYTES
    for path in paths:
        assert path.stat().st_size <= films.MAX_FILM_BYTES
        with Image.open(path) as film:
            assert film.n_frames >= 40, path.name
            first = np.asarray(film.convert("RGB")).astype(int)
            film.seek(2)
            assert np.abs(np.asarray(film.convert("RGB")).astype(int) - first).max() > 50, path.name


def test_an_example_is_recorded_as_it_runs() -> None:
    recording = record_example("plug_into_planner")
    assert len(recording.constraints) == 41
    radii = [constraints.obstacles[0].radius_m for _, constraints in recording.constraints]
    assert radii[-1] < radii[12] - 0.3


@pytest.mark.full
def test_a_film_shows_the_crossing_at_its_rate() -> None:
    film = films.Film()
    result = run_crossing("crossing_attentive", policy="balanced", seed=0, observer=film)
    assert len(film.pictures) == pytest.approx(result.duration_s / 0.25, abs=1.5)
    assert len({picture.size for picture in film.pictures}) == 1
    assert len(film.webp()) <= films.MAX_FILM_BYTES
