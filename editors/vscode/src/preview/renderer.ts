// Renders previews: a scene in a temporary folder, with a copy of the shader beside it.

import { copyFile, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import * as path from "node:path";
import { PNG } from "pngjs";

import { declaredClasses, previewParameters } from "../classes";
import { run, searchPath } from "../program";
import { Bounds, Quality, Role, ROLES, studioScene, Subject } from "./scene";

/** The greatest number of renders that look for the exposure of a light. */
const EXPOSURE_TRIES = 5;
/** Stops by which the exposure changes while a picture is white or black. */
const EXPOSURE_STEP = 6;

const SCENE = "preview.pbrt";

/** The best picture of a preview, and further arguments of `rtsl render`. */
export interface Settings {
    width: number;
    samples: number;
    arguments: string[];
}

/** A picture of a preview. */
export interface Picture {
    /** The bytes of a PNG file. */
    png: Buffer;
    quality: Quality;
    /** True for the last picture. */
    best: boolean;
}

/** An error whose text is for the user. */
export class PreviewError extends Error {}

/** The pictures that show a class of a file, each better than the one before. */
export async function* pictures(
    program: string,
    file: string,
    className: string,
    settings: Settings,
    signal: AbortSignal,
): AsyncGenerator<Picture> {
    const folder = await mkdtemp(path.join(tmpdir(), "rtsl-preview-"));
    try {
        await copyFile(file, path.join(folder, path.basename(file)));
        const renderer = new Renderer(program, file, folder, settings, signal);
        const subject = await renderer.subject(className);
        const exposure = subject.role === "light" ? await renderer.exposure(subject) : 0;
        const steps = qualities(settings);
        for (const quality of steps) {
            const best = quality === steps.at(-1);
            // The first picture comes soonest without optimisation.
            const words = quality === steps[0] ? ["--optimise", "never"] : [];
            yield { png: await renderer.render(subject, quality, [`--exposure=${exposure}`, ...words]), quality, best };
        }
    } finally {
        await rm(folder, { recursive: true, force: true });
    }
}

/** The qualities of a preview's pictures: one at once, one soon, and the best. */
export function qualities(settings: Settings): Quality[] {
    const quality = (part: number, samples: number): Quality => {
        const width = Math.max(16, Math.round(settings.width * part));
        return { width, height: Math.round((width * 3) / 4), samples: Math.min(samples, settings.samples) };
    };
    return [quality(0.25, 1), quality(0.5, 16), quality(1, settings.samples)];
}

/** The roles of the classes that `rtsl info FILE` describes, in paragraphs whose first lines are `Name: role, role`. */
export function rolesOf(info: string): Map<string, Role> {
    const roles = new Map<string, Role>();
    for (const paragraph of info.split(/\r?\n\r?\n/)) {
        const [, name, list] = /^(\w+): ([a-z, ]+)$/m.exec(paragraph.split(/\r?\n/)[0]) ?? [];
        const role = ROLES.find((each) => list?.split(", ").includes(each));
        if (name && role) {
            roles.set(name, role);
        }
    }
    return roles;
}

/** The arguments `--param NAME=VALUE` for those parameters of a scene that are numbers. */
export function parameterArguments(parameters: string): string[] {
    const found = parameters.matchAll(/"\w+ (\w+)"\s*(?:\[([^\]"]*)\]|(-?[\d.][^\s"[\]]*))/g);
    return [...found].flatMap(([, name, list, value]) => [
        "--param",
        `${name}=${(list ?? value).trim().split(/\s+/).join(",")}`,
    ]);
}

/** The bounds in the answer of `rtsl eval FILE computeBounds --json`, if they are finite. */
export function boundsOf(answer: string): Bounds | undefined {
    const point = (variable: string): number[] | undefined => JSON.parse(answer).state?.[variable]?.lanes?.[0];
    const [low, high] = [point("rt_BoundMin"), point("rt_BoundMax")];
    const finite = (each?: number[]): each is [number, number, number] =>
        each?.length === 3 && each.every(Number.isFinite);
    return finite(low) && finite(high) && low.every((each, axis) => each <= high[axis]) ? { low, high } : undefined;
}

/** The change of the exposure, in stops, that makes the bright parts of a picture bright, but not white. */
export function exposureChange(png: Buffer): number {
    const { data } = PNG.sync.read(png);
    const values = data.filter((_, index) => index % 4 !== 3).sort();
    const bright = values[Math.floor(values.length * 0.9)];
    if (bright >= 254) return -EXPOSURE_STEP;
    if (bright < 4) return EXPOSURE_STEP;
    return Math.log2(190 / bright);
}

/** Calls of the program for one shader. */
class Renderer {
    /** The arguments for the folders of `#include` and `import`: that of the shader, and those of its `rtsl.toml`. */
    private readonly folders: string[];

    constructor(
        private readonly program: string,
        private readonly file: string,
        private readonly folder: string,
        private readonly settings: Settings,
        private readonly signal: AbortSignal,
    ) {
        const shaders = path.dirname(file);
        this.folders = [shaders, ...searchPath(shaders)].flatMap((each) => ["-I", each]);
    }

    /** What is to be shown of a class. */
    async subject(className: string): Promise<Subject> {
        const text = await readFile(this.file, "utf8");
        const declared = declaredClasses(text).find((each) => each.name === className);
        const parameters = declared ? previewParameters(text, declared) : "";
        const role = rolesOf(await this.stdout(["info", path.basename(this.file), ...this.folders])).get(className);
        if (!role) {
            const name = path.basename(this.file);
            throw new PreviewError(`${name} has no class \`${className}\` with a role such as \`rt_Material\`.`);
        }
        const bounds = role === "primitive" ? await this.bounds(className, parameters) : undefined;
        return { name: className, role, parameters, bounds };
    }

    /** The bounds of a primitive; none if it does not give them. */
    private async bounds(className: string, parameters: string): Promise<Bounds | undefined> {
        const words = ["eval", path.basename(this.file), "computeBounds", "--class", className, "--json"];
        const outcome = await this.run([...words, ...parameterArguments(parameters)]);
        return outcome.code === 0 ? boundsOf(outcome.stdout) : undefined;
    }

    /** The exposure for the scene of a light, in stops. */
    async exposure(subject: Subject): Promise<number> {
        let exposure = 0;
        for (let tries = 0; tries < EXPOSURE_TRIES; tries++) {
            const words = [`--exposure=${exposure}`, "--view", "standard", "--optimise", "never"];
            const change = exposureChange(await this.render(subject, { width: 64, height: 48, samples: 4 }, words));
            exposure += change;
            if (Math.abs(change) < EXPOSURE_STEP) break;
        }
        return exposure;
    }

    /** The bytes of a picture. */
    async render(subject: Subject, quality: Quality, words: string[]): Promise<Buffer> {
        await writeFile(path.join(this.folder, SCENE), studioScene(subject, quality));
        const picture = path.join(this.folder, "preview.png");
        await this.stdout(["render", SCENE, "-o", picture, ...this.folders, ...words, ...this.settings.arguments]);
        return readFile(picture);
    }

    /** The standard output of a successful run. */
    private async stdout(words: string[]): Promise<string> {
        const outcome = await this.run(words);
        if (outcome.code !== 0) {
            throw new PreviewError(withHint(outcome.stderr.trim() || `rtsl ended with ${outcome.code}.`));
        }
        return outcome.stdout;
    }

    private run(words: string[]) {
        return run(this.program, ["--color", "never", ...words], { cwd: this.folder, signal: this.signal });
    }
}

/** Errors in the scene of the preview are about parameters, which a comment can set. */
function withHint(text: string): string {
    if (!text.includes(`─ ${SCENE}:`)) {
        return text;
    }
    return `${text}\n\nA comment before the class sets its parameters in previews:\n\n// preview: "float radius" 2`;
}
