// Sliders, numbers, choices and switches, built from the models.

const get = (root, keys) => keys.reduce((value, key) => value?.[key], root);

function put(root, keys, value) {
  get(root, keys.slice(0, -1))[keys.at(-1)] = value;
}

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "on")
      for (const [event, act] of Object.entries(value)) made.addEventListener(event, act);
    else if (name === "html") made.innerHTML = value;
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

/**
 * One setting as a row.
 * @param {object} field from the models or the situation.
 * @param {object} place root and keys of the value; `id`; changed (after a new value); rebuilt
 *   (after a change of which rows there are).
 */
function rowOf(field, place) {
  const { root, keys, id } = place, value = get(root, keys);
  const overTime = DATA.over_time.includes(id);
  const text = element("p", {
    id: `${id}:text`, class: "text", hidden: true, html: coded(rowText(field)),
  });
  const more = element("button", {
    type: "button", class: "more", "aria-expanded": "false", "aria-controls": `${id}:text`,
    "aria-label": `About ${field.label ?? field.key}`,
    on: { click: () => {
      text.hidden = !text.hidden;
      more.setAttribute("aria-expanded", String(!text.hidden));
    } },
  }, "?");
  const kind = field.label ? "" : "key";
  const name = element("label", { for: id, class: kind }, field.label ?? field.key);
  const head = element("div", { class: "head" }, name);
  if (field.unit) head.append(element("span", { class: "unit" }, field.unit));
  if (overTime) head.append(element("span", { class: "tag" }, "over time"));
  head.append(more);
  const row = element("div", { class: "row", "data-id": id }, head);
  if (field.nullable && field.kind === "number")
    head.prepend(switchOf(field, place, value !== null));
  if (field.kind === "number") row.append(numberOf(field, place));
  else if (field.kind === "choice") row.append(choiceOf(field, place));
  else if (field.kind === "boolean") head.prepend(booleanOf(place));
  else if (field.kind === "table") row.append(tableOf(field, place));
  row.append(text);
  row.addEventListener("focusin", () => {
    if (place.about) place.about(id, rowText(field));
  });
  return row;
}

const rowText = (field) => {
  const unit = field.unit ? ` ${field.unit}` : "";
  const range = field.kind === "number" ? ` Range ${rangeText(field)}${unit}.` : "";
  const standard = typeof field.default === "number" ? ` Default ${general(field.default)}.` : "";
  return `${field.text}${range}${field.required || field.label ? "" : standard}`;
};

function switchOf(field, { root, keys, id, rebuilt }, on) {
  return element("input", {
    type: "checkbox", id: `${id}:on`, "aria-label": `${field.label ?? field.key} on`, checked: on,
    on: { change: (event) => {
      beginChange();
      // The two settings of the watching level belong together.
      const watching = { watching_above: 0.8, watching_human_speed_mps: 0.05 };
      const last = keys.at(-1), on = event.target.checked;
      const both = Object.hasOwn(watching, last) ? watching : { [last]: startOf(field) };
      for (const [key, value] of Object.entries(both)) {
        const first = on ? watchingValue(root, keys, key, value) : null;
        put(root, [...keys.slice(0, -1), key], first);
      }
      rebuilt(`${id}:on`);
    } },
  });
}

/** A first value of the watching level that fits the aware one; other values as they are. */
function watchingValue(root, keys, key, value) {
  const speed = get(root, keys.slice(0, -1));
  if (key === "watching_above") return Math.min(Math.max(value, speed.aware_above + 0.05), 1);
  if (key === "watching_human_speed_mps") return Math.min(value, speed.aware_human_speed_mps);
  return value;
}

const startOf = (field) => field.default ?? field.slider[1];

function numberOf(field, { root, keys, id, changed }) {
  const [low, high, step] = field.slider, value = get(root, keys), off = value === null;
  const slider = element("input", {
    type: "range", id: `${id}:slider`, min: low, max: high, step, disabled: off,
    "aria-label": `${field.label ?? field.key}${field.unit ? ` in ${field.unit}` : ""}`,
  });
  const number = element("input", {
    type: "number", id, step, min: field.low, max: field.high, disabled: off, inputmode: "decimal",
    "aria-describedby": `${id}:text`,
  });
  const show = (shown) => {
    if (document.activeElement !== number) number.value = off ? "" : String(shown);
    slider.max = Math.max(high, shown ?? high);
    slider.value = shown ?? low;
    const share = (Number(slider.value) - low) / (Number(slider.max) - low);
    slider.style.setProperty("--share", `${100 * share}%`);
  };
  slider.addEventListener("input", () => {
    let next = Number(Number(slider.value).toPrecision(10));
    if (field.low !== null && (field.low_open ? next <= field.low : next < field.low))
      next = field.low_open ? Number((field.low + step).toPrecision(10)) : field.low;
    if (field.high_open && next >= field.high) next = Number((field.high - step).toPrecision(10));
    put(root, keys, next);
    number.value = String(next);
    show(next);
    changed();
  });
  number.addEventListener("input", () => {
    const next = number.value.trim() === "" ? NaN : Number(number.value);
    put(root, keys, next);
    if (Number.isFinite(next)) show(next);
    changed();
  });
  show(value);
  return element("div", { class: "pair", "data-show": "" }, slider, number);
}

