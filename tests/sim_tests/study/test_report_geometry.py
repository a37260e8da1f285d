"""Labels of the page do not overlap and no mark hides another, on a phone too."""

from __future__ import annotations

import itertools
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from chromium_pipe import Chromium
from report_runs import MadeUpRun, made_up_run

from sim_tests.study.report import write_report
from sim_tests.study.report._geometry import FONT_PX, PLOT_PX, TRACK_PX, Region, label_px, spread
from sim_tests.study.report._panel import Scale

WHOLE = Region(0.0, 100.0, 0.0, 100.0)


def same_outcomes(run: MadeUpRun) -> MadeUpRun:
    """The run in which every policy does what the first one did with the same seed."""
    first = {}
    records = []
    for record in run.records:
        like = first.setdefault((record.scenario, record.seed), record)
        records.append(replace(like, policy=record.policy, perception=record.perception))
    return replace(run, records=tuple(records))


def lost_everywhere(run: MadeUpRun) -> MadeUpRun:
    """The run in which nobody arrives, with the same margin in every episode."""
    records = tuple(
        replace(each, success=False, time_to_goal_s=None, time_lost_s=29.0, min_margin_m=-0.1)
        for each in run.records
    )
    return replace(run, records=records)


RUNS = {
    "one": lambda: made_up_run(scenarios=1, seeds=1, policies=("balanced",)),
    "few": lambda: made_up_run(scenarios=5, seeds=3),
    "same": lambda: same_outcomes(made_up_run(scenarios=20, seeds=4)),
    "lost": lambda: lost_everywhere(made_up_run(scenarios=4, seeds=4)),
    "many": lambda: made_up_run(scenarios=20, seeds=6, faults=("late_frames",)),
}


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("runs")
    return {
        name: write_report(run().write(folder / name), stills=False) for name, run in RUNS.items()
    }


@pytest.fixture(params=RUNS)
def page(request: pytest.FixtureRequest, pages: dict[str, Path]) -> Path:
    return pages[request.param]


def boxes_across(texts: list[tuple[float, str]], length_px: float) -> list[tuple[float, float]]:
    """Ends of centred labels along an axis."""
    return [
        (
            0.01 * length_px * place - 0.5 * label_px(text),
            0.01 * length_px * place + 0.5 * label_px(text),
        )
        for place, text in texts
    ]


def assert_apart(boxes: list[tuple[float, float]]) -> None:
    for (_, end), (start, _) in itertools.pairwise(sorted(boxes)):
        assert end < start


def test_labels_of_axes_do_not_overlap(page: Path) -> None:
    html = page.read_text("utf-8")
    axes = re.findall(r'<svg class="axis">(.*?)</svg>', html)
    assert axes
    label = re.compile(r'<text(?: class="\w+")? x="([\d.]+)%"[^>]*>([^<]+)</text>')
    for axis in axes:
        texts = [(float(place), text) for place, text in label.findall(axis)]
        assert texts
        assert_apart(boxes_across(texts, TRACK_PX))
    across = re.findall(r'<text class="xt" x="([\d.]+)%"[^>]*>([^<]+)<', html)
    assert_apart(boxes_across([(float(place), text) for place, text in across], PLOT_PX[0]))
    upright = re.findall(r'<text class="yt" x="-8" y="([\d.]+)%"[^>]*>', html)
    middles = [0.01 * PLOT_PX[1] * float(place) for place in upright]
    assert_apart([(middle - 0.5 * FONT_PX, middle + 0.5 * FONT_PX) for middle in middles])


def test_no_mark_covers_another(page: Path) -> None:
    html = page.read_text("utf-8")
    marks = re.findall(r'<use href="#([ms])\d" x="([\d.]+)%" y="([\d.]+)%"/></a>', html)
    assert marks
    apart = 1.6 if marks[0][0] == "m" else 0.6
    places = np.array([(float(x), float(y)) for _, x, y in marks])
    assert len(places) == len(json.loads(re.search(r'\{"arms".*\}', html)[0])["rows"])
    assert places.min() >= 0.0
    assert places.max() <= 100.0
    gaps = np.abs(places[:, None] - places[None]).max(axis=2) + 100.0 * np.eye(len(places))
    close = int((gaps.min(axis=1) < apart - 0.021).sum())
    covered = re.search(r"(\d+) marks? lies? on others", html)
    assert close == 0 or covered is not None


