"""A belief that a person has noticed the robot, from the looks of the last seconds.

α(t) tells whether somebody looks now; a person who has looked for half a second knows of the robot
for some seconds more. The belief is a lower bound of the probability of that, 1 − exp(−looks / τ),
where looks is the time in which the person has looked, each frame with a weight of how certain it
is that α is at least a half, and more than that of somebody who looks where they walk. While
frames show the person without a look, looks decays. A further look never lowers the belief.

A look is no promise: people often look before they set off. The belief predicts that they keep to
the motion that they had as they looked, or slow down. The speed by which they depart from that is
theirs at once (:func:`departed_mps`). Two things end the belief, until there are new looks:

- doubt whether this is the person who looked: an ambiguous match, unless the rival has noticed the
  robot as well; a place that jumps; a gap in what the other sensors see, once no look is recent;
  cameras that have fallen silent, since nobody would see a face that looks away;
- setting off: a departure beyond the bound of what the belief predicts. It allows more the longer
  somebody has looked who looks still.

Nothing else ends it at once: :func:`aware_for_s` says for how long it lasts at least, which falls
by a second per second. It is over ``noticed_memory_s`` after the last look, and 1.5 s after a face
that looks away for 0.1 s: who passes a robot looks ahead.
"""

from __future__ import annotations

import math
from typing import Final

from perception.awareness import AttentionCone

from ._match import Match, Sight
from ._person import Track
from ._sensors import Sensors
from ._state import State, Step, absence_s, face_period_s
from .awareness_filter import EVIDENCE_GAP_S, grace_s, logit
from .clock import GAP_PERIODS, FrameClock
from .people import AVERTED_AWARENESS, AVERTED_LEFT_S, NOTICING_S, WALKING_MPS

# Time constant with which looks decay while the person is seen without a look.
_FORGETTING_S: Final = 3.0
# A belief of a half rests on so many looks.
_HALF_S: Final = 0.5
# A frame is a look if it is so certain, from 0 to 1, that α is at least that of no look: by 0.7 σ.
_LOOK: Final = 0.5
# Somebody who looks along their way shows so much less than such a gaze by chance, in σ.
_BY_CHANCE_SIGMAS: Final = 2.5
# Somebody who walks has a robot right ahead within this angle of their way: as far as a gaze that
# rests on something may be off it.
_AHEAD_TAN: Final = math.tan(math.radians(10.0))
_CONE: Final = AttentionCone()
# α of a face that looks away is low, and below a half by one standard deviation.
_AVERTED_SIGMAS: Final = -1.0
_AVERTED_LOGIT: Final = logit(AVERTED_AWARENESS)
# One frame may be wrong about a face, and two are not both by chance.
_AVERTED_S: Final = 0.09
# Somebody departs from their motion beyond 99 % (χ², two degrees). People who keep to it sway:
# 0.15 m/s is the bound of that.
_DEPARTED_CHI2: Final = 9.21
_SWAY_STD_MPS: Final = 0.15 / math.sqrt(_DEPARTED_CHI2)
# Time constant with which the motion of somebody who looks becomes the one that they keep to.
_KEEPING_S: Final = 2.0


def remembers(sensors: Sensors) -> bool:
    """Return whether looks are remembered: it takes another sensor to tell who it is since then."""
    lasts = sensors.config.awareness.noticed_memory_s > 0.0
    return lasts and len(sensors.faces) < len(sensors.all)


def held(track: Track, stamp_s: float, clocks: tuple[FrameClock, ...], sensors: Sensors) -> bool:
    """Return whether a sensor without faces has seen a person without a gap."""
    for sensor, clock, seen_s in zip(sensors.all, clocks, track.seen_s, strict=True):
        if sensor.settings.sees_faces or clock.period_s == math.inf:
            continue
        if stamp_s - seen_s <= GAP_PERIODS * clock.period_s:
            return True
    return False


def noticed(track: Track, stamp_s: float, state: State, sensors: Sensors) -> float:
    """Return the lower bound, in [0, 1], of the probability that a person has noticed the robot.

    It is 0 for tentative tracks, and where the latest look is no longer recent and no other sensor
    sees the person.
    """
    config, age_s = sensors.config.awareness, stamp_s - track.look_s
    if track.looked_s <= 0.0 or not track.confirmed or age_s > config.noticed_memory_s:
        return 0.0
    if _cameras_are_silent(stamp_s, state.faces):
        return 0.0
    period_s = face_period_s(track, state.faces, state.clocks, sensors)
    if age_s > grace_s(period_s, config) and not held(track, stamp_s, state.clocks, sensors):
        return 0.0
    return -math.expm1(-track.looked_s / NOTICING_S)


