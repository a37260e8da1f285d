"""The work of ``awarenav bridge``: a DDS node and the bridge, in one loop beside perception."""

from __future__ import annotations

import os
import re
import signal
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from types import FrameType
from typing import Any, Final, NoReturn

from nav_adapter import AwarenessPolicy, NavError
from nav_adapter.ros2 import (
    MASK_TOPICS,
    PUBLISHED,
    READ,
    AwarenessBridge,
    Frames,
    RobotFile,
    SpeedMaskSettings,
    Topic,
    renamed,
    scanner_inputs,
)
from perception import AttentionCone, AwarenessPipeline, Camera
from perception.laser import MapCells
from perception.named import Networks
from perception.shipped import simulator_networks_warning
from tracking.prediction import PredictionModel

from ..errors import AwarenavError, counted
from ..estimate import (
    admit_options,
    choice_of_options,
    running_options,
)
from ._loop import BridgeInputs, BridgeLoop, TopicPublisher
from ._replay import BagReplay, ReplayPublisher, recorded_messages, static_transforms

# The last messages need so long to leave before the node is closed.
_SEND_TIME_S: Final = 0.1
_MOST_SCANNERS: Final = 2


def bridge_command(options: Any) -> int:
    """Run the bridge until Ctrl-C, SIGTERM or ``--seconds``; return the exit status.

    Args:
        options: of the command line, as attributes.

    Raises:
        AwarenavError: for input that cannot be used.
        NavError: for a policy, robot or topic that cannot be used.
    """
    domain = _domain(options.domain)
    robot = RobotFile.from_yaml(options.robot)
    policy = AwarenessPolicy.named(options.policy)
    published = _published_topics(
        options.topic, options.only, with_mask=options.speed_mask is not None
    )
    mask = _speed_mask(options, published)
    inputs = _inputs(options)

    from nav_adapter.ros2 import DdsNode, McapRecorder  # noqa: PLC0415 - needs the extra ros2

    with ExitStack() as stack:
        # What the user gave is refused before networks that they may have to fetch.
        messages = None
        if options.bag is not None:
            messages = recorded_messages(options.bag, inputs)
            stack.callback(messages.close)
        camera, map_cells, prediction = _files(options, inputs)
        scanners = scanner_inputs([topic.name for topic in inputs.scans], robot)
        networks, unfit = _networks(options)
        recorder = None
        if options.record is not None:
            recorder = stack.enter_context(McapRecorder(options.record))
        viewer = None
        if options.rerun is not None:
            from ._rerun import RerunRecorder  # noqa: PLC0415 - needs the extra viz

            half_angle_rad = AttentionCone().half_angle_rad
            viewer = RerunRecorder(options.rerun, half_angle_rad)
            stack.enter_context(viewer)
        if unfit:
            _log(f"{simulator_networks_warning(unfit)}: trust no awareness that comes from them")
        if scanners:
            _log("the shipped leg detector is made for simulated scans; see docs/laser.md")
        publisher: TopicPublisher | ReplayPublisher
        if messages is None:
            node = DdsNode(domain)
            stack.callback(node.close)
            publisher = TopicPublisher(node, published, recorder)
        else:
            publisher = ReplayPublisher(published, recorder)
        bridge = AwarenessBridge(
            policy,
            robot.profile(),
            publisher.publish,
            frames=Frames(options.odom_frame, options.base_frame, options.camera_frame),
            T_base_camera=None if robot.camera is None else robot.camera.T_base_camera(),
            camera=camera,
            rectified=inputs.rectified,
            with_camera=not options.no_camera,
            with_depth=inputs.depth is not None,
            scanners=scanners,
            prediction=prediction,
            percentage=options.percentage,
            speed_mask=mask,
            warn=_log,
            wanted=publisher.wants,
            make_pipeline=partial(AwarenessPipeline.of, networks),
        )
        if map_cells is not None:
            bridge.on_map(map_cells)
        if messages is not None and isinstance(publisher, ReplayPublisher):
            static = static_transforms(messages, inputs, _log)
            replay = BagReplay(
                messages, bridge, inputs, options.rate, publisher, static=static, viewer=viewer
            )
            _log(f"replayed {replay.run(options.seconds, report=_log):.1f} s: {_summary(bridge)}")
            return 0
        loop = BridgeLoop(node, bridge, inputs, options.rate, recorder=recorder, viewer=viewer)
        stack.callback(_close, loop)
        _announce(domain, inputs, published)
        _run_until_interrupted(loop, bridge, options.seconds)
    return 0


def _files(
    options: Any, inputs: BridgeInputs
) -> tuple[Camera | None, MapCells | None, PredictionModel | None]:
    """Return the camera, the map and the prediction in files; None for each that is not."""
    camera = map_cells = prediction = None
    if options.camera is not None:
        camera = Camera.from_yaml(options.camera, rectified=inputs.rectified)
    if _is_file(options.map):
        map_cells = MapCells.from_yaml(options.map, options.map_frame)
    if options.prediction is not None:
        prediction = PredictionModel.from_calibration(options.prediction)
    return camera, map_cells, prediction


def _networks(options: Any) -> tuple[Networks, tuple[str, ...]]:
    """Return the networks, and the roles of those that have seen renders only."""
    # Without a camera they see nothing.
    choice = choice_of_options(options, rendered=options.no_camera, log=_log)
    networks = choice.load(**running_options(options))
    return networks, admit_options(networks, options, rendered=options.no_camera)


