// The outline of the obstacle beyond its circle. The Python original is nav_adapter/_obstacles.py.

const SIDES = 24;
const SWEEP_STEP_S = 0.25;
const WALKING_MPS = 0.1;
const UNIT_POLYGON = Array.from({ length: SIDES }, (_, side) => {
  const angle = side * ((2 * Math.PI) / SIDES), reach = 1 / Math.cos(Math.PI / SIDES);
  return [reach * Math.cos(angle), reach * Math.sin(angle)];
});

/** The obstacle's polygon: corners [x, y] in the base frame, counter-clockwise. */
function obstaclePolygon(policy, state, found) {
  const { outline, margins } = policy, { person, radius_m: radius } = found;
  const disc = ([x, y], size) => UNIT_POLYGON.map(([ux, uy]) => [x + size * ux, y + size * uy]);
  const points = disc(person.predicted, radius);
  if (!(outline.unaware_ahead_s > 0 || outline.sweep_s > 0)) return points;
  const [x, y] = person.predicted, { vx_mps: vx, vy_mps: vy } = state;
  const [dx, dy] = person.walking > WALKING_MPS
    ? [vx / person.walking, vy / person.walking] : [1, 0];
  points.push(...disc([x + found.ahead_m * dx, y + found.ahead_m * dy], radius));
  const steps = Math.ceil(outline.sweep_s / SWEEP_STEP_S);
  for (let step = 1; step <= steps; step += 1) {
    const ahead = (outline.sweep_s * step) / steps;
    const time = state.data_age_s + ahead;
    const position2 = state.sigma_m ** 2 + time ** 2 * state.velocity_sigma_mps ** 2;
    const noise = (outline.acceleration_density_m2ps3 * ahead ** 3) / 3;
    const grown = Math.sqrt((position2 + noise) * (1 + outline.overconfidence_per_s * ahead));
    const wider = margins.uncertainty_sigmas * Math.max(0, grown - person.sigma);
    points.push(...disc([x + ahead * vx, y + ahead * vy], bounded(margins, radius + wider)));
  }
  return hullOf(points);
}
