"""The work of ``awarenav doctor``."""

from __future__ import annotations

import contextlib
import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from perception import AttentionCone, Camera, PerceptionError
from perception.evidence import AwarenessReason
from perception.named import NetworkChoice
from perception.picture_notes import picture_notes
from perception.shipped import simulator_networks, simulator_networks_warning
from perception.turn import QuarterTurn

from ..errors import AwarenavError, counted
from ..estimate import (
    CameraChoice,
    FrameEstimate,
    ImageSource,
    OverlayWriter,
    PeopleEstimator,
    SourceFrame,
    choice_of_options,
    is_recording,
    open_source,
    running_options,
)
from ..files import json_text
from ._findings import Finding, Severity, by_importance, findings_text
from ._installation import installation_findings
from ._pictures import PictureFigures, picture_figures, picture_findings

# Rates of the method's paper, and below which a frame is too old to prove awareness when the next
# one comes (`timing.fresh_within_s` of the policies).
_WANTED_HZ: Final = 20.0
_LEAST_HZ: Final = 4.0
# The first frames warm up caches and networks.
_WARM_UP: Final = 2
# Width of a face, the pixels across it below which awareness is uncertain, and the range up to
# which a robot should see them.
_FACE_M: Final = 0.15
_FACE_PX: Final = 20.0
_FACE_RANGE_M: Final = 3.0
# Why a head that moves, or is dark, has no awareness, and the share of people from which on it is
# the camera's fault: in sharp pictures one in twenty has it.
_UNKNOWN: Final[AwarenessReason] = "head direction unknown"
_UNKNOWN_SHARE: Final = 0.2
# A principal point farther from the middle, as a share of the width, is unusual.
_OFF_CENTRE: Final = 0.1
# Images that are looked at in all turns, and how many times the people of the picture as it is, and
# how many more, a turned one must show.
_TURNED_IMAGES: Final = 8
_TURNED_TIMES, _TURNED_MORE = 1.5, 1
_TURN_WORDS: Final = (
    "",
    "by 90 degrees counter-clockwise",
    "upside down",
    "by 90 degrees clockwise",
)
_REMEDY_NETWORKS: Final = "awarenav models fetch real"
_FASTER_CAMERA: Final = "a higher rate of the camera's driver; no network changes it"
_FASTER_NETWORKS: Final = (
    "--detect-every-s 0.15; smaller networks, a GPU (--provider), or another computer"
)


@dataclass(slots=True)
class _Examined:
    """Figures and findings of the images of a source."""

    stamps_s: list[float] = field(default_factory=list)
    figures: list[PictureFigures] = field(default_factory=list)
    times_s: list[float] = field(default_factory=list)
    people: list[int] = field(default_factory=list)
    without_evidence: Counter[AwarenessReason | None] = field(default_factory=Counter)
    problems: list[str] = field(default_factory=list)
    best: FrameEstimate | None = None
    #: People found in some of the images, by the quarter turns of the picture.
    by_turn: Counter[QuarterTurn] = field(default_factory=Counter)
    turned: int = 0


def doctor_command(options: Any) -> int:
    """Print the findings; return the exit status: 1 if there are errors.

    Args:
        options: of the command line, as attributes.

    Raises:
        AwarenavError: for a source, networks or options that cannot be used.
        PerceptionError: for a network or calibration that cannot be used.
    """
    findings = installation_findings()
    if options.source is not None:
        findings += _source_findings(options)
    ordered = by_importance(findings)
    errors = sum(each.severity == "error" for each in ordered)
    if options.as_json:
        print(json_text([asdict(each) for each in ordered]), end="")
    else:
        warnings = sum(each.severity == "warning" for each in ordered)
        print(findings_text(ordered))
        print(f"\n{counted(errors, 'error')}, {counted(warnings, 'warning')}")
    return 1 if errors else 0


def _source_findings(options: Any) -> list[Finding]:
    if not is_recording(Path(options.source)):
        return _image_findings(options)
    from ._recording import recording_findings  # noqa: PLC0415 - needs the extra rosbag

    findings, has_images = recording_findings(Path(options.source))
    if not has_images:
        return findings
    try:
        return findings + _image_findings(options)
    except (AwarenavError, PerceptionError) as problem:
        # What has been found of scanners and odometry is told all the same.
        return [*findings, Finding.error("images", str(problem))]


