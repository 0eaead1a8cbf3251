// What leaves the page: programs, files, links.

import { chosen, say } from "./dom";

const real = (x: number): string => (Number.isInteger(x) && Math.abs(x) < 1e15 ? `${x}.0` : String(x));

export function asPython(): string {
  const { machine, values, start } = chosen;
  const list = (row: number[]): string => `(${row.map(real).join(", ")},)`;
  const fixed = Object.entries(machine.fixed).map(([k, v]) => `${k}=${typeof v === "boolean" ? (v ? "True" : "False") : JSON.stringify(v)}`);
  const words = [...machine.parameters.map((p) => `${p.name}=${real(values[p.name])}`), ...fixed].map((one) => `    ${one},\n`).join("");
  return `import vibroimpact as vi\n\nmachine = ${machine.python}(\n${words})\nstart = vi.State(${list(start.x)}, ${list(start.v)}, ${real(start.phase)})\nrun = vi.simulate(machine, start, impacts=1000)\nprint(run)\n`;
}
export function asToml(): string {
  const { machine, values, start } = chosen;
  const fixed = Object.entries(machine.fixed).map(([k, v]) => `${k} = ${JSON.stringify(v)}`);
  const words = [...machine.parameters.map((p) => `${p.name} = ${real(values[p.name])}`), ...fixed].join("\n");
  const list = (row: number[]): string => `[${row.map(real).join(", ")}]`;
  return `[${machine.name}]\n${words}\n\n[start]\nposition = ${list(start.x)}\nvelocity = ${list(start.v)}\nphase = ${real(start.phase)}\n`;
}

export async function copy(text: string, what: string): Promise<void> {
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

export function save(name: string, blob: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
