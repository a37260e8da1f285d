"""The frontier: time lost over step-out impacts, with and without awareness."""

from __future__ import annotations

from ._frontier import TODAY, sensors_of_today
from ._show import frontier_command
