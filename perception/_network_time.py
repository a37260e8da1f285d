"""How long networks have run, so that everything else can be told apart."""

from __future__ import annotations

import threading


class NetworkTime(threading.local):
    """Time that the calling thread has spent in networks since it began, each thread its own.

    Attributes:
        elapsed_s: by the clock.
        processor_s: of the processor, in that thread; a network's other threads do not count.
    """

    elapsed_s: float = 0.0
    processor_s: float = 0.0


#: Every :class:`~perception.networks.OnnxModel` adds to it.
NETWORK_TIME = NetworkTime()
