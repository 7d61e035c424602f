// Draws the picture of the README: the previews of the snippets, side by side.

import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import * as path from "node:path";
import { PNG } from "pngjs";

import { declaredClasses } from "../src/classes";
import { pictures } from "../src/preview/renderer";
import { findProgram, thisEnvironment } from "../src/program";
import { expanded, snippets } from "../test/snippets";

const PREFIXES = ["material", "texture", "field", "light", "camera", "integrator"];
const COLUMNS = 3;
const SETTINGS = { width: 320, samples: 256, arguments: [] };

/** The last picture of a preview. */
async function best(program: string, file: string, className: string): Promise<PNG> {
    let png: PNG | undefined;
    for await (const picture of pictures(program, file, className, SETTINGS, new AbortController().signal)) {
        png = PNG.sync.read(picture.png);
    }
    return png!;
}

async function main(out: string): Promise<void> {
    const program = process.env.RTSL_PROGRAM ?? findProgram("rtsl", thisEnvironment());
    if (!program) throw new Error("there is no program `rtsl`; `RTSL_PROGRAM` names one");
    const folder = mkdtempSync(path.join(tmpdir(), "rtsl-pictures-"));
    const [width, height] = [SETTINGS.width, (SETTINGS.width * 3) / 4];
    const whole = new PNG({ width: COLUMNS * width, height: Math.ceil(PREFIXES.length / COLUMNS) * height });
    for (const [index, prefix] of PREFIXES.entries()) {
        const text = expanded(Object.values(snippets()).find((each) => each.prefix === prefix)!);
        const file = path.join(folder, `${prefix}.rtsl`);
        writeFileSync(file, text);
        const png = await best(program, file, declaredClasses(text)[0].name);
        PNG.bitblt(png, whole, 0, 0, width, height, (index % COLUMNS) * width, Math.floor(index / COLUMNS) * height);
    }
    writeFileSync(out, PNG.sync.write(whole, { colorType: 2 }));
    rmSync(folder, { recursive: true });
}

void main(process.argv[2]);
