// The plan of the hall, and what the drawings share: colours, sizes and sharp canvases.

const PALETTE = {};

function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["card", "ink", "soft", "line", "floor", "accent", "robot", "rack",
    "rack-edge", "scan", "unaware", "unsure", "aware", "unknown", "s0", "s1", "s2", "s3"]) {
    PALETTE[name] = style.getPropertyValue("--" + name).trim();
  }
  PALETTE.ramp = ["unaware", "unsure", "aware"].map((name) =>
    [1, 3, 5].map((at) => parseInt(PALETTE[name].slice(at, at + 2), 16)));
}

// Red for unaware, amber, green for aware; grey where there is no evidence.
function awarenessColour(alpha, opacity = 1) {
  if (alpha === null || alpha === undefined) return withOpacity(PALETTE.unknown, opacity);
  const half = alpha < 0.5 ? 0 : 1;
  const share = Math.min(Math.max(2 * alpha - half, 0), 1);
  const mixed = PALETTE.ramp[half].map((low, index) =>
    Math.round(low + share * (PALETTE.ramp[half + 1][index] - low)));
  return `rgb(${mixed.join(" ")} / ${opacity})`;
}

function withOpacity(colour, opacity) {
  const parts = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  return `rgb(${parts.join(" ")} / ${opacity})`;
}

const trackColour = (id) => PALETTE["s" + (id % 4)];

// Return a context whose unit is the CSS pixel, of a canvas as large as it is shown.
function prepare(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = Math.max(canvas.clientWidth, 1), height = Math.max(canvas.clientHeight, 1);
  const wanted = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== wanted[0]) canvas.width = wanted[0];
  if (canvas.height !== wanted[1]) canvas.height = wanted[1];
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.lineJoin = "round";
  return { pen, width, height };
}

function font(pen, size, weight = 400) {
  pen.font = `${weight} ${size}px system-ui, -apple-system, "Segoe UI", Roboto, sans-serif`;
}

// Requests and answers of the last 2 s, of each track the latest; each is in one state only.
const SHOWN_S = 2;

function recentRequests(states, index) {
  const latest = new Map();
  for (let at = index; at >= 0 && states[index].t_s - states[at].t_s <= SHOWN_S; at -= 1) {
    const { requests = [], answers = [] } = states[at];
    for (const { id, after_s } of answers) {
      if (!latest.has(id)) latest.set(id, { id, answered: true, text: `track ${id} looked after ${after_s.toFixed(1)} s` });
    }
    for (const { id, means, wins_s, reason } of requests) {
      if (!latest.has(id)) latest.set(id, { id, answered: false, reason, text: `asks track ${id} by ${means}: wins ${wins_s.toFixed(1)} s` });
    }
  }
  return [...latest.values()];
}

// Text that stays legible over any drawing.
function writeOver(pen, text, x, y, colour, halo) {
  pen.lineWidth = 4;
  pen.strokeStyle = halo;
  pen.strokeText(text, x, y);
  pen.fillStyle = colour;
  pen.fillText(text, x, y);
}

function drawPlan(canvas, begin, states, index, layers) {
  const { pen, width, height } = prepare(canvas);
  const [left, bottom, right, top] = begin.plan_odom_m;
  const scale = Math.min(width / (right - left), height / (top - bottom));
  const x = (value) => width / 2 + (value - (left + right) / 2) * scale;
  const y = (value) => height / 2 - (value - (bottom + top) / 2) * scale;
  const state = states[index];

  const floor = begin.floor_odom_m;
  pen.fillStyle = PALETTE.floor;
  pen.fillRect(x(floor[0]), y(floor[3]), (floor[2] - floor[0]) * scale, (floor[3] - floor[1]) * scale);
  gridOfMetres(pen, floor, x, y);
  pen.lineWidth = 1;
  pen.strokeStyle = PALETTE["rack-edge"];
  pen.fillStyle = PALETTE.rack;
  for (const [x0, y0, x1, y1] of begin.boxes_odom_m) {
    pen.beginPath();
    pen.rect(x(x0), y(y1), (x1 - x0) * scale, (y1 - y0) * scale);
    pen.fill();
    pen.stroke();
  }
  goalMark(pen, x(begin.goal_odom_m[0]), y(begin.goal_odom_m[1]));
  if (!state) return;

  if (layers.paths) paths(pen, states, index, x, y);
  if (layers.rings) for (const each of state.obstacles) obstacle(pen, each, x, y, scale);
  if (layers.scan) {
    pen.fillStyle = PALETTE.scan;
    const points = state.scan_odom_cm;
    for (let at = 0; at < points.length; at += 2) {
      pen.fillRect(x(points[at] / 100) - 1, y(points[at + 1] / 100) - 1, 2, 2);
    }
  }
  if (layers.cones) {
    for (const person of state.people) cone(pen, person, begin.cone_half_angle_rad, x, y, scale);
  }
  for (const person of state.people) {
    pen.beginPath();
    pen.arc(x(person.odom[0]), y(person.odom[1]), Math.max(begin.body_radius_m * scale, 4), 0, 7);
    pen.fillStyle = PALETTE.ink;
    pen.fill();
  }
  viewEdges(pen, begin, state, x, y);
  robot(pen, begin, state, x, y, scale);
  if (layers.tracks) for (const track of state.tracks) trackMark(pen, track, state, x, y, scale, height);
  for (const each of recentRequests(states, index)) requestMark(pen, each, state, x, y, scale);
  scaleBar(pen, scale, height);
}

