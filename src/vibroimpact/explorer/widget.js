// The explorer in a notebook: embed.js, which stands before this text, with the trait `link` as its state. The page, half
// a megabyte, is asked for and kept out of the notebook's file; Python is asked for compilations that it does not have.

export default {
  render({ model, el }) {
    let explorer = null, seen = "";
    const asked = new Map(); // who waits, by question
    const answer = (question) =>
      new Promise((done) => {
        asked.set(JSON.stringify(question), done);
        model.send({ question });
      });
    const hear = ({ link }) => {
      if (link === seen) return;
      seen = link;
      model.set("link", link);
      model.save_changes();
    };
    const take = () => {
      if (model.get("link") === seen) return;
      seen = model.get("link");
      explorer?.setState({ link: seen });
    };
    const receive = (message, buffers) => {
      const text = new TextDecoder().decode(buffers[0]);
      if (message.question) {
        asked.get(JSON.stringify(message.question))?.(JSON.parse(text));
        return;
      }
      explorer?.remove();
      seen = message.link;
      explorer = mount(el, text, { state: { link: seen }, height: `${model.get("height")}px`, answer });
      explorer.onState(hear);
    };
    model.on("msg:custom", receive);
    model.on("change:link", take);
    model.send({ wants: "page" });
    return () => {
      model.off("msg:custom", receive);
      model.off("change:link", take);
      explorer?.remove();
    };
  },
};
