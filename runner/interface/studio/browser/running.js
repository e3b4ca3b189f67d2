// The run of what is written: its figures as they come, whether it is still the same run, and its views over time.

class Running {
  /** @param {Link} link @param {{ shown: (data: Page, run: { text: string, until: number | null }) => void }} told */
  constructor(link, { shown }) {
    this.link = link;
    this.shown = shown; // told of a run that is over
    this.latest = 0;
    /** @type {Run | null} */
    this.before = null;
    /** @type {Run | null} */
    this.now = null;
    this.status = element("p", { className: "status", role: "status" });
    this.bar = element("progress", { max: 1, value: 0, hidden: true });
    this.digest = element("p", { className: "digest" });
    this.metrics = element("table", { className: "figures" });
    this.monitors = element("ul", { className: "monitors" });
    this.box = element("div", { className: "run" }, this.status, this.bar, this.metrics, this.monitors, this.digest);
  }

  /** @param {string} words */
  say(words, kind = "") {
    this.status.textContent = words;
    this.status.dataset.kind = kind;
  }

  /** @param {string} text */
  async start(text) {
    const number = ++this.latest;
    this.say("running …", "running");
    /** @type {RunAnswer & { error?: string, stale?: boolean }} */
    const found = await this.link.ask({ ask: "run", text }, (said) => {
      if (number !== this.latest) return;
      this.bar.hidden = said.share === null;
      this.bar.value = said.share ?? 0;
      this.say(`running … ${said.records.toLocaleString("en")} events`, "running");
      this.table(said.metrics, this.now?.metrics);
    });
    if (number !== this.latest || found.stale) return;
    this.bar.hidden = true;
    if (found.error) {
      this.box.classList.add("stale");
      return this.say(found.error, "failed");
    }
    const data = await readData(found.view), [run] = data.runs;
    if (number !== this.latest) return;
    this.box.classList.remove("stale");
    [this.before, this.now] = [this.now, run];
    this.say(found.failed || found.ended || `${run.records.toLocaleString("en")} events in ${found.seconds.toFixed(2)} s; ended by ${run.stopped}`,
      found.failed ? "failed" : found.ended ? "ended" : "done");
    this.table(run.metrics, this.before?.metrics);
    this.monitors.replaceChildren(...run.monitors.map(({ name, holds, text: remark }) =>
      element("li", { className: holds ? "holds" : "broken", text: `${name} ${holds ? "holds" : remark}` })));
    const moved = this.before && (this.before.digest === run.digest ? "the same run as before" : "another run than before");
    this.digest.replaceChildren(
      ...(moved ? [element("b", { text: moved, className: this.before.digest === run.digest ? "same" : "moved" }), " "] : []),
      element("code", { text: run.digest.slice(0, 16), title: `digest of the event log: ${run.digest}` }));
    this.shown(data, { text, until: found.ended ? run.end / 1e9 : null });
  }

  // The text has changed: what is shown belongs to the one before.
  stale(words = "") {
    this.latest++;
    this.bar.hidden = true;
    this.box.classList.add("stale");
    if (words) this.say(words, "waiting");
  }

  /** @param {Metric[]} metrics @param {Metric[]} [before] */
  table(metrics, before) {
    const old = new Map((before ?? []).map((each) => [each[0], each[4]]));
    this.metrics.replaceChildren(...metrics.map(([name, words, unit, doc, value]) => {
      const was = old.get(name), change = typeof was === "number" && typeof value === "number" ? value - was : 0;
      const cell = element("td", { text: change ? `${change > 0 ? "+" : "−"}${numberText(Math.abs(change))}` : "", className: change ? "change" : "" });
      const row = element("tr", {}, element("th", { text: name, title: doc }), element("td", { text: `${words} ${unit}`.trim() }), cell);
      row.dataset.metric = name;
      return row;
    }));
  }
}

// The views of a run over time, one of them at a time.
class Views {
  /** @param {WhatIf} whatIf */
  constructor(whatIf) {
    this.whatIf = whatIf;
    this.tabs = element("div", { className: "tabs" });
    this.holder = element("div", { className: "holder" });
    this.strip = element("div", { className: "scrub" });
    this.time = element("output", { className: "now" });
    this.times = timeButtons(() => this.state);
    this.box = element("div", { className: "views" },
      element("div", { className: "viewbar" }, ...this.times.buttons, this.time, this.tabs), this.whatIf.box, this.strip, this.holder);
    this.wanted = "";
    /** @type {{ [name: string]: any } | null} the views of the run, by name */
    this.known = null;
  }

  /** @param {State} state @param {{ runs: Run[] }} data */
  show(state, data) {
    const before = this.lanes;
    this.state = state;
    this.box.classList.toggle("empty", !state.run.times.length);
    if (!state.run.times.length) {
      this.known = null;
      this.time.textContent = "";
      return this.holder.replaceChildren(element("p", { className: "hint", text: "The run over time appears here." }));
    }
    this.lanes = new Lanes(state);
    if (before) for (const name of before.shown) if (this.lanes.names.includes(name)) this.lanes.shown.add(name);
    this.scrubber = new Scrubber(state);
    /** @type {{ [name: string]: any }} */
    const known = { signals: this.lanes, sequence: new Chart(state), details: new Details(state, this.lanes) };
    if (data.runs.some((each) => each.marks.length)) known.space = new Space(state, 0, { scale: 0, x: 0, y: 0, extent: Space.extent(data.runs) });
    this.known = known;
    const names = ["space", "signals", "sequence", "details"].filter((name) => known[name]);
    this.tabs.replaceChildren(...names.map((name) => {
      const tab = button(name, () => this.choose(name), "toggle");
      tab.dataset.view = name;
      return tab;
    }));
    this.strip.replaceChildren(this.scrubber.canvas);
    this.choose(names.includes(this.wanted) ? this.wanted : names[0], false);
  }

  /** @param {string} name */
  choose(name, isWanted = true) {
    if (isWanted) this.wanted = name;
    this.name = name;
    for (const tab of this.tabs.querySelectorAll("button")) tab.setAttribute("aria-pressed", String(tab.dataset.view === name));
    this.holder.replaceChildren(this.known[name].canvas ?? this.known[name].box);
    this.state.changed();
  }

  paint() {
    const { state } = this;
    if (!this.known) return;
    this.scrubber.paint();
    this.known[this.name].paint?.();
    this.time.textContent = state.nowText;
    this.times.tell(this.time);
    this.whatIf.tell();
  }
}