function gridOfMetres(pen, floor, x, y) {
  pen.strokeStyle = withOpacity(PALETTE.line, 0.6);
  pen.lineWidth = 1;
  pen.beginPath();
  for (let at = Math.ceil(floor[0]); at <= floor[2]; at += 1) {
    pen.moveTo(Math.round(x(at)) + 0.5, y(floor[1]));
    pen.lineTo(Math.round(x(at)) + 0.5, y(floor[3]));
  }
  for (let at = Math.ceil(floor[1]); at <= floor[3]; at += 1) {
    pen.moveTo(x(floor[0]), Math.round(y(at)) + 0.5);
    pen.lineTo(x(floor[2]), Math.round(y(at)) + 0.5);
  }
  pen.stroke();
}

function goalMark(pen, u, v) {
  pen.strokeStyle = PALETTE.robot;
  pen.lineWidth = 2;
  pen.beginPath();
  pen.arc(u, v, 8, 0, 7);
  pen.moveTo(u + 3, v);
  pen.arc(u, v, 3, 0, 7);
  pen.stroke();
  font(pen, 12);
  pen.textAlign = "center";
  writeOver(pen, "goal", u, v - 13, PALETTE.ink, PALETTE.floor);
}

function paths(pen, states, index, x, y) {
  const line = (place, colour, dash) => {
    pen.beginPath();
    for (let at = 0; at <= index; at += 1) {
      const point = place(states[at]);
      if (point) pen.lineTo(x(point[0]), y(point[1]));
    }
    pen.setLineDash(dash);
    pen.strokeStyle = colour;
    pen.lineWidth = 1.6;
    pen.stroke();
    pen.setLineDash([]);
  };
  line((state) => state.robot_odom, PALETTE.robot, []);
  states[index].people.forEach((_, number) =>
    line((state) => state.people[number] && state.people[number].odom, PALETTE.soft, [2, 3]));
}

function obstacle(pen, each, x, y, scale) {
  pen.beginPath();
  pen.arc(x(each.odom[0]), y(each.odom[1]), each.radius_m * scale, 0, 7);
  pen.fillStyle = awarenessColour(each.awareness_lower, 0.16);
  pen.fill();
  pen.strokeStyle = awarenessColour(each.awareness_lower);
  pen.lineWidth = 2;
  pen.stroke();
}

function cone(pen, person, half, x, y, scale) {
  const [px, py, gaze] = person.odom;
  const length = Math.max(1.2 * scale, 20);
  pen.beginPath();
  pen.moveTo(x(px), y(py));
  pen.arc(x(px), y(py), length, -gaze - half, -gaze + half);
  pen.closePath();
  pen.fillStyle = awarenessColour(person.awareness, 0.5);
  pen.fill();
  pen.strokeStyle = awarenessColour(person.awareness);
  pen.lineWidth = 1.2;
  pen.stroke();
}

// The edges of what the camera sees; one that sees all around has none.
function viewEdges(pen, begin, state, x, y) {
  if (begin.camera_fov_rad >= 2 * Math.PI - 0.01) return;
  const [px, py, heading] = state.robot_odom;
  pen.beginPath();
  for (const side of [-1, 1]) {
    const angle = heading + (side * begin.camera_fov_rad) / 2;
    pen.moveTo(x(px), y(py));
    pen.lineTo(x(px + 3 * Math.cos(angle)), y(py + 3 * Math.sin(angle)));
  }
  pen.setLineDash([4, 4]);
  pen.strokeStyle = PALETTE.soft;
  pen.lineWidth = 1;
  pen.stroke();
  pen.setLineDash([]);
}