def _image_findings(options: Any) -> list[Finding]:
    with contextlib.closing(open_source(options.source, topic=options.topic)) as source:
        choice = choice_of_options(options, rendered=source.rendered)
        networks = choice.load(**running_options(options))
        unfit = () if source.rendered else simulator_networks(networks.training_domains)
        said: list[str] = []
        cameras = CameraChoice.of_options(options.camera, options.fov_deg, source, said.append)
        look = partial(PeopleEstimator, networks, cameras, unfit=unfit)
        seen = _examine(source, look, options.frames)
        findings = [
            _domain_finding(unfit, networks.training_domains, choice, rendered=source.rendered),
            *(Finding.error("images", note) for note in source.notes),
        ]
        if seen.problems:
            text = f"{counted(len(seen.problems), 'image')} of {options.frames}: {seen.problems[0]}"
            severity: Severity = "warning" if seen.figures else "error"
            findings.append(Finding(severity, "images", text))
        if seen.best is None:
            return findings
        findings += [
            _calibration_finding(
                seen.best.camera if cameras.calibrated else None, options, source, said
            ),
            *_mount_findings(source, seen),
            *_rate_findings(source, seen),
            *picture_findings(seen.figures),
            *(Finding.warning("images", note) for note in _notes(seen.best, source)),
            _resolution_finding(seen.best.camera, choice),
            *_people_findings(seen),
        ]
        if str(options.out) != "none":
            _draw(options.out, seen.best)
            findings.append(Finding.fine("people", f"test picture: {options.out}"))
        return findings


def _notes(best: FrameEstimate, source: ImageSource) -> tuple[str, ...]:
    image = best.frame.image_rgb
    return () if source.rendered or image is None else picture_notes(image)


def _examine(
    source: ImageSource, make_estimator: Callable[..., PeopleEstimator], most: int
) -> _Examined:
    """Look at some images, evenly chosen where all are there.

    Where nothing says which way is up, the first of them are looked at in all four turns.
    """
    seen, before = _Examined(), None
    estimator = make_estimator(up_camera=source.up_camera)
    others = {}
    if source.up_camera is None:
        turns = map(QuarterTurn, range(1, 4))
        others = {turn: make_estimator(up_camera=turn.up_camera) for turn in turns}
    for frame in _chosen(source, most):
        if frame.image_rgb is None:
            seen.problems.append(frame.problem)
            continue
        began = time.perf_counter()
        try:
            estimate = estimator.estimate(frame)
        except AwarenavError as error:
            seen.problems.append(f"frame {frame.name}: {error}")
            continue
        seen.times_s.append(time.perf_counter() - began)
        seen.stamps_s.append(frame.stamp_s)
        seen.figures.append(picture_figures(frame.image_rgb, before))
        before = frame.image_rgb
        people = estimate.observations
        if frame.T_odom_camera is None and seen.turned < _TURNED_IMAGES:
            seen.turned += bool(others)
            seen.by_turn[QuarterTurn(0)] += len(people)
            for turn, other in others.items():
                seen.by_turn[turn] += len(other.estimate(frame).observations)
        if seen.best is None or len(people) > len(seen.best.observations):
            seen.best = estimate
        seen.people.append(len(people))
        seen.without_evidence.update(
            each.awareness_reason for each in people if each.awareness is None
        )
    return seen


