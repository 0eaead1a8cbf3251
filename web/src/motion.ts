// The motion that is shown: events as they are computed, states at any time, the drawing of the machine.

import type { Ink } from "./canvas";
import type { ElementData, MachineData, Start } from "./data";
import type { Pen } from "./svg";
import { END_EVENTS, END_FREE, END_IMPACTS, END_LONG, END_MISSING, END_WORDS, HEAD, isImpact, type Kernel, Refused } from "./kernel";

export interface Hit {
  time: number;
  contact: number;
  side: number;
  speed: number;
}

const AHEAD = 64; // events of a piece

/** A run that is computed as far as it is looked at, and some events further: a horizon would cut a flight, and with it
 * the last bits of what follows. */
export class Motion {
  readonly period: number;
  ended = "";
  private without = ""; // why no contact comes after the last event
  hits: Hit[] = [];
  private times: number[] = [0];
  private modes: number[] = [];
  private states: Float64Array[] = [];
  private reached = 0;

  constructor(private readonly kernel: Kernel, machine: MachineData, values: Record<string, number>, start: Start) {
    kernel.compile(machine, values, start);
    if (!kernel.begin(start)) throw new Missing(kernel.missing);
    this.period = kernel.period;
    this.modes.push(kernel.startMode);
    this.states.push(kernel.state());
  }

  /** Compute up to a time. */
  until(t: number): void {
    const n = this.kernel.degrees;
    while (this.reached < t && !this.ended) {
      const e = this.kernel.record(Infinity, 1 << 20, AHEAD);
      for (let i = 0; i < e.count; ++i) {
        const row = e.rows.subarray(i * e.width, (i + 1) * e.width);
        const time = row[4] + row[5];
        if (isImpact(row[0])) this.hits.push({ time, contact: row[1], side: row[2], speed: -row[6] });
        this.times.push(time);
        this.modes.push(row[3]);
        this.states.push(row.slice(HEAD + 3 * n));
        this.reached = time;
      }
      if (e.end === END_FREE || e.end === END_LONG) [this.without, this.reached] = [END_WORDS[e.end], Infinity];
      else if (e.end === END_MISSING) throw new Missing(this.kernel.missing);
      else if (e.end !== END_EVENTS && e.end !== END_IMPACTS) this.ended = END_WORDS[e.end] ?? "the run ended";
    }
    this.forget(t - 12 * this.period);
  }

  get end(): number {
    return this.reached;
  }
  /** Why no contact comes after a time; nothing where one does. */
  silent(t: number): string {
    return t >= this.times.at(-1)! ? this.without : "";
  }

  /** Mode and state, positions then velocities, at a time that is computed. */
  at(t: number): { mode: number; xv: Float64Array } {
    let low = 0, high = this.times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= t) low = middle;
      else high = middle - 1;
    }
    const xv = this.kernel.evaluate(this.modes[low], this.states[low], Math.max(0, t - this.times[low]));
    return { mode: this.modes[low], xv: xv.slice() };
  }

  private forget(t: number): void {
    const first = this.times.findIndex((x) => x >= t);
    if (first > 4000) {
      this.times.splice(0, first - 1);
      this.modes.splice(0, first - 1);
      this.states.splice(0, first - 1);
    }
    if (this.hits.length > 4000) this.hits.splice(0, this.hits.length - 2000);
  }
}

export class Missing extends Refused {
  constructor(readonly code: number) {
    super("The motion needs a mode of the machine that this page was not given.");
  }
}

/** State of every element in a mode, by its code (compile/piecewise.py). */
export function statesOf(code: number, contacts: number, elements: number): number[] {
  const digits = Array.from({ length: contacts }, (_, i) => Math.floor(code / 3 ** i) % 3);
  const rest = Math.floor(code / 3 ** contacts);
  return [...digits, ...Array.from({ length: elements }, (_, i) => Math.floor(rest / 7 ** i) % 7)];
}

interface Look {
  machine: MachineData;
  kernel: Kernel;
  motion: Motion;
  time: number;
  phase: number; // of the first line, at the start
  scale: { size: number };
  ink: Ink;
}

const WALL = 26;

