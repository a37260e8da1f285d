"""Simulated people beside recorded ones: ``python -m benchmarks.people``.

Both are sampled at the same rate and smoothed by the same filter. Crowds of simulated people walk
in the layout of the recordings. Others stand beside a robot and start, or look at it before they
cross. The recorded distributions come with the benchmark as quantiles; the recordings do not.
"""

from ._standing import DISPLACEMENTS

__all__ = ["DISPLACEMENTS"]