def aware_for_s(track: Track, stamp_s: float, state: State, sensors: Sensors) -> float:
    """Return for how long a belief of a half lasts at least, if the person keeps to their motion.

    It is infinite where nothing is remembered: awareness is then what the latest frames show.
    """
    if not remembers(sensors):
        return math.inf
    if noticed(track, stamp_s, state, sensors) < 0.5:
        return 0.0
    left_s = sensors.config.awareness.noticed_memory_s - (stamp_s - track.look_s)
    fades_s = _FORGETTING_S * math.log(max(track.looked_s / _HALF_S, 1.0))
    # The next picture may show no look, and then stands for the time since the last one.
    return max(min(left_s, fades_s - _since_pictured_s(track, stamp_s)), 0.0)


def departed_mps(track: Track) -> float:
    """Return the speed by which a person departs from keeping to their motion or slowing down."""
    if track.looked_s <= 0.0:
        return 0.0
    x, y = _nearest_kept(track)
    return math.hypot(track.vx - x, track.vy - y)


def remember_looks(tracks: list[Track], match: Match, step: Step) -> None:
    """Take a frame into the looks of the tracks: new tracks last, with the frame's measurements."""
    shared = _shared_with_rivals(tracks, match)
    for row, (track, sight) in enumerate(zip(tracks, match.sights, strict=True)):
        look = _look(track, sight, step)
        if row in shared:
            track.looked_s, track.look_s = shared[row]
        if look > 0.0 or track.looked_s > 0.0:
            _remember(track, sight, look, step)


def _remember(track: Track, sight: Sight | None, look: float, step: Step) -> None:
    """Take a frame into the looks of one person, who looks at the robot by ``look`` in [0, 1]."""
    stamp, faces, looking = step.frame.stamp_s, step.earlier.faces, look > 0.0
    config, sees_faces = step.config.awareness, step.sensor.settings.sees_faces
    dt_s = _since_pictured_s(track, stamp) if sees_faces else 0.0
    period_s = face_period_s(track, faces, step.state.clocks, step.sensors)
    since_s = stamp - track.look_s
    if looking:
        track.averted_s = 0.0
    elif sees_faces and _looks_away(sight):
        track.averted_s += min(dt_s, step.dt_s)
    doubtful = sight is not None and sight.jumped
    averted = track.averted_s > _AVERTED_S
    if (
        doubtful
        or since_s > config.noticed_memory_s
        or _cameras_are_silent(stamp, faces)
        or _is_interrupted(track, sight, period_s, looking, step)
        or _sets_off(track, since_s)
    ):
        track.looked_s = 0.0
    if averted and track.looked_s > 0.0:
        track.look_s = min(track.look_s, stamp - config.noticed_memory_s + AVERTED_LEFT_S)
    _slow_down(track)
    if not sees_faces or sight is None:
        return
    track.pictured_s = stamp
    if not looking:
        # What is believed already lasts for as long as was said.
        against_s = dt_s * look if track.looked_s < _HALF_S else 0.0
        track.looked_s = max(track.looked_s * math.exp(-dt_s / _FORGETTING_S) + against_s, 0.0)
        return
    if track.looked_s <= 0.0:
        track.kept_mps = (track.vx, track.vy)
    if not (doubtful or sight.ambiguous):
        # A look after a pause stands for one frame, not for the pause. Of two cameras, it stands
        # for the time since the last look of either.
        follows = since_s <= EVIDENCE_GAP_S
        stands_for_s = min(sight.stands_for_s, EVIDENCE_GAP_S)
        track.looked_s += look * min(stands_for_s, since_s if follows else period_s)
    track.look_s = stamp
    share = -math.expm1(-dt_s / _KEEPING_S)
    x, y = track.kept_mps
    track.kept_mps = (x + share * (track.vx - x), y + share * (track.vy - y))


def _since_pictured_s(track: Track, stamp_s: float) -> float:
    """Return the time since a picture of any camera last showed a person, up to that of a gap."""
    return min(stamp_s - track.pictured_s, EVIDENCE_GAP_S)


def _cameras_are_silent(stamp_s: float, faces: FrameClock) -> bool:
    """Return whether no camera has sent a frame for so long that nobody would see a face."""
    if faces.stamp_s is None:
        return True
    return stamp_s - faces.stamp_s > absence_s(faces.known_period_s)