def _announce(domain: int, inputs: BridgeInputs, published: Mapping[str, Topic]) -> None:
    if inputs.camera_info is not None:
        _log(f"waiting for /{inputs.camera_info.name}")
    topics = (inputs.image, inputs.depth, *inputs.scans, inputs.odom)
    read = [topic for topic in topics if topic is not None]
    _log(
        f"domain {domain}: reading {' and '.join('/' + topic.name for topic in read)}, "
        f"publishing {', '.join('/' + topic.name for topic in published.values())}"
    )


def _run_until_interrupted(
    loop: BridgeLoop, bridge: AwarenessBridge, seconds: float | None
) -> None:
    """Run the loop, and end with a stop."""
    before = signal.signal(signal.SIGTERM, _interrupt)
    try:
        loop.run(seconds, report=_log)
    except KeyboardInterrupt:
        pass  # the usual end of a bridge
    finally:
        signal.signal(signal.SIGTERM, before)
        bridge.stop(time.time(), "awarenav bridge has ended")
        time.sleep(_SEND_TIME_S)
    scans = f" and {counted(bridge.counts['scans'], 'scan')}" if "scans" in bridge.counts else ""
    _log(f"ended after {counted(loop.frames, 'frame')}{scans}; a stop was published")


def _summary(bridge: AwarenessBridge) -> str:
    counts = bridge.counts
    names = [
        name
        for name in ("frames", "depth_images", "depth_images_refused", "scans", "scans_refused")
        if name in counts
    ]
    return ", ".join(f"{counts[name]} {name.replace('_', ' ')}" for name in names)


def _close(loop: BridgeLoop) -> None:
    if not loop.close():
        _log("perception does not end; the process ends without it")


def _domain(option: int | None) -> int:
    """Return the DDS domain of the option, else that of the environment."""
    if option is not None:
        return option
    text = os.environ.get("ROS_DOMAIN_ID", "") or "0"
    if re.fullmatch("[0-9]{1,9}", text) is None:
        raise AwarenavError(f"ROS_DOMAIN_ID must be a number from 0 to 232, got {text!r:.60}")
    return int(text)


def _interrupt(number: int, frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt


def _speed_mask(options: Any, published: Mapping[str, Topic]) -> SpeedMaskSettings | None:
    """Return the settings of the speed mask, None without ``--speed-mask``."""
    if options.speed_mask is None:
        return None
    if "speed_mask" not in published:
        raise AwarenavError("--speed-mask needs --only speed_mask too, or no --only")
    return SpeedMaskSettings(
        options.speed_mask,
        options.speed_mask_size,
        options.speed_mask_resolution,
        f"/{published['speed_mask'].name}",
    )


def _published_topics(
    renames: Sequence[str], only: Sequence[str], *, with_mask: bool
) -> dict[str, Topic]:
    """Return the topics to publish by key, renamed and selected as the options say."""
    topics = {**PUBLISHED, **MASK_TOPICS}
    for rename in renames:
        key, equals, name = rename.partition("=")
        if not equals or key not in topics:
            raise AwarenavError(
                f"--topic must be KEY=TOPIC with a key of {', '.join(topics)}, got {rename!r}"
            )
        topics[key] = renamed(topics[key], name)
    for key in only:
        if key not in topics:
            raise AwarenavError(f"--only must name some of {', '.join(topics)}, got {key!r}")
        if key in MASK_TOPICS and not with_mask:
            raise AwarenavError(f"--only {key} needs --speed-mask HZ")
    names = [topic.name for topic in topics.values()]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise NavError(f"two kinds of messages cannot share a topic, got {twice!r} twice")
    chosen = only or (topics if with_mask else PUBLISHED)
    return {key: topic for key, topic in topics.items() if key in chosen}


def _is_file(map_option: str | None) -> bool:
    """Return whether the option names a file; no topic has a dot in its name."""
    return map_option is not None and "." in map_option


def _inputs(options: Any) -> BridgeInputs:
    """Return the topics to read."""
    scans = tuple(renamed(READ["scan"], name) for name in options.scan)
    names = [topic.name for topic in scans]
    if len(names) > _MOST_SCANNERS or len(set(names)) < len(names):
        raise AwarenavError(
            f"--scan must name up to {_MOST_SCANNERS} different topics, got {', '.join(names)}"
        )
    if options.no_camera and not scans:
        raise AwarenavError("--no-camera needs a scanner: --scan TOPIC")
    if options.no_camera and options.camera is not None:
        raise AwarenavError("--no-camera and --camera exclude each other")
    if options.no_camera and options.depth is not None:
        raise AwarenavError("--no-camera and --depth exclude each other")
    if options.map is not None and not scans:
        raise AwarenavError("--map is for the scans: it needs --scan TOPIC")
    tf = options.tf.strip("/").removesuffix("_static")
    image = READ["compressed" if options.compressed else "image"]
    with_info = options.camera is None and not options.no_camera
    return BridgeInputs(
        image=None if options.no_camera else renamed(image, options.image),
        odom=renamed(READ["odom"], options.odom),
        camera_info=renamed(READ["camera_info"], options.camera_info) if with_info else None,
        tf=renamed(READ["tf"], tf),
        tf_static=renamed(READ["tf_static"], f"{tf}_static"),
        scans=scans,
        map=None
        if options.map is None or _is_file(options.map)
        else renamed(READ["map"], options.map),
        depth=None if options.depth is None else renamed(READ["depth"], options.depth),
        footprint=None
        if options.footprint is None
        else renamed(READ["footprint"], options.footprint),
    )


def _log(text: str) -> None:
    print(f"awarenav bridge: {text}", file=sys.stderr, flush=True)
