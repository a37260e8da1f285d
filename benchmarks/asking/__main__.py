"""Entry point of ``python -m benchmarks.asking``."""

from __future__ import annotations

from ._cli import main

if __name__ == "__main__":
    main()
