// One run or two, with all their views, buttons and keys.

class Viewer {
  /** @param {Page} data */
  constructor(data) {
    PALETTE.splice(0, Infinity, ...data.palette.map((colour) => (colour === "#000000" ? "#8c6bb1" : colour))); // black is invisible in the dark theme
    data.runs.forEach((run, i) => {
      const record = data.difference?.records[i] ?? NOTHING;
      run.tagOfDifference = record >= 0 ? run.record_tag[record] : undefined;
      run.firstChange = data.difference?.firings[i] ?? NOTHING; // the first firing that is not the same in the other run
    });
    const state = this.state = new State(data), scrubber = new Scrubber(state), lanes = new Lanes(state), chart = new Chart(state);
    const camera = { scale: 0, x: 0, y: 0, extent: Space.extent(data.runs) }, hasSpace = data.runs.some((run) => run.marks.length);
    const spaces = hasSpace ? data.runs.map((_, i) => new Space(state, i, camera)) : [];
    const graphs = data.runs.map((_, i) => new Graph(state, i));
    this.details = new Details(state, lanes);
    this.views = { scrubber, spaces, graphs, chart, lanes };
    /** @param {string} name @param {string} title @param {...Node} content */
    const pane = (name, title, ...content) => {
      const made = element("section", { className: `pane ${name}` }, element("h1", { text: title }), ...content);
      made.dataset.pane = name;
      return made;
    };
    /** @param {(Space | Graph)[]} views @param {string} what */
    const named = (views, what) => views.map((view, i) => pane(`${what} of${i}`, data.runs.length > 1 ? `${what}: ${data.runs[i].name}` : what,
      ...("note" in view && view.note ? [element("p", { className: "note", text: view.note })] : []), view.canvas));
    const panes = element("div", { id: "panes", className: `runs${data.runs.length}${hasSpace ? "" : " flat"}` },
      ...named(spaces, "space"), ...named(graphs, "graph"),
      pane("chart", "sequence", coneOnly(state, chart), chart.canvas), pane("lanes", "signals", picker(state, lanes), lanes.canvas),
      pane("about", "details", this.details.box));
    this.bar = bar(state, data);
    this.content = [this.bar.box, element("div", { className: "scrub" }, scrubber.canvas), panes, tabs(panes, hasSpace, state)];
    this.painted = [scrubber, ...spaces, ...graphs, chart, lanes];
    const changed = data.story.length ? data.runs.findLastIndex((run) => run.firstChange >= 0) : NOTHING;
    if (changed >= 0) {
      const run = data.runs[changed], tag = run.firing_tag[run.firstChange], half = Math.max(1e8, state.end / 30);
      state.activate(changed);
      state.show(run.times[tag] - half / 2, run.times[tag] + half * 1.5);
      state.setTag(tag);
      chart.reveal(run.firing_actor[run.firstChange]);
    }
  }

  /** Lets time pass while it plays, and paints what has changed. @param {number} seconds */
  advance(seconds) {
    const { state } = this;
    state.advance(seconds);
    if (!state.isDirty) return;
    state.isDirty = false;
    for (const view of this.painted) view.paint();
    this.bar.tell();
  }
}

