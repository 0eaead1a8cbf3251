// Diagrams over one parameter, planes of two parameters, basins over two coordinates of the start.

import { BOTTOM, cross, empty, frameOf, ink, LEFT, paint, RIGHT, TOP } from "./canvas";
import type { Cell, Crew } from "./crew";
import { coordinateOf } from "./data";
import { $, chosen, say } from "./dom";
import type { CellsJob, Named } from "./worker";

const PALETTE = ["#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#7A6A00", "#4B3F8F", "#8C8C8C"];
const COLUMNS = 400, CELLS = 200;
const SAME_MOTION = 1e-3; // distance of footprints, in units of the size of their motions

export type Changes = { values?: Record<string, number>; start?: Record<string, number> };
type Take = (changes: Changes) => void;

/** A canvas whose points are chosen by clicks, arrow keys and Enter, and computed by the crew. */
abstract class Sweep {
  protected done = 0;
  protected all = 0;
  private begun = 0;
  private seconds = 0;
  private waiting = false;
  protected mark: [number, number] = [0.5, 0.5];

  constructor(readonly id: string, protected readonly crew: Crew, protected readonly take: Take) {
    const canvas = $<HTMLCanvasElement>(id);
    canvas.onfocus = canvas.onblur = () => this.draw();
    canvas.onclick = (event) => {
      const box = canvas.getBoundingClientRect();
      this.moveTo((event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT), 1 - (event.clientY - box.top - TOP) / (box.height - TOP - BOTTOM));
      this.takeMark();
    };
    canvas.addEventListener("keydown", (event: KeyboardEvent) => {
      const step = event.shiftKey ? 0.1 : 0.01, [x, y] = this.mark;
      const moves: Record<string, [number, number]> = { ArrowLeft: [x - step, y], ArrowRight: [x + step, y], ArrowUp: [x, y + step], ArrowDown: [x, y - step] };
      if (event.key === "Enter") this.takeMark();
      else if (event.key in moves) {
        this.moveTo(...moves[event.key]);
        this.draw();
      } else return;
      event.preventDefault();
    });
    $(`${id}-go`).onclick = () => this.compute();
  }

  abstract compute(): void;
  abstract draw(): void;
  abstract clear(): void;
  abstract csv(): string;
  protected abstract takeMark(): void;

  protected get marked(): boolean {
    return document.activeElement === $(this.id);
  }
  private moveTo(x: number, y: number): void {
    const kept = (s: number): number => Math.min(1, Math.max(0, s));
    this.mark = [kept(x), kept(y)];
  }
  protected begin(all: number): void {
    [this.done, this.all, this.seconds, this.begun] = [0, all, 0, performance.now()];
  }
  protected get progress(): string {
    if (this.done < this.all) return `${this.done} of ${this.all}`;
    this.seconds ||= (performance.now() - this.begun) / 1000;
    return `${this.all} in ${this.seconds.toFixed(1)} s`;
  }
  protected soon(): void {
    if (this.waiting) return;
    this.waiting = true;
    setTimeout(() => {
      this.waiting = false;
      this.draw();
    }, 60);
  }
  /** Numbers of the panel's fields; null where one is none. */
  protected numbers(...names: string[]): number[] | null {
    const fields = names.map((name) => $<HTMLInputElement>(`${this.id}-${name}`));
    const found = fields.map((field) => (field.value.trim() === "" ? NaN : Number(field.value.replace(",", "."))));
    fields.forEach((field, i) => field.classList.toggle("bad", !Number.isFinite(found[i])));
    if (found.every(Number.isFinite)) return found;
    say("A range is given by two numbers.");
    return null;
  }
  protected word(name: string): string {
    return $<HTMLSelectElement>(`${this.id}-${name}`).value;
  }
}

const between = (a: number, b: number, count: number): number[] => Array.from({ length: count }, (_, i) => a + ((b - a) * i) / (count - 1));
const at = (row: number[], s: number): number => row[0] + s * (row[row.length - 1] - row[0]);

/** Indices from coarse to fine. */
function coarseToFine(count: number): number[] {
  const found = new Set<number>();
  for (let step = 64; step >= 1; step /= 2) for (let i = 0; i < count; i += step) found.add(i);
  return [...found];
}

export class Diagram extends Sweep {
  private found: { name: string; at: number[]; speeds: (Float32Array | undefined)[] } | null = null;

