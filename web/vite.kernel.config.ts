// The kernel and its data alone, for a test in Node: the calls that the page makes.
import { defineConfig } from "vite";

export default defineConfig({
  build: {
    outDir: "build",
    emptyOutDir: false,
    minify: false,
    lib: { entry: { kernel: "src/kernel.ts", data: "src/data.ts" }, formats: ["es"], fileName: (_, name) => `${name}.mjs` },
  },
});
