// The section: states after impacts at a stop, millions of them, in a view that zooms and moves.

import { BOTTOM, frameOf, ink, LEFT, paint, RIGHT, TOP } from "./canvas";
import type { Crew } from "./crew";
import { Density } from "./density";
import { $, chosen } from "./dom";

const MOST_POINTS = 4000000, MOST_BYTES = 128e6; // of the graphics processor
const BEGINS = 50; // points that show how the motion begins: the view of all is of those after them
const KEPT = 100000; // points of the table, the latest
const LOOKED_AT = 10000; // of the latest points: whether they fall on few pixels, and what is drawn without WebGL
const FEW = 1000; // pixels with points below which each is drawn larger
const PAUSE = 120; // milliseconds between pictures while the section grows
const FINEST = 1e-4; // of the largest number, a range that is still drawn: numbers of the graphics processor have 24 bits

type Range = [x0: number, x1: number, y0: number, y1: number];
const NONE: Range = [0, 0, 0, 0];

export class Section {
  private parts: Float64Array[] = []; // the latest points
  private width = 0;
  private total = 0;
  private rate = 0;
  private low: number[] = []; // of every column
  private high: number[] = [];
  private all = NONE;
  private zoomed: Range | null = null;
  private dirty = false;
  private drawnAt = 0;
  private density = Density.of(() => this.lost());

  constructor(private readonly crew: Crew) {
    this.listen();
  }

  /** Contact and side that are chosen; null where the machine has no stop. */
  get stop(): [number, number] | null {
    const [contact, side] = $<HTMLSelectElement>("s-stop").value.split(",").map(Number);
    return Number.isFinite(contact) && $<HTMLSelectElement>("s-stop").value ? [contact, side] : null;
  }
  private get columns(): [number, number] {
    return [Number($<HTMLSelectElement>("s-x").value), Number($<HTMLSelectElement>("s-y").value)];
  }

  clear(): void {
    this.parts = [];
    this.total = this.rate = 0;
    this.width = 2 + 2 * chosen.start.x.length;
    this.density?.clear(this.width);
    this.fit();
    $("d-section").textContent = "";
    this.crew.section(null, () => undefined);
  }
  restart(): void {
    this.clear();
    if (!this.stop) return;
    const [contact, side] = this.stop, { values, start } = chosen;
    const points = Math.min(MOST_POINTS, Math.floor(MOST_BYTES / (4 * this.width)));
    this.crew.section({ kind: "section", values, start, contact, side, points }, ({ rows, rate }) => {
      if (!rows) return;
      this.rate = rate!;
      this.take(rows);
    });
  }
  /** Show all points again, also where the axes are others. */
  fit(): void {
    this.zoomed = null;
    this.all = NONE;
    this.redraw();
  }
  redraw(): void {
    this.dirty = true;
    this.drawnAt = 0;
  }

  csv(): string {
    const n = chosen.start.x.length, names = (k: string): string[] => Array.from({ length: n }, (_, i) => `${k}${i + 1}`);
    const rows = [...this.latest(KEPT)].map((row) => row.join(","));
    return `${[["phase", "impact_speed", ...names("x"), ...names("v")].join(","), ...rows].join("\n")}\n`;
  }

  private take(rows: Float64Array): void {
    const { width } = this;
    for (let i = 0; i < rows.length; i += width, ++this.total) {
      if (this.total === 0 || this.total === BEGINS) {
        [this.low, this.high] = [new Array<number>(width).fill(Infinity), new Array<number>(width).fill(-Infinity)];
        this.all = NONE;
      }
      for (let k = 0; k < width; ++k) {
        if (rows[i + k] < this.low[k]) this.low[k] = rows[i + k];
        if (rows[i + k] > this.high[k]) this.high[k] = rows[i + k];
      }
    }
    this.density?.add(rows);
    this.parts.push(rows);
    for (let kept = this.parts.reduce((sum, part) => sum + part.length, 0); kept - this.parts[0].length > KEPT * width; ) kept -= this.parts.shift()!.length;
    this.dirty = true;
  }
  /** So many of the latest points. */
  private *latest(most: number): Generator<Float64Array> {
    const { width } = this;
    let skipped = this.parts.reduce((sum, part) => sum + part.length / width, 0) - most;
    for (const part of this.parts)
      if ((skipped -= part.length / width) < 0)
        for (let i = Math.max(0, part.length + Math.ceil(skipped) * width); i < part.length; i += width) yield part.subarray(i, i + width);
  }
  /** The graphics processor has been taken away, and the points with it. */
  private lost(): void {
    this.density = Density.of(() => this.lost());
    this.restart();
  }

