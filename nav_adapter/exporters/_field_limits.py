"""The limits of all rules for some people at some poses.

The formulas are those of :mod:`nav_adapter._separation` and of the speed governor, written for
large arrays: without copies where nothing differs, and differentiable.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from .._policy import AwarenessPolicy
from .._robot import RobotProfile
from ._field_arrays import ArrayLibrary
from ._field_people import PeopleAhead
from ._field_poses import FootprintGaps, Poses

# Added where a speed or a time of 0 would leave nothing to divide by; it only lowers a limit.
_SLOWEST_MPS: Final = 1e-9
# (gap in metres, share of the stopping distance that leads there or None for all of it)
_Bound = tuple[Any, Any]


class _Turn(NamedTuple):
    """The bound for people who have to turn to the robot, as in :mod:`nav_adapter._approach`."""

    acceleration_mps2: float
    delay_s: Any
    nearer_m: Any


class FieldLimits:
    """The limits that the rules of a policy set for people around a robot.

    Args:
        library: of the arrays.
        policy: the adapter's.
        robot: likewise.
        rounding_m: taken off every gap, for rounding.
        reach_m: the limits hold for every position within this distance of the poses' own.
    """

    def __init__(
        self,
        library: ArrayLibrary,
        policy: AwarenessPolicy,
        robot: RobotProfile,
        rounding_m: float,
        reach_m: float = 0.0,
    ) -> None:
        self._library = library
        self._rules = policy.rules
        self._clearance_m = policy.margins.separation_clearance_m
        self._unaware_mps = policy.speed.human_speed_mps(0.0)
        self._braking_mps2 = robot.max_deceleration_mps2
        self._maximum_mps = robot.max_speed_mps
        self._footprint = FootprintGaps(robot)
        self._circle_m: Final = self._footprint.radius_m + rounding_m + reach_m
        self._rounding_m = rounding_m
        self._reach_m = reach_m

    def of(self, people: PeopleAhead, poses: Poses) -> dict[str, Any]:
        """Return the limits (N, …) of people at poses, by the name of the rule.

        The arrays of the people must broadcast with (N, …) and those of the poses with (…).
        """
        library, rules = self._library, self._rules
        x, y = people.x - poses.x, people.y - poses.y
        distance_m = library.sqrt(x * x + y * y)
        track = (x, y, distance_m)
        places = [track]
        if people.track_x is not None:
            x, y = people.track_x - poses.x, people.track_y - poses.y
            track = (x, y, library.sqrt(x * x + y * y))
            places.append(track)
        bounds, ahead, held = self._bounds(people, poses, places)
        closing_mps = None if people.velocity_x_mps is None else self._closing_mps(people, track)
        human_mps = people.human_mps
        if closing_mps is not None and rules.protective_field is None:
            human_mps = library.maximum(
                self._turned_mps(people, track, *closing_mps[:2]), human_mps
            )
        turn = self._turn(people, closing_mps)
        limits = {"speed and separation": self._separation_mps(people, bounds, human_mps, turn)}
        if rules.zones is not None or rules.near_cap is not None:
            limits.update(self._distance_limits_mps(bounds))
        if people.reserved:
            limits["start reserve"] = self._reserve_mps(people, bounds, ahead, closing_mps, turn)
        if held is not None:
            beyond_mps = library.convert(2.0 * self._maximum_mps)
            limits = {
                rule: library.where(held, limit, beyond_mps) for rule, limit in limits.items()
            }
        if people.lost_mps is not None:
            lowest = None
            for limit in limits.values():
                lowest = limit if lowest is None else library.minimum(lowest, limit)
            return {"lost": library.maximum(lowest, people.lost_mps)}
        return limits

    def _bounds(
        self, people: PeopleAhead, poses: Poses, places: list[tuple[Any, Any, Any]]
    ) -> tuple[list[_Bound], Any, Any]:
        """Return the bounds on the way to people, and two things that follow from the heading.

        They are the share straight ahead that the start reserve counts, and whether people are in
        the path of a protective field; None for everybody.
        """
        library, held = self._library, None
        nearest_m = places[0][2]
        for _, _, distance_m in places[1:]:
            nearest_m = library.minimum(nearest_m, distance_m)
        margin_m = people.margin_m + poses.driven_m
        circle_m = nearest_m - (margin_m + self._circle_m)
        if poses.heading is None:
            return [(circle_m, None)], None, None
        cos, sin = poses.heading
        footprint_m, share, ahead = None, None, None
        for x, y, distance_m in places:
            forward_m, left_m = cos * x + sin * y, cos * y - sin * x
            gap_m = self._footprint.distance_m(library, forward_m, left_m)
            footprint_m = gap_m if footprint_m is None else library.minimum(footprint_m, gap_m)
            if poses.travel is None or poses.turn is None:
                continue
            along_m, across_m = poses.along(forward_m, left_m)
            cos_turn, sin_turn = poses.turn
            turned_m = along_m * cos_turn + abs(across_m) * sin_turn
            own = library.where(
                along_m < distance_m * cos_turn,
                library.at_least(turned_m, 0.0) / distance_m,
                library.convert(1.0),
            )
            share = own if share is None else library.maximum(share, own)
            if self._rules.protective_field is not None:
                beside_m = self._rules.protective_field.beside_m
                body_m = people.margin_m + 10.0 * self._rounding_m
                own = self._footprint.in_path(library, poses, along_m, across_m, body_m, beside_m)
                held = own if held is None else held | own
            if people.reserved:
                # The last place is that of the track, which this rule counts.
                ahead = library.at_least(along_m, 0.0) / distance_m
        gap_m = footprint_m - (margin_m + self._rounding_m)
        if share is None:
            bounds = [(gap_m, None)]
            if people.turn_delay_s is not None:
                bounds.append((circle_m, None))
            return bounds, None, None
        if ahead is not None and poses.stands is not None:
            ahead = library.where(poses.stands, library.convert(1.0), ahead)
        return [(gap_m, None), (circle_m, share)], ahead, held

    def _closing_mps(
        self, people: PeopleAhead, track: tuple[Any, Any, Any]
    ) -> tuple[Any, Any, Any]:
        """Return the speed towards the robot, that across, and the signed speed towards it."""
        x, y, distance_m = track
        velocity_x, velocity_y = people.velocity_x_mps, people.velocity_y_mps
        closing_mps = -(velocity_x * x + velocity_y * y) / distance_m
        across_mps = None
        if people.turn is not None:
            across_mps = abs(velocity_x * y - velocity_y * x) / distance_m
        signed_mps = closing_mps
        if self._reach_m > 0.0:
            # The robot may be in a direction that differs by this sine.
            walking_mps = self._library.sqrt(velocity_x * velocity_x + velocity_y * velocity_y)
            closing_mps = self._library.at_least(closing_mps, 0.0)
            closing_mps = closing_mps + walking_mps * (self._reach_m / distance_m)
            closing_mps = self._library.minimum(closing_mps, walking_mps)
            signed_mps = signed_mps + 2.0 * walking_mps * (self._reach_m / distance_m)
            signed_mps = self._library.minimum(signed_mps, walking_mps)
        return closing_mps, across_mps, signed_mps

    def _turned_mps(
        self, people: PeopleAhead, track: tuple[Any, Any, Any], closing_mps: Any, across_mps: Any
    ) -> Any:
        """Return the speed towards the robot of brisk walkers who turn to it."""
        if people.turn is None:
            return closing_mps
        library, (cos, sin) = self._library, people.turn
        velocity_x, velocity_y = people.velocity_x_mps, people.velocity_y_mps
        walking_mps = library.sqrt(velocity_x * velocity_x + velocity_y * velocity_y)
        turned_mps = closing_mps * cos + across_mps * sin
        if self._reach_m > 0.0:
            turned_mps = library.at_least(turned_mps, 0.0)
            turned_mps = turned_mps + walking_mps * (self._reach_m / track[2])
            turned_mps = library.minimum(turned_mps, walking_mps)
        return library.where(closing_mps >= walking_mps * cos, walking_mps, turned_mps)

    def _turn(self, people: PeopleAhead, closing_mps: Any) -> _Turn | None:
        """Return the bound for people who have to turn to the robot; None if it does not hold."""
        if people.turn_delay_s is None or closing_mps is None:
            return None
        library, walking = self._library, self._rules.walking
        assert walking is not None
        a_h, since_s = walking.human_acceleration_mps2, people.turn_delay_s
        delay_s = (closing_mps[2] + people.velocity_spread_mps) * (1.0 / a_h) + since_s
        counted_s = library.at_least(delay_s, 0.0)
        nearer_m = library.at_least((since_s * since_s - counted_s * counted_s) * (0.5 * a_h), 0.0)
        return _Turn(a_h, library.maximum(delay_s, -people.reaction_s), nearer_m)

    def _separation_mps(
        self, people: PeopleAhead, bounds: list[_Bound], human_mps: Any, turn: _Turn | None
    ) -> Any:
        limit, reaction_s = None, people.reaction_s
        starts: list[tuple[float, Any, Any]] = []
        if people.start_delay_s is not None and self._rules.standing is not None:
            a_h = self._rules.standing.human_acceleration_mps2
            starts = [(a_h, people.start_delay_s, None)]
        for number, (gap_m, share) in enumerate(bounds, start=1):
            spare_m, ways = gap_m - self._clearance_m, starts
            if turn is not None and number == len(bounds):
                # The last bound is that from the circle about the base.
                ways = [*starts, (turn.acceleration_mps2, turn.delay_s, turn.nearer_m)]
            if not ways:
                walker_m = spare_m - human_mps * reaction_s
                own = self._walker_mps(walker_m, human_mps, reaction_s, share)
                limit = own if limit is None else self._library.maximum(limit, own)
            for way in ways:
                own = self._starter_mps(spare_m, human_mps, reaction_s, share, *way)
                limit = own if limit is None else self._library.maximum(limit, own)
        return limit

    def _reserve_mps(
        self,
        people: PeopleAhead,
        bounds: list[_Bound],
        ahead: Any,
        closing_mps: Any,
        turn: _Turn | None,
    ) -> Any:
        reserve = self._rules.start_reserve
        assert reserve is not None
        library, a_h = self._library, reserve.human_acceleration_mps2
        delay_s = _in_shape_of_times(people, reserve.start_delay_s)
        if closing_mps is not None:
            delay_s = library.at_least(closing_mps[0], 0.0) / a_h + reserve.start_delay_s
        limit, unaware_mps = None, library.convert(self._unaware_mps)
        for number, (gap_m, share) in enumerate(bounds, start=1):
            spare_m = gap_m
            if turn is not None and number == len(bounds) and turn.acceleration_mps2 <= a_h:
                # Nearly equal does not count: the adapter may see it otherwise.
                at_once_s = people.reaction_s + reserve.start_delay_s
                in_time_s = people.reaction_s + turn.delay_s
                sooner_m = (0.5 * a_h) * (at_once_s * at_once_s - in_time_s * in_time_s)
                later = sooner_m >= turn.nearer_m + 1e-4
                delay_s = library.where(later, turn.delay_s, delay_s)
                spare_m = library.where(later, gap_m - turn.nearer_m, gap_m)
            part = None if share is None else ahead
            own = self._starter_mps(spare_m, unaware_mps, people.reaction_s, part, a_h, delay_s)
            limit = own if limit is None else library.maximum(limit, own)
        return limit

    def _walker_mps(self, spare_m: Any, human_mps: Any, reaction_s: Any, share: Any) -> Any:
        """Return the limit of speed and separation, given what the gap leaves for braking."""
        library, a = self._library, self._braking_mps2
        # The quadratic equation times 2a, with a b above 0 that a root can be taken of.
        spare = (2.0 * a) * library.at_least(spare_m, 0.0)
        human_mps = human_mps + _SLOWEST_MPS
        if share is None:
            b = a * reaction_s + human_mps
            return spare / (b + library.root(b * b + spare))
        b = share * (a * reaction_s) + human_mps
        return spare / (b + library.root(b * b + share * spare))

    def _starter_mps(
        self,
        gap_m: Any,
        human_mps: Any,
        reaction_s: Any,
        share: Any,
        human_acceleration_mps2: float,
        delay_s: Any,
        nearer_m: Any = None,
    ) -> Any:
        """Return the limit for people who stand, start or turn; never below that for walkers."""
        library, a, a_h = self._library, self._braking_mps2, human_acceleration_mps2
        since_s, speeding_up_s = reaction_s + delay_s, human_mps / a_h
        walked_m = (0.5 * a_h) * since_s * since_s
        late_m = human_mps * (delay_s - 0.5 * speeding_up_s)
        if nearer_m is not None:
            walked_m, late_m = walked_m + nearer_m, late_m + nearer_m
        spare_m = 2.0 * library.at_least(gap_m - walked_m, 0.0)
        b, c = since_s * (a_h / a) + _SLOWEST_MPS, (a_h / a + 1.0) / a
        if share is None:
            b = b + reaction_s
        else:
            b, c = b + share * reaction_s, (share + a_h / a) * (1.0 / a)
        early_mps = spare_m / (b + library.root(b * b + c * spare_m))
        is_early = early_mps <= a * (speeding_up_s - since_s)
        walker_m = gap_m - human_mps * reaction_s
        spare_m = library.where(is_early, walker_m, library.maximum(walker_m, walker_m - late_m))
        late_mps = self._walker_mps(spare_m, human_mps, reaction_s, share)
        return library.where(is_early, library.maximum(early_mps, late_mps), late_mps)

    def _distance_limits_mps(self, bounds: list[_Bound]) -> dict[str, Any]:
        library, zones, cap = self._library, self._rules.zones, self._rules.near_cap
        gap_m = bounds[0][0]
        limits = {}
        if zones is not None:
            distance_m = gap_m
            circle_m, share = bounds[-1]
            if share is not None:
                # The distance that the robot drives until it has come nearer by the gap.
                drive_m = library.where(
                    circle_m > 0.0, circle_m / library.at_least(share, 1e-9), circle_m
                )
                distance_m = library.maximum(gap_m, drive_m)
            span_m = zones.full_speed_beyond_m - zones.stop_within_m
            part = library.at_least((distance_m - zones.stop_within_m) / span_m, 0.0)
            limits["distance zone"] = self._maximum_mps * part
        if cap is not None:
            beyond_m = library.at_least(gap_m - cap.within_m, 0.0)
            limits["cap near people"] = library.sqrt(
                2.0 * self._braking_mps2 * beyond_m + cap.speed_mps**2
            )
        return limits


def _in_shape_of_times(people: PeopleAhead, number: float) -> Any:
    """Return a number in the shape of the people's reaction times."""
    return 0.0 * people.reaction_s + number
