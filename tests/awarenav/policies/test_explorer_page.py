"""The policy explorer as a page: alone on its machine, quick, legible, and usable by keyboard."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from chromium_pipe import Chromium

from awarenav.cli import main
from nav_adapter import AwarenessPolicy

WINDOWS = [(1280, 800), (1024, 768), (390, 844)]
# From the start of the navigation to the end of the load event.
MOST_MS = 2000.0

# Everything that a policy can have is switched on and opened.
ALL_OPEN = """(() => {
  const rules = DATA.models.SpeedRules.fields.filter(({ kind }) => kind === "model");
  for (const { key, models: [name] } of rules) page.draft.rules[key] ??= checkedModel(name, {}, "");
  for (const field of ["noticed", "alerts"])
    page.draft[field] ??= structuredClone(DATA.presets.balanced[field] ?? null);
  document.querySelectorAll("details").forEach((each) => { page.open.add(each.id); });
  const paths = ["inflation", "speed", "outline", "rules", "noticed", "alerts", "margins", "timing",
    "filter", "Person", "Track", "Robot's motion", "Robot"];
  rules.forEach(({ key }) => paths.push(`rules.${key}`));
  paths.forEach((path) => page.open.add(path));
  takeDrafts();
  build();
  document.querySelectorAll("details").forEach((each) => { each.open = true; });
  document.querySelectorAll(".more").forEach((each) => each.click());
  draw();
})()"""

# Visible text, or the edge of a control, with too little contrast after WCAG 2.2 (1.4.3, 1.4.11).
TOO_FAINT = """(() => {
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (text) => {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillStyle = text;
    canvas.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = canvas.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const light = (colour) => {
    const [r, g, b] = colour.slice(0, 3).map((v) => v / 255)
      .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ratio = (a, b) => {
    const [dark, bright] = [light(a), light(b)].sort((one, other) => one - other);
    return (bright + 0.05) / (dark + 0.05);
  };
  const behind = (element) => {
    const inDrawing = element instanceof SVGElement && element.parentElement;
    for (let each = inDrawing || element; each; each = each.parentElement) {
      const colour = rgba(getComputedStyle(each).backgroundColor);
      if (colour[3] > 0.99) return colour;
    }
    return [255, 255, 255, 1];
  };
  const shown = [...document.querySelectorAll("body *")].filter((e) =>
    !e.closest("script, .skip, title, option") && e.getClientRects().length);
  const texts = shown.filter((e) =>
    [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim())
    || e.matches("input[type=number], textarea, select"));
  const named = (e, value) =>
    `${e.tagName}.${e.getAttribute("class")} ${e.textContent.slice(0, 20)} ${value.toFixed(2)}`;
  const faint = [];
  for (const each of texts) {
    if (each.disabled) continue;
    const style = getComputedStyle(each);
    const value = ratio(rgba(each instanceof SVGElement ? style.fill : style.color), behind(each));
    if (value < 4.5) faint.push(named(each, value));
  }
  const marks = ".curve, .mark, .body, .obstacleline, .robot, .unaware, .bodyline";
  for (const each of document.querySelectorAll(marks)) {
    const style = getComputedStyle(each);
    const colour = style.stroke === "none" || each.matches(".mark") ? style.fill : style.stroke;
    const value = ratio(rgba(colour), behind(each));
    if (value < 3) faint.push(named(each, value));
  }
  const edges = "input[type=number]:enabled, select, main button:enabled";
  for (const each of document.querySelectorAll(edges)) {
    const value = ratio(rgba(getComputedStyle(each).borderTopColor), behind(each.parentElement));
    if (value < 3 && !each.matches(".more")) faint.push(named(each, value));
  }
  return { texts: texts.length, faint };
})()"""

TOO_WIDE = """(() => {
  const padding = parseFloat(getComputedStyle(document.body).paddingRight);
  const width = document.documentElement.clientWidth - padding;
  return [...document.querySelectorAll("body *")].filter((e) => !e.closest("svg, .skip, #dock"))
    .filter((e) => e.getBoundingClientRect().right > width + 1)
    .map((e) => `${e.tagName}.${e.className} ${e.id}`);
})()"""


def test_the_file_needs_no_other_file_and_no_network(explorer: Path) -> None:
    text = explorer.read_text("utf-8")
    assert not re.search(r"https?:|@import|\bfetch\(|XMLHttpRequest|WebSocket|\burl\(", text)
    assert re.findall(r"<[^<>]*\s(?:src|href)\s*=\s*[\"'][^\"']*[\"']", text) == [
        '<link rel="icon" href="data:,"',
        '<a class="skip" href="#controls"',
    ]
    assert "default-src 'none'" in text
    assert explorer.stat().st_size < 300_000


@pytest.mark.parametrize(("width", "height"), WINDOWS)
@pytest.mark.parametrize("dark", [False, True])
def test_the_page_is_quick_quiet_and_legible(
    chromium: Chromium, explorer: Path, width: int, height: int, dark: bool
) -> None:
    chromium.open(explorer, width=width, height=height, dark=dark)
    timing = "performance.getEntriesByType('navigation')[0]"
    assert chromium.evaluate(f"{timing}.loadEventEnd - {timing}.startTime") < MOST_MS
    for step in (
        "true",
        ALL_OPEN,
        "takePolicy(checkedPolicy(structuredClone(DATA.presets.blind)))",
    ):
        chromium.evaluate(step)
        chromium.drawn()
        found = chromium.evaluate(TOO_FAINT)
        assert found["faint"] == []
        assert found["texts"] > 100
        assert chromium.evaluate(TOO_WIDE) == []
    assert chromium.requests() == [explorer.resolve().as_uri()]
    assert chromium.evaluate("performance.getEntriesByType('resource').length") == 0
    assert chromium.complaints() == []


def test_every_control_has_a_name_and_a_visible_focus(page: Chromium) -> None:
    page.evaluate(ALL_OPEN)
    page.drawn()
    controls = page.evaluate(
        """[...document.querySelectorAll("input, select, button, textarea, summary, a")]
        .filter((each) => !each.disabled && each.getClientRects().length).map((each) => {
          each.focus();
          const ring = each.matches("#load") ? each.parentElement : each;
          const style = getComputedStyle(ring);
          const name = each.getAttribute("aria-label")
            || [...(each.labels ?? [])].map((label) => label.textContent).join(" ")
            || each.textContent;
          return [name.trim(), document.activeElement === each && each.tabIndex >= 0,
            style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2, each.id];
        })"""
    )
    assert len(controls) > 150
    assert [each for each in controls if not each[0] or not each[1] or not each[2]] == []


def test_arrow_keys_move_a_setting_and_everything_that_follows(page: Chromium) -> None:
    page.evaluate("byId('inflation.aware_radius_m:slider').focus()")
    before = page.evaluate("answerIn(page).radius_m")
    for _ in range(20):
        page.press("ArrowRight", 39)
    assert page.evaluate("page.policy.inflation.aware_radius_m") == pytest.approx(0.65)
    assert page.evaluate("byId('inflation.aware_radius_m').value") == "0.65"
    radius_m = page.evaluate("answerIn(page).radius_m")
    assert radius_m == pytest.approx(before + 0.2)
    answers = page.evaluate("byId('answers').textContent")
    assert f"{radius_m:.2f} m" in answers
    assert "+0.20" in answers
    assert page.evaluate("document.querySelectorAll('#radius .other').length") == 1
    assert "aware_radius_m: 0.65" in page.evaluate("byId('text').value")
    assert page.evaluate("byId('about').textContent").startswith("inflation.aware_radius_m")


def test_the_tab_key_reaches_the_sliders_and_space_switches_a_rule(page: Chromium) -> None:
    page.evaluate("page.open.add('rules'); page.open.add('rules.near_cap'); build()")
    seen = []
    page.evaluate("byId('preset').focus()")
    for _ in range(12):
        page.press("Tab", 9)
        seen.append(page.evaluate("document.activeElement.id"))
    assert "situation.gap_m:slider" in seen
    assert "situation.gap_m" in seen
    page.evaluate("byId('rules.near_cap:on').focus()")
    page.press(" ", 32)
    assert page.evaluate("page.policy.rules.near_cap") == {"within_m": 1.5, "speed_mps": 0.8}
    assert page.evaluate("document.activeElement.id") == "rules.near_cap:on"
    assert page.evaluate("byId('rules.near_cap.within_m:slider') !== null")
    page.press(" ", 32)
    assert page.evaluate("page.policy.rules.near_cap") is None


def test_a_policy_that_is_not_valid_is_named_and_cannot_be_saved(page: Chromium) -> None:
    page.evaluate(
        """(() => {
          const number = byId("inflation.unaware_below");
          number.value = "0.9";
          number.dispatchEvent(new Event("input", { bubbles: true }));
        })()"""
    )
    page.drawn()
    assert "aware_above must exceed unaware_below" in page.evaluate("byId('problem').textContent")
    assert not page.evaluate("byId('problem').hidden")
    assert page.evaluate("byId('save').disabled")
    assert page.evaluate("page.policy.inflation.unaware_below") == 0.1
    page.evaluate("byId('preset').dispatchEvent(new Event('change'))")
    assert page.evaluate("byId('problem').hidden")
    assert page.evaluate("page.draft.inflation.unaware_below") == 0.1


def test_files_are_loaded_and_saved(page: Chromium, tmp_path: Path) -> None:
    mine = AwarenessPolicy.model_validate(
        {"inflation": {"table_m": [[0.2, 1.1], [0.7, 0.5]]}, "rules": {"near_cap": {}}}
    )
    mine.to_yaml(tmp_path / "mine.yaml")
    load(page, tmp_path / "mine.yaml")
    assert page.evaluate("page.policy") == mine.model_dump(mode="json")
    (tmp_path / "typo.yaml").write_text("margins: {uncertainty_sigma: 1}")
    load(page, tmp_path / "typo.yaml")
    assert page.evaluate("byId('problem').textContent") == (
        "typo.yaml is not used: unknown key 'uncertainty_sigma' in SafetyMargins; "
        "did you mean 'uncertainty_sigmas'?"
    )
    assert page.evaluate("page.policy") == mine.model_dump(mode="json")
    page.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    page.evaluate("byId('save').click()")
    saved = tmp_path / "policy.yaml"
    while not any(
        each.get("params", {}).get("state") == "completed"
        for each in page.events
        if each.get("method", "").endswith("downloadProgress")
    ):
        page.wait_for_event()
    assert AwarenessPolicy.from_yaml(saved) == mine
    assert page.complaints() == []


def load(page: Chromium, file: Path) -> None:
    root: dict[str, Any] = page.call("DOM.getDocument")["root"]
    node = page.call("DOM.querySelector", nodeId=root["nodeId"], selector="#load")["nodeId"]
    page.call("DOM.setFileInputFiles", files=[str(file)], nodeId=node)
    page.drawn()
    page.drawn()


def test_the_person_is_dragged_in_the_plan_and_the_point_in_a_chart(page: Chromium) -> None:
    box = page.evaluate("(({x, y, width, height}) => [x, y, width, height])"
                        "(byId('radius').getBoundingClientRect())")  # fmt: skip
    x, y = box[0] + 38 + 0.9 * (box[2] - 48), box[1] + 0.5 * box[3]
    drag(page, (x, y), (x, y))
    assert page.evaluate("page.situation.awareness_lower") == pytest.approx(0.9, abs=0.02)
    assert page.evaluate("byId('situation.awareness_lower').value") == "0.9"
    person = page.evaluate(
        "(({x, y, width, height}) => [x + width / 2, y + height / 2])"
        "(document.querySelector('#plan .body').getBoundingClientRect())"
    )
    drag(page, person, (person[0], person[1] - 60))
    assert page.evaluate("page.situation.bearing_deg") > 5
    assert page.complaints() == []


def drag(page: Chromium, start: Any, end: Any) -> None:
    def mouse(kind: str, at: Any) -> None:
        page.call("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], button="left",
                  clickCount=1)  # fmt: skip

    mouse("mousePressed", start)
    mouse("mouseMoved", end)
    mouse("mouseReleased", end)
    page.drawn()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["balancd"], "did you mean 'balanced'"),
        (["nowhere.yaml"], "cannot read nowhere.yaml"),
        (["--out", "page.pdf"], "--out must end in .html, got page.pdf"),
        (["--out", "folder.html"], "--out must be a file, folder.html is a folder"),
        (["--robot", "nothing.yaml"], "cannot read nothing.yaml"),
        (["--robot", "flat.yaml"], "footprint_m must enclose at least"),
    ],
)
def test_bad_arguments_are_refused_in_one_line(
    arguments: list[str], message: str, tmp_path: Path, monkeypatch: Any, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.html").mkdir()
    (tmp_path / "flat.yaml").write_text(
        "footprint_m: [[0, 0], [1, 0], [2, 0]]\nmax_speed_mps: 1.0\nmax_acceleration_mps2: 1.0\n"
        "max_deceleration_mps2: 1.0\nreaction_time_s: 0.3\n"
    )
    assert main(["policy", "explore", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("awarenav policy explore: ")
    assert message in error
    assert {path.name for path in tmp_path.iterdir()} == {"folder.html", "flat.yaml"}


def test_a_policy_and_a_robot_of_ones_own_are_shown_first(
    chromium: Chromium, tmp_path: Path
) -> None:
    mine = AwarenessPolicy.model_validate({"margins": {"uncertainty_sigmas": 1.25}})
    mine.to_yaml(tmp_path / "<script><b>.yaml")
    (tmp_path / "robot.yaml").write_text(
        "footprint_m: [[0.5, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.5, -0.3]]\nmax_speed_mps: 2.0\n"
        "max_acceleration_mps2: 0.8\nmax_deceleration_mps2: 1.2\nreaction_time_s: 0.2\n"
        "drive: differential\ncamera: {position_base_m: [0.2, 0.0, 1.0]}\n"
    )
    out = tmp_path / "new" / "mine.html"
    arguments = [str(tmp_path / "<script><b>.yaml"), "--robot", str(tmp_path / "robot.yaml")]
    assert main(["policy", "explore", *arguments, "--out", str(out)]) == 0
    chromium.open(out)
    assert chromium.evaluate("page.policy") == mine.model_dump(mode="json")
    assert chromium.evaluate("page.robot.max_speed_mps") == 2.0
    assert chromium.evaluate("page.robot.drive") == "differential"
    assert chromium.evaluate("byId('preset').selectedOptions[0].text") == "<script><b>.yaml"
    assert chromium.complaints() == []
