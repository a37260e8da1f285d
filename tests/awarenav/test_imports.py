"""``import awarenav`` is light, and its names are those of its packages."""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import subprocess
import sys

import pytest
from paths import ROOT

import awarenav
import nav_adapter
import perception
import tracking
from awarenav.errors import MissingExtraError

LIGHT = """
import json, sys
import awarenav
print(json.dumps(sorted(sys.modules)))
awarenav.NavAdapter
assert "shapely" in sys.modules
"""


def python(code: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_importing_awarenav_imports_no_array_no_network_and_no_command_line():
    loaded = set(json.loads(python(LIGHT)))
    assert loaded.isdisjoint({"click", "cv2", "numpy", "onnxruntime", "pydantic", "scipy"})
    assert [each for each in loaded if each.split(".")[0] == "awarenav"] != []


def test_names_of_awarenav_are_those_of_their_packages():
    assert awarenav.NavAdapter is nav_adapter.NavAdapter
    assert awarenav.PersonTracker is tracking.PersonTracker
    assert awarenav.AwarenessPipeline is perception.AwarenessPipeline
    for name in awarenav.__all__:
        homes = [each for each in (perception, tracking, nav_adapter) if name in each.__all__]
        assert all(getattr(each, name) is getattr(awarenav, name) for each in homes)
        assert homes or name in ("AwarenavError", "Navigator")


@pytest.mark.parametrize(
    "page",
    [
        ".".join(path.parent.relative_to(ROOT).parts)
        for package in ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests")
        for path in sorted((ROOT / package).rglob("__init__.py"))
        if "lazy_page(" in path.read_text("utf-8")
    ],
)
def test_every_name_of_a_lazy_page_is_found_and_others_are_refused(page):
    module = importlib.import_module(page)
    for name in module.__all__:
        with contextlib.suppress(MissingExtraError, nav_adapter.NavError):  # no extra
            assert getattr(module, name) is not None
    with pytest.raises(AttributeError, match=rf"module '{page}' has no attribute 'Nope'"):
        _ = module.Nope
