// The kernel in WebAssembly: web/kernel/page.cpp. No formula of mechanics is written here.

import { type MachineData, PACE, type Recording, type Start } from "./data";

interface Exports {
  memory: WebAssembly.Memory;
  _initialize(): void;
  reserve(bytes: number): number;
  repeat(recording: number, inputs: number): number;
  pace_of(r: number, x: number, v: number, run: number, slowest: number, fastest: number): number;
  build(recording: number): void;
  begin(x: number, v: number, phases: number): number;
  record(tMax: number, flight: number, events: number, impacts: number, out: number): number;
  section(contact: number, side: number, room: number, tMax: number, events: number, out: number): number;
  symbol(settle: number, observe: number, impacts: number, tolerance: number, returns: number, phase: number, out: number): number;
  evaluate(mode: number, y: number, dt: number, out: number): void;
  state(out: number): void;
  step_of(): number;
  reason(): number;
  missing(): number;
}

// Ends of runs: RunEnd of simulation/simulate.py.
export const END_IMPACTS = 0, END_FREE = 2, END_MISSING = 5, END_EVENTS = 6, END_OBSERVER = 7, END_LONG = 12;
export const END_WORDS: Record<number, string> = {
  2: "no contact will come any more: this is proved",
  3: "the next event could not be decided at double precision",
  4: "time does not advance: more than 4096 events at one instant",
  5: "a mode is needed that this page was not given",
  9: "the motion diverged",
  10: "one flight took more steps of the search than are allowed",
  12: "no contact in a long flight",
};
// Kinds of events: Status of simulation/simulate.py.
const IMPACT = 0, CHATTER = 2, SIMULTANEOUS = 5, ENGAGE = 13;
const COUNTED = new Set([IMPACT, SIMULTANEOUS, CHATTER, ENGAGE]);
export const isImpact = (status: number): boolean => COUNTED.has(status);

export const HEAD = 9; // numbers of a row before the states: see `head` in page.cpp
const ROOM = 1 << 19; // numbers of the table of results
export const UNFORCED = 60; // time that is a period without forcing
const LONG_PERIODS = 10000, LONG_STEPS = 100000; // simulation/simulate.py
const SLOWEST = 2.0 ** -108, FASTEST = 2.0 ** 108; // compile/modes.py

export interface Events {
  count: number;
  width: number; // numbers of a row
  rows: Float64Array;
  end: number;
}

interface Loaded {
  recording: Recording;
  at: number; // address of its table
  inputs: number;
}

export class Refused extends Error {}

export class Kernel {
  private readonly wasm: Exports;
  private readonly out: number;
  private readonly scratch: number;
  private loaded = new Map<Recording, Loaded>();
  private current: Loaded | null = null;
  private machine: MachineData | null = null;
  private phase = 0;
  private first = 0; // the recording that served last

  constructor(instance: WebAssembly.Instance) {
    this.wasm = instance.exports as unknown as Exports;
    this.wasm._initialize();
    this.out = this.wasm.reserve(8 * ROOM);
    this.scratch = this.wasm.reserve(8 * 512);
  }

  static async of(code: BufferSource): Promise<Kernel> {
    const { instance } = await WebAssembly.instantiate(code, {});
    return new Kernel(instance);
  }

  get degrees(): number {
    return this.current!.recording.degrees;
  }
  get size(): number {
    const r = this.current!.recording;
    return 2 * (r.degrees + r.lines);
  }
  get codes(): number[] {
    return this.current!.recording.codes;
  }

  /** Compile the machine with these parameters, for runs of some length from a start. */
  compile(machine: MachineData, values: Record<string, number>, start: Start, run = Infinity): void {
    if (this.machine !== machine) {
      this.machine = machine;
      this.first = 0;
    }
    const plain = this.fitting(values, 0);
    const pace = this.paceOf(plain, start, run);
    const used = pace > 0 ? this.fitting(values, pace) : plain;
    this.wasm.build(used.at);
    this.current = used;
  }

