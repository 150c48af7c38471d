/// <reference types="vite/client" />
import ts from "typescript";
import { expect, it } from "vitest";

/** Imports of each module of `src`, types included, by the paths of the modules. */
function importGraph(sources: Record<string, string>): Map<string, string[]> {
  const imports = (path: string): string[] =>
    ts
      .preProcessFile(sources[path])
      .importedFiles.map(({ fileName }) => new URL(`${fileName}.ts`, `file://${path}`).pathname)
      .filter((target) => target in sources);
  return new Map(Object.keys(sources).map((path) => [path, imports(path)]));
}

/** The first cycle of a graph, as a path that ends at its start; null for an acyclic graph. */
function findCycle(graph: Map<string, string[]>): string[] | null {
  const finished = new Set<string>();
  const visit = (node: string, path: string[]): string[] | null => {
    if (path.includes(node)) return [...path.slice(path.indexOf(node)), node];
    if (finished.has(node)) return null;
    for (const next of graph.get(node) ?? []) {
      const cycle = visit(next, [...path, node]);
      if (cycle !== null) return cycle;
    }
    finished.add(node);
    return null;
  };
  for (const node of graph.keys()) {
    const cycle = visit(node, []);
    if (cycle !== null) return cycle;
  }
  return null;
}

it("modules import each other without a cycle, type imports included", () => {
  const sources = import.meta.glob<string>("/src/**/*.ts", { query: "?raw", import: "default", eager: true });
  const graph = importGraph(sources);
  expect([...graph.values()].flat().length).toBeGreaterThan(100);
  expect(findCycle(graph)).toBeNull();
});

it("a cycle of two modules is found", () => {
  const graph = new Map([
    ["a", ["b"]],
    ["b", ["c"]],
    ["c", ["b"]],
  ]);
  expect(findCycle(graph)).toEqual(["b", "c", "b"]);
});
