// The page: what is chosen, what moves, and what is told of it.

import { BOTTOM, colourBy, DARK, frameOf, ink, LEFT, paint, pngOf, readColours, svgOf, TOP } from "./canvas";
import { controls, menus, ranges, refresh } from "./controls";
import { chosenCode, Crew, inflated } from "./crew";
import { type MachineData, machinesOf, type Start, unpacked, withCoordinates } from "./data";
import { $, chosen, say } from "./dom";
import { ask, type Changes, listenToHost, tell } from "./host";
import { Kernel, Refused, UNFORCED } from "./kernel";
import { asPython, asToml, copy, save } from "./leaves";
import { drawMachine, Motion } from "./motion";
import { Section } from "./section";
import { type Changes as Taken, Diagram, Grid } from "./sweeps";

const PERIODS = 6; // of the time history

let machines: Record<string, MachineData> = {};
let others: Record<string, string> = {}; // titles of those that the command has
let operands: number[] = [];
let kernel: Kernel, crew: Crew;
let section: Section, diagram: Diagram, plane: Grid, basins: Grid;
let motion: Motion | null = null;
let playing = true, time = 0, last = 0, noted = 0;
const scale = { size: 1e-300 };
const addressed = location.protocol !== "about:"; // a frame's text has no address of its own
const served = location.protocol.startsWith("http") && document.getElementById("server") !== null;

// ---- beginning -----------------------------------------------------------------------------------

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
  crew = new Crew(1 + Math.max(2, Math.min(4, (navigator.hardwareConcurrency || 2) - 1)), code);
  section = new Section(crew);
  diagram = new Diagram(crew, take, () => section.stop);
  plane = new Grid("plane", "values", crew, take);
  basins = new Grid("basins", "start", crew, take);
  readColours();
  const menu = $<HTMLSelectElement>("machine");
  const titles = { ...others, ...Object.fromEntries(Object.entries(machines).map(([name, one]) => [name, one.title])) };
  menu.replaceChildren(...Object.entries(titles).map(([name, title]) => new Option(`${name} — ${title}`, name)));
  const from = await readLink(location.hash.slice(1)), said = $("say").textContent ?? "";
  choose(from?.machine ?? all.chosen, from ?? {});
  if (said) say(said);
  listen();
  listenToHost(set, show, (scheme) => {
    colourBy(scheme);
    redraw();
  });
  requestAnimationFrame(frame);
  document.body.dataset.ready = "1";
}

// ---- what is chosen ------------------------------------------------------------------------------

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

let shown: string[] = []; // panels that the link names; none: all
/** What a permalink names; null where its machine is not here. */
async function readLink(link: string): Promise<Changes | null> {
  if (!link) return null;
  const given = new URLSearchParams(link.replaceAll("+", "%2B")), name = given.get("machine") ?? "";
  if (given.has("show")) show(given.get("show")!.split(","));
  if (!(await known(name))) {
    say(`The link names the machine ${JSON.stringify(name)}, which is not here. This is another one.`);
    return null;
  }
  const values: Record<string, number> = {}, start: Partial<Start> = {}, wrong: string[] = [];
  for (const [key, word] of given) {
    if (key === "machine" || key === "show") continue;
    const numbers = word.split(",").map(Number);
    if (!numbers.every(Number.isFinite) || word === "") wrong.push(`${key}=${word}`);
    else if (key === "phase") start.phase = numbers[0];
    else if ((key === "x" || key === "v") && numbers.length === machines[name].start.x.length) start[key] = numbers;
    else if (machines[name].parameters.some((p) => p.name === key)) values[key] = numbers[0];
    else wrong.push(`${key}=${word}`);
  }
  if (wrong.length) say(`Left out of the link: ${wrong.join(", ")}.`);
  return { machine: name, values, start };
}

function linkOf({ machine, values, start }: typeof chosen): string {
  const words = [`machine=${machine.name}`, ...machine.parameters.map((p) => `${encodeURIComponent(p.name)}=${values[p.name]}`)];
  words.push(`x=${start.x.join(",")}`, `v=${start.v.join(",")}`, `phase=${start.phase}`);
  return words.join("&");
}

function choose(name: string, changes: Changes): void {
  const machine = machines[name];
  chosen.machine = machine;
  chosen.values = { ...Object.fromEntries(machine.parameters.map((p) => [p.name, p.value])), ...changes.values };
  chosen.start = structuredClone({ ...machine.start, ...changes.start });
  $<HTMLSelectElement>("machine").value = name;
  crew.know(machine);
  const cases = $<HTMLSelectElement>("case");
  cases.replaceChildren(new Option("—", ""), ...Object.keys(machine.cases).map((one) => new Option(one, one)));
  $("of-cases").hidden = !Object.keys(machine.cases).length;
  $("about").textContent = `${machine.title}. ${machine.si ? "Numbers in SI units." : ""}`;
  for (const id of ["python", "toml"]) $(id).hidden = !machine.python;
  controls(restart);
  menus();
  crew.sweep(() => null, () => undefined);
  for (const one of [diagram, plane, basins]) one.clear();
  restart();
  ranges(reach);
}

