// The time line: awareness of each track with its bound, speed, limit and what sets the limit.

const GUTTER = { left: 36, right: 8 };

function timeScale(width, states, begin) {
  const last = states.length ? states[states.length - 1].t_s : begin.planned_s;
  const span = Math.max(last, begin.step_s);
  const inner = width - GUTTER.left - GUTTER.right;
  return {
    x: (t_s) => GUTTER.left + (t_s / span) * inner,
    t: (x) => ((x - GUTTER.left) / inner) * span,
    span,
  };
}

function axes(pen, time, height, bottom, ticks, y) {
  font(pen, 11.5);
  pen.textBaseline = "middle";
  pen.textAlign = "right";
  pen.lineWidth = 1;
  for (const tick of ticks) {
    pen.strokeStyle = PALETTE.line;
    pen.beginPath();
    pen.moveTo(GUTTER.left, Math.round(y(tick)) + 0.5);
    pen.lineTo(time.x(time.span), Math.round(y(tick)) + 0.5);
    pen.stroke();
    pen.fillStyle = PALETTE.soft;
    pen.fillText(String(tick), GUTTER.left - 6, y(tick));
  }
  pen.textBaseline = "alphabetic";
  pen.textAlign = "center";
  const inner = time.x(time.span) - GUTTER.left;
  const step = [0.5, 1, 2, 5, 10, 20].find((each) => (each / time.span) * inner > 56) || 50;
  for (let t = 0; t <= time.span + 1e-9; t += step) {
    pen.fillStyle = PALETTE.soft;
    pen.fillText(t === 0 ? "0 s" : String(+t.toFixed(1)), time.x(t), height - bottom + 14);
  }
}

function playhead(pen, time, state, height) {
  pen.strokeStyle = PALETTE.ink;
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.moveTo(time.x(state.t_s), 0);
  pen.lineTo(time.x(state.t_s), height);
  pen.stroke();
}

// With more tracks than this, each is drawn as what counts alone until one is chosen.
const MOST_WHOLE_TRACKS = 3;

function drawAlpha(canvas, begin, states, index, chosen) {
  const { pen, width, height } = prepare(canvas);
  const time = timeScale(width, states, begin), bottom = 18;
  const y = (alpha) => 8 + (1 - alpha) * (height - bottom - 14);
  axes(pen, time, height, bottom, [0, 0.5, 1], y);
  const all = tracksOver(states);
  const whole = chosen !== null || new Set(all.map((run) => run.id)).size <= MOST_WHOLE_TRACKS;
  for (const run of chosen === null ? all : all.filter((each) => each.id === chosen)) {
    const colour = trackColour(run.id);
    if (whole) {
      pen.beginPath();
      for (const [t, alpha] of run.points) pen.lineTo(time.x(t), y(alpha));
      for (const [t, , lower] of [...run.points].reverse()) pen.lineTo(time.x(t), y(lower));
      pen.closePath();
      pen.fillStyle = withOpacity(colour, 0.2);
      pen.fill();
      curve(pen, run.points.map(([t, alpha]) => [time.x(t), y(alpha)]), colour, 1.2);
    }
    curve(pen, run.points.map(([t, , , counts]) => [time.x(t), y(counts)]), colour, 2.6);
  }
  pen.fillStyle = PALETTE.ink;
  const every = Math.max(Math.round((4 * states.length) / Math.max(width, 1)), 1);
  for (let at = 0; whole && at < states.length; at += every) {
    for (const person of peopleOf(states[at], chosen)) {
      pen.fillRect(time.x(states[at].t_s) - 0.8, y(person.awareness) - 0.8, 1.6, 1.6);
    }
  }
  if (states[index]) playhead(pen, time, states[index], height - bottom);
}

// Return the person whom a track follows; everybody without one.
function peopleOf(state, chosen) {
  if (chosen === null) return state.people;
  const track = state.tracks.find((each) => each.id === chosen);
  if (!track) return [];
  const away = (person) =>
    Math.hypot(person.odom[0] - track.odom[0], person.odom[1] - track.odom[1]);
  const nearest = [...state.people].sort((one, other) => away(one) - away(other))[0];
  return nearest && away(nearest) < 1 ? [nearest] : [];
}

// Return runs of states in which a track is there, as [t_s, α, lower bound, what counts].
function tracksOver(states) {
  const open = new Map(), runs = [];
  states.forEach((state, number) => {
    for (const track of state.tracks) {
      let run = open.get(track.id);
      if (!run || run.last !== number - 1) {
        run = { id: track.id, points: [], last: number };
        open.set(track.id, run);
        runs.push(run);
      }
      run.last = number;
      const kept = state.obstacles.find((each) => each.id === track.id);
      const counts = kept ? kept.awareness_lower : track.awareness_lower;
      run.points.push([state.t_s, track.awareness, track.awareness_lower, counts]);
    }
  });
  return runs;
}

function curve(pen, points, colour, thickness) {
  pen.beginPath();
  for (const [u, v] of points) pen.lineTo(u, v);
  pen.strokeStyle = colour;
  pen.lineWidth = thickness;
  pen.stroke();
}

// "track 3: start reserve" is the rule "start reserve".
const ruleOf = (reason) => reason.replace(/^track \d+: /, "");

function drawMotion(canvas, begin, states, index) {
  const { pen, width, height } = prepare(canvas);
  const time = timeScale(width, states, begin), strip = 18, bottom = 38;
  const top = Math.max(begin.max_speed_mps, ...states.map((state) => state.limit_mps));
  const y = (speed) => 8 + (1 - Math.max(speed, 0) / top) * (height - bottom - 14);
  const ticks = top > 1.6 ? [0, 1, 2].filter((each) => each <= top) : [0, 0.5, 1, 1.5].filter((each) => each <= top);
  axes(pen, time, height, 18, ticks, y);
  if (!states.length) return;
  pen.beginPath();
  pen.moveTo(time.x(states[0].t_s), y(0));
  for (const state of states) pen.lineTo(time.x(state.t_s), y(state.speed_mps));
  pen.lineTo(time.x(states[states.length - 1].t_s), y(0));
  pen.fillStyle = withOpacity(PALETTE.robot, 0.28);
  pen.fill();
  curve(pen, states.map((state) => [time.x(state.t_s), y(state.speed_mps)]), PALETTE.robot, 1.5);
  curve(pen, states.map((state) => [time.x(state.t_s), y(state.limit_mps)]), PALETTE.unaware, 2);
  reasons(pen, time, states, height - 18 - strip, strip - 3);
  if (states[index]) playhead(pen, time, states[index], height - 18);
}

function reasons(pen, time, states, top, tall) {
  font(pen, 11.5);
  pen.textAlign = "left";
  let from = 0;
  for (let at = 1; at <= states.length; at += 1) {
    const rule = ruleOf(states[from].limited_by);
    if (at < states.length && ruleOf(states[at].limited_by) === rule) continue;
    const end = states[Math.min(at, states.length - 1)].t_s;
    const left = time.x(states[from].t_s), right = time.x(end);
    const free = rule === "robot maximum";
    pen.fillStyle = free ? withOpacity(PALETTE.soft, 0.16) : withOpacity(PALETTE.unaware, 0.16);
    pen.fillRect(left, top, Math.max(right - left - 1, 1), tall);
    pen.fillStyle = free ? PALETTE["rack-edge"] : PALETTE.unaware;
    pen.fillRect(left, top, 2, tall);
    if (pen.measureText(rule).width + 10 < right - left) {
      pen.fillStyle = PALETTE.ink;
      pen.fillText(rule, left + 6, top + 11.5);
    }
    from = at;
  }
}
