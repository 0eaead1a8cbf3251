// Sliders and fields of parameters and start, and the menus of the panels.

import type { MachineData, Parameter } from "./data";
import { $, chosen, say } from "./dom";

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
/** Show the values that are chosen. */
export const refresh = (): void => refreshers.forEach((show) => show());

/** Sliders and fields of the machine; `restart` is called when one has changed. */
export function controls(restart: () => void): void {
  refreshers.length = 0;
  const { machine, start } = chosen;
  const row = (name: string, about: string, unit: string, get: () => number, set: (x: number) => void, range: Range): HTMLElement =>
    control(name, about, unit, get, set, range, restart);
  $("parameters").replaceChildren(
    ...machine.parameters.map((p) => row(p.name, p.about || p.name, p.unit, () => chosen.values[p.name], (x) => (chosen.values[p.name] = x), rangeOf(p))),
  );
  const fields: HTMLElement[] = [];
  (["x", "v"] as const).forEach((kind) =>
    start[kind].forEach((at, i) =>
      fields.push(row(`${kind}${i + 1}`, `${kind === "x" ? "position" : "velocity"} ${i + 1}`, "", () => chosen.start[kind][i], (x) => (chosen.start[kind][i] = x), around(at))),
    ),
  );
  fields.push(row("phase", "phase of the force", "rad", () => chosen.start.phase, (x) => (chosen.start.phase = x), { from: 0, to: 2 * Math.PI, log: false }));
  $("start").replaceChildren(...fields);
}

function control(name: string, about: string, unit: string, get: () => number, set: (x: number) => void, range: Range, restart: () => void): HTMLElement {
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

// ---- menus ---------------------------------------------------------------------------------------

type Word = [value: string, text: string];

function fill(id: string, words: Word[], value: string): void {
  const menu = $<HTMLSelectElement>(id);
  menu.replaceChildren(...words.map(([one, text]) => new Option(text, one)));
  menu.value = value;
}

/** Fill the menus of the panels for the machine. */
export function menus(): void {
  const { machine } = chosen, n = machine.start.x.length;
  const names: Word[] = machine.parameters.map((p) => [p.name, p.name.replaceAll("_", " ")]);
  const first = names.some(([one]) => one === "omega") ? "omega" : names[0][0];
  const second = (names.find(([one]) => one !== first && /clearance|gap|amplitude|force/.test(one)) ?? names.find(([one]) => one !== first) ?? names[0])[0];
  fill("diagram-x", names, first);
  fill("plane-x", names, first);
  fill("plane-y", names, second);
  const coordinates = ["x", "v"].flatMap((kind) => machine.start.x.map((_, i): Word => [`${kind}${i + 1}`, `${kind}${i + 1}`]));
  fill("basins-x", [...coordinates, ["phase", "phase"]], `x${n}`);
  fill("basins-y", [...coordinates, ["phase", "phase"]], `v${n}`);
  const stops: Word[] = [];
  machine.elements.forEach((e, i) => {
    if (e.stop) stops.push([`${i},0`, e.label], [`${i},1`, `${e.label}, upper (A)`], [`${i},-1`, `${e.label}, lower (B)`]);
  });
  fill("s-stop", stops, stops[0]?.[0] ?? "");
  const axes: Word[] = [["0", "phase"], ["1", "impact speed"], ...coordinates.map(([one], i): Word => [String(2 + i), one])];
  fill("s-x", axes, "0");
  fill("s-y", axes, String(1 + 2 * n));
}

/** Propose ranges: of parameters around their values, of coordinates as far as the motion goes. */
export function ranges(reach: (kind: "x" | "v", i: number) => number): void {
  const set = (id: string, [from, to]: [number, number]): void => {
    $<HTMLInputElement>(`${id}0`).value = String(Number(from.toPrecision(4)));
    $<HTMLInputElement>(`${id}1`).value = String(Number(to.toPrecision(4)));
  };
  const coordinate = (name: string): [number, number] => {
    if (name === "phase") return [0, 2 * Math.PI];
    const far = reach(name[0] as "x" | "v", Number(name.slice(1)) - 1);
    return [-far, far];
  };
  for (const id of ["diagram-x", "plane-x", "plane-y", "basins-x", "basins-y"]) {
    const menu = $<HTMLSelectElement>(id), propose = (): void => set(id, id.startsWith("basins") ? coordinate(menu.value) : bounds(chosen.machine, menu.value));
    menu.onchange = propose;
    propose();
  }
}
function bounds(machine: MachineData, name: string): [number, number] {
  const x = chosen.values[name], p = machine.parameters.find((one) => one.name === name)!;
  if (p.check === "fraction") return [0, 1];
  return x ? ([0.5 * x, 1.5 * x].sort((a, b) => a - b) as [number, number]) : [0, 1];
}
