"""Entry point of ``python -m benchmarks.people``."""

from __future__ import annotations

from ._cli import main

if __name__ == "__main__":
    raise SystemExit(main())
