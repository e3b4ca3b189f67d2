// The page: reads what is written, shows it, and arranges everything.

const PAUSE = 70, RUN_PAUSE = 350; // ms after the last key before the text is read, and before it is run
const LARGEST = 1 << 20; // characters of a file that is dropped in

class Studio {
  /** @param {HTMLElement} page @param {{ text: string, name: string, is_new: boolean }} hello */
  constructor(page, hello) {
    this.page = page;
    this.name = hello.name;
    this.saved = hello.is_new ? null : hello.text;
    this.version = 0; // of the text
    /** @type {Promise<boolean>} */
    this.editing = Promise.resolve(true);
    /** @type {{ what: string, key: string, given: any[], done?: Promise<boolean> } | null} the latest change, if it waits */
    this.pending = null;
    /** @type {State} of the graph */
    this.state = null;
    /** @type {Diagram} */
    this.diagram = null;
    this.drawn = ""; // the drawing that the graph shows, as text
    /** @type {Rows<Field> | null} of the chosen actor */
    this.fields = null;
    this.fieldsOf = "";
    this.soon = 0; // timers
    this.runSoon = 0;
    /** @type {{ [section: string]: KnownType[] }} */
    this.typesKnown = { actors: [], aspects: [] };
    this.running = new Running(link, { shown: (data, run) => this.showRun(data, run) });
    this.whatIf = new WhatIf(link, { page, aspects: () => [...this.aspects.rows.keys()], names: () => this.parameterNames() });
    this.views = new Views(this.whatIf);
    this.build(hello);
    this.read();
    this.loadTypes();
  }

  /** @param {{ text: string, name: string }} hello */
  build(hello) {
    const pane = (/** @type {string} */ name, /** @type {Node[]} */ ...content) => {
      const made = element("section", { className: `part ${name}` }, ...content);
      made.setAttribute("aria-label", name);
      return made;
    };
    const lists = ["aspects", "actors"].map((section) => element("datalist", { id: `${section}-known` }));
    this.lists = { aspects: lists[0], actors: lists[1] };
    this.saveButton = button("Save", () => this.save(), "save");
    this.undoButton = button("Undo", () => CM.undo(this.editor.view));
    this.redoButton = button("Redo", () => CM.redo(this.editor.view));
    this.message = element("output", { className: "message" });
    this.problems = element("ul", { className: "problems" });
    this.summary = element("strong", { className: "summary" });
    this.graphBox = element("div", { className: "graphbox" });
    this.hint = element("p", { className: "hint" });
    this.chosen = element("div", { className: "chosen" });
    this.parameters = new Rows((/** @type {Field} */ field) => fieldRow(field, (text) => this.edit("set_parameter", "", "parameters", field.name, "", text)));
    /** @type {Write} */
    const edit = (what, ...given) => this.edit(what, ...given);
    this.aspects = new Rows((/** @type {Aspect} */ aspect) => aspectRow(aspect, { edit, names: "aspects-known" }));
    this.attach = attachRow({ edit, names: "aspects-known", typeOf: (name) => this.typesKnown.aspects.find((each) => each.name === name), taken: () => [...this.aspects.rows.keys()] });
    const file = element("input", { type: "file", accept: ".yaml,.yml", hidden: true });
    file.addEventListener("change", () => { this.dropIn(file.files[0]); file.value = ""; });
    const heading = (/** @type {string} */ words, /** @type {Node[]} */ ...more) => element("h2", {}, words, ...more);
    const textBox = element("div", { className: "editor" });
    this.page.replaceChildren(
      element("header", {}, element("strong", { text: hello.name, className: "name" }), this.saveButton, this.undoButton, this.redoButton, this.message, this.pageTabs()),
      element("main", { id: "parts" },
        pane("text", textBox),
        pane("graph", this.graphBox, this.hint, this.addRow(), this.chosen),
        pane("over", this.views.box),
        pane("side", heading("run"), this.running.box,
          heading("aspects", button("disturbance …", () => file.click(), "small"), file), this.aspects.box, this.attach.box,
          heading("parameters"), this.parameters.box),
        pane("below", this.summary, this.problems)), ...lists);
    this.page.dataset.tab = "graph";
    this.editor = new TextEditor(textBox, hello.text, this.page.dataset.nonce, {
      ask: (question) => link.ask(question), changed: () => this.changed(), save: () => this.save(),
    });
    const drop = (/** @type {DragEvent} */ event) => {
      event.preventDefault();
      if (event.type === "drop" && event.dataTransfer.files[0]) this.dropIn(event.dataTransfer.files[0]);
    };
    for (const kind of /** @type {("dragover" | "drop")[]} */ (["dragover", "drop"])) document.addEventListener(kind, (event) => { if (event.dataTransfer.types.includes("Files")) drop(event); }, true);
    addEventListener("beforeunload", (event) => { if (this.isDirty) event.preventDefault(); });
    this.showGraph(emptyState(EMPTY), EMPTY);
    this.tell();
  }

