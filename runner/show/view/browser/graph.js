// Graph: the drawn model, with actors lit when they fire, tokens on their wires, and acts of aspects at their badges.

const LEGIBLE = 5; // px of a letter; below this, composites close and words are left out

class Graph extends View {
  /** @param {State} state @param {number} number */
  constructor(state, number) {
    super(state, "Model graph: actors, wires and aspects");
    this.number = number;
    this.run = state.runs[number];
    this.drawing = this.run.drawing;
    this.note = this.drawing.note;
    this.canvas.dataset.view = "graph";
    this.camera = { scale: 0, x: 0, y: 0 };
    this.shut = new Map(); // composites that were closed (true) or opened (false) by hand
    this.boxes = new Map(this.drawing.boxes.flatMap((box) => [box.path, ...box.members].map((path) => [path, box])));
    /** @type {Map<Path, Placed>} */
    this.ports = new Map();
    for (const box of this.drawing.boxes)
      for (const [path, , side, x, y] of box.ports) this.ports.set(path, { path, side, x, y, box });
    /** @type {Map<Path, Wire[]>} */
    this.wiresFrom = new Map();
    for (const wire of this.drawing.wires) {
      if (!this.wiresFrom.has(wire.source)) this.wiresFrom.set(wire.source, []);
      this.wiresFrom.get(wire.source).push(wire);
    }
    /** @type {Map<number, Route | null>} */
    this.routes = new Map();
    const aspects = [...new Set(this.drawing.badges.map((badge) => badge[1]).filter(Boolean))];
    this.colours = new Map(aspects.map((name, i) => [name, PALETTE[(i + 1) % PALETTE.length]]));
    gestures(this.canvas, {
      move: (dx, dy) => {
        this.camera.x -= dx / this.camera.scale;
        this.camera.y -= dy / this.camera.scale;
        state.changed();
      },
      zoom: (factor, x, y) => this.zoom(factor, x, y),
      click: (x, y) => this.pick(x, y),
      grab: (x, y) => this.grab?.(x, y),
      drop: (x, y) => this.drop?.(x, y),
      hover: (x, y) => this.hover?.(x, y),
    });
    this.canvas.addEventListener("dblclick", () => {
      this.camera.scale = 0;
      state.changed();
    });
  }

  /** @param {number} factor @param {number} x @param {number} y */
  zoom(factor, x, y) {
    const { camera } = this;
    camera.x += (x / camera.scale) * (1 - factor);
    camera.y += (y / camera.scale) * (1 - factor);
    camera.scale = Math.min(20, camera.scale / factor);
    this.state.changed();
  }

  look() {
    const { camera, drawing } = this;
    if (camera.scale) return;
    camera.scale = Math.min(2, (this.width - 8) / drawing.width, (this.height - 8) / drawing.height);
    if (camera.scale * drawing.height < this.height / 3 || camera.scale * drawing.width < this.width / 5)
      camera.scale = Math.min(2, Math.max(camera.scale, 0.25, Math.min(this.width / drawing.width, 0.5)));
    camera.x = Math.min(0, (drawing.width - this.width / camera.scale) / 2);
    camera.y = Math.min(0, (drawing.height - this.height / camera.scale) / 2);
  }

  /** @param {Box} box */
  isShut(box) {
    if (!box.composite) return false;
    return this.shut.get(box.path) ?? this.camera.scale * 9 < LEGIBLE * 0.62;
  }

  // The outermost closed composite around something, if there is one; its content is not visible.
  /** @param {Path} path */
  cover(path) {
    for (let at = path.indexOf("."); at >= 0; at = path.indexOf(".", at + 1)) {
      const box = this.boxes.get(path.slice(0, at));
      if (box && this.isShut(box)) return box;
    }
    return null;
  }

  // The visible box for a path; arrays that are one box use that of their first instance, what is not drawn that around it.
  /** @param {Path} path */
  boxOf(path) {
    for (let at = path; at; at = at.slice(0, Math.max(at.lastIndexOf("."), 0))) {
      const box = this.boxes.get(at) ?? this.boxes.get(at.replace(/\[\d+\]/g, "[0]"));
      if (box) return this.cover(box.path) ?? box;
    }
    return null;
  }

  /** @param {Paper} paper */
  draw(paper) {
    this.look();
    const { camera } = this;
    paper.save();
    paper.scale(camera.scale, camera.scale);
    paper.translate(-camera.x, -camera.y);
    this.sight = [camera.x, camera.y, camera.x + this.width / camera.scale, camera.y + this.height / camera.scale];
    this.lit = this.firing();
    const seen = this.drawing.boxes.filter((box) => this.isSeen(box.at) && !this.cover(box.path));
    for (const box of seen) this.box(paper, box);
    this.wires(paper);
    for (const box of seen) this.labels(box);
    this.tokens();
    this.badges(paper); // over wires that are lit, so that names can be read
    paper.restore();
  }

