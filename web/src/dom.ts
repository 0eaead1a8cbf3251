// Elements of the page, its line of words, and what is chosen.

import type { MachineData, Start } from "./data";

export const $ = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;
export function say(text: string): void {
  $("say").textContent = text;
}

/** The machine, its parameters, and where its motion begins. */
export const chosen: { machine: MachineData; values: Record<string, number>; start: Start } = {
  machine: null as unknown as MachineData, // before the first choose()
  values: {},
  start: { x: [], v: [], phase: 0 },
};