  pageTabs() {
    const made = element("nav", { className: "pagetabs" });
    for (const name of ["text", "graph", "run"]) {
      const tab = button(name, () => {
        this.page.dataset.tab = name;
        for (const each of made.children) each.setAttribute("aria-pressed", String(each === tab));
        this.state?.changed();
      }, "toggle");
      tab.dataset.tab = name;
      tab.setAttribute("aria-pressed", String(name === "graph"));
      made.append(tab);
    }
    return made;
  }

  // -- what is written --

  get isDirty() {
    return this.editor.text !== this.saved && !(this.saved === null && !this.editor.text);
  }

  changed() {
    this.version++;
    this.running.stale();
    clearTimeout(this.soon);
    clearTimeout(this.runSoon);
    this.soon = setTimeout(() => this.read(), PAUSE);
    this.tell();
  }

  tell() {
    const { state } = this.editor.view;
    this.saveButton.disabled = !this.isDirty;
    this.undoButton.disabled = !CM.undoDepth(state);
    this.redoButton.disabled = !CM.redoDepth(state);
    document.title = `${this.isDirty ? "● " : ""}${this.name} - Epicycle studio`;
  }

  async read() {
    const { version } = this, { text } = this.editor;
    let isValid = false;
    const found = await link.ask({ ask: "read", text }, (said) => {
      if (version !== this.version) return;
      isValid = said.valid;
      this.showProblems(said.problems);
    });
    if (version !== this.version || found.stale) return;
    if (found.error) return this.say(found.error);
    if (found.graph) {
      this.showDrawing(found.graph);
      this.parameters.show(found.parameters);
      this.aspects.show(found.aspects);
    }
    this.graphBox.classList.toggle("before", !found.graph);
    this.page.dataset.read = String(version);
    this.showChosen();
    if (isValid) this.runSoon = setTimeout(() => this.running.start(text), RUN_PAUSE);
    else this.running.stale(this.running.now ? "not run: there are problems; these are the figures of the text before" : "runs when there are no problems");
    const { result: coloured } = await link.ask({ ask: "textDocument/semanticTokens/full", text, params: {} });
    if (version === this.version && coloured) this.editor.setColours(coloured);
  }

  /** @param {Diagnostic[]} problems */
  showProblems(problems) {
    this.editor.setProblems(problems);
    const errors = problems.filter((each) => each.severity === 1).length, others = problems.length - errors;
    const counted = (/** @type {number} */ count, /** @type {string} */ word) => `${count} ${word}${count === 1 ? "" : "s"}`;
    this.summary.textContent = problems.length ? [errors && counted(errors, "problem"), others && counted(others, "warning")].filter(Boolean).join(", ") : "no problems";
    this.summary.dataset.kind = errors ? "error" : others ? "warning" : "fine";
    this.problems.replaceChildren(...problems.map(({ range, severity, code, message, relatedInformation, data: fix }) => {
      const [said, ...help] = message.split("\nhelp: ");
      const go = button(relatedInformation ? "another file" : `line ${range.start.line + 1}`, () => this.editor.show(range), "link");
      const made = element("li", { className: severity === 1 ? "error" : "warning" }, go,
        element("code", { text: code }), element("span", { text: said }), ...help.filter((each) => !fix || each !== fixText(fix)).map((each) => element("em", { text: each })));
      if (fix) made.append(button(fixText(fix), () => this.editor.write([fix]), "small"));
      return made;
    }));
  }

