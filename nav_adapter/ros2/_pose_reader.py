"""Odometry and tf messages of the bridge: checked against the clock, and stored."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

from .._errors import NavError
from ._clock import CLOCK_TOLERANCE_S, BridgeClock, InputKind
from ._outgoing import Frames
from ._poses import RobotPoses
from .conversions import to_seconds
from .messages.geometry_msgs import TransformStamped
from .messages.nav_msgs import Odometry
from .messages.tf2_msgs import TFMessage


class PoseReader:
    """Stores odometry and transforms. One thread at a time may use it.

    Args:
        poses: takes them.
        clock: of the bridge.
        odom_frame: name of the fixed frame.
        warn: called with each problem.
        with_map: whether the pose of odom in a map is needed. Localisation stamps it ahead on
            purpose; the latest one then holds until the next.
    """

    def __init__(
        self,
        poses: RobotPoses,
        clock: BridgeClock,
        odom_frame: str,
        warn: Callable[[str], object],
        *,
        with_map: bool,
    ) -> None:
        self._poses, self._clock, self._odom_frame = poses, clock, odom_frame
        self._warn, self._with_map = warn, with_map
        self._ahead: set[InputKind] = set()

    def read_transforms(
        self, message: TFMessage, now_s: float | None, *, static: bool = False
    ) -> None:
        """Store the transforms of /tf or /tf_static.

        Args:
            message: the transforms.
            now_s: the present time; None to check no stamps.
            static: whether they hold at all times; their stamps are then not looked at.
        """
        for each in message.transforms:
            to_odom = each.child_frame_id.lstrip("/") == self._odom_frame
            timeless = static or (to_odom and self._with_map)
            if not timeless and self._is_future_transform(each, now_s):
                continue
            try:
                self._poses.add_transform(each, static=timeless)
            except NavError as problem:
                self._warn(f"tf: {problem}")

    def read_odometry(self, message: Odometry, now_s: float | None) -> None:
        """Store the robot's state and pose.

        Args:
            message: in the odom frame.
            now_s: the present time; None to check no stamp.
        """
        if message.header.frame_id.lstrip("/") != self._odom_frame:
            self._warn(
                f"odometry must be in frame {self._odom_frame!r}, got "
                f"{message.header.frame_id!r}: ignored"
            )
            return
        if self._is_future("odometry", to_seconds(message.header.stamp), now_s):
            return
        before = self._poses.problem
        try:
            self._poses.add_odometry(message)
            problem = self._poses.problem
        except NavError as refused:
            problem = str(refused)
        if problem and problem != before:
            self._warn(f"odometry: {problem}")

    def drop_future(self, now_s: float) -> None:
        """Forget what is from the future and would shut out good messages until then."""
        state = self._poses.state
        if state is not None and self._is_future("odometry", state.stamp_s, now_s):
            self._poses.state = None
        self._poses.drop_after(now_s + CLOCK_TOLERANCE_S)

    def forget(self) -> None:
        """Forget all but static transforms, and which problems have been reported."""
        self._poses.forget()
        self._ahead.clear()

    def _is_future(self, kind: InputKind, stamp_s: float, now_s: float | None) -> bool:
        """Return whether a message is from the future; it is then counted."""
        refusal = None if now_s is None else self._clock.refusal(kind, stamp_s, now_s)
        # A sender that is always ahead must not flood the terminal: the diagnostics have the count.
        if refusal is not None and kind not in self._ahead:
            self._ahead.add(kind)
            self._warn(f"{kind}: the {refusal}: refused and counted, without further warnings")
        return refusal is not None

    def _is_future_transform(self, message: TransformStamped, now_s: float | None) -> bool:
        stamp_s = to_seconds(message.header.stamp)
        if message.child_frame_id.lstrip("/") == self._odom_frame and now_s is not None:
            # Localisation stamps map -> odom ahead on purpose, and it is not needed here.
            return stamp_s > self._clock.read(now_s) + CLOCK_TOLERANCE_S
        return self._is_future("transforms", stamp_s, now_s)


def odometry_problems(
    odometry: Iterable[Odometry],
    transforms: Iterable[TFMessage] = (),
    static_transforms: Iterable[TFMessage] = (),
    *,
    frames: Frames | None = None,
) -> tuple[str, ...]:
    """Return in words what the bridge would find wrong with a recording's odometry and tf.

    For example that they contradict each other, or that the odometry is in another frame.

    Args:
        odometry: all messages of its topic.
        transforms: all messages of /tf.
        static_transforms: all messages of /tf_static.
        frames: names of the frames.

    Returns:
        Each problem once, in the order of their first sight; none if nothing is wrong.
    """
    named = frames or Frames()
    problems: dict[str, None] = {}
    poses = RobotPoses(named, None)
    reader = PoseReader(poses, BridgeClock(), named.odom, problems.setdefault, with_map=False)
    for message in static_transforms:
        reader.read_transforms(message, None, static=True)
    moving = [
        (to_seconds(each.header.stamp), 0, partial(reader.read_transforms, TFMessage((each,))))
        for message in transforms
        for each in message.transforms
    ]
    driven = [
        (to_seconds(each.header.stamp), 1, partial(reader.read_odometry, each)) for each in odometry
    ]
    for _, _, read in sorted([*moving, *driven], key=lambda entry: entry[:2]):
        read(None)
    return tuple(problems)
