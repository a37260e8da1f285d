"""Measures perception: frames per second, and the time outside the networks against rtmlib's.

    python -m benchmarks.perception_speed

The clip is rendered: 640×480 pixels, two people. Time outside the networks is the processor time of
the calling thread less that in the networks, which run on one thread. rtmlib (see requirements.txt)
uses the same model files and images in the same run. A part whose package or file is missing is
left out, with a message. Exit status 1 when a figure is worse than the baseline allows, or when
ours costs more than rtmlib's.
"""

from __future__ import annotations

import contextlib
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import onnxruntime as ort

from awarenav.baseline import MeasuredValue, write_baseline
from awarenav.errors import AwarenavError
from awarenav.records import read_records
from benchmarks._harness import bad_input, count, make_parser, parse
from perception import AwarenessPipeline, Camera, PersonDetection, PersonDetector
from perception.networks import (
    NETWORK_TIME,
    PROVIDERS,
    OnnxModel,
    OnnxPersonDetector,
    OnnxPoseEstimator,
    OnnxSettings,
    Provider,
    parse_provider_options,
)
from perception.networks.heads import OnnxHeadPoseEstimator
from perception.shipped import DETECTOR, HEAD, POSE, shipped_model_path

REPEATS = 7
BASELINE = Path(__file__).with_name("perception_baseline.json")
LIMIT_MS = 2.0  # wanted outside the networks, two people
#: Detectors trained on photographs: file, rtmlib's class, height and width of the input.
DETECTORS = {
    "yolox": ("yolox_nano_416_coco.onnx", "YOLOX", (416, 416)),
    "rtmdet": ("rtmdet_nano_person_320_mmpose.onnx", "RTMDet", (320, 320)),
}


@dataclass(frozen=True)
class RenderedFrame:
    """An image and the boxes (2, 4) of the two people in it."""

    image_rgb: Any
    boxes_xyxy_px: Any

    @property
    def detections(self) -> tuple[PersonDetection, ...]:
        """The boxes as detections."""
        return tuple(PersonDetection(box, 1.0) for box in self.boxes_xyxy_px)


class TimedSession:
    """An onnxruntime session for the peer, whose runs count as time in networks, like ours."""

    def __init__(self, path: Path) -> None:
        options = ort.SessionOptions()
        options.intra_op_num_threads = 1
        self._session = ort.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        self.get_inputs = self._session.get_inputs
        self.get_outputs = self._session.get_outputs

    def run(self, *args: Any) -> Any:
        """Run the network."""
        began = time.thread_time()
        try:
            return self._session.run(*args)
        finally:
            NETWORK_TIME.processor_s += time.thread_time() - began


def peer_tool(make: Callable[..., Any], path: Path, size: tuple[int, int]) -> Any:
    """Return a tool of rtmlib with its network on one thread, timed."""
    with contextlib.redirect_stdout(sys.stderr):
        tool = make(str(path), model_input_size=size, backend="onnxruntime")
    tool.session = TimedSession(path)
    return tool


class TwoPeople:
    """A detector that runs its network and returns known detections, so that all runs are equal."""

    def __init__(self, detector: PersonDetector) -> None:
        self.detector = detector
        self.detections: tuple[PersonDetection, ...] = ()

    def detect(self, image_rgb: Any) -> tuple[PersonDetection, ...]:
        """Run the network; return the known detections."""
        self.detector.detect(image_rgb)
        return self.detections


def clip(frames: int) -> tuple[Camera, list[RenderedFrame]]:
    """Render images with two people in each; return the camera and at most ``frames`` images."""
    from sim_tests.dataset import RenderConfig, render  # noqa: PLC0415 - needs the simulator

    config = RenderConfig(frames=3 * frames, scenes=1, people=2, max_range_m=6.0, seed=4)
    with tempfile.TemporaryDirectory() as folder:
        records = read_records(render(config, Path(folder)))
        camera = Camera.from_yaml(Path(folder) / "camera.yaml")
        pairs = [record for record in records if len(record["people"]) == 2][:frames]
        if not pairs:
            raise AwarenavError(
                f"none of {config.frames} images shows two people; use more --frames"
            )
        return camera, [
            RenderedFrame(
                cv2.cvtColor(cv2.imread(str(Path(folder) / record["frame"])), cv2.COLOR_BGR2RGB),
                np.array([person["box_xyxy_px"] for person in record["people"]]),
            )
            for record in pairs
        ]


