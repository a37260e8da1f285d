"""The wheel's content, and the core in an environment without the simulator."""

from __future__ import annotations

import hashlib
import json
import zipfile
from email.parser import Parser
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

PACKAGES = {"perception", "tracking", "nav_adapter", "awarenav", "sim_tests"}
CORE = ("perception", "tracking", "nav_adapter", "awarenav")

# Prints what importing and using the core pulled in.
CORE_CODE = """
import importlib.util, json, sys
import awarenav, nav_adapter, perception, tracking
robot = nav_adapter.RobotProfile(
    footprint_m=[[0.4, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.4, -0.3]], max_speed_mps=1.5,
    max_acceleration_mps2=1.0, max_deceleration_mps2=1.0, reaction_time_s=0.3)
state = nav_adapter.RobotState(0.0, [0.0, 0.0], 0.0, 0.0, 0.0)
adapter = nav_adapter.NavAdapter(nav_adapter.AwarenessPolicy(), robot)
constraints = adapter.update(tracking.PersonTracker().predict(0.0), state, 0.0)
print(json.dumps({
    "files": {
        each.__name__: each.__file__ for each in (perception, tracking, nav_adapter, awarenav)
    },
    "found": [name for name in ("pybullet", "av") if importlib.util.find_spec(name)],
    "imported": [name for name in ("pybullet", "matplotlib", "av", "tqdm") if name in sys.modules],
    "obstacles": nav_adapter.circles(constraints).shape,
}))
"""


def names_in(wheel: Path) -> list[str]:
    with zipfile.ZipFile(wheel) as archive:
        return archive.namelist()


def metadata_file(wheel: Path, name: str) -> str:
    (path,) = (entry for entry in names_in(wheel) if entry.endswith(f".dist-info/{name}"))
    with zipfile.ZipFile(wheel) as archive:
        return archive.read(path).decode()


def test_wheel_is_small_and_owns_its_five_top_level_names_and_no_others(wheel: Path) -> None:
    assert wheel.stat().st_size <= 30e6
    tops = {name.split("/")[0] for name in names_in(wheel)}
    assert {top for top in tops if not top.endswith(".dist-info")} == PACKAGES
    assert len(tops) == len(PACKAGES) + 1


def test_wheel_ships_every_file_of_the_packages(wheel: Path, root: Path) -> None:
    on_disk = {
        path.relative_to(root).as_posix()
        for package in PACKAGES
        for path in (root / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".part"
    }
    shipped = {name for name in names_in(wheel) if name.split("/")[0] in PACKAGES}
    assert shipped == on_disk
    assert {f"{package}/py.typed" for package in PACKAGES} <= shipped


def test_wheel_carries_the_licence_and_the_command(wheel: Path, root: Path) -> None:
    assert metadata_file(wheel, "licenses/LICENSE") == (root / "LICENSE").read_text()
    assert "awarenav = awarenav.cli:main" in metadata_file(wheel, "entry_points.txt")
    metadata = Parser().parsestr(metadata_file(wheel, "METADATA"))
    assert metadata["License-Expression"] == "Apache-2.0"
    needed = [line for line in metadata.get_all("Requires-Dist", []) if "extra ==" not in line]
    optional = ("pybullet", "av", "ai_edge_litert", "filelock", "flatbuffers", "pooch")
    assert not any(line.startswith(optional) for line in needed)
    assert any(line.startswith("filterpy") for line in needed)
    extras = set(metadata.get_all("Provides-Extra", []))
    assert {"sim", "litert", "fetch"} <= extras


def test_wheel_carries_the_networks_unaltered(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        manifest = json.loads(archive.read("perception/models/manifest.json"))
        for model in manifest["models"]:
            content = archive.read(f"perception/models/{model['name']}.onnx")
            assert hashlib.sha256(content).hexdigest() == model["sha256"]
            assert archive.read(f"perception/models/{model['name']}.md")
    assert len(manifest["models"]) == 4


def test_the_installed_wheel_imports_and_its_commands_run(installed: Any) -> None:
    done = installed.python(CORE_CODE)
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    for name in CORE:
        assert Path(seen["files"][name]).parent == installed.site / name
    assert seen["imported"] == []
    assert seen["obstacles"] == [0, 5]
    for arguments in (("--help",), ("models", "verify"), ("policy", "show", "balanced")):
        ran = installed.command("awarenav", *arguments)
        assert ran.returncode == 0, f"{arguments}: {ran.stdout}{ran.stderr}"


@pytest.mark.full
def test_core_installs_and_runs_without_the_simulator(
    wheel: Path, root: Path, environment: Any, tmp_path: Path
) -> None:
    environment.pip("install", "--quiet", "--constraint", root / "requirements.lock", wheel)

    done = environment.python(CORE_CODE)

    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    for name in CORE:
        assert Path(seen["files"][name]).parent == environment.site / name
    assert seen["found"] == []
    assert seen["imported"] == []
    assert seen["obstacles"] == [0, 5]

    assert environment.command("awarenav", "--help").returncode == 0
    (tmp_path / "images").mkdir()
    for number in range(2):
        noise = np.random.default_rng(number).integers(0, 255, (240, 320, 3), dtype=np.uint8)
        assert cv2.imwrite(str(tmp_path / "images" / f"{number:06d}.png"), noise)
    estimates = tmp_path / "estimates.jsonl"
    for arguments in (
        ("models", "verify"),
        ("models", "list", "--json"),
        ("doctor",),
        ("estimate", tmp_path / "images", "--out", estimates, "--allow-simulator-networks"),
        ("judge", estimates, estimates),
        ("tracks", estimates),
        ("policy", "show", "balanced"),
        ("bridge", "--help"),
    ):
        ran = environment.command("awarenav", *map(str, arguments))
        assert ran.returncode == 0, f"{arguments}: {ran.stdout}{ran.stderr}"
    refused = environment.command("awarenav", "demo", "--out", "demo")
    assert refused.returncode == 2, refused.stderr
    assert "awarenav[sim]" in refused.stderr
    assert "Traceback" not in refused.stderr
