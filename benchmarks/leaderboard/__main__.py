"""The command ``python -m benchmarks.leaderboard``: measure what is missing, write the page."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from awarenav.errors import AwarenavError
from benchmarks._harness import count, make_parser

from ._measure import differences, measure, read_results, remeasured
from ._page import leaderboard_page
from ._rows import PAGE, RESULTS, Board, Row


def main() -> int:
    """Run the command; return 1 if an episode is another one now, 2 for bad input."""
    parser = make_parser(
        "benchmarks.leaderboard",
        "Measure the episodes that docs/leaderboard lacks, and write docs/leaderboard.md. An "
        "interrupted run continues with the same command.",
    )
    parser.add_argument(
        "--row", nargs="+", metavar="NAME", help="rows to measure (default: all of rows.yaml)"
    )
    parser.add_argument(
        "--workers", type=count, default=1, metavar="N", help="worker processes (default: 1)"
    )
    parser.add_argument("--again", action="store_true", help="measure the rows from the beginning")
    parser.add_argument("--page", action="store_true", help="measure nothing, write the page")
    parser.add_argument(
        "--check",
        metavar="SCENARIO",
        help="measure nothing new: run the first seed of this scenario again and compare it",
    )
    options = parser.parse_args()
    try:
        board = Board.read()
        rows = [board.named(name) for name in options.row] if options.row else list(board.rows)
        if options.check:
            return _check(board, rows, options.check)
        if not options.page:
            measure(board, rows, workers=options.workers, again=options.again)
        PAGE.write_text(leaderboard_page(board, RESULTS), encoding="utf-8")
    except AwarenavError as error:
        print(f"leaderboard: {error}", file=sys.stderr)
        return 2
    print(f"written: docs/{PAGE.name}")
    return 0


def _check(board: Board, rows: Sequence[Row], scenario: str) -> int:
    """Compare one episode of each row with the committed one; return 1 for a difference."""
    status = 0
    for row in rows:
        for record in read_results(board, row):
            if (record.scenario, record.seed) == (scenario, 0):
                found = differences(record, remeasured(row, scenario, 0))
                print(f"{row.name}: {'; '.join(found) or 'the same'}")
                status |= bool(found)
    return int(status)


if __name__ == "__main__":
    sys.exit(main())
