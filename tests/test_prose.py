"""Pages are written in short sentences without riddles, and the checker finds all others."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from paths import ROOT

sys.path.insert(0, str(ROOT))
try:
    from tools import prose
finally:
    sys.path.remove(str(ROOT))

PAGES = prose.pages()
PACKAGES = ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests")
PAGE = """---
title: front matter
---
# A heading of no sentence

**A title.** One sentence has five words. `awarenav crossings --out x` is one
word, see [the page](other.md#part).

- An item without a stop
- An item, as E. T. Hall and others (e.g. Smith et al. 2018) say. It has two sentences.

| a table | is no prose |
| --- | --- |

    indented code is none

```python
fenced = "code. Is none."
```

!!! note

    An admonition is prose.

<p>HTML is none.
Neither is its second line.</p>

![An image is none.](image.png)
"""


def texts(markdown: str) -> list[str]:
    return [sentence.text for sentence in prose.sentences(markdown)]


def test_only_running_text_and_lists_are_sentences() -> None:
    assert texts(PAGE) == [
        "One sentence has five words.",
        "CODE is one word, see the page.",
        "An item without a stop",
        "An item, as E. T. Hall and others (e.g. Smith et al. 2018) say.",
        "It has two sentences.",
        "An admonition is prose.",
    ]
    assert [sentence.words for sentence in prose.sentences(PAGE)][:3] == [5, 7, 5]
    assert prose.sentences(PAGE)[1].line == 6
    assert prose.mean_words(prose.sentences("Two words. And four more words.")) == 3.0
    assert prose.mean_words([]) == 0.0


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("It stops at 0.5 m. Then it goes on.", 2),
        ("It stops (at C + Z.) Then it goes on.", 2),
        ("It ends at C + Z. Set it.", 2),
        ("It drops to 0. α stays.", 2),
        ("It stops at 0.5 m. then goes on", 1),
        ("Does it stop? It does!", 2),
    ],
)
def test_sentences_end_where_a_reader_would_end_them(text: str, count: int) -> None:
    assert len(texts(text)) == count


@pytest.mark.parametrize(
    "riddle",
    [
        "A person whom nobody sees is not aware.",
        "The map holds nobody's legs.",
        "A shadow is nobody.",
        "A ghost appears where nobody is.",
        "It sends topics that nobody reads.",
        "Whoever comes first is served.",
        "The robot stops, and whoever waits is let pass.",
        "On a bend, who runs is assumed to fall.",
        "The search goes on after a kill.",
        "The tool searches people who fall.",
        "Not knowing the range stops the robot.",
        "A short delay is not had.",
        "The report could be a proof, but it is none.",
        "What nobody expects is the rule.",
        "What slows it down is the reserve.",
        "Who stands beside it is passed.",
        "Never is a radius below the floor.",
        "Of somebody behind a rack, the legs are seen.",
    ],
)
def test_riddles_are_found(riddle: str) -> None:
    assert [finding.sentence.text for finding in prose.findings(riddle)][:1] == [riddle]


@pytest.mark.parametrize(
    "plain",
    [
        "A person outside the camera's view counts as unaware.",
        "A person who runs is assumed to run straight at the robot.",
        "No contact occurred, and nobody waited.",
        "The check is that nobody starts inside a rack.",
        "**What it is not.** It is a demonstration.",
        "[How the limit is made](policies.md) is a page.",
        "What does it cost?",
        "Where no ankle is seen, the lowest joint counts.",
        "`whoever` is a name in code.",
        "Of 40 runs, one failed.",
    ],
)
def test_plain_sentences_are_left_alone(plain: str) -> None:
    assert prose.findings(plain) == []


def test_a_long_sentence_is_found_and_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"{'Word ' * 37}ends.\n\n{'Word ' * 41}ends.\n\nShort.\n", encoding="utf-8")
    assert prose.main([str(page), "--long"]) == 1
    printed = capsys.readouterr().out
    assert ":3: 42 words, at most 40" in printed
    assert ":1: 38 words\n" in printed
    page.write_text("Short.\n", encoding="utf-8")
    assert prose.main([str(page)]) == 0
    page.write_text(f"{'Word ' * 30}ends.\n", encoding="utf-8")
    assert prose.main([str(page)]) == 1
    assert "31.0 words each, above 20" in capsys.readouterr().out


def test_a_changelog_counts_with_its_newest_section() -> None:
    changelog = "# Changelog\n\n## [2]\n\n- New.\n\n## [1]\n\n- Old.\n"
    assert texts(prose.newest_section(changelog)) == ["New."]


@pytest.mark.parametrize("page", PAGES)
def test_a_page_has_short_sentences_and_no_riddles(page: str) -> None:
    found = [
        f"{page}:{each.sentence.line}: {each.rule}: {each.sentence.text}"
        for each in prose.findings(PAGES[page])
    ]
    assert found == []
    assert prose.mean_words(prose.sentences(PAGES[page])) <= prose.PAGE_MEAN_WORDS


def test_sentences_are_short_over_all_pages() -> None:
    assert {"README.md", "CHANGELOG.md", "docs/safety.md"} <= set(PAGES)
    found = [sentence for markdown in PAGES.values() for sentence in prose.sentences(markdown)]
    assert prose.mean_words(found) <= prose.MEAN_WORDS


def docstrings(package: str) -> Iterator[tuple[str, str]]:
    """The docstrings of a package with their places, help texts of commands included."""
    for path in sorted((ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                continue
            if text := ast.get_docstring(node):
                yield f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 1)}", text


@pytest.mark.parametrize("package", PACKAGES)
def test_docstrings_say_what_a_thing_is_or_does(package: str) -> None:
    found = dict(docstrings(package))
    assert len(found) > 50
    riddles = "|".join(prose.RIDDLES)
    begins = re.compile("(What|Who|Whom|Whose|Where|Which|Whether|When|Why|How|Whoever|Nobody)\\b")
    assert [place for place, text in found.items() if begins.match(text)] == []
    flat = {place: " ".join(text.split()) for place, text in found.items()}
    assert [place for place, text in flat.items() if re.search(riddles, text, re.I)] == []
