// The state of the page: time, selection and axis; views redraw when it changes.

const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1e3, 2e3, 5e3, 1e4, 1e5, 1e6];
const GLOW = 0.35; // s of real time for which a firing is visible

class State {
  /** @param {Page} data */
  constructor(data) {
    this.runs = data.runs;
    this.data = data;
    this.active = 0;
    this.end = Math.max(1, ...data.runs.map((run) => run.end)); // ns
    this.time = 0; // ns
    this.tags = data.runs.map(() => NOTHING); // the last completed tag of each run
    this.isPlaying = false;
    this.speed = speedFor(this.end / 1e9);
    this.axis = { byTag: false, low: 0, high: this.end };
    this.selection = null; // {run, firing, record}
    this.cone = null;
    this.directions = { back: true, ahead: true };
    this.isDirty = true;
    /** @type {(() => void)[]} */
    this.listeners = [];
    this.setTime(0);
  }

  get run() {
    return this.runs[this.active];
  }

  get tag() {
    return this.tags[this.active];
  }

  get nowText() {
    return this.isPlaying || this.tag < 0 ? secondsText(Math.round(this.time / 1e3) * 1e3) : this.run.tagText(this.tag);
  }

  changed() {
    this.isDirty = true;
  }

  /** @param {number} time */
  setTime(time) {
    this.time = Math.min(this.end, Math.max(0, time));
    this.tags = this.runs.map((run) => run.tagAt(this.time));
    this.changed();
  }

  // Moves to one tag of the active run; later microsteps of its time may still follow.
  /** @param {number} tag */
  setTag(tag) {
    const run = this.run;
    if (!run.times.length) return;
    const wanted = Math.min(run.times.length - 1, Math.max(0, tag));
    this.setTime(run.times[wanted]);
    this.tags[this.active] = wanted;
    this.keepInSight();
  }

  /** @param {number} count */
  step(count) {
    this.isPlaying = false;
    this.setTag(this.tag + count);
  }

  /** @param {boolean} isPlaying */
  play(isPlaying) {
    if (isPlaying && this.time >= this.end) this.setTime(0);
    this.isPlaying = isPlaying;
    this.changed();
  }

  /** @param {number} seconds */
  advance(seconds) {
    if (!this.isPlaying) return;
    this.setTime(this.time + seconds * this.speed * 1e9);
    this.keepInSight();
    if (this.time >= this.end) this.isPlaying = false;
  }

  // How strongly to show what happened at a tag of a run: 1 now, fading afterwards, 0 before.
  /** @param {Run} run @param {number} tag */
  glow(run, tag) {
    const now = this.tags[this.runs.indexOf(run)];
    if (tag > now) return 0;
    if (tag === now) return 1;
    if (!this.isPlaying) return 0;
    return Math.max(0, 1 - (this.time - run.times[tag]) / this.afterglow);
  }

  get afterglow() {
    return GLOW * this.speed * 1e9; // ns
  }

  // -- the time axis: seconds, or one step for each tag --

  /** @param {Run} run @param {number} tag */
  place(run, tag) {
    return this.axis.byTag ? tag : run.times[tag];
  }

  get cursor() {
    if (!this.axis.byTag) return this.time;
    const { run, tag } = this;
    if (tag < 0) return -0.5;
    const gap = (run.times[tag + 1] ?? this.end) - run.times[tag];
    return tag + (gap > 0 ? Math.min(0.999, (this.time - run.times[tag]) / gap) : 0);
  }

  /** @type {[low: number, high: number]} */
  get extent() {
    return this.axis.byTag ? [-0.5, Math.max(1, this.run.times.length) - 0.5] : [0, this.end];
  }

  /** @param {number} place */
  setCursor(place) {
    if (this.axis.byTag) this.setTag(Math.round(place));
    else this.setTime(place);
  }

  /** @param {boolean} byTag */
  setByTag(byTag) {
    if (this.axis.byTag === byTag) return;
    const { run } = this, toTag = (/** @type {number} */ time) => search(run.times.length, (tag) => run.times[tag] >= time);
    const { low, high } = this.axis;
    this.axis.byTag = byTag;
    if (byTag) this.show(toTag(low) - 0.5, Math.max(toTag(low) + 4, toTag(high)) - 0.5);
    else this.show(run.times[Math.max(0, Math.ceil(low))] ?? 0, run.times[Math.floor(high)] ?? this.end);
  }

  /** @param {number} low @param {number} high */
  show(low, high) {
    const [first, last] = this.extent, least = this.axis.byTag ? 4 : Math.min(100, last - first);
    let size = Math.min(last - first, Math.max(least, high - low));
    let start = Math.min(last - size, Math.max(first, (low + high - size) / 2));
    Object.assign(this.axis, { low: start, high: start + size });
    this.changed();
  }

  /** @param {number} factor @param {number} place */
  zoom(factor, place) {
    const { low, high } = this.axis;
    this.show(place - (place - low) * factor, place + (high - place) * factor);
  }

  keepInSight() {
    const { low, high } = this.axis, place = this.cursor;
    if (place < low || place > high) this.show(place - (high - low) * 0.1, place + (high - low) * 0.9);
  }

  // -- the selection --

  /** @param {Chosen} selection */
  select(selection) {
    this.selection = selection;
    if (selection && selection.run !== this.active) this.activate(selection.run);
    this.findCone();
    for (const listener of this.listeners) listener();
  }

  // Selects the first firing of this tag, or the one after that which is selected.
  selectNext() {
    const { run, tag, selection } = this, first = search(run.firing_tag.length, (firing) => run.firing_tag[firing] >= tag);
    const next = selection && selection.firing >= first ? selection.firing + 1 : first;
    const firing = run.firing_tag[next] === tag ? next : first;
    if (run.firing_tag[firing] === tag) this.select({ run: this.active, firing, record: NOTHING });
  }

  /** @param {Chosen} selection */
  goTo(selection) {
    this.isPlaying = false;
    this.select(selection);
    const { run } = this;
    this.setTag(selection.firing >= 0 ? run.firing_tag[selection.firing] : run.record_tag[selection.record]);
  }

  /** @param {number} number */
  activate(number) {
    const { byTag } = this.axis;
    if (byTag) this.setByTag(false);
    this.active = number;
    if (byTag) this.setByTag(true);
    if (this.selection && this.selection.run !== number) this.select(null);
    this.changed();
    for (const listener of this.listeners) listener();
  }

  findCone() {
    const { selection, directions } = this;
    const isWanted = selection && (directions.back || directions.ahead);
    this.cone = isWanted ? new Cone(this.runs[selection.run], selection, directions) : null;
    this.changed();
  }
}

// A speed at which a run takes about twenty seconds.
/** @param {number} seconds */
function speedFor(seconds) {
  return SPEEDS.find((speed) => seconds / speed <= 30) ?? SPEEDS.at(-1);
}
