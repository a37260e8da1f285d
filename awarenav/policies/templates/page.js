// The page: what is shown, and what happens when it changes.

const page = {
  draft: checkedPolicy(DATA.policy.values),
  policy: checkedPolicy(DATA.policy.values),
  robotDraft: structuredClone(DATA.robot),
  robot: structuredClone(DATA.robot),
  situation: Object.fromEntries(
    Object.values(DATA.situation).flat().map((field) => [field.key, field.default]),
  ),
  before: null,
  open: new Set(["Person", "inflation", "speed"]),
};

/** The state that the arithmetic takes, from the controls of the situation. */
function stateOf(situation, robot, filter) {
  const bearing = radians(situation.bearing_deg), unit = [Math.cos(bearing), Math.sin(bearing)];
  const hull = hullOfRobot(robot), goal = situation.gap_m + DATA.body_radius_m;
  // The distance along the bearing at which the outline is that far away.
  let near = 0, far = goal + circumscribed(robot);
  for (let round = 0; round < 60; round += 1) {
    const middle = 0.5 * (near + far);
    if (distanceFrom(hull, unit.map((each) => each * middle)) < goal) near = middle;
    else far = middle;
  }
  const walking = bearing + Math.PI - radians(situation.walking_deg), speed = situation.walking_mps;
  const measured = situation.awareness_from !== "lower bound of α";
  return {
    ...situation,
    x_m: far * unit[0], y_m: far * unit[1],
    vx_mps: speed ? speed * Math.cos(walking) : 0, vy_mps: speed ? speed * Math.sin(walking) : 0,
    awareness_lower: measured
      ? lowerBound(situation.awareness, situation.awareness_std, filter)
      : situation.awareness_lower,
  };
}

const snapshot = () => structuredClone({
  policy: page.policy, robot: page.robot, situation: page.situation,
});

/** Keeps what is shown now, to be compared with what follows. */
function beginChange() {
  page.before = snapshot();
}

/** The answer as a function of changes: a distance `gap_m`, a lower bound `alpha`, or neither. */
function answerer({ policy, robot, situation }) {
  const here = stateOf(situation, robot, policy.filter);
  return ({ gap_m: gap, alpha } = {}) => {
    const state = gap === undefined
      ? here : stateOf({ ...situation, gap_m: gap }, robot, policy.filter);
    const bound = alpha ?? state.awareness_lower;
    return answer(policy, robot, { ...state, awareness_lower: bound });
  };
}

const answerIn = (which, change) => answerer(which)(change);

/** Takes over the drafts if they are valid; else says why not. */
function takeDrafts() {
  let problem = "";
  try {
    page.policy = checkedPolicy(page.draft);
  } catch (error) {
    if (!(error instanceof PolicyError)) throw error;
    problem = error.message;
  }
  problem ||= robotProblem(page.robotDraft) || situationProblem(page.situation);
  if (!problem) page.robot = structuredClone(page.robotDraft);
  const box = byId("problem");
  box.hidden = !problem;
  box.textContent = `Not valid, so the drawings show the last valid values: ${problem}`;
  byId("save").disabled = Boolean(problem);
  return !problem;
}

function robotProblem(robot) {
  try {
    for (const field of DATA.robot_fields)
      if (field.kind === "number") checkedNumber(field, robot[field.key], `robot: ${field.key}`);
  } catch (error) {
    return error.message;
  }
  const corners = robot.footprint_m;
  if (corners.length < 3 || !corners.flat().every(Number.isFinite))
    return "robot: footprint_m must have at least 3 corners, all of them finite";
  const hull = hullOf(corners);
  const twice = hull.reduce((sum, [x, y], at) => {
    const [nextX, nextY] = hull[(at + 1) % hull.length];
    return sum + x * nextY - y * nextX;
  }, 0);
  return 0.5 * twice < 1e-6 ? "robot: footprint_m must enclose an area" : "";
}

function situationProblem(situation) {
  try {
    for (const field of Object.values(DATA.situation).flat())
      if (field.kind === "number") checkedField(field, situation[field.key], field.label);
  } catch (error) {
    return error.message;
  }
  return "";
}

let waiting = 0;

/** Draws everything in the next frame of the screen. */
function redraw() {
  cancelAnimationFrame(waiting);
  waiting = requestAnimationFrame(draw);
}

function draw() {
  const { policy, robot, situation } = page, now = { policy, robot, situation };
  const state = stateOf(situation, robot, policy.filter), found = answer(policy, robot, state);
  const other = compared();
  byId("answers").innerHTML = answersOf(found, other && answerIn(other));
  byId("sentence").innerHTML = sentenceOf(policy, robot, state, found);
  drawPlan(policy, robot, state, found, dragPerson);
  drawBudget(budgetOf(policy, robot, state, found));
  drawCharts(now, other, found, state);
  drawLegend(now, other);
  const text = byId("text");
  if (document.activeElement !== text) text.value = policyYaml(policy);
}

