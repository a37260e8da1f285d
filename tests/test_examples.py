"""Every example runs, as a newcomer would run it."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(path):
    done = subprocess.run(
        [sys.executable, "-W", "error", str(path)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=120,
        check=False,
        env={"PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


def test_the_plug_in_example_shows_room_shrinking_for_an_aware_person():
    out = subprocess.run(
        [sys.executable, str(ROOT / "examples" / "plug_into_planner.py")],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=120,
        check=True,
        env={"PYTHONPATH": str(ROOT)},
    ).stdout
    radii = [float(text) for text in re.findall(r"radius +([0-9.]+) m", out)]
    limits = [float(text) for text in re.findall(r"limit +([0-9.]+) m/s", out)]
    assert radii[-1] < radii[12] - 0.3
    assert limits[-1] > limits[12]


@pytest.mark.parametrize("page", ["README.md", "docs/rendering.md"])
def test_a_page_shows_code_that_runs(page):
    """Python blocks of the page, in order, in one namespace."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S)
    assert blocks
    namespace: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), namespace)
