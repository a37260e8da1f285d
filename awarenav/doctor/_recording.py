"""Findings about the scanners and the odometry of a ROS recording, as the bridge has them."""

from __future__ import annotations

import contextlib
import math
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from nav_adapter import NavError
from nav_adapter.ros2 import Frames, ScanMessages, TransformBuffer, odometry_problems
from nav_adapter.ros2.conversions import from_ros
from nav_adapter.ros2.messages import ros_type
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.sensor_msgs import CompressedImage, Image, LaserScan
from nav_adapter.ros2.messages.tf2_msgs import TFMessage
from perception import PerceptionError
from perception.laser import Scanner, sight_of
from perception.no_view import LastFrames

from ..errors import counted
from ..estimate import BagMessages
from ._brakes import brakings
from ._findings import Finding, Severity

_KINDS: Final = {ros_type(each): each for each in (LaserScan, Odometry, TFMessage)}
_IMAGES: Final = frozenset(ros_type(each) for each in (Image, CompressedImage))
# So much of a recording is looked at.
_LONGEST_S: Final = 60.0
_BASE: Final = "base_link"
# A scanner that is blind in more of its scans is an error; fewer are worth a look.
_OFTEN: Final = 0.5
_SELDOM: Final = 0.05
# A robot that turns no farther off its curve keeps to it: odometry is not surer.
_ON_CURVE_DEG: Final = 5.0
_REMEDY_BLIND: Final = (
    "check its window and its driver; directions hidden by the robot's own body belong outside "
    "field_of_view_deg of robot.yaml"
)


class _Recording:
    """The messages of a recording.

    Attributes:
        scans: of every scanner, with the times of their recording.
        odometry: of every source.
        transforms: of /tf, whatever its namespace.
        static: of /tf_static.
        has_images: whether there is a topic of images.
        whole: whether all of it has been read.
    """

    def __init__(self, path: Path) -> None:
        self.scans: dict[str, list[tuple[float, LaserScan]]] = defaultdict(list)
        self.odometry: dict[str, list[Odometry]] = defaultdict(list)
        self.transforms: list[TFMessage] = []
        self.static: list[TFMessage] = []
        self.whole = True
        with contextlib.closing(BagMessages(path)) as recorded:
            self.has_images = any(kind in _IMAGES for _, kind in recorded.topics)
            kinds = {name: kind for name, kind in recorded.topics if kind in _KINDS}
            began_s = None
            for topic, recorded_s, message in recorded.of(_KINDS):
                began_s = recorded_s if began_s is None else began_s
                # A message of ROS 1 may have other fields: then nothing is known of it.
                with contextlib.suppress(NavError, AttributeError, TypeError, ValueError):
                    self._add(topic, recorded_s, from_ros(_KINDS[kinds[topic]], message))
                if recorded_s - began_s > _LONGEST_S:
                    self.whole = False
                    break

    def _add(self, topic: str, recorded_s: float, message: Any) -> None:
        if isinstance(message, LaserScan):
            self.scans[topic].append((recorded_s, message))
        elif isinstance(message, Odometry):
            self.odometry[topic].append(message)
        else:
            (self.static if topic.endswith("_static") else self.transforms).append(message)

    @property
    def base(self) -> str:
        """The robot's frame: base_link if there is one, else that of the odometry."""
        named = [
            name.lstrip("/")
            for message in (*self.transforms, *self.static)
            for each in message.transforms
            for name in (each.header.frame_id, each.child_frame_id)
        ]
        children = [each[0].child_frame_id.lstrip("/") for each in self.odometry.values()]
        return _BASE if _BASE in (*named, *children) or not children else children[0] or _BASE


def recording_findings(path: Path) -> tuple[list[Finding], bool]:
    """Return the findings about scans and odometry, and whether there are images to look at.

    The first minute of the recording is read.

    Raises:
        AwarenavError: for a file that is not a recording, or a message that cannot be read.
    """
    recording = _Recording(path)
    mounts = TransformBuffer()
    # Those of ROS 1 are in /tf. Between two frames of the robot the latest will do.
    for message in (*recording.transforms, *recording.static):
        for each in message.transforms:
            with contextlib.suppress(NavError):
                mounts.add_message(each, static=True)
    found = []
    for topic, scans in sorted(recording.scans.items()):
        found += _scanner_findings(topic, scans, mounts, recording.base)
    for topic, odometry in sorted(recording.odometry.items()):
        found += _odometry_findings(topic, odometry, recording)
    if not recording.whole:
        text = f"scanners and odometry were checked for the first {_LONGEST_S:g} s"
        found.append(Finding.fine("recording", text))
    if not recording.has_images:
        found.append(Finding.warning("images", "the recording has none"))
    return found, recording.has_images