def outside_ms(call: Callable[[RenderedFrame], Any], frames: Sequence[RenderedFrame]) -> float:
    """Return the processor milliseconds per frame outside the networks.

    The best of seven runs of a frame counts: other programs and cold caches can only slow it down.
    """
    call(frames[0])
    best = np.full(len(frames), np.inf)
    for _ in range(REPEATS):
        for row, frame in enumerate(frames):
            networks_s, began = NETWORK_TIME.processor_s, time.thread_time()
            call(frame)
            took_s = time.thread_time() - began
            best[row] = min(best[row], took_s - (NETWORK_TIME.processor_s - networks_s))
    return 1e3 * float(best.mean())


def peers() -> Any | None:
    """Return the peer's package, or None where it is not installed."""
    try:
        import rtmlib  # noqa: PLC0415 - an optional peer
    except ImportError:
        return None
    return rtmlib


def measure(
    models: Path, frame_count: int, providers: tuple[Provider, ...] = ("cpu",)
) -> list[MeasuredValue]:
    """Return every figure that the installed packages and files allow."""
    cv2.setNumThreads(1)
    one_thread = OnnxSettings(providers, intra_op_threads=1)
    print(providers_in_use(one_thread))
    skipped = []
    try:
        camera, frames = clip(frame_count)
    except ImportError as error:
        print(f"nothing measured: the clip needs the extra 'sim' ({error})", file=sys.stderr)
        return []
    metrics = pipeline_metrics(camera, frames, providers)
    rtmlib = peers()
    if rtmlib is None:
        skipped.append("the comparison: rtmlib is not installed (benchmarks/requirements.txt)")
    else:
        for name, (file, kind, size) in DETECTORS.items():
            if (models / file).is_file():
                metrics += detector_metrics(
                    name, models / file, getattr(rtmlib, kind), size, frames
                )
            else:
                skipped.append(f"{name}: there is no {models / file} (--models)")
        metrics += pose_metrics(rtmlib, frames)
    for reason in skipped:
        print(f"left out, {reason}", file=sys.stderr)
    return metrics


def providers_in_use(settings: OnnxSettings) -> str:
    """Return which execution providers run each shipped network, and with which options."""
    texts = [f"onnxruntime {ort.__version__}"]
    for name in (DETECTOR, POSE, HEAD):
        model = OnnxModel(shipped_model_path(name), settings=settings)
        options = model.provider_options
        used = (each + (f" {options[each]}" if each in options else "") for each in model.providers)
        texts.append(f"{name}: {', '.join(used)}")
    return "\n".join(texts)


def pipeline_metrics(
    camera: Camera, frames: Sequence[RenderedFrame], providers: tuple[Provider, ...] = ("cpu",)
) -> list[MeasuredValue]:
    """Return the figures of the whole pipeline with the shipped networks."""
    _, process = shipped_pipeline(camera, OnnxSettings(providers, intra_op_threads=1))
    outside = outside_ms(process, frames)
    # Every frame runs the same networks.
    before_s = NETWORK_TIME.elapsed_s
    process(frames[-1])
    inside = 1e3 * (NETWORK_TIME.elapsed_s - before_s)
    _, process = shipped_pipeline(camera, OnnxSettings(providers, intra_op_threads=2))
    times = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        for frame in frames:
            process(frame)
        times.append((time.perf_counter() - began) / len(frames))
    return [
        # Bare times depend on the computer; wide tolerances only catch a large change.
        MeasuredValue(
            "pipeline_frames_per_s_two_threads", 1.0 / min(times), "frames/s", "higher", 0.6
        ),
        MeasuredValue("pipeline_outside_networks", outside, "ms/frame", "lower", 1.0),
        MeasuredValue("pipeline_in_networks_one_thread", inside, "ms/frame", "lower", 1.0),
    ]


def shipped_pipeline(
    camera: Camera, settings: OnnxSettings
) -> tuple[AwarenessPipeline, Callable[[RenderedFrame], None]]:
    """Return a pipeline of the shipped networks, and a function that runs it on a frame."""
    detector = TwoPeople(OnnxPersonDetector(shipped_model_path(DETECTOR), settings=settings))
    pipeline = AwarenessPipeline(
        camera,
        detector,
        OnnxPoseEstimator(shipped_model_path(POSE), settings=settings),
        OnnxHeadPoseEstimator(shipped_model_path(HEAD), settings=settings),
    )

    def process(frame: RenderedFrame) -> None:
        detector.detections = frame.detections
        pipeline.process(frame.image_rgb, 0.0)

    return pipeline, process


