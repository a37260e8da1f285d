"""The measures of other projects, computed again from their definitions: loops over plain numbers.

Written from the papers and texts that docs/social_measures.md names, and from nothing in
``sim_tests.study.social``. An instant is a dictionary; a person who is not there is absent from it.
"""

from __future__ import annotations

import math
from itertools import pairwise

CONSTANTS = {"lambda": 2.0, "gamma": 0.35, "n": 2.0, "n_prime": 3.0, "social": 2.1}


def instants_of(episode):
    """Return the instants of an episode as dictionaries."""
    rows = []
    for row, t in enumerate(episode.t_s):
        people = {}
        for person in range(episode.people_m.shape[1]):
            if not math.isnan(episode.people_m[row, person, 0]):
                people[person] = {
                    "p": tuple(map(float, episode.people_m[row, person])),
                    "v": tuple(map(float, episode.people_mps[row, person])),
                    "yaw": float(episode.people_heading_rad[row, person]),
                }
        rows.append(
            {
                "t": float(t),
                "p": tuple(map(float, episode.robot_m[row])),
                "v": tuple(map(float, episode.robot_mps[row])),
                "yaw": float(episode.robot_heading_rad[row]),
                "people": people,
            }
        )
    return rows


def turn(angle):
    while angle > math.pi:
        angle -= 2.0 * math.pi
    while angle <= -math.pi:
        angle += 2.0 * math.pi
    return angle


def path_length(rows):
    return sum(math.dist(a["p"], b["p"]) for a, b in pairwise(rows))


def heading_changes(yaws):
    return sum(abs(turn(b - a)) for a, b in pairwise(yaws))


def weighted(success, actual, best):
    """S · l / max(p, l)."""
    return best / max(actual, best) if success else 0.0


def rotation_excess(rows, goal):
    bearing = math.atan2(goal[1] - rows[0]["p"][1], goal[0] - rows[0]["p"][0])
    return heading_changes([r["yaw"] for r in rows]) - abs(turn(bearing - rows[0]["yaw"]))


def goal_angle(rows, goal):
    total = 0.0
    for r in rows:
        ahead = (math.cos(r["yaw"]), math.sin(r["yaw"]))
        to = (goal[0] - r["p"][0], goal[1] - r["p"][1])
        cross, dot = ahead[0] * to[1] - ahead[1] * to[0], ahead[0] * to[0] + ahead[1] * to[1]
        total += abs(math.atan2(cross, dot))
    return total / len(rows)


def collision_time(rows, robot_radius, person_radius):
    """Solve |c + v t| = R for every person at every instant."""
    best = math.inf
    reach = robot_radius + person_radius
    for r in rows:
        for q in r["people"].values():
            cx, cy = q["p"][0] - r["p"][0], q["p"][1] - r["p"][1]
            vx, vy = q["v"][0] - r["v"][0], q["v"][1] - r["v"][1]
            if math.hypot(cx, cy) < reach:
                return 0.0
            a, b, c = vx * vx + vy * vy, 2.0 * (cx * vx + cy * vy), cx * cx + cy * cy - reach**2
            if a > 0.0 and b < 0.0 and b * b - 4.0 * a * c > 0.0:
                best = min(best, (-b - math.sqrt(b * b - 4.0 * a * c)) / (2.0 * a))
    return best


def surface_distances(rows, robot_radius, person_radius):
    """Per instant, the distance of the closest person's disc, or None."""
    found = []
    for r in rows:
        all_of_them = [
            max(math.dist(r["p"], q["p"]) - robot_radius - person_radius, 0.0)
            for q in r["people"].values()
        ]
        found.append(min(all_of_them) if all_of_them else None)
    return found


def zone_of(distance):
    if distance is None or distance >= 3.6:
        return "public"
    return "intimate" if distance < 0.45 else "personal" if distance < 1.2 else "social"


def zone_times(rows, distances):
    times = dict.fromkeys(("intimate", "personal", "social", "public"), 0.0)
    for row in range(len(rows) - 1):
        times[zone_of(distances[row])] += rows[row + 1]["t"] - rows[row]["t"]
    return times


def zone_percents(distances):
    zones = [zone_of(distance) for distance in distances]
    return {z: 100.0 * zones.count(z) / len(zones) for z in ("intimate", "personal", "social")}


def group_distances(rows, groups, robot_radius):
    """Per instant, the distance of the nearest group's centre from the robot's disc, or None."""
    found = []
    for r in rows:
        all_of_them = []
        for group in groups:
            if all(person in r["people"] for person in group):
                x = y = 0.0
                for person in group:
                    q = r["people"][person]
                    x += q["p"][0] + 1.5 * math.cos(q["yaw"])
                    y += q["p"][1] + 1.5 * math.sin(q["yaw"])
                centre = (x / len(group), y / len(group))
                all_of_them.append(math.dist(centre, r["p"]) - robot_radius)
        found.append(min(all_of_them) if all_of_them else None)
    return found


