// Sequence chart: a lane for each actor, firings as dots, tokens as arrows from sender to receiver.

const ROW = 19, ARROWS = 2500;
const AT_FIRST = 600; // arrows that are in sight when a page opens, at most
const BIN = 4; // px in which firings of an actor are counted where they are dense

class Chart extends Timeline {
  /** @param {State} state */
  constructor(state) {
    super(state, "Sequence chart: who sent what to whom");
    this.canvas.dataset.view = "chart";
    this.isConeOnly = false;
    state.listeners.push(() => this.follow());
    const ends = state.runs.map((run) => run.times[run.firing_tag[run.arrival_firing[AT_FIRST] ?? NOTHING]] ?? state.end);
    state.show(0, Math.min(...ends) || state.end); // if all are at the start, the whole run
  }

  // Scrolls to the selected actor.
  follow() {
    const { selection, run } = this.state;
    if (!selection || !this.height) return;
    const loss = run.losses.find((each) => each.record === selection.record);
    const actor = selection.firing >= 0 ? run.firing_actor[selection.firing] : loss?.actor, row = this.rows().at.get(actor);
    if (row === undefined) return;
    const y = this.y(row);
    if (y < RULER + ROW || y > this.height - ROW) this.scrollBy(y - this.height / 2);
  }

  // Scrolls to the lane of an actor, before the first drawing.
  /** @param {number} actor */
  reveal(actor) {
    this.scroll = Math.max(0, ((this.rows().at.get(actor) ?? 0) - 3) * ROW);
  }

  // The actors with a lane, by its position.
  rows() {
    const { run, cone, selection } = this.state;
    const wanted = this.isConeOnly && cone && selection.run === this.state.active ? cone.actors : null;
    if (this.known?.run !== run || this.known.wanted !== wanted) {
      if (this.known?.run !== run) this.known = { run, actors: [...run.places.keys()].filter((place) => run.firingsOf.of(place).length) };
      const shown = wanted ? this.known.actors.filter((place) => wanted.has(place)) : this.known.actors;
      this.known = { ...this.known, wanted, shown, at: new Map(shown.map((place, row) => [place, row])) };
    }
    return this.known;
  }

  /** @param {number} row */
  y(row) {
    return RULER + ROW / 2 + row * ROW - this.scroll;
  }

  /** @param {Paper} paper */
  draw(paper) {
    const { state } = this, { run } = state, { shown, at } = this.rows();
    this.tall = RULER + ROW * shown.length + 8;
    this.scroll = Math.min(this.scroll, Math.max(0, this.tall - this.height));
    this.ruler();
    paper.save();
    paper.beginPath();
    paper.rect(0, RULER - 3, this.width, this.height);
    paper.clip();
    const first = Math.max(0, Math.floor((this.scroll - RULER) / ROW)), last = Math.min(shown.length, first + Math.ceil(this.height / ROW) + 2);
    for (let row = first; row < last; row++) {
      this.line([this.margin, this.y(row), this.width, this.y(row)], theme.faint, 1);
      this.text(run.places[shown[row]], this.margin - 6, this.y(row) + 4, { size: 11, align: "right", width: this.margin - 10, hasEnd: true });
    }
    paper.beginPath();
    paper.rect(this.margin - 6, RULER - 3, this.width, this.height);
    paper.clip();
    const [from, to] = this.tagsInSight(run);
    const begin = search(run.firing_tag.length, (firing) => run.firing_tag[firing] >= from);
    const end = search(run.firing_tag.length, (firing) => run.firing_tag[firing] > to);
    /** @type {[x: number, y: number, target: { firing: number, record: number }][]} */
    this.hits = [];
    this.arrows(begin, end, at);
    this.dots(from, to, first, last);
    this.losses(from, to, at);
    this.firstChange(at);
    paper.restore();
    this.cursor();
  }

  /** @param {number} begin @param {number} end @param {Map<number, number>} at */
  arrows(begin, end, at) {
    const { run, cone, selection } = this.state, isCone = cone && selection.run === this.state.active;
    const first = search(run.arrival_firing.length, (i) => run.arrival_firing[i] >= begin);
    const last = search(run.arrival_firing.length, (i) => run.arrival_firing[i] >= end);
    const isCrowded = last - first > ARROWS, plain = [];
    /** @param {number} from @param {number} to @param {string} colour @param {number} width @param {number[]} [dash] */
    const arrow = (from, to, colour, width, dash) => {
      const [ax, ay, bx, by] = [...this.spot(from, at), ...this.spot(to, at)];
      if (Number.isNaN(ay + by)) return;
      this.line([ax, ay, bx, by], colour, width, dash);
      if (Math.hypot(bx - ax, by - ay) > 9) this.head(ax, ay, bx, by, colour);
    };
    if (!isCrowded)
      for (let arrival = first; arrival < last; arrival++) {
        const record = run.arrival_record[arrival], from = record < 0 ? NOTHING : run.record_firing[record];
        if (from >= 0) plain.push([from, run.arrival_firing[arrival]]);
      }
    for (const [from, to] of plain) arrow(from, to, faded("#888888", isCone ? 0.25 : 0.6), 1);
    if (isCrowded)
      this.text(`${(last - first).toLocaleString("en")} tokens here: zoom in to see them as arrows`, this.margin + 8, this.height - 8, { colour: theme.soft });
    if (isCone)
      for (const edge of cone.edges) {
        if (edge.from < 0 || (edge.from >= end && edge.to >= end) || (edge.to < begin && edge.from < begin)) continue;
        arrow(edge.from, edge.to, edge.isBack ? theme.back : theme.ahead, 1.8, edge.kind === "token" ? [] : [2, 3]);
      }
  }

