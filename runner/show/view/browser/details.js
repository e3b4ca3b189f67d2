// Details of the selection, in words: what it took, what it sent, what it did not get, and links to follow.

class Details {
  /** @param {State} state @param {Lanes} lanes */
  constructor(state, lanes) {
    this.state = state;
    this.lanes = lanes;
    this.box = element("div", { className: "details", tabIndex: -1 });
    this.box.setAttribute("aria-live", "polite");
    state.listeners.push(() => this.show());
    this.show();
  }

  show() {
    const { selection } = this.state, used = this.box.contains(document.activeElement) ? document.activeElement.textContent : null;
    this.box.replaceChildren(...(selection ? this.selected(selection) : this.overview()));
    if (used === null) return;
    const same = [...this.box.querySelectorAll("button")].find((each) => each.textContent === used);
    (same ?? this.box).focus(); // so that keys go on from here
  }

  overview() {
    const { data, runs, active } = this.state, run = runs[active], parts = [];
    if (data.story.length) parts.push(element("h2", { text: "What if" }), ...data.story.map((text) => element("p", { className: "story", text })));
    if (data.difference) parts.push(...this.difference());
    parts.push(element("h2", { text: run.name || run.model }));
    if (run.doc) parts.push(element("p", { text: run.doc }));
    const facts = [
      ["seed", run.seed], ["end", `${secondsText(run.end)}, ${run.stopped}`], ["firings", run.firings.toLocaleString("en")],
      ["events", run.records.toLocaleString("en")], ["digest", `${run.digest.slice(0, 16)}…`],
    ];
    if (run.settings.length) facts.push(["settings", run.settings.join(", ")]);
    parts.push(table(run.metrics.map(([name, value, unit, doc]) => [name, `${value}${unit ? ` ${unit}` : ""}`, doc]), "metrics"));
    for (const { name, property, text, time } of run.monitors) {
      parts.push(element("h2", { text: `Monitor ${name}` }), table([[property, text]], "monitor"));
      if (time !== null) parts.push(button("go to the break", () => this.state.setTime(time)));
    }
    parts.push(table(facts, "run"));
    const shown = run.firing_tag.length;
    if (shown < run.firings)
      parts.push(element("p", { className: "note", text: `The run is too long to show completely: ${shown.toLocaleString("en")} of its firings are shown, in ${run.gaps.length + 1} stretches without gaps. Signals and metrics cover the whole run.` }));
    const thinned = run.lanes.filter((lane) => lane.left_out);
    if (thinned.length)
      parts.push(element("p", { className: "note", text: `${thinned.length} of ${run.lanes.length} signals are thinned: where there are more samples than pixels, the lowest and the highest are shown.` }));
    if (run.lanes_left_out)
      parts.push(element("p", { className: "note", text: `Not shown: ${run.lanes_left_out.toLocaleString("en")} of the recorded signals, for which the page has no lane. Record fewer, or choose them with a figure.` }));
    parts.push(element("p", { className: "note", text: "Select an actor, a body, a dot or a cross to see what led to it and what came of it." }));
    return parts;
  }

  difference() {
    const { data, runs } = this.state, { difference } = data;
    /** @type {HTMLElement[]} */
    const parts = [element("h2", { text: "First difference" })];
    parts.push(table(runs.map((run, i) => [run.name, difference.texts[i]]), "difference"));
    const place = runs[this.state.active].tagOfDifference;
    if (place !== undefined) parts.push(button("go there", () => this.state.setTag(place)));
    if (difference.fired.length) {
      parts.push(element("h2", { text: "First firing that changes" }));
      parts.push(table(runs.map((run, i) => [run.name, difference.fired[i]]), "difference fired"));
      const there = runs.map((run, i) => i).filter((i) => runs[i].firstChange >= 0);
      for (const i of there)
        parts.push(button(`show it in ${runs[i].name}`, () => this.state.goTo({ run: i, firing: runs[i].firstChange, record: NOTHING }), "changed"));
    }
    if (data.comparison.length) {
      const head = ["metric", ...runs.map((run) => run.name), "change"];
      parts.push(table([head, ...data.comparison], "compared"));
    }
    return parts;
  }

