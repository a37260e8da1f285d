"""The runtime of the networks reports nothing to anybody, unless its owner wants it to."""

import os
import subprocess
import sys

import pytest

PROGRAM = "import os, perception.networks; print(os.environ['ORT_DISABLE_TELEMETRY'])"


def run(tmp_path, **environment):
    # The runtime is silent in what it takes for a build server, so these must not be set.
    kept = {key: value for key, value in os.environ.items() if key not in ("CI", "GITHUB_ACTIONS")}
    kept.pop("ORT_DISABLE_TELEMETRY", None)
    return subprocess.run(
        [sys.executable, "-c", PROGRAM],
        capture_output=True,
        text=True,
        check=True,
        env={
            **kept,
            "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
            "TMPDIR": str(tmp_path),
            "HOME": str(tmp_path),
            **environment,
        },
    )


def test_importing_the_networks_leaves_no_identifier_behind(tmp_path):
    assert run(tmp_path).stdout == "1\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("chosen", ["0", "1"])
def test_what_the_owner_chose_stays(tmp_path, chosen):
    assert run(tmp_path, ORT_DISABLE_TELEMETRY=chosen).stdout == f"{chosen}\n"
