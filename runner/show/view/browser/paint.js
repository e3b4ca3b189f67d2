// Canvases that fit their boxes, colours of the theme, and gestures shared by all views.

/** @type {string[]} */
const PALETTE = []; // also of figures; filled by main

/**
 * @template {keyof HTMLElementTagNameMap} Name
 * @param {Name} name @param {{ [name: string]: any }} [options] @param {...(Node | string | null)} children
 */
function element(name, options = {}, ...children) {
  const { text, label, ...rest } = options, made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  if (label) made.setAttribute("aria-label", label);
  Object.assign(made, rest);
  made.append(...children.filter((child) => child !== null));
  return made;
}

// The colours of the page's style, read again when the theme changes.
/** @type {{ [name: string]: string }} */
const theme = {};
function readTheme() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["ink", "soft", "faint", "paper", "panel", "frame", "back", "ahead", "loss", "limit", "now"])
    theme[name] = style.getPropertyValue(`--${name}`).trim();
}

// CSS pixels per unit of the views: letters and lines are larger on a very wide screen.
function unit() {
  return window.innerWidth >= 2400 ? 1.5 : 1;
}

class View {
  // A canvas in a box; `draw` paints it in CSS pixels, or in larger units on a very wide screen.
  /** @param {State} state @param {string} label */
  constructor(state, label) {
    this.state = state;
    this.canvas = element("canvas", { label, tabIndex: 0, className: "view" });
    this.canvas.setAttribute("role", "img");
    this.width = this.height = 0;
    new ResizeObserver(() => this.fit()).observe(this.canvas);
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas, ratio = window.devicePixelRatio || 1;
    if (!width || !height) return;
    this.width = width / unit();
    this.height = height / unit();
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.paper = this.canvas.getContext("2d");
    this.resized?.();
    this.state.changed();
  }

  paint() {
    if (!this.width || !this.canvas.offsetParent) return;
    const ratio = this.canvas.width / this.width;
    this.paper.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.paper.clearRect(0, 0, this.width, this.height);
    this.paper.lineJoin = "round";
    this.draw(this.paper);
  }

  /** @param {string} words @param {number} x @param {number} y @param {TextStyle} style */
  text(words, x, y, { colour = theme.ink, size = 11, align = "left", bold = false, width = Infinity, hasEnd = false, isApart = false } = {}) {
    const { paper } = this;
    this.write(size, bold);
    paper.fillStyle = colour;
    paper.textAlign = align;
    paper.textBaseline = "alphabetic";
    if (width < Infinity && paper.measureText(words).width > width) {
      if (width < 12) return;
      const letters = [...words], cut = (/** @type {number} */ count) =>
        hasEnd ? `…${letters.slice(letters.length - count).join("")}` : `${letters.slice(0, count).join("")}…`;
      words = cut(search(letters.length, (count) => paper.measureText(cut(count + 1)).width > width));
    }
    if (isApart) { // from what is drawn behind it
      Object.assign(paper, { strokeStyle: theme.panel, lineWidth: 4 });
      paper.setLineDash([]);
      paper.strokeText(words, x, y);
    }
    paper.fillText(words, x, y);
  }

  // Choose the letters of what is written or measured next.
  /** @param {number} size @param {boolean} bold */
  write(size, bold) {
    this.paper.font = `${bold ? "600 " : ""}${size}px system-ui, sans-serif`;
  }

  /** @param {number[]} points @param {string} colour @param {number} [width] @param {number[]} [dash] */
  line(points, colour, width = 1, dash = []) {
    const { paper } = this;
    if (points.length < 4) return;
    paper.beginPath();
    paper.moveTo(points[0], points[1]);
    for (let i = 2; i < points.length; i += 2) paper.lineTo(points[i], points[i + 1]);
    paper.strokeStyle = colour;
    paper.lineWidth = width;
    paper.setLineDash(dash);
    paper.stroke();
    paper.setLineDash([]);
  }

