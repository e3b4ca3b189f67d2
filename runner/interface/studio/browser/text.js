// The text: an editor with problems, completion, descriptions, and the colours of names.

const CM = window.CodeMirror;
const KINDS = { key: "property", type: "class", actor: "variable", port: "interface", parameter: "variable", value: "enum", unit: "constant", path: "variable", function: "function", file: "text" };

const setColours = CM.StateEffect.define();
const colours = CM.StateField.define({
  create: () => CM.Decoration.none,
  update(found, transaction) {
    for (const effect of transaction.effects)
      if (effect.is(setColours)) {
        const size = transaction.newDoc.length, known = effect.value.filter(([from, to]) => from < to && to <= size);
        return CM.Decoration.set(known.map(([from, to, kind]) => CM.Decoration.mark({ class: `name-${kind}` }).range(from, to)), true);
      }
    return found.map(transaction.changes);
  },
  provide: (field) => CM.EditorView.decorations.from(field),
});

const { tags } = CM;
const highlight = CM.HighlightStyle.define([
  { tag: [tags.propertyName, tags.definition(tags.propertyName)], class: "word-key" },
  { tag: tags.comment, class: "word-comment" },
  { tag: [tags.string, tags.attributeValue], class: "word-quoted" },
  { tag: [tags.punctuation, tags.separator, tags.brace, tags.squareBracket], class: "word-mark" },
]);

class TextEditor {
  constructor(box, text, nonce, { ask, changed, save }) {
    this.ask = ask;
    const { EditorView, keymap } = CM;
    this.view = new EditorView({
      parent: box,
      state: CM.EditorState.create({
        doc: text,
        extensions: [
          CM.EditorState.lineSeparator.of("\n"), // so that all other characters of the file stay
          EditorView.cspNonce.of(nonce),
          CM.indentUnit.of("  "),
          CM.lineNumbers(), CM.history(), CM.drawSelection(), CM.highlightActiveLine(), CM.highlightActiveLineGutter(),
          CM.highlightSpecialChars(), CM.bracketMatching(), CM.highlightSelectionMatches(), CM.search({ top: true }),
          CM.lintGutter(), CM.yaml(), CM.syntaxHighlighting(highlight), colours,
          CM.autocompletion({ override: [(context) => this.complete(context)], interactionDelay: 0, icons: false }),
          CM.hoverTooltip((view, at) => this.describe(at), { hoverTime: 250 }),
          EditorView.contentAttributes.of({ "aria-label": "the model's text" }),
          keymap.of([
            { key: "Mod-s", preventDefault: true, run: () => (save(), true) },
            { key: "Tab", run: CM.acceptCompletion },
            { key: "Enter", run: (view) => (trim(view), false) },
            ...CM.completionKeymap, ...CM.searchKeymap, ...CM.historyKeymap, ...CM.lintKeymap, ...CM.defaultKeymap, CM.indentWithTab,
          ]),
          EditorView.updateListener.of((update) => { if (update.docChanged) changed(); }),
        ],
      }),
    });
  }

  get text() {
    return this.view.state.doc.toString();
  }

  // Changes of the text, which come from elsewhere on the page.
  splice(splices) {
    const changes = splices.map(({ from, to, text }) => ({ from, to, insert: text }));
    const last = splices.at(-1);
    if (last) this.view.dispatch({ changes, scrollIntoView: false });
  }

  show(from, to = from) {
    const size = this.view.state.doc.length;
    this.view.dispatch({ selection: { anchor: Math.min(from, size), head: Math.min(to, size) }, scrollIntoView: true });
    this.view.focus();
  }

  setProblems(problems) {
    const size = this.view.state.doc.length;
    const found = problems.map((problem) => ({
      from: Math.min(problem.from, size),
      to: Math.min(Math.max(problem.to, problem.from), size),
      severity: problem.severity === "error" ? "error" : "warning",
      source: problem.code,
      message: [problem.message, ...problem.help].join("\n"),
      actions: problem.fix ? [{ name: `write ${problem.fix.text.trim()}`, apply: () => this.splice([problem.fix]) }] : [],
    }));
    this.view.dispatch(CM.setDiagnostics(this.view.state, found.sort((one, other) => one.from - other.from)));
  }

  setColours(found) {
    this.view.dispatch({ effects: setColours.of(found) });
  }

  async complete({ pos, state, explicit }) {
    const before = state.doc.lineAt(pos).text.slice(0, pos - state.doc.lineAt(pos).from);
    if (!explicit && /^\s*$|#.*$|[\]})]\s*$/.test(before)) return null;
    const { options } = await this.ask({ ask: "complete", text: state.doc.toString(), at: pos });
    if (!options?.length) return null;
    const from = options[0].from;
    return {
      from,
      validFor: /^[\w*]*$/,
      options: options.filter((option) => option.from === from).map(({ text, kind, what, doc }) => ({
        label: text.trim().replace(/:$/, ""), apply: text, type: KINDS[kind] ?? "text", detail: what || kind, info: doc || undefined,
      })),
    };
  }

  async describe(at) {
    const { words } = await this.ask({ ask: "hover", text: this.text, at });
    return words ? { pos: at, above: true, create: () => ({ dom: element("div", { className: "described" }, ...formatted(words)) }) } : null;
  }
}

// A completed key ends with a space, for its value; what begins a section has none.
function trim(view) {
  const { main } = view.state.selection, line = view.state.doc.lineAt(main.head), before = line.text.slice(0, main.head - line.from);
  const spaces = before.match(/: +$/) && main.empty ? before.length - before.trimEnd().length : 0;
  if (spaces && CM.completionStatus(view.state) !== "active") view.dispatch({ changes: { from: main.head - spaces, to: main.head } });
}

// Words with **bold** and `code`, as text nodes: nothing in them becomes a tag.
function formatted(words) {
  return words.split(/\n\n+/).map((paragraph) => element("p", {}, ...paragraph.split(/(\*\*[^*]+\*\*|`[^`]+`)/).map((part) => {
    if (part.startsWith("**")) return element("b", { text: part.slice(2, -2) });
    return part.startsWith("`") ? element("code", { text: part.slice(1, -1) }) : part;
  })));
}
