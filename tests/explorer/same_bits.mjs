// Runs of the page's kernel beside those of Python, event by event: node same_bits.mjs FOLDER. Prints what differs.
import fs from "node:fs";
import { pathToFileURL } from "node:url";

const [folder, built] = process.argv.slice(2);
const { Kernel, HEAD } = await import(pathToFileURL(`${built}/kernel.mjs`));
const { unpacked } = await import(pathToFileURL(`${built}/data.mjs`));
const read = (name) => JSON.parse(fs.readFileSync(`${folder}/${name}.json`, "utf8"));
const whole = read("machines"), runs = read("runs");
const kernel = await Kernel.of(fs.readFileSync(`${built}/plain.wasm`));
let compared = 0;
const differ = [];
for (const [name, all] of Object.entries(runs)) {
  const machine = whole.machines[name];
  machine.recordings = machine.recordings.map((r) => unpacked(r, whole.operands));
  all.forEach((run, number) => {
    try {
      kernel.compile(machine, run.values, run.start, run.t_max);
      if (!kernel.begin(run.start)) throw new Error(`mode ${kernel.missing} is missing`);
    } catch (error) {
      differ.push(`${name} ${number}: ${error.message}`);
      return;
    }
    const e = kernel.record(run.t_max, run.impacts), n = kernel.degrees;
    if (e.count !== run.rows.length || e.end !== run.end) differ.push(`${name} ${number}: ${e.count} events, not ${run.rows.length}`);
    for (let i = 0; i < Math.min(e.count, run.rows.length); ++i) {
      const row = e.rows.subarray(i * e.width, (i + 1) * e.width);
      const [status, contact, side, , high, low, before, after, phase] = row;
      const mine = [status, contact, side, high + low, before, after, phase, ...row.subarray(HEAD, HEAD + 3 * n)];
      const at = mine.findIndex((x, k) => !Object.is(x, run.rows[i][k]) && !(run.rows[i][k] === null && Number.isNaN(x)));
      compared += 1;
      if (at < 0) continue;
      differ.push(`${name} ${number}: event ${i}, number ${at}: ${mine[at]}, not ${run.rows[i][at]}`);
      break;
    }
  });
}
console.log(JSON.stringify({ compared, differ }));
