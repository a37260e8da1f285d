"""Check the prose of Markdown pages: length of sentences, and turns of phrase that readers stumble on.

    python tools/prose.py                    # the project's pages; status 1 if one breaks a rule
    python tools/prose.py --long docs/runs.md        # also list its long sentences

A sentence is one of running text or of a list. Code, tables, headings, quoted code and images are
left out. A piece of inline code or a number counts as one word.
"""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Most words in a sentence: on average over all pages, on one page, and in any one sentence.
MEAN_WORDS, PAGE_MEAN_WORDS, LONGEST_WORDS = 18.0, 20.0, 40
#: Longer sentences are listed.
LONG_WORDS = 35
#: Turns of phrase that a reader has to solve, and what to write instead.
RIDDLES = {
    r"\b(whom|which|what|that) nobody\b": "say what happens instead: 'a person out of view'",
    r"\bnobody('s)? (knows?|sees?|asks?|asked|looks?|is|was|nobody)\b": "name the thing itself",
    r"\bis (then )?nobody\b": "name the thing: 'is not reported as a person'",
    r"\bwhoever\b": "'a person who'",
    r"\bwhomever\b": "'a person whom'",
    r"(^|[.,;:] )who (runs|walks|comes|looks|stands|sets off|obeys) (is|was|has|can|may)\b": (
        "'a person who'"
    ),
    r"\bafter a kill\b": "'a killed run continues with --resume'",
    r"\bsearch(es)? people who\b": "'searches for situations in which'",
    r"\bnot knowing\b": "say what is unknown",
    r"\bis no licen[cs]e\b": "say what the limit is",
    r"\bstood to the robot\b": "'was aware of the robot'",
    r"\bit is none\b": "'it does not replace one'",
    r"\b(is|are) none by itself\b": "'it does not replace one'",
    r"\bunasked\b": "'only if you ask for it'",
    r"\blooks at no\b": "name what is not done",
    r"\b(is|are|was|were) not had\b": "'is not reached'",
    r"\bas it stands\b": "'today'",
    r"\bfor good reason is\b": "turn the sentence round",
    r"\b(is|are) nobody's\b": "name the thing itself",
    r"\bmakes? no secret\b": "say it",
    r"\bis where it is\b": "give the place",
}
_END_OF_SENTENCE = r"(?<=[.!?])\s+(?=[\"'(–—]*[A-Zα-ω\d])|(?<=[.!?][)\"'])\s+"
#: Sentences that begin so: the subject of a sentence comes first, and it is a thing.
RIDDLE_BEGINNINGS = {
    r"Who(se|m|ever)?\b[^?]*$": "begin with the subject: 'A person who …'",
    r"(What|How) [^,?]+ (is|are|was|were|counts?|decides?|makes?|lasts?|gives?)\b[^?]*$": (
        "begin with the subject: 'The …'"
    ),
    r"(Not|Never|Nowhere|No longer|Only then|So little|Nor) (is|are|was|were|does|do|did|has|have|can)"
    r"\b": "subject before verb",
    r"Of (somebody|people|a person|those|two) .*, ": "begin with the subject",
}


@dataclass(frozen=True)
class Sentence:
    """A sentence of a page.

    Attributes:
        line: number of the line on which its paragraph begins, from 1.
        text: the sentence without markup.
    """

    line: int
    text: str

    @property
    def words(self) -> int:
        """Number of words."""
        return len(re.findall(r"[^\s–—=+·→|]*\w[^\s]*", self.text))


@dataclass(frozen=True)
class Finding:
    """A place that breaks a rule.

    Attributes:
        line: number of the line on which the paragraph begins, from 1.
        rule: what is wrong, and what to write instead.
        text: the sentence.
    """

    line: int
    rule: str
    text: str


def paragraphs(markdown: str) -> list[tuple[int, str]]:
    """Return the running text of a page: (first line, text) of each paragraph and list item."""
    found: list[tuple[int, list[str]]] = []
    fence, open_paragraph, skipped_html, indent = "", False, False, 0
    for number, raw in enumerate(_without_front_matter(markdown), start=1):
        line = raw.rstrip()
        if fence:
            fence = "" if line.strip().startswith(fence) else fence
            continue
        if opening := re.match(r"\s*(```+|~~~+)", line):
            fence, open_paragraph = opening[1], False
            continue
        if not line.strip():
            open_paragraph = skipped_html = False
            continue
        if re.match(r"(!!!|\?\?\?\+?|===) ", line.lstrip()):  # an admonition: its text is indented
            open_paragraph, indent = False, len(line) - len(line.lstrip()) + 4
            continue
        depth = len(line) - len(line.lstrip())
        indent = indent if depth >= indent else 0
        text = line[indent:]
        item = re.match(r"\s*(?:[-*+]|\d+\.) +(.*)", text)
        skipped_html = skipped_html or text.startswith("<")
        if skipped_html or re.match(r"\s*(\||#|:::|--8<--|\[\^?[\w-]+\]:)", text):
            open_paragraph = False
        elif item:
            found.append((number, [item[1]]))
            open_paragraph = True
        elif open_paragraph:
            found[-1][1].append(text.strip())
        elif not text.startswith("    "):
            found.append((number, [text.strip()]))
            open_paragraph = True
    return [(line, " ".join(lines)) for line, lines in found]


