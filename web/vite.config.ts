import { defineConfig } from "vitest/config";

export default defineConfig({
  base: "./",
  publicDir: false,
  build: {
    outDir: "../src/cagefield/server/web/static",
    emptyOutDir: true,
    target: "es2022",
    chunkSizeWarningLimit: 1000,
    modulePreload: { polyfill: false },
    rollupOptions: {
      output: {
        entryFileNames: "editor.js",
        chunkFileNames: "[name].js",
        assetFileNames: "editor[extname]",
      },
    },
  },
  server: {
    proxy: {
      "/socket": {
        target: "ws://localhost:8741",
        ws: true,
        headers: { origin: "http://localhost:8741" },
        changeOrigin: true,
      },
    },
  },
  test: { include: ["tests/**/*.test.ts"] },
});
