"""Crossings made from formulas, whose measures are known."""

from __future__ import annotations

import math

import numpy as np
from shapely.geometry import Point, Polygon
from shapely.ops import nearest_points

from nav_adapter import NavConstraints, RobotState
from nav_adapter.rigid import Motion
from sim_tests import NOVA_CARTER, CrossingFrame, CrossingResult
from sim_tests.crossing._separations import AWAY, Approach, ContactEvent, margins_m, moves
from sim_tests.crossing._stage import TrueView
from tracking import PersonTrack

BODY_RADIUS_M = 0.30
FAR = (1000.0, 0.0, 0.5, -0.5)  # where the bodies of people who are away are put, and how they move
ALONG_M, ACROSS_M = 0.3625, 0.25  # half the robot's length and width


def footprint_at(position, heading, footprint_m=NOVA_CARTER.footprint_m):
    cos, sin = math.cos(heading), math.sin(heading)
    turn = np.array([[cos, -sin], [sin, cos]])
    return Polygon(footprint_m @ turn.T + np.asarray(position))


def track_at(position, awareness, lower, ident=1, t_s=0.0):
    return PersonTrack(
        id=ident,
        stamp_s=t_s,
        status="confirmed",
        position_odom_m=np.asarray(position, dtype=float),
        velocity_odom_mps=np.zeros(2),
        covariance_odom=np.eye(4),
        awareness=awareness,
        awareness_std=0.1,
        awareness_lower=lower,
        height_m=1.75,
        time_since_seen_s=0.0,
    )


def crossing(
    times,
    robot,
    /,
    walks=(),
    *,
    awareness=None,
    looks=None,
    tracked=None,
    contacts=(),
    reached=True,
    alerts=None,
    constraints=None,
    footprint_m=NOVA_CARTER.footprint_m,
    **values,
):
    """A result whose frames follow formulas.

    ``robot(t)`` gives x, y, heading, forward speed, and perhaps the speed to the left and the yaw
    rate; each of ``walks``, of t, gives x, y, vx, vy, or None while away; ``awareness(t, person)``
    the true α, ``looks(t, person)`` whether they look at the robot, ``tracked(t, person)`` α and
    lower bound or None; ``constraints(t)`` fields of the constraints.
    """
    frames, looked_s = [], {}
    for t in np.asarray(times).tolist():
        x, y, heading, *velocity = robot(t)
        speed, yaw_rate = velocity[0], velocity.pop() if len(velocity) == 3 else 0.0
        state = RobotState(
            t,
            np.array([x, y]),
            heading,
            speed,
            yaw_rate,
            velocity_base_mps=None if len(velocity) == 1 else np.array(velocity),
        )
        outline = footprint_at((x, y), heading, footprint_m)
        views, tracks, approaches = [], [], []
        for index, person in enumerate(walks):
            away = (now := person(t)) is None
            px, py, vx, vy = FAR if away else now
            if looks is not None and not away and looks(t, index):
                looked_s[index] = t
            true = 0.0 if awareness is None or away else awareness(t, index)
            views.append(
                TrueView(
                    np.zeros(3),
                    np.array([0.0, 0.0, 1.0]),
                    true,
                    np.array([px, py]),
                    np.array([vx, vy]),
                    not away,
                    away,
                    t - looked_s.get(index, -math.inf),
                    index in looked_s,
                )
            )
            said = None if tracked is None or away else tracked(t, index)
            if said is not None:
                tracks.append(track_at((px + 0.1, py), *said, ident=index + 1, t_s=t))
            approaches.append(AWAY if away else approach_of(state, outline, (px, py), (vx, vy)))
        robot_moves = moves(Motion.of(state), NOVA_CARTER)
        given = {
            "obstacles": (),
            "limited_by": "nothing",
            "alerts": () if alerts is None else alerts(t),
            **({} if constraints is None else constraints(t)),
        }
        limits = NavConstraints(stamp_s=t, speed_limit_mps=1.5, stale=False, **given)
        frames.append(
            CrossingFrame(
                t_s=t,
                robot_state=state,
                known_state=state,
                T_odom_camera=np.eye(4),
                truth=tuple(views),
                observations=(),
                observed_workers=(),
                tracks=tuple(tracks),
                constraints=limits,
                command=(speed, 0.0),
                approaches=tuple(approaches),
                margins_m=tuple(margins_m(approaches, NOVA_CARTER, moves=robot_moves)),
                robot_moves=robot_moves,
            )
        )
    values = {
        "scenario": "made_up",
        "seed": 0,
        "policy": "balanced",
        "planner": "Formula",
        "perception": "truth",
        "contacts": tuple(contacts),
        "time_to_goal_s": frames[-1].t_s if reached else None,
        "frames": tuple(frames),
        **values,
    }
    return CrossingResult(**values)


def approach_of(state, outline, place, velocity):
    """The approach of an outline and a disc about a place."""
    centre = Point(place)
    point = nearest_points(outline, centre)[0]
    gap = np.array(place) - (state.position_odom_m if outline.contains(centre) else point.coords[0])
    x, y = (gap / max(np.linalg.norm(gap), 1e-9)).tolist()
    robot_mps = Motion.of(state).velocity_at(point.x, point.y)
    separation_m = max(outline.distance(centre) - BODY_RADIUS_M, 0.0)
    return Approach(separation_m, (x, y), robot_mps, velocity)


def contact(t_s, person, by, robot_mps):
    """A contact of a robot that drives in the direction of x, into somebody or away from them."""
    towards = (1.0 if by == "robot" else -1.0, 0.0)
    return ContactEvent(t_s, person, Approach(0.0, towards, (robot_mps, 0.0)))


def straight(speed_mps, start=(0.0, 0.0), heading=0.0):
    """A robot that drives straight on."""
    cos, sin = math.cos(heading), math.sin(heading)
    return lambda t: (
        start[0] + speed_mps * t * cos,
        start[1] + speed_mps * t * sin,
        heading,
        speed_mps,
    )


def walking(start, velocity):
    """A person who walks straight on."""
    return lambda t: (start[0] + velocity[0] * t, start[1] + velocity[1] * t, *velocity)