  /** @param {Chosen} given */
  selected({ firing, record }) {
    const { state } = this, { run } = state, parts = [];
    if (record >= 0 && firing < 0) parts.push(...this.act(run, record));
    else parts.push(...this.fired(run, firing));
    if (state.cone) parts.push(...this.cone(state.cone));
    return parts;
  }

  /** @param {Run} run @param {number} firing */
  fired(run, firing) {
    const actor = run.actorName(firing), outside = ["", "SimPy resumed the process", "an aspect released what it had held"];
    /** @type {HTMLElement[]} */
    const parts = [
      element("h2", { text: actor }),
      element("p", { text: `fired at ${run.tagText(run.firing_tag[firing])}${run.firing_outside[firing] ? `: ${outside[run.firing_outside[firing]]}` : ""}` }),
      element("div", { className: "buttons" },
        button("earlier", () => this.neighbour(firing, -1)), button("later", () => this.neighbour(firing, 1)), button("close", () => this.state.select(null))),
    ];
    const took = [...run.arrivalsOf.of(firing)].map((arrival) => this.arrival(run, firing, arrival));
    for (const wake of run.wakesOf.of(firing)) {
      const asker = run.wake_asker[wake], tag = run.wake_tag[wake];
      took.push(this.item("wake-up", tag < 0 ? "requested in initialize" : `requested at ${run.tagText(tag)}`, asker, NOTHING));
    }
    parts.push(...list("took", took));
    const missed = lossesBefore(run, firing).map((/** @type {number} */ record) => this.loss(run, record));
    parts.push(...list("did not get", missed));
    const kept = absorbed(run, firing, run.firing_actor[firing]).filter(() => run.hasSent[firing]).slice(0, 20).map((before) =>
      this.item("earlier", `what it took at ${run.tagText(run.firing_tag[before])}`, before, NOTHING));
    parts.push(...list("since it last sent", kept));
    const sent = [...run.recordsOf.of(firing)].map((record) => this.sent(run, record));
    parts.push(...list("sent", sent));
    return parts;
  }

  /** @param {Run} run @param {number} firing @param {number} arrival */
  arrival(run, firing, arrival) {
    const port = run.portText(run.arrival_port[arrival], run.arrival_channel[arrival]).split(".").at(-1), record = run.arrival_record[arrival];
    if (record < 0) return this.item(port, "sent in a part of the run that is not shown", NOTHING, NOTHING);
    const late = run.record_tag[record] === run.firing_tag[firing] ? "" : `, sent at ${run.tagText(run.record_tag[record])}`;
    const acts = [...run.actsAbout.of(record)].filter((act) => run.ports[run.record_port[act]].leads.includes(run.firing_actor[firing]));
    const marks = [...new Set(acts.map((act) => `${run.aspects[run.record_aspect[act]]}: ${run.events[run.record_event[act]]}`))];
    return this.item(port, `${run.text(record)} from ${run.portPath(run.record_port[record])}${late}${marks.length ? ` (${marks.join(", ")})` : ""}`, run.record_firing[record], NOTHING);
  }

  /** @param {Run} run @param {number} record */
  loss(run, record) {
    const about = run.record_about[record], sent = about >= 0 ? `${run.portPath(run.record_port[about])} of ${run.tagText(run.record_tag[about])}` : "a token";
    return this.item(run.portPath(run.record_port[record]), `${sent}: ${run.events[run.record_event[record]]} by ${run.aspects[run.record_aspect[record]]}`, NOTHING, record);
  }

  /** @param {Run} run @param {number} record */
  sent(run, record) {
    const port = run.portText(run.record_port[record], run.record_channel[record]), takers = new Set([...run.arrivalsFrom.of(record)].map((arrival) => run.arrival_firing[arrival]));
    const acts = run.isSend[record] ? [] : [`${run.events[run.record_event[record]]} by ${run.aspects[run.record_aspect[record]]}`];
    const line = this.item(port.split(".").at(-1), [run.text(record), ...acts].join(", "), NOTHING, NOTHING);
    for (const taker of [...takers].slice(0, 12)) line.append(" ", this.link(`→ ${run.actorName(taker)}`, taker, NOTHING));
    if (takers.size > 12) line.append(` and ${takers.size - 12} more`);
    for (const act of run.actsAbout.of(record)) if (run.isLoss.has(act)) line.append(" ", this.link(`✕ ${run.portPath(run.record_port[act])}`, NOTHING, act));
    line.append(" ", button("show as a lane", () => this.lanes.toggle(run.portPath(run.record_port[record]), true)));
    return line;
  }