function choiceOf(field, { root, keys, id, changed }) {
  const choices = field.nullable ? [null, ...field.choices] : field.choices;
  const select = element("select", {
    id, "aria-describedby": `${id}:text`,
    on: { change: () => {
      put(root, keys, choices[select.selectedIndex]);
      changed(true);
    } },
  }, ...choices.map((choice) => element("option", {}, choice ?? "not known")));
  select.selectedIndex = choices.indexOf(get(root, keys));
  return select;
}

function booleanOf({ root, keys, id, changed }) {
  return element("input", {
    type: "checkbox", id, checked: get(root, keys), "aria-describedby": `${id}:text`,
    on: { change: (event) => {
      put(root, keys, event.target.checked);
      changed();
    } },
  });
}

/** A table as rows of two numbers. */
function tableOf(field, place) {
  const { root, keys, id, changed, rebuilt } = place, points = get(root, keys);
  const names = field.key === "footprint_m"
    ? ["x in m", "y in m"] : ["α", `value in ${field.unit}`];
  const rows = points.map((pair, at) => element("div", { class: "point" },
    ...pair.map((value, side) => element("input", {
      type: "number", step: "0.01", value, id: `${id}:${at}:${side}`,
      "aria-label": `${field.key}, point ${at + 1}, ${names[side]}`,
      on: { input: (event) => {
        points[at][side] = event.target.value.trim() === "" ? NaN : Number(event.target.value);
        changed();
      } },
    })),
    element("button", {
      type: "button", "aria-label": `Remove point ${at + 1}`, disabled: points.length < 2,
      on: { click: () => {
        beginChange();
        points.splice(at, 1);
        rebuilt(`${id}:add`);
      } },
    }, "×")));
  const add = element("button", {
    type: "button", id: `${id}:add`,
    on: { click: () => {
      beginChange();
      points.push(nextPoint(field, points));
      rebuilt(`${id}:${points.length - 1}:0`);
    } },
  }, "Add a point");
  const title = element("p", { class: "unit" }, names.join(", "));
  const group = { id, role: "group", "aria-label": field.key, class: "table" };
  return element("div", group, title, ...rows, add);
}

function nextPoint(field, points) {
  const [first, second] = points.at(-1);
  if (field.key === "footprint_m") return [Number((first + 0.1).toFixed(4)), second];
  return [Number(Math.min((1 + first) / 2, 1).toFixed(4)), second];
}

/** The rows of a model under their heading, and its parts below. */
function groupOf(name, keys, depth, place) {
  const model = DATA.models[name], rows = [];
  for (const field of model.fields) {
    const path = [...keys, field.key], id = path.join(".");
    if (field.kind === "model") rows.push(partOf(field, path, id, depth, place));
    else rows.push(rowOf(field, { ...place, keys: path, id }));
  }
  return rows;
}

/** A part of a model: a heading, a switch or a choice of its kind, and its rows. */
function partOf(field, keys, id, depth, place) {
  const { root, rebuilt, open } = place, value = get(root, keys);
  const table = value !== null && Object.keys(value).some((key) => key.startsWith("table"));
  const name = field.models[table ? 1 : 0], on = value !== null;
  const body = element("div", { class: "part" });
  body.append(element("p", { class: "text", html: coded(DATA.models[name].text) }));
  if (field.nullable) {
    const box = element("input", {
      type: "checkbox", id: `${id}:on`, checked: on,
      on: { change: (event) => {
        beginChange();
        put(root, keys, event.target.checked ? checkedModel(name, {}, id) : null);
        open.add(id);
        rebuilt(`${id}:on`);
      } },
    });
    body.append(element("label", { class: "switch" }, box, ` use ${field.key}`));
  }
  if (field.models.length > 1) {
    const select = element("select", {
      id: `${id}:kind`,
      on: { change: () => {
        beginChange();
        put(root, keys, otherKind(field.models[select.selectedIndex], value, root));
        rebuilt(`${id}:kind`);
      } },
    }, element("option", {}, "ramp"), element("option", {}, "table"));
    select.selectedIndex = table ? 1 : 0;
    body.append(element("label", { class: "switch" }, "given as ", select));
  }
  if (on) body.append(...groupOf(name, keys, depth + 1, place));
  const title = element("summary", {}, element("code", {}, field.key));
  if (field.nullable) title.append(element("span", { class: "tag" }, on ? "on" : "off"));
  return element("details", {
    open: open.has(id), class: depth ? "inner" : "group",
    on: { toggle: (event) => {
      if (event.target.open) open.add(id);
      else open.delete(id);
    } },
  }, title, body);
}

/** A ramp of defaults, or a table with the values that the ramp had. */
function otherKind(name, before, policy) {
  const key = DATA.models[name].fields[0].key;
  if (!key.startsWith("table")) return checkedModel(name, {}, "");
  const value = key === "table_m" ? policyRadius : policyHumanSpeed;
  const at = [before.unaware_below, before.aware_above];
  if (before.watching_above) at.push(before.watching_above);
  return { [key]: at.map((alpha) => [alpha, Number(value(policy, alpha).toFixed(4))]) };
}
