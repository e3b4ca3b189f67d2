// Writes the licences of everything in the bundle beside it.
import { readFileSync, writeFileSync } from "node:fs";

const { packages } = JSON.parse(readFileSync("package-lock.json", "utf8"));
const texts = new Map(); // names by the text of their licence
for (const [path, about] of Object.entries(packages)) {
  if (!path || about.dev) continue;
  const text = readFileSync(`${path}/LICENSE`, "utf8").trim();
  const name = `${path.replace(/^.*node_modules\//, "")} ${about.version}`;
  texts.set(text, [...(texts.get(text) ?? []), name]);
}
const parts = [...texts].map(([text, names]) => `${names.join(", ")}:\n\n${text}\n`);
writeFileSync("../../runner/interface/studio/browser/codemirror.LICENSE", `codemirror.js holds\n\n${parts.join(`\n${"-".repeat(78)}\n\n`)}`);
