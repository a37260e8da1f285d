// Policies from plain data: defaults filled in, and the same refusals as in Python.
// Keys, ranges and defaults come from the pydantic models (DATA.models).

class PolicyError extends Error {}

const shown = (value) => (typeof value === "string" ? `'${value}'` : JSON.stringify(value));
const general = (value) => String(Number(value.toPrecision(6)));

/** How alike two words are, from 0 to 1: twice the length of common blocks over that of both. */
function likeness(first, second) {
  const common = (a, b) => {
    let best = 0, atA = 0, atB = 0;
    for (let i = 0; i < a.length; i += 1)
      for (let j = 0; j < b.length; j += 1) {
        let size = 0;
        while (i + size < a.length && j + size < b.length && a[i + size] === b[j + size]) size += 1;
        if (size > best) [best, atA, atB] = [size, i, j];
      }
    if (best === 0) return 0;
    return best + common(a.slice(0, atA), b.slice(0, atB))
      + common(a.slice(atA + best), b.slice(atB + best));
  };
  return (2 * common(first, second)) / Math.max(first.length + second.length, 1);
}

function unknownKey(key, name, valid) {
  const [score, near] = valid
    .map((each) => [likeness(each, key), each])
    .sort((a, b) => b[0] - a[0] || (a[1] < b[1] ? 1 : -1))[0];
  const hint = score >= 0.5 ? `did you mean '${near}'?` : `valid keys: ${valid.join(", ")}`;
  return new PolicyError(`unknown key '${key}' in ${name}; ${hint}`);
}

const isMapping = (value) => value !== null && typeof value === "object" && !Array.isArray(value);

/** A checked model with all its keys; `place` names it in messages. */
function checkedModel(name, data, place) {
  const fields = DATA.models[name].fields;
  if (!isMapping(data)) throw new PolicyError(`${place || "a policy"} must be a mapping of keys`);
  const valid = fields.map((field) => field.key);
  for (const key of Object.keys(data)) if (!valid.includes(key)) throw unknownKey(key, name, valid);
  const model = {};
  for (const field of fields) {
    const path = place ? `${place}.${field.key}` : field.key;
    const given = Object.hasOwn(data, field.key);
    if (!given && field.required) throw new PolicyError(`${path} is missing`);
    const value = given ? data[field.key] : structuredClone(field.default);
    model[field.key] = checkedField(field, value, path);
  }
  for (const check of CHECKS[name] ?? []) {
    const problem = check(model);
    if (problem) throw new PolicyError(`${place ? `${place}: ` : ""}${problem}`);
  }
  return model;
}

function checkedField(field, value, path) {
  if (value === null || value === undefined) {
    if (field.nullable) return null;
    throw new PolicyError(`${path} must not be null`);
  }
  if (field.kind === "model") {
    const table = field.models.length > 1 && isMapping(value)
      && Object.keys(value).some((key) => key.startsWith("table"));
    return checkedModel(field.models[table ? 1 : 0], value, path);
  }
  if (field.kind === "number") return checkedNumber(field, value, path);
  if (field.kind === "table") return checkedTable(field, value, path);
  if (field.kind === "boolean") {
    if (typeof value === "boolean") return value;
    throw new PolicyError(`${path} must be true or false, got ${shown(value)}`);
  }
  if (field.choices.includes(value)) return value;
  throw new PolicyError(`${path} must be one of ${field.choices.join(", ")}, got ${shown(value)}`);
}

const asNumber = (value) =>
  typeof value === "string" && /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(value.trim())
    ? Number(value) : value;

function checkedNumber(field, given, path) {
  const value = asNumber(given);
  if (typeof value !== "number" || !Number.isFinite(value))
    throw new PolicyError(`${path} must be a finite number, got ${shown(given)}`);
  const { low, high, low_open: lowOpen, high_open: highOpen } = field;
  const tooLow = low !== null && (lowOpen ? value <= low : value < low);
  const tooHigh = high !== null && (highOpen ? value >= high : value > high);
  if (!tooLow && !tooHigh) return value;
  throw new PolicyError(`${path} must lie in ${rangeText(field)}, got ${general(value)}`);
}

/** The valid range of a number as text. */
function rangeText({ low, high, low_open: lowOpen, high_open: highOpen }) {
  const from = low === null ? "(−∞" : `${lowOpen ? "(" : "["}${general(low)}`;
  return `${from}, ${high === null ? "∞)" : `${general(high)}${highOpen ? ")" : "]"}`}`;
}

