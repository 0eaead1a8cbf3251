// The page: what is chosen, what is drawn, and who computes it.

import { fast, plain } from "virtual:kernel";
import { type MachineData, machinesOf, type Parameter, type Start, unpacked } from "./data";
import { ask, type Changes, listenToHost, tell } from "./host";
import { Kernel, Refused } from "./kernel";
import { drawMachine, type Ink, Motion } from "./motion";
import Work from "./worker?worker&inline";
import type { DiagramJob, Job, PlaneJob } from "./worker";

const $ = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;
const PALETTE = ["#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#7A6A00", "#4B3F8F", "#8C8C8C"];
const PERIODS = 6; // of the time history
const MOST_POINTS = 3000000; // of the section
const COLUMNS = 400, CELLS = 200;

let machines: Record<string, MachineData> = {};
let others: Record<string, string> = {}; // titles of those that the command has
let operands: number[] = [];
let machine: MachineData;
let values: Record<string, number> = {};
let start: Start = { x: [], v: [], phase: 0 };
let kernel: Kernel;
let motion: Motion | null = null;
let playing = true, time = 0, last = 0;
const scale = { size: 1e-300 };
let ink: Ink = {};
const addressed = location.protocol !== "about:"; // a frame's text has no address of its own
const served = location.protocol.startsWith("http") && document.getElementById("server") !== null;

// ---- beginning -----------------------------------------------------------------------------------