  /** The first recording whose conditions hold, repeated. */
  private fitting(values: Record<string, number>, pace: number): Loaded {
    const all = this.machine!.recordings;
    for (let k = 0; k < all.length; ++k) {
      const i = (this.first + k) % all.length;
      const recording = all[i];
      if (recording.inputs.includes(PACE) !== pace > 0) continue;
      const one = this.load(recording);
      const f = this.floats(one.inputs, recording.inputs.length);
      recording.inputs.forEach((name, j) => (f[j] = name === PACE ? pace : values[name]));
      if (this.wasm.repeat(one.at, one.inputs) < 0) {
        if (pace === 0) this.first = i;
        return one;
      }
    }
    throw new Refused(
      pace > 0
        ? "The motion is much faster than the machine, and this page has no compilation for that."
        : "The machine refuses these values, or they need a compilation that this page was not given.",
    );
  }

  private paceOf(one: Loaded, start: Start, run: number): number {
    const x = this.put(start.x, 0), v = this.put(start.v, 64);
    return this.wasm.pace_of(one.at, x, v, run, SLOWEST, FASTEST);
  }

  /** Begin at a start. False where a mode is missing. */
  begin(start: Start): boolean {
    const x = this.put(start.x, 0), v = this.put(start.v, 64);
    const omegas = this.omegas;
    const phases = this.put(Array.from(omegas, (omega) => start.phase * (omega / omegas[0])), 128);
    this.phase = start.phase;
    const mode = this.wasm.begin(x, v, phases);
    if (mode === -1) throw new Refused("The start lies behind a stop.");
    this.startMode = mode;
    return mode >= 0;
  }
  startMode = 0;

  /** Angular frequencies of the forcing lines. */
  get omegas(): Float64Array {
    const r = this.current!.recording;
    return this.floats(this.numbersOf(this.current!) + 8 * (2 + r.parts * (r.degrees + 5)), r.lines).slice();
  }

  /** That of the first line, 0 without forcing. */
  get omega(): number {
    return this.omegas[0] ?? 0;
  }

  /** Time of a forcing period; without forcing a hundred steps or so of the motion. */
  get period(): number {
    const omega = this.omega;
    return omega ? (2 * Math.PI) / omega : UNFORCED;
  }

  /** Row, lower and upper limit, ..., speed of the belt of every element with a row: compile/pace.py. */
  get parts(): number[][] {
    const r = this.current!.recording, width = r.degrees + 5;
    const f = this.floats(this.numbersOf(this.current!) + 16, r.parts * width);
    return Array.from({ length: r.parts }, (_, i) => [...f.slice(i * width, (i + 1) * width)]);
  }

  /** Go on, and return the events. Their rows are a copy. */
  record(tMax: number, impacts: number, most = 1 << 20): Events {
    const width = HEAD + 3 * this.degrees + this.size;
    const room = Math.min(most, Math.floor(ROOM / width));
    const omega = this.omega;
    const flight = omega ? (LONG_PERIODS * 2.0 * Math.PI) / omega : LONG_STEPS * this.wasm.step_of();
    const count = this.wasm.record(tMax, flight, room, impacts, this.out);
    return { count, width, rows: this.floats(this.out, count * width).slice(), end: this.wasm.reason() };
  }

  /** States after impacts at a contact: rows of phase, impact speed, x, v. */
  section(contact: number, side: number, most: number, events: number): { rows: Float64Array; width: number; count: number; end: number } {
    const width = 2 + 2 * this.degrees;
    const room = Math.min(most, Math.floor(ROOM / width));
    const count = this.wasm.section(contact, side, room, Infinity, events, this.out);
    return { rows: this.floats(this.out, count * width).slice(), width, count, end: this.wasm.reason() };
  }

  /** Let time go on without a record. */
  settle(until: number): number {
    const width = HEAD + 3 * this.degrees + this.size, room = Math.floor(ROOM / width);
    do this.wasm.section(-2, 0, 1, until, room, this.out);
    while (this.wasm.reason() === END_EVENTS || this.wasm.reason() === END_IMPACTS);
    return this.wasm.reason();
  }

