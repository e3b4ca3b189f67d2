// The graph as one can edit it: a line from port to port is a connection, a click chooses a part or a wire.

const NEAR = 7; // px around a port

class Diagram extends Graph {
  /**
   * @param {State} state @param {{ connect: (source: Path, target: Path) => void, choose: (chosen: Selected | null) => void }} acts
   * @param {Diagram} [before] what was shown before
   */
  constructor(state, { connect, choose }, before) {
    super(state, 0);
    this.connect = connect;
    this.choose = choose;
    /** @type {{ port: Placed, x: number, y: number } | null} a line that is being drawn */
    this.draft = null;
    /** @type {Placed | null} a port below the pointer */
    this.near = null;
    /** @type {Selected | null} */
    this.chosen = before?.chosen ?? null;
    this.isMoved = false;
    if (before) {
      this.shut = before.shut;
      if (before.isMoved) Object.assign(this, { camera: before.camera, isMoved: true });
    }
    this.canvas.addEventListener("wheel", () => { this.isMoved = true; });
    this.canvas.addEventListener("pointermove", (event) => { if (event.buttons) this.isMoved = true; });
    this.canvas.addEventListener("dblclick", () => { this.isMoved = false; });
    this.canvas.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.draft = null;
      state.changed();
    });
  }

  resized() {
    if (!this.isMoved) this.camera.scale = 0; // fit it again
  }

  /** @param {number} x @param {number} y */
  at(x, y) {
    return [x / this.camera.scale + this.camera.x, y / this.camera.scale + this.camera.y];
  }

  /** @param {number} px @param {number} py */
  portAt(px, py) {
    const [x, y] = this.at(px, py), reach = NEAR / this.camera.scale;
    let best = null, least = reach;
    if (this.camera.scale * 9 < LEGIBLE) return null;
    for (const port of this.ports.values()) {
      const away = Math.hypot(port.x - x, port.y - y);
      if (away < least && !this.cover(port.box.path)) [best, least] = [port, away];
    }
    return best;
  }

  // The path of a port, or of those of all instances that its box stands for.
  /** @param {Placed} port */
  pathOf({ path, box }) {
    const name = path.slice(box.path.length);
    return (box.count > 1 ? box.path.replace(/\[0\]$/, "[*]") : box.path) + name;
  }

  // Whether tokens between two ports come from the first: inside of a composite, its inputs send.
  /** @param {Placed} one @param {Placed} other */
  isSource(one, other) {
    return other.box.path.startsWith(`${one.box.path}.`) ? one.side === "left" : one.side === "right";
  }

  /** @param {number} x @param {number} y */
  grab(x, y) {
    const port = this.portAt(x, y);
    if (!port) return null;
    this.draft = { port, x, y };
    return (/** @type {number} */ to, /** @type {number} */ down) => {
      this.draft = { port, x: to, y: down };
      this.state.changed();
    };
  }

  /** @param {number} x @param {number} y */
  drop(x, y) {
    const from = this.draft?.port, to = this.portAt(x, y);
    this.draft = null;
    this.state.changed();
    if (!from || !to || from === to) return;
    const [source, target] = this.isSource(from, to) ? [from, to] : [to, from];
    this.connect(this.pathOf(source), this.pathOf(target));
  }

  /** @param {number} x @param {number} y */
  hover(x, y) {
    const port = Number.isNaN(x) ? null : this.portAt(x, y);
    this.canvas.style.cursor = port ? "crosshair" : "";
    this.canvas.title = port ? `${this.pathOf(port)}: draw a line to another port to connect them` : "";
    if (port !== this.near) {
      this.near = port;
      this.state.changed();
    }
  }

  /** @param {number} px @param {number} py */
  wireAt(px, py) {
    const [x, y] = this.at(px, py), reach = 5 / this.camera.scale;
    for (const wire of this.drawing.wires)
      for (const line of this.isHidden(wire) ? [] : wire.lines)
        for (let i = 2; i < line.length; i += 2)
          if (distance(x, y, line[i - 2], line[i - 1], line[i], line[i + 1]) < reach) return wire;
    return null;
  }

  /** @param {number} px @param {number} py */
  pick(px, py) {
    const [x, y] = this.at(px, py);
    const badge = this.drawing.badges.find(([, aspect, left, middle, width, place]) =>
      aspect && x >= left && x <= left + width && Math.abs(y - middle) < 7 && !this.cover(place));
    const boxes = this.drawing.boxes.filter(({ at: [left, top, width, height], path }) =>
      x >= left && y >= top && x <= left + width && y <= top + height && !this.cover(path));
    const box = boxes.at(-1), wire = !badge && (!box || (box.composite && !this.isShut(box))) ? this.wireAt(px, py) : null;
    super.pick(px, py);
    if (badge) this.chosen = { aspect: badge[1] };
    else if (wire) {
      const source = this.ports.get(wire.source), targets = wire.targets.map((path) => this.ports.get(path)).filter(Boolean);
      this.chosen = { wire, ends: source ? targets.map((target) => [this.pathOf(source), this.pathOf(target)]) : [] };
    } else this.chosen = box ? { path: box.path, kind: box.kind, doc: box.doc, composite: box.composite } : null;
    this.choose(this.chosen);
    this.state.changed();
  }

  /** @param {Paper} paper */
  draw(paper) {
    super.draw(paper);
    const { camera, chosen, draft, near } = this, to = (/** @type {number} */ x, /** @type {number} */ y) => /** @type {Dot} */ ([(x - camera.x) * camera.scale, (y - camera.y) * camera.scale]);
    const box = chosen?.path && !this.cover(chosen.path) ? this.boxes.get(chosen.path) : null;
    if (box) {
      const [x, y, width, height] = box.at;
      paper.strokeStyle = theme.back;
      paper.lineWidth = 2;
      paper.strokeRect(...to(x - 2, y - 2), (width + 4) * camera.scale, (height + 4) * camera.scale);
    }
    if (chosen?.wire && this.drawing.wires.includes(chosen.wire))
      for (const line of chosen.wire.lines) {
        const points = [];
        for (let i = 0; i < line.length; i += 2) points.push(...to(line[i], line[i + 1]));
        this.line(points, theme.back, 2.5);
      }
    for (const port of new Set([near, draft?.port])) if (port) this.dot(...to(port.x, port.y), 5, theme.back, theme.panel);
    if (draft) this.line([...to(draft.port.x, draft.port.y), draft.x, draft.y], theme.back, 2, [5, 3]);
  }
}

