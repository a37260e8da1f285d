from __future__ import annotations

import os
import random

import pytest
from paths import ROOT


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    interface = '<NetworkInterface name="lo" multicast="false"/>'
    monkeypatch.setenv(
        "CYCLONEDDS_URI",
        f"<CycloneDDS><Domain><General><Interfaces>{interface}</Interfaces>"
        "<AllowMulticast>false</AllowMulticast></General><Discovery>"
        '<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="localhost"/></Peers>'
        "</Discovery></Domain></CycloneDDS>",
    )
    path = os.pathsep.join(part for part in (str(ROOT), os.environ.get("PYTHONPATH")) if part)
    monkeypatch.setenv("PYTHONPATH", path)
    return random.SystemRandom().randint(1, 200)
