// Bundles the extension to `out/extension.js`, or with `--tests` each test to a file in `out/test`. With `--minify`, for
// a package, the bundle is small, and the licences are beside it.

import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const folder = fileURLToPath(new URL("..", import.meta.url));
const options = process.argv.slice(2);
const common = {
    absWorkingDir: folder,
    bundle: true,
    platform: "node",
    format: "cjs",
    // That of the oldest VS Code that `engines` names.
    target: "node20",
    external: ["vscode"],
    minify: options.includes("--minify"),
    sourcemap: !options.includes("--minify"),
};

if (options.includes("--tests")) {
    const tests = readdirSync(`${folder}/test`).filter((name) => name.endsWith(".test.ts"));
    await build({ ...common, entryPoints: tests.map((name) => `test/${name}`), outdir: "out/test" });
} else {
    await build({ ...common, entryPoints: ["src/extension.ts"], outfile: "out/extension.js" });
}

if (options.includes("--minify")) {
    const licences = ["LICENSE-MIT", "LICENSE-APACHE"].map((name) => readFileSync(`${folder}/../../${name}`, "utf8"));
    writeFileSync(`${folder}/LICENSE.txt`, `MIT OR Apache-2.0, at your option.\n\n${licences.join("\n\n")}`);
}