def detector_metrics(
    name: str, path: Path, peer: Any, size: tuple[int, int], frames: Sequence[RenderedFrame]
) -> list[MeasuredValue]:
    """Return the figures of one detector, ours and the peer's."""
    detector = OnnxPersonDetector(path, settings=OnnxSettings(intra_op_threads=1))
    other = peer_tool(peer, path, size)
    bgr = {id(frame): frame.image_rgb[..., ::-1].copy() for frame in frames}
    return compared(
        f"{name}_detector",
        outside_ms(lambda frame: detector.detect(frame.image_rgb), frames),
        outside_ms(lambda frame: other(bgr[id(frame)]), frames),
    )


def pose_metrics(rtmlib: Any, frames: Sequence[RenderedFrame]) -> list[MeasuredValue]:
    """Return the figures of the shipped pose network, ours and the peer's."""
    path = shipped_model_path(POSE)
    estimator = OnnxPoseEstimator(path, settings=OnnxSettings(intra_op_threads=1))
    other = peer_tool(rtmlib.RTMPose3d, path, (144, 192))
    return compared(
        "pose_two_people",
        outside_ms(lambda frame: estimator.estimate(frame.image_rgb, frame.detections), frames),
        outside_ms(lambda frame: other(frame.image_rgb, frame.boxes_xyxy_px), frames),
    )


def compared(name: str, ours_ms: float, theirs_ms: float) -> list[MeasuredValue]:
    """Return our time outside the network, and its ratio to the peer's."""
    return [
        MeasuredValue(f"{name}_outside_network", ours_ms, "ms/frame", "lower", 1.0),
        MeasuredValue(f"{name}_outside_over_rtmlib", ours_ms / theirs_ms, "x", "lower", 0.5),
    ]


def report(
    metrics: Sequence[MeasuredValue], baseline: dict[str, MeasuredValue]
) -> tuple[str, bool]:
    """Return the figures as text beside the baseline, and whether all are good enough."""
    lines = [f"{'figure':42s}{'now':>10s}{'baseline':>10s}  unit"]
    good = True
    for metric in metrics:
        known = baseline.get(metric.name)
        verdict = "   WORSE" if known is not None and metric.is_worse_than(known) else ""
        if metric.name.endswith("_over_rtmlib") and metric.value >= 1.0:
            verdict = "   MORE THAN RTMLIB"
        good = good and not verdict
        if metric.name == "pipeline_outside_networks" and metric.value > LIMIT_MS:
            verdict += f"   above {LIMIT_MS:g}, the aim on an idle computer"
        before = "-" if known is None else f"{known.value:.3g}"
        lines.append(f"{metric.name:42s}{metric.value:10.3g}{before:>10s}  {metric.unit}{verdict}")
    return "\n".join(lines), good


def main() -> int:
    """Run the benchmark; return 0 for success, 1 for a worse figure, 2 for bad input."""
    parser = make_parser(
        "benchmarks.perception_speed",
        "Measure frames per second and the time outside the networks, and compare with rtmlib on "
        "the same model files in the same run.",
        BASELINE,
    )
    shared = Path(__file__).resolve().parents[2] / "shared" / "models"
    parser.add_argument(
        "--models", type=Path, default=shared, metavar="DIR", help="folder of the detectors"
    )
    parser.add_argument(
        "--frames", type=count, default=12, metavar="N", help="images of the clip (default: 12)"
    )
    parser.add_argument(
        "--provider", default="cpu", choices=sorted(PROVIDERS), help="runs the pipeline's networks"
    )
    parser.add_argument(
        "--provider-options", default="", metavar="'KEY=VALUE ...'", help="options of the provider"
    )
    options, baseline = parse(parser, None)
    try:
        chosen = parse_provider_options(options.provider_options.split())
        metrics = measure(options.models, options.frames, ((options.provider, chosen),))
    except AwarenavError as error:
        return bad_input(parser, error)
    text, good = report(metrics, baseline)
    print(text)
    if options.out is not None:
        write_baseline(options.out, metrics)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
