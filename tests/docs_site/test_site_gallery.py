"""The gallery shows every shipped scenario with a film, and every example with a picture."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from paths import ROOT

pytest.importorskip("pybullet", reason="the gallery shows crossings (extra sim)")
sys.path.insert(0, str(ROOT))

from awarenav.figures import Image
from sim_tests import run_crossing
from tools.docs_site import films
from tools.docs_site.example_pictures import FOLDER, PLANNERS, example_names, record_example
from tools.docs_site.gallery import PAGE, gallery_page


def test_the_page_is_what_its_command_writes() -> None:
    text = PAGE.read_text("utf-8")
    assert text == gallery_page(), "run python -m tools.docs_site.gallery"
    for name in films.filmed_scenarios():
        assert f"### {name}\n" in text
        assert f"images/films/{name}.webp" in text
    for path in (ROOT / "examples").glob("*.py"):
        assert f"(../examples/{path.name})" in text


@pytest.mark.parametrize("name", films.filmed_scenarios())
def test_a_scenario_has_a_film(name: str) -> None:
    path = films.FOLDER / f"{name}.webp"
    assert path.is_file(), f"run python -m tools.docs_site.films {name}"
    assert path.stat().st_size <= films.MAX_FILM_BYTES
    with Image.open(path) as film:
        assert film.n_frames >= 40
        first = np.asarray(film.convert("RGB")).astype(int)
        film.seek(film.n_frames // 2)
        later = np.asarray(film.convert("RGB")).astype(int)
    assert np.abs(later - first).max() > 100  # something moves


def test_no_film_is_left_of_a_scenario_that_is_gone() -> None:
    kept = {path.stem for path in films.FOLDER.glob("*.webp")}
    assert kept == set(films.filmed_scenarios())
    total = sum(path.stat().st_size for path in films.FOLDER.glob("*.webp"))
    assert total <= films.MAX_SUM_BYTES


def test_every_example_has_a_picture() -> None:
    assert {path.stem for path in FOLDER.glob("*.png")} == set(example_names())
    third_party = {path.stem for path in (ROOT / "examples" / "planners").glob("[!_]*.py")}
    assert third_party == PLANNERS.keys()


def test_an_example_is_recorded_as_it_runs() -> None:
    recording = record_example("plug_into_planner")
    assert len(recording.constraints) == 41
    radii = [constraints.obstacles[0].radius_m for _, constraints in recording.constraints]
    assert radii[-1] < radii[12] - 0.3


def test_a_film_shows_the_crossing_at_its_rate() -> None:
    film = films.Film()
    result = run_crossing("crossing_attentive", policy="balanced", seed=0, observer=film)
    assert len(film.pictures) == pytest.approx(result.duration_s / 0.25, abs=1.5)
    sizes = {picture.size for picture in film.pictures}
    assert len(sizes) == 1
    assert len(film.webp()) <= films.MAX_FILM_BYTES
