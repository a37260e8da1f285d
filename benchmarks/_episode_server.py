"""Runs the crossings asked for on standard input, one a line, for ``benchmarks.episode_cost``.

It is run as source text in the folder of a checkout, whose packages it imports.
"""

from __future__ import annotations

import hashlib
import json
import sys
import time

from sim_tests import run_crossing

for line in sys.stdin:
    scenario, policy, perception, seed = json.loads(line)
    begun_s = time.process_time()
    result = run_crossing(scenario, policy=policy, perception=perception, seed=seed)
    spent_s = time.process_time() - begun_s
    digest = hashlib.sha256()
    for frame in result.frames:
        digest.update(frame.robot_state.position_odom_m.tobytes())
        digest.update(repr((frame.t_s, frame.command, frame.margins_m)).encode())
    figures = {
        "processor_s": spent_s,
        "simulated_s": result.duration_s,
        "digest": digest.hexdigest(),
    }
    print(json.dumps(figures), flush=True)
