// The page as one file: styles, scripts, workers and the kernel are put into it, so that it works from a folder.
import { readFileSync } from "node:fs";
import { gzipSync } from "node:zlib";
import { defineConfig, type Plugin } from "vite";

/** `virtual:kernel` exports the two modules of the kernel as text: gzip in base 64. */
function kernels(): Plugin {
  const text = (name: string): string =>
    JSON.stringify(gzipSync(readFileSync(new URL(`build/${name}.wasm`, import.meta.url)), { level: 9 }).toString("base64"));
  return {
    name: "kernels",
    resolveId: (id) => (id === "virtual:kernel" ? "\0kernel" : undefined),
    load: (id) => (id === "\0kernel" ? `export const fast=${text("fast")};export const plain=${text("plain")};` : undefined),
  };
}

/** Puts scripts and styles into the page. */
function whole(): Plugin {
  return {
    name: "whole",
    enforce: "post",
    generateBundle(_, bundle) {
      const page = bundle["index.html"];
      if (page?.type !== "asset") return;
      let html = String(page.source);
      for (const [name, one] of Object.entries(bundle)) {
        if (one.type === "chunk") {
          html = html.replace(/<script type="module"[^>]*><\/script>/, "");
          const code = one.code.replaceAll("</script", "<\\/script");
          html = html.replace("</body>", () => `<script type="module">${code}</script>\n</body>`);
        } else if (name.endsWith(".css")) {
          html = html.replace(/<link rel="stylesheet"[^>]*>/, () => `<style>${String(one.source)}</style>`);
        } else continue;
        delete bundle[name];
      }
      page.source = html;
    },
  };
}

export default defineConfig({
  base: "./",
  plugins: [kernels(), whole()],
  worker: { format: "iife" },
  build: { outDir: "dist", assetsInlineLimit: 1 << 24, modulePreload: false, target: "es2022" },
});
