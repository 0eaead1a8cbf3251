// A worker: sections, diagrams and planes, in pieces, so that a newer request ends an older one.

import type { Cell } from "./crew";
import { type MachineData, type Start, withCoordinates } from "./data";
import { Kernel, END_EVENTS, END_IMPACTS, END_OBSERVER, Refused } from "./kernel";

export interface SectionJob {
  kind: "section";
  values: Record<string, number>;
  start: Start;
  contact: number;
  side: number;
  points: number;
}
export interface DiagramJob {
  kind: "diagram";
  values: Record<string, number>;
  start: Start;
  name: string;
  at: number[];
  columns: number[];
  contact: number;
  settle: number;
  points: number;
}
export type Named = "values" | "start";
/** Motions over two parameters, or over two coordinates of the start: "x1", ..., "v1", ..., "phase". */
export interface CellsJob {
  kind: "cells";
  values: Record<string, number>;
  start: Start;
  of: Named;
  names: [string, string];
  cells: { i: number; j: number; size: number; x: number; y: number }[];
  settle: number;
  observe: number;
}
export type Job = SectionJob | DiagramJob | CellsJob;
export type Message =
  | { type: "code"; code: ArrayBuffer }
  | { type: "machine"; machine: MachineData }
  | { type: "job"; id: number; job: Job | null };

let kernel: Promise<Kernel>;
let machine: MachineData;
let latest = 0;
const PIECE = 12; // milliseconds between looks at the mail

const channel = new MessageChannel();
let wake: (() => void) | null = null;
channel.port1.onmessage = () => wake?.();
const pause = (): Promise<void> =>
  new Promise((done) => {
    wake = done;
    channel.port2.postMessage(0);
  });

self.onmessage = ({ data }: MessageEvent<Message>) => {
  if (data.type === "code") kernel = Kernel.of(data.code);
  else if (data.type === "machine") machine = data.machine;
  else {
    latest = data.id;
    if (data.job) void work(data.id, data.job);
  }
};

async function work(id: number, job: Job): Promise<void> {
  const k = await kernel;
  try {
    if (job.kind === "section") await section(k, id, job);
    else if (job.kind === "diagram") await diagram(k, id, job);
    else await cells(k, id, job);
  } catch (error) {
    if (!(error instanceof Refused)) throw error;
    self.postMessage({ id, refused: error.message });
  }
  if (id === latest) self.postMessage({ id, done: true });
}

async function section(k: Kernel, id: number, job: SectionJob): Promise<void> {
  k.compile(machine, job.values, job.start);
  if (!k.begin(job.start)) return;
  let total = 0;
  const begun = performance.now();
  for (let events = 200; total < job.points && id === latest; ) {
    const from = performance.now();
    const part = k.section(job.contact, job.side, 20000, events);
    total += part.count;
    const time = performance.now() - from;
    if (time < PIECE) events = Math.min(2 * events, 200000);
    self.postMessage({ id, rows: part.rows, width: part.width, rate: total / (performance.now() - begun) }, { transfer: [part.rows.buffer as ArrayBuffer] });
    if (part.end !== END_EVENTS && part.end !== END_IMPACTS && part.end !== END_OBSERVER) return;
    await pause();
  }
}

async function diagram(k: Kernel, id: number, job: DiagramJob): Promise<void> {
  let from = performance.now();
  for (const column of job.columns) {
    if (id !== latest) return;
    const speeds: number[] = [];
    try {
      k.compile(machine, { ...job.values, [job.name]: job.at[column] }, job.start);
      if (k.begin(job.start)) {
        k.settle(job.settle * k.period);
        const part = k.section(job.contact, 0, job.points, 40 * job.points);
        for (let i = 0; i < part.count; ++i) speeds.push(part.rows[i * part.width + 1]);
      }
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
    }
    self.postMessage({ id, column, speeds: Float32Array.from(speeds) });
    if (performance.now() - from > PIECE) {
      await pause();
      from = performance.now();
    }
  }
}

async function cells(k: Kernel, id: number, job: CellsJob): Promise<void> {
  let from = performance.now(), found: Cell[] = [];
  for (const { i, j, size, x, y } of job.cells) {
    if (id !== latest) return;
    let word = "refused", mark: number[][] = [];
    const { values, start } = placed(job, { [job.names[0]]: x, [job.names[1]]: y });
    try {
      k.compile(machine, values, start);
      if (k.begin(start)) {
        const { period } = k, s = k.symbol(job.settle * period, job.observe * period, 1e-6, 2);
        const impacts = [...s.p, ...s.q].reduce((sum, one) => sum + one, 0);
        word = s.impacts === 0 ? "none" : impacts ? `${s.n}-${s.p.join("+")}-${s.q.join("+")}` : "other";
        if (job.of === "start" && impacts) mark = k.footprint(impacts);
      }
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
    }
    found.push([i, j, size, word, mark]);
    if (performance.now() - from > PIECE) {
      self.postMessage({ id, found });
      found = [];
      await pause();
      from = performance.now();
    }
  }
  self.postMessage({ id, found });
}

/** Parameters and start of a cell. */
function placed(job: CellsJob, at: Record<string, number>): { values: Record<string, number>; start: Start } {
  if (job.of === "values") return { values: { ...job.values, ...at }, start: job.start };
  return { values: job.values, start: withCoordinates(job.start, at) };
}