  /** @param {Rect | [number, number, number, number]} parts */
  isSeen([x, y, width, height]) {
    const [left, top, right, bottom] = this.sight;
    return x < right && y < bottom && x + width > left && y + height > top;
  }

  // How strongly each actor is lit, by the path of its visible box.
  firing() {
    const { run, state } = this, lit = new Map(), last = state.tags[this.number];
    const end = search(run.firing_tag.length, (firing) => run.firing_tag[firing] > last);
    for (let firing = end - 1; firing >= 0 && firing > end - 3000; firing--) {
      const glow = state.glow(run, run.firing_tag[firing]);
      if (!glow) break;
      const box = this.boxOf(run.actorName(firing));
      if (box) lit.set(box.path, Math.max(glow, lit.get(box.path) ?? 0));
    }
    return lit;
  }

  /** @param {Paper} paper @param {Box} box */
  box(paper, box) {
    const [x, y, width, height] = box.at, isShut = this.isShut(box), lit = this.lit.get(box.path) ?? 0;
    const { selection } = this.state;
    const isOpen = box.composite && !isShut;
    for (const inset of box.count > 1 ? [6, 3] : []) this.frame(paper, x + inset, y + inset, width - inset, height, theme.panel);
    this.frame(paper, x, y, width, height, isOpen ? theme.frame : theme.panel, box.director ? 2.2 : 1);
    if (lit && !isOpen) {
      paper.globalAlpha = (isShut ? 0.3 : 0.6) * lit;
      this.frame(paper, x, y, width, height, theme.now);
      paper.globalAlpha = 1;
    }
    if (isOpen) return;
    const isOf = (/** @type {number} */ firing) => this.boxOf(this.run.actorName(firing)) === box;
    const isOwn = selection && selection.run === this.number;
    const colour = isOwn && selection.firing >= 0 && isOf(selection.firing) ? theme.ink : this.coneColour(box);
    if (colour) {
      paper.strokeStyle = colour;
      paper.lineWidth = 3;
      paper.strokeRect(x - 2, y - 2, width + 4, height + 4);
    }
  }

  // The colour of the cone that a box belongs to.
  /** @param {Box} box */
  coneColour(box) {
    const { cone, selection } = this.state;
    if (!cone || selection.run !== this.number) return null;
    if (this.coned?.cone !== cone || this.coned.scale !== this.camera.scale) {
      const paths = (/** @type {Map<number, boolean>} */ firings) => new Set([...firings.keys()].map((firing) => this.boxOf(this.run.actorName(firing))));
      this.coned = { cone, scale: this.camera.scale, back: paths(cone.back), ahead: paths(cone.ahead) };
    }
    return this.coned.back.has(box) ? theme.back : this.coned.ahead.has(box) ? theme.ahead : null;
  }

  /** @param {Paper} paper @param {number} x @param {number} y @param {number} width @param {number} height @param {string} fill */
  frame(paper, x, y, width, height, fill, rim = 1) {
    paper.fillStyle = fill;
    paper.strokeStyle = theme.soft;
    paper.lineWidth = rim;
    paper.beginPath();
    paper.roundRect(x, y, width, height, 3);
    paper.fill();
    paper.stroke();
  }

  /** @param {Box} box */
  labels(box) {
    const [x, y, width, height] = box.at, isShut = this.isShut(box), { scale } = this.camera;
    const isOpen = box.composite && !isShut;
    if (box.composite) this.sign(x + width - 11, y + 4, isShut);
    if (scale * 9 < LEGIBLE) {
      if (!isOpen && scale * width > 24) {
        const size = Math.min(12 / scale, height / 2, (1.5 * width) / box.name.length);
        if (size * scale >= LEGIBLE) this.text(box.name, x + width / 2, y + height / 2 + size / 3, { align: "center", bold: true, size, width: width - 2 });
      }
      return;
    }
    if (isOpen) this.text(`${box.name}: ${box.kind}`, x + 12, y + 14, { size: 9, bold: true, width: width - 30 });
    else {
      const middle = isShut ? y + height / 2 - 4 : y + 12;
      this.text(box.name, x + width / 2, middle, { size: 9, bold: true, align: "center" });
      this.text(box.kind, x + width / 2, middle + 10.5, { size: 7.5, align: "center", colour: theme.soft });
    }
    for (const [, name, side, px, py, isMulti] of box.ports) {
      this.paper.fillStyle = isMulti ? theme.panel : theme.ink;
      this.paper.strokeStyle = theme.ink;
      this.paper.lineWidth = 0.8;
      this.paper.fillRect(px - 2.2, py - 2.2, 4.4, 4.4);
      this.paper.strokeRect(px - 2.2, py - 2.2, 4.4, 4.4);
      const isLeft = side === "left", up = isOpen ? -3 : 2.5;
      this.text(name, px + (isLeft ? 6 : -6), py + up, { size: 7, align: isLeft ? "left" : "right", colour: theme.soft });
    }
  }

