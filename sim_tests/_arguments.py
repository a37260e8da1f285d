"""Values of command lines that several commands take."""

from __future__ import annotations

import argparse


def add_camera(parser: argparse.ArgumentParser) -> None:
    """Add ``--camera``."""
    parser.add_argument(
        "--camera",
        default="",
        metavar="NAME|FILE",
        help="another camera on the robot: 'forward' (120 degrees, that of the shipped scenarios), "
        "'surround' (360 degrees), or a YAML file (default: that of each scenario)",
    )


def count(text: str) -> int:
    """A whole number of at least 1, as the ``type`` of an argument."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number of at least 1, got {text!r}")
    return value