/** Draw the machine as it stands: a lane for every coordinate, and one for every row of other form. */
export function drawMachine(c: Pen, width: number, height: number, look: Look): void {
  const { machine, kernel, motion, ink, time } = look, n = kernel.degrees;
  const { mode, xv } = motion.at(time), x = xv.subarray(0, n);
  const parts = kernel.parts, withRow = machine.elements.filter((e) => e.row.length);
  const rigid = machine.elements.filter((e) => e.rigid).length;
  const states = statesOf(kernel.codes[mode], rigid, machine.elements.length - rigid);
  const omegas = kernel.omegas;
  const odd = withRow.filter((e) => !placeOf(e));
  const lanes = n + odd.length, lane = (height - 8) / lanes, box = Math.min(30, lane * 0.34), half = Math.min(34, width * 0.05);

  // one scale for all: what moves and where stops are, slowly followed
  let size = 1e-300;
  for (const value of x) size = Math.max(size, Math.abs(value));
  parts.forEach((p, k) => {
    const from = placeOf(withRow[k])?.from ?? null, base = from === null ? 0 : Math.abs(x[from]);
    for (const limit of [p[n], p[n + 1]]) if (Number.isFinite(limit)) size = Math.max(size, base + Math.abs(limit));
  });
  look.scale.size = size > look.scale.size ? size : Math.max(size, look.scale.size * 0.995);
  const unit = (width / 2 - WALL - 2.2 * half) / look.scale.size, middle = width / 2;
  const X = (value: number): number => middle + unit * value;
  const Y = (i: number): number => 4 + lane * (i + 0.5);

  c.clearRect(0, 0, width, height);
  c.lineWidth = 1.4;
  c.font = "12px system-ui, sans-serif";
  c.textAlign = "center";
  c.textBaseline = "middle";

  // guide lines, and the ground
  c.strokeStyle = ink.line;
  for (let i = 0; i < lanes; ++i) line(c, WALL, Y(i) + box + 2, width - WALL, Y(i) + box + 2);
  for (const [kind, i, j] of machine.links) {
    c.strokeStyle = ink.soft;
    const y = Y(i) + (kind === "spring" ? -0.45 : 0.45) * box;
    if (j < 0) {
      hatch(c, WALL - 14, Y(i) - box, 14, 2 * box, ink.soft);
      (kind === "spring" ? spring : dashpot)(c, WALL, y, X(x[i]) - half, y);
    } else (kind === "spring" ? spring : dashpot)(c, X(x[i]) + (kind === "spring" ? -8 : 8), Y(i) + box, X(x[j]) + (kind === "spring" ? -8 : 8), Y(j) - box);
  }

  // bodies
  for (let i = 0; i < n; ++i) {
    c.fillStyle = ink.body;
    c.strokeStyle = ink.ink;
    rounded(c, X(x[i]) - half, Y(i) - box, 2 * half, 2 * box);
    c.fillStyle = ink.ink;
    c.fillText(`x${i + 1}`, X(x[i]), Y(i));
  }

  // elements
  let k = -1, extra = n;
  machine.elements.forEach((e, number) => {
    if (!e.row.length) return;
    ++k;
    const p = parts[k], state = states[number] ?? 0;
    const moved = e.motion.reduce((sum, [l, s, cosine]) => {
      const theta = (look.phase * omegas[l]) / omegas[0] + omegas[l] * time;
      return sum + s * Math.sin(theta) + cosine * Math.cos(theta);
    }, 0);
    const place = placeOf(e);
    let on: number, base: number, sign = 1, reach = half;
    if (place) {
      on = place.on;
      base = place.from === null ? moved : x[place.from] + moved;
      sign = place.sign;
    } else { // a lane of its own: a mark at row . x
      on = extra++;
      base = moved;
      reach = 5;
      const u = e.row.reduce((sum, r, i) => sum + r * x[i], 0);
      c.fillStyle = ink.ink;
      c.beginPath();
      c.arc(X(u), Y(on), 5, 0, 7);
      c.fill();
      c.textAlign = "left";
      c.fillText(e.row.map((r, i) => (r ? `${r < 0 ? "−" : "+"}${Math.abs(r) === 1 ? "" : Math.abs(r).toPrecision(3)}x${i + 1}` : "")).join(""), WALL, Y(on) - box);
      c.textAlign = "center";
    }
    if (!e.stop) { // friction: a pad that shows whether it sticks
      const sticks = (e.states[state] ?? "").includes("stick");
      hatch(c, X(x[Math.min(on, n - 1)]) - half, Y(on) + box - 1, 2 * half, 7, sticks ? ink.b : ink.soft);
      return;
    }
    for (const side of [1, -1]) {
      const limit = side > 0 ? p[n + 1] : p[n];
      if (!Number.isFinite(limit)) continue;
      const to = side * sign, at = X(base + sign * limit) + to * reach;
      const pressed = state !== 0 && (state % 2 === 1) === side > 0;
      const hit = strongest(motion, time, number, side, motion.period);
      const colour = side > 0 ? ink.a : ink.b;
      if (hit > 0) {
        c.globalAlpha = 0.75 * hit;
        c.fillStyle = ink.flash;
        c.beginPath();
        c.arc(at, Y(on), box * (0.5 + 0.9 * hit), 0, 7);
        c.fill();
        c.globalAlpha = 1;
      }
      c.strokeStyle = colour;
      c.lineWidth = pressed ? 6 : 3;
      line(c, at, Y(on) - box, at, Y(on) + box);
      c.lineWidth = 1.4;
      if (place && place.from !== null) { // an arm of the body that carries the stop
        const from = Y(place.from) + Math.sign(on - place.from) * box, near = Y(on) + Math.sign(place.from - on) * (box + 4);
        const edge = X(x[place.from]) + to * half;
        c.beginPath();
        c.moveTo(edge, from - Math.sign(on - place.from) * box * 0.5);
        c.lineTo(at, from - Math.sign(on - place.from) * box * 0.5);
        c.lineTo(at, near);
        c.lineTo(at, Y(on));
        c.stroke();
      } else if (e.rigid) hatch(c, to > 0 ? at : at - 9, Y(on) - box, 9, 2 * box, colour);
      else spring(c, at, Y(on), at + to * 26, Y(on), colour);
    }
  });
}

