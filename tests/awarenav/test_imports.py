"""``import awarenav`` is light, and nothing in it needs the simulator."""

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

# Imports every module while a finder refuses the simulator. An extra may be missing.
WITHOUT_SIMULATOR = """
import importlib, json, pkgutil, sys

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("pybullet", "pybullet_data", "sim_tests"):
            raise AssertionError(f"{name} was imported")

sys.meta_path.insert(0, Refuse())
import awarenav
from awarenav.errors import MissingExtraError

imported, missing = [], []
for module in pkgutil.walk_packages(awarenav.__path__, "awarenav."):
    if module.name == "awarenav.__main__":
        continue
    try:
        importlib.import_module(module.name)
        imported.append(module.name)
    except MissingExtraError as error:
        missing.append(f"{module.name}: {error}")
assert not {"pybullet", "sim_tests"} & set(sys.modules)
print(json.dumps([imported, missing]))
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


def test_no_module_of_awarenav_imports_the_simulator():
    imported, missing = json.loads(python(WITHOUT_SIMULATOR))
    for tool in ("bridge._run", "estimate._run", "judge._judge", "models._run", "tracks._run"):
        assert f"awarenav.{tool}" in imported
    assert "awarenav.policies.command" in imported
    assert len(missing) <= 4, missing  # av, matplotlib, rerun, rosbags


def test_names_of_awarenav_are_those_of_their_packages():
    assert awarenav.NavAdapter is nav_adapter.NavAdapter
    assert awarenav.PersonTracker is tracking.PersonTracker
    assert awarenav.AwarenessPipeline is perception.AwarenessPipeline
    for name in awarenav.__all__:
        homes = [each for each in (perception, tracking, nav_adapter) if name in each.__all__]
        assert all(getattr(each, name) is getattr(awarenav, name) for each in homes)
        assert homes or name == "AwarenavError"


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
        with contextlib.suppress(MissingExtraError):
            assert getattr(module, name) is not None
    with pytest.raises(AttributeError, match=rf"module '{page}' has no attribute 'Nope'"):
        _ = module.Nope
