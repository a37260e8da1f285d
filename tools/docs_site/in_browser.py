"""The built site in Chromium: screenshots, requests, console, widths and the search.

    python -m tools.docs_site.in_browser site screenshots

Needs Playwright (``pip install playwright``) and a Chromium on the path. Exit status 1 when a page
requests anything from another host, writes an error to the console, or is wider than its window,
or when the search does not find what it must.
"""

from __future__ import annotations

import argparse
import functools
import http.server
import shutil
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from playwright.sync_api import sync_playwright

PAGES: Final = {
    "home": "index.html",
    "tutorial": "first_ten_minutes.html",
    "api": "reference/nav_adapter.html",
    "keys": "reference/policy-keys.html",
    "commands": "reference/commands.html",
    "gallery": "gallery.html",
}
SIZES: Final = ((1280, 900), (390, 844))
SCHEMES: Final = ("light", "dark")
#: What a reader looks for, and a part of the title or address of a page that must be found.
SEARCHES: Final = {
    "awareness_lower": "reference/nav_adapter",
    "stop": "nav2",
    "LaserScan": "laser",
}
_FLAGS: Final = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
_TOO_WIDE: Final = """() => {
  const width = document.documentElement.clientWidth;
  if (document.scrollingElement.scrollWidth <= width) return [];
  return [...document.querySelectorAll("main *")]
    .filter((e) => !e.closest(".md-typeset__scrollwrap, pre, .highlight"))
    .filter((e) => e.getBoundingClientRect().right > width + 1)
    .map((e) => e.tagName + "." + e.className).slice(0, 5);
}"""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """Serve a folder on the loopback interface; give its address."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_: Any) -> None:
            pass

    handler = functools.partial(Quiet, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/"
        finally:
            server.shutdown()


def main() -> int:
    """Take the screenshots and try the search; return 1 for a fault."""
    parser = argparse.ArgumentParser(description="Look at the built site in Chromium.")
    parser.add_argument("site", type=Path, help="folder of the built site")
    parser.add_argument("out", type=Path, help="folder of the screenshots")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    faults: list[str] = []
    with served(options.site) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=list(_FLAGS)
        )
        for width, height in SIZES:
            for scheme in SCHEMES:
                context = browser.new_context(
                    viewport={"width": width, "height": height},
                    color_scheme=scheme,
                )
                context.set_default_timeout(120_000)
                page = context.new_page()
                _listen(page, address, faults)
                for name, path in PAGES.items():
                    page.goto(address + path)
                    page.wait_for_timeout(400)
                    page.screenshot(path=str(options.out / f"{name}_{width}_{scheme}.png"))
                    wide = page.evaluate(_TOO_WIDE)
                    faults += [f"{name} at {width} px is too wide: {each}" for each in wide]
                if scheme == "light":
                    faults += _searched(page, address, options.out, width)
                context.close()
        browser.close()
    print("\n".join(dict.fromkeys(faults)) or "no faults")
    return int(bool(faults))


def _listen(page: Any, address: str, faults: list[str]) -> None:
    """Collect requests to other hosts, answers of failure and errors on the console."""

    def requested(request: Any) -> None:
        if not request.url.startswith((address, "data:", "blob:")):
            faults.append(f"requests {request.url}")

    def answered(response: Any) -> None:
        if response.status >= 400:
            faults.append(f"{response.status} for {response.url}")

    def logged(message: Any) -> None:
        if message.type == "error":
            faults.append(f"console: {message.text}")

    page.on("request", requested)
    page.on("response", answered)
    page.on("console", logged)
    page.on("pageerror", lambda error: faults.append(f"error: {error}"))


def _searched(page: Any, address: str, out: Path, width: int) -> Iterator[str]:
    """Type each search; yield those that do not find their page, and print what was found."""
    for words, wanted in SEARCHES.items():
        page.goto(address)
        page.keyboard.press("/")
        page.locator(".md-search__input").type(words, delay=20)
        page.locator(".md-search-result__link").first.wait_for()
        page.wait_for_timeout(500)
        links = page.locator(".md-search-result__link")
        found = [links.nth(number).get_attribute("href") for number in range(links.count())]
        places = [each.removeprefix(address).partition("?")[0] for each in found]
        print(f"search {words!r} at {width} px: {', '.join(places[:4])}")
        page.screenshot(path=str(out / f"search_{words}_{width}.png"))
        if not any(wanted in place for place in places):
            yield f"search {words!r} does not find {wanted}"


if __name__ == "__main__":
    sys.exit(main())
