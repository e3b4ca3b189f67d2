// Space: the positions of things, as figures of the model place them.

class Space extends View {
  /** @param {State} state @param {number} number @param {Camera & { extent: Rect }} camera */
  constructor(state, number, camera) {
    super(state, "Space: bodies, estimates, plans and goals");
    this.number = number;
    this.marks = state.runs[number].marks;
    /** @type {[x: number, y: number, width: number][]} */
    this.names = []; // where some are written
    this.camera = camera; // shared by all runs, which are seen from one place
    this.canvas.dataset.view = "space";
    gestures(this.canvas, {
      move: (dx, dy) => this.pan(dx, dy),
      zoom: (factor, x, y) => this.zoom(factor, x, y),
      click: (x, y) => this.pick(x, y),
    });
    this.canvas.addEventListener("dblclick", () => {
      this.camera.scale = 0;
      state.changed();
    });
  }

  /** @param {Run[]} runs @returns {Rect} */
  static extent(runs) {
    let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const { marks } of runs)
      for (const { shape, rows, width, radius } of marks) {
        if (shape !== "body" && shape !== "goal") continue;
        for (let i = 0; i < rows.length; i += width) {
          if (!Number.isFinite(rows[i] + rows[i + 1])) continue;
          left = Math.min(left, rows[i] - radius);
          right = Math.max(right, rows[i] + radius);
          low = Math.min(low, rows[i + 1] - radius);
          high = Math.max(high, rows[i + 1] + radius);
        }
      }
    return left > right ? [-1, 1, -1, 1] : [left, right, low, high];
  }

  look() {
    const { camera } = this;
    if (!camera.scale) {
      const [left, right, low, high] = camera.extent;
      const scale = Math.min((this.width - 50) / (right - left || 1), (this.height - 50) / (high - low || 1));
      Object.assign(camera, { scale: Math.max(scale, 1e-9), x: (left + right) / 2, y: (low + high) / 2 });
    }
  }

  /** @param {number} x */
  x(x) {
    return this.width / 2 + (x - this.camera.x) * this.camera.scale;
  }

  /** @param {number} y */
  y(y) {
    return this.height / 2 - (y - this.camera.y) * this.camera.scale;
  }

  /** @param {number} dx @param {number} dy */
  pan(dx, dy) {
    this.camera.x -= dx / this.camera.scale;
    this.camera.y += dy / this.camera.scale;
    this.state.changed();
  }

  /** @param {number} factor @param {number} x @param {number} y */
  zoom(factor, x, y) {
    const { camera } = this, dx = x - this.width / 2, dy = this.height / 2 - y;
    camera.x += (dx / camera.scale) * (1 - factor);
    camera.y += (dy / camera.scale) * (1 - factor);
    camera.scale /= factor;
    this.state.changed();
  }

  /** @param {Mark} mark */
  colour(mark) {
    return mark.colour === null ? theme.limit : PALETTE[mark.colour % PALETTE.length];
  }

  // The row of a mark that is valid at a time (s); -1 before the first.
  /** @param {Mark} mark @param {number} time */
  row(mark, time) {
    return search(mark.times.length, (row) => mark.times[row] > time + 1e-12) - 1;
  }

  // Whether a row is older than the usual interval between rows.
  /** @param {Mark} mark @param {number} row @param {number} time */
  isStale(mark, row, time) {
    return time - mark.times[row] > 1.6 * mark.interval;
  }

  /** @param {Mark} mark @param {number} time */
  place(mark, time) {
    const row = this.row(mark, time), { rows, width, times } = mark;
    if (row < 0) return null;
    const now = [rows[row * width], rows[row * width + 1]], gap = times[row + 1] - times[row];
    // A body moves towards its next known position.
    if (!(gap > 0) || gap > 2 * mark.interval) return now;
    const share = (time - times[row]) / gap;
    return [0, 1].map((i) => now[i] + share * (rows[(row + 1) * width + i] - now[i]));
  }

  /** @param {Paper} paper */
  draw(paper) {
    this.look();
    this.grid();
    this.names = [];
    const time = this.state.time / 1e9;
    /** @type {{ [shape: string]: "sight" | "tube" | "ellipse" | "goal" | "body" }} */
    const painters = { line: "sight", tube: "tube", ellipse: "ellipse", goal: "goal", body: "body" };
    for (const mark of this.marks) if (mark.shape === "body") this.trail(mark, time);
    for (const [shape, painter] of Object.entries(painters))
      for (const mark of this.marks) if (mark.shape === shape) this[painter](paper, mark, time);
    if (!this.marks.length) this.text("No figure of this model shows positions in space.", 12, 24, { colour: theme.soft });
  }

  grid() {
    const { camera } = this, half = this.width / 2 / camera.scale, tall = this.height / 2 / camera.scale;
    const across = ticks(camera.x - half, camera.x + half, this.width / 90);
    for (const x of across.at) {
      this.line([this.x(x), 0, this.x(x), this.height], theme.faint, 0.5);
      this.text(numberText(x, across.step), this.x(x) + 3, this.height - 4, { size: 10, colour: theme.soft });
    }
    const up = ticks(camera.y - tall, camera.y + tall, this.height / 90);
    for (const y of up.at) {
      this.line([0, this.y(y), this.width, this.y(y)], theme.faint, 0.5);
      this.text(`${numberText(y, up.step)} m`, 3, this.y(y) < 14 ? this.y(y) + 11 : this.y(y) - 3, { size: 10, colour: theme.soft });
    }
  }

  /** @param {Mark} mark @param {number} time */
  trail(mark, time) {
    const now = this.row(mark, time), { rows, width } = mark, colour = this.colour(mark);
    const points = (/** @type {number} */ from, /** @type {number} */ to) => {
      const found = [], skip = Math.max(1, Math.floor((to - from) / 4000));
      for (let row = from; row < to; row += skip) found.push(this.x(rows[row * width]), this.y(rows[row * width + 1]));
      return found;
    };
    this.line(points(Math.max(0, now), mark.times.length), faded(colour, 0.18), 1.2, [3, 4]);
    const way = points(0, now + 1), end = this.place(mark, time);
    if (end) way.push(this.x(end[0]), this.y(end[1]));
    this.line(way, faded(colour, 0.8), 1.8);
  }

  /** @param {Paper} paper @param {Mark} mark @param {number} time */
  body(paper, mark, time) {
    const place = this.place(mark, time), colour = this.colour(mark);
    if (!place) return;
    const [x, y] = [this.x(place[0]), this.y(place[1])], isChosen = this.isChosen(mark);
    if (mark.radius) {
      this.dot(x, y, mark.radius * this.camera.scale, faded(colour, 0.14), faded(colour, 0.6));
    }
    this.dot(x, y, isChosen ? 8 : 5.5, colour, isChosen ? theme.ink : theme.paper);
    this.name(mark.name.replace(/\.[^.]*$/, ""), x, y - 8, 9, { bold: isChosen, size: 11.5 });
  }

  // A name beside a place: on the right or left, as high as wanted or below that, where no other name is.
  /** @param {string} name @param {number} x @param {number} y @param {number} away @param {TextStyle & { size: number }} style */
  name(name, x, y, away, style) {
    this.write(style.size, style.bold ?? false);
    const width = this.paper.measureText(name).width, most = x + away < this.width ? this.width - width - 3 : Infinity;
    const right = Math.min(x + away, most), left = x - away - width; // not cut off at an edge
    const isFree = (/** @type {Dot} */ [start, base]) =>
      start > 0 && this.names.every(([from, under, long]) => start > from + long || from > start + width || Math.abs(base - under) > 12);
    /** @type {Dot[]} */
    const places = [[right, y], [right, y + 24], [left, y], [left, y + 24]];
    const [start, base] = places.find(isFree) ?? places[0];
    this.names.push([start, base, width]);
    this.text(name, start, base, style);
  }

  /** @param {Paper} paper @param {Mark} mark */
  goal(paper, mark) {
    const [x, y] = [this.x(mark.rows[0]), this.y(mark.rows[1])];
    paper.beginPath();
    for (let i = 0; i < 10; i++) {
      const angle = (i * Math.PI) / 5 - Math.PI / 2, radius = i % 2 ? 4 : 10;
      paper.lineTo(x + radius * Math.cos(angle), y + radius * Math.sin(angle));
    }
    paper.closePath();
    paper.fillStyle = this.colour(mark);
    paper.fill();
    this.name(mark.name, x, y + 4, 12, { colour: theme.soft, size: 11 });
  }

  /** @param {Paper} paper @param {Mark} mark @param {number} time */
  ellipse(paper, mark, time) {
    const row = this.row(mark, time), colour = this.colour(mark);
    if (row < 0) return;
    const [x, y, along, across, angle] = mark.rows.subarray(row * 5, row * 5 + 5), { scale } = this.camera;
    const share = this.isStale(mark, row, time) ? 0.35 : 0.95;
    paper.beginPath();
    paper.ellipse(this.x(x), this.y(y), Math.min(1e5, along * scale), Math.min(1e5, across * scale), -angle, 0, 2 * Math.PI);
    paper.strokeStyle = faded(colour, share);
    paper.fillStyle = faded(colour, 0.06);
    paper.lineWidth = 1.5;
    paper.fill();
    paper.stroke();
    this.cross(this.x(x), this.y(y), 3, faded(colour, share));
  }

  // The circles of a plan as one shape, and the path through their centres.
  /** @param {Paper} paper @param {Mark} mark @param {number} time */
  tube(paper, mark, time) {
    const row = this.row(mark, time), { rows, width } = mark, colour = this.colour(mark), way = [];
    if (row < 0) return;
    const share = this.isStale(mark, row, time) ? 0.35 : 1;
    paper.fillStyle = faded(colour, 0.13 * share);
    paper.beginPath();
    for (let i = row * width; i < (row + 1) * width; i += 3) {
      const [x, y] = [this.x(rows[i]), this.y(rows[i + 1])], radius = rows[i + 2] * this.camera.scale;
      paper.moveTo(x + radius, y);
      paper.arc(x, y, radius, 0, 2 * Math.PI);
      way.push(x, y);
    }
    paper.fill("nonzero");
    this.line(way, faded(colour, 0.75 * share), 1.2, this.isStale(mark, row, time) ? [2, 3] : []);
    for (let i = 0; i < way.length; i += 2) this.dot(way[i], way[i + 1], 1.6, faded(colour, 0.8 * share));
  }

  /** @param {Paper} paper @param {Mark} mark @param {number} time */
  sight(paper, mark, time) {
    const row = this.row(mark, time);
    if (row < 0 || this.isStale(mark, row, time)) return;
    const [ax, ay, bx, by] = mark.rows.subarray(row * 4, row * 4 + 4), colour = this.colour(mark);
    this.line([this.x(ax), this.y(ay), this.x(bx), this.y(by)], faded(colour, 0.45), 1, [1, 3]);
    this.dot(this.x(bx), this.y(by), 2, faded(colour, 0.7));
  }

  /** @param {Mark} mark */
  isChosen(mark) {
    const { selection } = this.state, run = this.state.runs[this.number];
    if (!selection || selection.run !== this.number || !mark.port) return false;
    const port = run.portOf.get(mark.port);
    return port !== undefined && selection.firing >= 0 && run.firing_actor[selection.firing] === run.ports[port].place;
  }

  // A click on a body selects the firing that last gave its position.
  /** @param {number} x @param {number} y */
  pick(x, y) {
    const run = this.state.runs[this.number], time = this.state.time / 1e9;
    let best = null, least = 24;
    for (const mark of this.marks) {
      const place = mark.shape === "body" ? this.place(mark, time) : null;
      const away = place ? Math.hypot(this.x(place[0]) - x, this.y(place[1]) - y) : Infinity;
      if (away < least) [best, least] = [mark, away];
    }
    const port = best && run.portOf.get(best.port);
    if (port === undefined || port === null) return this.state.select(null);
    const rows = run.recordsAt.of(port), tag = run.tagAt(this.state.time);
    const place = search(rows.length, (i) => run.record_tag[rows[i]] > tag) - 1;
    const record = place >= 0 ? rows[place] : NOTHING;
    this.state.select(record < 0 ? null : { run: this.number, firing: run.record_firing[record], record: NOTHING });
  }
}