  async loadTypes() {
    const { types } = await link.ask({ ask: "types", text: this.editor.text });
    if (!types) return;
    this.typesKnown = types;
    for (const [section, list] of Object.entries(this.lists))
      list.replaceChildren(...this.typesKnown[section].map(({ name, doc }) => element("option", { value: name, label: doc })));
  }

  // -- the graph --

  /** @param {ModelDrawing} drawing */
  showDrawing(drawing) {
    const text = JSON.stringify(drawing);
    if (text === this.drawn) return;
    this.drawn = text;
    this.showGraph(emptyState(drawing), drawing);
  }

  /** @param {State} state @param {ModelDrawing} drawing */
  showGraph(state, drawing) {
    const before = this.diagram;
    this.state = state;
    this.diagram = new Diagram(state, {
      connect: (source, target) => this.edit("connect", source, target), choose: (chosen) => this.showChosen(chosen),
    }, before);
    this.graphBox.replaceChildren(this.diagram.canvas);
    this.hint.textContent = drawing.note || (drawing.boxes.length ? "Draw a line from port to port to connect them; click a part or a wire to change it." : "The graph of what you write appears here.");
    this.views.show(state, { runs: state.runs });
  }

  /** @param {Page} data @param {{ text: string, until: number | null }} run */
  showRun(data, { text, until }) {
    const state = new State(data), { drawing } = state.run;
    if (this.views.state.time && this.views.state.end === state.end) state.setTime(this.views.state.time);
    this.whatIf.show({ text, until, state });
    this.drawn = JSON.stringify(drawing);
    this.showGraph(state, drawing);
    this.page.dataset.run = String(this.version);
  }

  // What a run can change: parameters of the model, and of the chosen actor.
  parameterNames() {
    const chosen = this.diagram.chosen?.path;
    return [...this.parameters.rows.keys(), ...(chosen && this.fields ? [...this.fields.rows.keys()].map((name) => `${chosen}.${name}`) : [])];
  }

  // A new actor: its type, its name, and the button that writes it.
  addRow() {
    const type = element("input", { type: "text", className: "type", label: "type of a new actor", placeholder: "new actor: its type", spellcheck: false });
    type.setAttribute("list", "actors-known");
    const name = element("input", { type: "text", label: "name of the new actor", placeholder: "its name", spellcheck: false });
    const add = async () => {
      const known = this.typesKnown.actors.find((each) => each.name === type.value.trim());
      if (!known) return this.say("There is no such type.");
      if (await this.edit("add_part", "", "actors", name.value.trim() || known.name.toLowerCase(), known.name, known.needs)) type.value = name.value = "";
    };
    return element("div", { className: "addrow" }, type, name, button("add", add, "small"));
  }

