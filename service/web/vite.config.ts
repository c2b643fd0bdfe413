import { defineConfig } from "vite";

// The page lives under whatever path the service has, and talks to it alone.
export default defineConfig({
  base: "./",
  oxc: { jsx: { runtime: "automatic", importSource: "preact" } },
  build: {
    target: "es2022",
    outDir: "dist",
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 700, // three.js, loaded when a mesh is shown
  },
  server: {
    proxy: Object.fromEntries(
      ["/v1", "/docs", "/healthz", "/readyz", "/openapi.json"].map((path) => [path, "http://127.0.0.1:8000"]),
    ),
  },
});
