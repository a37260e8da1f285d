"""Command ``python -m benchmarks.perception``: judge networks on renders or on photographs.

``--networks`` judges other files than the shipped ones, so before and after are one command each.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from . import _degradations, _photographs, _sureness
from ._pictures import add_pictures


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the measurement asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.perception", description=__doc__)
    parts = parser.add_subparsers(dest="part", required=True)
    degradations = parts.add_parser(
        "degradations", help="recall, head direction and α under one effect of cameras at a time"
    )
    add_pictures(degradations)
    sureness = parts.add_parser("sureness", help="errors of head poses and α in units of their σ")
    add_pictures(sureness)
    sureness.add_argument(
        "--head",
        choices=("network", "pnp"),
        default="network",
        help="pnp judges PnP on the keypoints of the same pose network (default: %(default)s)",
    )
    photographs = parts.add_parser("photographs", help="recall and α on labelled photographs")
    _photographs.add_options(photographs)
    chosen = parser.parse_args(arguments)
    measurement = {
        "degradations": _degradations.run,
        "sureness": _sureness.run,
        "photographs": _photographs.run,
    }
    measurement[chosen.part](parts.choices[chosen.part], chosen)


if __name__ == "__main__":
    main()
