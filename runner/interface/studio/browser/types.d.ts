// What the parts of the studio share: questions and answers, some of them the Language Server Protocol's.
// For `tsc --checkJs` in `make lint` alone; no page has it.

interface Place {
  line: number;
  character: number;
}

interface Range {
  start: Place;
  end: Place;
}

interface TextEdit {
  range: Range;
  newText: string;
}

interface Diagnostic {
  range: Range;
  severity: 1 | 2; // an error, a warning
  code: string;
  message: string;
  relatedInformation?: unknown[]; // it is about another file
  data?: TextEdit; // the change that removes it
}

interface CompletionItem {
  label: string;
  kind: number;
  detail?: string;
  documentation?: string;
  textEdit: TextEdit;
}

interface Question {
  ask: string;
  text: string;
  [given: string]: any;
}

// What is set at one place of the text: a parameter, with its bounds.
interface Field {
  name: string;
  said: string; // in the text; empty if it has its default
  value: string;
  kind: "text" | "choice" | "switch";
  unit?: string;
  choices?: string[];
  doc?: string;
  low?: number | null;
  high?: number | null;
  whole?: boolean;
  number?: number | null;
  computed?: boolean;
}

interface Aspect {
  name: string;
  type: string;
  at: string;
  on: boolean;
  fields: Field[];
}

interface KnownType {
  name: string;
  doc: string;
  needs: { [parameter: string]: string };
}

interface Metric extends Array<string | number | null> {
  0: string; // its name
  1: string; // its value, in words
  2: string; // its unit
  3: string; // what it is
  4: number | null;
}

interface RunAnswer {
  digest: string;
  stopped: string;
  seconds: number;
  failed: string;
  ended: string;
  view: any;
}

// What is chosen in the graph: a part, a wire with the ends that can be disconnected, or an aspect.
interface Selected {
  path?: Path;
  kind?: string;
  doc?: string;
  composite?: boolean;
  wire?: Wire;
  ends?: [source: Path, target: Path][];
  aspect?: string;
}

type Write = (what: string, ...given: any[]) => Promise<boolean>;

interface Window {
  CodeMirror: any;
}