def test_marks_keep_to_their_side_of_a_margin_of_0(page: Path) -> None:
    html = page.read_text("utf-8")
    zero = re.search(
        r'<line class="zero" x1="([\d.]+)%" x2="[\d.]+%" y1="0" y2="100%"/>\s*<g', html
    )
    if zero is None:
        pytest.skip("all margins are on one side")
    rows = json.loads(re.search(r'\{"arms".*\}', html)[0])["rows"]
    xs = re.findall(r'<use href="#[ms]\d" x="([\d.]+)%" y="[\d.]+%"/></a>', html)
    for row, x in zip(rows, xs, strict=True):
        margin = float(row[4].replace("\N{MINUS SIGN}", "-"))
        if abs(margin) > 0.005:
            assert (float(x) >= float(zero[1])) == (margin > 0.0)


def test_marks_at_one_place_are_all_seen() -> None:
    places, covered = spread([(50.0, 50.0, WHOLE)] * 12, 2.0)
    assert covered == 0
    assert len(set(places)) == 12
    assert places[0] == (50.0, 50.0)
    assert max(abs(x - 50.0) for x, _ in places) == pytest.approx(2.0)
    assert max(abs(y - 50.0) for _, y in places) <= 8.0
    assert spread([(50.0, 50.0, WHOLE)] * 12, 2.0)[0] == places


def test_marks_that_find_no_place_are_counted() -> None:
    strip = Region(0.0, 100.0, 0.0, 9.0)
    places, covered = spread([(50.0, 4.5, strip)] * 3000, 2.0)
    assert covered == 3000 - len(set(places))
    assert len(set(places)) == 9 * 5
    assert all(strip.holds(*place) for place in places)


def test_marks_far_apart_stay() -> None:
    rng = np.random.default_rng(0)
    grid = [(4.0 * i, 4.0 * j, WHOLE) for i in range(26) for j in range(26)]
    order = rng.permutation(len(grid))
    shuffled = [grid[i] for i in order]
    places, covered = spread(shuffled, 2.0)
    assert covered == 0
    assert places == [(x, y) for x, y, _ in shuffled]


@pytest.mark.parametrize("length_px", [60.0, TRACK_PX, 300.0])
@pytest.mark.parametrize(
    ("low", "high"),
    [(0.0, 1.0), (-0.5, 0.5), (-120.0, 3000.0), (0.0, 1e-3), (-1.23, -1.2), (99.5, 100.2)],
)
def test_ticks_fit_their_axis(low: float, high: float, length_px: float) -> None:
    ticks = Scale(low, high).ticks(8, length_px)
    assert ticks
    assert_apart(boxes_across(list(ticks), length_px))


# Labels in plots that overlap or lie beyond the window; and how many places the marks have.
_FOUND = """(() => {
  const overlaps = [];
  for (const svg of document.querySelectorAll(".axis, .frame > svg")) {
    const labels = [...svg.querySelectorAll("text")];
    const boxes = labels.map((each) => each.getBoundingClientRect());
    labels.forEach((one, i) => labels.slice(i + 1).forEach((two, k) => {
      const a = boxes[i], b = boxes[i + 1 + k];
      if (Math.min(a.right, b.right) > Math.max(a.left, b.left) &&
          Math.min(a.bottom, b.bottom) > Math.max(a.top, b.top) + 1) {
        overlaps.push(one.textContent + " / " + two.textContent);
      }
    }));
    boxes.forEach((box, i) => {
      if (box.width && (box.left < 0 || box.right > innerWidth)) {
        overlaps.push(labels[i].textContent + " outside");
      }
    });
  }
  const places = [...document.querySelectorAll(".marks use")].map((each) =>
    Math.round(2 * each.x.baseVal.value) + " " + Math.round(2 * each.y.baseVal.value));
  return {
    overlaps, labels: document.querySelectorAll(".axis text, .frame text").length,
    marks: places.length, places: new Set(places).size, width: innerWidth,
    wide: document.documentElement.scrollWidth - innerWidth,
  };
})()"""


@pytest.mark.parametrize("width_px", [390, 1280])
def test_a_browser_draws_labels_and_marks_apart(
    page: Path, width_px: int, chromium: Chromium
) -> None:
    chromium.open(page, width=width_px, height=900, dark=width_px == 390)
    found = chromium.evaluate(_FOUND)
    assert found["overlaps"] == []
    assert found["labels"] > 10
    assert found["width"] == width_px
    assert found["wide"] <= 0
    counted = re.search(r"(\d+) marks? lies? on others", page.read_text("utf-8"))
    assert found["marks"] - found["places"] == (0 if counted is None else int(counted[1]))
    assert found["places"] > 0
    assert chromium.complaints() == []
