// The answer of the adapter for one person who has been tracked so for long enough.
// The Python originals are nav_adapter/_obstacle_rules.py, _approach.py, _governor.py, _alerting.py
// and _adapter.py.
//
// The state has: x_m, y_m (place of the track in the base frame), vx_mps, vy_mps, sigma_m and
// velocity_sigma_mps (standard deviations of place and velocity, the same in all directions),
// awareness_lower, noticed, was_aware, track (confirmed, coasting, tentative or first sight),
// unseen_s (from the last frame that showed the person to the track), data_age_s (from the track
// and the latest frame to now), moved_m and moved_age_s, speed_mps and lateral_mps.

const radians = (degrees) => degrees * (Math.PI / 180);
const BRISK_SHARE = 0.75;
const RUNNING_SHARE = 0.25;

/** The person as the adapter knows them: awareness that counts, radius, speeds, uncertainty. */
function personOf(policy, state) {
  const { timing, margins, outline } = policy;
  const stale = state.data_age_s > timing.stale_after_s;
  const since = state.unseen_s + state.data_age_s;
  const firstSight = state.track === "first sight";
  const confirmed = firstSight || state.track === "confirmed";
  const trusted = !stale && state.track !== "tentative" && since <= timing.fresh_within_s;
  const looks = trusted ? state.awareness_lower : 0;
  const rule = policy.noticed;
  const counts = trusted && confirmed && rule !== null && state.noticed >= rule.at_least;
  const lower = Math.max(looks, counts ? rule.counts_as_awareness : 0);
  const before = state.was_aware && !firstSight && state.track !== "tentative";
  const held = (ramp) => holds(ramp, looks, before);
  const ahead = Math.min(state.data_age_s, timing.stop_after_s);
  const sigma = Math.sqrt(state.sigma_m ** 2 + ahead ** 2 * state.velocity_sigma_mps ** 2);
  const walking = Math.hypot(state.vx_mps, state.vy_mps);
  const sized = firstSight ? 0 : held(policy.inflation) ? 1 : lower;
  const share = blend(outline, sized);
  const aheadS = mixed(share, outline.unaware_ahead_s, outline.aware_ahead_s);
  const elongates = outline.unaware_ahead_s > 0;
  const isNew = firstSight && 0 < timing.shrink_after_s - 1e-9;
  const heard = isNew ? 0 : held(policy.speed) ? 1 : lower;
  const fresh = trusted && state.track === "confirmed";
  return {
    counted_alpha: heard, stale, trusted, confirmed, fresh, lower, sigma, walking,
    radius: bounded(margins, policyRadius(policy, sized) + margins.uncertainty_sigmas * sigma),
    ahead: elongates ? Math.min(aheadS * walking, outline.longest_ahead_m) : 0,
    assumed: policyHumanSpeed(policy, heard),
    start: {
      bound: policy.rules.standing?.human_acceleration_mps2 ?? Infinity,
      delay: standingDelay(policy, state, fresh, walking),
    },
    uncertainty: sigma * (since > timing.fresh_within_s
      ? Math.max(margins.uncertainty_sigmas, margins.unseen_sigmas)
      : margins.uncertainty_sigmas),
    at: [state.x_m, state.y_m],
    predicted: [
      state.x_m + state.data_age_s * state.vx_mps, state.y_m + state.data_age_s * state.vy_mps,
    ],
  };
}

/** How long before the track's stamp a standing person may have begun to walk; else infinite. */
function standingDelay(policy, state, fresh, walking) {
  const standing = policy.rules.standing;
  if (standing === null || !fresh) return Infinity;
  const squared = walking * walking + state.velocity_sigma_mps ** 2;
  if (!(squared <= standing.standing_below_mps ** 2)) return Infinity;
  const least = standing.start_delay_s + state.unseen_s;
  if (!standing.delay_from_tracks) return least;
  const moved = state.moved_m ?? Infinity;
  const moving = Math.sqrt((2 * moved) / standing.human_acceleration_mps2);
  return Math.max(least, state.moved_age_s + moving);
}

/** The speed at which a track at a point comes nearer, negative if it leaves. */
function closingSpeed({ vx_mps: vx, vy_mps: vy }, [x, y]) {
  return -(vx * x + vy * y) / Math.max(Math.hypot(x, y), 1e-9);
}

/**
 * How soon a person comes who must turn to the robot; null for one who may turn at once.
 * They get as far as somebody who starts from standing after `delay` at `bound`, and by `nearer`
 * farther. A negative delay is the time that it takes to turn round.
 */
function turnOf(policy, robot, state, person) {
  const rule = policy.rules.walking;
  if (rule === null || !person.fresh) return null;
  const bound = rule.human_acceleration_mps2, unnoticed = rule.turn_delay_s + state.unseen_s;
  const spread = rule.velocity_sigmas * state.velocity_sigma_mps;
  const delay = unnoticed + (closingSpeed(state, person.at) + spread) / bound;
  const untilBraking = robot.reaction_time_s + state.data_age_s, counted = Math.max(delay, 0);
  return {
    bound, delay: Math.max(delay, -untilBraking),
    nearer: 0.5 * bound * Math.max(unnoticed * unnoticed - counted * counted, 0),
  };
}