function checkedTable(field, given, path) {
  if (!Array.isArray(given) || given.length === 0)
    throw new PolicyError(`${path} must hold at least one [awareness, ${field.unit}] pair`);
  const points = given.map((pair) => (Array.isArray(pair) ? pair.map(asNumber) : pair));
  for (const pair of points)
    if (!Array.isArray(pair) || pair.length !== 2 || !pair.every(Number.isFinite))
      throw new PolicyError(`${path} must hold [awareness, ${field.unit}] pairs of numbers`);
  for (const [alpha, value] of points) {
    if (!(alpha >= 0 && alpha <= 1))
      throw new PolicyError(`${path}: awareness must lie in [0, 1], got ${general(alpha)}`);
    if (!(value >= field.low && value <= field.high))
      throw new PolicyError(
        `${path}: values must lie in [${field.low}, ${field.high}] ${field.unit}, `
          + `got ${general(value)}`,
      );
  }
  for (let next = 1; next < points.length; next += 1) {
    const [[alpha, value], [nextAlpha, nextValue]] = [points[next - 1], points[next]];
    if (nextAlpha <= alpha)
      throw new PolicyError(
        `${path}: awareness must rise, got ${general(nextAlpha)} after ${general(alpha)}`,
      );
    if (nextValue > value)
      throw new PolicyError(
        `${path}: values must not grow with awareness, got ${general(nextValue)} ${field.unit} `
          + `after ${general(value)} ${field.unit}`,
      );
  }
  return points;
}

const rises = (low, high) => (model) =>
  model[high] <= model[low]
  && `${high} must exceed ${low}, got ${general(model[high])} and ${general(model[low])}`;
const atMost = (less, more, unit) => (model) =>
  model[less] > model[more]
  && `${less} must be at most ${more}, got ${general(model[less])} ${unit} and `
    + `${general(model[more])} ${unit}`;
const inOrder = (...keys) => (model) =>
  keys.some((key, index) => index > 0 && model[keys[index - 1]] > model[key])
  && `${keys.join(" <= ")} must hold, got ${keys.map((key) => general(model[key])).join(" s, ")} s`;

function watchingProblem(speed) {
  const { watching_above: above, watching_human_speed_mps: watching } = speed;
  if ((above === null) !== (watching === null))
    return "watching_above and watching_human_speed_mps belong together";
  if (above === null) return null;
  if (above <= speed.aware_above)
    return `watching_above must exceed aware_above, got ${general(above)} and `
      + general(speed.aware_above);
  if (watching > speed.aware_human_speed_mps)
    return "watching_human_speed_mps must be at most aware_human_speed_mps, got "
      + `${general(watching)} m/s and ${general(speed.aware_human_speed_mps)} m/s`;
  return speed.shape === "two_level"
    && "shape two_level has no watching level: leave out watching_above";
}

function ceilingProblem({ inflation, margins }) {
  const ceiling = margins.maximum_radius_m;
  const unaware = inflation.table_m ? inflation.table_m[0][1] : inflation.unaware_radius_m;
  return ceiling !== null && unaware > ceiling
    && `margins.maximum_radius_m must be at least the unaware radius of ${general(unaware)} m, `
      + `got ${general(ceiling)} m`;
}

// What a range of one key cannot say. tests/awarenav/policies holds these to the Python models.
const CHECKS = {
  AwarenessPolicy: [ceilingProblem],
  InterpolatedInflation: [
    rises("unaware_below", "aware_above"), atMost("aware_radius_m", "unaware_radius_m", "m"),
  ],
  InterpolatedHumanSpeed: [
    rises("unaware_below", "aware_above"), watchingProblem,
    atMost("aware_human_speed_mps", "unaware_human_speed_mps", "m/s"),
  ],
  ObstacleOutline: [
    rises("unaware_below", "aware_above"), atMost("aware_ahead_s", "unaware_ahead_s", "s"),
  ],
  SafetyMargins: [
    (margins) => margins.maximum_radius_m !== null && margins.maximum_radius_m < floorOf(margins)
      && `maximum_radius_m must be at least the floor of ${general(floorOf(margins))} m (body `
        + `radius plus minimum_clearance_m), got ${general(margins.maximum_radius_m)} m`,
  ],
  TimeBehaviour: [inOrder("fresh_within_s", "stale_after_s", "stop_after_s")],
  DistanceZones: [rises("stop_within_m", "full_speed_beyond_m")],
  StandingPeople: [
    ({ human_acceleration_mps2: bound, start_delay_s: delay, standing_below_mps: below }) =>
      below > bound * delay + 1e-9
      && "standing_below_mps must be at most human_acceleration_mps2 × start_delay_s = "
        + `${general(bound * delay)} m/s, got ${general(below)} m/s`,
  ],
  AwarenessFilterConfig: [
    inOrder("no_face_time_constant_s", "unseen_time_constant_s", "evidence_time_constant_s"),
  ],
};

/** A checked policy with every setting, from the data of a YAML file. */
const checkedPolicy = (data) => checkedModel("AwarenessPolicy", data, "");