/** What the dashed curves show: a preset for the same situation, or what was before. */
function compared() {
  const choice = byId("compare").value;
  if (choice === "nothing") return null;
  if (Object.hasOwn(DATA.presets, choice))
    return { policy: DATA.presets[choice], robot: page.robot, situation: page.situation };
  const { before } = page;
  const same = !before || JSON.stringify(before) === JSON.stringify(snapshot());
  return same ? null : before;
}

function drawCharts(now, other, found, state) {
  const { robot, situation } = now;
  const top = Math.max(robot.max_speed_mps, other?.robot.max_speed_mps ?? 0);
  const farthest = Math.max(6, Math.ceil(situation.gap_m));
  const ours = answerer(now), theirs = other && answerer(other);
  const over = (field, change) => {
    const of = (answers, extra = {}) => (at) => answers({ ...change(at), ...extra })[field];
    const dashed = theirs ? [{ of: of(theirs), look: "other" }] : [];
    return { of, curves: [...dashed, { of: of(ours), look: "now" }] };
  };
  const limit = over("limit_mps", (at) => ({ gap_m: at }));
  const docked = byId("dock").clientHeight > 0;
  drawTwice(docked, {
    id: "distance", x: [0, farthest], y: [0, 1.08 * top], curves: limit.curves,
    label: "Speed limit over distance; "
      + `${fixed(found.limit_mps)} m/s at ${fixed(situation.gap_m)} m`,
    xText: "distance (m)", yText: "m/s", marks: [[situation.gap_m, found.limit_mps]],
    band: [limit.of(ours, { alpha: 0 }), limit.of(ours, { alpha: 1 })],
    strip: (at) => ours({ gap_m: at }).reason,
    pick: (at) => setSituation("gap_m", Number(at.toFixed(2))),
  });
  const alpha = (at) => ({ alpha: at }), at = state.awareness_lower;
  const pick = (value) => {
    if (situation.awareness_from === "lower bound of α")
      setSituation("awareness_lower", Number(value.toFixed(2)));
  };
  const { margins } = now.policy;
  const most = (field) => Math.max(
    ...[ours, theirs].filter(Boolean).map((answers) => answers({ alpha: 0 })[field]),
  );
  const unaware = most("radius_m"), human = most("human_speed_mps");
  const common = { x: [0, 1], xText: "lower bound of α", pick };
  drawChart({
    ...common, id: "limit", y: [0, 1.08 * top], yText: "m/s", marks: [[at, found.limit_mps]],
    curves: over("limit_mps", alpha).curves, strip: (value) => ours({ alpha: value }).reason,
    label: `Speed limit over the lower bound of α; ${fixed(found.limit_mps)} m/s at ${fixed(at)}`,
  });
  drawTwice(docked, {
    ...common, id: "radius", y: [0, Math.max(1.15 * unaware, 0.5)], yText: "m",
    curves: over("radius_m", alpha).curves, marks: [[at, found.radius_m]],
    lines: [{ y: floorOf(margins), text: `floor ${fixed(floorOf(margins))} m` }],
    label: `Obstacle radius over the lower bound of α; ${fixed(found.radius_m)} m at ${fixed(at)}`,
  });
  drawChart({
    ...common, id: "human", y: [0, Math.max(1.15 * human, 0.2)], yText: "m/s",
    curves: over("human_speed_mps", alpha).curves, marks: [[at, found.human_speed_mps]],
    label: "Human speed that counts over the lower bound of α; "
      + `${fixed(found.human_speed_mps)} m/s at ${fixed(at)}`,
  });
}

/** Draws a chart, and a small one at the bottom of a narrow window. */
function drawTwice(docked, chart) {
  drawChart(chart);
  if (docked) drawChart({ ...chart, id: `dock${chart.id}`, small: true, lines: [], pick: null });
}

function drawLegend(now, other) {
  const choice = byId("compare").value;
  const preset = Object.hasOwn(DATA.presets, choice);
  const rules = Object.entries(RULES)
    .map(([name, look]) => `<li><i class="${look}"></i>${name}</li>`).join("");
  byId("legend").innerHTML = [
    '<li><i class="line now"></i>this policy</li>',
    other ? '<li><i class="line other"></i>' : "",
    other ? `${preset ? `preset ${choice}` : "before the last change"}</li>` : "",
    '<li><i class="bandkey"></i>from unaware to α = 1</li>', rules,
  ].join("");
}

function setSituation(key, value) {
  page.situation[key] = value;
  showNumber(`situation.${key}`, value);
  takeDrafts();
  redraw();
}

/** Shows a value that did not come from its own row. */
function showNumber(id, value) {
  const number = byId(id), slider = byId(`${id}:slider`);
  number.value = String(value);
  slider.value = value;
  const [low, high] = [Number(slider.min), Number(slider.max)];
  const share = (Number(slider.value) - low) / (high - low);
  slider.style.setProperty("--share", `${100 * share}%`);
}

/** Puts the person at a place in the base frame. */
function dragPerson(x, y) {
  const { robot, situation } = page;
  const gap = distanceFrom(hullOfRobot(robot), [x, y]) - DATA.body_radius_m;
  const most = DATA.situation.Person[0].slider[1];
  situation.bearing_deg = Math.round((Math.atan2(y, x) * 180) / Math.PI);
  showNumber("situation.bearing_deg", situation.bearing_deg);
  setSituation("gap_m", Number(Math.min(Math.max(gap, 0), most).toFixed(2)));
}