def forward_speed(row):
    return row["v"][0] * math.cos(row["yaw"]) + row["v"][1] * math.sin(row["yaw"])


def left_speed(row):
    return row["v"][1] * math.cos(row["yaw"]) - row["v"][0] * math.sin(row["yaw"])


def hunav_differences(rows, power):
    """Σ Δv / Δt^power over the steps, divided by the number of instants."""
    total = 0.0
    for a, b in pairwise(rows):
        total += (math.hypot(*b["v"]) - math.hypot(*a["v"])) / (b["t"] - a["t"]) ** power
    return total / len(rows)


def pair_force(source, target):
    """The social force of one body on another (Moussaïd et al. 2009)."""
    dx, dy = source["p"][0] - target["p"][0], source["p"][1] - target["p"][1]
    distance = math.hypot(dx, dy)
    ex, ey = dx / distance, dy / distance
    ix = CONSTANTS["lambda"] * (target["v"][0] - source["v"][0]) + ex
    iy = CONSTANTS["lambda"] * (target["v"][1] - source["v"][1]) + ey
    length = math.hypot(ix, iy)
    tx, ty = ix / length, iy / length
    theta = math.atan2(ex * ty - ey * tx, ex * tx + ey * ty)
    b = CONSTANTS["gamma"] * length
    along = -math.exp(-distance / b - (CONSTANTS["n_prime"] * b * theta) ** 2)
    aside = math.exp(-distance / b - (CONSTANTS["n"] * b * theta) ** 2)
    aside = aside if theta > 0.0 else -aside if theta < 0.0 else 0.0
    a = CONSTANTS["social"]
    return a * (along * tx - aside * ty), a * (along * ty + aside * tx)


def wall_force(point, radius, walls):
    """The force of the nearest of all walls: 10 exp(−(d − r) / 0.2)."""
    best = math.inf
    for x1, y1, x2, y2 in walls:
        length2 = (x2 - x1) ** 2 + (y2 - y1) ** 2
        share = ((point[0] - x1) * (x2 - x1) + (point[1] - y1) * (y2 - y1)) / length2
        share = min(max(share, 0.0), 1.0)
        foot = (x1 + share * (x2 - x1), y1 + share * (y2 - y1))
        best = min(best, math.dist(point, foot))
    return 10.0 * math.exp(-(best - radius) / 0.2) if walls else 0.0


def social_work(rows, robot_radius, walls):
    on_people = on_robot = on_robot_from_walls = work = 0.0
    for r in rows:
        sum_x = sum_y = here = 0.0
        for q in r["people"].values():
            here += math.hypot(*pair_force(r, q))
            fx, fy = pair_force(q, r)
            on_robot += math.hypot(fx, fy)
            sum_x, sum_y = sum_x + fx, sum_y + fy
        wall = wall_force(r["p"], robot_radius, walls)
        on_people += here
        on_robot_from_walls += wall
        work += math.hypot(sum_x, sum_y) + wall + here
    return on_people, on_robot, on_robot_from_walls, work


def gym_motion(rows):
    """Magnitudes of velocity, acceleration and jerk after the first instant, as SocNavGym."""
    speeds, accelerations, jerks, length = [], [], [], 0.0
    before_v = before_a = (0.0, 0.0)
    for a, b in pairwise(rows):
        dt = b["t"] - a["t"]
        v = (forward_speed(b), left_speed(b))
        acc = ((v[0] - before_v[0]) / dt, (v[1] - before_v[1]) / dt)
        jerk = ((acc[0] - before_a[0]) / dt, (acc[1] - before_a[1]) / dt)
        speeds.append(math.hypot(*v))
        accelerations.append(math.hypot(*acc))
        jerks.append(math.hypot(*jerk))
        length += dt * speeds[-1]
        before_v, before_a = v, acc
    return speeds, accelerations, jerks, length


def track_sums(times, points):
    """NavWareSet: Σ |a| dt, its Σ dt, Σ |j| dt, and its Σ dt of one track."""
    dts = [b - a for a, b in pairwise(times)]
    speeds = [math.dist(points[i], points[i + 1]) / dt for i, dt in enumerate(dts)]
    accelerations = [(speeds[i] - speeds[i - 1]) / dts[i] for i in range(1, len(speeds))]
    jerks = [
        (accelerations[i] - accelerations[i - 1]) / dts[i + 1] for i in range(1, len(accelerations))
    ]
    return (
        sum(abs(a) * dt for a, dt in zip(accelerations, dts[1:], strict=True)),
        sum(dts[1:]),
        sum(abs(j) * dt for j, dt in zip(jerks, dts[2:], strict=True)),
        sum(dts[2:]),
    )