  constructor(crew: Crew, take: Take, private readonly stop: () => [number, number] | null) {
    super("diagram", crew, take);
  }
  clear(): void {
    this.found = null;
    this.draw();
  }
  compute(): void {
    const range = this.numbers("x0", "x1"), stop = this.stop();
    if (!range || !stop) return;
    const name = this.word("x"), { values, start } = chosen;
    const found = (this.found = { name, at: between(range[0], range[1], COLUMNS), speeds: new Array<Float32Array | undefined>(COLUMNS) });
    const order = coarseToFine(COLUMNS);
    this.begin(COLUMNS);
    this.crew.sweep(
      (k, of) => ({ kind: "diagram", values, start, name, at: found.at, columns: order.filter((_, i) => i % of === k), contact: stop[0], settle: 200, points: 80 }),
      ({ column, speeds }) => {
        if (!speeds) return;
        found.speeds[column!] = speeds;
        this.done += 1;
        this.soon();
      },
    );
  }
  draw(): void {
    const { found } = this;
    paint("diagram", (c, w, h) => {
      if (!found) return empty(c, w, h, "Impact speeds over a parameter: Compute.");
      let high = 0;
      for (const one of found.speeds) if (one) for (const v of one) high = Math.max(high, v);
      const axes = frameOf(c, w, h, found.at[0], found.at[COLUMNS - 1], 0, 1.05 * high || 1);
      c.fillStyle = ink.a;
      found.speeds.forEach((one, i) => one?.forEach((v) => c.fillRect(axes.x(found.at[i]) - 0.5, axes.y(v) - 0.5, 1.2, 1.2)));
      cross(c, axes.x(chosen.values[found.name]), null, w, h, ink.b);
      if (this.marked) cross(c, LEFT + this.mark[0] * (w - LEFT - RIGHT), null, w, h, ink.ink);
    });
    $("d-diagram").textContent = found
      ? `Impact speed over ${found.name}; ${this.progress}. A click takes a value.`
      : "Each value begins at the same start and runs 200 periods first. A click takes a value.";
  }
  protected takeMark(): void {
    if (this.found) this.take({ values: { [this.found.name]: at(this.found.at, this.mark[0]) } });
  }
  csv(): string {
    const { found } = this, rows = found ? [`${found.name},impact_speed`] : [];
    found?.speeds.forEach((one, i) => one?.forEach((v) => rows.push(`${found.at[i]},${v}`)));
    return `${rows.join("\n")}\n`;
  }
}

interface Words {
  invitation: string;
  about: string;
  none: string;
  refused: string;
}
const OF: Record<Named, Words> = {
  values: {
    invitation: "Symbols n-p-q over two parameters: Compute.",
    about: "200 x 200 motions, from coarse to fine: settled for 200 periods, seen for 100. A click takes both values.",
    none: "no impacts",
    refused: "not taken",
  },
  start: {
    invitation: "Attractors over starts: Compute.",
    about: "200 x 200 starts, from coarse to fine: settled for 200 periods, seen for 100. A click takes the start.",
    none: "no impacts any more",
    refused: "behind a stop",
  },
};

/** A plane of two parameters, whose colours are symbols, or of two coordinates of the start, whose colours are attractors. */
export class Grid extends Sweep {
  private found: { names: [string, string]; x: number[]; y: number[]; cells: (string | undefined)[] } | null = null;
  private readonly picture = document.createElement("canvas");
  private readonly ranks = new Map<string, number>();
  private readonly attractors = new Map<string, number[][][]>(); // footprints of those of a symbol

  constructor(id: string, private readonly of: Named, crew: Crew, take: Take) {
    super(id, crew, take);
    this.picture.width = this.picture.height = CELLS;
  }
  clear(): void {
    this.found = null;
    $(`${this.id}-legend`).replaceChildren();
    this.draw();
  }
  compute(): void {
    const range = this.numbers("x0", "x1", "y0", "y1"), names: [string, string] = [this.word("x"), this.word("y")];
    if (!range) return;
    if (names[0] === names[1]) return say(`The axes need two different ${this.of === "values" ? "parameters" : "coordinates"}.`);
    const x = between(range[0], range[1], CELLS), y = between(range[2], range[3], CELLS);
    const cells: CellsJob["cells"] = [], had = new Set<number>();
    for (const size of [20, 10, 5, 2, 1])
      for (let j = 0; j < CELLS; j += size)
        for (let i = 0; i < CELLS; i += size)
          if (!had.has(j * CELLS + i)) {
            had.add(j * CELLS + i);
            cells.push({ i, j, size, x: x[i], y: y[j] });
          }
    const found = (this.found = { names, x, y, cells: new Array<string | undefined>(CELLS * CELLS) });
    this.ranks.clear();
    this.attractors.clear();
    this.begin(cells.length);
    const c = this.picture.getContext("2d")!, { values, start } = chosen;
    c.clearRect(0, 0, CELLS, CELLS);
    this.crew.sweep(
      (k, of) => ({ kind: "cells", values, start, of: this.of, names, cells: cells.filter((_, i) => i % of === k), settle: 200, observe: 100 }),
      (news) => {
        for (const cell of news.found ?? []) {
          const [i, j, size] = cell, word = this.named(cell);
          found.cells[j * CELLS + i] = word;
          c.fillStyle = this.colour(word);
          c.clearRect(i, CELLS - j - size, size, size);
          c.fillRect(i, CELLS - j - size, size, size);
          this.done += 1;
        }
        this.soon();
      },
    );
  }

