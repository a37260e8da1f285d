// The answer in words and figures.

const strong = (text) => `<b>${escaped(text)}</b>`;
const coded = (text) => escaped(text).replace(/`([^`]*)`/g, "<code>$1</code>");

/** The gap and what it is used for at the limit, by the bound that allows more speed. */
function budgetOf(policy, robot, state, found) {
  const limit = found.limit_mps, { person, bounds } = found;
  const braking = robot.max_deceleration_mps2, reaction = robot.reaction_time_s + state.data_age_s;
  const reserve = found.reason === "start reserve";
  const rule = reserve ? "start reserve" : "speed and separation";
  const { each, share, bound, delay, nearer } = bounds[rule]
    ?? { each: 0, share: 1, ...person.start, nearer: 0 };
  const speed = reserve ? policyHumanSpeed(policy, 0) : found.human_speed_mps;
  const human = walked(reaction + limit / braking, speed, bound, delay) + nearer;
  const clearance = reserve ? 0 : policy.margins.separation_clearance_m;
  return {
    gap: found.gaps_m[each],
    from: each ? "the robot's circle" : "robot",
    parts: [
      { name: "robot reacts", m: share * limit * reaction, look: "b1" },
      { name: "robot brakes", m: (share * limit * limit) / (2 * braking), look: "b2" },
      { name: "person walks", m: human, look: "b3" },
      { name: "clearance", m: clearance, look: "b4" },
      { name: "uncertainty", m: found.uncertainty_m, look: "b5" },
    ],
  };
}

/** How the person counts: unaware, partly aware, aware or watching. */
function standingOf(policy, alpha) {
  const { speed } = policy;
  if (speed.table_mps) return alpha > 0 ? `aware to ${fixed(alpha)}` : "unaware";
  if (alpha <= speed.unaware_below) return "unaware";
  if (speed.watching_above !== null && alpha >= speed.watching_above) return "watching";
  return alpha >= speed.aware_above ? "aware" : "partly aware";
}

/** What led to the awareness that counts, where it is not the given bound. */
function awarenessNote(policy, state, found) {
  const { timing } = policy;
  if (found.stale)
    return `The data are older than ${timing.stale_after_s} s, so everybody counts as unaware.`;
  if (state.track === "tentative") return "A tentative track counts as unaware.";
  if (state.unseen_s + state.data_age_s > timing.fresh_within_s)
    return `No frame has shown the person for more than ${timing.fresh_within_s} s: unaware.`;
  if (state.track === "first sight") return "At first sight everybody counts as unaware.";
  if (found.awareness_lower > state.awareness_lower)
    return `Having noticed the robot counts as α = ${fixed(found.awareness_lower)}.`;
  return "";
}

function sentenceOf(policy, robot, state, found) {
  const { timing, rules } = policy;
  const way = found.reason === "robot maximum"
    ? `The robot may drive at its maximum of ${strong(`${fixed(found.limit_mps)} m/s`)}.`
    : found.limit_mps > 0
      ? `The robot may drive ${strong(`${fixed(found.limit_mps)} m/s`)}: `
        + `${strong(found.reason)} sets this limit.`
      : `The robot must stop: ${strong(found.reason)}.`;
  const assumed = found.human_speed_mps > found.person.assumed + 1e-9
    ? `and counts as coming at ${fixed(found.human_speed_mps)} m/s because of the walk`
    : `and is assumed to come at ${fixed(found.human_speed_mps)} m/s`;
  const who = found.in_path
    ? `The person counts as ${strong(standingOf(policy, found.person.counted_alpha))} ${assumed}.`
    : "The person is not in the path, so the protective field does not count them.";
  const brakes = found.braking_suffices ? ""
    : " Full braking from the present speed would come too late.";
  const apart = unawareRadius(policy, found) - found.radius_m;
  const taken = fixed(timing.shrink_after_s + apart / timing.shrink_rate_mps, 1);
  const shrinks = apart > 0.005
    ? ` After α has risen, the obstacle takes ${taken} s to shrink from unaware to this.` : "";
  const note = awarenessNote(policy, state, found);
  const rule = ruleNote(rules, policy, found.reason);
  return `${way} ${rule}${who} ${turnNote(found)}${escaped(note)}${brakes}${shrinks}`;
}

/** What `rules.walking` says of the person, where it raises the limit. */
function turnNote({ bounds, reason }) {
  if (!bounds[reason]?.turns) return "";
  const { delay } = bounds[reason];
  return delay < 0
    ? `The person must first turn round, which takes at least ${fixed(-delay)} s. `
    : `The person counts as having set off from a stand ${fixed(delay)} s ago. `;
}

/** What a rule besides speed and separation does. */
function ruleNote(rules, policy, reason) {
  if (reason === "start reserve")
    return "However aware, the person might set off now, at "
      + `${rules.start_reserve.human_acceleration_mps2} m/s² up to `
      + `${fixed(policyHumanSpeed(policy, 0))} m/s. `;
  if (reason === "distance zone")
    return `The limit falls from full speed at ${rules.zones.full_speed_beyond_m} m to a stop at `
      + `${rules.zones.stop_within_m} m. `;
  if (reason === "cap near people")
    return `Within ${rules.near_cap.within_m} m the robot drives at most `
      + `${rules.near_cap.speed_mps} m/s. `;
  return "";
}

/** The figures of the answer, each with its difference from the answer compared with. */
function answersOf(found, before) {
  const entry = (name, value, unit, look, was, digits = 2) => {
    const change = was === null ? 0 : value - was;
    const differs = Math.abs(change) >= 0.5 * 10 ** -digits;
    const sign = change > 0 ? "+" : "−";
    return `<div><dt>${name}</dt><dd class="${look}"><b>${fixed(value, digits)}</b> ${unit}`
      + `<small>${differs ? `${sign}${fixed(Math.abs(change), digits)}` : ""}</small></dd></div>`;
  };
  const { alert } = found, cell = (name, value, look = "") =>
    `<div class="${look}"><dt>${name}</dt><dd>${value}</dd></div>`;
  const of = (field) => before?.[field] ?? null;
  const square = `<i class="${ruleClass(found.reason)}"></i>`;
  return [
    entry("speed limit", found.limit_mps, "m/s", found.limit_mps > 0 ? "" : "bad", of("limit_mps")),
    cell("reason", square + escaped(found.reason), "reason"),
    entry("obstacle radius", found.radius_m, "m", "", of("radius_m")),
    entry("stopping distance", found.stopping_m, "m", "", of("stopping_m")),
    entry("human speed", found.human_speed_mps, "m/s", "", of("human_speed_mps")),
    cell("alert", alert ? `<b>${alert.kind}</b> in ${fixed(alert.time_s, 1)} s` : "<b>none</b>"),
  ].join("");
}