/** Take what the host sets; what it does not name stays. */
async function set(given: Changes): Promise<void> {
  const changes = given.link === undefined ? given : await readLink(given.link);
  if (!changes) return;
  const said = given.link === undefined ? "" : ($("say").textContent ?? "");
  const name = changes.machine ?? chosen.machine.name;
  if (!(name in machines)) return say(`There is no machine ${JSON.stringify(name)} here.`);
  if (name !== chosen.machine.name) return choose(name, changes);
  chosen.values = { ...chosen.values, ...changes.values };
  chosen.start = structuredClone({ ...chosen.start, ...changes.start });
  changed();
  if (said) say(said);
}
/** Take parameters, or coordinates of the start by their names. */
function take({ values, start }: Taken): void {
  chosen.values = { ...chosen.values, ...values };
  chosen.start = withCoordinates(chosen.start, start ?? {});
  changed();
}
function changed(): void {
  refresh();
  restart();
  for (const one of [diagram, plane, basins]) one.draw();
}

/** Show these panels alone. */
function show(panels: string[]): void {
  shown = panels;
  document.body.dataset.panels = "some";
  for (const panel of document.querySelectorAll<HTMLElement>("[data-panel]")) panel.hidden = !panels.includes(panel.dataset.panel!);
  if (chosen.machine) redraw();
}

// ---- motion --------------------------------------------------------------------------------------

let track: { t: number[]; x: number[][] } = { t: [], x: [] };

function restart(): void {
  const { machine, values, start } = chosen;
  say("");
  const link = linkOf(chosen);
  if (addressed) history.replaceState(null, "", `#${link}${shown.length ? `&show=${shown.join(",")}` : ""}`);
  tell({ machine: machine.name, values, start, link });
  time = 0;
  scale.size = 1e-300;
  track = { t: [], x: machine.start.x.map(() => []) };
  try {
    motion = new Motion(kernel, machine, values, start);
    motion.until(motion.period);
    describe();
    section.restart();
  } catch (error) {
    refused(error);
  }
}

function refused(error: unknown): void {
  if (!(error instanceof Refused)) throw error;
  motion = null;
  section.clear();
  say(error.message);
  void missed();
}

/** Ask for a compilation at these values. */
let asked = "";
async function missed(): Promise<void> {
  const question = (): string => JSON.stringify({ machine: chosen.machine.name, values: chosen.values, start: chosen.start }), text = question();
  if (text === asked) return;
  asked = text;
  const found = await ask(JSON.parse(text), served);
  if (found?.refused) return say(found.refused);
  if (text !== question() || !found?.recording) return;
  const { machine } = chosen;
  machine.recordings.unshift(unpacked(found.recording, operands));
  chosen.machine = machines[machine.name] = { ...machine };
  crew.know(chosen.machine);
  restart();
}

function describe(): void {
  const labels = chosen.machine.elements.map((e) => e.label).join(", ");
  $("d-motion").textContent = `A lane for every coordinate; stops ${labels || "none"}: upper in blue, lower in orange; pressed ones are thick, impacts flash.`;
}

/** How far a coordinate goes in the first periods of the motion, for ranges of starts. */
function reach(kind: "x" | "v", i: number): number {
  const { start } = chosen;
  let far = Math.abs(start[kind][i]);
  if (motion && kernel) {
    motion.until(PERIODS * motion.period);
    for (let k = 0; k <= 200; ++k) far = Math.max(far, Math.abs(motion.at((k / 200) * Math.min(motion.end, PERIODS * motion.period)).xv[i + (kind === "v" ? start.x.length : 0)]));
  }
  return far || 1;
}

function frame(now: number): void {
  const dt = Math.min(0.05, (now - last) / 1000);
  last = now;
  if (motion) {
    try {
      const moving = motion;
      if (playing && !document.hidden) {
        const speed = 10 ** (0.5 * Number($<HTMLInputElement>("speed").value));
        time += (dt * speed * moving.period) / 2.5;
        moving.until(time);
        if (moving.ended && time > moving.end) {
          time = moving.end;
          say(`The motion ends here: ${moving.ended}.`);
          playing = false;
          buttons();
        }
        follow(moving);
      }
      paint("motion", (c, w, h) => drawMachine(c, w, h, { machine: chosen.machine, kernel, motion: moving, time, phase: chosen.start.phase, scale, ink }));
      paint("history", drawHistory);
      const recent = moving.hits.filter((hit) => hit.time <= time && hit.time > time - moving.period).length;
      if (now - noted > 500) {
        noted = now;
        const silent = moving.silent(time);
        $("d-history").textContent = `t = ${time.toPrecision(5)}; ${recent} impacts in the last ${kernel.omega ? "forcing period" : `${UNFORCED} units of time`}${silent && `; ${silent}`}`;
      }
    } catch (error) {
      refused(error);
    }
  }
  section.draw();
  requestAnimationFrame(frame);
}

