"""ONNX Runtime sends no telemetry unless the environment variable allows it."""

import os
import subprocess
import sys

PROGRAM = "import os, perception.networks; print(os.environ['ORT_DISABLE_TELEMETRY'])"


def run(tmp_path, **environment):
    # ONNX Runtime sends nothing on a build server, so the variables that mark one are removed.
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


def test_importing_the_networks_stores_no_identifier(tmp_path):
    assert run(tmp_path).stdout == "1\n"
    assert list(tmp_path.iterdir()) == []


def test_a_set_environment_variable_is_kept(tmp_path):
    assert run(tmp_path, ORT_DISABLE_TELEMETRY="0").stdout == "0\n"
