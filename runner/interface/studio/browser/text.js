// The text: an editor with problems, completion, descriptions, and the colours of names.

/** @type {any} CodeMirror, from its own file */
const CM = window.CodeMirror;
// What the kinds of completions are called here.
/** @type {{ [kind: number]: string }} */
const KINDS = { 3: "function", 6: "parameter", 7: "type", 8: "port", 9: "actor", 10: "key", 11: "unit", 20: "value" };
const TOKENS = ["parameter", "port", "actor", "aspect", "composite", "metric", "monitor", "figure"]; // as the server counts them
const SUGGESTIONS = 500;

const setColours = CM.StateEffect.define();
const colours = CM.StateField.define({
  create: () => CM.Decoration.none,
  /** @param {any} found @param {any} transaction */
  update(found, transaction) {
    for (const effect of transaction.effects)
      if (effect.is(setColours)) {
        const size = transaction.newDoc.length;
        /** @type {[number, number, string][]} */
        const known = effect.value.filter((/** @type {any} */ [from, to]) => from < to && to <= size);
        return CM.Decoration.set(known.map(([from, to, kind]) => CM.Decoration.mark({ class: `name-${kind}` }).range(from, to)), true);
      }
    return found.map(transaction.changes);
  },
  /** @param {any} field */
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
  /**
   * @param {HTMLElement} box @param {string} text @param {string} nonce
   * @param {{ ask: (question: Question) => Promise<any>, changed: () => void, save: () => void }} acts
   */
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
          CM.autocompletion({ override: [(/** @type {any} */ context) => this.complete(context)], interactionDelay: 0, icons: false }),
          CM.hoverTooltip((/** @type {any} */ view, /** @type {number} */ at) => this.describe(at), { hoverTime: 250 }),
          EditorView.contentAttributes.of({ "aria-label": "the model's text" }),
          keymap.of([
            { key: "Mod-s", preventDefault: true, run: () => (save(), true) },
            { key: "Tab", run: CM.acceptCompletion },
            { key: "Enter", run: (/** @type {any} */ view) => (trim(view), false) },
            ...CM.completionKeymap, ...CM.searchKeymap, ...CM.historyKeymap, ...CM.lintKeymap, ...CM.defaultKeymap, CM.indentWithTab,
          ]),
          EditorView.updateListener.of((/** @type {any} */ update) => { if (update.docChanged) changed(); }),
        ],
      }),
    });
  }

  /** @returns {string} */
  get text() {
    return this.view.state.doc.toString();
  }

  /** Changes of the text, which come from elsewhere on the page. @param {TextEdit[]} edits */
  write(edits) {
    const places = new Places(this.text);
    const changes = edits.map(({ range, newText }) => ({ ...places.stretch(range), insert: newText }));
    if (changes.length) this.view.dispatch({ changes, scrollIntoView: false });
  }

  /** @param {Range} range */
  show(range) {
    const { from, to } = new Places(this.text).stretch(range);
    this.view.dispatch({ selection: { anchor: from, head: to }, scrollIntoView: true });
    this.view.focus();
  }

  /** @param {Diagnostic[]} problems */
  setProblems(problems) {
    const places = new Places(this.text);
    const found = problems.filter((each) => !each.relatedInformation).map(({ range, severity, code, message, data: fix }) => ({
      ...places.stretch(range),
      severity: severity === 1 ? "error" : "warning",
      source: code,
      message,
      actions: fix ? [{ name: fixText(fix), apply: () => this.write([fix]) }] : [],
    }));
    this.view.dispatch(CM.setDiagnostics(this.view.state, found.sort((one, other) => one.from - other.from)));
  }

  /** Colour the names, of which each says its distance from the one before. @param {{ data: number[] }} tokens */
  setColours({ data }) {
    const places = new Places(this.text), found = [];
    let line = 0, character = 0;
    for (let i = 0; i < data.length; i += 5) {
      character = data[i] ? data[i + 1] : character + data[i + 1];
      line += data[i];
      const from = places.offset({ line, character });
      found.push([from, from + data[i + 2], TOKENS[data[i + 3]]]);
    }
    this.view.dispatch({ effects: setColours.of(found) });
  }

  /** What the language server says of a place. @param {string} method @param {number} at */
  about(method, at) {
    const { text } = this;
    return this.ask({ ask: method, text, params: { position: new Places(text).place(at) } });
  }

  /** @param {any} context */
  async complete({ pos, state, explicit }) {
    const before = state.doc.lineAt(pos).text.slice(0, pos - state.doc.lineAt(pos).from);
    if (!explicit && /^\s*$|#.*$|[\]})]\s*$/.test(before)) return null;
    const places = new Places(state.doc.toString());
    /** @type {CompletionItem[]} */
    const items = (await this.about("textDocument/completion", pos)).result?.slice(0, SUGGESTIONS) ?? [];
    if (!items.length) return null;
    const starts = items.map(({ textEdit }) => places.offset(textEdit.range.start)), [from] = starts;
    return {
      from,
      validFor: /^[\w*]*$/,
      options: items.filter((_, i) => starts[i] === from).map(({ label, kind, detail, documentation, textEdit }) => ({
        label, apply: textEdit.newText, type: KINDS[kind] ?? "text", detail: detail ?? KINDS[kind], info: documentation,
      })),
    };
  }

  /** @param {number} at */
  async describe(at) {
    const words = (await this.about("textDocument/hover", at)).result?.contents.value;
    return words ? { pos: at, above: true, create: () => ({ dom: element("div", { className: "described" }, ...formatted(words)) }) } : null;
  }
}

// Places in a text as the Language Server Protocol has them, whose lines end with CR, LF or both.
class Places {
  /** @param {string} text */
  constructor(text) {
    this.size = text.length;
    this.starts = [0, ...Array.from(text.matchAll(/\r\n|\r|\n/g), (found) => found.index + found[0].length)];
  }

  /** @param {Place} place */
  offset({ line, character }) {
    return Math.min(line < this.starts.length ? this.starts[line] + character : this.size, this.size);
  }

  /** @param {Range} range */
  stretch({ start, end }) {
    return { from: this.offset(start), to: this.offset(end) };
  }

  /** @param {number} offset @returns {Place} */
  place(offset) {
    const line = search(this.starts.length, (i) => this.starts[i] > offset) - 1;
    return { line, character: offset - this.starts[line] };
  }
}

/** @param {TextEdit} fix */
const fixText = (fix) => `write ${fix.newText.trim().replace(/^, /, "")}`;

// A completed key ends with a space, for its value; what begins a section has none.
/** @param {any} view */
function trim(view) {
  const { main } = view.state.selection, line = view.state.doc.lineAt(main.head), before = line.text.slice(0, main.head - line.from);
  const spaces = before.match(/: +$/) && main.empty ? before.length - before.trimEnd().length : 0;
  if (spaces && CM.completionStatus(view.state) !== "active") view.dispatch({ changes: { from: main.head - spaces, to: main.head } });
}

// Words with **bold** and `code`, as text nodes: nothing in them becomes a tag.
/** @param {string} words */
function formatted(words) {
  return words.split(/\n\n+/).map((paragraph) => element("p", {}, ...paragraph.split(/(\*\*[^*]+\*\*|`[^`]+`)/).map((part) => {
    if (part.startsWith("**")) return element("b", { text: part.slice(2, -2) });
    return part.startsWith("`") ? element("code", { text: part.slice(1, -1) }) : part;
  })));
}
