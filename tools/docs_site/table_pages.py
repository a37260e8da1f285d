"""Reference tables of metrics, of the columns of ``episodes.csv``, and of ROS 2 topics."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from nav_adapter.ros2 import MASK_TOPICS, PUBLISHED, READ, Topic
from nav_adapter.ros2.messages import ros_type
from sim_tests.study.measures import COLUMNS, METRICS, RATIOS, SHARES, Metric

from .config_pages import unit_of
from .roles import plain

_METRICS: Final = """# Metrics

The columns that `awarenav crossings` writes and `awarenav compare` prints, from the code that
defines them. [What is measured, and what it does not say](../metrics.md) has the full definitions.
An empty cell means that a figure does not apply, which is never the same as 0."""
_TOPICS: Final = """# ROS 2 topics

The topics of `awarenav bridge` with their types and quality of service, from the code that opens
them. [Nav2, its collision monitor, TEB and RViz](../nav2.md) says who reads which, and how to set
up each reader. `--rename` and the other options of
[`awarenav bridge`](commands.md#awarenav-bridge) change names."""
_BETTER: Final = {"lower": "lower", "higher": "higher", "neither": "–"}


def metrics_page() -> str:
    """Return the page of metrics and columns."""
    columns = ["| column | unit | meaning |", "| --- | --- | --- |"]
    columns += [
        f"| `{name}` | {unit_of(name)} | {_cell(plain(meaning))} |"
        for name, meaning in COLUMNS.items()
    ]
    return "\n\n".join(
        [
            _METRICS,
            "## Shares of episodes",
            _metric_table(SHARES),
            "## Means over episodes",
            _metric_table(METRICS),
            "## Ratios of sums over episodes",
            _metric_table({name: ratio.metric for name, ratio in RATIOS.items()}),
            "## Columns of episodes.csv",
            "\n".join(columns) + "\n",
        ]
    )


def topics_page() -> str:
    """Return the page of topics."""
    return "\n\n".join(
        [
            _TOPICS,
            "## Published",
            _topic_table(PUBLISHED.values()),
            "## Published with `--speed-mask`",
            _topic_table(MASK_TOPICS.values()),
            "## Read",
            _topic_table(READ.values()) + "\n",
        ]
    )


def _metric_table(metrics: Mapping[str, Metric]) -> str:
    rows = ["| metric | title | unit | better | meaning |", "| --- | --- | --- | --- | --- |"]
    rows += [
        f"| `{name}` | {each.title} | {each.unit} | {_BETTER[each.better]} | "
        f"{_cell(each.meaning)} |"
        for name, each in metrics.items()
    ]
    return "\n".join(rows).replace(
        "Mean |α of the track − true α|", "Mean difference of α and truth"
    )


def _topic_table(topics: Iterable[Topic]) -> str:
    rows = [
        "| topic | type | reliability | durability | depth |",
        "| --- | --- | --- | --- | --- |",
    ]
    rows += [
        f"| `/{each.name}` | `{ros_type(each.message).replace('/msg/', '/')}` | "
        f"{'reliable' if each.reliable else 'best effort'} | "
        f"{'transient local' if each.transient_local else 'volatile'} | {each.depth} |"
        for each in topics
    ]
    return "\n".join(rows)


def _cell(text: str) -> str:
    """Return text for one cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")
