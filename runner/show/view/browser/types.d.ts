// What the parts of the page share: the data that page.py and drawing.py write, and shapes that several parts use.
// For `tsc --checkJs` in `make lint` alone; no page has it.

type Path = string; // of a place or port of the model, dotted
type Rect = [left: number, top: number, width: number, height: number];
type Dot = [x: number, y: number];
type Numbers = Uint8Array | Int32Array | Float32Array | Float64Array;
type Column = [kind: "b" | "d" | "f" | "i", start: number, count: number];
type Paper = CanvasRenderingContext2D;

interface Port {
  place: number;
  name: string;
  multi: boolean;
  leads: number[]; // the actors that receive its tokens
}

interface Lane {
  name: Path;
  times: Float64Array; // s
  values: Float32Array | Float64Array;
  states: string[] | null;
  line: boolean;
  asked?: boolean;
  left_out: number;
}

interface Mark {
  name: Path;
  port: Path;
  shape: "body" | "goal" | "ellipse" | "tube" | "line";
  times: Float64Array; // s
  rows: Float32Array | Float64Array;
  width: number; // of a row
  interval: number; // s, usual
  radius: number; // m
  colour: number | null;
}

interface Box {
  path: Path;
  name: string;
  kind: string;
  doc: string;
  at: Rect;
  level: number;
  composite: boolean;
  director: boolean;
  count: number;
  members: Path[]; // of a box that is no array, if it stands for several
  ports: [path: Path, name: string, side: "left" | "right", x: number, y: number, isMulti: boolean][];
}

interface Wire {
  source: Path;
  targets: Path[];
  heads: Dot[];
  lines: number[][];
  level: number;
  scope?: Path;
  tree?: Map<string, number[][]>;
}

interface Placed {
  path: Path;
  side: "left" | "right";
  x: number;
  y: number;
  box: Box;
}

type Badge = [words: string, aspect: string, x: number, y: number, width: number, place: Path];

interface ModelDrawing {
  note: string;
  width: number;
  height: number;
  boxes: Box[];
  wires: Wire[];
  badges: Badge[];
}

interface Monitor {
  name: string;
  property: string;
  holds: boolean;
  text: string;
  time: number | null; // ns
}

// A run as it is written, without what is packed.
interface RunHead {
  name: string;
  model: string;
  doc: string;
  seed: string;
  end: number; // ns
  stopped: string;
  digest: string;
  settings: string[];
  metrics: [name: string, value: string, unit: string, doc: string, number: number | null][];
  monitors: Monitor[];
  firings: number;
  records: number;
  gaps: [firing: number, left: number][];
  places: Path[];
  ports: Port[];
  events: string[];
  aspects: Path[];
  lanes_left_out: number;
  drawing: ModelDrawing;
}

interface PackedRun extends RunHead {
  columns: { [name: string]: Column };
  tags: [Column, Column];
  texts: [Column, Column];
  lanes: (Omit<Lane, "times" | "values"> & { times: Column; values: Column })[];
  marks: (Omit<Mark, "times" | "rows"> & { times: Column; rows: Column })[];
}

interface Run extends RunHead {
  firing_tag: Int32Array;
  firing_actor: Int32Array;
  firing_outside: Int32Array;
  record_tag: Int32Array;
  record_firing: Int32Array;
  record_port: Int32Array;
  record_channel: Int32Array;
  record_event: Int32Array;
  record_aspect: Int32Array;
  record_text: Int32Array;
  record_about: Int32Array;
  arrival_firing: Int32Array;
  arrival_port: Int32Array;
  arrival_channel: Int32Array;
  arrival_record: Int32Array;
  wake_firing: Int32Array;
  wake_tag: Int32Array;
  firstChange: number; // the first firing that is another one in the other run; set by main, as is the tag
  tagOfDifference: number | undefined;
}

interface Difference {
  [name: string]: any;
}

interface Page {
  palette: string[];
  runs: Run[];
  story: string[];
  difference: Difference | null;
  comparison: string[][];
}

interface Chosen {
  run: number;
  firing: number;
  record: number;
}

interface Cause {
  firing: number;
  kind: "token" | "wake" | "kept" | "lost";
  record: number;
}

interface Camera {
  scale: number;
  x: number;
  y: number;
}

interface TextStyle {
  colour?: string;
  size?: number; // px
  align?: CanvasTextAlign;
  bold?: boolean;
  width?: number; // px, beyond which it is cut
  hasEnd?: boolean; // of a path, whose end says more than its start: that is what stays when it is cut
  isApart?: boolean; // from what is below it
}

interface Route {
  points: number[];
  lengths: number[];
}

// What a drag, a wheel or a pinch does; a drag that `grab` takes goes to the function it returns.
interface Gestures {
  move?(dx: number, dy: number, x: number, y: number): void;
  zoom?(factor: number, x: number, y: number): void;
  click?(x: number, y: number): void;
  grab?(x: number, y: number): ((x: number, y: number) => void) | null | undefined;
  drop?(x: number, y: number): void;
  hover?(x: number, y: number): void;
}

// What subclasses of View have, and what the studio gives a graph.
interface View {
  draw(paper: Paper): void;
  resized?(): void;
}
interface Graph extends Gestures {
  coned: { cone: Cone; scale: number; back: Set<Box | null>; ahead: Set<Box | null> } | null;
  shutNow: { scale: number; boxes: Rect[] } | null;
}
interface Chart {
  known: { run: Run; actors: number[]; wanted?: Set<number> | null; shown?: number[]; at?: Map<number, number> };
}
interface Timeline {
  tall?: number; // px of all that can be scrolled to
}

interface Window {
  epicycle: any; // for tests
}