def _shared_with_rivals(tracks: list[Track], match: Match) -> dict[int, tuple[float, float]]:
    """Return looks and the stamp of the latest one that are left to tracks of ambiguous matches.

    If two people may have been exchanged, what holds for both holds for each of them still.
    """
    shared: dict[int, tuple[float, float]] = {}
    for row, rival in match.rivals:
        looked_s, look_s = shared.get(row, (tracks[row].looked_s, tracks[row].look_s))
        if rival < 0:
            shared[row] = (0.0, look_s)
            continue
        other = tracks[rival]
        look_s = min(look_s, other.look_s) if other.look_s > -math.inf else look_s
        shared[row] = (min(looked_s, other.looked_s), look_s)
    for row, sight in enumerate(match.sights):
        if sight is not None and sight.ambiguous and row not in shared:
            shared[row] = (0.0, tracks[row].look_s)
    return shared


def _look(track: Track, sight: Sight | None, step: Step) -> float:
    """Return, in [−1, 1], how certainly the frame shows a person who looks at the robot.

    Below 0 it shows, as certainly, less than a gaze along the way, but not surely another gaze:
    where somebody does look along it, both come by chance, and are of no weight together.
    """
    if sight is None or sight.evidence is None or not step.sensor.settings.sees_faces:
        return 0.0
    if sight.by_ray or sight.given.weak or not track.confirmed:
        return 0.0
    # In standard deviations above the α of no look; 2 Φ(σ) − 1.
    (mean, variance), least = sight.evidence, _no_look_logit(track, step)
    sigmas = (mean - least) / math.sqrt(variance)
    certainty = math.erf(math.sqrt(0.5) * sigmas)
    by_chance = least > 0.0 and sigmas >= -_BY_CHANCE_SIGMAS
    return certainty if certainty >= _LOOK or (certainty <= -_LOOK and by_chance) else 0.0


def _no_look_logit(track: Track, step: Step) -> float:
    """Return logit(α) up to which a face is no look: 0, or that of a gaze along the person's way.

    Whoever walks looks where they go, which faces a robot beside the way, too. One right ahead is
    what they see.
    """
    vx, vy = track.vx, track.vy
    x, y = step.place_m[0] - track.x, step.place_m[1] - track.y
    fastest_mps = track.speed_mps + math.sqrt(max(track.p22, track.p33))
    if fastest_mps < WALKING_MPS or abs(x * vy - y * vx) <= _AHEAD_TAN * (x * vx + y * vy):
        return 0.0
    along_way = _CONE.score_of((0.0, 0.0, 0.0), (vx, vy, 0.0), (x, y, 0.0))
    return max(logit(along_way), 0.0) if along_way > 0.0 else 0.0


def _looks_away(sight: Sight | None) -> bool:
    """Return whether the frame shows a face that looks away."""
    if sight is None or sight.evidence is None:
        return False
    mean, variance = sight.evidence
    return mean <= _AVERTED_LOGIT and mean <= _AVERTED_SIGMAS * math.sqrt(variance)


def _is_interrupted(
    track: Track, sight: Sight | None, period_s: float, looking: bool, step: Step
) -> bool:
    """Return whether no look is recent, and there was a gap before this frame.

    After a gap nobody knows that it is the same person; a new look excuses motion alone.
    """
    config = step.config.awareness
    known_s = period_s if period_s < math.inf else 0.0
    longest_s = max(EVIDENCE_GAP_S, GAP_PERIODS * known_s)
    recent_s = longest_s if looking else grace_s(period_s, config)
    if track.look_s >= step.frame.stamp_s - recent_s:
        return False
    # By the sightings before this frame: it must not close a gap.
    if sight is not None:
        return not sight.held
    return not held(track, step.frame.stamp_s, step.state.clocks, step.sensors)


def _nearest_kept(track: Track) -> tuple[float, float]:
    """Return the velocity nearest to a person's among those from the one they keep to down to 0."""
    x, y = track.kept_mps
    share = (x * track.vx + y * track.vy) / max(x * x + y * y, 1e-9)
    share = min(max(share, 0.0), 1.0)
    return share * x, share * y


def _sets_off(track: Track, since_s: float) -> bool:
    """Return whether a person departs from their motion by more than a belief in looks allows."""
    looks = track.looked_s / NOTICING_S if since_s <= EVIDENCE_GAP_S else 0.0
    sway_mps = _SWAY_STD_MPS * (1.0 + looks)
    return track.velocity_chi2(_nearest_kept(track), sway_mps) > _DEPARTED_CHI2


def _slow_down(track: Track) -> None:
    """Lower the speed that a person keeps to where theirs is surely lower: they may have halted."""
    x, y = track.kept_mps
    kept_mps = math.hypot(x, y)
    most_mps = track.speed_mps + 2.0 * math.sqrt(max(track.p22, track.p33))
    if kept_mps > most_mps:
        share = most_mps / kept_mps
        track.kept_mps = (share * x, share * y)
