import assert from "node:assert/strict";
import { existsSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import * as path from "node:path";
import test from "node:test";
import { PNG } from "pngjs";

import { declaredClasses } from "../src/classes";
import {
    boundsOf,
    exposureChange,
    parameterArguments,
    Picture,
    pictures,
    qualities,
    rolesOf,
} from "../src/preview/renderer";
import { studioScene } from "../src/preview/scene";
import { findProgram, run, thisEnvironment } from "../src/program";
import { expanded, snippets } from "./snippets";

// The program of this checkout, or of `RTSL_PROGRAM`, or of the PATH. Tests that need it are skipped without one.
const BUILT = ["release", "debug"].map((profile) => path.join(__dirname, "../../../../target", profile, "rtsl"));
const PROGRAM =
    process.env.RTSL_PROGRAM ?? BUILT.find((file) => existsSync(file)) ?? findProgram("rtsl", thisEnvironment());
const withProgram = { skip: PROGRAM ? false : "there is no program `rtsl`" };

const SETTINGS = { width: 64, samples: 2, arguments: [] };

async function inFolder(check: (folder: string) => Promise<void>): Promise<void> {
    const folder = mkdtempSync(path.join(tmpdir(), "rtsl-test-"));
    try {
        await check(folder);
    } finally {
        rmSync(folder, { recursive: true });
    }
}

async function draw(file: string, className: string, most = Infinity): Promise<Picture[]> {
    const drawn: Picture[] = [];
    for await (const picture of pictures(PROGRAM!, file, className, SETTINGS, new AbortController().signal)) {
        drawn.push(picture);
        if (drawn.length >= most) break;
    }
    return drawn;
}

test("pictures become larger and smoother up to the settings", () => {
    assert.deepEqual(qualities({ width: 640, samples: 256, arguments: [] }), [
        { width: 160, height: 120, samples: 1 },
        { width: 320, height: 240, samples: 16 },
        { width: 640, height: 480, samples: 256 },
    ]);
    assert.equal(qualities({ width: 640, samples: 4, arguments: [] })[1].samples, 4);
});

test("roles are those of the program's description", () => {
    const info =
        "Ball: primitive, material\n  Some text: material\nmethods: lookup\n\nB: texture\nmethods: lookup\n\nC: none\n";
    assert.deepEqual(
        [...rolesOf(info)],
        [
            ["Ball", "material"],
            ["B", "texture"],
        ],
    );
});

test("parameters of scenes that are numbers become arguments", () => {
    const found = parameterArguments('"float radius" 2 "rgb kd" [ 1 0.5  .2 ] "texture t" "name" "integer n" [-3]');
    assert.deepEqual(found, ["--param", "radius=2", "--param", "kd=1,0.5,.2", "--param", "n=-3"]);
});

test("bounds are finite or absent", () => {
    const answer = (low: unknown, high: unknown) =>
        JSON.stringify({ state: { rt_BoundMin: { lanes: [low] }, rt_BoundMax: { lanes: [high] } } });
    assert.deepEqual(boundsOf(answer([0, -1, 0], [1, 1, 1])), { low: [0, -1, 0], high: [1, 1, 1] });
    assert.equal(boundsOf(answer(["-Infinity", 0, 0], [1, 1, 1])), undefined);
    assert.equal(boundsOf(answer([2, 0, 0], [1, 1, 1])), undefined);
    assert.equal(boundsOf("{}"), undefined);
});

test("primitives stand on the floor and have one size", () => {
    const bounds = { low: [1, 3, -2], high: [5, 4, 0] } as const;
    const subject = {
        name: "Ball",
        role: "primitive" as const,
        parameters: '"float radius" 2',
        bounds: bounds as never,
    };
    const scene = studioScene(subject, { width: 64, height: 48, samples: 3 });
    assert.match(scene, /Scale 0.5 0.5 0.5\n {2}Translate -3 -3 1\n {2}Shape "Ball" "float radius" 2\n/);
    assert.match(scene, /"integer xresolution" 64 "integer yresolution" 48\n.*"integer pixelsamples" 3\n/);
});

test("the exposure follows the bright parts", () => {
    const grey = (value: number) => {
        const png = new PNG({ width: 4, height: 4 });
        png.data.fill(value);
        return PNG.sync.write(png);
    };
    assert.ok(exposureChange(grey(255)) < -4);
    assert.ok(exposureChange(grey(0)) > 4);
    assert.ok(Math.abs(exposureChange(grey(190))) < 1e-6);
    assert.ok(Math.abs(exposureChange(grey(95)) - 1) < 1e-6);
});

test("every snippet of a class is valid, and its preview shows something", withProgram, async () => {
    await inFolder(async (folder) => {
        const texts = Object.values(snippets()).map((snippet) => ({ prefix: snippet.prefix, text: expanded(snippet) }));
        const classes = texts.filter(({ text }) => declaredClasses(text).length > 0);
        assert.equal(classes.length, 7);
        await Promise.all(classes.map(({ prefix, text }) => checkAndDraw(path.join(folder, `${prefix}.rtsl`), text)));
    });
});

async function checkAndDraw(file: string, text: string): Promise<void> {
    writeFileSync(file, text);
    const checked = await run(PROGRAM!, ["check", file, "--color", "never"]);
    assert.equal(`${checked.code}${checked.stderr}`, "0", text);
    const [first] = await draw(file, declaredClasses(text)[0].name, 1);
    const { data } = PNG.sync.read(first.png);
    assert.ok(new Set(data).size > 20, `the preview of ${file} has one colour`);
}

test("snippets inside classes are valid", withProgram, async () => {
    await inFolder(async (folder) => {
        const { Parameter, Illuminance } = snippets();
        const text =
            `class T : rt_Material;\npublic color kd = color(0.5);\n${expanded(Parameter)}` +
            `void shade() {\n${expanded(Illuminance)}rt_SampleColor *= roughness;\n}\n`;
        const file = path.join(folder, "inside.rtsl");
        writeFileSync(file, text);
        const checked = await run(PROGRAM!, ["check", file, "--color", "never"]);
        assert.equal(`${checked.code}${checked.stderr}`, "0", text);
    });
});

test("a preview ends with the picture of the settings, and finds what the shader includes", withProgram, async () => {
    await inFolder(async (folder) => {
        writeFileSync(path.join(folder, "red.rtsl"), "const vec3 RED = vec3(0.8, 0.0, 0.0);\n");
        const file = path.join(folder, "dyed.rtsl");
        const text = `#include "red.rtsl"
// preview: "float amount" 1
class Dyed : rt_Texture;
public float amount;
void lookup() { rt_TextureColor = amount * color(RED); }
`;
        writeFileSync(file, text);
        const drawn = await draw(file, "Dyed");
        assert.deepEqual(
            drawn.map(({ best }) => best),
            [false, false, true],
        );
        const { width, height, data } = PNG.sync.read(drawn[2].png);
        assert.deepEqual([width, height], [64, 48]);
        const isRed = (at: number) => data[at] > 3 * data[at + 1] && data[at] > 60;
        assert.ok(Array.from({ length: width * height }, (_, pixel) => 4 * pixel).some(isRed));
    });
});

test("errors name the file, and a missing parameter has a remedy", withProgram, async () => {
    await inFolder(async (folder) => {
        const file = path.join(folder, "broken.rtsl");
        writeFileSync(file, "class Broken : rt_Texture;\nvoid lookup() { rt_TextureColor = nothing; }\n");
        await assert.rejects(draw(file, "Broken"), /nothing[^]*─ broken\.rtsl:2:35/);
        writeFileSync(
            file,
            "class Whole : rt_Texture;\npublic float size;\nvoid lookup() { rt_FloatTextureValue = size; }\n",
        );
        await assert.rejects(draw(file, "Whole"), /size[^]*\/\/ preview: "float radius" 2/);
        await assert.rejects(draw(file, "Other"), /broken\.rtsl has no class `Other`/);
    });
});