  /** The symbol; of attractors a letter too, one for each that is apart from the others of this symbol. */
  private named([, , , word, mark]: Cell): string {
    if (!mark.length) return word;
    const known = this.attractors.get(word) ?? [];
    this.attractors.set(word, known);
    const near = (one: number[], other: number[]): boolean =>
      one.every((x, i) => Math.abs(x - other[i]) <= SAME_MOTION * Math.max(one.at(-1)!, other.at(-1)!));
    let which = known.findIndex((one) => one.every((group, g) => near(group, mark[g])));
    if (which < 0) which = known.push(mark) - 1;
    return `${word} ${which < 26 ? String.fromCharCode(97 + which) : which + 1}`;
  }
  private colour(word: string): string {
    if (word === "none") return "#ffffff";
    if (word === "other") return "#30363c";
    if (word === "refused") return "#c9ced3";
    if (!this.ranks.has(word)) this.ranks.set(word, this.ranks.size);
    return PALETTE[Math.min(this.ranks.get(word)!, PALETTE.length - 1)];
  }

  draw(): void {
    const { found } = this, words = OF[this.of];
    paint(this.id, (c, w, h) => {
      if (!found) return empty(c, w, h, words.invitation);
      const { x, y } = found, axes = frameOf(c, w, h, x[0], x[CELLS - 1], y[0], y[CELLS - 1]);
      c.imageSmoothingEnabled = false;
      c.drawImage(this.picture, LEFT, TOP, w - LEFT - RIGHT, h - TOP - BOTTOM);
      const [px, py] = found.names.map((name) => valueOf(this.of, name));
      cross(c, axes.x(px), axes.y(py), w, h, "#ff2d2d");
      if (this.marked) cross(c, LEFT + this.mark[0] * (w - LEFT - RIGHT), TOP + (1 - this.mark[1]) * (h - TOP - BOTTOM), w, h, ink.ink);
    });
    $(`d-${this.id}`).textContent = found ? `${found.names[1]} over ${found.names[0]}; ${this.progress}. A click takes both.` : words.about;
    if (found) this.legend(found.cells);
  }
  private legend(cells: (string | undefined)[]): void {
    const counts = new Map<string, number>();
    for (const word of cells) if (word) counts.set(word, (counts.get(word) ?? 0) + 1);
    const many = [...counts].sort((a, b) => b[1] - a[1]).slice(0, 12), words = { ...OF[this.of], other: "not periodic, or not settled" } as Record<string, string>;
    $(`${this.id}-legend`).replaceChildren(
      ...many.map(([word, count]) => {
        const item = document.createElement("li"), patch = document.createElement("i");
        patch.style.background = this.colour(word);
        item.append(patch, `${words[word] ?? word} (${((100 * count) / this.done).toFixed(0)} %)`);
        return item;
      }),
    );
  }
  protected takeMark(): void {
    if (!this.found) return;
    const { names, x, y } = this.found;
    this.take({ [this.of]: { [names[0]]: at(x, this.mark[0]), [names[1]]: at(y, this.mark[1]) } });
  }
  csv(): string {
    const { found } = this, rows = found ? [`${found.names.join(",")},motion`] : [];
    found?.cells.forEach((word, i) => word && rows.push(`${found.x[i % CELLS]},${found.y[Math.floor(i / CELLS)]},${word}`));
    return `${rows.join("\n")}\n`;
  }
}

/** The chosen value of a parameter, or of a coordinate of the start. */
function valueOf(of: Named, name: string): number {
  return of === "values" ? chosen.values[name] : coordinateOf(chosen.start, name);
}
