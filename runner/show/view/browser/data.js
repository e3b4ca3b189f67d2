// The data of the page: runs in columns, as packing.py writes them, and indices for looking things up.

const MISSING = -2, NOTHING = -1;

/** @param {string} text @returns {Promise<Page>} */
async function readData(text) {
  const packed = atob(text.trim()), bytes = new Uint8Array(packed.length);
  for (let i = 0; i < packed.length; i++) bytes[i] = packed.charCodeAt(i);
  const unpacked = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(unpacked).arrayBuffer();
  const size = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  const body = new Uint8Array(buffer, 4 + size);
  head.runs = head.runs.map((/** @type {PackedRun} */ each) => new Run(each, (column) => readColumn(body, column)));
  return head;
}

// Whole numbers are stored as differences from the previous one; bytes of equal significance are stored together.
/** @param {Uint8Array} body @param {Column} parts */
function readColumn(body, [kind, start, count]) {
  if (kind === "b") return body.subarray(start, start + count);
  const width = kind === "d" ? 8 : 4, whole = new Uint8Array(width * count);
  for (let plane = 0; plane < width; plane++) {
    const from = start + plane * count;
    for (let i = 0; i < count; i++) whole[i * width + plane] = body[from + i];
  }
  if (kind === "d") return new Float64Array(whole.buffer);
  if (kind === "f") return new Float32Array(whole.buffer);
  const numbers = new Int32Array(whole.buffer);
  for (let i = 1; i < count; i++) numbers[i] += numbers[i - 1];
  return numbers;
}

// For each number from 0 to count, the rows that have it in a column; rows with a negative number are left out.
class Index {
  /** @param {Numbers} column @param {number} count */
  constructor(column, count) {
    this.starts = new Int32Array(count + 1);
    for (const number of column) if (number >= 0) this.starts[number + 1]++;
    for (let i = 0; i < count; i++) this.starts[i + 1] += this.starts[i];
    this.rows = new Int32Array(this.starts[count]);
    const next = this.starts.slice(0, count);
    column.forEach((number, row) => { if (number >= 0) this.rows[next[number]++] = row; });
  }

  /** @param {number} number */
  of(number) {
    return this.rows.subarray(this.starts[number], this.starts[number + 1]);
  }
}

// The first index for which a condition holds, given that it also holds for all later ones.
/** @param {number} count @param {(index: number) => boolean} isSo */
function search(count, isSo) {
  let low = 0, high = count;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (isSo(middle)) high = middle;
    else low = middle + 1;
  }
  return low;
}

class Run {
  /** @param {PackedRun} head @param {(column: Column) => any} read */
  constructor(head, read) {
    Object.assign(this, head);
    for (const [name, column] of Object.entries(head.columns)) Object.assign(this, { [name]: read(column) });
    this.times = read(head.tags[0]); // ns
    this.microsteps = read(head.tags[1]);
    this.textBytes = read(head.texts[0]);
    this.textEnds = read(head.texts[1]); // lengths
    for (let i = 1; i < this.textEnds.length; i++) this.textEnds[i] += this.textEnds[i - 1];
    this.lanes = head.lanes.map((lane) => ({ ...lane, times: read(lane.times), values: read(lane.values) }));
    this.marks = head.marks.map((mark) => ({ ...mark, times: read(mark.times), rows: read(mark.rows) }));
    const firings = this.firing_tag.length, records = this.record_tag.length;
    this.recordsOf = new Index(this.record_firing, firings);
    this.arrivalsOf = new Index(this.arrival_firing, firings);
    this.arrivalsFrom = new Index(this.arrival_record, records);
    this.actsAbout = new Index(this.record_about, records);
    this.wakesOf = new Index(this.wake_firing, firings);
    this.firingsOf = new Index(this.firing_actor, this.places.length);
    this.recordsAt = new Index(this.record_port, this.ports.length);
    this.placeOf = new Map(this.places.map((path, place) => [path, place]));
    this.portOf = new Map(this.ports.map((port, number) => [this.portPath(number), number]));
    this.wake_asker = this.askers();
    this.wakesAsked = new Index(this.wake_asker, firings);
    this.isSend = new Uint8Array(records).map((_, row) => this.record_aspect[row] === NOTHING ? 1 : 0);
    this.hasSent = new Uint8Array(firings);
    this.record_firing.forEach((firing, row) => { if (firing >= 0 && this.isSend[row]) this.hasSent[firing] = 1; });
    this.acts = Int32Array.from(this.record_tag.keys()).filter((row) => !this.isSend[row]);
    this.findLosses();
    this.findFlights();
  }

