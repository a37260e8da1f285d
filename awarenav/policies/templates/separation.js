// Speed and separation, and distances from the robot.
// The Python originals are nav_adapter/_separation.py, _footprint.py and _protective_field.py.

/** The highest speed whose protective separation is at most `gap`. */
function highestSpeed(gap, human, braking, reaction, clearance, share) {
  const spare = gap - clearance - human * reaction;
  if (!(spare > 0)) return 0;
  const b = share * braking * reaction + human;
  const denominator = b + Math.sqrt(b * b + 2 * braking * share * spare);
  if (denominator > 0) return (2 * braking * spare) / denominator;
  return share === 0 ? Infinity : 0;
}

/**
 * The same for a person who stands and speeds up by at most `starting`, `delay` ago at first.
 * A delay below 0, but at least −`reaction`, is the time for which the person still stands.
 */
function highestSpeedFromStanding(
  gap, human, braking, reaction, clearance, share, starting, delay,
) {
  const walker = highestSpeed(gap, human, braking, reaction, clearance, share);
  if (!Number.isFinite(starting) || !Number.isFinite(delay)) return walker;
  const speedingUp = human / starting;
  const lead = human * (delay - 0.5 * speedingUp);
  const late = highestSpeed(gap, human, braking, reaction, clearance + lead, share);
  const since = reaction + delay;
  const spare = Math.max(gap - clearance - 0.5 * starting * since * since, 0) || 0;
  const b = (starting * since) / braking + share * reaction;
  const root = Math.sqrt(b * b + ((2 * (starting / braking + share)) / braking) * spare);
  const early = b + root > 0 ? (2 * spare) / (b + root) : 0;
  const starter = since + early / braking <= speedingUp ? early : late;
  return Math.max(walker, starter);
}

/** The way that a person walks in `time`, at once or from standing. */
function walked(time, human, starting, delay) {
  if (!Number.isFinite(starting) || !Number.isFinite(delay)) return human * time;
  const since = Math.max(time + delay, 0);
  const speedingUp = Math.min(since, human / starting);
  const started = 0.5 * starting * speedingUp * speedingUp + human * (since - speedingUp);
  return Math.min(human * time, started);
}

/** The way that the robot drives until it stands. */
const stopping = (speed, braking, reaction) => speed * reaction + (speed * speed) / (2 * braking);

/** The convex hull of points, counter-clockwise. */
function hullOf(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const turn = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
  const half = (list) => {
    const chain = [];
    for (const point of list) {
      while (chain.length > 1 && turn(chain.at(-2), chain.at(-1), point) <= 0) chain.pop();
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

const HULLS = new WeakMap();

/** The convex hull of a robot's footprint, which must not change in place. */
function hullOfRobot({ footprint_m: corners }) {
  if (!HULLS.has(corners)) HULLS.set(corners, hullOf(corners));
  return HULLS.get(corners);
}

/** The distance of a point from a convex outline, 0 inside. */
function distanceFrom(hull, [x, y]) {
  let nearest2 = Infinity, inside = true;
  hull.forEach(([startX, startY], index) => {
    const [endX, endY] = hull[(index + 1) % hull.length];
    const edgeX = endX - startX, edgeY = endY - startY;
    const toX = x - startX, toY = y - startY;
    const along = (toX * edgeX + toY * edgeY) / (edgeX * edgeX + edgeY * edgeY);
    const clipped = Math.min(Math.max(along, 0), 1);
    const awayX = toX - clipped * edgeX, awayY = toY - clipped * edgeY;
    nearest2 = Math.min(nearest2, awayX * awayX + awayY * awayY);
    inside = inside && edgeX * toY >= edgeY * toX;
  });
  return inside ? 0 : Math.sqrt(nearest2);
}

/** The circle about the base origin that contains the footprint. */
const circumscribed = (robot) => Math.max(...robot.footprint_m.map(([x, y]) => Math.hypot(x, y)));

const LATERAL_NOISE_MPS = 0.1;
const STANDING_MPS = 0.05;

/** The speed and the direction of travel in the base frame; the heading for a robot that stands. */
function travelOf(state) {
  const travel = Math.hypot(state.speed_mps, state.lateral_mps);
  const backward = state.speed_mps < 0 || Object.is(state.speed_mps, -0);
  if (Math.abs(state.lateral_mps) > LATERAL_NOISE_MPS)
    return { travel, direction: [state.speed_mps / travel, state.lateral_mps / travel] };
  return { travel, direction: [backward ? -1 : 1, 0] };
}

/** Whether a body reaches into the straight path of the robot, or beside it. */
function inPath(robot, [ahead, left], besideM, [x, y], error) {
  const along = robot.footprint_m.map(([cx, cy]) => cx * ahead + cy * left);
  const across = robot.footprint_m.map(([cx, cy]) => cy * ahead - cx * left);
  const forward = ahead * x + left * y, aside = ahead * y - left * x;
  const body = DATA.body_radius_m + error;
  const reach = body + besideM;
  return (
    Math.min(...across) - reach <= aside &&
    aside <= Math.max(...across) + reach &&
    forward >= Math.min(...along) - body
  );
}