/** Calls a function for each frame, with the seconds since the one before. @param {(seconds: number) => void} act */
function eachFrame(act) {
  let before = performance.now();
  const frame = (/** @type {number} */ now) => {
    act(Math.min(0.1, (now - before) / 1000));
    before = now;
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

/** @param {State} state @param {Page} data */
function bar(state, data) {
  const [first] = data.runs, times = timeButtons(() => state);
  const speed = element("select", { label: "model seconds per second", id: "speed" });
  for (const each of [...new Set([...SPEEDS, state.speed])].sort((a, b) => a - b)) speed.append(element("option", { value: each, text: `×${each}` }));
  speed.value = String(state.speed);
  speed.addEventListener("change", () => { state.speed = Number(speed.value); });
  const axis = element("select", { label: "time axis", id: "axis" }, element("option", { value: "time", text: "by time" }), element("option", { value: "tag", text: "by tag" }));
  axis.addEventListener("change", () => state.setByTag(axis.value === "tag"));
  /** @param {"back" | "ahead"} name @param {string} words */
  const toggle = (name, words) => {
    const made = button(words, () => {
      state.directions[name] = !state.directions[name];
      made.setAttribute("aria-pressed", String(state.directions[name]));
      state.findCone();
      for (const listener of state.listeners) listener();
    }, `toggle ${name}`);
    made.setAttribute("aria-pressed", "true");
    return made;
  };
  const runs = data.runs.length < 2 ? [] : data.runs.map((run, i) => {
    const made = button(run.name, () => state.activate(i), "toggle");
    state.listeners.push(() => made.setAttribute("aria-pressed", String(state.active === i)));
    made.setAttribute("aria-pressed", String(state.active === i));
    return made;
  });
  const now = element("output", { id: "now" });
  const box = element("header", {},
    element("strong", { text: data.runs.length > 1 ? first.model : first.name || first.model }), ...runs,
    element("span", { className: "group" }, ...times.buttons, speed), now, axis,
    element("span", { className: "group" }, toggle("back", "what led to it"), toggle("ahead", "what came of it")));
  const tell = () => {
    now.textContent = state.nowText;
    times.tell(now);
    speed.value = String(state.speed);
    axis.value = state.axis.byTag ? "tag" : "time";
  };
  return { box, tell };
}

// The buttons that move through time; while it plays, screen readers do not say the time that an element shows.
/** @param {() => State} of */
function timeButtons(of) {
  const play = button("▶", () => of().play(!of().isPlaying), "play", "play");
  const buttons = [
    button("|◀", () => of().setTag(0), "", "first tag"), button("◀", () => of().step(-1), "", "previous tag"), play,
    button("▶|", () => of().step(1), "", "next tag"),
  ];
  const tell = (/** @type {HTMLElement} */ now) => {
    const { isPlaying } = of();
    play.textContent = isPlaying ? "❚❚" : "▶";
    play.ariaLabel = play.title = isPlaying ? "pause" : "play";
    now.ariaLive = isPlaying ? "off" : "polite";
  };
  return { buttons, tell };
}

/** @param {State} state @param {Chart} chart */
function coneOnly(state, chart) {
  const box = element("input", { type: "checkbox", id: "cone-only" });
  box.addEventListener("change", () => {
    chart.isConeOnly = box.checked;
    state.changed();
  });
  return element("label", { className: "option", title: "show only actors of the cone" }, box, " cone only");
}

/** @param {State} state @param {Lanes} lanes */
function picker(state, lanes) {
  const select = element("select", { label: "signals to show or hide", className: "option" }, element("option", { value: "", text: "signals…" }));
  const fill = () => {
    while (select.options.length > 1) select.remove(1);
    for (const name of lanes.names) select.append(element("option", { value: name, text: `${lanes.shown.has(name) ? "✓ " : "   "}${name}` }));
  };
  select.addEventListener("pointerdown", fill);
  select.addEventListener("focus", fill);
  select.addEventListener("change", () => {
    lanes.toggle(select.value);
    select.value = "";
    fill();
    state.changed();
  });
  return select;
}

// A narrow screen shows one pane at a time.
/** @param {HTMLElement} panes @param {boolean} hasSpace @param {State} state */
function tabs(panes, hasSpace, state) {
  const names = [...(hasSpace ? ["space"] : []), "graph", "chart", "lanes", "about"], made = element("nav", {});
  for (const name of names) {
    const tab = button(name === "chart" ? "sequence" : name === "lanes" ? "signals" : name === "about" ? "details" : name, () => {
      panes.dataset.tab = name;
      for (const each of made.children) each.setAttribute("aria-pressed", String(each === tab));
      state.changed();
    }, "toggle");
    tab.setAttribute("aria-pressed", String(name === names[0]));
    made.append(tab);
  }
  panes.dataset.tab = names[0];
  return made;
}

/** @param {State} state @param {AddEventListenerOptions} [options] */
function keys(state, options = {}) {
  document.addEventListener("keydown", (event) => {
    if (!(event.target instanceof Element) || event.target.matches("select, input") || event.altKey || event.ctrlKey || event.metaKey) return;
    const size = state.axis.high - state.axis.low, last = state.run.times.length - 1;
    /** @type {{ [key: string]: () => void }} */
    const acts = {
      " ": () => state.play(!state.isPlaying),
      ArrowRight: () => state.step(event.shiftKey ? 20 : 1),
      ArrowLeft: () => state.step(event.shiftKey ? -20 : -1),
      Home: () => state.setTag(0),
      End: () => state.setTag(last),
      "+": () => state.zoom(0.7, state.cursor),
      "-": () => state.zoom(1 / 0.7, state.cursor),
      "0": () => state.show(...state.extent),
      "[": () => state.show(state.axis.low - size / 4, state.axis.high - size / 4),
      "]": () => state.show(state.axis.low + size / 4, state.axis.high + size / 4),
      t: () => state.setByTag(!state.axis.byTag),
      Enter: () => state.selectNext(),
      Escape: () => state.select(null),
    };
    if (!acts[event.key] || ([" ", "Enter"].includes(event.key) && event.target.matches("button"))) return;
    event.preventDefault();
    acts[event.key]();
  }, options);
}