/** How brightly a stop flashes: 1 at an impact of usual strength, fading within a fifth of a period. */
function strongest(motion: Motion, time: number, contact: number, side: number, period: number): number {
  let usual = 1e-300, found = 0;
  for (let i = motion.hits.length - 1; i >= 0; --i) {
    const hit = motion.hits[i];
    if (hit.time < time - 6 * period) break;
    if (hit.time > time) continue;
    usual = Math.max(usual, hit.speed);
    const age = (time - hit.time) / (0.22 * period);
    if (hit.contact === contact && hit.side === side && age < 1) found = Math.max(found, (1 - age) * Math.sqrt(Math.max(0, hit.speed)));
  }
  return Math.min(1, found / Math.sqrt(usual));
}

/** On which coordinate an element of one coordinate, or of the difference of two, is drawn, and what carries it. */
function placeOf(e: ElementData): { on: number; from: number | null; sign: number } | null {
  const where = e.row.flatMap((r, i) => (r ? [i] : []));
  if (where.length === 1 && Math.abs(e.row[where[0]]) === 1) return { on: where[0], from: null, sign: e.row[where[0]] };
  if (where.length === 2 && e.row[where[0]] === -e.row[where[1]] && Math.abs(e.row[where[0]]) === 1)
    return { on: where[1], from: where[0], sign: e.row[where[1]] };
  return null;
}

function line(c: Pen, x0: number, y0: number, x1: number, y1: number): void {
  c.beginPath();
  c.moveTo(x0, y0);
  c.lineTo(x1, y1);
  c.stroke();
}
function rounded(c: Pen, x: number, y: number, w: number, h: number): void {
  c.beginPath();
  c.roundRect(x, y, w, h, 5);
  c.fill();
  c.stroke();
}
function along(c: Pen, x0: number, y0: number, x1: number, y1: number, draw: (length: number) => void): void {
  c.save();
  c.translate(x0, y0);
  c.rotate(Math.atan2(y1 - y0, x1 - x0));
  draw(Math.hypot(x1 - x0, y1 - y0));
  c.restore();
}
function spring(c: Pen, x0: number, y0: number, x1: number, y1: number, colour?: string): void {
  if (colour) c.strokeStyle = colour;
  along(c, x0, y0, x1, y1, (length) => {
    const ends = Math.min(8, 0.2 * length), turns = 2 * Math.round(Math.max(7, length / 18) / 2) + 1, pitch = (length - 2 * ends) / turns;
    c.beginPath();
    c.moveTo(0, 0);
    c.lineTo(ends, 0);
    for (let i = 0; i < turns; ++i) c.lineTo(ends + (i + 0.5) * pitch, i % 2 ? 5 : -5);
    c.lineTo(length - ends, 0);
    c.lineTo(length, 0);
    c.stroke();
  });
}
function dashpot(c: Pen, x0: number, y0: number, x1: number, y1: number): void {
  along(c, x0, y0, x1, y1, (length) => {
    const at = 0.5 * length;
    line(c, 0, 0, at - 4, 0);
    line(c, at - 4, -4, at - 4, 4);
    c.beginPath();
    c.moveTo(at - 12, -6);
    c.lineTo(at + 6, -6);
    c.lineTo(at + 6, 6);
    c.lineTo(at - 12, 6);
    c.stroke();
    line(c, at + 6, 0, length, 0);
  });
}
function hatch(c: Pen, x: number, y: number, w: number, h: number, colour: string): void {
  c.save();
  c.beginPath();
  c.rect(x, y, w, h);
  c.clip();
  c.strokeStyle = colour;
  c.lineWidth = 1;
  for (let s = x - h; s < x + w; s += 6) line(c, s, y + h, s + h, y);
  c.restore();
}
