// Lanes: acts of each aspect, then signals, numbers as lines and states as strips; two runs are drawn over each other.

const LANE = 46, ACTS = 17, RULER = 18, MODES = 8;

class Lanes extends Timeline {
  /** @param {State} state */
  constructor(state) {
    super(state, "Signals and events of aspects over time");
    this.canvas.dataset.view = "lanes";
    this.names = [...new Set(state.runs.flatMap((run) => run.lanes.map((lane) => lane.name)))];
    const asked = state.runs[0].lanes.filter((lane) => lane.asked).map((lane) => lane.name);
    this.shown = new Set(asked.length ? asked.slice(0, 12) : this.names.slice(0, 6));
    this.addModes(state.runs[0]);
  }

  // Ports that send words, such as modes of machines, have lanes even if they are not recorded.
  /** @param {Run} run */
  addModes(run) {
    const modes = [...run.ports.keys()].filter((port) => {
      const rows = run.recordsAt.of(port).slice(0, 40).filter((row) => run.isSend[row]);
      return rows.length && rows.every((row) => run.text(row).startsWith('"'));
    });
    for (const port of modes.slice(0, MODES)) this.toggle(run.portPath(port), true);
  }

  // Shows or hides a signal, or the numbers or words that an unrecorded port sent.
  /** @param {Path} path @param {boolean} [isShown] */
  toggle(path, isShown = !this.shown.has(path)) {
    if (!isShown) this.shown.delete(path);
    else {
      for (const run of this.state.runs)
        if (run.portOf.has(path) && !run.lanes.some((lane) => lane.name === path)) run.lanes.push(laneOf(run, path));
      if (!this.names.includes(path)) this.names.push(path);
      this.shown.add(path);
    }
    this.state.changed();
  }

  /** @param {Paper} paper */
  draw(paper) {
    const { state } = this;
    this.ruler();
    paper.save();
    paper.beginPath();
    paper.rect(0, RULER - 3, this.width, this.height);
    paper.clip();
    let y = RULER - this.scroll;
    for (const [number, name] of state.run.aspects.entries()) {
      if (y + ACTS > 0 && y < this.height) this.acts(number, name, y);
      y += ACTS;
    }
    for (const name of this.names) {
      if (!this.shown.has(name)) continue;
      if (y + LANE > 0 && y < this.height) this.lane(name, y);
      y += LANE;
    }
    this.tall = y + this.scroll + 4;
    if (y === RULER - this.scroll)
      for (const [line, words] of ["Nothing is recorded. Select an actor:", "each port that it sends from can be a lane."].entries())
        this.text(words, this.margin + 8, 40 + 15 * line, { colour: theme.soft });
    paper.restore();
    this.cursor();
  }

  // A click near an act selects it.
  /** @param {number} x @param {number} y */
  pick(x, y) {
    const { state } = this, { run } = state, aspect = Math.floor((y + this.scroll - RULER) / ACTS);
    let best = NOTHING, least = 8;
    if (aspect >= 0 && aspect < run.aspects.length && y > RULER) {
      const around = this.at(x - least), first = search(run.acts.length, (i) => state.place(run, run.record_tag[run.acts[i]]) >= around);
      for (let i = first; i < run.acts.length; i++) {
        const record = run.acts[i], away = this.x(state.place(run, run.record_tag[record])) - x;
        if (away > least) break;
        if (run.record_aspect[record] === aspect && Math.abs(away) < least) [best, least] = [record, Math.abs(away)];
      }
    }
    if (best >= 0) state.goTo({ run: state.active, firing: NOTHING, record: best });
    else super.pick(x);
  }

  /** @param {number} number @param {string} name @param {number} y */
  acts(number, name, y) {
    const { run } = this.state, { acts } = run, [first, last] = this.tagsInSight(run);
    this.text(name, 4, y + 12, { size: 10.5, colour: theme.soft, width: this.margin - 8 });
    const from = search(acts.length, (i) => run.record_tag[acts[i]] >= first);
    let before = -10;
    for (let i = from; i < acts.length && run.record_tag[acts[i]] <= last; i++) {
      if (run.record_aspect[acts[i]] !== number) continue;
      const x = this.x(this.state.place(run, run.record_tag[acts[i]])), isLoss = run.isLoss.has(acts[i]);
      if (x - before < 0.7 && !isLoss) continue;
      if (isLoss) this.cross(x, y + 8, 3, theme.loss);
      else this.line([x, y + 3, x, y + 13], faded(PALETTE[(number + 1) % PALETTE.length], 0.7), 1);
      before = x;
    }
  }

  /** @param {string} name @param {number} y */
  lane(name, y) {
    const { state } = this;
    this.line([0, y, this.width, y], theme.faint, 0.5);
    const found = state.runs.map((run) => run.lanes.find((lane) => lane.name === name));
    const parts = name.match(/^(.*?)([^.]*)$/);
    this.text(parts[2], 4, y + 15, { size: 10.5, bold: true, width: this.margin - 8 });
    this.text(parts[1].replace(/\.$/, ""), 4, y + 41, { size: 9, colour: theme.soft, width: this.margin - 8 });
    const isNumber = found.some((lane) => lane && !lane.states);
    if (isNumber) this.numbers(found, y);
    else found.forEach((lane, run) => lane && this.strip(lane, run, y + 4 + (run * (LANE - 8)) / found.length, (LANE - 8) / found.length));
    const lane = found[state.active];
    if (!lane) return;
    const row = search(lane.times.length, (i) => lane.times[i] > state.time / 1e9) - 1;
    const now = row < 0 ? "–" : lane.states ? lane.states[lane.values[row]] ?? "–" : numberText(lane.values[row]);
    this.text(now, 4, y + 28, { size: 11, colour: theme.now, width: this.margin - 8 });
  }

