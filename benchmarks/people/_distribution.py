"""Quantile functions of recorded quantities, in a file, and their distance to simulated ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.stats import kstest

from awarenav.errors import AwarenavError
from awarenav.files import json_text, write_text
from perception.arrays import FloatArray
from perception.documents import read_json

from ._motion import ORDER, QUANTITIES, RATE_HZ, WINDOW, Scene, noise_m

#: Summary of the recordings that comes with the benchmark.
RECORDED: Final = Path(__file__).with_name("recorded.json")
_POINTS: Final = 101


@dataclass(frozen=True)
class Distribution:
    """A recorded distribution.

    Attributes:
        samples: number of values behind it; values of one person are not independent.
        quantiles: (101,) values at 0, 1, …, 100 %.
    """

    samples: int
    quantiles: FloatArray

    def percentile(self, percent: float) -> float:
        """Return a percentile."""
        return float(np.interp(percent, np.linspace(0.0, 100.0, _POINTS), self.quantiles))

    def distance(self, values: FloatArray) -> float:
        """Return the Kolmogorov-Smirnov distance of values to the distribution.

        It is the largest difference of the two distribution functions. The recorded one is linear
        between its quantiles.
        """
        levels = np.linspace(0.0, 1.0, _POINTS)
        return float(
            kstest(
                values, lambda each: np.interp(each, self.quantiles, levels, left=0.0, right=1.0)
            ).statistic
        )


def summarise(scenes: Sequence[Scene], source: str) -> dict[str, object]:
    """Return the summary of recordings, as :func:`read_recorded` reads it."""
    quantities = {}
    for quantity in QUANTITIES:
        values = quantity.values(scenes)
        quantities[quantity.name] = {
            "unit": quantity.unit,
            "samples": len(values),
            "quantiles": np.quantile(values, np.linspace(0.0, 1.0, _POINTS)).round(4).tolist(),
        }
    return {
        "source": source,
        "rate_hz": RATE_HZ,
        "filter": f"Savitzky-Golay, {WINDOW} frames, order {ORDER}",
        "people": sum(len(scene.positions_m) for scene in scenes),
        "noise_m": round(noise_m(scenes), 5),
        "quantities": quantities,
    }


def write_recorded(path: Path, summary: dict[str, object]) -> None:
    """Write a summary of recordings."""
    write_text(path, json_text(summary))


def read_recorded(path: Path = RECORDED) -> dict[str, Distribution]:
    """Read a summary of recordings; return its distributions by name.

    Raises:
        AwarenavError: for a file that is no such summary.
    """
    try:
        return {
            name: Distribution(int(entry["samples"]), np.array(entry["quantiles"], dtype=float))
            for name, entry in read_json(path, AwarenavError)["quantities"].items()
        }
    except (ValueError, KeyError, TypeError, AttributeError) as cause:
        raise AwarenavError(
            f"{path} is not a summary of recorded people: 'quantities' must give 'samples' and "
            f"101 'quantiles' by name ({cause})"
        ) from cause
