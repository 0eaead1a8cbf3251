// What Python says of a machine: src/vibroimpact/explorer/page_data.py writes it.

export interface Recording {
  inputs: string[];
  constants: number[];
  code: number[][];
  lists: number[];
  tables: number;
  conditions: number[][];
  patches: number[];
  numbers: number[];
  dense: boolean;
  mixed: boolean;
  piecewise: boolean;
  sequential: boolean;
  degrees: number;
  lines: number;
  contacts: number;
  elements: number;
  resets: number;
  parts: number;
  codes: number[];
  side: number[];
  states: number[];
  soft: number[];
  joint: number[];
  watch_counts: number[];
  watch_element: number[];
  watch_held: number[];
  watch_reset: number[];
}

export interface Parameter {
  name: string;
  value: number;
  about: string;
  unit: string;
  check: string; // "real", "positive", "nonnegative" or "fraction"
}

export interface ElementData {
  label: string;
  rigid: boolean;
  stop: boolean;
  row: number[];
  states: Record<string, string>;
  motion: number[][]; // number of the forcing line, amplitudes of sine and cosine
}

export interface MachineData {
  name: string;
  title: string;
  python: string;
  si: boolean;
  parameters: Parameter[];
  fixed: Record<string, unknown>;
  cases: Record<string, Record<string, number>>;
  start: Start;
  elements: ElementData[];
  links: [string, number, number][];
  recordings: Recording[];
}

export interface Start {
  x: number[];
  v: number[];
  phase: number;
}

/** A coordinate of a start: "x1", ..., "v1", ..., "phase". */
export function coordinateOf(start: Start, name: string): number {
  return name === "phase" ? start.phase : start[name[0] as "x" | "v"][Number(name.slice(1)) - 1];
}

/** A start in which coordinates are changed. */
export function withCoordinates(start: Start, at: Record<string, number>): Start {
  const changed = { x: [...start.x], v: [...start.v], phase: start.phase };
  for (const [name, x] of Object.entries(at))
    if (name === "phase") changed.phase = x;
    else changed[name[0] as "x" | "v"][Number(name.slice(1)) - 1] = x;
  return changed;
}

export const PACE = "pace";

export interface Machines {
  chosen: string;
  operands: number[];
  machines: Record<string, MachineData>;
  others: Record<string, string>;
}

const PLAIN = new Set([26, 27]); // operations whose operands are no entries: decouple, taken

/** Recordings as the kernel takes them, from the text of page_data.py. */
export function unpacked(r: Recording, operands: number[]): Recording {
  const flat = r.code as unknown as number[], code: number[][] = [];
  let at = r.inputs.length + r.constants.length;
  for (let i = 0; i < flat.length; ++at) {
    const name = flat[i++], row = [name, 0, 0, 0];
    for (let k = 1; k <= operands[name]; ++k, ++i) row[k] = PLAIN.has(name) ? flat[i] : at - flat[i];
    code.push(row);
  }
  const half = r.patches.length / 2, patches: number[] = [];
  for (let i = 0, place = 0, entry = 0; i < half; ++i)
    patches.push((place += r.patches[i]), (entry += r.patches[half + i]));
  return { ...r, code, patches };
}

export function machinesOf(text: string): Machines {
  const packed = JSON.parse(text) as Machines;
  for (const machine of Object.values(packed.machines))
    machine.recordings = machine.recordings.map((r) => unpacked(r, packed.operands));
  return packed;
}
