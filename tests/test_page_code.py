"""All code on the pages runs as written, page by page, in an empty folder."""

from __future__ import annotations

import doctest
from pathlib import Path

import pytest
from page_code import Block, Reader, blocks_of, compare_output
from paths import ROOT

from nav_adapter import NavAdapter
from perception import AwarenessPipeline
from tracking import PersonTracker

PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in ("README.md", "docs/*.md", "docs/tutorials/*.md")
    for path in ROOT.glob(pattern)
)
BLOCKS = {page: list(blocks_of((ROOT / page).read_text("utf-8"))) for page in PAGES}

# Code that publishes stays on this computer.
LOOPBACK = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/>'
    "</Interfaces><AllowMulticast>false</AllowMulticast></General></Domain></CycloneDDS>"
)


def runs(block: Block, *, full: bool) -> bool:
    """Say whether a test runs a block, rather than to leave it out."""
    return block.kind in ("shell", "python") and not block.skipped and (full or not block.slow)


RUN = [page for page in PAGES if any(runs(block, full=False) for block in BLOCKS[page])]
SLOW = [page for page in PAGES if any(block.slow for block in BLOCKS[page])]


def follow(page: str, folder: Path, monkeypatch: pytest.MonkeyPatch, *, full: bool) -> None:
    empty, tools = folder / "empty", folder / "tools"
    empty.mkdir()
    tools.mkdir()
    monkeypatch.chdir(empty)
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    # A page's own modules are imported from its folder, and by this page alone.
    monkeypatch.syspath_prepend(str(empty))
    assert Reader(page, empty, tools).follow(BLOCKS[page], full=full)


@pytest.mark.parametrize("page", RUN)
def test_a_page_runs_in_an_empty_folder(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    follow(page, tmp_path, monkeypatch, full=False)


def test_the_five_lines_of_the_readme_are_five() -> None:
    (block,) = (each for each in BLOCKS["README.md"] if each.kind == "python")
    lines = block.text[block.text.index("nav = ") :].partition("\n\n")[0].splitlines()
    assert len(lines) == 5


@pytest.mark.parametrize("main_class", [NavAdapter, PersonTracker, AwarenessPipeline])
def test_the_example_of_a_main_class_prints_what_it_shows(main_class: type) -> None:
    (example,) = doctest.DocTestFinder(recurse=False).find(main_class, globs={})
    result = doctest.DocTestRunner().run(example)
    assert result.attempted >= 5
    assert result.failed == 0


@pytest.mark.full
@pytest.mark.parametrize("page", SLOW)
def test_a_page_runs_with_its_slow_blocks(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    follow(page, tmp_path, monkeypatch, full=True)


def test_what_is_not_run_says_why() -> None:
    for page, blocks in BLOCKS.items():
        for block in blocks:
            assert not block.skipped or len(block.skipped.split()) >= 2, f"{page}:{block.line}"


def test_no_python_is_left_out() -> None:
    """A planner, a policy and a robot's loop can be shown with what they need."""
    left_out = [
        f"{page}:{block.line}"
        for page, blocks in BLOCKS.items()
        for block in blocks
        if block.kind in ("python", "file") and block.skipped
    ]
    assert left_out == []


def test_every_tutorial_says_what_it_gives_what_it_needs_and_how_long_it_takes() -> None:
    tutorials = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
    assert len(tutorials) >= 3
    for path in tutorials:
        text = path.read_text("utf-8")
        head = text.partition("\n## ")[0]
        for word in ("**At the end**", "**You need**", "**Time**"):
            assert word in head, f"{path.name}: {word}"
        assert "\n## Where to go next\n" in text, path.name


def test_output_may_leave_out_lines_and_differ_in_the_last_digits() -> None:
    printed = "0%\r50%\nfound  12 people at 3.14 m\nmore\nlimit 0.51 m/s (track 1)\n"
    compare_output("found 12 people at 3.15 m\n…\nlimit 0.51 m/s (…)\n", printed, "page")
    for wrong in ("found 11 people at 3.14 m", "found 12 people at 3.5 m", "limit 0.51 m/s"):
        with pytest.raises(AssertionError, match="not printed"):
            compare_output(wrong, printed, "page")
    with pytest.raises(AssertionError, match="not in this order"):
        compare_output("limit 0.51 m/s (…)\nmore", printed, "page")


def test_a_failing_block_names_its_page_and_line(tmp_path: Path) -> None:
    (tmp_path / "tools").mkdir()
    reader = Reader("page.md", tmp_path, tmp_path / "tools")
    with pytest.raises(AssertionError, match=r"page\.md:7"):
        reader.follow([Block("shell", "python -c 'raise SystemExit(3)'\n", 7)], full=False)
    assert reader.follow([Block("python", "assert 1 + 1 == 2\n", 8)], full=False) == 1