def centre_distances(rows):
    return [
        min((math.dist(r["p"], q["p"]) for q in r["people"].values()), default=None) for r in rows
    ]


def share(values, holds):
    known = [value for value in values if value is not None]
    return sum(1 for value in known if holds(value)) / len(known)


def reference_measures(episode, groups):
    """Return every measure of ``social.csv`` by its name, for an episode with people and a goal."""
    rows, walls = instants_of(episode), [tuple(map(float, w)) for w in episode.walls_m]
    goal = tuple(map(float, episode.goal_m))
    radius, body = episode.robot_radius_m, episode.person_radius_m
    duration, length = rows[-1]["t"] - rows[0]["t"], path_length(rows)
    surfaces, centres = surface_distances(rows, radius, body), centre_distances(rows)
    times, percents = zone_times(rows, surfaces), zone_percents(surfaces)
    of_groups = zone_percents(group_distances(rows, groups, radius))
    forces = social_work(rows, radius, walls)
    speeds, accelerations, jerks, gym_length = gym_motion(rows)
    robot = track_sums([r["t"] for r in rows], [r["p"] for r in rows])
    people, turned, walking = [0.0] * 4, 0.0, []
    for person in range(episode.people_m.shape[1]):
        own = [r for r in rows if person in r["people"]]
        sums = track_sums([r["t"] for r in own], [r["people"][person]["p"] for r in own])
        people = [a + b for a, b in zip(people, sums, strict=True)]
        turned += heading_changes([r["people"][person]["yaw"] for r in own])
        walking += [math.hypot(*r["people"][person]["v"]) for r in own]
    excess = rotation_excess(rows, goal)
    after = [math.inf if each is None else each for each in centres[1:]]
    extremes = {
        f"socnavgym_{kind}_{series}": pick(values)
        for series, values in (
            ("speed_mps", speeds),
            ("acceleration_mps2", accelerations),
            ("jerk_mps3", jerks),
        )
        for kind, pick in (
            ("min", min),
            ("avg", lambda values: sum(values) / len(values)),
            ("max", max),
        )
    }
    return {
        "spl": weighted(episode.success, length, episode.reference_length_m),
        "stl": weighted(episode.success, episode.time_to_goal_s, episode.reference_time_s),
        "path_irregularity_rad": excess,
        "path_irregularity_radpm": excess / length,
        "mean_goal_angle_rad": goal_angle(rows, goal),
        "time_to_collision_s": collision_time(rows, radius, body),
        **{f"{zone}_distance_s": times[zone] for zone in ("intimate", "personal", "social")},
        "human_delay_s": episode.human_delay_s,
        "people_acceleration_mps2": people[0] / people[1],
        "people_jerk_mps3": people[2] / people[3],
        "people_heading_changes_rad": turned,
        "hunav_time_s": duration,
        "hunav_path_length_m": length,
        "hunav_heading_changes_rad": heading_changes([r["yaw"] for r in rows]),
        "hunav_mean_closest_m": sum(d for d in surfaces if d is not None) / len(rows),
        "hunav_min_distance_m": min(d for d in surfaces if d is not None),
        **{f"hunav_{zone}_percent": percents[zone] for zone in percents},
        **{f"hunav_group_{zone}_percent": of_groups[zone] for zone in of_groups},
        "hunav_speed_mps": sum(math.hypot(*row["v"]) for row in rows) / len(rows),
        "hunav_acceleration_mps2": hunav_differences(rows, 1),
        "hunav_overacceleration_mps3": hunav_differences(rows, 2),
        "hunav_people_speed_mps": sum(walking) / len(walking),
        "hunav_force_on_people_mps2": forces[0],
        "hunav_force_on_robot_mps2": forces[1],
        "hunav_obstacle_force_mps2": forces[2],
        "hunav_social_work_mps2": forces[3],
        "socnavgym_path_length_m": gym_length,
        **extremes,
        "socnavgym_min_distance_m": min(after),
        "socnavgym_compliance": sum(d - radius >= 0.45 for d in after) / len(after),
        "navwareset_speed_mps": length / duration,
        "navwareset_acceleration_mps2": robot[0] / robot[1],
        "navwareset_jerk_mps3": robot[2] / robot[3],
        "navwareset_path_length_m": length,
        "navwareset_psc_percent": 100.0 * share(centres, lambda d: d < 0.5),
        "navwareset_compliance_percent": 100.0 * share(centres, lambda d: d - 0.4 >= 0.5),
        "navwareset_min_distance_m": min(d for d in centres if d is not None),
    }
