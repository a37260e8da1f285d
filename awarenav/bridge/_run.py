"""Where the messages of the bridge go.

What ``awarenav bridge`` does: a DDS node about the bridge, in one loop.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, NoReturn

from nav_adapter import AwarenessPolicy, NavError
from nav_adapter.ros2 import PUBLISHED, READ, AwarenessBridge, Frames, RobotFile, Topic, renamed
from nav_adapter.ros2.messages import Message
from perception import AttentionCone, AwarenessPipeline, Camera, PersonDetector
from perception.arrays import finite_number

from ..errors import AwarenavError
from ..estimate import SHIPPED, Networks, RecordingPoseEstimator, choose_networks
from ._loop import BridgeLoop, Inputs

if TYPE_CHECKING:
    from nav_adapter.ros2 import DdsNode, McapRecorder


class Outlet:
    """Publishes over DDS, and records what it publishes.

    Args:
        node: has the publishers, which are made here.
        topics: what is published, by key.
        recorder: gets it all, if there is one.
    """

    def __init__(
        self, node: DdsNode, topics: Mapping[str, Topic], recorder: McapRecorder | None
    ) -> None:
        self._node, self._topics, self._recorder = node, topics, recorder
        for topic in topics.values():
            node.advertise(topic)

    def wants(self, key: str) -> bool:
        """Whether a message would reach anybody.

        Who subscribes later gets the next one; of a latched topic the last one must be there.
        """
        topic = self._topics.get(key)
        return topic is not None and (
            self._recorder is not None or topic.transient_local or self._node.readers_of(topic) > 0
        )

    def publish(self, key: str, message: Message) -> None:
        """Send a message, unless its topic is left out."""
        topic = self._topics.get(key)
        if topic is not None:
            cdr = self._node.publish(topic, message)
            if self._recorder is not None:
                self._recorder.write(topic, cdr, time.time())


# Time for the last messages to leave before the node does.
_LINGER_S = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class BridgeOptions:
    """The options of ``awarenav bridge``."""

    robot: Path
    policy: str
    domain: int | None
    rate: float
    seconds: float | None
    detector: str
    pose: str
    head: str
    image: str
    compressed: bool
    camera_info: str
    camera: Path | None
    odom: str
    odom_frame: str
    base_frame: str
    camera_frame: str
    topic: tuple[str, ...]
    only: tuple[str, ...]
    percentage: bool
    record: Path | None
    rerun: Path | None


def bridge_command(options: BridgeOptions) -> int:
    """Run the bridge until Ctrl-C, SIGTERM or ``--seconds``."""
    rate_hz = finite_number("--rate", options.rate, AwarenavError, minimum=1.0, maximum=200.0)
    seconds = _seconds(options.seconds)
    domain = _domain(options.domain)
    robot = RobotFile.from_yaml(options.robot)
    policy = _policy(options.policy)
    camera = None if options.camera is None else Camera.from_yaml(options.camera)
    published = _published(options.topic, options.only)
    networks = choose_networks(options.detector, options.pose, options.head)
    inputs = _inputs(options, with_info=camera is None, with_tf=robot.camera is None)

    from nav_adapter.ros2 import DdsNode, McapRecorder  # noqa: PLC0415 - needs the extra ros2

    node = DdsNode(domain)
    with ExitStack() as stack:
        stack.callback(node.close)
        recorder = None
        if options.record is not None:
            recorder = stack.enter_context(McapRecorder(options.record))
        outlet = Outlet(node, published, recorder)
        tap = RecordingPoseEstimator(networks.pose_estimator)
        cone = AttentionCone()
        drawing = None
        if options.rerun is not None:
            from ._rerun import RerunRecorder  # noqa: PLC0415 - needs the extra viz

            drawing = RerunRecorder(options.rerun, tap, cone.half_angle_rad)
            stack.enter_context(drawing)

        if SHIPPED in (options.detector, options.pose):
            _say("the networks in the box are made for the simulator; see --detector and --pose")
        if camera is None:
            _say(f"waiting for /{options.camera_info.strip('/')}")
        bridge = AwarenessBridge(
            policy,
            robot.profile(),
            outlet.publish,
            frames=Frames(options.odom_frame, options.base_frame, options.camera_frame),
            T_base_camera=None if robot.camera is None else robot.camera.T_base_camera(),
            camera=camera,
            percentage=options.percentage,
            warn=_say,
            wanted=outlet.wants,
            make_pipeline=_pipelines(networks, tap, cone),
        )
        loop = BridgeLoop(node, bridge, inputs, rate_hz, recorder=recorder, drawing=drawing)
        _say(
            f"domain {domain}: reading /{inputs.image.name} and /{inputs.odom.name}, publishing "
            f"{', '.join('/' + topic.name for topic in published.values())}"
        )
        before = signal.signal(signal.SIGTERM, _interrupt)
        try:
            loop.run(seconds, report=_say)
        except KeyboardInterrupt:
            pass  # the way in which a bridge ends
        finally:
            signal.signal(signal.SIGTERM, before)
            bridge.stop(time.time(), "awarenav bridge has ended")
            time.sleep(_LINGER_S)
        _say(f"ended after {loop.frames} frames; a stop was published")
    return 0


def _pipelines(
    networks: Networks, tap: RecordingPoseEstimator, cone: AttentionCone
) -> Callable[[Camera], AwarenessPipeline]:
    """Makes the pipeline of these networks, with the keypoints listened to."""

    def make(camera: Camera) -> AwarenessPipeline:
        detector = networks.detector
        if not isinstance(detector, PersonDetector):
            detector = detector(camera)
        return AwarenessPipeline(camera, detector, tap, networks.head_pose_estimator, cone)

    return make


def _seconds(option: float | None) -> float | None:
    return (
        None if option is None else finite_number("--seconds", option, AwarenavError, minimum=0.0)
    )


def _domain(option: int | None) -> int:
    """The domain asked for, or that of the environment."""
    if option is not None:
        return option
    text = os.environ.get("ROS_DOMAIN_ID", "") or "0"
    if not text.isdigit():
        raise AwarenavError(f"ROS_DOMAIN_ID must be a number from 0 to 232, got {text!r}")
    return int(text)


def _interrupt(number: int, frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt


def _policy(name: str) -> AwarenessPolicy:
    if Path(name).suffix in (".yaml", ".yml"):
        return AwarenessPolicy.from_yaml(name)
    return AwarenessPolicy.preset(name)


def _published(renames: Sequence[str], only: Sequence[str]) -> dict[str, Topic]:
    topics = dict(PUBLISHED)
    for rename in renames:
        key, equals, name = rename.partition("=")
        if not equals or key not in topics:
            raise AwarenavError(
                f"--topic must be KEY=TOPIC with a key of {', '.join(PUBLISHED)}, got {rename!r}"
            )
        topics[key] = renamed(topics[key], name)
    for key in only:
        if key not in topics:
            raise AwarenavError(f"--only must name some of {', '.join(PUBLISHED)}, got {key!r}")
    names = [topic.name for topic in topics.values()]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise NavError(f"two kinds of messages cannot share a topic, got {twice!r} twice")
    return {key: topic for key, topic in topics.items() if not only or key in only}


def _inputs(options: BridgeOptions, *, with_info: bool, with_tf: bool) -> Inputs:
    image = READ["compressed" if options.compressed else "image"]
    return Inputs(
        image=renamed(image, options.image),
        odom=renamed(READ["odom"], options.odom),
        camera_info=renamed(READ["camera_info"], options.camera_info) if with_info else None,
        tf=READ["tf"] if with_tf else None,
        tf_static=READ["tf_static"] if with_tf else None,
    )


def _say(text: str) -> None:
    print(f"awarenav bridge: {text}", file=sys.stderr, flush=True)
