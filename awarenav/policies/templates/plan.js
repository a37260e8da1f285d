// The plan view: robot, person and obstacle from above, to scale. The robot heads to the right.

const plan = { bounds: null };

/** The radius that the same person would have when unaware. */
function unawareRadius(policy, found) {
  const added = policy.margins.uncertainty_sigmas * found.person.sigma;
  return bounded(policy.margins, policyRadius(policy, 0) + added);
}

/** Draws the plan view. */
function drawPlan(policy, robot, state, found, drag) {
  const svg = byId("plan"), width = Math.max(svg.clientWidth, 200), height = svg.clientHeight;
  const [x, y] = found.person.predicted, unaware = unawareRadius(policy, found);
  const hull = hullOfRobot(robot), polygon = obstaclePolygon(policy, state, found);
  const stop = stopZone(robot, state, hull, found.stopping_m);
  if (!plan.dragging || !plan.bounds) plan.bounds = boundsOf([
    ...hull, ...stop, ...polygon, [x - unaware, y - unaware], [x + unaware, y + unaware],
  ], width / height);
  const { left, top, metres } = plan.bounds, scale = width / metres;
  const px = (mx) => (mx - left) * scale, py = (my) => (top - my) * scale;
  const shape = (points, look) =>
    `<path class="${look}" d="${path(points.map(([a, b]) => [px(a), py(b)]))}Z"/>`;
  const circle = (radius, look, [cx, cy] = [x, y]) =>
    `<circle class="${look}" cx="${px(cx)}" cy="${py(cy)}" r="${radius * scale}"/>`;
  let out = gridOf(width, height, left, top, metres, scale);
  out += shape(stop, "stopzone") + shape(polygon, "obstacle");
  out += circle(unaware, "unaware") + circle(found.radius_m, "obstacleline");
  if (found.uncertainty_m > 0) out += circle(DATA.body_radius_m + found.uncertainty_m, "sigma");
  out += circle(DATA.body_radius_m, "body") + shape(robot.footprint_m, "robot");
  out += arrow(px, py, [0, 0], [state.speed_mps, state.lateral_mps], "motion");
  out += arrow(px, py, [x, y], [state.vx_mps, state.vy_mps], "walk");
  const size = `radius ${fixed(found.radius_m)} m`, side = Math.max(...hull.map(([, b]) => b));
  out += placed(px(x), py(y - found.radius_m) + 14, size, width, height);
  out += placed(px(0), py(side) - 6, "robot", width, height);
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.setAttribute("aria-label", `From above: obstacle radius ${fixed(found.radius_m)} m, person `
    + `${fixed(x)} m ahead and ${fixed(y)} m to the left of the robot`);
  svg.innerHTML = out;
  svg.pointed = (atX, atY) => drag(left + atX / scale, top - atY / scale);
}

/** The floor that the robot covers until it stands from the limit, straight ahead. */
function stopZone(robot, state, hull, way) {
  const [ahead, aside] = travelOf(state).direction;
  return hullOf([...hull, ...hull.map(([x, y]) => [x + way * ahead, y + way * aside])]);
}

/** Whole half metres around all points, in the shape of the drawing. */
function boundsOf(points, ratio) {
  const xs = points.map(([x]) => x), ys = points.map(([, y]) => y);
  const from = Math.min(...xs, -1) - 0.3, to = Math.max(...xs, 3) + 0.3;
  const low = Math.min(...ys, -1) - 0.25, high = Math.max(...ys, 1) + 0.25;
  const metres = Math.ceil(2 * Math.max(to - from, (high - low) * ratio)) / 2;
  return {
    metres,
    left: Math.round(from + to - metres) / 2,
    top: (low + high) / 2 + metres / ratio / 2,
  };
}

function gridOf(width, height, left, top, metres, scale) {
  let out = "";
  const step = metres > 14 ? 5 : 1;
  for (let x = Math.ceil(left / step) * step; x < left + metres; x += step)
    out += `<path class="grid" d="M${(x - left) * scale} 0V${height}"/>`;
  for (let y = Math.floor(top / step) * step; (top - y) * scale < height; y -= step)
    out += `<path class="grid" d="M0 ${(top - y) * scale}H${width}"/>`;
  const bar = step * scale, at = width - 12;
  return `${out}<path class="scale" d="M${at - bar} ${height - 14}v5h${bar}v-5"/>`
    + `<text class="yt" x="${at - bar - 6}" y="${height - 8}">${step} m</text>`;
}

/** An arrow as long as the way of one second. */
function arrow(px, py, [x, y], [vx, vy], look) {
  const speed = Math.hypot(vx, vy);
  if (speed < 0.02) return "";
  const [x0, y0, x1, y1] = [px(x), py(y), px(x + vx), py(y + vy)];
  const [ux, uy] = [vx / speed, -vy / speed], size = 8;
  const wing = (side) => [
    x1 - size * (ux - side * 0.6 * uy), y1 - size * (uy + side * 0.6 * ux),
  ].join(" ");
  return `<path class="${look}" d="M${x0} ${y0}L${x1} ${y1}"/>`
    + `<path class="${look} head" d="M${x1} ${y1}L${wing(1)}L${wing(-1)}Z"/>`;
}

/** A text at a place, or as near to it as the drawing allows. */
function placed(x, y, text, width, height) {
  const inX = Math.min(Math.max(x, 40), width - 48), inY = Math.min(Math.max(y, 14), height - 22);
  return `<text class="xt name" x="${inX}" y="${inY}">${text}</text>`;
}