function robot(pen, begin, state, x, y, scale) {
  const [px, py, heading] = state.robot_odom;
  const cos = Math.cos(heading), sin = Math.sin(heading);
  pen.beginPath();
  for (const [a, b] of begin.footprint_m) {
    pen.lineTo(x(px + a * cos - b * sin), y(py + a * sin + b * cos));
  }
  pen.closePath();
  pen.fillStyle = PALETTE.robot;
  pen.fill();
  // The arrow is the way that the robot drives in a second.
  const reach = Math.max(...begin.footprint_m.map((corner) => corner[0]));
  const length = reach + Math.max(state.speed_mps, 0);
  arrow(pen, x(px + reach * cos), y(py + reach * sin),
    x(px + length * cos), y(py + length * sin), PALETTE.robot, 3);
}

function arrow(pen, u0, v0, u1, v1, colour, thickness) {
  const length = Math.hypot(u1 - u0, v1 - v0);
  if (length < 4) return;
  const a = (u1 - u0) / length, b = (v1 - v0) / length, head = Math.min(3 * thickness, length);
  pen.strokeStyle = pen.fillStyle = colour;
  pen.lineWidth = thickness;
  pen.beginPath();
  pen.moveTo(u0, v0);
  pen.lineTo(u1 - a * head, v1 - b * head);
  pen.stroke();
  pen.beginPath();
  pen.moveTo(u1, v1);
  pen.lineTo(u1 - a * head - b * head * 0.6, v1 - b * head + a * head * 0.6);
  pen.lineTo(u1 - a * head + b * head * 0.6, v1 - b * head - a * head * 0.6);
  pen.fill();
}

function trackMark(pen, track, state, x, y, scale, bottom) {
  const [px, py, vx, vy] = track.odom;
  const u = x(px), v = y(py), colour = trackColour(track.id);
  if (v < 0 || v > bottom) return;
  arrow(pen, u, v, x(px + vx), y(py + vy), colour, 2);
  pen.strokeStyle = colour;
  pen.lineWidth = 2.5;
  pen.setLineDash(track.status === "confirmed" ? [] : [3, 2]);
  pen.strokeRect(u - 6, v - 6, 12, 12);
  pen.setLineDash([]);
  const kept = state.obstacles.find((each) => each.id === track.id);
  const away = kept ? Math.max(kept.radius_m * scale, 14) : 14;
  font(pen, 12.5, 600);
  pen.textAlign = "center";
  const bound = kept ? kept.awareness_lower : track.awareness_lower;
  const name = state.tracks.length > 3 ? "" : "track ";
  const before = kept && kept.noticed_s !== null && kept.noticed_s !== undefined;
  const known = before ? `noticed ${kept.noticed_s.toFixed(1)} s ago` : `α ≥ ${bound.toFixed(2)}`;
  const text = `${name}${track.id}: ${known}`;
  writeOver(pen, text, u, Math.max(v - away - 6, 14), PALETTE.ink, PALETTE.floor);
}

// Waves about the person and a line from the robot that asks; green once the person has looked.
function requestMark(pen, request, state, x, y, scale) {
  const held = (each) => each.id === request.id;
  const found = state.tracks.find(held) || state.obstacles.find(held);
  if (!found) return;
  const u = x(found.odom[0]), v = y(found.odom[1]);
  pen.strokeStyle = request.answered ? PALETTE.aware : PALETTE.robot;
  pen.lineWidth = 2;
  if (!request.answered) {
    pen.beginPath();
    pen.moveTo(x(state.robot_odom[0]), y(state.robot_odom[1]));
    pen.lineTo(u, v);
    pen.setLineDash([2, 5]);
    pen.stroke();
    pen.setLineDash([]);
  }
  for (const radius_m of [0.42, 0.62]) {
    pen.beginPath();
    pen.arc(u, v, Math.max(radius_m * scale, 40 * radius_m), 0, 7);
    pen.stroke();
  }
}

function scaleBar(pen, scale, height) {
  pen.strokeStyle = PALETTE.ink;
  pen.lineWidth = 2;
  pen.beginPath();
  pen.moveTo(14, height - 12);
  pen.lineTo(14 + scale, height - 12);
  pen.stroke();
  font(pen, 12);
  pen.textAlign = "left";
  writeOver(pen, "1 m", 16, height - 18, PALETTE.ink, PALETTE.floor);
}
