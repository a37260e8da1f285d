from __future__ import annotations

from pathlib import Path

import pytest
from local_dds import own_domain
from paths import ROOT
from rendered_image import RenderedImage, rendered

from nav_adapter.ros2 import RobotFile


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    return own_domain(monkeypatch)


@pytest.fixture(scope="session")
def scene(tmp_path_factory: pytest.TempPathFactory) -> RenderedImage:
    pytest.importorskip("pybullet", reason="the extra sim is not installed")
    return rendered(tmp_path_factory.mktemp("render"))


@pytest.fixture
def robot_file(tmp_path: Path) -> Path:
    """The robot of the docs, whose scanners are in tf."""
    path = tmp_path / "robot.yaml"
    docs = RobotFile.from_yaml(ROOT / "docs" / "nav2" / "robot.yaml")
    docs.model_copy(update={"scanners": None}).to_yaml(path)
    return path
