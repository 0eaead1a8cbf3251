// Runs of the page's kernel beside those of Python, event by event. Chromium imports differences(); node takes the
// folder of the runs and that of the built modules, and prints what differs: node same_bits.mjs FOLDER BUILT
export function differences({ Kernel, HEAD, unpacked }, kernel, whole, runs, numbers, one_in = 1) {
  const differ = [];
  let compared = 0, at = 0;
  for (const [name, all] of Object.entries(runs)) {
    const machine = whole.machines[name];
    machine.recordings = machine.recordings.map((r) => unpacked(r, whole.operands));
    all.forEach((run, number) => {
      const width = 7 + 3 * run.start.x.length, expected = numbers.subarray(at, (at += run.count * width));
      if (number % one_in) return;
      try {
        kernel.compile(machine, run.values, run.start, run.t_max);
        if (!kernel.begin(run.start)) throw new Error(`mode ${kernel.missing} is missing`);
      } catch (error) {
        differ.push(`${name} ${number}: ${error.message}`);
        return;
      }
      const e = kernel.record(run.t_max, run.impacts);
      if (e.count !== run.count || e.end !== run.end) differ.push(`${name} ${number}: ${e.count} events, not ${run.count}`);
      for (let i = 0; i < Math.min(e.count, run.count); ++i) {
        const row = e.rows.subarray(i * e.width, (i + 1) * e.width);
        const [status, contact, side, , high, low, before, after, phase] = row;
        const mine = [status, contact, side, high + low, before, after, phase, ...row.subarray(HEAD, HEAD + width - 7)];
        const other = mine.findIndex((x, k) => !Object.is(x, expected[i * width + k]));
        compared += 1;
        if (other < 0) continue;
        differ.push(`${name} ${number}: event ${i}, number ${other}: ${mine[other]}, not ${expected[i * width + other]}`);
        break;
      }
    });
  }
  return { compared, differ };
}

const ONE_IN = 20; // of the runs with the module that computes fma without the instruction, which is slow

if (globalThis.process?.argv) {
  const fs = await import("node:fs"), { pathToFileURL } = await import("node:url");
  const [folder, built] = process.argv.slice(2), read = (name) => JSON.parse(fs.readFileSync(`${folder}/${name}.json`, "utf8"));
  const modules = { ...(await import(pathToFileURL(`${built}/kernel.mjs`))), ...(await import(pathToFileURL(`${built}/data.mjs`))) };
  const kernel = await modules.Kernel.of(fs.readFileSync(`${built}/plain.wasm`)), bytes = fs.readFileSync(`${folder}/numbers`);
  const numbers = new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
  console.log(JSON.stringify(differences(modules, kernel, read("machines"), read("runs"), numbers, ONE_IN)));
}