/** The speed towards the robot that counts: the policy's, or that of the track if it is higher. */
function countedHumanSpeed(policy, state, person) {
  if (policy.rules.protective_field !== null) return person.assumed;
  const [x, y] = person.at, { vx_mps: vx, vy_mps: vy } = state;
  const distance = Math.max(Math.hypot(x, y), 1e-9);
  const unaware = policyHumanSpeed(policy, 0);
  let closing = closingSpeed(state, person.at), assumed = person.assumed;
  if (person.walking > BRISK_SHARE * unaware) {
    const across = Math.abs(vx * y - vy * x) / distance;
    const brisk = (person.walking / Math.max(unaware, 1e-9) - BRISK_SHARE) / (1 - BRISK_SHARE);
    const turn = radians(policy.rules.people_turn_deg) * Math.min(brisk, 1);
    closing = Math.atan2(across, closing) <= turn
      ? person.walking
      : closing * Math.cos(turn) + across * Math.sin(turn);
  }
  const excess = person.walking - unaware;
  if (excess > 0) {
    const running = Math.min(excess / Math.max(RUNNING_SHARE * unaware, 1e-9), 1);
    assumed = Math.max(assumed + excess, assumed + running * (person.walking - assumed));
  }
  return Math.max(closing, assumed);
}

/** Whether the drive cannot move sideways. */
function drivesStraight(robot) {
  return robot.drive === "differential" || robot.drive === "ackermann";
}

/** The share of the stopping distance that can lead to a point. */
function approach(policy, robot, state, [x, y]) {
  const lateral = Math.abs(state.lateral_mps);
  if (Math.abs(state.speed_mps) < STANDING_MPS && lateral <= LATERAL_NOISE_MPS) return 1;
  const [ahead, left] = travelOf(state).direction;
  const angle = Math.abs(Math.atan2(ahead * y - left * x, ahead * x + left * y));
  let turn = radians(policy.rules.turn_within_stop_deg);
  if (lateral <= LATERAL_NOISE_MPS && !drivesStraight(robot))
    turn += Math.atan2(lateral, Math.abs(state.speed_mps));
  return Math.max(Math.cos(Math.max(angle - turn, 0)), 0);
}

/** Separations and shares of the stopping distance: [from the footprint, from the circle]. */
function gapsOf(policy, robot, state, person) {
  const margin = DATA.body_radius_m + person.uncertainty;
  const both = [person.predicted, person.at];
  const hull = hullOfRobot(robot);
  const outline = Math.min(...both.map((point) => distanceFrom(hull, point)));
  const centre = Math.min(...both.map(([x, y]) => Math.hypot(x, y)));
  return {
    raw: [outline, centre - circumscribed(robot)].map((gap) => gap - DATA.body_radius_m),
    gaps: [outline - margin, centre - circumscribed(robot) - margin],
    shares: [1, Math.max(...both.map((point) => approach(policy, robot, state, point)))],
  };
}

/**
 * The bounds on how much nearer person and robot come, each with its gap and its share of the
 * stopping distance. A turn counts with the second, whose direction is that of the base.
 */
function boundsFor(gaps, shares, start, turn) {
  const bounds = gaps.map((gap, each) => ({ each, gap, share: shares[each], ...start, nearer: 0 }));
  return turn ? [...bounds, { ...bounds[1], ...turn, turns: true }] : bounds;
}

/**
 * The limit of each rule in m/s, speed and separation first.
 * `counting` gets, for the two rules that have several bounds, the one that allows most speed.
 */
function ruleLimits(policy, robot, state, person, human, { gaps, shares }, counting) {
  const rules = policy.rules, braking = robot.max_deceleration_mps2;
  const reaction = robot.reaction_time_s + state.data_age_s;
  const turn = turnOf(policy, robot, state, person);
  const highest = (rule, speed, clearance, bounds) => {
    const limits = bounds.map(({ gap, nearer, share, bound, delay }) => highestSpeedFromStanding(
      gap - nearer, speed, braking, reaction, clearance, share, bound, delay,
    ));
    const most = Math.max(...limits);
    counting[rule] = bounds[limits.indexOf(most)];
    return most;
  };
  const limits = {
    "speed and separation": highest(
      "speed and separation", human, policy.margins.separation_clearance_m,
      boundsFor(gaps, shares, person.start, turn),
    ),
  };
  if (rules.zones !== null) {
    const drive = gaps[1] > 0 ? gaps[1] / shares[1] : gaps[1];
    const { stop_within_m: stop, full_speed_beyond_m: full } = rules.zones;
    const share = (Math.max(gaps[0], drive) - stop) / (full - stop);
    limits["distance zone"] = robot.max_speed_mps * (share > 0 ? Math.min(share, 1) : 0);
  }
  if (rules.near_cap !== null) {
    const beyond = Math.max(gaps[0] - rules.near_cap.within_m, 0);
    limits["cap near people"] = Math.sqrt(rules.near_cap.speed_mps ** 2 + 2 * braking * beyond);
  }
  if (rules.start_reserve !== null) {
    const [x, y] = person.at, { travel, direction } = travelOf(state);
    const distance = Math.max(Math.hypot(x, y), 1e-9);
    const along = (x * direction[0] + y * direction[1]) / distance;
    const toward = [1, travel < STANDING_MPS ? 1 : Math.min(Math.max(along, 0), 1)];
    const { human_acceleration_mps2: bound, start_delay_s: delay } = rules.start_reserve;
    const start = { bound, delay: delay + Math.max(closingSpeed(state, person.at), 0) / bound };
    const bounds = boundsFor(gaps, toward, start, null);
    if (turn !== null && turn.bound <= bound) {
      // Whoever has to turn round is no nearer when the robot brakes, and from then on.
      const atOnce = reaction + delay, inTime = reaction + turn.delay;
      const way = turn.nearer + 0.5 * bound * (inTime * inTime);
      if (way <= 0.5 * bound * (atOnce * atOnce))
        bounds[1] = { ...bounds[1], delay: turn.delay, nearer: turn.nearer, turns: true };
    }
    limits["start reserve"] = highest("start reserve", policyHumanSpeed(policy, 0), 0, bounds);
  }
  return limits;
}

