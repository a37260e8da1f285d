"""The page about learning is made from the committed episodes, and says what they say."""

from __future__ import annotations

from benchmarks.learning import PAGE, page, read, smooth, table


def test_the_page_has_the_table_of_the_committed_drives() -> None:
    """After other drives: python -m benchmarks.learning."""
    text = PAGE.read_text(encoding="utf-8")
    assert table() in text
    assert page(text) == text


def test_ppo_beats_random_search_that_has_more_steps() -> None:
    (*_, (steps, ppo)), (*_, (searched_steps, searched)) = map(smooth, ("ppo", "random_search"))
    assert steps < searched_steps
    assert ppo > searched + 5.0


def test_every_planner_drives_the_same_crossings() -> None:
    drives: dict[str, list[str]] = {}
    for row in read("drives"):
        drives.setdefault(row["planner"], []).append(row["scenario"])
    first, *others = drives.values()
    assert len(others) == 3
    assert all(each == first for each in others)
