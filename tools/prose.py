"""Check the prose of Markdown pages: the length of sentences, and sentences that are riddles.

    python tools/prose.py                        # the project's pages
    python tools/prose.py --long docs/runs.md    # also list the long sentences of a page

A sentence is one of running text or of a list. Code, tables, headings and images are left out. A
piece of inline code counts as one word. The exit status is 1 if a page breaks a rule.
"""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Most words in a sentence: on average over all pages, on average on one page, and at all.
MEAN_WORDS, PAGE_MEAN_WORDS, LONGEST_WORDS = 18.0, 20.0, 40
#: ``--long`` lists sentences with more words than this.
LONG_WORDS = 35

#: Turns of phrase that a reader has to solve, and what to write instead.
RIDDLES = {
    r"\b(whom|what) nobody\b": "say what happens instead, as 'a person out of view'",
    r"\bnobody (knows?|sees?|asks?|asked|reads?|heeds?|looks?|nobody)\b": "name the thing itself",
    r"\bwhere nobody is\b": "name the place",
    r"\b(is|are) (then )?nobody\b": "name the thing itself",
    r"\bnobody's\b": "name the thing itself",
    r"\bwho(m)?ever\b": "'a person who'",
    r"(^|[.,;:] )who (runs|walks|comes|looks|stands|sets off|obeys) (is|was|has|can|may)\b": (
        "'a person who'"
    ),
    r"\bafter a kill\b": "'a killed run continues with --resume'",
    r"\bsearch(es)? people who\b": "'searches for situations in which'",
    r"\bnot knowing\b": "say what is unknown",
    r"\bis no licen[cs]e\b": "say what the limit is",
    r"\bstood to the robot\b": "'was aware of the robot'",
    r"\b(?-i:it is none)\b": "'it does not replace one'",
    r"\bnone by itself\b": "'it does not replace one'",
    r"\bunasked\b": "'only if you ask for it'",
    r"\blooks? at no\b": "say what is not done",
    r"\b(is|are|was|were) not had\b": "'is not reached'",
    r"\bas it stands\b": "'today'",
}
#: Beginnings of sentences that put the subject last, and what to write instead.
RIDDLE_BEGINNINGS = {
    r"Who(se|m|ever)?\b[^?]*$": "begin with the subject, as 'A person who …'",
    r"(What|How) [^,:?]+ (is|are|was|were|counts?|decides?|makes?|lasts?|gives?)\b[^?]*$": (
        "begin with the subject, as 'The …'"
    ),
    r"(Not|Never|Nowhere|Nor|Only then|Only so) "
    r"(is|are|was|were|does|do|did|has|have|can|may|will)\b": "subject before verb",
    r"Of (somebody|people|a person|those|two) .*, ": "begin with the subject",
}
_END_OF_SENTENCE = r"(?<=[.!?])\s+(?=[\"'(–—]*[A-Zα-ω\d])|(?<=[.!?][)\"'])\s+"


@dataclass(frozen=True)
class Sentence:
    """A sentence of a page.

    Attributes:
        line: number of the line on which its paragraph begins, from 1.
        text: the sentence without markup; CODE stands for inline code.
    """

    line: int
    text: str

    @property
    def words(self) -> int:
        """Number of words. A number is a word, a sign is none."""
        return len(re.findall(r"\S*\w\S*", self.text))


@dataclass(frozen=True)
class Finding:
    """A sentence that breaks a rule.

    Attributes:
        sentence: the sentence.
        rule: what is wrong, or what to write instead.
    """

    sentence: Sentence
    rule: str


def paragraphs(markdown: str) -> list[tuple[int, str]]:
    """Return the running text of a page: (first line, text) of each paragraph and list item."""
    found: list[tuple[int, list[str]]] = []
    fence, is_open, is_html, indent = "", False, False, 0
    for number, line in enumerate(_without_front_matter(markdown), start=1):
        if fence:
            fence = "" if line.strip().startswith(fence) else fence
            continue
        if opening := re.match(r"\s*(```+|~~~+)", line):
            fence, is_open = opening[1], False
            continue
        if not line.strip():
            is_open = is_html = False
            continue
        depth = len(line) - len(line.lstrip())
        if re.match(r"(!!!|\?\?\?\+?|===) ", line.lstrip()):  # its text is indented, and no code
            is_open, indent = False, depth + 4
            continue
        indent = indent if depth >= indent else 0
        text = line[indent:]
        item = re.match(r"\s*(?:[-*+]|\d+\.) +(.*)", text)
        is_html = is_html or text.startswith("<")
        if is_html or re.match(r"\s*(\||#|:::|--8<--|\[\^?[\w-]+\]:)", text):
            is_open = False
        elif item or is_open or not text.startswith("    "):
            if item or not is_open:
                found.append((number, []))
            found[-1][1].append(item[1] if item else text.strip())
            is_open = True
    return [(line, " ".join(lines)) for line, lines in found]


