// Charts as SVG. Lengths are pixels of the page, so that texts keep their size.

const byId = (id) => document.getElementById(id);
const fixed = (value, digits = 2) => value.toFixed(digits).replace(/^-(0\.?0*)$/, "$1");
const TEXTS = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };
const escaped = (text) => String(text).replace(/[&<>"]/g, (letter) => TEXTS[letter]);

/** Rules by the class of their colour. */
const RULES = {
  "speed and separation": "r1", "start reserve": "r2", "distance zone": "r3",
  "cap near people": "r4", "robot maximum": "r0",
};
const ruleClass = (reason) => RULES[reason] ?? "r5";

/** Steps of an axis: about `count` of them, each 1, 2 or 5 times a power of ten. */
function ticks(from, to, count) {
  const rough = (to - from) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= rough * 0.999);
  const found = [];
  for (let at = Math.ceil(from / step - 1e-9); at * step <= to + 1e-9; at += 1)
    found.push(Number((at * step).toPrecision(6)));
  return found;
}

const path = (points) =>
  points.map(([x, y], at) => `${at ? "L" : "M"}${fixed(x, 1)} ${fixed(y, 1)}`).join("");

/**
 * Draws a chart.
 * @param {object} chart id, label, x and y ([from, to]), xText, yText, curves ([{of, look}]), band
 *   ([low, high] functions or null), marks ([[x, y]]), lines ([{y, text}]), strip (x to a rule, or
 *   null), pick (called with an x that the user points at), small (without names of the axes).
 */
function drawChart(chart) {
  const svg = byId(chart.id), width = Math.max(svg.clientWidth, 200), height = svg.clientHeight;
  const below = (chart.strip ? 46 : 34) - (chart.small ? 14 : 0);
  const box = { left: 38, right: width - 10, top: 8, bottom: height - below };
  const [x0, x1] = chart.x, [y0, y1] = chart.y;
  const px = (x) => box.left + ((x - x0) / (x1 - x0)) * (box.right - box.left);
  const py = (y) => box.bottom - ((Math.min(y, y1) - y0) / (y1 - y0)) * (box.bottom - box.top);
  const count = Math.max(Math.round((box.right - box.left) / 1.5), 60);
  const xs = Array.from({ length: count + 1 }, (_, at) => x0 + ((x1 - x0) * at) / count);
  const along = (of) => xs.map((x) => [px(x), py(of(x))]);
  let out = "";
  for (const y of ticks(y0, y1, chart.small ? 2 : 4))
    out += `<line class="grid" x1="${box.left}" x2="${box.right}" y1="${py(y)}" y2="${py(y)}"/>`
      + `<text class="yt" x="${box.left - 6}" y="${py(y) + 4}">${y}</text>`;
  for (const x of ticks(x0, x1, chart.small ? 3 : width > 330 ? 6 : 5))
    out += `<path class="grid" d="M${px(x)} ${box.top}V${box.bottom}"/>`
      + `<text class="xt" x="${px(x)}" y="${height - (chart.small ? 4 : 18)}">${x}</text>`;
  if (chart.band) {
    const [low, high] = chart.band.map(along);
    out += `<path class="band" d="${path([...high, ...low.reverse()])}Z"/>`;
  }
  for (const { y, text } of chart.lines ?? [])
    out += `<line class="floor" x1="${box.left}" x2="${box.right}" y1="${py(y)}" y2="${py(y)}"/>`
      + `<text class="floortext" x="${box.right - 2}" y="${py(y) - 4}">${text}</text>`;
  if (chart.strip) out += stripOf(xs, px, chart.strip, box.bottom + 3);
  for (const { of, look } of chart.curves)
    out += `<path class="curve ${look}" d="${path(along(of))}"/>`;
  for (const [x, y] of chart.marks)
    if (x >= x0 && x <= x1)
      out += `<path class="cross" d="M${px(x)} ${box.bottom}V${py(y)}H${box.left}"/>`
        + `<circle class="mark" cx="${px(x)}" cy="${py(y)}" r="5"/>`;
  if (!chart.small)
    out += `<text class="xlabel" x="${box.right}" y="${height - 3}">${chart.xText}</text>`
      + `<text class="ylabel" x="${box.left + 4}" y="${box.top + 9}">${chart.yText}</text>`;
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.setAttribute("aria-label", chart.label);
  svg.innerHTML = out;
  svg.pointed = chart.pick && ((at) => {
    const share = (at - box.left) / (box.right - box.left);
    chart.pick(x0 + Math.min(Math.max(share, 0), 1) * (x1 - x0));
  });
}

/** A strip under a chart: the rule at each x. */
function stripOf(xs, px, ruleAt, top) {
  let out = "", from = 0;
  const rules = xs.map(ruleAt);
  rules.forEach((rule, at) => {
    if (at + 1 < rules.length && rules[at + 1] === rule) return;
    const left = px(xs[from]), right = px(xs[Math.min(at + 1, xs.length - 1)]);
    out += `<rect class="${ruleClass(rule)}" x="${left}" width="${Math.max(right - left, 0)}"`
      + ` y="${top}" height="7"><title>${escaped(rule)}</title></rect>`;
    from = at + 1;
  });
  return out;
}

/** Calls `pointed` of an SVG while the user drags over it. */
function followPointer(svg) {
  const move = (event) => {
    const place = svg.getBoundingClientRect();
    svg.pointed?.(event.clientX - place.left, event.clientY - place.top);
  };
  svg.addEventListener("pointerdown", (event) => {
    svg.setPointerCapture(event.pointerId);
    beginChange();
    move(event);
  });
  svg.addEventListener("pointermove", (event) => {
    if (svg.hasPointerCapture(event.pointerId)) move(event);
  });
}

/** Draws the parts of the separation at the limit as one bar. */
function drawBudget({ parts, gap, from }) {
  const svg = byId("budget"), width = Math.max(svg.clientWidth, 200);
  const used = parts.reduce((sum, { m }) => sum + m, 0), left = 10, right = width - 10;
  const whole = Math.max(used, gap, 0.01), px = (m) => left + (m / whole) * (right - left);
  let out = "", at = 0, legend = "", row = 0, column = left;
  const spare = gap - used;
  const all = spare > 5e-4 ? [...parts, { name: "left over", m: spare, look: "b6" }] : parts;
  for (const { name, m, look } of all) {
    if (m <= 5e-4) continue;
    const long = Math.max(px(at + m) - px(at) - 1, 1);
    out += `<rect class="${look}" x="${px(at)}" y="16" width="${long}" height="20">`
      + `<title>${name}: ${fixed(m)} m</title></rect>`;
    at += m;
    const text = `${name} ${fixed(m)} m`, wide = 22 + 6.6 * text.length;
    if (column + wide > right && column > left) [row, column] = [row + 1, left];
    legend += `<rect class="${look}" x="${column}" y="${50 + 18 * row}" width="11" height="11"/>`
      + `<text x="${column + 16}" y="${60 + 18 * row}">${text}</text>`;
    column += wide;
  }
  const end = px(Math.max(gap, 0)), far = end > width / 2;
  out += `<path class="bodyline" d="M${end} 10V42"/>`
    + `<text class="${far ? "yt" : ""}" x="${end + (far ? -2 : 4)}" y="10">`
    + `body, ${fixed(gap).replace("-", "−")} m</text>`
    + (end > 150 ? `<text x="${left}" y="10">${from}</text>` : "");
  const height = 70 + 18 * row;
  svg.style.height = `${height}px`;
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.setAttribute("aria-label", all.map(({ name, m }) => `${name} ${fixed(m)} m`).join(", "));
  svg.innerHTML = out + legend;
}