def _chosen(source: ImageSource, most: int) -> Iterator[SourceFrame]:
    """Yield the first frames of a film; of single images, some from all over."""
    count = source.count
    step = 1 if count is None or source.rate_hz is not None else max(count // most, 1)
    taken = 0
    for number, frame in enumerate(source.frames()):
        if taken >= most:
            return
        if number % step == 0:
            taken += 1
            yield frame


def _domain_finding(
    unfit: tuple[str, ...],
    domains: Mapping[str, str | None],
    choice: NetworkChoice,
    *,
    rendered: bool,
) -> Finding:
    if unfit:
        text = simulator_networks_warning(unfit)
        return Finding.error("networks", text, _REMEDY_NETWORKS)
    known = {
        role: f", {model.name} by {model.publisher}" for role, model in choice.catalogued().items()
    }
    told = "; ".join(
        f"{role} {domain or 'not known'}{known.get(role, '')}" for role, domain in domains.items()
    )
    kind = "renders" if rendered else "pictures that no renderer of this package made"
    if None in domains.values():
        return Finding.warning(
            "networks",
            f"trained on: {told}; the images are {kind}",
            "a network in `awarenav models list` is known by its checksum; any other can state its "
            "'training_domain' in its metadata",
        )
    return Finding.fine("networks", f"trained on: {told}; the images are {kind}")


def _mount_findings(source: ImageSource, seen: _Examined) -> list[Finding]:
    """Return that the camera is rolled: by what the source says, or else by the people found."""
    if source.up_camera is not None:
        turn = QuarterTurn.upright(source.up_camera)
        text = f"by tf the camera is rolled: pictures are turned {_TURN_WORDS[turn.quarters]}"
        return [Finding.fine("mount", text)] if turn.quarters else []
    upright = seen.by_turn[QuarterTurn(0)]
    for turn, people in seen.by_turn.most_common(1):
        if people > _TURNED_TIMES * upright + _TURNED_MORE:
            return [
                Finding.error(
                    "mount",
                    f"turned {_TURN_WORDS[turn.quarters]}, {counted(seen.turned, 'picture')} show "
                    f"{counted(people, 'person', 'people')}, and as they are {upright or 'none'}: "
                    "the camera is rolled, and nothing says so",
                    "tf of the optical frame, or roll_deg: "
                    f"{turn.roll_deg} of the camera in robot.yaml; files need turned pictures",
                )
            ]
    return []


def _calibration_finding(
    camera: Camera | None, options: Any, source: ImageSource, said: list[str]
) -> Finding:
    fov_deg = options.fov_deg
    if camera is None and fov_deg is None:
        return Finding.error(
            "calibration",
            said[0].partition("; give")[0],
            "--camera camera.yaml (ROS camera_calibration makes it), or at least --fov-deg",
        )
    if camera is None:
        return Finding.warning(
            "calibration",
            f"a horizontal field of view of {fov_deg:g} degrees, without lens distortion",
            "--camera camera.yaml (ROS camera_calibration makes it)",
        )
    across = math.degrees(2.0 * math.atan(0.5 * camera.width_px / camera.fx_px))
    off = abs(camera.cx_px - 0.5 * camera.width_px) / camera.width_px
    text = f"{camera.width_px} × {camera.height_px} pixels, {across:.0f} degrees across"
    if source.rectified:
        text += "; by the topic's name, the images are rectified: P applies, without distortion"
    elif is_recording(Path(str(options.source))):
        text += "; by the topic's name, the images are raw: K and distortion apply, and P is not"
        text += " used"
    if off > _OFF_CENTRE:
        return Finding.warning(
            "calibration",
            f"{text}; its principal point lies {100.0 * off:.0f} % of the width off centre",
            "was the picture cropped after the calibration?",
        )
    return Finding.fine("calibration", text)


def _rate_findings(source: ImageSource, seen: _Examined) -> list[Finding]:
    """Return the findings about the rate of the images, and of perception."""
    found = []
    steps_s = np.diff(seen.stamps_s)
    if (source.live or source.rate_hz is not None) and len(steps_s) and np.median(steps_s) > 0.0:
        found.append(
            _rate_finding(1.0 / float(np.median(steps_s)), "the images come at", _FASTER_CAMERA)
        )
        if (steps_s <= 0.0).any():
            text = "stamps do not advance, or go back"
            found.append(Finding.error("frame rate", text, "check the driver's clock"))
    if warm := seen.times_s[_WARM_UP:]:
        found.append(
            _rate_finding(1.0 / float(np.median(warm)), "perception manages", _FASTER_NETWORKS)
        )
    return found


def _rate_finding(rate_hz: float, words: str, remedy: str) -> Finding:
    text = f"{words} {rate_hz:.1f} images per second"
    if rate_hz < _LEAST_HZ:
        return Finding.error(
            "frame rate",
            f"{text}: nobody counts as aware below {_LEAST_HZ:g}",
            remedy,
        )
    if rate_hz < _WANTED_HZ:
        return Finding.warning(
            "frame rate",
            f"{text}; the method's paper has {_WANTED_HZ:g}",
            remedy,
        )
    return Finding.fine("frame rate", text)


def _resolution_finding(camera: Camera, choice: NetworkChoice) -> Finding:
    range_m = camera.fx_px * _FACE_M / _FACE_PX
    beyond = "α is less certain" if choice.face == "none" else "a face that is not found gives no α"
    text = f"faces have {_FACE_PX:g} pixels up to {range_m:.1f} m; beyond, {beyond}"
    if range_m < _FACE_RANGE_M:
        remedy = "a larger picture, or a narrower lens: awareness is uncertain beyond"
        return Finding.warning("resolution", text, remedy)
    return Finding.fine("resolution", text)


def _people_findings(seen: _Examined) -> list[Finding]:
    total, images = sum(seen.people), len(seen.people)
    if not total:
        return [
            Finding.warning(
                "people",
                f"nobody in {counted(images, 'image')}",
                "stand in front of the camera, 2 to 5 m away, and run it again",
            )
        ]
    with_people = sum(number > 0 for number in seen.people)
    reasons = seen.without_evidence
    text = (
        f"{counted(total, 'person', 'people')} in {with_people} of {counted(images, 'image')}, "
        f"{reasons.total()} of them without evidence of awareness"
    )
    if reasons:
        text += f" ({', '.join(f'{reason}: {n}' for reason, n in reasons.most_common())})"
    found = [Finding.fine("people", text)]
    unknown = reasons[_UNKNOWN]
    if unknown > _UNKNOWN_SHARE * total:
        found.append(
            Finding.warning(
                "people",
                f"{unknown} of {total} heads show no direction, because of motion blur or noise",
                "use a shorter exposure and more light",
            )
        )
    return found


def _draw(path: Path, estimate: FrameEstimate) -> None:
    with OverlayWriter(path, 1.0, AttentionCone(), single=True) as writer:
        writer.add(estimate)