function follow(moving: Motion): void {
  const step = (moving.period * PERIODS) / 900;
  for (let t = (track.t.at(-1) ?? -step) + step; t <= time; t += step) {
    const { xv } = moving.at(t);
    track.t.push(t);
    track.x.forEach((row, i) => row.push(xv[i]));
  }
  if (track.t.length > 2000) {
    track.t.splice(0, 1000);
    track.x.forEach((row) => row.splice(0, 1000));
  }
}

const drawHistory: Parameters<typeof paint>[1] = (c, w, h) => {
  if (!motion) return c.clearRect(0, 0, w, h);
  const span = motion.period * PERIODS, from = Math.max(0, time - span);
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
  for (const hit of motion.hits) if (hit.time >= from && hit.time <= time) c.fillRect(axes.x(hit.time) - 0.75, h - BOTTOM - 7, 1.5, 7);
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
};

/** Impacts that are kept, and the time history, as tables. */
function impactsCsv(): string {
  const { machine } = chosen, rows = (motion?.hits ?? []).filter((hit) => hit.time <= time);
  return ["time,element,side,impact_speed", ...rows.map((hit) => `${hit.time},${machine.elements[hit.contact]?.label ?? hit.contact},${hit.side},${hit.speed}`), ""].join("\n");
}
function historyCsv(): string {
  return [["time", ...track.x.map((_, i) => `x${i + 1}`)].join(","), ...track.t.map((t, i) => [t, ...track.x.map((row) => row[i])].join(",")), ""].join("\n");
}

// ---- listening -----------------------------------------------------------------------------------

function buttons(): void {
  $("run").textContent = playing ? "Pause" : "Run";
  $("run").setAttribute("aria-pressed", String(playing));
}

function redraw(): void {
  readColours();
  section.redraw();
  for (const one of [diagram, plane, basins]) one.draw();
}

/** Buttons that save a panel, in each of them. */
function saveButtons(): void {
  const tables: Record<string, () => string> = {
    motion: impactsCsv, history: historyCsv, section: () => section.csv(),
    diagram: () => diagram.csv(), plane: () => plane.csv(), basins: () => basins.csv(),
  };
  for (const [id, table] of Object.entries(tables)) {
    const ways: [string, () => Blob | Promise<Blob | null>][] = [
      ["PNG", () => pngOf(id)],
      ["SVG", () => new Blob([svgOf(id)], { type: "image/svg+xml" })],
      ["CSV", () => new Blob([table()], { type: "text/csv" })],
    ];
    for (const [kind, make] of ways) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = kind;
      button.dataset.save = `${id}-${kind.toLowerCase()}`;
      button.setAttribute("aria-label", `Save the ${id} as ${kind}`);
      button.onclick = async () => {
        const blob = await make();
        if (blob) save(`${chosen.machine.name}-${id}.${kind.toLowerCase()}`, blob);
      };
      document.querySelector(`[data-panel=${id}] .save`)!.append(button);
    }
  }
}

function listen(): void {
  saveButtons();
  $("link").hidden = !addressed;
  $("run").onclick = () => {
    playing = !playing;
    buttons();
  };
  $("again").onclick = restart;
  $("machine").onchange = async () => {
    const name = $<HTMLSelectElement>("machine").value;
    if (await known(name)) choose(name, {});
  };
  $("case").onchange = () => {
    const values = chosen.machine.cases[$<HTMLSelectElement>("case").value];
    if (values) take({ values });
  };
  $("python").onclick = () => void copy(asPython(), "The Python code");
  $("toml").onclick = () => void copy(asToml(), "The TOML file");
  $("link").onclick = () => void copy(location.href, "The link");
  $("controls").onsubmit = (event) => event.preventDefault();
  $("s-stop").onchange = () => section.restart();
  for (const id of ["s-x", "s-y"]) $(id).onchange = () => section.fit();
  document.addEventListener("keydown", (event) => {
    if ((event.target as HTMLElement).closest("input, select, button, textarea, summary")) return;
    if (event.key === " ") $("run").click();
    else if (event.key === "r" || event.key === "R") restart();
    else return;
    event.preventDefault();
  });
  addEventListener("hashchange", async () => {
    const link = await readLink(location.hash.slice(1)), said = $("say").textContent ?? "";
    if (link) choose(link.machine!, link);
    if (said) say(said);
  });
  addEventListener("resize", redraw);
  matchMedia(DARK).addEventListener("change", redraw);
  redraw();
}

void begin();