  /** @param {number} x @param {number} y @param {number} radius @param {string} colour @param {string | null} rim */
  dot(x, y, radius, colour, rim = null) {
    const { paper } = this;
    paper.beginPath();
    paper.arc(x, y, radius, 0, 2 * Math.PI);
    paper.fillStyle = colour;
    paper.fill();
    if (rim) {
      paper.strokeStyle = rim;
      paper.lineWidth = 1.5;
      paper.stroke();
    }
  }

  /** @param {number} x @param {number} y @param {number} size @param {string} colour */
  cross(x, y, size, colour) {
    this.line([x - size, y - size, x + size, y + size], colour, 2);
    this.line([x - size, y + size, x + size, y - size], colour, 2);
  }
}

// Drags, wheel and pinches of a canvas: `move(dx, dy, x, y)`, `zoom(factor, x, y)`, `click(x, y)`; a drag starts with
// `grab(x, y)`, which may return another function to continue it until `drop(x, y)`.
/** @param {HTMLCanvasElement} canvas @param {Gestures} given */
function gestures(canvas, { move, zoom, click, grab, drop, hover }) {
  /** @type {Map<number, Dot>} */
  const held = new Map();
  /** @type {Dot | null} */
  let start = null;
  /** @type {((x: number, y: number) => void) | null} */
  let way = null;
  let spread = 0;
  /** @param {MouseEvent} event @returns {Dot} */
  const at = (event) => {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left) / unit(), (event.clientY - box.top) / unit()];
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, at(event));
    if (held.size === 1) {
      start = at(event);
      way = grab?.(...start) ?? null;
    } else start = null;
    spread = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const place = at(event), before = held.get(event.pointerId);
    if (!before) return hover?.(...place);
    held.set(event.pointerId, place);
    if (held.size === 2) {
      const [[ax, ay], [bx, by]] = held.values(), size = Math.hypot(ax - bx, ay - by);
      if (spread) zoom?.(spread / size, (ax + bx) / 2, (ay + by) / 2);
      spread = size;
    } else {
      if (start && Math.hypot(place[0] - start[0], place[1] - start[1]) > 5) start = null;
      if (way) way(...place);
      else if (!start) move?.(place[0] - before[0], place[1] - before[1], ...place);
    }
  });
  const end = (/** @type {PointerEvent} */ event) => {
    if (!held.delete(event.pointerId)) return;
    if (way && event.type === "pointerup") drop?.(...at(event));
    if (start && event.type === "pointerup") click?.(...start);
    start = way = null;
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("pointerleave", () => hover?.(NaN, NaN));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const [x, y] = at(event);
    if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) move?.(-(event.deltaX || event.deltaY), 0, x, y);
    else if (event.ctrlKey || !canvas.dataset.scrolls) zoom?.(Math.exp(event.deltaY * 0.0015), x, y);
    else move?.(0, -event.deltaY, x, y);
  }, { passive: false });
}

// Ticks at round numbers.
/** @param {number} low @param {number} high @param {number} count */
function ticks(low, high, count) {
  const raw = (high - low) / Math.max(1, count), power = 10 ** Math.floor(Math.log10(raw));
  const step = power * ([1, 2, 5, 10].find((each) => each * power >= raw) ?? 10), found = [];
  for (let at = Math.ceil(low / step); at * step <= high && found.length < 200; at++) found.push(at * step);
  return { step, at: found };
}

// A number to six digits, or to as many as tell it from the next one, which is a step away; a whole one as it is.
/** @param {number} value @param {number} [step] */
function numberText(value, step) {
  if (Number.isInteger(value) && Math.abs(value) < 2 ** 24) return String(value); // what 32 bits hold
  const apart = step ? Math.floor(Math.log10(Math.abs(value))) - Math.floor(Math.log10(step)) + 1 : 0;
  const [digits, power] = value.toPrecision(Math.min(15, Math.max(6, apart))).split("e");
  return `${parseFloat(digits)}${power ? `e${power}` : ""}`;
}

/** @param {string} colour @param {number} share */
function faded(colour, share) {
  const number = parseInt(colour.slice(1), 16);
  return `rgba(${number >> 16}, ${(number >> 8) & 255}, ${number & 255}, ${share})`;
}
