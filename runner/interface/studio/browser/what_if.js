// What if: another course of the run that is shown, from the tag on where one stands; both futures side by side.

const SEVERAL = 60; // acts or ports in a menu

class WhatIf {
  /** @param {Link} link @param {{ page: HTMLElement, names: () => string[], aspects: () => string[] }} given */
  constructor(link, { page, names, aspects }) {
    this.link = link;
    this.page = page;
    this.aspects = aspects; // functions: the names of the model's aspects, and of parameters
    this.names = names;
    this.asked = 0;
    /** @type {State} */
    this.state = null;
    this.text = "";
    /** @type {number | null} s */
    this.until = null;
    /** @type {Viewer | null} */
    this.viewer = null;
    this.tag = element("span", { className: "from" });
    this.through = button("let it through", () => this.letThrough(), "small through");
    this.acts = this.menu("acts …", "what aspects did", () => this.actsFrom(), (record) => this.state.goTo({ run: 0, firing: NOTHING, record: Number(record) }));
    this.lost = this.menu("lose …", "lose a token", () => this.portsHere(), (port) => this.ask({ lose: [port] }));
    this.removed = this.menu("remove …", "remove an aspect", () => this.aspectsHere(), (aspect) => this.ask({ remove: [aspect] }));
    this.known = element("datalist", { id: "parameters-known" });
    this.change = element("input", { type: "text", label: "change a parameter from here on", placeholder: "name=value", spellcheck: false });
    this.change.setAttribute("list", this.known.id);
    this.change.addEventListener("focus", () => this.known.replaceChildren(...this.names().map((name) => element("option", { value: `${name}=` }))));
    this.change.addEventListener("keydown", (event) => { if (event.key === "Enter" && this.change.value.trim()) this.ask({ change: [this.change.value.trim()] }); });
    this.said = element("output", { className: "note" });
    this.box = element("div", { className: "whatif" }, this.tag, this.acts, this.through, this.lost, this.removed, this.change, this.known, this.said);
    this.box.setAttribute("role", "group");
    this.box.setAttribute("aria-label", "what if");
  }

  // A menu whose choices are acts; what it offers is found when it opens.
  /** @param {string} title @param {string} label @param {() => [string | number, string][]} offered @param {(value: string) => void} act */
  menu(title, label, offered, act) {
    const made = element("select", { label, title: `${label} from here on` }, element("option", { value: "", text: title }));
    const fill = () => made.replaceChildren(made.options[0], ...offered().map(([value, text]) => element("option", { value, text })));
    made.addEventListener("pointerdown", fill);
    made.addEventListener("focus", fill);
    made.addEventListener("change", () => {
      const { value } = made;
      made.selectedIndex = 0;
      if (value) act(value);
    });
    return made;
  }

  // The run that is shown: its text, its state, and the time (s) at which the limits of the studio have ended it.
  /** @param {{ text: string, state: State, until: number | null }} run */
  show({ text, state, until }) {
    Object.assign(this, { text, state, until });
    this.asked++;
    this.said.textContent = "";
    state.listeners.push(() => this.tell());
    this.tell();
  }

  tell() {
    const { state } = this;
    this.tag.textContent = `what if, from ${state.nowText}:`;
    this.through.disabled = this.act === null;
    this.through.title = this.act === null ? "choose what an aspect did, here or in the sequence" : this.actText(this.act);
  }

  // What an aspect did, if that is selected.
  get act() {
    const { selection, run } = this.state;
    return selection && selection.record >= 0 && !run.isSend[selection.record] ? selection.record : null;
  }

  /** @param {number} record */
  actText(record) {
    const { run } = this.state;
    return `${run.tagText(run.record_tag[record])} ${run.aspects[run.record_aspect[record]]}: ${run.events[run.record_event[record]]} at ${run.portPath(run.record_port[record])}`;
  }

  /** @returns {[number, string][]} */
  actsFrom() {
    const { run, tag } = this.state, first = search(run.acts.length, (i) => run.record_tag[run.acts[i]] >= tag);
    return [...run.acts.subarray(first, first + SEVERAL)].map((record) => [record, this.actText(record)]);
  }

  // Where tokens pass: first the ports of what is selected, then all.
  /** @returns {[string, string][]} */
  portsHere() {
    const { run, selection } = this.state, firing = selection?.firing ?? NOTHING;
    const own = firing >= 0 ? [...run.recordsOf.of(firing)].map((record) => run.record_port[record]) : [];
    const all = new Set([...own, ...run.ports.keys()].map((port) => run.portPath(port)).filter((path) => !run.placeOf.has(path)));
    return [...all].slice(0, SEVERAL).map((path) => [path, `the next token at ${path}`]);
  }

  /** @returns {[string, string][]} */
  aspectsHere() {
    return [...new Set([...this.aspects(), ...this.state.run.aspects])].map((name) => [name, name]);
  }

  letThrough() {
    const { run } = this.state, { act } = this, columns = [run.record_aspect, run.record_port, run.record_tag];
    const before = run.acts.filter((/** @type {number} */ other) => other <= act && columns.every((column) => column[other] === column[act]));
    const name = `${run.aspects[run.record_aspect[act]]}@${run.portPath(run.record_port[act])}#${before.length}`;
    this.ask({ let_through: [name] }, run.record_tag[act]);
  }

  /** @param {{ [change: string]: string[] }} changes */
  async ask(changes, tag = this.state.tag) {
    const { run, time } = this.state, isBetween = tag < 0 || (tag === this.state.tag && time > run.times[tag]);
    const at = isBetween ? [Math.ceil(time), 0] : [run.times[tag], run.microsteps[tag]], number = ++this.asked;
    this.said.textContent = "running both futures …";
    const found = await this.link.ask({ ask: "what_if", text: this.text, at, until: this.until, ...changes });
    if (number !== this.asked || found.stale) return;
    this.said.textContent = found.error ?? found.sentence;
    if (found.view) this.open(await readData(found.view));
  }

  // Both futures, over everything else.
  /** @param {Page} data */
  open(data) {
    if (this.viewer) this.close();
    this.viewer = new Viewer(data);
    const close = button("close", () => this.close(), "close");
    this.over = element("section", { className: "futures", tabIndex: -1 }, ...this.viewer.content);
    this.over.setAttribute("aria-label", "both futures");
    this.viewer.bar.box.prepend(close);
    this.opened = new AbortController();
    document.addEventListener("keydown", (event) => { if (event.key === "Escape" && !this.viewer.state.selection) this.close(); }, this.opened);
    keys(this.viewer.state, this.opened);
    this.page.append(this.over);
    this.over.focus();
  }

  close() {
    this.opened.abort();
    this.over.remove();
    this.viewer = null;
  }

  /** @param {number} seconds */
  advance(seconds) {
    this.viewer?.advance(seconds);
  }
}
