// The page in a frame of another one: the messages of src/vibroimpact/explorer/embed.js.

import type { Recording, Start } from "./data";

export interface State extends Question {
  link: string; // permalink
}
export interface Question {
  machine: string;
  values: Record<string, number>;
  start: Start;
}
export interface Changes {
  machine?: string;
  values?: Record<string, number>;
  start?: Partial<Start>;
  link?: string; // which names all of these
}
export interface Answer {
  refused?: string;
  recording?: Recording;
}
interface Heard {
  state?: Changes;
  panels?: string[];
  scheme?: string; // "light" or "dark", the system's for any other
  answers?: boolean;
  question?: Question;
  answer?: Answer;
}

const host = window.parent === window ? null : window.parent;
const waiting = new Map<string, (answer: Answer) => void>(); // by question
let answers = false;

function send(message: object): void {
  host?.postMessage({ vibroimpact: message }, "*");
}

/** Tell the host the state, where there is one. */
export function tell(state: State): void {
  send({ state });
}

/** Say that the page is ready, and hear what is set. */
export function listenToHost(
  set: (changes: Changes) => Promise<void>, show: (panels: string[]) => void, shade: (scheme: string) => void,
): void {
  addEventListener("message", ({ source, data }: MessageEvent<{ vibroimpact?: Heard } | null>) => {
    const heard = data?.vibroimpact;
    if (source !== host || !heard) return;
    if (heard.answers) answers = true;
    if (heard.scheme) shade(heard.scheme);
    if (heard.panels?.length) show(heard.panels);
    if (heard.state && Object.keys(heard.state).length) void set(heard.state);
    if (heard.question) {
      const key = JSON.stringify(heard.question);
      waiting.get(key)?.(heard.answer ?? {});
      waiting.delete(key);
    }
  });
  send({ ready: true });
}

/** Ask for a compilation: of the command that serves the page, or of the host. Null where neither is there. */
export function ask(question: Question, served: boolean): Promise<Answer> | null {
  if (served) return fetch("recording", { method: "POST", body: JSON.stringify(question) }).then((answer) => answer.json());
  if (!answers) return null;
  send({ question });
  return new Promise((done) => waiting.set(JSON.stringify(question), done));
}