  /** @param {number} x @param {number} y @param {boolean} isShut */
  sign(x, y, isShut) {
    const { paper } = this;
    paper.strokeStyle = theme.soft;
    paper.lineWidth = 0.8;
    paper.strokeRect(x, y, 7, 7);
    this.line([x + 1.5, y + 3.5, x + 5.5, y + 3.5], theme.soft, 0.8);
    if (isShut) this.line([x + 3.5, y + 1.5, x + 3.5, y + 5.5], theme.soft, 0.8);
  }

  /** @param {Paper} paper */
  wires(paper) {
    paper.strokeStyle = theme.soft;
    paper.lineWidth = 1;
    paper.beginPath();
    const heads = [];
    for (const wire of this.drawing.wires) {
      if (this.isHidden(wire)) continue;
      for (const line of wire.lines) {
        paper.moveTo(line[0], line[1]);
        for (let i = 2; i < line.length; i += 2) paper.lineTo(line[i], line[i + 1]);
      }
      heads.push(...wire.heads);
    }
    paper.stroke();
    paper.fillStyle = theme.soft;
    if (this.camera.scale * 9 >= LEGIBLE * 0.7)
      for (const [x, y] of heads) {
        paper.beginPath();
        paper.moveTo(x - 2.4, y);
        paper.lineTo(x - 8.4, y - 2.6);
        paper.lineTo(x - 8.4, y + 2.6);
        paper.fill();
      }
  }

  // A wire belongs to the composite that contains its ends, or whose ports they are.
  /** @param {Wire} wire */
  isHidden(wire) {
    if (wire.scope === undefined) {
      const owners = [wire.source, ...wire.targets].map((path) => path.replace(/\.[^.]*$/, ""));
      const inner = owners.find((path) => this.boxes.get(path)?.level === wire.level);
      wire.scope = inner === undefined ? owners[0] : inner.replace(/(^|\.)[^.]*$/, "");
    }
    if (!wire.scope) return false;
    const box = this.boxes.get(wire.scope);
    return (box && this.isShut(box)) || this.cover(wire.scope) !== null;
  }

  /** @param {Paper} paper */
  badges(paper) {
    const { run, state } = this, last = state.tags[this.number], acts = new Map();
    const end = search(run.acts.length, (i) => run.record_tag[run.acts[i]] > last);
    for (let i = end - 1; i >= 0 && i > end - 500; i--) {
      const record = run.acts[i], glow = state.glow(run, run.record_tag[record]);
      if (!glow) break;
      const key = `${shortName(run.aspects[run.record_aspect[record]])} ${run.portPath(run.record_port[record])}`;
      const before = acts.get(key);
      acts.set(key, { glow: Math.max(glow, before?.glow ?? 0), isLoss: run.isLoss.has(record) || before?.isLoss });
    }
    for (const [words, aspect, x, y, width, place] of this.drawing.badges) {
      const owner = place.replace(/\.[^.]*$/, "");
      if (!this.isSeen([x, y - 6, width, 12]) || (aspect ? this.cover(place) !== null : this.isBadgeHidden(x, y))) continue;
      const act = aspect ? acts.get(`${aspect} ${place}`) : null, colour = this.colours.get(aspect);
      paper.beginPath();
      paper.roundRect(x, y - 6, width, 12, 6);
      paper.fillStyle = theme.panel; // so that no wire is seen through it
      paper.fill();
      if (aspect) {
        paper.fillStyle = act ? colour : faded(colour, 0.35);
        paper.fill();
      }
      paper.strokeStyle = act?.isLoss ? theme.loss : theme.soft;
      paper.lineWidth = act ? 0.8 + 2.2 * act.glow : 0.6;
      paper.stroke();
      if (this.camera.scale * 6.5 >= LEGIBLE * 0.7)
        this.text(words, x + width / 2, y + 2.3, { size: 6.5, align: "center", colour: act ? "#fff" : theme.ink });
      if (act?.isLoss) this.cross(x + width / 2, y, 7, theme.loss);
    }
  }