/** Builds all rows anew; the control with the id `focus` keeps the focus. */
function build(focus) {
  const changed = (rows) => {
    takeDrafts();
    if (rows) build(document.activeElement?.id);
    redraw();
  };
  const rebuilt = (id) => {
    takeDrafts();
    build(id);
    redraw();
  };
  const about = (id, text) => {
    const box = byId("about");
    box.hidden = false;
    box.innerHTML = `<code>${escaped(id.replace("situation.", ""))}</code> ${coded(text)}`;
  };
  const common = { changed, rebuilt, about, open: page.open };
  const groups = Object.entries(DATA.situation).map(([name, fields]) => section(name, fields
    .filter(isShown)
    .map((field) => rowOf(field, {
      ...common, root: page, keys: ["situation", field.key], id: `situation.${field.key}`,
    }))));
  groups.push(section("Robot", DATA.robot_fields.map((field) => rowOf(field, {
    ...common, root: page, keys: ["robotDraft", field.key], id: `robot.${field.key}`,
  }))));
  const top = byId("controls").scrollTop;
  byId("controls").replaceChildren(
    element("h2", {}, "Situation"), ...groups, element("h2", {}, "Policy"),
    ...groupOf("AwarenessPolicy", [], 0, { ...common, root: page.draft }),
  );
  byId("controls").scrollTop = top;
  if (focus) byId(focus)?.focus({ preventScroll: true });
}

/** Whether a control of the situation matters for the kind of awareness that is given. */
function isShown({ key }) {
  const direct = page.situation.awareness_from === "lower bound of α";
  if (key === "awareness_lower") return direct;
  return !["awareness", "awareness_std"].includes(key) || !direct;
}

function section(name, rows) {
  return element("details", {
    open: page.open.has(name), class: "group",
    on: { toggle: (event) => {
      if (event.target.open) page.open.add(name);
      else page.open.delete(name);
    } },
  }, element("summary", {}, name), element("div", { class: "part" }, ...rows));
}

/** Shows another policy. */
function takePolicy(policy) {
  beginChange();
  page.draft = policy;
  build();
  takeDrafts();
  redraw();
}

/** Shows the policy of a YAML text, or says why it cannot be used. */
function takeYaml(text, name) {
  try {
    takePolicy(checkedPolicy(parseYaml(text)));
    byId("preset").value = "";
  } catch (error) {
    if (!(error instanceof PolicyError || error instanceof YamlError)) throw error;
    byId("problem").hidden = false;
    byId("problem").textContent = `${name} is not used: ${error.message}`;
  }
}

function start() {
  const names = Object.keys(DATA.presets), preset = byId("preset"), compare = byId("compare");
  const isPreset = names.includes(DATA.policy.name);
  preset.append(...(isPreset ? [] : [element("option", { value: "file" }, DATA.policy.name)]));
  preset.append(element("option", { value: "", hidden: true }, "your own"));
  preset.append(...names.map((name) => element("option", { value: name }, name)));
  preset.value = isPreset ? DATA.policy.name : "file";
  preset.addEventListener("change", () => takePolicy(checkedPolicy(structuredClone(
    DATA.presets[preset.value] ?? DATA.policy.values,
  ))));
  const others = ["the last change", "nothing", ...names];
  compare.append(...others.map((name) => element("option", { value: name }, name)));
  compare.addEventListener("change", redraw);
  byId("load").addEventListener("change", async (event) => {
    const [file] = event.target.files;
    if (file) takeYaml(await file.text(), file.name);
    event.target.value = "";
  });
  byId("save").addEventListener("click", () => {
    const link = element("a", { download: "policy.yaml" });
    link.href = URL.createObjectURL(new Blob([policyYaml(page.policy)], { type: "text/yaml" }));
    link.click();
    URL.revokeObjectURL(link.href);
  });
  byId("apply").addEventListener("click", () => takeYaml(byId("text").value, "The text"));
  byId("copy").addEventListener("click", () => {
    byId("text").select();
    document.execCommand("copy");
  });
  const controls = byId("controls");
  controls.addEventListener("pointerdown", (event) => {
    if (event.target.type === "range") beginChange();
  });
  controls.addEventListener("focusin", (event) => {
    if (event.target.matches("input,select")) beginChange();
  });
  for (const id of ["plan", "distance", "limit", "radius", "human"]) followPointer(byId(id));
  byId("plan").addEventListener("pointerdown", () => { plan.dragging = true; });
  byId("plan").addEventListener("pointerup", () => {
    plan.dragging = false;
    redraw();
  });
  // In a narrow window the drawings scroll away: two small ones stay while the settings are seen.
  new IntersectionObserver(([{ isIntersecting }]) => {
    byId("dock").classList.toggle("on", isIntersecting);
    redraw();
  }, { rootMargin: "-40% 0px 0px 0px" }).observe(byId("controls"));
  new ResizeObserver(redraw).observe(byId("view"));
  addEventListener("resize", redraw);
  build();
  draw();
}

start();
