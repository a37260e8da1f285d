(() => {
  "use strict";
  const told = document.getElementById("told");
  let quiet = 0;

  // The page is often a file on disk, where the clipboard may refuse; a selection then serves.
  async function copy(text, from) {
    let done = false;
    try {
      await navigator.clipboard.writeText(text);
      done = true;
    } catch {
      const area = document.createElement("textarea");
      area.value = text;
      area.setAttribute("readonly", "");
      area.style.cssText = "position:fixed;opacity:0";
      document.body.append(area);
      const before = document.activeElement;
      area.select();
      done = document.execCommand("copy");
      area.remove();
      if (before && before.focus) before.focus({ preventScroll: true });
    }
    told.textContent = done ? "Copied: " + text : "Could not copy; select the command by hand";
    told.classList.add("on");
    clearTimeout(quiet);
    quiet = setTimeout(() => told.classList.remove("on"), 1800);
    if (done && from) {
      from.classList.add("done");
      setTimeout(() => from.classList.remove("done"), 1800);
    }
  }

  document.addEventListener("click", (event) => {
    const target = event.target.closest("[data-copy]");
    if (target) copy(target.textContent.trim(), target);
  });

  // Tables: a button in each heading of a column.
  for (const table of document.querySelectorAll("table.sortable")) {
    const columns = [];
    const rows = [...table.tHead.rows];
    rows.forEach((row, depth) => {
      for (const cell of row.cells) {
        if (cell.colSpan > 1 || cell.scope === "colgroup") continue;
        if (depth === 0 && rows.length > 1 && cell.rowSpan < 2) continue;
        columns.push(cell);
      }
    });
    columns.forEach((head, index) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const up = head.getAttribute("aria-sort") === "descending" ||
          (!head.hasAttribute("aria-sort") && head.classList.contains("text"));
        columns.forEach((each) => each.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", up ? "ascending" : "descending");
        sort(table.tBodies[0], index, up);
      });
    });
  }

  function sort(body, index, up) {
    const value = (row) => {
      const cell = row.cells[index];
      const text = cell.dataset.v ?? cell.textContent.trim().replace("\u2212", "-");
      if (text === "" || text === "–") return null;
      const number = parseFloat(text);
      return Number.isNaN(number) || cell.classList.contains("text") ? text : number;
    };
    const keyed = [...body.rows].map((row) => [value(row), row]);
    keyed.sort(([a], [b]) => {
      if (a === null || b === null) return (a === null) - (b === null);
      const order = typeof a === "number" && typeof b === "number"
        ? a - b : String(a).localeCompare(String(b));
      return up ? order : -order;
    });
    body.append(...keyed.map(([, row]) => row));
  }

  // Pictures of an episode side by side, or each as wide as the card.
  for (const pair of document.querySelectorAll(".pictures")) {
    for (const picture of [...pair.children]) {
      const button = document.createElement("button");
      button.type = "button";
      button.className = "zoom";
      button.setAttribute("aria-expanded", "false");
      picture.replaceWith(button);
      button.append(picture);
      button.addEventListener("click", () => {
        const large = pair.classList.toggle("large");
        for (const each of pair.children) each.setAttribute("aria-expanded", String(large));
      });
    }
  }

  // A link to an episode opens the list that it stands in.
  function open() {
    const row = location.hash.startsWith("#e") && document.getElementById(location.hash.slice(1));
    if (row && row.closest("details")) {
      row.closest("details").open = true;
      row.scrollIntoView({ block: "center" });
    }
  }
  addEventListener("hashchange", open);
  open();

  addEventListener("beforeprint", () => {
    for (const each of document.querySelectorAll("details:not(#list)")) each.open = true;
  });

  // The scatter: marks and rows of data are in the same order.
  const source = document.getElementById("data");
  if (!source) return;
  const data = JSON.parse(source.textContent);
  const marks = [...document.querySelectorAll(".marks a")];
  const chosen = document.querySelector(".chosen");
  const places = marks.map((mark) => {
    const use = mark.firstElementChild;
    return [parseFloat(use.getAttribute("x")), parseFloat(use.getAttribute("y"))];
  });
  let current = -1;
  let pinned = false;

  function element(name, text) {
    const made = document.createElement(name);
    if (text !== undefined) made.textContent = text;
    return made;
  }

  function choose(index) {
    if (index === current) return;
    if (current >= 0) {
      marks[current].classList.remove("on");
      marks[current].tabIndex = -1;
    } else {
      marks[0].tabIndex = -1;
    }
    current = index;
    marks[index].classList.add("on");
    marks[index].tabIndex = 0;
    const [number, arm, scenario, seed, margin, separation, speed, lost, remark] = data.rows[index];
    const head = element("h3");
    const sign = document.querySelectorAll(".arms .mark")[arm].cloneNode(true);
    head.append(sign, data.arms[arm]);
    const list = element("dl");
    for (const [name, value] of [
      ["smallest margin", margin + " m"], ["smallest separation", separation + " m"],
      ["speed when nearest", speed + " m/s"], ["time lost", lost + " s"],
    ]) list.append(element("dt", name), element("dd", value));
    const parts = [head, element("p", data.scenarios[scenario] + ", seed " + seed)];
    if (remark) {
      const said = element("p", remark);
      said.className = "bad";
      parts.push(said);
    }
    parts.push(list);
    if (number >= 0) {
      const button = element("button");
      button.type = "button";
      button.className = "cmd";
      button.dataset.copy = "";
      button.append(element("code", data.replay + number));
      parts.push(button);
    } else {
      parts.push(element("p", "The replay command is not known: its job is missing."));
    }
    chosen.replaceChildren(...parts);
  }

  function take(index) {
    choose(index);
    const button = chosen.querySelector(".cmd");
    if (button) copy(button.textContent.trim(), button);
  }

  const visible = (index) =>
    !marks[index].classList.contains("dim") && marks[index].getClientRects().length > 0;

  // The nearest mark in a direction; what lies ahead counts more than what lies aside.
  function neighbour(index, dx, dy) {
    let best = -1, least = Infinity;
    const [x, y] = places[index];
    places.forEach(([u, v], other) => {
      const ahead = (u - x) * dx + (v - y) * dy;
      const aside = Math.abs((u - x) * dy) + Math.abs((v - y) * dx);
      // Marks in one spot are gone through in their order.
      const same = ahead === 0 && aside === 0 && (other - index) * (dx + dy) > 0;
      if (other === index || (!same && ahead <= 0) || !visible(other)) return;
      const cost = same ? 0 : ahead + 2 * aside + 1e-6;
      if (cost < least) { least = cost; best = other; }
    });
    return best;
  }

  const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  marks.forEach((mark, index) => {
    mark.addEventListener("focus", () => choose(index));
    mark.addEventListener("mouseenter", () => pinned || choose(index));
    mark.addEventListener("click", (event) => {
      event.preventDefault();
      event.stopPropagation();
      pinned = true;
      take(index);
    });
    mark.addEventListener("keydown", (event) => {
      if (!(event.key in steps)) return;
      event.preventDefault();
      const next = neighbour(index, ...steps[event.key]);
      if (next >= 0) marks[next].focus();
    });
  });

  // A click holds the choice, so that the pointer may travel to the command.
  document.querySelector(".frame").addEventListener("click", () => { pinned = false; });
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") pinned = false;
  });

  const pick = document.querySelector(".pick");
  const label = element("label", "");
  const select = element("select");
  select.setAttribute("aria-label", "Scenario shown");
  select.append(new Option("all scenarios", "-1"));
  data.scenarios.forEach((name, index) => select.append(new Option(name, String(index))));
  select.addEventListener("change", () => {
    const wanted = Number(select.value);
    marks.forEach((mark, index) =>
      mark.classList.toggle("dim", wanted >= 0 && data.rows[index][2] !== wanted));
  });
  label.append(select);
  pick.append(label);
  pick.hidden = false;
})();