  /** @param {number} x @param {number} y */
  isBadgeHidden(x, y) {
    for (const box of this.drawing.boxes) {
      const [left, top, width, height] = box.at;
      if (this.isShut(box) && x > left && x < left + width && y > top && y < top + height) return true;
    }
    return false;
  }

  // -- travelling tokens --

  tokens() {
    const { run, state } = this, { time, afterglow } = state, last = state.tags[this.number];
    if (last < 0) return;
    let drawn = 0;
    const end = search(run.firing_tag.length, (firing) => run.firing_tag[firing] > last);
    for (let firing = end - 1; firing >= 0 && drawn < 600; firing--) {
      const glow = state.glow(run, run.firing_tag[firing]);
      if (!glow) break;
      for (const arrival of run.arrivalsOf.of(firing)) {
        const record = run.arrival_record[arrival];
        if (record < 0 || this.isFlight(record, firing)) continue;
        this.token(record, arrival, state.isPlaying ? 1 - glow : 1, state.isPlaying ? 1 : 0.9);
        drawn++;
      }
    }
    const flights = run.flights, until = search(flights.length, (i) => flights[i].sent > time);
    for (let i = until - 1; i >= 0 && i > until - 2000 && drawn < 900; i--) {
      const { arrival, record, sent, arrived } = flights[i], landing = Math.max(arrived, sent + (state.isPlaying ? afterglow : 0));
      if (time > landing || run.record_tag[record] > last) continue;
      this.token(record, arrival, Math.min(1, (time - sent) / (landing - sent)), 1);
      drawn++;
    }
  }

  /** @param {number} record @param {number} firing */
  isFlight(record, firing) {
    const { run } = this;
    return run.times[run.record_tag[record]] < run.times[run.firing_tag[firing]];
  }

  /** @param {number} record @param {number} arrival @param {number} share @param {number} alpha */
  token(record, arrival, share, alpha) {
    const { run } = this, route = this.route(run.record_port[record], run.arrival_port[arrival]);
    if (!route) return;
    const { cone, selection } = this.state, isNow = !this.state.isPlaying && share === 1;
    let colour = theme.now;
    if (cone && selection.run === this.number) colour = cone.has(run.arrival_firing[arrival]) ? theme.back : faded(theme.now, 0.3);
    if (isNow) this.outsideOfShut(() => this.line(route.points, colour, 2));
    const at = along(route, share);
    if (this.covers(...at)) return;
    this.paper.globalAlpha = alpha;
    this.dot(...at, 3.2, colour, theme.panel);
    this.paper.globalAlpha = 1;
  }

  // The places of the composites that appear closed.
  get shutBoxes() {
    const { camera: { scale }, drawing } = this;
    if (this.shutNow?.scale !== scale) {
      const boxes = drawing.boxes.filter((box) => this.isShut(box) && !this.cover(box.path));
      this.shutNow = { scale, boxes: boxes.map((box) => box.at) };
    }
    return this.shutNow.boxes;
  }

  /** @param {number} x @param {number} y */
  covers(x, y) {
    return this.shutBoxes.some(([left, top, width, height]) =>
      x > left + 1 && x < left + width - 1 && y > top + 1 && y < top + height - 1);
  }

  /** @param {() => void} draw */
  outsideOfShut(draw) {
    const { paper } = this, [left, top, right, bottom] = this.sight;
    paper.save();
    paper.beginPath();
    paper.rect(left, top, right - left, bottom - top);
    for (const box of this.shutBoxes) paper.rect(...box);
    paper.clip("evenodd");
    draw();
    paper.restore();
  }

  // The route along wires from an output port to an input port, through ports of composites.
  /** @param {number} from @param {number} to */
  route(from, to) {
    const key = from * 65536 + to;
    if (!this.routes.has(key)) this.routes.set(key, this.findRoute(this.portOf(from), this.portOf(to)));
    return this.routes.get(key);
  }

  /** @param {number} number */
  portOf(number) {
    const path = this.run.portPath(number);
    return this.ports.get(path) ?? this.ports.get(path.replace(/\[\d+\]/g, "[0]"));
  }

  /** @param {Placed | undefined} source @param {Placed | undefined} target */
  findRoute(source, target) {
    if (!source || !target) return null;
    /** @type {Map<Path, { path: Path, wire: Wire, place: number } | null>} */
    const came = new Map([[source.path, null]]), waiting = [source.path];
    while (waiting.length) {
      const path = waiting.shift();
      if (path === target.path) break;
      for (const wire of this.wiresFrom.get(path) ?? [])
        wire.targets.forEach((next, place) => {
          if (came.has(next)) return;
          came.set(next, { path, wire, place });
          waiting.push(next);
        });
    }
    if (!came.has(target.path)) return null;
    const pieces = [];
    for (let step = came.get(target.path); step; step = came.get(step.path)) pieces.unshift(step);
    const points = pieces.flatMap(({ path, wire, place }) => branch(wire, this.ports.get(path), wire.heads[place]));
    const lengths = [0];
    for (let i = 2; i < points.length; i += 2)
      lengths.push(lengths.at(-1) + Math.hypot(points[i] - points[i - 2], points[i + 1] - points[i - 1]));
    return { points, lengths };
  }