def sentences(markdown: str) -> list[Sentence]:
    """Return the sentences of the running text of a page, without markup."""
    found = []
    for line, paragraph in paragraphs(markdown):
        text = re.sub(r"^\*\*(?:[^*\s]+\s?){1,5}[.:]\*\*\s*", "", paragraph)  # a title
        text = re.sub(r"`[^`]*`", "CODE", text)
        text = re.sub(r"!\[[^\]]*\]\([^)]*\)(\{[^}]*\})?", "", text)
        text = re.sub(r"\[(What|How|Who)\b[^\]]*\]\([^)]*\)", "PAGE", text)  # a title as a name
        text = re.sub(r"\[([^\]]*)\]\([^)]*\)(\{[^}]*\})?", r"\1", text)
        text = re.sub(r"<[^>]*>|\*\*|(?<!\w)[*_]|[*_](?!\w)", "", text)
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
            found.append(Finding(sentence, rule))
        for pattern, instead in RIDDLES.items():
            if re.search(pattern, sentence.text, re.IGNORECASE):
                found.append(Finding(sentence, instead))
        for pattern, instead in RIDDLE_BEGINNINGS.items():
            if re.match(pattern, sentence.text):
                found.append(Finding(sentence, instead))
    return found


def mean_words(found: list[Sentence]) -> float:
    """Return the mean number of words of sentences; 0 without any."""
    return sum(sentence.words for sentence in found) / max(len(found), 1)


def newest_section(changelog: str) -> str:
    """Return the newest section of a changelog: from its first ``## [`` to the next."""
    return "## [" + changelog.split("\n## [")[1]


def pages(root: Path = ROOT) -> dict[str, str]:
    """Return the pages that the rules hold for: path from the root → Markdown."""
    patterns = (
        *("README.md", "CONTRIBUTING.md", "docs/**/*.md", "perception/models/*.md"),
        *("benchmarks/*/README.md", "training/*/README.md"),
    )
    paths = sorted(path for pattern in patterns for path in root.glob(pattern))
    found = {path.relative_to(root).as_posix(): path.read_text("utf-8") for path in paths}
    changelog = (root / "CHANGELOG.md").read_text("utf-8")
    return found | {"CHANGELOG.md": newest_section(changelog)}


def main(arguments: list[str] | None = None) -> int:
    """Print the figures of pages and what breaks the rules; return 1 if anything does."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("pages", nargs="*", metavar="FILE.md", help="default: the project's pages")
    parser.add_argument(
        "--long", action="store_true", help=f"list the sentences of more than {LONG_WORDS} words"
    )
    given = parser.parse_args(arguments)
    everything: list[Sentence] = []
    broken = 0
    chosen = {name: Path(name).read_text("utf-8") for name in given.pages} or pages()
    for name, markdown in chosen.items():
        found = sentences(markdown)
        everything += found
        mean = mean_words(found)
        words = sum(sentence.words for sentence in found)
        above = f", above {PAGE_MEAN_WORDS:g}" if mean > PAGE_MEAN_WORDS else ""
        print(f"{name}: {words} words, {len(found)} sentences, {mean:.1f} words each{above}")
        wrong = findings(markdown)
        broken += len(wrong) + bool(above)
        if given.long:
            long = [each for each in found if LONG_WORDS < each.words <= LONGEST_WORDS]
            wrong += [Finding(each, f"{each.words} words") for each in long]
        for finding in wrong:
            print(f"  {name}:{finding.sentence.line}: {finding.rule}\n    {finding.sentence.text}")
    mean = mean_words(everything)
    print(f"all: {sum(each.words for each in everything)} words, {mean:.1f} words a sentence")
    return int(broken > 0 or mean > MEAN_WORDS)


def _without_front_matter(markdown: str) -> list[str]:
    lines = markdown.splitlines()
    if lines and lines[0] == "---" and "---" in lines[1:]:
        end = lines.index("---", 1)
        return [""] * (end + 1) + lines[end + 1 :]
    return lines


def _protected(text: str) -> str:
    """Hide the full stops that end no sentence."""
    text = re.sub(r"\b(e\.g|i\.e|et al|etc|vs|cf|Eq|Fig|No)\.", r"\1" + "\0", text)
    return re.sub(r"\b([A-Z])\. ([A-Z])\. (?=[A-Z])", "\\1\0 \\2\0 ", text)  # initials


if __name__ == "__main__":
    sys.exit(main())
