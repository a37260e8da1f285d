// Radius and assumed human speed of a policy over the lower bound of α, and that bound itself.
// The Python originals are in nav_adapter/policies and tracking/awareness_filter.py.

const smoothstep = (p) => Math.min(p * p * (3 - 2 * p), 1);

/** The share of "aware" in [0, 1] of a ramp at α. */
function blend(ramp, alpha) {
  const below = ramp.unaware_below, above = ramp.aware_above;
  if (!(alpha > below)) return 0;
  if (alpha >= above) return 1;
  const position = (alpha - below) / (above - below);
  if (ramp.shape === "two_level") return 0;
  if (ramp.shape === "linear") return Math.min(position, 1);
  if (ramp.shape === "logistic") {
    const half = 0.25 * ramp.steepness;
    const share = 0.5 + (0.5 * Math.tanh(half * (2 * position - 1))) / Math.tanh(half);
    return Math.min(Math.max(share, 0), 1);
  }
  return smoothstep(position);
}

const mixed = (share, first, second) => (1 - share) * first + share * second;

/** The value of a table at α, linear between its points and constant beyond. */
function interpolate(points, alpha) {
  if (!(alpha > points[0][0])) return points[0][1];
  const next = points.findIndex(([at]) => at > alpha);
  if (next < 0) return points[points.length - 1][1];
  const [[from, value], [to, after]] = [points[next - 1], points[next]];
  return mixed((alpha - from) / (to - from), value, after);
}

/** Whether the hysteresis of a ramp with two levels holds a person as aware. */
function holds(ramp, alpha, held) {
  if (ramp.shape !== "two_level" || !(alpha > 0)) return false;
  return alpha >= ramp.aware_above || (held && alpha > ramp.unaware_below);
}

const floorOf = (margins) => DATA.body_radius_m + margins.minimum_clearance_m;

function bounded(margins, radius) {
  const most = margins.maximum_radius_m ?? Infinity;
  return Math.min(Math.max(radius, floorOf(margins)), most);
}

/** The radius at α between floor and ceiling, without the uncertainty of the position. */
function policyRadius(policy, alpha) {
  const inflation = policy.inflation;
  const radius = inflation.table_m
    ? interpolate(inflation.table_m, alpha)
    : mixed(blend(inflation, alpha), inflation.unaware_radius_m, inflation.aware_radius_m);
  return bounded(policy.margins, radius);
}

/** The speed towards the robot that the policy assumes at α. */
function policyHumanSpeed(policy, alpha) {
  const speed = policy.speed;
  if (speed.table_mps) return interpolate(speed.table_mps, alpha);
  const share = blend(speed, alpha);
  const above = speed.watching_above, watching = speed.watching_human_speed_mps;
  if (share < 1 || above === null || watching === null)
    return mixed(share, speed.unaware_human_speed_mps, speed.aware_human_speed_mps);
  const position = Math.min((alpha - speed.aware_above) / (above - speed.aware_above), 1);
  return mixed(smoothstep(position), speed.aware_human_speed_mps, watching);
}

/** The probability that a standard normal value exceeds z ≥ 0. */
function upperTail(z) {
  const density = Math.exp(-0.5 * z * z) / Math.sqrt(2 * Math.PI);
  if (z > 3) {
    // The continued fraction of Mills' ratio, from its far end.
    let fraction = z;
    for (let level = 200; level > 0; level -= 1) fraction = z + level / fraction;
    return density / fraction;
  }
  // Φ(z) − 1/2 = density · (z + z³/3 + z⁵/(3·5) + …), of which all terms are positive.
  let term = z, sum = z;
  for (let odd = 3; term > 1e-18; odd += 2) {
    term *= (z * z) / odd;
    sum += term;
  }
  return 0.5 - density * sum;
}

/** The z that a standard normal value exceeds with probability 1 − confidence (0.5 to 1). */
function quantile(confidence) {
  const tail = 1 - confidence;
  let low = 0, high = 40;
  for (let round = 0; round < 100 && low < high; round += 1) {
    const middle = 0.5 * (low + high);
    if (middle === low || middle === high) break;
    if (upperTail(middle) > tail) low = middle;
    else high = middle;
  }
  return 0.5 * (low + high);
}

/** The lower bound of α after one measurement α ± σ alone: no prior, nothing remembered. */
function lowerBound(alpha, std, filter) {
  if (!(std <= filter.max_evidence_std)) return 0;
  const clip = filter.clip_awareness;
  const logit = (value) => {
    const inside = Math.min(Math.max(value, clip), 1 - clip);
    return Math.log(inside / (1 - inside));
  };
  const below = logit(alpha - std), above = logit(alpha + std);
  const spread = Math.max(0.5 * (above - below), filter.min_evidence_std_logit);
  const bound = 0.5 * (above + below) - quantile(filter.lower_bound_confidence) * spread;
  return Math.max((1 / (1 + Math.exp(-bound)) - clip) / (1 - clip), 0);
}