/** Whether the robot stops in time if it brakes fully from now on. */
function brakingSuffices(policy, robot, state, person, human, { gaps, shares }) {
  const { travel } = travelOf(state), braking = robot.max_deceleration_mps2;
  if (travel < STANDING_MPS) return true;
  const turn = turnOf(policy, robot, state, person), time = state.data_age_s + travel / braking;
  return boundsFor(gaps, shares, person.start, turn).some((each) => {
    const way = walked(time, human, each.bound, each.delay) + each.nearer;
    const driven = each.share * stopping(travel, braking, state.data_age_s);
    return way + driven + policy.margins.separation_clearance_m <= each.gap;
  });
}

/** The alert for the person if none has been given before, or null. */
function alertOf(policy, robot, state, person) {
  const rules = policy.alerts;
  if (rules === null || person.stale || travelOf(state).travel <= STANDING_MPS) return null;
  if (state.track === "tentative" || person.lower >= rules.unaware_below) return null;
  const [x, y] = person.predicted;
  const vx = state.vx_mps - state.speed_mps, vy = state.vy_mps - state.lateral_mps;
  const speed2 = vx * vx + vy * vy, closing = -(x * vx + y * vy);
  if (speed2 < 1e-6 || closing <= 1e-9) return null;
  const time = closing / speed2;
  const reach = circumscribed(robot) + DATA.body_radius_m
    + policy.margins.uncertainty_sigmas * person.sigma;
  const gap = Math.max(Math.hypot(x + time * vx, y + time * vy) - reach, 0);
  if (gap > rules.miss_within_m) return null;
  const kind = time < rules.horn_within_s ? "horn"
    : time < rules.voice_within_s ? "voice"
    : time < rules.light_within_s ? "light" : null;
  return kind && { kind, time_s: time, gap_m: gap };
}

/** Radius, speed limit, reason and all that they come from. */
function answer(policy, robot, state) {
  const person = personOf(policy, state);
  const human = countedHumanSpeed(policy, state, person);
  const terms = gapsOf(policy, robot, state, person);
  const maximum = robot.max_speed_mps, { travel, direction } = travelOf(state);
  const field = policy.rules.protective_field;
  const counts = field === null || [person.predicted, person.at].some(
    (point) => inPath(robot, direction, field.beside_m, point, person.uncertainty),
  );
  const bounds = {};  // of the rules that have several, the one that counts
  const limits = counts ? ruleLimits(policy, robot, state, person, human, terms, bounds) : {};
  let limit = maximum, reason = "robot maximum";
  for (const [rule, value] of Object.entries(limits))
    if (value < limit) [limit, reason] = [value, rule];
  const suffices = !counts || travel <= limits["speed and separation"]
    || brakingSuffices(policy, robot, state, person, human, terms);
  if (state.data_age_s > policy.timing.stop_after_s)
    [limit, reason] = [0, `stale data: perception is ${state.data_age_s.toFixed(2)} s old`];
  const lateral = Math.abs(state.lateral_mps);
  if (drivesStraight(robot) && lateral > LATERAL_NOISE_MPS) {
    limit = 0;
    reason = `robot: moves sideways at ${lateral.toFixed(2)} m/s, but its profile says `
      + `drive='${robot.drive}'`;
  }
  const reaction = robot.reaction_time_s + state.data_age_s;
  return {
    radius_m: person.radius, ahead_m: person.ahead, awareness_lower: person.lower,
    human_speed_mps: human, limit_mps: limit, reason, limits, stale: person.stale,
    stopping_m: stopping(limit, robot.max_deceleration_mps2, reaction),
    braking_suffices: suffices, alert: alertOf(policy, robot, state, person),
    gaps_m: terms.raw, uncertainty_m: person.uncertainty, bounds, in_path: counts, person,
  };
}