def sentences(markdown: str) -> list[Sentence]:
    """Return the sentences of the running text of a page, without markup."""
    found = []
    for line, paragraph in paragraphs(markdown):
        text = re.sub(r"!\[[^\]]*\]\([^)]*\)(\{[^}]*\})?", "", paragraph)
        text = re.sub(r"\[([^\]]*)\]\([^)]*\)(\{[^}]*\})?", r"\1", text)
        text = re.sub(r"`[^`]*`", "`x`", text)
        text = re.sub(r"<[^>]*>|\*\*|(?<!\w)[*_]|[*_](?!\w)", "", text)
        text = text.replace("`x`", "CODE")
        for part in re.split(_END_OF_SENTENCE, _protected(text)):
            plain = part.replace("\0", ".").strip()
            if re.search(r"\w", plain):
                found.append(Sentence(line, plain))
    return found


def findings(markdown: str) -> list[Finding]:
    """Return the sentences of a page that are too long, or that are riddles."""
    found = []
    for sentence in sentences(markdown):
        if sentence.words > LONGEST_WORDS:
            rule = f"{sentence.words} words, at most {LONGEST_WORDS}"
            found.append(Finding(sentence.line, rule, sentence.text))
        for pattern, instead in RIDDLES.items():
            if re.search(pattern, sentence.text, re.IGNORECASE):
                found.append(Finding(sentence.line, instead, sentence.text))
        for pattern, instead in RIDDLE_BEGINNINGS.items():
            if re.match(pattern, sentence.text):
                found.append(Finding(sentence.line, instead, sentence.text))
    return found


def newest_section(changelog: str) -> str:
    """Return the newest section of a changelog: from its first ``## [`` to the next."""
    return "## [" + changelog.split("\n## [")[1]


def pages(root: Path = ROOT) -> dict[str, str]:
    """Return the pages that the rules hold for: path from the root → Markdown."""
    patterns = (
        *("README.md", "CONTRIBUTING.md", "docs/**/*.md", "training/*/README.md"),
        *("benchmarks/*/README.md", "perception/models/*.md"),
    )
    paths = sorted(path for pattern in patterns for path in root.glob(pattern))
    found = {path.relative_to(root).as_posix(): path.read_text("utf-8") for path in paths}
    changelog = (root / "CHANGELOG.md").read_text("utf-8")
    return found | {"CHANGELOG.md": newest_section(changelog)}


def mean_words(found: list[Sentence]) -> float:
    """Return the mean number of words of sentences; 0 without any."""
    return sum(sentence.words for sentence in found) / max(len(found), 1)


def main(arguments: list[str] | None = None) -> int:
    """Print the figures of pages and what breaks the rules; return 1 if anything does."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("pages", nargs="*", metavar="FILE.md", help="default: the project's pages")
    parser.add_argument("--long", action="store_true", help="list the ten longest sentences a page")
    given = parser.parse_args(arguments)
    chosen = {name: Path(name).read_text("utf-8") for name in given.pages} or pages()
    everything: list[Sentence] = []
    broken = 0
    for name, markdown in chosen.items():
        found = sentences(markdown)
        everything += found
        mean = mean_words(found)
        words = sum(sentence.words for sentence in found)
        mark = f"  above {PAGE_MEAN_WORDS:g}" if mean > PAGE_MEAN_WORDS else ""
        print(f"{name}: {words} words, {len(found)} sentences, mean {mean:.1f}{mark}")
        broken += bool(mark)
        for finding in findings(markdown):
            print(f"  {name}:{finding.line}: {finding.rule}\n      {finding.text}")
            broken += 1
        if given.long:
            for sentence in sorted(found, key=lambda each: -each.words)[:10]:
                print(f"  {sentence.words} words, line {sentence.line}: {sentence.text}")
    mean = mean_words(everything)
    print(f"all: {sum(each.words for each in everything)} words, mean {mean:.1f} a sentence")
    return int(broken > 0 or mean > MEAN_WORDS)


def _without_front_matter(markdown: str) -> list[str]:
    lines = markdown.splitlines()
    if lines and lines[0] == "---" and "---" in lines[1:]:
        end = lines.index("---", 1)
        return [""] * (end + 1) + lines[end + 1 :]
    return lines




def _protected(text: str) -> str:
    """Hide the full stops that end no sentence."""
    text = re.sub(r"\b(e\.g|i\.e|et al|etc|vs|cf|approx|Eq|Fig|No)\.", r"\1" + "\0", text)
    return re.sub(r"\b([A-Z])\. ([A-Z])\. (?=[A-Z])", "\\1\0 \\2\0 ", text)  # initials


if __name__ == "__main__":
    sys.exit(main())
