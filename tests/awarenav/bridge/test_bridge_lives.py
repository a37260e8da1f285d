from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from troubled_publishers import OwnPeer, live_through, one_scanner


@pytest.mark.slow
def test_the_bridge_lives_while_publishers_come_and_go(domain: int, tmp_path: Path) -> None:
    peer = OwnPeer(domain)
    try:
        live_through(peer, domain, one_scanner(tmp_path / "robot.yaml"))
    finally:
        peer.close()