async function inflated(text: string): Promise<ArrayBuffer> {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

/** The module with the instruction for fma, where it is there and rounds once; else the other, some five times slower. */
async function chosenCode(): Promise<ArrayBuffer> {
  const code = await inflated(fast);
  try {
    const { instance } = await WebAssembly.instantiate(code, {});
    const exports = instance.exports as unknown as { _initialize(): void; fused(x: number): number };
    exports._initialize();
    if (exports.fused(2 ** -30)) return code;
  } catch {
    // not known to this browser
  }
  document.body.dataset.kernel = "plain";
  return inflated(plain);
}

class Crew {
  readonly workers: Worker[] = [];
  private ids: number[] = [];
  private hear: ((data: any, worker: number) => void)[] = [];
  constructor(count: number, code: ArrayBuffer) {
    for (let i = 0; i < count; ++i) {
      const one = new Work();
      one.postMessage({ type: "code", code });
      one.onmessage = ({ data }) => {
        if (data.id === this.ids[i]) this.hear[i]?.(data, i);
      };
      this.workers.push(one);
      this.ids.push(0);
    }
  }
  know(one: MachineData): void {
    for (const worker of this.workers) worker.postMessage({ type: "machine", machine: one });
  }
  give(worker: number, job: Job | null, hear: (data: any, worker: number) => void): void {
    this.hear[worker] = hear;
    this.workers[worker].postMessage({ type: "job", id: ++this.ids[worker], job });
  }
}
let crew: Crew;
let sweeping = ""; // which panel the sweep belongs to

async function begin(): Promise<void> {
  const text = document.getElementById("machines")?.textContent?.trim();
  if (!text) {
    say("This page has no machines in it. Open it with: vibroimpact explore");
    return;
  }
  const all = machinesOf(new TextDecoder().decode(await inflated(text)));
  ({ machines, operands, others } = all);
  const code = await chosenCode();
  kernel = await Kernel.of(code);
  const workers = Math.max(2, Math.min(4, (navigator.hardwareConcurrency || 2) - 1));
  crew = new Crew(1 + workers, code);
  const menu = $<HTMLSelectElement>("machine");
  const titles = { ...others, ...Object.fromEntries(Object.entries(machines).map(([name, one]) => [name, one.title])) };
  menu.replaceChildren(...Object.entries(titles).map(([name, title]) => new Option(`${name} — ${title}`, name)));
  const from = await readHash(), said = $("say").textContent ?? "";
  choose(from?.machine ?? all.chosen, from);
  if (said) say(said);
  listen();
  listenToHost(set, show);
  requestAnimationFrame(frame);
  document.body.dataset.ready = "1";
}

function say(text: string): void {
  $("say").textContent = text;
}

// ---- what is chosen ------------------------------------------------------------------------------

interface Link {
  machine: string;
  values: Record<string, number>;
  start: Partial<Start>;
}

/** Get a machine that the command has. */
async function known(name: string): Promise<boolean> {
  if (name in machines) return true;
  if (!(name in others)) return false;
  say(`Compiling ${name} ...`);
  const answer = await fetch(`machine/${encodeURIComponent(name)}`);
  if (!answer.ok) return false;
  Object.assign(machines, machinesOf(await answer.text()).machines);
  say("");
  return true;
}

async function readHash(): Promise<Link | null> {
  const hash = location.hash.slice(1);
  if (!hash) return null;
  const given = new URLSearchParams(hash), name = given.get("machine") ?? "";
  if (!(await known(name))) {
    say(`The link names the machine ${JSON.stringify(name)}, which is not here. This is another one.`);
    return null;
  }
  const link: Link = { machine: name, values: {}, start: {} }, wrong: string[] = [];
  for (const [key, word] of given) {
    if (key === "machine") continue;
    const numbers = word.split(",").map(Number);
    if (!numbers.every(Number.isFinite) || word === "") wrong.push(`${key}=${word}`);
    else if (key === "phase") link.start.phase = numbers[0];
    else if ((key === "x" || key === "v") && numbers.length === machines[name].start.x.length) link.start[key] = numbers;
    else if (machines[name].parameters.some((p) => p.name === key)) link.values[key] = numbers[0];
    else wrong.push(`${key}=${word}`);
  }
  if (wrong.length) say(`Left out of the link: ${wrong.join(", ")}.`);
  return link;
}

function writeHash(): void {
  const words = [`machine=${machine.name}`, ...machine.parameters.map((p) => `${encodeURIComponent(p.name)}=${values[p.name]}`)];
  words.push(`x=${start.x.join(",")}`, `v=${start.v.join(",")}`, `phase=${start.phase}`);
  if (addressed) history.replaceState(null, "", `#${words.join("&")}`);
}

/** Take what the host sets; what it does not name stays. */
function set(changes: Changes): void {
  const name = changes.machine ?? machine.name;
  if (!(name in machines)) return say(`There is no machine ${JSON.stringify(name)} here.`);
  const taken = { machine: name, values: { ...changes.values }, start: { ...changes.start } };
  if (name !== machine.name) return choose(name, taken);
  values = { ...values, ...taken.values };
  start = { ...start, ...structuredClone(taken.start) };
  refresh();
  restart();
  drawDiagram();
  drawPlane();
}

/** Show these panels alone. */
function show(panels: string[]): void {
  document.body.dataset.panels = "some";
  for (const panel of document.querySelectorAll<HTMLElement>("[data-panel]")) panel.hidden = !panels.includes(panel.dataset.panel!);
  redraw();
}

function choose(name: string, link: Link | null = null): void {
  machine = machines[name];
  values = { ...Object.fromEntries(machine.parameters.map((p) => [p.name, p.value])), ...link?.values };
  start = { ...structuredClone(machine.start), ...link?.start };
  $<HTMLSelectElement>("machine").value = name;
  crew.know(machine);
  const cases = $<HTMLSelectElement>("case");
  cases.replaceChildren(new Option("—", ""), ...Object.keys(machine.cases).map((one) => new Option(one, one)));
  $("of-cases").hidden = !Object.keys(machine.cases).length;
  $("about").textContent = `${machine.title}. ${machine.si ? "Numbers in SI units." : ""}`;
  for (const id of ["python", "toml"]) $(id).hidden = !machine.python;
  controls();
  menus();
  clearSweeps();
  restart();
}

function controls(): void {
  refreshers.length = 0;
  $("parameters").replaceChildren(...machine.parameters.map((p) => control(p.name, p.about || p.name, p.unit, () => values[p.name], (x) => (values[p.name] = x), rangeOf(p))));
  const fields: HTMLElement[] = [];
  (["x", "v"] as const).forEach((kind) =>
    start[kind].forEach((_, i) =>
      fields.push(control(`${kind}${i + 1}`, `${kind === "x" ? "position" : "velocity"} ${i + 1}`, "", () => start[kind][i], (x) => (start[kind][i] = x), around(start[kind][i]))),
    ),
  );
  fields.push(control("phase", "phase of the force", "rad", () => start.phase, (x) => (start.phase = x), { from: 0, to: 2 * Math.PI, log: false }));
  $("start").replaceChildren(...fields);
}

interface Range {
  from: number;
  to: number;
  log: boolean;
}
const around = (x: number): Range => ({ from: x - Math.max(1, Math.abs(x)), to: x + Math.max(1, Math.abs(x)), log: false });
function rangeOf(p: Parameter): Range {
  const x = p.value;
  if (p.check === "fraction") return { from: 0, to: 1, log: false };
  if (p.check === "positive" && x > 0) return { from: x / 4, to: x * 4, log: true };
  if (p.check === "nonnegative") return { from: 0, to: x > 0 ? 4 * x : 1, log: false };
  return x > 0 ? { from: 0, to: 3 * x, log: false } : around(x);
}

const refreshers: (() => void)[] = [];
function control(name: string, about: string, unit: string, get: () => number, set: (x: number) => void, range: Range): HTMLElement {
  const row = document.createElement("div");
  row.className = "parameter";
  const label = document.createElement("label"), id = `f-${name}`;
  label.htmlFor = id;
  label.title = about;
  const bold = document.createElement("b"), note = document.createElement("span");
  bold.textContent = name.replaceAll("_", " ");
  note.textContent = unit;
  label.append(bold, note);
  const slider = document.createElement("input"), field = document.createElement("input");
  slider.type = "range";
  slider.min = "0";
  slider.max = "1000";
  slider.setAttribute("aria-label", `${name}: ${about}`);
  field.id = id;
  field.inputMode = "decimal";
  field.autocomplete = "off";
  const place = (x: number): number => (range.log ? Math.log(x / range.from) / Math.log(range.to / range.from) : (x - range.from) / (range.to - range.from));
  const show = (): void => {
    field.value = String(get());
    slider.value = String(1000 * place(get()));
    slider.setAttribute("aria-valuetext", field.value);
  };
  slider.oninput = () => {
    const s = Number(slider.value) / 1000;
    const x = range.log ? range.from * (range.to / range.from) ** s : range.from + s * (range.to - range.from);
    set(Number(x.toPrecision(4)));
    show();
    restart();
  };
  field.onchange = () => {
    const x = Number(field.value.replace(",", "."));
    const good = field.value.trim() !== "" && Number.isFinite(x);
    field.classList.toggle("bad", !good);
    if (!good) return say(`${name} = ${field.value}: must be a number.`);
    set(x);
    show();
    restart();
  };
  row.append(label, slider, field);
  refreshers.push(show);
  show();
  return row;
}
const refresh = (): void => refreshers.forEach((show) => show());

function menus(): void {
  const fill = (id: string, words: [string, string][], chosen: string): void => {
    const menu = $<HTMLSelectElement>(id);
    menu.replaceChildren(...words.map(([value, text]) => new Option(text, value)));
    menu.value = chosen;
  };
  const names: [string, string][] = machine.parameters.map((p) => [p.name, p.name.replaceAll("_", " ")]);
  const first = names.some(([n]) => n === "omega") ? "omega" : names[0][0];
  const second = (names.find(([n]) => n !== first && /clearance|gap|amplitude|force/.test(n)) ?? names.find(([n]) => n !== first) ?? names[0])[0];
  fill("d-name", names, first);
  fill("p-x", names, first);
  fill("p-y", names, second);
  sweepRange("d-name", "d-from", "d-to");
  sweepRange("p-x", "p-x0", "p-x1");
  sweepRange("p-y", "p-y0", "p-y1");
  const stops: [string, string][] = [];
  machine.elements.forEach((e, i) => {
    if (e.stop) stops.push([`${i},0`, e.label], [`${i},1`, `${e.label}, upper (A)`], [`${i},-1`, `${e.label}, lower (B)`]);
  });
  fill("s-stop", stops, stops[0]?.[0] ?? "");
  const n = machine.start.x.length, axes: [string, string][] = [["0", "phase"], ["1", "impact speed"]];
  for (let i = 0; i < n; ++i) axes.push([String(2 + i), `x${i + 1}`]);
  for (let i = 0; i < n; ++i) axes.push([String(2 + n + i), `v${i + 1}`]);
  fill("s-x", axes, "0");
  fill("s-y", axes, String(2 + 2 * n - 1));
}

function sweepRange(menu: string, from: string, to: string): void {
  const name = $<HTMLSelectElement>(menu).value, x = values[name], p = machine.parameters.find((q) => q.name === name)!;
  const range = p.check === "fraction" ? [0, 1] : x ? [0.5 * x, 1.5 * x].sort((a, b) => a - b) : [0, 1];
  $<HTMLInputElement>(from).value = String(Number(range[0].toPrecision(4)));
  $<HTMLInputElement>(to).value = String(Number(range[1].toPrecision(4)));
}

// ---- motion --------------------------------------------------------------------------------------

let track: { t: number[]; x: number[][] } = { t: [], x: [] };

function restart(): void {
  say("");
  writeHash();
  tell({ machine: machine.name, values, start });
  time = 0;
  scale.size = 1e-300;
  track = { t: [], x: machine.start.x.map(() => []) };
  try {
    motion = new Motion(kernel, machine, values, start);
    motion.until(motion.period);
    describe();
    restartSection();
  } catch (error) {
    refused(error);
  }
}

function refused(error: unknown): void {
  if (!(error instanceof Refused)) throw error;
  motion = null;
  crew.give(0, null, () => undefined);
  clearPoints();
  say(error.message);
  void missed();
}

/** Ask for a compilation at these values. */
let asked = "";
async function missed(): Promise<void> {
  const question = { machine: machine.name, values, start }, text = JSON.stringify(question);
  if (text === asked) return;
  asked = text;
  const found = await ask(question, served);
  if (!found) return;
  if (found.refused) return say(found.refused);
  if (text !== JSON.stringify({ machine: machine.name, values, start }) || !found.recording) return;
  machine.recordings.unshift(unpacked(found.recording, operands));
  machine = machines[machine.name] = { ...machine };
  crew.know(machine);
  restart();
}

function describe(): void {
  const rigid = machine.elements.map((e) => e.label).join(", ");
  $("d-motion").textContent = `A lane for every coordinate; stops ${rigid || "none"}: upper in blue, lower in orange; pressed ones are thick, impacts flash.`;
}

function frame(now: number): void {
  const dt = Math.min(0.05, (now - last) / 1000);
  last = now;
  if (motion) {
    try {
      if (playing && !document.hidden) {
        const speed = 10 ** (0.5 * Number($<HTMLInputElement>("speed").value));
        time += (dt * speed * motion.period) / 2.5;
        motion.until(time);
        if (motion.ended && time > motion.end) {
          time = motion.end;
          say(`The motion ends here: ${motion.ended}.`);
          playing = false;
          buttons();
        }
        follow();
      }
      paint("motion", (c, w, h) => drawMachine(c, w, h, { machine, kernel, motion: motion!, time, phase: start.phase, scale, ink }));
      paint("history", drawHistory);
      const recent = motion.hits.filter((hit) => hit.time <= time && hit.time > time - motion!.period).length;
      if (now - noted > 500) {
        noted = now;
        $("d-history").textContent = `t = ${time.toPrecision(5)}; ${recent} impacts in the last ${kernel.omega ? "forcing period" : "60 units of time"}`;
      }
    } catch (error) {
      refused(error);
    }
  }
  if (dirty) drawSection();
  requestAnimationFrame(frame);
}
let noted = 0;

function follow(): void {
  const step = (motion!.period * PERIODS) / 900;
  for (let t = (track.t.at(-1) ?? -step) + step; t <= time; t += step) {
    const { xv } = motion!.at(t);
    track.t.push(t);
    track.x.forEach((row, i) => row.push(xv[i]));
  }
  if (track.t.length > 2000) {
    track.t.splice(0, 1000);
    track.x.forEach((row) => row.splice(0, 1000));
  }
}

// ---- canvases ------------------------------------------------------------------------------------

type Draw = (c: CanvasRenderingContext2D, width: number, height: number) => void;
function paint(id: string, draw: Draw): void {
  const canvas = $<HTMLCanvasElement>(id), ratio = devicePixelRatio || 1;
  const { clientWidth: w, clientHeight: h } = canvas;
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
    canvas.width = Math.round(w * ratio);
    canvas.height = Math.round(h * ratio);
  }
  const c = canvas.getContext("2d", { willReadFrequently: id === "section" })!;
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  draw(c, w, h);
}

