// The common part of all views over time: axis, cursor, dragging and zooming; and the strip of the whole run.

const MARGIN = 168; // px at the left, for names

class Timeline extends View {
  /** @param {State} state @param {string} label */
  constructor(state, label) {
    super(state, label);
    this.scroll = 0;
    this.canvas.dataset.scrolls = "yes";
    gestures(this.canvas, {
      move: (dx, dy) => {
        const size = state.axis.high - state.axis.low;
        state.show(state.axis.low - (dx / this.span) * size, state.axis.high - (dx / this.span) * size);
        this.scrollBy(-dy);
      },
      zoom: (factor, x) => state.zoom(factor, this.at(x)),
      click: (x, y) => this.pick(x, y),
    });
  }

  get margin() {
    return this.width < 500 ? 96 : MARGIN;
  }

  get span() {
    return this.width - this.margin - 8;
  }

  /** @param {number} place */
  x(place) {
    const { low, high } = this.state.axis;
    return this.margin + ((place - low) / (high - low)) * this.span;
  }

  /** @param {number} x */
  at(x) {
    const { low, high } = this.state.axis;
    return low + ((x - this.margin) / this.span) * (high - low);
  }

  // The visible tags of a run.
  /** @param {Run} run */
  tagsInSight(run) {
    const { low, high, byTag } = this.state.axis;
    if (byTag) return [Math.max(0, Math.floor(low)), Math.min(run.times.length - 1, Math.ceil(high))];
    return [search(run.times.length, (tag) => run.times[tag] >= low), run.tagAt(high)];
  }

  /** @param {number} dy */
  scrollBy(dy) {
    const most = Math.max(0, (this.tall ?? 0) - this.height);
    this.scroll = Math.min(most, Math.max(0, this.scroll + dy));
    this.state.changed();
  }

  ruler() {
    const { axis, run } = this.state, { low, high } = axis;
    const marks = axis.byTag ? ticks(low, high, this.span / 110) : ticks(low / 1e9, high / 1e9, this.span / 90);
    let free = this.margin; // px from which on nothing is written
    for (const at of marks.at) {
      const x = this.x(axis.byTag ? at : at * 1e9);
      if (x < this.margin) continue;
      this.line([x, 0, x, this.height], theme.faint, 0.5);
      const words = axis.byTag ? (Number.isInteger(at) && run.times[at] !== undefined ? run.tagText(at) : "") : `${numberText(at, marks.step)} s`;
      this.write(10, false);
      const wide = this.paper.measureText(words).width, start = Math.min(x + 3, this.width - wide - 3);
      if (start < free) continue;
      this.text(words, start, 11, { size: 10, colour: theme.soft, isApart: true });
      free = start + wide + 8;
    }
    // The firings that a thinned run does not show.
    for (const [kept, count] of run.gaps) {
      const before = run.firing_tag[kept - 1] ?? 0, after = run.firing_tag[kept] ?? run.times.length - 1;
      const from = this.x(this.state.place(run, before)), to = this.x(this.state.place(run, after));
      if (to < this.margin || from > this.width) continue;
      this.paper.fillStyle = faded("#888888", 0.18);
      this.paper.fillRect(Math.max(this.margin, from), 14, Math.max(1, to - Math.max(this.margin, from)), this.height);
      this.text(`${count.toLocaleString("en")} firings not shown`, Math.max(this.margin, from) + 3, this.height - 4,
        { size: 10, colour: theme.soft, width: to - from - 6 });
    }
  }

  cursor() {
    const x = this.x(this.state.cursor);
    if (x >= this.margin - 1) this.line([x, 0, x, this.height], theme.now, 1.5);
    const { data, runs, active } = this.state;
    for (const { time } of runs[active].monitors) {
      const at = time === null || this.state.axis.byTag ? -1 : this.x(time);
      if (at >= this.margin) this.line([at, 0, at, this.height], theme.loss, 1.5, [1, 3]);
    }
    if (data.difference) {
      const tag = runs[active].tagOfDifference, at = tag === undefined ? -1 : this.x(this.state.place(runs[active], tag));
      if (at >= this.margin) this.line([at, 0, at, this.height], theme.loss, 1.5, [4, 3]);
    }
  }

  /** @param {number} x @param {number} [y] */
  pick(x, y) {
    if (x >= this.margin) {
      this.state.isPlaying = false;
      this.state.setCursor(this.at(x));
    }
  }
}

// The whole run in one strip: how much happens when, the visible part, and the cursor.
class Scrubber extends View {
  /** @param {State} state */
  constructor(state) {
    super(state, "The whole run: drag to move through time");
    this.canvas.dataset.view = "scrubber";
    gestures(this.canvas, {
      grab: (x) => {
        const move = (/** @type {number} */ to) => {
          state.isPlaying = false;
          const [low, high] = state.extent;
          state.setCursor(low + (to / this.width) * (high - low));
          state.keepInSight();
        };
        move(x);
        return move;
      },
      zoom: (factor) => state.zoom(factor, state.cursor),
    });
  }

  resized() {
    this.counted = null;
  }

  /** @param {Paper} paper */
  draw(paper) {
    const { state } = this, { run, axis } = state, [low, high] = state.extent;
    const x = (/** @type {number} */ place) => ((place - low) / (high - low)) * this.width;
    if (this.counted?.run !== run || this.counted.byTag !== axis.byTag) this.count(run, x);
    const most = Math.max(1, ...this.counted.firings);
    this.counted.firings.forEach((count, i) => {
      const tall = count ? Math.max(1.5, (Math.sqrt(count / most)) * (this.height - 10)) : 0;
      paper.fillStyle = faded(PALETTE[0], 0.45);
      paper.fillRect(2 * i, this.height - tall, 1.6, tall);
      if (this.counted.losses[i]) {
        paper.fillStyle = theme.loss;
        paper.fillRect(2 * i, 0, 2, 5);
      }
    });
    paper.fillStyle = faded("#888888", 0.16);
    paper.fillRect(x(axis.low), 0, Math.max(2, x(axis.high) - x(axis.low)), this.height);
    const tag = run.tagOfDifference;
    if (tag !== undefined) this.line([x(state.place(run, tag)), 0, x(state.place(run, tag)), this.height], theme.loss, 2, [3, 2]);
    this.line([x(state.cursor), 0, x(state.cursor), this.height], theme.now, 2.5);
  }

  /** @param {Run} run @param {(place: number) => number} x */
  count(run, x) {
    const parts = Math.ceil(this.width / 2), firings = new Float64Array(parts), losses = new Uint8Array(parts);
    const part = (/** @type {number} */ tag) => Math.min(parts - 1, Math.max(0, Math.floor(x(this.state.place(run, tag)) / 2)));
    for (const tag of run.firing_tag) firings[part(tag)]++;
    for (const { record } of run.losses) losses[part(run.record_tag[record])] = 1;
    this.counted = { run, byTag: this.state.axis.byTag, firings, losses };
  }
}