// How far a point is from a stretch of a line.
/** @param {number} x @param {number} y @param {number} ax @param {number} ay @param {number} bx @param {number} by */
function distance(x, y, ax, ay, bx, by) {
  const long = (bx - ax) ** 2 + (by - ay) ** 2;
  const share = long ? Math.min(1, Math.max(0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / long)) : 0;
  return Math.hypot(x - ax - share * (bx - ax), y - ay - share * (by - ay));
}

// The data of a run that has not been made, so that a graph can be drawn.
/** @param {ModelDrawing} drawing */
function emptyRun(drawing) {
  /** @type {any} */
  const columns = {};
  for (const [kind, names] of Object.entries({
    firing: ["tag", "actor", "outside"], record: ["tag", "firing", "port", "channel", "event", "aspect", "text", "about"],
    arrival: ["firing", "port", "channel", "record"], wake: ["firing", "tag"],
  })) for (const name of names) columns[`${kind}_${name}`] = [];
  /** @type {any} */
  const head = { columns, drawing, tags: [[], []], texts: [[], []], lanes: [], marks: [], places: [], ports: [], events: [],
    aspects: [], gaps: [], monitors: [], metrics: [], settings: [], name: "", model: "", end: 1, digest: "" };
  return new Run(head, (/** @type {any} */ column) => Int32Array.from(column));
}