const LEFT = 46, BOTTOM = 22, TOP = 6, RIGHT = 8;
interface Axes {
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
function frameOf(c: CanvasRenderingContext2D, w: number, h: number, x0: number, x1: number, y0: number, y1: number): Axes {
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

function drawHistory(c: CanvasRenderingContext2D, w: number, h: number): void {
  const span = motion!.period * PERIODS, from = Math.max(0, time - span);
  let low = Infinity, high = -Infinity;
  for (const row of track.x)
    for (let i = 0; i < row.length; ++i)
      if (track.t[i] >= from) {
        low = Math.min(low, row[i]);
        high = Math.max(high, row[i]);
      }
  if (!(high > low)) [low, high] = [(low || 0) - 1, (low || 0) + 1];
  const edge = 0.06 * (high - low), axes = frameOf(c, w, h, from, from + span, low - edge, high + edge);
  c.fillStyle = ink.flash;
  for (const hit of motion!.hits)
    if (hit.time >= from && hit.time <= time) c.fillRect(axes.x(hit.time) - 0.75, h - BOTTOM - 7, 1.5, 7);
  const colours = [ink.a, ink.b, ink.c, ink.d];
  track.x.forEach((row, k) => {
    c.strokeStyle = colours[k % 4];
    c.lineWidth = 1.6;
    c.setLineDash(k < 4 ? [] : [4, 3]);
    c.beginPath();
    let begun = false;
    row.forEach((value, i) => {
      if (track.t[i] < from) return;
      if (begun) c.lineTo(axes.x(track.t[i]), axes.y(value));
      else c.moveTo(axes.x(track.t[i]), axes.y(value));
      begun = true;
    });
    c.stroke();
    c.setLineDash([]);
    c.fillStyle = colours[k % 4];
    c.textAlign = "left";
    c.fillText(`x${k + 1}`, LEFT + 8 + 26 * k, TOP + 7);
  });
}

// ---- section -------------------------------------------------------------------------------------

let points: Float64Array[] = [], width = 0, total = 0, dirty = false, rate = 0;
function clearPoints(): void {
  points = [];
  cloud = null;
  total = 0;
  rate = 0;
  dirty = true;
  $("d-section").textContent = "";
}
function restartSection(): void {
  clearPoints();
  const [contact, side] = $<HTMLSelectElement>("s-stop").value.split(",").map(Number);
  if (!Number.isFinite(contact)) return;
  crew.give(0, { kind: "section", values, start, contact, side: side || 0, points: MOST_POINTS }, (data) => {
    if (!data.rows) return;
    width = data.width;
    points.push(data.rows);
    total += data.rows.length / width;
    rate = data.rate;
    dirty = true;
  });
}

/** Counts of points by pixel, to which new points are added as long as all of them fit. */
interface Cloud {
  key: string;
  range: [number, number, number, number];
  counts: Uint32Array;
  parts: number; // so many of `points` are counted
  most: number;
}
let cloud: Cloud | null = null;
let drawnAt = 0;

function drawSection(): void {
  const now = performance.now();
  if (now - drawnAt < (total > 20000 ? 400 : 120)) return;
  drawnAt = now;
  dirty = false;
  const ix = Number($<HTMLSelectElement>("s-x").value), iy = Number($<HTMLSelectElement>("s-y").value);
  paint("section", (c, w, h) => {
    if (!w || !h) return;
    const ratio = devicePixelRatio || 1, W = Math.round(w * ratio), H = Math.round(h * ratio);
    const key = [ix, iy, W, H].join();
    const fresh = (): Cloud => ({ key, range: rangeOfPoints(ix, iy), counts: new Uint32Array(W * H), parts: 0, most: 1 });
    if (!cloud || cloud.key !== key || cloud.parts > points.length) cloud = fresh();
    let axes = frameOf(c, w, h, ...cloud.range);
    if (!counted(cloud, axes, ix, iy, W, H, ratio)) {
      cloud = fresh();
      axes = frameOf(c, w, h, ...cloud.range);
      counted(cloud, axes, ix, iy, W, H, ratio);
    }
    const image = c.getImageData(0, 0, W, H), [r, g, b] = ink.point.split(",").map(Number), full = Math.log1p(cloud.most);
    const { counts } = cloud, spread = total < 20000;
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
  });
  $("d-section").textContent = total ? `${Math.round(total).toLocaleString("en")} points, ${Math.round(rate * 1000).toLocaleString("en")} a second` : "no impacts at this stop yet";
}

/** Range of the points but for the first ones, which show how the motion begins. */
function rangeOfPoints(ix: number, iy: number): [number, number, number, number] {
  let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity], seen = 0;
  const skipped = Math.min(50, total / 5);
  for (const rows of points)
    for (let i = 0; i < rows.length; i += width) {
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
  return [...(ix === 0 ? [0, 2 * Math.PI] as const : widened(x0, x1)), ...(iy === 0 ? [0, 2 * Math.PI] as const : widened(y0, y1))];
}

/** Count the points that are new. False where some of them lie outside. */
function counted(cloud: Cloud, axes: Axes, ix: number, iy: number, W: number, H: number, ratio: number): boolean {
  const ax = axes.x(0) * ratio, bx = (axes.x(1) - axes.x(0)) * ratio, ay = axes.y(0) * ratio, by = (axes.y(1) - axes.y(0)) * ratio;
  const [x0, x1, y0, y1] = cloud.range, begins = cloud.parts === 0;
  let outside = 0;
  for (; cloud.parts < points.length; ++cloud.parts) {
    const rows = points[cloud.parts];
    for (let i = 0; i < rows.length; i += width) {
      const x = rows[i + ix], y = rows[i + iy];
      if (!(x >= x0 && x <= x1 && y >= y0 && y <= y1)) {
        ++outside;
        continue;
      }
      const at = Math.min(H - 1, Math.round(ay + by * y)) * W + Math.min(W - 1, Math.round(ax + bx * x));
      cloud.most = Math.max(cloud.most, ++cloud.counts[at]);
    }
  }
  return begins || outside === 0;
}

// ---- diagram and plane ---------------------------------------------------------------------------

interface Swept {
  seconds?: number; // that it took
  done: number;
  all: number;
  begun: number;
}
let diagram: (Swept & { name: string; at: number[]; speeds: (Float32Array | undefined)[] }) | null = null;
let plane: (Swept & { names: [string, string]; x: number[]; y: number[]; cells: (string | undefined)[] }) | null = null;
let mark = { diagram: 0.5, plane: [0.5, 0.5] };

function clearSweeps(): void {
  diagram = plane = null;
  sweeping = "";
  for (let i = 1; i < crew.workers.length; ++i) crew.give(i, null, () => undefined);
  $("legend").replaceChildren();
  drawDiagram();
  drawPlane();
}

function numbersIn(...ids: string[]): number[] | null {
  const found = ids.map((id) => Number($<HTMLInputElement>(id).value.replace(",", ".")));
  const bad = ids.filter((id, i) => !Number.isFinite(found[i]) || $<HTMLInputElement>(id).value.trim() === "");
  ids.forEach((id) => $(id).classList.toggle("bad", bad.includes(id)));
  if (bad.length) say("A range is given by two numbers.");
  return bad.length ? null : found;
}
const between = (a: number, b: number, count: number): number[] => Array.from({ length: count }, (_, i) => a + ((b - a) * i) / (count - 1));

/** Indices from coarse to fine. */
function coarseToFine(count: number): number[] {
  const found = new Set<number>();
  for (let step = 64; step >= 1; step /= 2) for (let i = 0; i < count; i += step) found.add(i);
  return [...found];
}

function computeDiagram(): void {
  const range = numbersIn("d-from", "d-to"), stop = $<HTMLSelectElement>("s-stop").value;
  if (!range || !stop) return;
  const name = $<HTMLSelectElement>("d-name").value, at = between(range[0], range[1], COLUMNS);
  diagram = { name, at, speeds: [], done: 0, all: COLUMNS, begun: performance.now() };
  sweeping = "diagram";
  const order = coarseToFine(COLUMNS), crews = crew.workers.length - 1;
  for (let k = 0; k < crews; ++k) {
    const job: DiagramJob = {
      kind: "diagram", values, start, name, at, columns: order.filter((_, i) => i % crews === k),
      contact: Number(stop.split(",")[0]), settle: 200, points: 80,
    };
    crew.give(k + 1, job, (data) => {
      if (!data.speeds || sweeping !== "diagram") return;
      diagram!.speeds[data.column] = data.speeds;
      diagram!.done += 1;
      soon(drawDiagram);
    });
  }
}

const waiting = new Set<() => void>();
function soon(draw: () => void): void {
  if (waiting.has(draw)) return;
  waiting.add(draw);
  setTimeout(() => {
    waiting.delete(draw);
    draw();
  }, 60);
}

const progress = (s: Swept): string => {
  if (s.done < s.all) return `${s.done} of ${s.all}`;
  s.seconds ??= (performance.now() - s.begun) / 1000;
  return `${s.all} in ${s.seconds.toFixed(1)} s`;
};

function drawDiagram(): void {
  paint("diagram", (c, w, h) => {
    c.clearRect(0, 0, w, h);
    if (!diagram) return empty(c, w, h, "Impact speeds over a parameter: Compute.");
    let high = 0;
    for (const one of diagram.speeds) if (one) for (const v of one) high = Math.max(high, v);
    const { at } = diagram, axes = frameOf(c, w, h, at[0], at[at.length - 1], 0, 1.05 * high || 1);
    c.fillStyle = ink.a;
    diagram.speeds.forEach((one, i) => one?.forEach((v) => c.fillRect(axes.x(at[i]) - 0.5, axes.y(v) - 0.5, 1.2, 1.2)));
    cross(c, axes.x(values[diagram.name]), null, w, h, ink.b);
    if (document.activeElement === $("diagram")) cross(c, LEFT + mark.diagram * (w - LEFT - RIGHT), null, w, h, ink.ink);
  });
  if (!diagram) $("d-diagram").textContent = "Each value begins at the same start and runs 200 periods first. A click takes a value.";
  else $("d-diagram").textContent = `Impact speed over ${diagram.name}; ${progress(diagram)}. A click takes a value.`;
}

function empty(c: CanvasRenderingContext2D, w: number, h: number, text: string): void {
  c.fillStyle = ink.soft;
  c.font = "13px system-ui, sans-serif";
  c.textAlign = "center";
  c.fillText(text, w / 2, h / 2);
}
function cross(c: CanvasRenderingContext2D, x: number, y: number | null, w: number, h: number, colour: string): void {
  c.strokeStyle = colour;
  c.lineWidth = 1.2;
  c.beginPath();
  if (x >= LEFT && x <= w - RIGHT) {
    c.moveTo(x, TOP);
    c.lineTo(x, h - BOTTOM);
  }
  if (y !== null && y >= TOP && y <= h - BOTTOM) {
    c.moveTo(LEFT, y);
    c.lineTo(w - RIGHT, y);
  }
  c.stroke();
}

function computePlane(): void {
  const range = numbersIn("p-x0", "p-x1", "p-y0", "p-y1");
  if (!range) return;
  const names: [string, string] = [$<HTMLSelectElement>("p-x").value, $<HTMLSelectElement>("p-y").value];
  if (names[0] === names[1]) return say("A plane has two different parameters.");
  const x = between(range[0], range[1], CELLS), y = between(range[2], range[3], CELLS);
  const cells: PlaneJob["cells"] = [], had = new Set<number>();
  for (const size of [20, 10, 5, 2, 1])
    for (let j = 0; j < CELLS; j += size)
      for (let i = 0; i < CELLS; i += size)
        if (!had.has(j * CELLS + i)) {
          had.add(j * CELLS + i);
          cells.push({ i, j, size, x: x[i], y: y[j] });
        }
  plane = { names, x, y, cells: [], done: 0, all: cells.length, begun: performance.now() };
  ranks.clear();
  sweeping = "plane";
  if (!imagePlane) imagePlane = new OffscreenCanvas(CELLS, CELLS);
  imagePlane.getContext("2d")!.clearRect(0, 0, CELLS, CELLS);
  const crews = crew.workers.length - 1;
  for (let k = 0; k < crews; ++k)
    crew.give(k + 1, { kind: "plane", values, start, names, cells: cells.filter((_, i) => i % crews === k), settle: 200, observe: 100 }, (data) => {
      if (!data.found || sweeping !== "plane") return;
      const c = imagePlane!.getContext("2d")!;
      for (const [i, j, size, word] of data.found as [number, number, number, string][]) {
        plane!.cells[j * CELLS + i] = word;
        c.fillStyle = colourOf(word);
        c.clearRect(i, CELLS - j - size, size, size);
        c.fillRect(i, CELLS - j - size, size, size);
        plane!.done += 1;
      }
      soon(drawPlane);
    });
}
let imagePlane: OffscreenCanvas | null = null;
const ranks = new Map<string, number>();
function colourOf(word: string): string {
  if (word === "none") return "#ffffff";
  if (word === "other") return "#30363c";
  if (word === "refused") return "#c9ced3";
  if (!ranks.has(word)) ranks.set(word, ranks.size);
  return PALETTE[Math.min(ranks.get(word)!, PALETTE.length - 1)];
}
const WORDS: Record<string, string> = { none: "no impacts", other: "not periodic, or not settled", refused: "not taken" };

function drawPlane(): void {
  paint("plane", (c, w, h) => {
    c.clearRect(0, 0, w, h);
    if (!plane) return empty(c, w, h, "Symbols n-p-q over two parameters: Compute.");
    const { x, y } = plane, axes = frameOf(c, w, h, x[0], x[CELLS - 1], y[0], y[CELLS - 1]);
    c.imageSmoothingEnabled = false;
    c.drawImage(imagePlane!, LEFT, TOP, w - LEFT - RIGHT, h - TOP - BOTTOM);
    cross(c, axes.x(values[plane.names[0]]), axes.y(values[plane.names[1]]), w, h, "#ff2d2d");
    if (document.activeElement === $("plane")) cross(c, LEFT + mark.plane[0] * (w - LEFT - RIGHT), TOP + (1 - mark.plane[1]) * (h - TOP - BOTTOM), w, h, ink.ink);
  });
  if (!plane) {
    $("d-plane").textContent = "200 x 200 motions, from coarse to fine: settled for 200 periods, seen for 100. A click takes both values.";
    return;
  }
  $("d-plane").textContent = `${plane.names[1]} over ${plane.names[0]}; ${progress(plane)}. A click takes both values.`;
  const counts = new Map<string, number>();
  for (const word of plane.cells) if (word) counts.set(word, (counts.get(word) ?? 0) + 1);
  const many = [...counts].sort((a, b) => b[1] - a[1]).slice(0, 12);
  $("legend").replaceChildren(
    ...many.map(([word, count]) => {
      const item = document.createElement("li"), patch = document.createElement("i");
      patch.style.background = colourOf(word);
      item.append(patch, `${WORDS[word] ?? word} (${((100 * count) / plane!.done).toFixed(0)} %)`);
      return item;
    }),
  );
}

function take(changes: Record<string, number>): void {
  values = { ...values, ...changes };
  refresh();
  restart();
  drawDiagram();
  drawPlane();
}
function share(event: MouseEvent): [number, number] {
  const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
  const x = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT), y = (event.clientY - box.top - TOP) / (box.height - TOP - BOTTOM);
  const kept = (s: number): number => Math.min(1, Math.max(0, s));
  return [kept(x), kept(1 - y)];
}
const at = (row: number[], s: number): number => row[0] + s * (row[row.length - 1] - row[0]);
function takeMark(which: "diagram" | "plane"): void {
  if (which === "diagram" && diagram) take({ [diagram.name]: at(diagram.at, mark.diagram) });
  if (which === "plane" && plane) take({ [plane.names[0]]: at(plane.x, mark.plane[0]), [plane.names[1]]: at(plane.y, mark.plane[1]) });
}

// ---- what leaves the page ------------------------------------------------------------------------

const real = (x: number): string => (Number.isInteger(x) && Math.abs(x) < 1e15 ? `${x}.0` : String(x));
function asPython(): string {
  const list = (row: number[]): string => `(${row.map(real).join(", ")},)`;
  const fixed = Object.entries(machine.fixed).map(([k, v]) => `${k}=${typeof v === "boolean" ? (v ? "True" : "False") : JSON.stringify(v)}`);
  const words = [...machine.parameters.map((p) => `${p.name}=${real(values[p.name])}`), ...fixed].map((one) => `    ${one},\n`).join("");
  return `import vibroimpact as vi\n\nmachine = ${machine.python}(\n${words})\nstart = vi.State(${list(start.x)}, ${list(start.v)}, ${real(start.phase)})\nrun = vi.simulate(machine, start, impacts=1000)\nprint(run)\n`;
}
function asToml(): string {
  const fixed = Object.entries(machine.fixed).map(([k, v]) => `${k} = ${JSON.stringify(v)}`);
  const words = [...machine.parameters.map((p) => `${p.name} = ${real(values[p.name])}`), ...fixed].join("\n");
  const list = (row: number[]): string => `[${row.map(real).join(", ")}]`;
  return `[${machine.name}]\n${words}\n\n[start]\nposition = ${list(start.x)}\nvelocity = ${list(start.v)}\nphase = ${real(start.phase)}\n`;
}
async function copy(text: string, what: string): Promise<void> {
  try {
    await navigator.clipboard.writeText(text);
    say(`${what} is copied.`);
  } catch {
    const area = document.createElement("textarea");
    area.value = text;
    document.body.append(area);
    area.select();
    const done = document.execCommand("copy");
    area.remove();
    say(done ? `${what} is copied.` : text);
  }
}
function save(name: string, blob: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
function tableOf(which: string): string {
  const rows: string[] = [];
  if (which === "section") {
    const n = machine.start.x.length, names = (k: string): string[] => Array.from({ length: n }, (_, i) => `${k}${i + 1}`);
    rows.push(["phase", "impact_speed", ...names("x"), ...names("v")].join(","));
    for (const part of points) for (let i = 0; i < part.length; i += width) rows.push(part.subarray(i, i + width).join(","));
  } else if (which === "diagram" && diagram) {
    rows.push(`${diagram.name},impact_speed`);
    diagram.speeds.forEach((one, i) => one?.forEach((v) => rows.push(`${diagram!.at[i]},${v}`)));
  } else if (which === "plane" && plane) {
    rows.push(`${plane.names.join(",")},motion`);
    plane.cells.forEach((word, i) => word && rows.push(`${plane!.x[i % CELLS]},${plane!.y[Math.floor(i / CELLS)]},${word}`));
  }
  return `${rows.join("\n")}\n`;
}

// ---- listening -----------------------------------------------------------------------------------

function buttons(): void {
  $("run").textContent = playing ? "Pause" : "Run";
  $("run").setAttribute("aria-pressed", String(playing));
}

function colours(): void {
  const style = getComputedStyle(document.documentElement);
  ink = Object.fromEntries(["ink", "soft", "line", "body", "a", "b", "c", "d", "flash", "point"].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}
function redraw(): void {
  colours();
  dirty = true;
  drawnAt = 0;
  drawDiagram();
  drawPlane();
}

function listen(): void {
  colours();
  $("link").hidden = !addressed;
  $("run").onclick = () => {
    playing = !playing;
    buttons();
  };
  $("again").onclick = restart;
  $("machine").onchange = async () => {
    const name = $<HTMLSelectElement>("machine").value;
    if (await known(name)) choose(name);
  };
  $("case").onchange = () => {
    const chosen = machine.cases[$<HTMLSelectElement>("case").value];
    if (chosen) take(chosen);
  };
  $("python").onclick = () => void copy(asPython(), "The Python code");
  $("toml").onclick = () => void copy(asToml(), "The TOML file");
  $("link").onclick = () => void copy(location.href, "The link");
  $("controls").onsubmit = (event) => event.preventDefault();
  $("s-stop").onchange = restartSection;
  for (const id of ["s-x", "s-y"]) $(id).onchange = () => (dirty = true);
  $("d-name").onchange = () => sweepRange("d-name", "d-from", "d-to");
  $("p-x").onchange = () => sweepRange("p-x", "p-x0", "p-x1");
  $("p-y").onchange = () => sweepRange("p-y", "p-y0", "p-y1");
  $("d-go").onclick = computeDiagram;
  $("p-go").onclick = computePlane;
  $("diagram").onclick = (event) => {
    mark.diagram = share(event)[0];
    takeMark("diagram");
  };
  $("plane").onclick = (event) => {
    mark.plane = share(event);
    takeMark("plane");
  };
  for (const which of ["diagram", "plane"] as const) {
    const canvas: HTMLElement = $(which);
    canvas.onfocus = canvas.onblur = which === "diagram" ? drawDiagram : drawPlane;
    canvas.addEventListener("keydown", (event: KeyboardEvent) => {
      const step = event.shiftKey ? 0.1 : 0.01, move: Record<string, [number, number]> = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
      if (event.key === "Enter") takeMark(which);
      else if (event.key in move) {
        const [dx, dy] = move[event.key], kept = (s: number): number => Math.min(1, Math.max(0, s));
        if (which === "diagram") mark.diagram = kept(mark.diagram + dx);
        else mark.plane = [kept(mark.plane[0] + dx), kept(mark.plane[1] + dy)];
        (which === "diagram" ? drawDiagram : drawPlane)();
      } else return;
      event.preventDefault();
    });
  }
  document.querySelectorAll<HTMLElement>("[data-png]").forEach((button) => {
    button.onclick = () => $<HTMLCanvasElement>(button.dataset.png!).toBlob((blob) => blob && save(`${machine.name}-${button.dataset.png}.png`, blob));
  });
  document.querySelectorAll<HTMLElement>("[data-csv]").forEach((button) => {
    button.onclick = () => save(`${machine.name}-${button.dataset.csv}.csv`, new Blob([tableOf(button.dataset.csv!)], { type: "text/csv" }));
  });
  document.addEventListener("keydown", (event) => {
    if ((event.target as HTMLElement).closest("input, select, button, textarea, summary")) return;
    if (event.key === " ") $("run").click();
    else if (event.key === "r" || event.key === "R") restart();
    else return;
    event.preventDefault();
  });
  addEventListener("hashchange", async () => {
    const link = await readHash(), said = $("say").textContent ?? "";
    if (link) choose(link.machine, link);
    if (said) say(said);
  });
  addEventListener("resize", redraw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  redraw();
}

void begin();
