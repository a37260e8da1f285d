"""Takes the screenshots of a report for docs/bench.md, and checks the page.

    python tools/report_screenshots.py crossings/report.html docs/images

Needs Playwright (``pip install playwright``) and a Chromium; ``--chromium`` names one that is not
on the path. Exit status 1 when the page requests anything from the network, writes to the console,
is wider than its window, or has text of less contrast than WCAG AA requires.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path
from typing import Any, Final

import cv2
from playwright.sync_api import sync_playwright

# Name, width (px), height (px), colour scheme, and the section at the top.
VIEWS: Final = (
    ("report_summary", 1280, 1180, "light", None),
    ("report_episodes", 1280, 860, "light", "#scatter"),
    ("report_scenarios", 1280, 860, "dark", "#scenarios"),
    ("report_worst", 1280, 1040, "light", "#worst"),
    ("report_phone", 390, 1180, "light", None),
    ("report_phone_dark", 390, 1180, "dark", "#scatter"),
)
# Largest size of a screenshot.
_MAX_BYTES: Final = 200_000

# Elements that reach beyond the window, except those that scroll.
_TOO_WIDE: Final = """() => {
  const width = document.documentElement.clientWidth;
  return [...document.querySelectorAll("body *")]
    .filter((e) => !e.closest(".scroll, nav, svg, pre, .unseen, .skip"))
    .filter((e) => e.getBoundingClientRect().right > width + 1)
    .map((e) => e.tagName + "." + e.className);
}"""
# Visible text with too little contrast after WCAG 2.2, 1.4.3.
_TOO_FAINT: Final = """() => {
  const numbers = (text) => (text.match(/[\\d.]+/g) || []).map(Number);
  const light = (colour) => {
    const [r, g, b] = colour.slice(0, 3).map((v) => v / 255)
      .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const behind = (e) => {
    for (let each = e; each; each = each.parentElement) {
      const colour = numbers(getComputedStyle(each).backgroundColor);
      if (colour.length === 3 || colour[3] > 0.99) return colour;
    }
    return [255, 255, 255];
  };
  return [...document.querySelectorAll("body *")]
    .filter((e) => !e.closest(".unseen, .skip, #told, script") && e.getClientRects().length)
    .filter((e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()))
    .filter((e) => {
      const style = getComputedStyle(e);
      const front = light(numbers(e instanceof SVGElement ? style.fill : style.color));
      const back = light(behind(e));
      return (Math.max(front, back) + 0.05) / (Math.min(front, back) + 0.05) < 4.5;
    })
    .map((e) => e.tagName + "." + e.getAttribute("class"));
}"""


def main() -> int:
    """Take all screenshots; return 1 if the page has a fault."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("page", type=Path, metavar="REPORT.html", help="the report")
    parser.add_argument("out", type=Path, metavar="DIR", help="folder of the screenshots")
    parser.add_argument(
        "--chromium",
        default=shutil.which("chromium"),
        metavar="FILE",
        help="the browser (default: chromium on the path)",
    )
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    faults: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=options.chromium, args=["--no-sandbox", "--disable-gpu"]
        )
        for view in VIEWS:
            faults += _take(browser, options.page.resolve().as_uri(), options.out, *view)
        browser.close()
    print("\n".join(faults) if faults else "the page has no faults")
    return 1 if faults else 0


def _take(
    browser: Any,
    page_uri: str,
    out: Path,
    name: str,
    width: int,
    height: int,
    colours: str,
    section: str | None,
) -> list[str]:
    """Take one screenshot and return the faults of the page."""
    context = browser.new_context(
        viewport={"width": width, "height": height}, color_scheme=colours, reduced_motion="reduce"
    )
    context.set_default_timeout(120_000)
    page = context.new_page()
    faults: list[str] = []
    page.on("console", lambda message: faults.append(f"{name}: console: {message.text}"))
    page.on("pageerror", lambda error: faults.append(f"{name}: error: {error}"))
    page.on(
        "request",
        lambda request: (
            None
            if request.url.startswith(("file:", "data:"))
            else faults.append(f"{name}: requests {request.url}")
        ),
    )
    page.goto(page_uri)
    if section and page.locator(section).count():
        page.evaluate(f"document.querySelector('{section}').scrollIntoView()")
        if section == "#scatter":
            page.locator(".marks a").nth(7).focus()
    page.wait_for_timeout(300)
    path = out / f"{name}.png"
    page.screenshot(path=str(path))
    _shrink(path)
    faults += [f"{name}: too wide: {each}" for each in page.evaluate(_TOO_WIDE)]
    faults += [f"{name}: too little contrast: {each}" for each in page.evaluate(_TOO_FAINT)]
    context.close()
    print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")
    return faults


def _shrink(path: Path) -> None:
    """Make a screenshot smaller until it has at most ``_MAX_BYTES``."""
    whole = cv2.imread(str(path))
    share = 1.0
    while path.stat().st_size > _MAX_BYTES and share > 0.3:
        share -= 0.1
        small = cv2.resize(whole, None, fx=share, fy=share, interpolation=cv2.INTER_AREA)
        cv2.imwrite(str(path), small, [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    sys.exit(main())
