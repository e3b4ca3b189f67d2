"use strict";
// Interaction on the page of a report: tips under the pointer, and pictures that can be enlarged.
(() => {
  /** @typedef {{ x: number, y: number, text: string }} Dot */
  /** @typedef {HTMLElement & { at?: number }} Frame  with the number of the dot that keys have chosen */

  const tip = document.createElement("div");
  tip.className = "tip";
  tip.hidden = true;
  const stage = document.querySelector("dialog");
  /** @type {WeakMap<Frame, Dot[]>} */
  const known = new WeakMap();

  // Titles of shapes serve browsers without scripts; here the page shows them itself, and sooner.
  for (const title of document.querySelectorAll(".tips title")) {
    title.parentElement.dataset.text = title.textContent;
    title.remove();
  }

  /** @param {Frame} frame @returns {Dot[]} */
  function tipsOf(frame) {
    if (!known.has(frame)) {
      const dots = [...frame.querySelectorAll("circle")].map((dot) => ({
        x: +dot.getAttribute("cx"), y: +dot.getAttribute("cy"), text: dot.dataset.text || "",
      }));
      known.set(frame, dots.sort((one, other) => one.x - other.x));
    }
    return known.get(frame);
  }

  /** @param {Frame} frame @param {Dot} dot */
  function place(frame, dot) {
    const box = frame.getBoundingClientRect(), view = frame.querySelector("svg").viewBox.baseVal;
    return [box.left + (dot.x * box.width) / view.width, box.top + (dot.y * box.height) / view.height];
  }

  /** @param {Event} event @param {string} selector @returns {Frame | null} */
  function closest(event, selector) {
    return event.target instanceof Element ? event.target.closest(selector) : null;
  }

  function hide() {
    tip.hidden = true;
    for (const dot of document.querySelectorAll(".tips .at")) dot.remove();
  }

  /** @param {Frame} frame @param {Dot} dot */
  function show(frame, dot) {
    hide();
    const mark = document.createElementNS("http://www.w3.org/2000/svg", "circle");
    mark.setAttribute("cx", String(dot.x));
    mark.setAttribute("cy", String(dot.y));
    mark.setAttribute("r", "4");
    mark.classList.add("at");
    frame.querySelector("svg").append(mark);
    (frame.closest("dialog") || document.body).append(tip);
    tip.textContent = dot.text;
    tip.hidden = false;
    const [x, y] = place(frame, dot), width = tip.offsetWidth, height = tip.offsetHeight;
    tip.style.left = `${Math.max(4, Math.min(x - width / 2, innerWidth - width - 4))}px`;
    tip.style.top = `${y - height - 12 < 4 ? y + 14 : y - height - 12}px`;
  }

  /** @param {PointerEvent} event */
  function nearest(event) {
    const frame = closest(event, ".frame");
    if (!frame || !frame.querySelector("svg")) return hide();
    let best = null, least = event.pointerType === "mouse" ? 20 : 36;
    for (const dot of tipsOf(frame)) {
      const [x, y] = place(frame, dot), away = Math.hypot(x - event.clientX, y - event.clientY);
      if (away < least) [best, least] = [dot, away];
    }
    return best ? show(frame, best) : hide();
  }

  addEventListener("pointermove", nearest);
  addEventListener("pointerdown", nearest);
  addEventListener("scroll", hide, true);
  addEventListener("blur", hide, true);

  addEventListener("keydown", (event) => {
    /** @type {Frame | null} */
    const frame = document.activeElement && document.activeElement.closest(".frame");
    if (!frame || !["ArrowLeft", "ArrowRight", "Enter"].includes(event.key)) return;
    event.preventDefault();
    if (event.key === "Enter") return enlarge(frame);
    const dots = tipsOf(frame);
    if (!dots.length) return;
    const step = event.key === "ArrowRight" ? 1 : -1;
    frame.at = ((frame.at ?? (step > 0 ? -1 : 0)) + step + dots.length) % dots.length;
    show(frame, dots[frame.at]);
  });

  /** @param {Frame} frame */
  function enlarge(frame) {
    if (frame.closest("dialog")) return;
    hide();
    const copy = /** @type {Frame} */ (frame.cloneNode(true));
    stage.querySelector(".stage").replaceChildren(copy);
    stage.showModal();
    copy.focus();
  }

  addEventListener("click", (event) => {
    const button = closest(event, "button");
    if (button && button.classList.contains("enlarge")) enlarge(button.closest("figure").querySelector(".frame"));
    else if (event.target === stage || (button && button.classList.contains("close"))) stage.close();
  });
  addEventListener("dblclick", (event) => {
    const frame = closest(event, ".frame");
    if (frame) enlarge(frame);
  });
  stage.addEventListener("close", hide);
})();
