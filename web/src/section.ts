// The section: states after impacts at a stop, counted by pixel, millions of them.

import { type Axes, frameOf, ink, paint } from "./canvas";
import type { Crew } from "./crew";
import { $, chosen } from "./dom";

const MOST_POINTS = 3000000;
const FEW = 4000; // pixels with points below which each is drawn larger
const MOST_ROWS = 100000; // of the table, the latest

/** Counts of points by pixel, to which new points are added as long as all of them fit. */
interface Cloud {
  key: string;
  range: [number, number, number, number];
  counts: Uint32Array;
  parts: number; // so many of `points` are counted
  most: number;
  pixels: number; // that have points
}

export class Section {
  private points: Float64Array[] = [];
  private width = 0;
  private total = 0;
  private rate = 0;
  private dirty = false;
  private drawnAt = 0;
  private cloud: Cloud | null = null;
  private readonly picture = document.createElement("canvas");

  constructor(private readonly crew: Crew) {}

  /** Contact and side that are chosen; null where the machine has no stop. */
  get stop(): [number, number] | null {
    const [contact, side] = $<HTMLSelectElement>("s-stop").value.split(",").map(Number);
    return Number.isFinite(contact) && $<HTMLSelectElement>("s-stop").value ? [contact, side] : null;
  }

  clear(): void {
    this.points = [];
    this.cloud = null;
    this.total = this.rate = 0;
    this.dirty = true;
    $("d-section").textContent = "";
    this.crew.section(null, () => undefined);
  }
  restart(): void {
    this.clear();
    if (!this.stop) return;
    const [contact, side] = this.stop, { values, start } = chosen;
    this.crew.section({ kind: "section", values, start, contact, side, points: MOST_POINTS }, (news) => {
      if (!news.rows) return;
      this.width = news.width!;
      this.points.push(news.rows);
      this.total += news.rows.length / this.width;
      this.rate = news.rate!;
      this.dirty = true;
    });
  }
  redraw(): void {
    this.dirty = true;
    this.drawnAt = 0;
  }

  csv(): string {
    const n = chosen.start.x.length, names = (k: string): string[] => Array.from({ length: n }, (_, i) => `${k}${i + 1}`);
    let skipped = Math.max(0, Math.round(this.total) - MOST_ROWS);
    const rows = [["phase", "impact_speed", ...names("x"), ...names("v")].join(",")];
    for (const part of this.points)
      for (let i = 0; i < part.length; i += this.width) if (skipped-- <= 0) rows.push(part.subarray(i, i + this.width).join(","));
    return `${rows.join("\n")}\n`;
  }

  /** Draw what is new, now and then. */
  draw(): void {
    const now = performance.now();
    if (!this.dirty || now - this.drawnAt < (this.total > 20000 ? 400 : 120)) return;
    this.drawnAt = now;
    this.dirty = false;
    const ix = Number($<HTMLSelectElement>("s-x").value), iy = Number($<HTMLSelectElement>("s-y").value);
    paint("section", (c, w, h) => {
      const ratio = devicePixelRatio || 1, W = Math.round(w * ratio), H = Math.round(h * ratio);
      const key = [ix, iy, W, H].join();
      const fresh = (): Cloud => ({ key, range: this.rangeOf(ix, iy), counts: new Uint32Array(W * H), parts: 0, most: 1, pixels: 0 });
      if (!this.cloud || this.cloud.key !== key || this.cloud.parts > this.points.length) this.cloud = fresh();
      let axes = frameOf(c, w, h, ...this.cloud.range);
      if (!this.counted(this.cloud, axes, ix, iy, W, H, ratio)) {
        this.cloud = fresh();
        axes = frameOf(c, w, h, ...this.cloud.range);
        this.counted(this.cloud, axes, ix, iy, W, H, ratio);
      }
      this.colour(this.cloud, W, H);
      c.drawImage(this.picture, 0, 0, w, h);
    });
    $("d-section").textContent = this.total
      ? `${Math.round(this.total).toLocaleString("en")} points, ${Math.round(this.rate * 1000).toLocaleString("en")} a second`
      : "no impacts at this stop yet";
  }

  /** Counts as a picture. */
  private colour({ counts, most, pixels }: Cloud, W: number, H: number): void {
    if (this.picture.width !== W || this.picture.height !== H) [this.picture.width, this.picture.height] = [W, H];
    const c = this.picture.getContext("2d")!, image = c.createImageData(W, H);
    const [r, g, b] = ink.point.split(",").map(Number), full = Math.log1p(most), spread = pixels < FEW;
    const put = (at: number, alpha: number): void => {
      const k = 4 * at;
      image.data[k] = r;
      image.data[k + 1] = g;
      image.data[k + 2] = b;
      image.data[k + 3] = Math.max(image.data[k + 3], 255 * alpha);
    };
    for (let at = 0; at < counts.length; ++at)
      if (counts[at]) {
        const alpha = 0.35 + (0.65 * Math.log1p(counts[at])) / full;
        put(at, alpha);
        if (spread) for (const step of [1, -1, W, -W]) if (at + step > 0 && at + step < counts.length && !counts[at + step]) put(at + step, alpha);
      }
    c.putImageData(image, 0, 0);
  }

  /** Range of the points but for the first ones, which show how the motion begins. */
  private rangeOf(ix: number, iy: number): [number, number, number, number] {
    let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity], seen = 0;
    const skipped = Math.min(50, this.total / 5);
    for (const rows of this.points)
      for (let i = 0; i < rows.length; i += this.width) {
        if (seen++ < skipped) continue;
        x0 = Math.min(x0, rows[i + ix]);
        x1 = Math.max(x1, rows[i + ix]);
        y0 = Math.min(y0, rows[i + iy]);
        y1 = Math.max(y1, rows[i + iy]);
      }
    const widened = (a: number, b: number): [number, number] => {
      if (!(b >= a)) return [0, 1];
      const edge = Math.max(0.06 * (b - a), 1e-9 * Math.max(Math.abs(a), Math.abs(b)), 1e-300);
      return [a - edge, b + edge];
    };
    const turn: [number, number] = [0, 2 * Math.PI];
    return [...(ix === 0 ? turn : widened(x0, x1)), ...(iy === 0 ? turn : widened(y0, y1))];
  }

  /** Count the points that are new. False where some of them lie outside. */
  private counted(cloud: Cloud, axes: Axes, ix: number, iy: number, W: number, H: number, ratio: number): boolean {
    const ax = axes.x(0) * ratio, bx = (axes.x(1) - axes.x(0)) * ratio, ay = axes.y(0) * ratio, by = (axes.y(1) - axes.y(0)) * ratio;
    const [x0, x1, y0, y1] = cloud.range, begins = cloud.parts === 0;
    let outside = 0;
    for (; cloud.parts < this.points.length; ++cloud.parts) {
      const rows = this.points[cloud.parts];
      for (let i = 0; i < rows.length; i += this.width) {
        const x = rows[i + ix], y = rows[i + iy];
        if (!(x >= x0 && x <= x1 && y >= y0 && y <= y1)) {
          ++outside;
          continue;
        }
        const at = Math.min(H - 1, Math.round(ay + by * y)) * W + Math.min(W - 1, Math.round(ax + bx * x));
        if (!cloud.counts[at]) ++cloud.pixels;
        cloud.most = Math.max(cloud.most, ++cloud.counts[at]);
      }
    }
    return begins || outside === 0;
  }
}
