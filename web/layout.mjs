// Writes src/field/layout.ts from the constants of Python; with --check, fails where the file differs from them.
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";

const target = fileURLToPath(new URL("src/field/layout.ts", import.meta.url));
const python = process.env.PYTHON ?? "python3";
const constants = JSON.parse(
  execFileSync(python, ["-m", "cagefield.pages.shader_constants"], { encoding: "utf8" }),
);
const objects = Object.entries(constants).map(([name, values]) => {
  const lines = Object.entries(values).map(([key, value]) => `  ${key}: ${value},\n`);
  return `\nexport const ${name} = {\n${lines.join("")}} as const;\n`;
});
const banner = `// Made by \`npm run layout\` from src/cagefield/pages/shader_constants.py; change that.\n`;
const source = banner + objects.join("");

if (!process.argv.includes("--check")) {
  writeFileSync(target, source);
} else if (readFileSync(target, "utf8") !== source) {
  console.error("web/src/field/layout.ts differs from the constants of Python: run `npm run layout`");
  process.exit(1);
}
