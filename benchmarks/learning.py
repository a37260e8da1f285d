"""Learning to cross: random search beside PPO, and how both drive (docs/learning.md).

python -m benchmarks.learning --search       # as many steps as PPO had; minutes
python -m benchmarks.learning --curve curve  # what train.py of the page wrote
python -m benchmarks.learning --drive        # the policies and the reference planner; minutes
python -m benchmarks.learning                # the page and its picture, from docs/learning
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from awarenav.errors import AwarenavError
from awarenav.figures import Figure, new_figure, save_figure
from benchmarks._harness import make_parser, with_figures
from sim_tests import LocalPlanner
from sim_tests.crossing import Crossing
from sim_tests.crossing.planner import make_planner
from sim_tests.learning import CrossingEnv, NetworkPolicy, ObservationEncoder
from sim_tests.study.measures import bootstrap_interval
from sim_tests.study.report import Table
from sim_tests.study.runs import named_scenarios

_ROOT: Final = Path(__file__).resolve().parents[1]
_FOLDER: Final = _ROOT / "docs" / "learning"
PAGE: Final = _ROOT / "docs" / "learning.md"
_PICTURE: Final = _ROOT / "docs" / "images" / "learning.svg"
_SEARCHED: Final = _FOLDER / "random_search.npz"
_STEPS: Final = 150_000
# As in train.py. Its reward at the goal is larger than the default, by this.
_SCAN_RAYS: Final = 16
_CONTROL_HZ: Final = 5.0
_MORE_AT_GOAL: Final = 15.0
# Random search: the deviation of a change, episodes that judge it, and typical sizes of what is
# observed: positions (m), speeds and radii.
_CHANGE: Final = 0.3
_JUDGED: Final = 4
_FAR, _NEAR = 10.0, 1.5
_SEED: Final = 0
_WINDOW: Final = 50
_REFERENCE: Final = "reference planner"

Episode = tuple[float, str, int, float]  # return, end, steps, seconds
Act = Callable[[CrossingEnv, dict[str, Any]], Any]


def _environment(control_hz: float | None = None) -> CrossingEnv:
    return CrossingEnv(named_scenarios(["all"]), scan_rays=_SCAN_RAYS, control_hz=control_hz)


def _episode(env: CrossingEnv, act: Act, **reset: Any) -> Episode:
    observation, info = env.reset(**reset)
    total, steps, ended = 0.0, 0, False
    while not ended:
        observation, reward, terminated, truncated, info = env.step(act(env, observation))
        total, steps, ended = total + reward, steps + 1, terminated or truncated
    return total, info["end"], steps, info["t_s"]


def _linear(weight: np.ndarray, scale: np.ndarray) -> NetworkPolicy:
    layer, bias = (weight.astype(np.float32),), (np.zeros(2, np.float32),)
    return NetworkPolicy(layer, bias, np.zeros(scale.size), scale, np.inf, 8, _SCAN_RAYS)


def _scale() -> np.ndarray:
    """Return (inputs,) the typical size of each number of an observation."""
    person = (_FAR, _FAR, _NEAR, _NEAR, _NEAR, 1.0)
    sizes = {"goal": (_FAR,) * 2, "mask": (1.0,) * 8, "people": person * 8, "robot": (_NEAR,) * 4}
    sizes["scan"] = (_FAR,) * _SCAN_RAYS
    assert set(sizes) == {"mask", *ObservationEncoder(8, _SCAN_RAYS).bounds()}
    return np.concatenate([sizes[name] for name in sorted(sizes)])


def search() -> None:
    """Climb: change the best linear policy at random, and keep what does at least as well."""
    env, rng, scale = _environment(_CONTROL_HZ), np.random.default_rng(0), _scale()
    env.reset(seed=0)
    best, highest = np.zeros((2, scale.size)), -np.inf
    rows: list[tuple[int, float, str]] = []
    steps = 0
    while steps < _STEPS:
        weight = best + _CHANGE * rng.normal(size=best.shape)
        policy = _linear(weight, scale)
        returns = []
        for _ in range(_JUDGED):
            total, end, length, _ = _episode(env, lambda _, seen, p=policy: p(seen))
            steps += length
            rows.append((steps, round(total, 3), end))
            returns.append(total)
        if np.mean(returns) >= highest:
            best, highest = weight, float(np.mean(returns))
    _linear(best, scale).save(_SEARCHED)
    _write("random_search", ("steps", "return", "end"), rows)


def curve(folder: Path) -> None:
    """Write the episodes that the monitors of Stable-Baselines3 logged as one table.

    Returns are those of the default reward.
    """
    logged = []
    for path in folder.glob("*.monitor.csv"):
        with path.open(encoding="utf-8") as file:
            file.readline()
            logged += [
                (float(r["t"]), int(r["l"]), float(r["r"]), r["end"]) for r in csv.DictReader(file)
            ]
    rows, steps = [], 0
    for _, length, total, end in sorted(logged):
        steps += length
        rows.append((steps, round(total - _MORE_AT_GOAL * (end == "goal"), 3), end))
    _write("ppo", ("steps", "return", "end"), rows)


def _planned(env: CrossingEnv, _: Any, *, name: str, made: dict[Crossing, LocalPlanner]) -> Any:
    """Return the action of a planner, which is made anew for each crossing."""
    crossing, now = env.crossing, env.situation
    if crossing not in made:
        made.clear()
        made[crossing] = make_planner(name, crossing.scenario)
    speed_mps, yaw_radps = made[crossing].plan(
        now.known_state, crossing.goal_odom_m, now.constraints, crossing.dt_s
    )
    robot = crossing.scenario.robot_profile
    return speed_mps / robot.max_speed_mps, yaw_radps / robot.max_yaw_rate_radps


def drive() -> None:
    """Drive every scenario with each planner, at the scenario's own rate of control."""
    rng = np.random.default_rng(0)
    learned = "sim_tests.learning:LearnedPlanner"
    planners = {
        "PPO": learned,
        "random search": f"{learned}(file={str(_SEARCHED)!r})",
        _REFERENCE: "",
    }
    drivers: dict[str, Act] = {
        label: partial(_planned, name=name, made={}) for label, name in planners.items()
    }
    drivers["random actions"] = lambda env, seen: rng.uniform(-1.0, 1.0, 2)
    env, rows = _environment(), []
    for label, act in drivers.items():
        for scenario in named_scenarios(["all"]):
            total, end, _, seconds = _episode(env, act, seed=_SEED, options={"scenario": scenario})
            rows.append((label, scenario.name, round(total, 3), end, round(seconds, 2)))
            print(*rows[-1], file=sys.stderr)
    _write("drives", ("planner", "scenario", "return", "end", "time_s"), rows)


