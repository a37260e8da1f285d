"""The live page's server: its stream, late readers, and refusals."""

from __future__ import annotations

import json
import threading
import urllib.error
import urllib.request

import pytest

from sim_tests.viewing import LivePage, page_text
from sim_tests.world.errors import SimError


def events(text: str) -> list[tuple[str, object]]:
    """Return the kind and value of the events of a stream."""
    found = []
    for block in text.strip().split("\n\n"):
        fields = dict(line.split(": ", 1) for line in block.splitlines() if line.strip(": "))
        if "data" in fields:
            found.append((fields.get("event", "message"), json.loads(fields["data"])))
    return found


def read(url: str, **headers: str) -> str:
    request = urllib.request.Request(url, headers=headers)
    with urllib.request.urlopen(request, timeout=10) as answer:
        return answer.read().decode()


@pytest.fixture
def page():
    with LivePage("<html>page</html>") as live:
        yield live


def test_readers_get_all_events_early_or_late(page):
    early: list[str] = []
    reader = threading.Thread(target=lambda: early.append(read(page.url + "states")))
    reader.start()
    assert page.wait_for_reader(5.0)
    page.begin({"scenario": "short"})
    page.state({"t_s": 0.0})
    page.state({"t_s": 0.05})
    page.end("Goal reached")
    reader.join(5.0)
    assert events(early[0]) == [
        ("begin", {"scenario": "short"}),
        ("message", {"t_s": 0.0}),
        ("message", {"t_s": 0.05}),
        ("end", {"outcome": "Goal reached", "note": ""}),
    ]
    assert page.wait_for_delivery(5.0)
    assert events(read(page.url + "states")) == events(early[0])
    assert page.opened == 2


def test_the_page_is_served_on_loopback_alone_under_its_own_names(page):
    assert page.url.startswith("http://127.0.0.1:")
    assert read(page.url) == "<html>page</html>"
    for path, host, status in (("", "evil.example", 403), ("", "", 403), ("other", None, 404)):
        headers = {} if host is None else {"Host": host}
        with pytest.raises(urllib.error.HTTPError) as refused:
            read(page.url + path, **headers)
        assert refused.value.code == status
        refused.value.close()
    assert read(page.url, Host="localhost:9") == "<html>page</html>"


def test_an_interrupted_crossing_tells_its_readers():
    got: list[str] = []
    with LivePage("page") as page:
        reader = threading.Thread(target=lambda: got.append(read(page.url + "states")))
        reader.start()
        assert page.wait_for_reader(5.0)
    reader.join(5.0)
    assert events(got[0])[-1][1]["outcome"] == "The crossing was stopped."


def test_a_port_in_use_is_named(page):
    port = int(page.url.rstrip("/").rpartition(":")[2])
    with pytest.raises(SimError, match=f"cannot listen on port {port} of 127.0.0.1"):
        LivePage("page", port)


def test_nobody_reads(page):
    assert not page.wait_for_reader(0.01)
    assert page.wait_for_delivery(0.01)


def test_the_browser_follows_scrubs_and_keeps_a_live_crossing(chromium, recorder):
    with LivePage(page_text("live")) as page:
        chromium.events.clear()
        chromium.call("Page.navigate", url=page.url)
        assert page.wait_for_reader(10.0)
        page.begin(recorder.begin)
        for state in recorder.states[:-1]:
            page.state(state)
        count = len(recorder.states)
        chromium.evaluate(waiting(count - 1))
        assert chromium.evaluate("[crossing.player.index, crossing.player.following]") == [
            count - 2,
            True,
        ]
        assert chromium.evaluate("document.getElementById('status').textContent") == "Live"
        chromium.press("Home", 36)
        page.state(recorder.states[-1])
        chromium.evaluate(waiting(count))
        assert chromium.evaluate("[crossing.player.index, crossing.player.following]") == [0, False]
        chromium.press("End", 35)
        assert chromium.evaluate("crossing.player.index") == count - 1
        page.end("Goal reached after 1.40 s")
        assert page.wait_for_delivery(10.0)
    chromium.drawn()
    assert chromium.evaluate("document.getElementById('status').textContent") == (
        "Goal reached after 1.40 s"
    )
    chromium.press("Home", 36)
    assert chromium.evaluate("crossing.player.index") == 0
    assert chromium.requests() == [page.url, page.url + "states"]
    assert chromium.complaints() == []


def waiting(count: int) -> str:
    """JavaScript that waits until the page has so many states."""
    return (
        "new Promise((done) => { const look = () => crossing.player.states.length >= "
        f"{count} ? done(true) : setTimeout(look, 20); look(); }})"
    )
