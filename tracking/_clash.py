"""Stops the import when another distribution has taken a name that this package needs."""

from __future__ import annotations

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

# Loaded by path: importing it by name would first run whatever now calls itself perception.
_spec = spec_from_file_location(
    "_awarenav_clash", Path(__file__).parents[1] / "perception" / "_clash.py"
)
if _spec is None or _spec.loader is None:
    raise ImportError("awarenav's perception/_clash.py cannot be loaded", name="perception")
_check = module_from_spec(_spec)
_spec.loader.exec_module(_check)
_check.require_sole_owner(__package__)
