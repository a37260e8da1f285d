"""The command ``python -m benchmarks.leaderboard``: measure what is missing, write the page."""

from __future__ import annotations

import sys

from awarenav.errors import AwarenavError
from benchmarks._harness import count, make_parser

from ._measure import measure
from ._page import leaderboard_page
from ._results import PAGES, write_figures
from ._rows import PAGE, RESULTS, STEP_OUT, WORK, Board


def main() -> int:
    """Run the command; return 2 for bad input."""
    parser = make_parser(
        "benchmarks.leaderboard",
        "Measure the rows that docs/leaderboard lacks, and write docs/what_it_wins.md and the "
        "figures of other pages. An interrupted run continues with the same command.",
    )
    parser.add_argument(
        "--row", nargs="+", metavar="NAME", help="rows to measure (default: all of rows.yaml)"
    )
    parser.add_argument(
        "--workers", type=count, default=1, metavar="N", help="worker processes (default: 1)"
    )
    parser.add_argument("--again", action="store_true", help="measure the rows from the beginning")
    parser.add_argument("--page", action="store_true", help="measure nothing, write the pages")
    options = parser.parse_args()
    try:
        board = Board.read()
        wanted = {board.named(name).name for name in options.row or ()}
        for folder in () if options.page else (RESULTS, STEP_OUT):
            each = Board.read(folder)
            rows = [row for row in each.rows if not wanted or row.name in wanted]
            work = WORK / folder.name
            measure(each, rows, folder, work=work, workers=options.workers, again=options.again)
        PAGE.write_text(leaderboard_page(board, RESULTS), encoding="utf-8")
        write_figures(board)
    except AwarenavError as error:
        print(f"leaderboard: {error}", file=sys.stderr)
        return 2
    print(f"written: docs/{PAGE.name}, and the figures of {' and '.join(p.name for p in PAGES)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