  /** Impacts, n, p and q of the motion: the observer `symbol` of sweeps. */
  symbol(settle: number, observe: number, tolerance: number, returns: number): { impacts: number; n: number; p: number[]; q: number[]; end: number } {
    const r = this.current!.recording, stops = r.contacts + r.elements;
    const end = this.wasm.symbol(settle, observe, 1 << 20, tolerance, returns, this.phase, this.out);
    const f = this.floats(this.out, 2 + 2 * stops);
    return { impacts: f[0], n: f[1], p: [...f.slice(2, 2 + stops)], q: [...f.slice(2 + stops)], end };
  }

  /** What so many impacts have in common, with whichever of a period they begin: means of the states after them and
   * their sizes, in groups of positions, velocities, and sine and cosine of the phase. */
  footprint(impacts: number): number[][] {
    const n = this.degrees, sums = [new Array<number>(n).fill(0), new Array<number>(n).fill(0), [0, 0]], sizes = [0, 0, 1];
    for (let left = impacts; left > 0; ) {
      const e = this.record(Infinity, left);
      for (let i = 0; i < e.count; ++i) {
        const row = e.rows.subarray(i * e.width, (i + 1) * e.width);
        if (!isImpact(row[0])) continue;
        --left;
        const after = [row.subarray(HEAD, HEAD + n), row.subarray(HEAD + 2 * n, HEAD + 3 * n), [Math.sin(row[8]), Math.cos(row[8])]];
        after.forEach((group, g) =>
          group.forEach((x, k) => {
            sums[g][k] += x / impacts;
            sizes[g] = Math.max(sizes[g], Math.abs(x));
          }),
        );
      }
      if (e.end !== END_EVENTS) break;
    }
    return sums.map((sum, g) => [...sum, sizes[g]]);
  }

  /** Positions, then velocities, a time after a state of a mode. */
  evaluate(mode: number, y: ArrayLike<number>, dt: number): Float64Array {
    this.wasm.evaluate(mode, this.put(y, 0), dt, this.out);
    return this.floats(this.out, 2 * this.degrees);
  }

  /** The coordinates of the present state. */
  state(): Float64Array {
    this.wasm.state(this.out);
    return this.floats(this.out, this.size).slice();
  }
  get missing(): number {
    return this.wasm.missing();
  }

  // ---- memory ----------------------------------------------------------------------------------

  private floats(at: number, count: number): Float64Array {
    return new Float64Array(this.wasm.memory.buffer, at, count);
  }
  private put(values: ArrayLike<number>, offset: number): number {
    const at = this.scratch + 8 * offset;
    this.floats(at, values.length).set(values);
    return at;
  }
  private keep(values: ArrayLike<number>): number {
    const at = this.wasm.reserve(4 * Math.max(1, values.length));
    new Int32Array(this.wasm.memory.buffer, at, values.length).set(values);
    return at;
  }
  private keepFloats(values: ArrayLike<number>, room = values.length): number {
    const at = this.wasm.reserve(8 * Math.max(1, room));
    this.floats(at, values.length).set(values);
    return at;
  }
  private numbersOf(one: Loaded): number {
    return new Int32Array(this.wasm.memory.buffer, one.at, 12)[11];
  }

  private load(r: Recording): Loaded {
    const known = this.loaded.get(r);
    if (known) return known;
    const entries = this.keepFloats([...r.inputs.map(() => 0), ...r.constants], r.inputs.length + r.constants.length + r.code.length);
    const table = [
      r.inputs.length, r.constants.length, r.code.length, r.conditions.length, r.patches.length / 2,
      entries, this.keep(r.code.flat()), this.keep(r.lists), this.keepFloats([], r.tables), this.keep(r.conditions.flat()), this.keep(r.patches),
      this.keepFloats(r.numbers),
      +r.dense, +r.mixed, +r.piecewise, +r.sequential, r.degrees, r.lines, r.contacts, r.elements,
      r.resets, r.parts, r.codes.length,
      this.keep(r.codes), this.keep(r.side), this.keep(r.states), this.keep(r.soft), this.keep(r.joint),
      this.keep(r.watch_counts), this.keep(r.watch_element), this.keep(r.watch_held), this.keep(r.watch_reset),
    ];
    const one = { recording: r, at: this.keep(table), inputs: this.keepFloats(r.inputs.map(() => 0)) };
    this.loaded.set(r, one);
    return one;
  }
}