def _write(name: str, columns: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    with (_FOLDER / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def read(name: str) -> list[dict[str, str]]:
    with (_FOLDER / f"{name}.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def table() -> str:
    """Return how each planner drives as Markdown."""
    rows = read("drives")
    lines = []
    for name in dict.fromkeys(row["planner"] for row in rows):
        own = [row for row in rows if row["planner"] == name]
        ends = [row["end"] for row in own]
        total = bootstrap_interval([float(row["return"]) for row in own], np.random.default_rng(0))
        counts = (ends.count(end) for end in ("goal", "contact", "bump", "time"))
        lines.append([name, total.text(1), *(f"{count} of {len(own)}" for count in counts)])
    columns = (
        "planner",
        "mean return",
        "goal",
        "hit a person",
        "hit a rack or wall",
        "time was up",
    )
    return Table(dict.fromkeys(columns, ""), lines).markdown()


def smooth(name: str) -> Iterator[tuple[float, float]]:
    """Yield steps and the mean return of windows of episodes."""
    rows = [(int(row["steps"]), float(row["return"])) for row in read(name)]
    for first, last in pairwise(range(0, len(rows) + 1, _WINDOW)):
        steps, returns = zip(*rows[first:last], strict=True)
        yield float(np.mean(steps)), float(np.mean(returns))


def figure() -> Figure:
    """Return the mean return over the steps that each way of learning took."""
    drawn = new_figure(7.8, 4.2)
    axes = drawn.subplots()
    for name, label, colour in (
        ("ppo", "PPO", "#1f5f8b"),
        ("random_search", "random search", "#c46a1b"),
    ):
        steps, returns = zip(*smooth(name), strict=True)
        axes.plot([1e-3 * each for each in steps], returns, color=colour, label=label, linewidth=2)
    reference = [float(row["return"]) for row in read("drives") if row["planner"] == _REFERENCE]
    axes.axhline(
        float(np.mean(reference)), color="#777777", linestyle="--", label="reference planner"
    )
    axes.set_xlabel("steps of the environment (thousands)", fontsize=13)
    axes.set_ylabel(f"mean return of {_WINDOW} episodes", fontsize=13)
    axes.legend(fontsize=12, loc="center right")
    axes.grid(alpha=0.3)
    return drawn


def page(text: str) -> str:
    """Return the text of the page with the present table."""
    return with_figures(text, {"learning": table()})


def main() -> int:
    """Run the command; return 2 for bad input."""
    parser = make_parser("benchmarks.learning", "Random search beside PPO, and how both drive.")
    parser.add_argument("--search", action="store_true", help="run random search")
    parser.add_argument("--curve", type=Path, metavar="DIR", help="what train.py wrote")
    parser.add_argument("--drive", action="store_true", help="drive with each planner")
    options = parser.parse_args()
    try:
        if options.search:
            search()
        if options.curve:
            curve(options.curve)
        if options.drive:
            drive()
        PAGE.write_text(page(PAGE.read_text("utf-8")), "utf-8")
        save_figure(figure(), _PICTURE)
    except (AwarenavError, OSError) as error:
        print(f"learning: {error}", file=sys.stderr)
        return 2
    print(f"written: docs/{PAGE.name} and its picture")
    return 0


if __name__ == "__main__":
    sys.exit(main())
