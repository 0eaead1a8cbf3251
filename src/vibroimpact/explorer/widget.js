// The explorer in a notebook: the built page in a frame, whose address is the trait `link`. The page, half a megabyte,
// is asked for and kept out of the notebook's file.
const LOOKS_EVERY = 200; // milliseconds

export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.title = "vibroimpact explorer";
    frame.style.cssText = `width: 100%; height: ${model.get("height")}px; border: 0`;
    el.append(frame);
    let address = "", seen = "";
    const show = (message, buffers) => {
      URL.revokeObjectURL(address);
      address = URL.createObjectURL(new Blob([buffers[0]], { type: "text/html" }));
      seen = message.link;
      frame.src = `${address}#${seen}`;
    };
    const take = () => {
      if (model.get("link") === seen || !address) return;
      seen = model.get("link");
      frame.contentWindow.location.hash = seen;
    };
    const look = () => {
      const link = address && frame.contentDocument?.body?.dataset.ready ? frame.contentWindow.location.hash.slice(1) : "";
      if (!link || link === seen) return;
      seen = link;
      model.set("link", link);
      model.save_changes();
    };
    model.on("msg:custom", show);
    model.on("change:link", take);
    const timer = setInterval(look, LOOKS_EVERY);
    model.send({ wants: "page" });
    return () => {
      clearInterval(timer);
      model.off("msg:custom", show);
      model.off("change:link", take);
      URL.revokeObjectURL(address);
    };
  },
};
