// Canvases: their size, axes and colours, and what was drawn on each, for SVG.

import { $ } from "./dom";
import { type Pen, SvgPen } from "./svg";

export interface Ink {
  [name: string]: string;
}
export let ink: Ink = {};
export const DARK = "(prefers-color-scheme: dark)";
const dark = [...document.styleSheets].flatMap(({ cssRules }) => [...cssRules])
  .find((rule): rule is CSSMediaRule => rule instanceof CSSMediaRule && rule.conditionText === DARK)!;

/** Take the colours of a scheme, "light" or "dark", of the system's for any other. */
export function colourBy(scheme: string): void {
  dark.media.mediaText = scheme === "dark" ? "all" : scheme === "light" ? "not all" : DARK;
  document.documentElement.style.colorScheme = scheme;
}

/** Read the colours of the page, which its scheme chooses. */
export function readColours(): void {
  const style = getComputedStyle(document.documentElement);
  const names = ["panel", "ink", "soft", "line", "body", "a", "b", "c", "d", "flash", "few", "many"];
  ink = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

type Draw = (c: Pen, width: number, height: number) => void;
const drawn = new Map<string, Draw>();

export function paint(id: string, draw: Draw): void {
  const canvas = $<HTMLCanvasElement>(id), ratio = devicePixelRatio || 1;
  const { clientWidth: w, clientHeight: h } = canvas;
  drawn.set(id, draw);
  if (!w || !h) return;
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
    canvas.width = Math.round(w * ratio);
    canvas.height = Math.round(h * ratio);
  }
  const c = canvas.getContext("2d")!;
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  draw(c, w, h);
}

/** What a canvas shows, as SVG. */
export function svgOf(id: string): string {
  const { clientWidth: w, clientHeight: h } = $<HTMLCanvasElement>(id), pen = new SvgPen(w, h, ink.panel);
  drawn.get(id)?.(pen, w, h);
  return pen.text();
}

/** What a canvas shows, as PNG, on the panel's colour. */
export function pngOf(id: string): Promise<Blob | null> {
  const from = $<HTMLCanvasElement>(id), whole = document.createElement("canvas"), c = whole.getContext("2d")!;
  [whole.width, whole.height] = [from.width, from.height];
  c.fillStyle = ink.panel;
  c.fillRect(0, 0, whole.width, whole.height);
  c.drawImage(from, 0, 0);
  return new Promise((done) => whole.toBlob(done));
}

export const LEFT = 46, BOTTOM = 22, TOP = 6, RIGHT = 8;
export interface Axes {
  x: (v: number) => number;
  y: (v: number) => number;
}
function ticksOf(from: number, to: number, most: number): number[] {
  const raw = (to - from) / most, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= raw)!;
  const found = [];
  for (let k = Math.ceil(from / step); k * step <= to; ++k) found.push(k * step);
  return found;
}
const short = (x: number): string => (x === 0 ? "0" : Math.abs(x) >= 1e5 || Math.abs(x) < 1e-3 ? x.toExponential(1) : String(Number(x.toPrecision(4))));

export function frameOf(c: Pen, w: number, h: number, x0: number, x1: number, y0: number, y1: number): Axes {
  c.clearRect(0, 0, w, h);
  const x = (v: number): number => LEFT + ((v - x0) / (x1 - x0)) * (w - LEFT - RIGHT);
  const y = (v: number): number => h - BOTTOM - ((v - y0) / (y1 - y0)) * (h - BOTTOM - TOP);
  c.strokeStyle = ink.line;
  c.fillStyle = ink.soft;
  c.lineWidth = 1;
  c.font = "11px system-ui, sans-serif";
  c.textBaseline = "middle";
  c.textAlign = "right";
  for (const v of ticksOf(y0, y1, 5)) {
    c.beginPath();
    c.moveTo(LEFT, y(v));
    c.lineTo(w - RIGHT, y(v));
    c.stroke();
    c.fillText(short(v), LEFT - 5, y(v));
  }
  c.textAlign = "center";
  for (const v of ticksOf(x0, x1, Math.max(2, w / 90))) c.fillText(short(v), x(v), h - BOTTOM + 11);
  return { x, y };
}

/** An empty canvas, and what it would show. */
export function empty(c: Pen, w: number, h: number, text: string): void {
  c.clearRect(0, 0, w, h);
  c.fillStyle = ink.soft;
  c.font = "13px system-ui, sans-serif";
  c.textAlign = "center";
  c.textBaseline = "middle";
  c.fillText(text, w / 2, h / 2);
}

/** Lines through a point, with edges of the panel's colour: they are seen on every colour. */
export function cross(c: Pen, x: number, y: number | null, w: number, h: number, colour: string): void {
  c.beginPath();
  if (x >= LEFT && x <= w - RIGHT) {
    c.moveTo(x, TOP);
    c.lineTo(x, h - BOTTOM);
  }
  if (y !== null && y >= TOP && y <= h - BOTTOM) {
    c.moveTo(LEFT, y);
    c.lineTo(w - RIGHT, y);
  }
  for (const [style, width] of [[ink.panel, 3.2], [colour, 1.2]] as const) {
    c.strokeStyle = style;
    c.lineWidth = width;
    c.stroke();
  }
}
