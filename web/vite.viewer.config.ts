import { defineConfig } from "vite";

/** The viewer of exported scenes: one script, which `cagefield export` puts into the file that it writes. */
export default defineConfig({
  publicDir: false,
  build: {
    outDir: "../src/cagefield/pages/viewer",
    emptyOutDir: true,
    target: "es2022",
    lib: { entry: "src/viewer/main.ts", formats: ["iife"], name: "cagefield", fileName: () => "viewer.js" },
  },
});
