"""Command ``python -m benchmarks.bridge``: how fast the bridge is with simulated drivers."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

from awarenav.baseline import MeasuredValue
from awarenav.cli import main as awarenav
from awarenav.errors import AwarenavError

from .._harness import bad_input, count, finish, make_parser, parse

BASELINE = Path(__file__).with_name("baseline.json")
#: Least images per second on two cores.
WANTED_HZ = 15.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return 0 for success, 1 for a missed goal, 2 for bad input."""
    parser = make_parser(
        "benchmarks.bridge",
        "Send one rendered image of 640 × 480 again and again over DDS on loopback to `awarenav "
        "bridge` with the shipped networks, with odometry at 50 Hz and a listener on every topic, "
        "and count the images that it processes. Bridge, sender and listener share the cores. "
        "Use a computer that runs nothing else.",
        BASELINE,
    )
    parser.add_argument("--seconds", type=count, default=20, metavar="S", help="default: 20")
    parser.add_argument(
        "--rate", type=count, default=30, metavar="HZ", help="images sent per second (default: 30)"
    )
    parser.add_argument("--cores", type=count, default=2, metavar="N", help="default: 2 (Linux)")
    parser.add_argument(
        "--people", type=count, default=1, metavar="N", help="people in the image (default: 1)"
    )
    parser.add_argument("--compressed", action="store_true", help="send JPEG files")
    parser.add_argument(
        "--render",
        type=Path,
        metavar="DIR",
        help="an `awarenav render` folder instead of a new one",
    )
    options, baseline = parse(parser, arguments)
    try:
        metrics = _metrics(options)
    except AwarenavError as error:
        return bad_input(parser, error)
    for metric in metrics:
        print(f"{metric.name:24s}{metric.value:9.2f} {metric.unit}")
    missed = []
    if metrics[0].value < min(WANTED_HZ, options.rate):
        missed.append(f"{metrics[0].value:.1f} images per second, at least {WANTED_HZ:g} wanted")
    return finish(metrics, missed, baseline, options.out)


def _metrics(options: argparse.Namespace) -> list[MeasuredValue]:
    # Imported late so that the help works without the extra ros2.
    from ._measure import measure  # noqa: PLC0415

    with tempfile.TemporaryDirectory() as temporary:
        folder = options.render
        if folder is None:
            folder = Path(temporary)
            _render(folder, options.people)
        figures = measure(folder, options.seconds, options.rate, options.cores, options.compressed)
    print(f"{figures.people} of {options.people} people confirmed")
    # Bare figures depend on the computer; wide tolerances only catch a large change.
    return [
        MeasuredValue("bridge_pictures_per_s", figures.frames_per_s, "1/s", "higher", 0.3),
        MeasuredValue(
            "bridge_publications_per_s", figures.publications_per_s, "1/s", "higher", 0.1
        ),
        MeasuredValue("bridge_latency", figures.latency_ms, "ms", "lower", 0.5),
        MeasuredValue("bridge_cpu_per_picture", figures.cpu_ms, "ms", "lower", 0.5),
    ]


def _render(folder: Path, people: int) -> None:
    size = ["--frames", "1", "--scenes", "1", "--people", str(people), "--range", "2", "4"]
    status = awarenav(["render", *size, "--seed", "3", "--workers", "1", "--out", str(folder)])
    if status != 0:
        raise AwarenavError(f"awarenav render ended with status {status}")


if __name__ == "__main__":
    raise SystemExit(main())
