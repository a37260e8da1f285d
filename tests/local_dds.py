"""DDS on this computer alone, for tests with participants in a domain of their own."""

from __future__ import annotations

import random

import pytest

_INTERFACE = '<NetworkInterface name="lo" multicast="false"/>'
#: Cyclone DDS on the loopback.
SETTINGS = (
    f"<CycloneDDS><Domain><General><Interfaces>{_INTERFACE}</Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery>"
    '<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="localhost"/></Peers>'
    "</Discovery></Domain></CycloneDDS>"
)


def own_domain(monkeypatch: pytest.MonkeyPatch) -> int:
    """Return a domain drawn at random, whose participants here speak on the loopback alone."""
    monkeypatch.setenv("CYCLONEDDS_URI", SETTINGS)
    return random.SystemRandom().randint(1, 200)
