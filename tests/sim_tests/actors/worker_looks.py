"""The shipped workers as parameters of tests: a few always, all of them with ``--full``."""

from __future__ import annotations

import pytest

from sim_tests.actors.body import worker_names

_ALWAYS = ("amina", "ivan")
#: Their files do not change, so two workers stand for all in every run.
LOOKS = [
    pytest.param(name, marks=() if name in _ALWAYS else pytest.mark.full) for name in worker_names()
]
