// What can be set: parameters as fields and sliders, aspects as switches; each writes the text.

// Rows that stay while somebody uses them: one per key, made once and then updated.
/** @template {{ name: string }} Item */
class Rows {
  /** @param {(item: Item) => { box: HTMLElement, update: (item: Item) => void }} make */
  constructor(make) {
    this.box = element("div", { className: "rows" });
    this.make = make;
    /** @type {Map<string, { box: HTMLElement, update: (item: Item) => void }>} */
    this.rows = new Map();
  }

  /** @param {Item[]} items */
  show(items) {
    const wanted = new Map(items.map((item) => [item.name, item]));
    for (const [name, row] of this.rows)
      if (!wanted.has(name)) {
        row.box.remove();
        this.rows.delete(name);
      }
    for (const [name, item] of wanted) {
      if (!this.rows.has(name)) this.rows.set(name, this.make(item));
      const row = this.rows.get(name);
      row.update(item);
      this.box.append(row.box);
    }
  }
}

/** @param {HTMLElement} input */
const isUsed = (input) => document.activeElement === input && input.dataset.used === "yes";

let fieldCount = 0;

// A field for a parameter; `write(text)` is told what somebody types, chooses or drags.
/** @param {Field} field @param {(text: string) => void} write */
function fieldRow(field, write) {
  const id = `field-${++fieldCount}`;
  const label = element("label", { text: field.name, htmlFor: id });
  const box = element("div", { className: "row" }, label);
  let now = field;
  /** @type {any} a field, a list or a box */
  let input;
  /** @type {HTMLInputElement | null} */
  let slider = null;
  if (field.kind === "choice" && field.choices.length) {
    input = element("select", { id }, ...field.choices.map((each) => element("option", { value: each, text: each })));
    input.addEventListener("change", () => write(input.value));
  } else if (field.kind === "switch") {
    input = element("input", { id, type: "checkbox" });
    input.addEventListener("change", () => write(String(input.checked)));
  } else {
    input = element("input", { id, type: "text", spellcheck: false, autocomplete: "off" });
    input.addEventListener("change", () => { if (input.value.trim()) write(input.value); });
    input.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => { if (event.key === "Enter") input.blur(); });
  }
  for (const kind of ["input", "blur"]) input.addEventListener(kind, () => { input.dataset.used = kind === "input" ? "yes" : ""; });
  const hasSlider = field.kind === "text" && typeof field.low === "number" && typeof field.high === "number" && field.high > field.low;
  if (hasSlider) {
    slider = element("input", { type: "range", label: `${field.name}, as a slider` });
    slider.min = String(field.low);
    slider.max = String(field.high);
    slider.step = String(field.whole ? 1 : stepOf(field.high - field.low));
    slider.addEventListener("input", () => {
      slider.dataset.used = "yes";
      input.value = [now.whole ? slider.value : numberText(Number(slider.value)), now.unit].filter(Boolean).join(" ");
      write(input.value);
    });
    slider.addEventListener("change", () => { slider.dataset.used = ""; });
    box.append(slider);
  }
  box.append(input);
  return {
    box,
    input,
    /** @param {Field} field */
    update(field) {
      now = field;
      label.title = [field.doc, field.unit && `in ${field.unit}`].filter(Boolean).join(", ");
      if (field.kind === "switch") input.checked = (field.said || field.value) === "true";
      else if (!isUsed(input) && slider?.dataset.used !== "yes") input.value = field.said || "";
      if (field.kind === "choice" && !field.said) input.value = field.value;
      input.placeholder = field.value || "";
      if (slider) {
        slider.disabled = field.number === null || field.computed;
        slider.title = slider.disabled ? "an expression computes it" : "";
        if (slider.dataset.used !== "yes" && field.number !== null) slider.value = String(field.number);
      }
      box.classList.toggle("given", Boolean(field.said));
    },
  };
}

// A hundred round steps, more or less.
/** @param {number} size */
function stepOf(size) {
  const raw = size / 100, power = 10 ** Math.floor(Math.log10(raw));
  return Number(([1, 2, 5].findLast((each) => each * power <= raw * 1.000001) * power).toPrecision(3));
}

// An aspect of the model: a switch, its type, its place, and what is strong about it.
/** @param {Aspect} aspect @param {{ edit: Write, names: string }} given */
function aspectRow(aspect, { edit, names }) {
  const on = element("input", { type: "checkbox", label: `${aspect.name} is on` });
  const type = element("input", { type: "text", className: "type", label: `type of ${aspect.name}`, spellcheck: false });
  type.setAttribute("list", names);
  const row = (/** @type {Field} */ field) => fieldRow(field, (text) => edit("set_parameter", "", "aspects", aspect.name, field.name, text));
  const place = element("code", {}), fields = new Rows(row), others = new Rows(row);
  const more = element("details", {}, element("summary", { text: "more" }));
  more.append(others.box);
  const box = element("section", { className: "aspect" },
    element("header", {}, element("label", { className: "switch", title: aspect.name }, on, element("b", { text: aspect.name })), type,
      button("×", () => edit("remove", "", "aspects", aspect.name), "remove")),
    element("p", { className: "place" }, "at ", place), fields.box, more);
  box.dataset.aspect = aspect.name;
  on.addEventListener("change", () => edit("switch", "", aspect.name, on.checked));
  type.addEventListener("change", () => edit("swap", "", aspect.name, type.value.trim()));
  return {
    box,
    /** @param {Aspect} aspect */
    update({ type: kind, at, on: isOn, fields: found }) {
      on.checked = isOn;
      box.classList.toggle("off", !isOn);
      if (document.activeElement !== type) type.value = kind;
      place.textContent = at;
      const isMain = (/** @type {Field} */ field) => field.said || (typeof field.low === "number" && typeof field.high === "number");
      fields.show(found.filter(isMain));
      others.show(found.filter((field) => !isMain(field)));
      more.hidden = !found.some((field) => !isMain(field));
    },
  };
}

// A new aspect: its type and place, and the switch that attaches it.
/** @param {{ edit: Write, names: string, typeOf: (name: string) => KnownType | undefined, taken: () => string[] }} given */
function attachRow({ edit, names, typeOf, taken }) {
  const type = element("input", { type: "text", className: "type", label: "type of a new aspect", placeholder: "PacketLoss, Latency, …", spellcheck: false });
  type.setAttribute("list", names);
  const place = element("input", { type: "text", className: "at", label: "where it attaches", placeholder: "where: a port, or a pattern", spellcheck: false });
  const on = element("input", { type: "checkbox", label: "attach it" }), said = element("p", { className: "note" });
  type.addEventListener("input", () => { said.textContent = typeOf(type.value)?.doc ?? ""; });
  on.addEventListener("change", async () => {
    const found = typeOf(type.value.trim());
    if (!found || !place.value.trim()) {
      said.textContent = found ? "Say where it attaches: click a wire or a part, or write a pattern." : "Choose a type first.";
      on.checked = false;
      return;
    }
    const base = found.name.replace(/(?<=[a-z])(?=[A-Z])/g, "_").toLowerCase();
    let name = base;
    for (let i = 2; taken().includes(name); i++) name = `${base}_${i}`;
    await edit("add_part", "", "aspects", name, found.name, { ...found.needs, at: place.value.trim() });
    on.checked = false;
    type.value = said.textContent = "";
  });
  const box = element("section", { className: "aspect attach" }, element("header", {}, element("label", { className: "switch" }, on, element("b", { text: "attach" })), type), element("p", { className: "place" }, "at ", place), said);
  return { box, place, type };
}