  /** @param {Run} run @param {number} record */
  act(run, record) {
    const about = run.record_about[record], sender = senderOf(run, record);
    /** @type {HTMLElement[]} */
    const parts = [
      element("h2", { text: `${run.events[run.record_event[record]]} by ${run.aspects[run.record_aspect[record]]}` }),
      element("p", { text: `at ${run.portText(run.record_port[record], run.record_channel[record])}, ${run.tagText(run.record_tag[record])}` }),
      element("p", { text: run.text(record), className: "token" }),
      element("div", { className: "buttons" }, button("close", () => this.state.select(null))),
    ];
    if (about >= 0) parts.push(...list("sent by", [this.item(run.portPath(run.record_port[about]).split(".").at(-1), `at ${run.tagText(run.record_tag[about])}`, sender, NOTHING)]));
    if (run.isLoss.has(record))
      parts.push(...list("fired without it", deprived(run, record).map((firing) => this.item(run.actorName(firing), `fired at ${run.tagText(run.firing_tag[firing])}`, firing, NOTHING))));
    return parts;
  }

  /** @param {Cone} cone */
  cone(cone) {
    const { state } = this, { run } = state, words = [];
    const since = (/** @type {Map<number, boolean>} */ firings) => {
      let first = Infinity, last = 0; // firings are in order of their tags
      for (const firing of firings.keys()) [first, last] = [Math.min(first, firing), Math.max(last, firing)];
      return `${firings.size.toLocaleString("en")} firings, ${secondsText(run.times[run.firing_tag[first]])} to ${secondsText(run.times[run.firing_tag[last]])}`;
    };
    if (cone.back.size) words.push(["led to it", since(cone.back)]);
    if (cone.ahead.size) words.push(["came of it", since(cone.ahead)]);
    const made = [element("h3", { text: "causal cone" }), table(words, "cone")];
    if (cone.isCut) made.push(element("p", { className: "note", text: `Only the ${NEAREST} nearest firings in each direction are followed.` }));
    return made;
  }

  /** @param {number} firing @param {number} step */
  neighbour(firing, step) {
    const { run, active } = this.state, rows = run.firingsOf.of(run.firing_actor[firing]), place = rows.indexOf(firing) + step;
    if (place >= 0 && place < rows.length) this.state.goTo({ run: active, firing: rows[place], record: NOTHING });
  }

  /** @param {string} name @param {string} words @param {number} firing @param {number} record */
  item(name, words, firing, record) {
    const line = element("li", {}, element("b", { text: name }), " ");
    line.append(firing >= 0 || record >= 0 ? this.link(words, firing, record) : words);
    return line;
  }

  /** @param {string} words @param {number} firing @param {number} record */
  link(words, firing, record) {
    return button(words, () => this.state.goTo({ run: this.state.active, firing, record }), "link");
  }
}

/** @param {string} words @param {() => void} act @param {string} [title] what it does, if words are a sign */
function button(words, act, className = "", title) {
  const made = element("button", { type: "button", text: words, className, ...(title && { label: title, title }) });
  made.addEventListener("click", act);
  return made;
}

/** @param {string} title @param {Node[]} items @returns {HTMLElement[]} */
function list(title, items) {
  return items.length ? [element("h3", { text: title }), element("ul", {}, ...items)] : [];
}

/** @param {(string | number)[][]} rows @param {string} className */
function table(rows, className) {
  const made = element("table", { className });
  for (const [name, ...cells] of rows) {
    const parts = String(name).split(/(?<=[_.])/).flatMap((part) => [part, element("wbr")]); // long names break between words
    made.append(element("tr", {}, element("th", {}, ...parts), ...cells.map((cell) => element("td", { text: String(cell) }))));
  }
  return made;
}