  async showChosen(chosen = this.diagram.chosen) {
    const box = this.chosen;
    if (!chosen) return box.replaceChildren();
    if (chosen.aspect) {
      box.replaceChildren();
      return this.aspects.rows.get(chosen.aspect)?.box.scrollIntoView({ block: "nearest" });
    }
    if (chosen.ends) {
      const [first] = chosen.ends;
      if (first) this.attach.place.value = first[1];
      return box.replaceChildren(...chosen.ends.map(([source, target]) => element("div", { className: "row" },
        element("code", { text: `${source} → ${target}` }), button("remove", () => this.edit("disconnect", source, target), "small"))));
    }
    const { version } = this, { path } = chosen;
    this.attach.place.value = `${path.replace(/\[0\]$/, "[*]")}.*`;
    const found = await link.ask({ ask: "fields", text: this.editor.text, path });
    if (version !== this.version || this.diagram.chosen?.path !== path) return;
    if (found.error) return box.replaceChildren(element("p", { className: "note", text: found.error }));
    if (this.fieldsOf !== path) {
      const rows = new Rows((/** @type {Field} */ field) => fieldRow(field, (text) => this.edit("set_parameter", found.owner, "actors", found.name, field.name, text)));
      this.fieldsOf = path;
      this.fields = rows;
    }
    if (this.fields.box.parentNode !== box || box.dataset.path !== path) {
      box.dataset.path = path;
      box.replaceChildren(element("header", {}, element("b", { text: path }), element("span", { className: "note", text: ` ${chosen.kind}: ${chosen.doc}` }),
        button("remove", () => this.edit("remove", found.owner, "actors", found.name), "small")), this.fields.box);
    }
    this.fields.show(found.fields);
  }

  // -- changes --

  // One change of the model after the other; each is written into the text as it is then. Whether it was.
  /** @param {string} what @param {any[]} given @returns {Promise<boolean>} */
  edit(what, ...given) {
    const key = given.slice(0, -1).join(" ");
    if (this.pending?.what === what && this.pending.key === key) {
      this.pending.given = given; // while one drags, only the latest counts
      return this.pending.done;
    }
    /** @type {{ what: string, key: string, given: any[], done?: Promise<boolean> }} */
    const pending = { what, key, given };
    this.pending = pending;
    pending.done = this.editing = this.editing.then(async () => {
      if (this.pending === pending) this.pending = null;
      for (let attempt = 0; attempt < 3; attempt++) {
        const { version } = this, found = await link.ask({ ask: "edit", text: this.editor.text, what, given: pending.given });
        if (version !== this.version) continue;
        this.say(found.error ?? "");
        if (found.edits) this.editor.write(found.edits);
        return Boolean(found.edits);
      }
      return false;
    });
    return pending.done;
  }

  /** @param {File} file */
  async dropIn(file) {
    if (!file || file.size > LARGEST) return this.say("A disturbance is a YAML file of at most 1 MB.");
    await this.edit("drop_in", "", await file.text());
  }

  /** @param {string} words */
  say(words) {
    this.message.textContent = words;
    this.message.title = words;
  }

  async save(anyway = false) {
    const { text } = this.editor, found = await link.ask({ ask: "save", text, anyway });
    if (found.conflict) {
      this.say(`${found.conflict}: `);
      return this.message.append(button("write mine", () => this.save(true), "small"));
    }
    this.say(found.error ?? "saved");
    if (found.saved) this.saved = text;
    this.tell();
  }
}

/** @type {ModelDrawing} */
const EMPTY = { note: "", width: 300, height: 100, boxes: [], wires: [], badges: [] };
/** @type {Link} */
let link;
/** @type {Studio | undefined} */
let studio;

/** @param {ModelDrawing} drawing */
const emptyState = (drawing) => new State({ runs: [emptyRun(drawing)], palette: [], story: [], difference: null, comparison: [] });

function begin() {
  const page = document.getElementById("page");
  readTheme();
  PALETTE.push("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1");
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    readTheme();
    studio?.state.changed();
  });
  link = new Link((hello) => {
    studio = new Studio(page, hello);
    page.dataset.ready = "yes";
    window.epicycle = { studio };
  }, (reason) => {
    page.dataset.ended = "yes";
    studio?.say(`${reason}: what you have written is still here, to be copied`);
  });
  eachFrame((seconds) => {
    const state = studio?.state;
    if (!state) return;
    studio.whatIf.advance(seconds);
    state.advance(seconds);
    if (!state.isDirty) return;
    state.isDirty = false;
    studio.diagram.paint();
    studio.views.paint();
  });
}

begin();
