// Workers and the code that they run.

import { fast, plain } from "virtual:kernel";
import type { MachineData } from "./data";
import Work from "./worker?worker&inline";
import type { Job } from "./worker";

export async function inflated(text: string): Promise<ArrayBuffer> {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

/** The module with the instruction for fma, where it is there and rounds once; else the other, which is slower. */
export async function chosenCode(): Promise<ArrayBuffer> {
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

/** What workers send, in parts: worker.ts. */
export interface News {
  rows?: Float64Array;
  width?: number;
  rate?: number;
  column?: number;
  speeds?: Float32Array;
  found?: Cell[];
  refused?: string;
}
export type Cell = [i: number, j: number, size: number, word: string, mark: number[][]];

/** Workers. The first draws sections, the others share the sweep of one panel. */
export class Crew {
  private readonly workers: Worker[] = [];
  private readonly ids: number[] = [];
  private readonly hear: ((news: News) => void)[] = [];

  constructor(count: number, code: ArrayBuffer) {
    for (let i = 0; i < count; ++i) {
      const one = new Work();
      one.postMessage({ type: "code", code });
      one.onmessage = ({ data }) => {
        if (data.id === this.ids[i]) this.hear[i]?.(data);
      };
      this.workers.push(one);
      this.ids.push(0);
    }
  }
  get sweepers(): number {
    return this.workers.length - 1;
  }
  know(machine: MachineData): void {
    for (const worker of this.workers) worker.postMessage({ type: "machine", machine });
  }
  section(job: Job | null, hear: (news: News) => void): void {
    this.give(0, job, hear);
  }
  /** Share a sweep: `part` gives the job of one of so many workers. What they swept before ends. */
  sweep(part: (worker: number, of: number) => Job | null, hear: (news: News) => void): void {
    for (let i = 0; i < this.sweepers; ++i) this.give(i + 1, part(i, this.sweepers), hear);
  }
  private give(worker: number, job: Job | null, hear: (news: News) => void): void {
    this.hear[worker] = hear;
    this.workers[worker].postMessage({ type: "job", id: ++this.ids[worker], job });
  }
}
