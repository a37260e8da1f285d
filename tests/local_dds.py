"""DDS on this computer alone, for tests with participants in a domain of their own."""

from __future__ import annotations

import os
import random

import pytest
from paths import ROOT

_INTERFACE = '<NetworkInterface name="lo" multicast="false"/>'
_SETTINGS = (
    f"<CycloneDDS><Domain><General><Interfaces>{_INTERFACE}</Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery>"
    '<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="localhost"/></Peers>'
    "</Discovery></Domain></CycloneDDS>"
)


def own_domain(monkeypatch: pytest.MonkeyPatch) -> int:
    """Keep DDS here and in child processes on the loopback, in a random domain; return it."""
    domain = random.SystemRandom().randint(1, 200)
    path = os.pathsep.join(part for part in (str(ROOT), os.environ.get("PYTHONPATH")) if part)
    monkeypatch.setenv("CYCLONEDDS_URI", _SETTINGS)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    monkeypatch.setenv("PYTHONPATH", path)
    return domain
