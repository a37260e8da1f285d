"""``awarenav estimate``: people in pictures from anywhere, one line a frame."""

from __future__ import annotations

import contextlib
import sys
import time
from dataclasses import dataclass, field
from typing import Final

from tqdm import tqdm

from nav_adapter import NavError
from perception import PerceptionError
from tracking import TrackingError

from .._errors import SimError
from ._estimate_records import estimate_record
from ._frame_estimate import FrameEstimate
from ._overlay_file import OverlayFile
from ._people_estimator import PeopleEstimator
from ._read_ahead import ReadAhead
from ._results_file import ResultsFile
from ._source_frame import SourceFrame
from ._write_behind import WriteBehind

# What goes wrong with one frame; everything else ends the run.
_FRAME_ERRORS: Final = (PerceptionError, SimError, TrackingError, NavError)
# When not one of so many frames could be estimated, none will be.
_HOPELESS: Final = 10
_SAID: Final = 5


@dataclass(slots=True)
class EstimateSummary:
    """What came of a run.

    Attributes:
        frames: estimated.
        people: observations in them.
        without_evidence: of these, those without an α.
        problems: of frames that could not be read or estimated.
        duration_s: of the run.
    """

    frames: int = 0
    people: int = 0
    without_evidence: int = 0
    problems: list[str] = field(default_factory=list)
    duration_s: float = 0.0

    def count(self, estimate: FrameEstimate) -> None:
        """Take one frame into account."""
        self.frames += 1
        self.people += len(estimate.observations)
        self.without_evidence += sum(each.awareness is None for each in estimate.observations)


def run_estimate(
    frames: ReadAhead,
    estimator: PeopleEstimator,
    results: ResultsFile,
    mark: str,
    *,
    overlay: OverlayFile | None = None,
    total: int | None = None,
    progress: bool = True,
) -> EstimateSummary:
    """Estimate every frame, write its line and draw it; reading and drawing run beside.

    A frame that cannot be read or estimated is named on standard error and has no line. The caller
    closes ``frames``, ``results`` and ``overlay``; what was done up to an error or Ctrl-C is whole.

    Args:
        frames: of the source.
        estimator: of people.
        results: where lines go; frames that are in it already are left out.
        mark: of the settings.
        overlay: where drawn pictures go.
        total: for the progress bar, if it is known.
        progress: shows the bar.

    Raises:
        SimError: when no frame at all could be estimated, saying why.
    """
    summary = EstimateSummary()
    start_s = time.monotonic()
    with contextlib.ExitStack() as stack:
        bar = stack.enter_context(
            tqdm(total=total, desc="estimate", unit="frame", file=sys.stderr, disable=not progress)
        )
        drawing = None
        if overlay is not None:
            drawing = stack.enter_context(WriteBehind[FrameEstimate](overlay.add))
        for frame in frames:
            bar.update()
            if frame.name in results.done:
                continue
            estimate = _estimate(frame, estimator, summary)
            if estimate is None:
                continue
            results.add(estimate_record(estimate, mark))
            summary.count(estimate)
            if drawing is not None:
                drawing.put(estimate)
    summary.duration_s = time.monotonic() - start_s
    if summary.problems and not summary.frames and not results.done:
        raise SimError(f"nothing could be estimated: {summary.problems[0]}")
    return summary


def _estimate(
    frame: SourceFrame, estimator: PeopleEstimator, summary: EstimateSummary
) -> FrameEstimate | None:
    problem = frame.problem
    if frame.image_rgb is not None:
        try:
            return estimator.estimate(frame)
        except _FRAME_ERRORS as error:
            problem = f"frame {frame.name}: {error}"
            if not summary.frames and len(summary.problems) + 1 >= _HOPELESS:
                raise SimError(
                    f"not one of the first {_HOPELESS} frames could be estimated: {problem}"
                ) from error
    summary.problems.append(problem)
    if len(summary.problems) <= _SAID:
        say(problem)
    elif len(summary.problems) == _SAID + 1:
        say("more frames with problems are counted, not named")
    return None


def say(text: str) -> None:
    """Tell the user something beside the progress bar."""
    tqdm.write(f"awarenav estimate: {text}", file=sys.stderr)