  /** @param {number} firing @param {Map<number, number>} at */
  spot(firing, at) {
    const { run } = this.state, row = at.get(run.firing_actor[firing]);
    return [this.x(this.state.place(run, run.firing_tag[firing])), row === undefined ? NaN : this.y(row)];
  }

  /** @param {number} ax @param {number} ay @param {number} bx @param {number} by @param {string} colour */
  head(ax, ay, bx, by, colour) {
    const { paper } = this, angle = Math.atan2(by - ay, bx - ax), [x, y] = [bx - 4 * Math.cos(angle), by - 4 * Math.sin(angle)];
    paper.beginPath();
    paper.moveTo(x, y);
    for (const turn of [-0.45, 0.45]) paper.lineTo(x - 7 * Math.cos(angle + turn), y - 7 * Math.sin(angle + turn));
    paper.fillStyle = colour;
    paper.fill();
  }

  // A firing that stands alone is a dot; where they are dense, bars say how many there are, the darker, the more.
  /** @param {number} from @param {number} to @param {number} first @param {number} last */
  dots(from, to, first, last) {
    const { state } = this, { run, cone, selection, active } = state, isCone = cone && selection.run === active, { shown } = this.rows();
    const bins = [];
    for (let row = first; row < last; row++) {
      const rows = run.firingsOf.of(shown[row]), y = this.y(row), place = (/** @type {number} */ i) => state.place(run, run.firing_tag[rows[i]]);
      let i = search(rows.length, (each) => run.firing_tag[rows[each]] >= from), before = null;
      while (i < rows.length && run.firing_tag[rows[i]] <= to) {
        const x = this.x(place(i)), next = this.at(x + BIN), begin = i;
        i = i + 1 >= rows.length || place(i + 1) >= next ? i + 1 : search(rows.length, (each) => place(each) >= next);
        const bin = { x, y, count: i - begin, isDense: place(i - 1) > place(begin) };
        if (before?.y === y && x - before.x < 6) before.isDense = bin.isDense = true;
        bins.push((before = bin));
        this.hits.push([x, y, { firing: rows[begin], record: NOTHING }]);
      }
    }
    const most = Math.max(1, ...bins.map((bin) => bin.count));
    for (const { x, y, count, isDense } of bins) {
      if (!isDense) this.dot(x, y, 3, isCone ? faded(PALETTE[0], 0.35) : PALETTE[0]);
      else {
        this.paper.fillStyle = faded(PALETTE[0], (isCone ? 0.35 : 1) * (0.2 + 0.7 * Math.sqrt(count / most)));
        this.paper.fillRect(x - BIN / 2, y - 4, BIN, 8);
      }
    }
    const marked = isCone ? [...cone.back.keys(), ...cone.ahead.keys()] : [];
    if (selection?.run === active && selection.firing >= 0) marked.push(selection.firing);
    for (const firing of marked) {
      const row = this.known.at.get(run.firing_actor[firing]), tag = run.firing_tag[firing];
      if (row === undefined || row < first || row >= last || tag < from || tag > to) continue;
      const x = this.x(state.place(run, tag)), isChosen = selection.firing === firing;
      this.dot(x, this.y(row), isChosen ? 6 : 4.5, cone?.ahead.has(firing) && !cone.back.has(firing) ? theme.ahead : theme.back, isChosen ? theme.ink : null);
      this.hits.push([x, this.y(row), { firing, record: NOTHING }]);
    }
  }

  // A ring around the first firing that is not the same in the other run.
  /** @param {Map<number, number>} at */
  firstChange(at) {
    const { run } = this.state;
    if (!(run.firstChange >= 0)) return;
    const [x, y] = this.spot(run.firstChange, at);
    if (Number.isNaN(y)) return;
    this.dot(x, y, 9, "transparent", theme.loss);
    this.text("first change", x + 12, y - 6, { size: 11, colour: theme.loss });
    this.hits.push([x, y, { firing: run.firstChange, record: NOTHING }]);
  }

  /** @param {number} from @param {number} to @param {Map<number, number>} at */
  losses(from, to, at) {
    const { run, selection, active } = this.state, { losses } = run;
    const first = search(losses.length, (i) => run.record_tag[losses[i].record] >= from);
    for (let i = first; i < losses.length && run.record_tag[losses[i].record] <= to; i++) {
      const { record, actor } = losses[i], row = at.get(actor);
      if (row === undefined) continue;
      const x = this.x(this.state.place(run, run.record_tag[record])), y = this.y(row);
      const isChosen = selection?.run === active && selection.record === record, sender = senderOf(run, record);
      if (sender >= 0 && losses.length - first < ARROWS) {
        const [ax, ay] = this.spot(sender, at);
        if (!Number.isNaN(ay)) this.line([ax, ay, x, y], faded(theme.loss, isChosen ? 0.9 : 0.35), isChosen ? 2 : 1, [4, 3]);
      }
      this.cross(x, y, isChosen ? 6 : 4, theme.loss);
      this.hits.push([x, y, { firing: NOTHING, record }]);
    }
  }

  /** @param {number} x @param {number} y */
  pick(x, y) {
    let best = null, least = 14;
    for (const [hx, hy, what] of this.hits ?? []) {
      const away = Math.hypot(hx - x, hy - y) - (what.record >= 0 ? 3 : 0);
      if (away < least) [best, least] = [what, away];
    }
    if (best) this.state.goTo({ run: this.state.active, ...best });
    else super.pick(x);
  }
}