  /** Draw what is new, now and then; another view at once. */
  draw(): void {
    const now = performance.now();
    if (!this.dirty || now - this.drawnAt < PAUSE) return;
    this.drawnAt = now;
    this.dirty = false;
    this.widen();
    paint("section", (c, w, h) => {
      const [ix, iy] = this.columns, range = this.total ? (this.zoomed ?? this.all) : ([0, 1, 0, 1] as Range), { x, y } = frameOf(c, w, h, ...range);
      if (!this.total) return;
      const ratio = devicePixelRatio || 1, pw = w - LEFT - RIGHT, ph = h - TOP - BOTTOM;
      c.save();
      c.beginPath();
      c.rect(LEFT, TOP, pw, ph);
      c.clip();
      if (this.density) {
        const size: [number, number] = [Math.max(1, Math.round(pw * ratio)), Math.max(1, Math.round(ph * ratio))];
        const part = this.zoomed ? Math.min(1, area(this.zoomed) / area(this.all)) : 1;
        const point = this.fallsOnFew(range, size) ? Math.round(3 * ratio) : 1;
        const drawn = this.density.show({ columns: [ix, iy], range, part, size, point }, rgb(ink.few), rgb(ink.many));
        if (drawn < this.total) this.redraw(); // the rest with the next frames
        c.drawImage(this.density.canvas, LEFT, TOP, pw, ph);
      } else {
        c.fillStyle = ink.many;
        for (const row of this.latest(LOOKED_AT)) c.fillRect(x(row[ix]) - 0.6, y(row[iy]) - 0.6, 1.2, 1.2);
      }
      c.restore();
    });
    this.describe();
  }
  private describe(): void {
    if (!this.total) return void ($("d-section").textContent = "no impacts at this stop yet");
    const words = (x: number): string => Math.round(x).toLocaleString("en");
    const seen = this.density ? "" : ` This browser has no WebGL 2: the latest ${words(Math.min(LOOKED_AT, this.total))} are drawn.`;
    $("d-section").textContent = `${words(this.total)} points, ${words(this.rate * 1000)} a second.${seen} Dragging moves, after a click the wheel zooms, a double click shows all.`;
  }

  /** Widen the view of all points where some lie outside. */
  private widen(): void {
    const [ix, iy] = this.columns, [x0, x1, y0, y1] = this.all, turn = [0, 2 * Math.PI] as const;
    const fits = (i: number, a: number, b: number): boolean => i === 0 ? a === turn[0] && b === turn[1] : a <= this.low[i] && this.high[i] <= b && a < b;
    if (!this.total || (fits(ix, x0, x1) && fits(iy, y0, y1))) return;
    const widened = (i: number): readonly [number, number] => {
      const a = this.low[i], b = this.high[i], edge = Math.max(0.06 * (b - a), 1e-9 * Math.max(Math.abs(a), Math.abs(b)), 1e-300);
      return i === 0 ? turn : [a - edge, b + edge];
    };
    this.all = [...widened(ix), ...widened(iy)];
  }
  /** Whether the latest points fall on few pixels. */
  private fallsOnFew([x0, x1, y0, y1]: Range, [w, h]: [number, number]): boolean {
    const [ix, iy] = this.columns, seen = new Set<number>();
    for (const row of this.latest(LOOKED_AT)) {
      const x = (row[ix] - x0) / (x1 - x0), y = (row[iy] - y0) / (y1 - y0);
      if (x >= 0 && x <= 1 && y >= 0 && y <= 1) seen.add(Math.round(x * w) + (w + 1) * Math.round(y * h));
    }
    return seen.size < FEW;
  }

  // ---- zooming and moving ------------------------------------------------------------------------

  /** Scale the view about a point of it, 0 to 1 from left and from below, and move it by parts of its size. */
  private zoom(factor: number, at: [number, number] = [0.5, 0.5], by: [number, number] = [0, 0]): void {
    if (!this.total) return;
    const [x0, x1, y0, y1] = this.zoomed ?? this.all;
    const scaled = (a: number, b: number, s: number, move: number): [number, number] => {
      const finest = FINEST * Math.max(Math.abs(a), Math.abs(b)), f = Math.max(factor, Math.min(1, finest / (b - a)));
      const fixed = a + s * (b - a), shift = move * (b - a);
      return [fixed + f * (a - fixed) - shift, fixed + f * (b - fixed) - shift];
    };
    this.zoomed = [...scaled(x0, x1, at[0], by[0]), ...scaled(y0, y1, at[1], by[1])];
    this.redraw();
  }
  private listen(): void {
    const canvas = $<HTMLCanvasElement>("section"), held = new Map<number, [number, number]>();
    const place = (event: MouseEvent): [number, number] => {
      const box = canvas.getBoundingClientRect();
      return [(event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT), 1 - (event.clientY - box.top - TOP) / (box.height - TOP - BOTTOM)];
    };
    canvas.onwheel = (event) => {
      if (!event.ctrlKey && document.activeElement !== canvas) return; // the page scrolls
      event.preventDefault();
      this.zoom(Math.exp(Math.max(-0.5, Math.min(0.5, event.deltaY / 300))), place(event));
    };
    canvas.ondblclick = () => this.fit();
    canvas.onpointerdown = (event) => {
      held.set(event.pointerId, place(event));
      canvas.setPointerCapture(event.pointerId);
    };
    canvas.onpointerup = canvas.onpointercancel = (event) => held.delete(event.pointerId);
    canvas.onpointermove = (event) => {
      const from = held.get(event.pointerId), to = place(event);
      if (!from) return;
      held.set(event.pointerId, to);
      const [other] = [...held].filter(([id]) => id !== event.pointerId).map(([, one]) => one);
      if (other) { // two fingers: their distance zooms
        const distance = (one: [number, number]): number => Math.max(0.02, Math.hypot(one[0] - other[0], one[1] - other[1]));
        this.zoom(distance(from) / distance(to), other);
      } else if (event.pointerType === "mouse" || event.pointerType === "pen") this.zoom(1, [0, 0], [to[0] - from[0], to[1] - from[1]]);
    };
    canvas.addEventListener("keydown", (event) => {
      const moves: Record<string, [number, number]> = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
      if (event.key in moves) this.zoom(1, [0, 0], moves[event.key]);
      else if (event.key === "+" || event.key === "=") this.zoom(0.8);
      else if (event.key === "-") this.zoom(1.25);
      else if (event.key === "0") this.fit();
      else return;
      event.preventDefault();
    });
  }
}

const area = ([x0, x1, y0, y1]: Range): number => (x1 - x0) * (y1 - y0);
const rgb = (colour: string): number[] => colour.match(/[0-9a-f]{2}/gi)!.map((part) => parseInt(part, 16) / 255);
