// The explorer's page as a part of another one: a frame, and messages by which its state is set and told.
//
//   const explorer = mount(element, page, { state, panels, height, answer });
//   explorer.setState({ values: { omega: 0.9 } });
//   explorer.onState((state) => console.log(state.machine, state.values, state.start));
//
// A state is {machine: name, values: {parameter: number}, start: {x: [...], v: [...], phase}}; one that is told has also
// its permalink, `link`. To set one, what it does not name stays; {link} sets what the link names. The page is the text
// of page_with() in page.py, or the address of such a file. It is light or dark as the element is by its color-scheme,
// also where an attribute of <html> changes that.

/**
 * Show the page in an element.
 *
 * @param element where the frame goes
 * @param page the page's text, or its address as a URL
 * @param options state: what is set at first; panels: names of those that are shown, all by default, of "controls",
 *   "motion", "history", "section", "diagram", "plane", "basins"; height: of the frame, a length of CSS;
 *   answer: gives what answer_of() of page.py does for a question, where the page has no compilation for its values
 * @returns setState(state), onState(hear): hear is called with every new state, the first one too; it returns what
 *   ends that; remove()
 */
export function mount(element, page, { state = {}, panels = [], height = "44rem", answer = null } = {}) {
  const frame = document.createElement("iframe"), hearers = new Set();
  let ready = false, last = null, waiting = state;
  frame.title = "vibroimpact explorer";
  frame.allow = "clipboard-write";
  frame.loading = "lazy"; // one that is not seen computes nothing
  frame.style.cssText = `width: 100%; height: ${height}; border: 0`;
  const send = (message) => frame.contentWindow?.postMessage({ vibroimpact: message }, "*");
  const shade = () => send({ scheme: getComputedStyle(element).colorScheme });
  const shades = new MutationObserver(shade);
  const tell = () => hearers.forEach((one) => one(last));
  const hear = async ({ source, data }) => {
    const message = data?.vibroimpact;
    if (source !== frame.contentWindow || !message) return;
    if (message.ready) {
      ready = true;
      if (Object.keys(waiting).length) last = null; // of its own; the page will tell that which is set
      else tell();
      send({ state: waiting, panels, answers: answer !== null });
      shade();
    } else if (message.question) {
      send({ question: message.question, answer: await answer(message.question) });
    } else if (message.state) {
      last = message.state;
      if (ready) tell();
    }
  };
  addEventListener("message", hear);
  shades.observe(document.documentElement, { attributes: true });
  if (page instanceof URL) frame.src = page.href;
  else frame.srcdoc = page;
  element.append(frame);
  return {
    setState(changes) {
      if (ready) send({ state: changes });
      else waiting = { ...waiting, ...changes };
    },
    onState(one) {
      hearers.add(one);
      if (ready && last) one(last);
      return () => hearers.delete(one);
    },
    remove() {
      removeEventListener("message", hear);
      shades.disconnect();
      frame.remove();
    },
  };
}
