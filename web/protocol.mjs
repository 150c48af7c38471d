// Writes src/net/protocol.ts from the server's schema; with --check, says whether it is what the schema gives.
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { compile } from "json-schema-to-typescript";

const target = fileURLToPath(new URL("src/net/protocol.ts", import.meta.url));
const python = process.env.PYTHON ?? "python3";
const schema = JSON.parse(
  execFileSync(python, ["-m", "cagefield.server.protocol.schema"], { encoding: "utf8" }),
);
const compiled = await compile(schema, "Protocol", {
  additionalProperties: false,
  bannerComment:
    "// Made by `npm run protocol` from what src/cagefield/server/protocol/schema.py collects; change that.",
  unreachableDefinitions: true,
  strictIndexSignatures: true,
  style: { printWidth: 110 },
});
const types = compiled
  .replace(
    /\n? \* This interface was referenced by `Protocol`'s JSON-Schema\n \* via the `definition` "\w+"\.\n/g,
    "",
  )
  .replace(/\/\*\* *\*\/\n/g, "")
  .replace(/\n *\*\n? \*\//g, "\n */")
  .replace("export interface Protocol {}\n", "");

if (!process.argv.includes("--check")) {
  writeFileSync(target, types);
} else if (readFileSync(target, "utf8") !== types) {
  console.error("web/src/net/protocol.ts is not what the server says: run `npm run protocol`");
  process.exit(1);
}
