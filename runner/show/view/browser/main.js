// The page of one run or of two.

async function main() {
  const holder = document.getElementById("data"), page = document.getElementById("page");
  readTheme();
  /** @type {Page} */
  let data;
  try {
    data = await readData(holder.textContent);
  } catch (error) {
    page.replaceChildren(element("p", { className: "note", text: `This browser cannot read the page's data (${error instanceof Error ? error.message : error}); it needs DecompressionStream, which browsers have had since 2023.` }));
    return;
  }
  holder.remove();
  const viewer = new Viewer(data), { state, views, details } = viewer;
  page.replaceChildren(...viewer.content);
  keys(state);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    readTheme();
    state.changed();
  });
  eachFrame((seconds) => viewer.advance(seconds));
  // For scripts, and for the tests of this page.
  window.epicycle = { state, views, details };
  page.dataset.ready = "yes";
}

main();