def _scanner_findings(
    topic: str, scans: Sequence[tuple[float, LaserScan]], mounts: TransformBuffer, base: str
) -> list[Finding]:
    """Return what is wrong with one scanner, or that nothing is."""
    said: list[str] = []
    messages = ScanMessages(topic, said.append)
    refused: Counter[str] = Counter()
    blind: Counter[str] = Counter()
    frozen: Counter[str] = Counter()
    last = LastFrames()
    frame = scans[0][1].header.frame_id
    try:
        mounting, where = Scanner(mounts.lookup(base, frame, 0.0)), f"in {base!r}"
    except (NavError, PerceptionError):
        mounting, where = Scanner(np.eye(4)), f"in its own frame {frame!r}, which is not in tf"
    for recorded_s, message in scans:
        try:
            scan = messages.read(message, recorded_s)
        except NavError as problem:
            refused[str(problem)] += 1
            continue
        if scan.repeats(last):
            frozen["all ranges are those of a scan before"] += 1
        sight = sight_of(scan, mounting)
        if sight.blind_text:
            blind[sight.blind_text] += 1
    found = [Finding.warning("scanners", text) for text in said]
    for reasons, words, remedy in (
        (refused, "refused: {}", "check its driver"),
        (blind, "the scanner is {} (0° is ahead, " + where + ")", _REMEDY_BLIND),
        (frozen, "{}: it is frozen", "check its driver; a simulated scanner needs noise"),
    ):
        share = reasons.total() / len(scans)
        if share > _SELDOM:
            why = words.format(reasons.most_common(1)[0][0])
            text = f"{topic}: in {reasons.total()} of {counted(len(scans), 'scan')}, {why}"
            severity: Severity = "error" if share > _OFTEN else "warning"
            found.append(Finding(severity, "scanners", text, remedy))
    few = refused.total() + blind.total() + frozen.total()
    text = f"{topic}: {counted(len(scans), 'scan')}, {few or 'none'} blind, frozen or refused"
    return found or [Finding.fine("scanners", text)]


def _odometry_findings(
    topic: str, odometry: Sequence[Odometry], recording: _Recording
) -> list[Finding]:
    """Return what is wrong with the odometry of one topic, or that nothing is."""
    frames = Frames(odometry[0].header.frame_id.lstrip("/") or "odom", recording.base)
    problems = odometry_problems(odometry, recording.transforms, recording.static, frames=frames)
    if problems:
        return [
            Finding.error("odometry", f"{topic}: {text.removeprefix('odometry: ')}")
            for text in problems
        ]
    text = f"{topic}: no contradiction to tf or itself in {counted(len(odometry), 'message')}"
    found = [Finding.fine("odometry", text)]
    if odometry[0].child_frame_id.lstrip("/") in ("", recording.base):
        found += _brake_findings(topic, odometry)
    return found


def _brake_findings(topic: str, odometry: Sequence[Odometry]) -> list[Finding]:
    """Return what the robot file may say of the brakes, if the robot has braked."""
    found = brakings(odometry)
    if not found:
        return []
    hard_mps2 = [each.deceleration_mps2 for each in found]
    off_deg = math.degrees(max(each.off_rad for each in found))
    text = (
        f"{topic}: the robot braked {counted(len(found), 'time')}, by {min(hard_mps2):.1f} to "
        f"{max(hard_mps2):.1f} m/s², and turned up to {off_deg:.0f}° off the curve that it was on"
    )
    if off_deg <= _ON_CURVE_DEG:
        return [Finding.fine("brakes", f"{text}: brakes_on_curve: true held here")]
    remedy = (
        "a robot file must not say brakes_on_curve: true, and the policy needs a turn_deg of at "
        f"least {off_deg:.0f}"
    )
    return [Finding("fine", "brakes", text, remedy)]