  // -- clicks --

  /** @param {number} px @param {number} py */
  pick(px, py) {
    const { camera, run, state } = this, x = px / camera.scale + camera.x, y = py / camera.scale + camera.y;
    const badge = this.drawing.badges.find(([, aspect, left, middle, width, place]) =>
      aspect && x >= left && x <= left + width && Math.abs(y - middle) < 7 && !this.cover(place));
    if (badge) return this.pickAct(badge[1], badge[5]);
    const boxes = this.drawing.boxes.filter(({ at: [left, top, width, height], path }) =>
      x >= left && y >= top && x <= left + width && y <= top + height && !this.cover(path));
    const box = boxes.at(-1); // the innermost
    if (!box) return state.select(null);
    const [left, top, width] = box.at, isSign = x > left + width - 18 && y < top + 16;
    if (box.composite && (isSign || this.isShut(box))) {
      this.shut.set(box.path, !this.isShut(box));
      this.coned = this.shutNow = null;
      return state.changed();
    }
    const place = run.placeOf.get(box.path);
    if (place === undefined) return state.select(null);
    const tag = state.tags[this.number], firing = Math.max(run.lastFiring(place, tag), NOTHING);
    const found = firing >= 0 ? firing : run.nextFiring(place, tag);
    return state.select(found < 0 ? null : { run: this.number, firing: found, record: NOTHING });
  }

  // The last act of an aspect at a place until now, otherwise its first.
  /** @param {string} aspect @param {Path} place */
  pickAct(aspect, place) {
    const { run, state } = this, last = state.tags[this.number];
    const acts = run.acts.filter((record) =>
      shortName(run.aspects[run.record_aspect[record]]) === aspect && run.portPath(run.record_port[record]) === place);
    const record = acts[Math.max(0, search(acts.length, (i) => run.record_tag[acts[i]] > last) - 1)];
    return record === undefined ? state.select(null) : state.goTo({ run: this.number, firing: NOTHING, record });
  }
}

/** @param {string} aspect */
function shortName(aspect) {
  return aspect.replace(/^.*\./, "");
}

// The part of a wire's tree from its source to one of its ends.
/** @param {Wire} wire @param {Placed} source @param {Dot} head */
function branch(wire, source, head) {
  const key = (/** @type {number[]} */ ...point) => point.join();
  if (!wire.tree) {
    wire.tree = new Map();
    const link = (/** @type {string} */ from, /** @type {number[]} */ line) => {
      if (!wire.tree.has(from)) wire.tree.set(from, []);
      wire.tree.get(from).push(line);
    };
    for (const line of wire.lines) {
      const back = [];
      for (let i = line.length - 2; i >= 0; i -= 2) back.push(line[i], line[i + 1]);
      link(key(line[0], line[1]), line);
      link(key(...line.slice(-2)), back);
    }
  }
  const start = key(source.x, source.y), goal = key(...head), came = new Map([[start, null]]), waiting = [start];
  while (waiting.length && !came.has(goal)) {
    const here = waiting.shift();
    for (const line of wire.tree.get(here) ?? []) {
      const next = key(...line.slice(-2));
      if (came.has(next)) continue;
      came.set(next, { here, line });
      waiting.push(next);
    }
  }
  if (!came.has(goal)) return [source.x, source.y, ...head];
  const lines = [];
  for (let step = came.get(goal); step; step = came.get(step.here)) lines.unshift(step.line);
  return lines.flat();
}

// The point of a route at a fraction of its length.
/** @param {Route} route @param {number} share @returns {Dot} */
function along({ points, lengths }, share) {
  const wanted = share * lengths.at(-1), i = Math.max(1, search(lengths.length, (at) => lengths[at] >= wanted));
  if (i >= lengths.length) return [points.at(-2), points.at(-1)];
  const part = (wanted - lengths[i - 1]) / (lengths[i] - lengths[i - 1] || 1);
  const at = (/** @type {number} */ axis) => points[2 * i - 2 + axis] + part * (points[2 * i + axis] - points[2 * i - 2 + axis]);
  return [at(0), at(1)];
}
