"""One step of the tracker, as a function from its state and a frame to its next state."""

from __future__ import annotations

import math
from typing import Final

from perception.matrices import CHI2_999

from ._frame import Frame
from ._match import Match, Sight, matched
from ._noticed import held, remember_looks, remembers
from ._person import Track
from ._presence import hit_evidence, is_beside, is_over, record_hit, record_misses
from ._sensors import Sensors
from ._size import RANGED_S, Taken, forget_size, learn_size, put_too_far
from ._state import State, Step, evidence_interval_s, face_period_s, seen_within
from .awareness_filter import EVIDENCE_GAP_S, drift, drift_unseen, forget, measure

# Factor on the variance of a place whose match is ambiguous. When two people pass each other, a
# wrong match would otherwise reverse both velocities.
_AMBIGUOUS_NOISE: Final = 2.0
# Networks of faces lose a small face for a few frames while the head keeps looking here. For this
# long after the last face, the belief stays as it is.
_MISSED_FACE_S: Final = 0.5


def advance(state: State, frame: Frame, sensors: Sensors) -> State:
    """Return the state after one more frame, whose stamp is not before the state's."""
    step = Step.of(frame, state, sensors)
    tracks = _predicted(step)
    match = matched(tracks, step)
    found = {
        track: (sight, *_correct(track, sight, step))
        for track, sight in zip(tracks, match.sights, strict=True)
        if sight is not None
    }
    beside = [not track.confirmed and is_beside(track, tracks, step) for track in found]
    for (track, (shown, distance2, log_det)), double in zip(found.items(), beside, strict=True):
        gain = hit_evidence(distance2, log_det, double, step)
        record_hit(track, gain, shown.stands_for_s, step)
    next_id = _give_birth(tracks, match, step)
    for track, sight in zip(tracks, match.sights, strict=True):
        _see_size(track, sight, step)
        _see_face(track, sight, step)
    if remembers(sensors):
        remember_looks(tracks, match, step)
    record_misses(tracks, step)
    gone = put_too_far(tracks, step)
    kept = [track for track in tracks if track.id not in gone] if gone else tracks
    fields = step.state.fields
    if step.view is None:
        people = [track for track in found if track.confirmed]
        index = frame.sensor
        field = fields[index].after(people, step)
        fields = (*fields[:index], field, *fields[index + 1 :])
    return step.state._replace(tracks=tuple(kept), next_id=next_id, fields=fields)


def _predicted(step: Step) -> list[Track]:
    """Return copies of the tracks at the frame's stamp, without those that have ended before it."""
    state, stamp, previous = step.state, step.frame.stamp_s, step.earlier.stamp_s
    if previous is None or stamp <= previous:
        return [track.copied() for track in state.tracks]
    tracks, clocks, sensors = [], step.clocks_before, step.sensors
    for track in state.tracks:
        # A track that the last frame has left alive gets a chance, however long the interval.
        if not is_over(track, stamp, clocks, sensors):
            moved = track.copied()
            moved.predict(previous, stamp, step.config.acceleration_density_m2ps3)
            tracks.append(moved)
    return tracks


def _correct(track: Track, sight: Sight, step: Step) -> tuple[float, float]:
    """Correct a track with its measurement; return the d² and ln det S of a tentative one."""
    taken, ray = sight.taken, sight.ray
    sight.stands_for_s = step.dt_s
    if step.is_second and track.seen_s[step.sensor.index] < step.frame.stamp_s:
        sight.stands_for_s = step.clock.interval_s
    origin, dx, dy = step.state.origin_m, taken.x - track.x, taken.y - track.y
    expected = track.spread_m2
    if origin is not None:
        taken.without_lasting(track, origin, step.state.origin_velocity_mps)
    if track.looked_s > 0.0:
        sight.held = held(track, step.frame.stamp_s, step.state.clocks, step.sensors)
        jump2 = expected.plus(taken.noise_m2).distance2_and_log_det(dx, dy)[0]
        sight.jumped = jump2 > CHI2_999 and not sight.by_ray
    found = (0.0, 0.0)
    if not track.confirmed:
        spread = track.spread_m2.plus(taken.noise_m2)
        if ray is not None and sight.by_ray:
            spread = spread.plus(ray.extra_m2)
        found = spread.distance2_and_log_det(dx, dy)
    # An ambiguous measurement has less weight and leaves more uncertainty.
    noise = taken.noise_m2
    if sight.ambiguous:
        noise = noise.times(_AMBIGUOUS_NOISE)
    if ray is not None:
        noise = ray.without_assumed_range(noise)
        # A place that jumps along the ray may be another person's.
        sight.ambiguous = sight.ambiguous or (sight.by_ray and ray.measures)
    if origin is not None:
        taken.pass_lasting(track, noise, origin)
    track.correct(taken.x, taken.y, noise)
    return found