  // The position of a sample on the axis.
  /** @param {Run} run @param {number} seconds */
  sampleX(run, seconds) {
    if (!this.state.axis.byTag) return this.x(seconds * 1e9);
    return this.x(search(run.times.length, (tag) => run.times[tag] >= seconds * 1e9 - 0.5));
  }

  /** @param {Lane} lane */
  inSight(lane) {
    const { axis, run } = this.state;
    const [low, high] = axis.byTag
      ? [run.times[Math.max(0, Math.floor(axis.low))] ?? 0, run.times[Math.min(run.times.length - 1, Math.ceil(axis.high))] ?? this.state.end]
      : [axis.low, axis.high];
    return [
      Math.max(0, search(lane.times.length, (i) => lane.times[i] * 1e9 > low) - 1),
      Math.min(lane.times.length, search(lane.times.length, (i) => lane.times[i] * 1e9 > high) + 1),
    ];
  }

  /** @param {(Lane | undefined)[]} lanes @param {number} y */
  numbers(lanes, y) {
    let low = Infinity, high = -Infinity;
    for (const lane of lanes)
      if (lane && !lane.states) {
        const [from, to] = this.inSight(lane);
        for (let i = from; i < to; i++)
          if (Number.isFinite(lane.values[i])) {
            low = Math.min(low, lane.values[i]);
            high = Math.max(high, lane.values[i]);
          }
      }
    if (low > high) return;
    const size = high - low || Math.abs(high) || 1, up = (/** @type {number} */ value) => y + LANE - 5 - ((value - low) / size) * (LANE - 12);
    this.paper.save();
    this.paper.beginPath();
    this.paper.rect(this.margin, y, this.span + 8, LANE);
    this.paper.clip();
    lanes.forEach((lane, number) => {
      if (!lane || lane.states) return;
      const run = this.state.runs[number], [from, to] = this.inSight(lane);
      const isActive = number === this.state.active, colour = PALETTE[isActive ? 0 : 5];
      /** @type {number[]} */
      let points = [];
      const draw = () => {
        if (lane.line && points.length === 2) this.dot(points[0], points[1], 1.5, colour); // alone between gaps
        this.line(points, colour, 1.4, isActive ? [] : [4, 3]);
        points = [];
      };
      for (let i = from; i < to; i++) {
        const x = this.sampleX(run, lane.times[i]), value = up(lane.values[i]);
        if (!lane.line && points.length) points.push(x, points.at(-1));
        if (Number.isFinite(value)) points.push(x, value);
        else draw(); // a gap until the next number
      }
      if (to === lane.times.length && points.length && !lane.line) points.push(this.sampleX(run, run.end / 1e9), points.at(-1));
      draw();
    });
    this.paper.restore();
    if (high > low)
      for (const [value, at] of [[high, y + 10], [low, y + LANE - 3]])
        this.text(numberText(value), this.width - 6, at, { size: 9, align: "right", colour: theme.soft, isApart: true });
  }

  /** @param {Lane} lane @param {number} number @param {number} y @param {number} tall */
  strip(lane, number, y, tall) {
    const run = this.state.runs[number], [from, to] = this.inSight(lane);
    for (let i = from; i < to; i++) {
      const begin = Math.max(this.margin, this.sampleX(run, lane.times[i]));
      const end = this.sampleX(run, lane.times[i + 1] ?? run.end / 1e9), state = lane.values[i];
      if (state < 0 || end < this.margin) continue;
      this.paper.fillStyle = faded(PALETTE[state % PALETTE.length], 0.55);
      this.paper.fillRect(begin, y, Math.max(0.6, end - begin), tall - 2);
      if (tall > 12) this.text(lane.states[state], begin + 3, y + tall / 2 + 3, { size: 10, width: end - begin - 6 });
    }
  }
}

// What a port sent in the kept firings.
/** @param {Run} run @param {Path} path */
function laneOf(run, path) {
  const rows = run.recordsAt.of(run.portOf.get(path)).filter((row) => run.isSend[row]);
  const times = Float64Array.from(rows, (row) => run.times[run.record_tag[row]] / 1e9);
  const numbers = Float64Array.from(rows, (row) => parseFloat(run.text(row)));
  /** @type {Lane} */
  const lane = { name: path, times, values: numbers, states: null, line: false, left_out: 0 };
  if (numbers.some((number) => !Number.isNaN(number))) return lane;
  const words = Array.from(rows, (row) => run.text(row).replace(/^"|"$/g, "")), states = [...new Set(words)];
  const place = new Map(states.map((state, i) => [state, i]));
  return { ...lane, values: Float64Array.from(words, (word) => place.get(word)), states };
}