  /** @param {number} port */
  portPath(port) {
    const { place, name } = this.ports[port];
    return name ? `${this.places[place]}.${name}` : this.places[place];
  }

  /** @param {number} record */
  text(record) {
    const text = this.record_text[record], start = text ? this.textEnds[text - 1] : 0;
    return new TextDecoder().decode(this.textBytes.subarray(start, this.textEnds[text]));
  }

  // The last tag at or before a time (ns); -1 before the first.
  /** @param {number} time */
  tagAt(time) {
    return search(this.times.length, (tag) => this.times[tag] > time) - 1;
  }

  // The last firing of an actor at or before a tag, and the first one at or after it; -1 if there is none.
  /** @param {number} actor @param {number} tag */
  lastFiring(actor, tag) {
    const rows = this.firingsOf.of(actor), place = search(rows.length, (i) => this.firing_tag[rows[i]] > tag);
    return place ? rows[place - 1] : -1;
  }

  /** @param {number} actor @param {number} tag */
  nextFiring(actor, tag) {
    const rows = this.firingsOf.of(actor), place = search(rows.length, (i) => this.firing_tag[rows[i]] >= tag);
    return place < rows.length ? rows[place] : -1;
  }

  // The firing that requested each wake-up.
  askers() {
    return this.wake_tag.map((tag, wake) => {
      if (tag < 0) return tag;
      const found = this.lastFiring(this.firing_actor[this.wake_firing[wake]], tag);
      return found >= 0 && this.firing_tag[found] === tag ? found : MISSING;
    });
  }

  // The last act on its way to an actor loses a token, if it never arrived.
  findLosses() {
    const last = new Map(); // what acts concern, and the actor -> the last of them
    const unsent = new Map(); // for acts at an output that concern nothing sent: aspects that one token has met
    for (const record of this.acts) {
      const about = this.record_about[record];
      if (about === MISSING) continue;
      let key = `${about}`;
      if (about === NOTHING) {
        const place = [this.record_firing[record], this.record_port[record], this.record_channel[record]].join(" ");
        const met = unsent.get(place) ?? { tokens: 0, aspects: new Set() }, aspect = this.record_aspect[record];
        if (met.aspects.has(aspect)) {
          met.tokens++;
          met.aspects.clear();
        }
        met.aspects.add(aspect);
        unsent.set(place, met);
        key = `${place} ${met.tokens}`;
      }
      for (const actor of this.ports[this.record_port[record]].leads) {
        const arrives = about >= 0 && this.arrivalsFrom.of(about).some(
          (arrival) => this.firing_actor[this.arrival_firing[arrival]] === actor);
        if (!arrives) last.set(`${key} ${actor}`, { record, actor });
      }
    }
    this.losses = [...last.values()].sort((one, other) => one.record - other.record);
    this.isLoss = new Set(this.losses.map((loss) => loss.record));
    this.lossesOf = new Map();
    for (const loss of this.losses) {
      if (!this.lossesOf.has(loss.actor)) this.lossesOf.set(loss.actor, []);
      this.lossesOf.get(loss.actor).push(loss.record);
    }
  }

  // Tokens with a travel time, in order of sending, and the longest of these times (ns).
  findFlights() {
    /** @type {{ arrival: number, record: number, sent: number, arrived: number }[]} */
    const flights = [];
    this.arrival_record.forEach((record, arrival) => {
      if (record < 0) return;
      const sent = this.times[this.record_tag[record]];
      const arrived = this.times[this.firing_tag[this.arrival_firing[arrival]]];
      if (arrived > sent) flights.push({ arrival, record, sent, arrived });
    });
    this.flights = flights.sort((one, other) => one.sent - other.sent);
  }

  /** @param {number} tag */
  tagText(tag) {
    const micro = this.microsteps[tag];
    return `${secondsText(this.times[tag])}${micro > 1 ? `, microstep ${micro}` : ""}`;
  }

  /** @param {number} firing */
  actorName(firing) {
    return this.places[this.firing_actor[firing]];
  }

  // The name of a port with its channel.
  /** @param {number} port @param {number} channel */
  portText(port, channel) {
    return this.portPath(port) + (channel >= 0 && this.ports[port].multi ? `[${channel}]` : "");
  }
}

// The shortest number that is this time and no other.
/** @param {number} nanoseconds */
function secondsText(nanoseconds) {
  return `${nanoseconds / 1e9} s`;
}