def _give_birth(tracks: list[Track], match: Match, step: Step) -> int:
    """Append new tracks of the measurements that fit none, and return the next free id."""
    next_id = step.earlier.next_id
    for measured in match.new:
        tracks.append(Track(next_id, measured, step.frame, len(step.sensors.all)))
        match.sights.append(Sight(Taken(tracks[-1], measured, None), 0.0))
        next_id += 1
    return next_id


def _see_size(track: Track, sight: Sight | None, step: Step) -> None:
    """Take what a frame says of a person's size."""
    if sight is None:
        return
    if sight.ambiguous:
        forget_size(track)
    origin = step.state.origin_m
    if step.sensor.settings.measures_range or sight.ambiguous or sight.given.weak:
        return
    if origin is not None and sight.given.size_log is not None:
        ranged = seen_within(track, step.sensors.ranging, step.frame.stamp_s, RANGED_S)
        learn_size(track, sight.given, by_ray=sight.by_ray, ranged=ranged, origin_m=origin)


def _see_face(track: Track, sight: Sight | None, step: Step) -> None:
    """Take a frame into the awareness of a person.

    An ambiguous match may be another person's: the belief drifts as if unseen and is then reset to
    the prior, also by a sensor that sees no faces. A weak detection may be something else, and is
    no evidence. A face that matches by its ray alone may be that of somebody behind.
    """
    config, stamp = step.config.awareness, step.frame.stamp_s
    ambiguous = sight is not None and sight.ambiguous
    if step.sensor.settings.sees_faces:
        seen = sight is not None and not sight.given.weak and not ambiguous
        evidence = sight.evidence if sight is not None and seen else None
        if sight is not None and sight.by_ray and step.sensors.mixed:
            evidence = None
        previous_s = step.earlier.faces.stamp_s
        if previous_s is not None and stamp > previous_s:
            missed = sight is not None and sight.given.face_missed and not sight.by_ray
            _drift(track, previous_s, seen, evidence is not None, step, missed=missed)
        if evidence is not None:
            interval_s = evidence_interval_s(track, stamp, step.clock, step.sensors)
            belief = measure(track.belief, evidence, interval_s, config)
            if not track.confirmed:
                # It may be clutter: its evidence must never shrink an obstacle.
                belief = belief._replace(bound=track.belief.bound)
            # A second measurement at the same stamp may only lower the bound.
            again = previous_s is not None and stamp <= previous_s and track.face_s == stamp
            if not again or belief.bound < track.belief.bound:
                track.belief = belief
            track.face_s = stamp
    if ambiguous:
        track.belief = forget(track.belief, config)
        track.face_s = -math.inf


def _drift(
    track: Track, previous_s: float, seen: bool, face: bool, step: Step, *, missed: bool
) -> None:
    """Let a belief drift to the frame, from the one before that could have shown a face.

    ``missed``: the head is still turned here, and the network of faces has not found its face.
    """
    config, stamp = step.config.awareness, step.frame.stamp_s
    dt_s = stamp - previous_s
    if face and stamp - track.face_s <= EVIDENCE_GAP_S:
        # Two faces count for the time between them, missed frames included, unless it is long.
        track.belief = drift(track.belief, dt_s, config.evidence_time_constant_s, config)
    elif seen and missed and stamp - track.face_s <= _MISSED_FACE_S:
        pass  # the belief stays as it is
    elif seen and not face:
        track.belief = drift(track.belief, dt_s, config.no_face_time_constant_s, config)
        # A person without a face has not just been missed: that ends the grace.
        track.face_s = -math.inf
    else:
        period_s = face_period_s(track, step.earlier.faces, step.earlier.clocks, step.sensors)
        track.belief = drift_unseen(track.belief, previous_s, stamp, track.face_s, period_s, config)
