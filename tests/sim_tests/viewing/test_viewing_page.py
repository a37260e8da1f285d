"""The page in a real browser: no request, no error, quick, by keyboard, in both schemes."""

from __future__ import annotations

import re
from importlib import resources

import pytest


def player(browser, expression: str):
    return browser.evaluate(f"crossing.player.{expression}")


def still(browser, page_file, **settings) -> None:
    """Open the page and stop it at its first state."""
    browser.open(page_file, **settings)
    browser.evaluate("crossing.play(false), crossing.seek(0), true")
    browser.drawn()


def test_the_page_opens_at_once_without_a_request_or_an_error(chromium, page_file):
    opened_ms = []
    for _ in range(3):  # a busy machine may be slow once
        chromium.open(page_file)
        opened_ms.append(chromium.evaluate("performance.now()"))
    assert min(opened_ms) < 2000
    assert chromium.requests() == [page_file.resolve().as_uri()]
    assert chromium.complaints() == []
    assert player(chromium, "playing") is True


def test_figures_and_drawings_are_those_of_the_state(chromium, page_file, recorder):
    still(chromium, page_file)
    at = len(recorder.states) // 2
    chromium.evaluate(f"crossing.seek({at}), true")
    chromium.drawn()
    state = recorder.states[at]
    text = chromium.evaluate("document.body.innerText")
    assert state["limited_by"] in text
    assert f"{state['t_s']:.2f} of {recorder.states[-1]['t_s']:.2f} s" in text
    for name in ("speed", "limit"):
        shown = chromium.evaluate(f"document.getElementById('{name}').textContent")
        assert float(shown) == pytest.approx(state[f"{name}_mps"], abs=6e-3)
    rows = chromium.evaluate("document.getElementById('tracks').rows.length")
    assert rows == len(state["tracks"]) >= 1
    assert chromium.evaluate("document.getElementById('camera').naturalWidth") == 480
    for name in ("plan", "alpha", "motion"):
        colours = chromium.evaluate(
            f"(() => {{const c = document.getElementById('{name}');"
            "const d = new Uint32Array(c.getContext('2d').getImageData(0, 0, c.width, c.height)"
            ".data.buffer); return new Set(d).size})()"
        )
        assert colours > 20, name
    assert len(chromium.requests()) == 1


def test_every_control_works_by_keyboard(chromium, page_file, recorder):
    browser, last = chromium, len(recorder.states) - 1
    still(browser, page_file)
    browser.press("ArrowRight", 39)
    assert player(browser, "index") == 1
    browser.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowRight", modifiers=8)
    assert player(browser, "index") == 21
    browser.press("End", 35)
    assert player(browser, "index") == last
    browser.press("ArrowLeft", 37)
    assert player(browser, "index") == last - 1
    browser.press("Home", 36)
    browser.press(" ", 32)
    assert player(browser, "playing") is True
    browser.press(" ", 32)
    assert player(browser, "playing") is False
    order = []
    for _ in range(11):
        browser.press("Tab", 9)
        order.append(
            browser.evaluate(
                "document.activeElement.dataset.layer || document.activeElement.id ||"
                "document.activeElement.className"
            )
        )
        outline = browser.evaluate("getComputedStyle(document.activeElement).outlineStyle")
        assert outline != "none", order[-1]
    layers = ["cones", "rings", "tracks", "scan", "paths"]
    assert order == ["skip", "scroll", "who", "at", "play", "rate", *layers]
    names = browser.evaluate(
        "[...document.querySelectorAll('button, input, select, canvas')].filter((each) =>"
        "!each.getAttribute('aria-label') && !each.labels?.length && !each.textContent.trim())"
        ".map((each) => each.outerHTML)"
    )
    assert names == []
    assert "limit" in browser.evaluate("document.getElementById('at').ariaValueText")


def test_reduced_motion_starts_nothing(chromium, page_file):
    chromium.open(page_file)
    calm = [{"name": "prefers-reduced-motion", "value": "reduce"}]
    chromium.call("Emulation.setEmulatedMedia", features=calm)
    chromium.call("Page.reload")
    chromium.events.clear()
    while not any(e.get("method") == "Page.loadEventFired" for e in chromium.events):
        chromium.wait_for_event()
    chromium.drawn()
    assert player(chromium, "playing") is False
    assert player(chromium, "index") == 0


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_nothing_is_wider_than_the_window(chromium, page_file, width, dark):
    still(chromium, page_file, width=width, dark=dark)
    assert chromium.evaluate("document.documentElement.scrollWidth") <= width
    background = chromium.evaluate("getComputedStyle(document.body).backgroundColor")
    level = sum(int(each) for each in re.findall(r"\d+", background)[:3]) / 3
    assert (level < 60) is dark


@pytest.mark.parametrize("height", [720, 800])
def test_people_and_the_time_line_are_seen_above_the_controls(
    chromium, page_file, recorder, height
):
    still(chromium, page_file, height=height)
    at = next(at for at, state in enumerate(recorder.states) if state["tracks"])
    chromium.evaluate(f"crossing.seek({at}), true")
    chromium.drawn()

    def edge(selector: str, side: str) -> float:
        box = f"document.querySelector('{selector}').getBoundingClientRect()"
        return chromium.evaluate(f"{box}.{side}")

    assert edge("#tracks tr", "bottom") <= edge("#side", "bottom")
    assert edge("#motion", "bottom") <= edge("footer", "top")
    assert edge("footer", "bottom") <= height


STYLE = (resources.files("sim_tests.viewing") / "templates" / "watch.css").read_text("utf-8")
LIGHT, DARK = re.findall(r":root\{(.*?)\}", STYLE, re.DOTALL)
#: Colours of text, which need 4.5 : 1, over each colour on which they stand.
TEXTS = {
    "ink": ("paper", "card", "floor"),
    "soft": ("paper", "card"),
    "accent": ("card",),
    "on-accent": ("accent",),
    "unaware": ("card",),
}
#: Colours of shapes that carry a meaning, which need 3 : 1.
SHAPES = ("robot", "rack-edge", "scan", "unaware", "unsure", "aware", "s0", "s1", "s2", "s3")


def luminance(colour: str) -> float:
    """WCAG 2.2, relative luminance."""
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("scheme", [LIGHT, DARK], ids=["light", "dark"])
def test_colours_have_the_contrast_of_wcag_aa(scheme):
    colours = dict(re.findall(r"--([\w-]+):(#[0-9a-f]{6})", scheme))
    for text, grounds in TEXTS.items():
        for ground in grounds:
            assert contrast(colours[text], colours[ground]) >= 4.5, (text, ground)
    for shape in SHAPES:
        for ground in ("card", "floor"):
            assert contrast(colours[shape], colours[ground]) >= 3.0, (shape, ground)
