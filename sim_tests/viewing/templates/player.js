// States come from the page itself or from its server; the controls move through them.

(() => {
  const find = (id) => document.getElementById(id);
  const layers = { cones: true, rings: true, tracks: true, scan: true, paths: true };
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const player = {
    begin: null, states: [], index: 0, playing: false, following: false, ended: true, clock: 0,
  };
  let scheduled = false;

  function draw() {
    scheduled = false;
    const { begin, states, index } = player;
    if (!begin) return;
    const state = states[index];
    drawPlan(find("plan"), begin, states, index, layers);
    if (state) {
      showPicture(states, index);
      figures(state);
    }
    drawAlpha(find("alpha"), begin, states, index, chosenTrack());
    drawMotion(find("motion"), begin, states, index);
  }

  // The newest picture up to a state.
  function showPicture(states, index) {
    let at = index;
    while (at >= 0 && !states[at].picture) at -= 1;
    if (at < 0) return;
    const address = `data:image/jpeg;base64,${states[at].picture}`;
    if (find("camera").src !== address) find("camera").src = address;
    find("note").hidden = true;
  }

  function chosenTrack() {
    const who = find("who");
    const known = new Set([...who.options].map((each) => each.value));
    for (const { id } of player.states[player.index]?.tracks ?? []) {
      if (!known.has(String(id))) who.append(new Option(String(id), String(id)));
    }
    return who.value === "" ? null : Number(who.value);
  }

  function request() {
    if (scheduled) return;
    scheduled = true;
    requestAnimationFrame(draw);
  }

  const fixed = (value, digits = 2) => (value === null ? "–" : value.toFixed(digits));
  const counted = (kept) => fixed(kept.awareness_lower) +
    (typeof kept.noticed_s === "number" ? ` (noticed ${kept.noticed_s.toFixed(1)} s ago)` : "");

  function figures(state) {
    find("speed").textContent = fixed(state.speed_mps);
    find("limit").textContent = fixed(state.limit_mps);
    const distances = state.people.map((each) => each.separation_m).filter((each) => each !== null);
    find("nearest").textContent = distances.length ? fixed(Math.min(...distances)) : "–";
    const more = (state.stale ? " (data too old)" : "") +
      (state.braking_suffices ? "" : " (braking does not suffice)");
    find("reason").textContent = state.limited_by + more;
    const asked = recentRequests(player.states, player.index);
    find("requests").textContent = asked.map((each) => each.text).join("; ") || "–";
    find("requests").title = asked.map((each) => each.reason).filter(Boolean).join("; ");
    const last = player.states[player.states.length - 1].t_s;
    find("clock").textContent = `${state.t_s.toFixed(2)} of ${last.toFixed(2)} s`;
    const said = `${state.t_s.toFixed(2)} seconds: speed ${fixed(state.speed_mps)}, limit ` +
      `${fixed(state.limit_mps)} metres per second, ${state.limited_by}`;
    find("at").setAttribute("aria-valuetext", said);
    const rows = state.tracks.map((track) => {
      const kept = state.obstacles.find((each) => each.id === track.id);
      const row = document.createElement("tr");
      const name = document.createElement("th");
      name.scope = "row";
      const mark = document.createElement("i");
      mark.style.background = trackColour(track.id);
      name.append(mark, `${track.id}${track.status === "confirmed" ? "" : ", " + track.status}`);
      row.append(name);
      for (const text of [`${fixed(track.awareness)} ± ${fixed(track.awareness_std)}`,
        fixed(track.awareness_lower), kept ? counted(kept) : "–", kept ? `${fixed(kept.radius_m)} m` : "–"]) {
        const cell = document.createElement("td");
        cell.textContent = text;
        row.append(cell);
      }
      return row;
    });
    find("tracks").replaceChildren(...rows);
  }

  function show(index) {
    const { states } = player;
    if (!states.length) return;
    player.index = Math.min(Math.max(index, 0), states.length - 1);
    find("at").max = String(states.length - 1);
    find("at").value = String(player.index);
    request();
  }

  function seek(index) {
    follow(false);
    show(index);
    player.clock = player.states.length ? player.states[player.index].t_s : 0;
  }

  function play(on) {
    if (on && player.index >= player.states.length - 1) seek(0);
    player.playing = on;
    find("play").classList.toggle("on", on);
    find("play").setAttribute("aria-label", on ? "Pause" : "Play");
    if (on) {
      player.clock = player.states[player.index].t_s;
      player.then = performance.now();
      requestAnimationFrame(tick);
    }
  }

  function tick(now) {
    if (!player.playing) return;
    player.clock += ((now - player.then) / 1000) * Number(find("rate").value);
    player.then = now;
    const { states } = player;
    let index = player.index;
    while (index + 1 < states.length && states[index + 1].t_s <= player.clock) index += 1;
    if (index !== player.index) show(index);
    if (index >= states.length - 1) {
      play(false);
      if (!player.ended) follow(true);
      return;
    }
    requestAnimationFrame(tick);
  }

  function follow(on) {
    player.following = on && !player.ended;
    find("live").setAttribute("aria-pressed", String(player.following));
    if (player.following) {
      play(false);
      show(player.states.length - 1);
    }
  }

  function takeBegin(begin) {
    player.begin = begin;
    find("title").textContent = begin.scenario;
    find("camera").style.aspectRatio = String(begin.picture_aspect);
    find("facts").textContent = [`seed ${begin.seed}`, `policy ${begin.policy}`, begin.planner,
      begin.perception, begin.fault && `fault ${begin.fault}`].filter(Boolean).join(" · ");
    find("play").disabled = false;
    request();
  }

  function takeEnd({ outcome, note }) {
    player.ended = true;
    player.following = false;
    find("live").hidden = true;
    find("status").className = "";
    find("status").textContent = outcome;
    if (!player.states.some((state) => state.picture)) {
      find("note").textContent = note || "There is no picture of the camera.";
      find("note").hidden = false;
    }
    request();
  }

  function listen() {
    player.ended = false;
    const stream = new EventSource("states");
    stream.addEventListener("begin", (event) => {
      player.states.length = 0;
      takeBegin(JSON.parse(event.data));
      find("status").className = "live";
      find("status").textContent = "Live";
      find("live").hidden = false;
      follow(true);
    });
    stream.addEventListener("message", (event) => {
      player.states.push(JSON.parse(event.data));
      if (player.following) show(player.states.length - 1);
      else show(player.index);
    });
    stream.addEventListener("end", (event) => {
      stream.close(); // the server is about to go, and all states are here
      takeEnd(JSON.parse(event.data));
    });
    stream.addEventListener("error", () => {
      if (player.ended) return;
      stream.close();
      takeEnd({ outcome: "The connection was lost", note: "" });
    });
  }

  function keys(event) {
    const within = event.target.closest("select, a");
    if (within || event.ctrlKey || event.metaKey || event.altKey) return;
    const second = player.begin ? Math.round(1 / player.begin.step_s) : 1;
    const stride = event.shiftKey ? second : 1;
    const actions = {
      " ": () => play(!player.playing),
      ArrowLeft: () => { play(false); seek(player.index - stride); },
      ArrowRight: () => { play(false); seek(player.index + stride); },
      Home: () => seek(0),
      End: () => (player.ended ? seek(player.states.length - 1) : follow(true)),
    };
    // Buttons and boxes take the space bar themselves.
    const own = event.key === " " && event.target.closest("button, input[type=checkbox]");
    if (!(event.key in actions) || own || !player.states.length) return;
    event.preventDefault();
    actions[event.key]();
  }

  find("play").addEventListener("click", () => play(!player.playing));
  find("live").addEventListener("click", () => follow(true));
  find("at").addEventListener("input", () => { play(false); seek(Number(find("at").value)); });
  document.addEventListener("keydown", keys);
  for (const box of document.querySelectorAll("[data-layer]")) {
    box.addEventListener("change", () => { layers[box.dataset.layer] = box.checked; request(); });
  }
  find("who").addEventListener("change", request);
  for (const id of ["alpha", "motion"]) {
    const chart = find(id);
    const scrub = (event) => {
      if (!player.states.length) return;
      const left = chart.getBoundingClientRect().left;
      const wanted = timeScale(chart.clientWidth, player.states, player.begin).t(event.clientX - left);
      const at = player.states.findIndex((state) => state.t_s >= wanted);
      play(false);
      seek(at < 0 ? player.states.length - 1 : at);
    };
    chart.addEventListener("pointerdown", (event) => {
      chart.setPointerCapture(event.pointerId);
      scrub(event);
    });
    chart.addEventListener("pointermove", (event) => { if (event.buttons) scrub(event); });
  }
  readColours();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    readColours();
    request();
  });
  new ResizeObserver(request).observe(document.body);

  const recording = JSON.parse(find("data").textContent);
  if (recording) {
    takeBegin(recording.begin);
    player.states = recording.states;
    takeEnd(recording);
    const ids = new Set(recording.states.flatMap((state) => state.tracks.map(({ id }) => id)));
    for (const id of ids) find("who").append(new Option(String(id), String(id)));
    show(0);
    if (!calm) play(true);
  } else {
    listen();
  }
  // What a script can ask the page.
  window.crossing = { player, seek, play };
})();
