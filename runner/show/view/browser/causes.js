// The causes and effects of an event.
//
// A firing is caused by the tokens that it takes, by the firing that requested its wake-up, by the previous one if
// SimPy resumed its process, and, if it sends something, by the tokens that its actor has taken without sending since
// it last sent.  An act that lost a token causes the next firing of the actor that did not get it.  Wake-ups are
// followed one step only, because a clock would lead back to its start.

const NEAREST = 300; // firings of a cone, nearest in time first

// Each as {firing, kind, record}: the send of its token, or the act that lost it, if there is one.
/** @param {Run} run @param {number} firing @returns {Cause[]} */
function causesOf(run, firing) {
  /** @type {Cause[]} */
  const found = [];
  const actor = run.firing_actor[firing];
  for (const arrival of run.arrivalsOf.of(firing)) {
    const record = run.arrival_record[arrival];
    if (record >= 0 && run.record_firing[record] >= 0)
      found.push({ firing: run.record_firing[record], kind: "token", record });
  }
  for (const wake of run.wakesOf.of(firing))
    if (run.wake_asker[wake] >= 0) found.push({ firing: run.wake_asker[wake], kind: "wake", record: NOTHING });
  for (const before of absorbed(run, firing, actor)) found.push({ firing: before, kind: "kept", record: NOTHING });
  return found;
}

// The firings of the actor just before this one that sent nothing; for a resumed process, always the previous one.
/** @param {Run} run @param {number} firing @param {number} actor */
function absorbed(run, firing, actor) {
  const rows = run.firingsOf.of(actor), found = [];
  let place = search(rows.length, (i) => rows[i] >= firing) - 1;
  if (run.firing_outside[firing] === 1 && place >= 0) found.push(rows[place--]);
  if (run.hasSent[firing])
    for (; place >= 0 && !run.hasSent[rows[place]] && found.length < NEAREST; place--) found.push(rows[place]);
  return found;
}

/** @param {Run} run @param {number} firing @returns {Cause[]} */
function effectsOf(run, firing) {
  /** @type {Cause[]} */
  const found = [];
  const actor = run.firing_actor[firing];
  for (const record of run.recordsOf.of(firing))
    for (const arrival of run.arrivalsFrom.of(record))
      found.push({ firing: run.arrival_firing[arrival], kind: "token", record });
  for (const wake of run.wakesAsked.of(firing))
    found.push({ firing: run.wake_firing[wake], kind: "wake", record: NOTHING });
  const rows = run.firingsOf.of(actor), place = search(rows.length, (i) => rows[i] > firing);
  if (place < rows.length && run.firing_outside[rows[place]] === 1)
    found.push({ firing: rows[place], kind: "kept", record: NOTHING });
  if (!run.hasSent[firing])
    for (let next = place; next < rows.length && next < place + NEAREST; next++)
      if (run.hasSent[rows[next]]) {
        found.push({ firing: rows[next], kind: "kept", record: NOTHING });
        break;
      }
  return found;
}

// The acts that kept a token from an actor between its previous firing and this one.
/** @param {Run} run @param {number} firing */
function lossesBefore(run, firing) {
  const actor = run.firing_actor[firing], losses = run.lossesOf.get(actor) ?? [], rows = run.firingsOf.of(actor);
  const place = search(rows.length, (i) => rows[i] >= firing), tag = run.firing_tag[firing];
  const before = place ? run.firing_tag[rows[place - 1]] : -1;
  const first = search(losses.length, (i) => run.record_tag[losses[i]] > before);
  const end = search(losses.length, (i) => run.record_tag[losses[i]] > tag);
  return losses.slice(first, end);
}

// All causes and effects of a selection: firings by direction, and the edges between them.
class Cone {
  /** @param {Run} run @param {Chosen} selection @param {{ back: boolean, ahead: boolean }} directions */
  constructor(run, selection, directions) {
    this.run = run;
    this.back = new Map(); // firing -> how it was reached
    this.ahead = new Map();
    this.edges = [];
    this.isCut = false;
    const { firing, record } = selection;
    const isLoss = record >= 0 && run.isLoss.has(record);
    const sender = record >= 0 ? senderOf(run, record) : NOTHING;
    const own = firing >= 0 ? firing : sender;
    if (directions.back && own >= 0) this.grow(this.back, own, causesOf, (one, other) => other - one);
    if (directions.ahead) {
      const starts = isLoss ? deprived(run, record).map((each) => ({ firing: each, kind: "lost", record })) : null;
      if (starts) {
        for (const each of starts) {
          this.edges.push({ from: NOTHING, to: each.firing, kind: "lost", record, isBack: false });
          this.grow(this.ahead, each.firing, effectsOf, (one, other) => one - other);
        }
      } else if (own >= 0) this.grow(this.ahead, own, effectsOf, (one, other) => one - other);
    }
  }

  /** @param {Map<number, boolean>} found @param {number} start @param {(run: Run, firing: number) => Cause[]} next @param {(one: number, other: number) => number} order */
  grow(found, start, next, order) {
    const isBack = found === this.back, waiting = [{ firing: start, wakes: true }];
    found.set(start, true);
    let grown = 0;
    while (waiting.length) {
      if (++grown > NEAREST) {
        this.isCut = true;
        break;
      }
      waiting.sort((one, other) => order(other.firing, one.firing)); // the nearest comes last
      const { firing, wakes } = waiting.pop();
      for (const each of next(this.run, firing)) {
        if (each.kind === "wake" && !wakes) continue;
        const [from, to] = isBack ? [each.firing, firing] : [firing, each.firing];
        this.edges.push({ from, to, kind: each.kind, record: each.record, isBack });
        const follows = each.kind !== "wake";
        if (!found.has(each.firing) || (follows && !found.get(each.firing))) {
          found.set(each.firing, follows);
          waiting.push({ firing: each.firing, wakes: follows });
        }
      }
    }
  }

  /** @param {number} firing */
  has(firing) {
    return this.back.has(firing) || this.ahead.has(firing);
  }

  get actors() {
    return new Set([...this.back.keys(), ...this.ahead.keys()].map((firing) => this.run.firing_actor[firing]));
  }
}

// The firing whose send a record concerns.
/** @param {Run} run @param {number} record */
function senderOf(run, record) {
  if (run.record_firing[record] >= 0) return run.record_firing[record];
  const about = run.record_about[record];
  return about >= 0 ? run.record_firing[about] : NOTHING;
}

// The next firings of the actors that a loss affects.
/** @param {Run} run @param {number} record */
function deprived(run, record) {
  const port = run.ports[run.record_port[record]];
  return port.leads.map((actor) => run.nextFiring(actor, run.record_tag[record])).filter((firing) => firing >= 0);
}
