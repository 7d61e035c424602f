// Costs and values, in a VS Code of which only the parts exist that these tests look at.

import assert from "node:assert/strict";
import test from "node:test";

import { levelOf, movedLines } from "../src/heat";
import { loadedWith, partly } from "./stand-in";

const SHADER = "file:///a/wave.rtsl";
const TEXT = "class Wave : rt_Texture;\nvoid lookup() {\n    rt_FloatTextureValue = 1.0;\n}\n";

/** What happened in the editor, and what it remembers. */
const fresh = () => ({
    asked: [] as { command: string; argument: object }[],
    /** The lines of each colour, from the coldest. */
    colors: [] as number[][],
    saved: [] as string[],
    errors: [] as string[],
    notes: [] as string[],
    memory: new Map<string, unknown>([["scene", "/a/z.pbrt"]]),
    /** Tells of a change of the shader. */
    change: (_event: unknown): void => {},
});

let editor = fresh();

const disposable = { dispose() {} };
const document = {
    languageId: "rtsl",
    isDirty: true,
    uri: { scheme: "file", toString: () => SHADER },
    getText: () => TEXT,
    save: async () => void editor.saved.push(SHADER),
};
const textEditor = {
    document,
    selection: { active: { line: 2 } },
    setDecorations: (color: number, ranges: { line: number }[]) =>
        (editor.colors[color] = ranges.map(({ line }) => line)),
};
let types = 0;
const vscode = partly({
    Uri: { parse: (text: string) => ({ toString: () => decodeURIComponent(text) }) },
    Range: class {
        constructor(readonly line: number) {}
    },
    OverviewRulerLane: { Left: 1 },
    window: partly({
        activeTextEditor: textEditor,
        visibleTextEditors: [textEditor],
        createTextEditorDecorationType: () => types++ % 5,
        onDidChangeVisibleTextEditors: () => disposable,
        showErrorMessage: async (text: string) => void editor.errors.push(text),
        showInformationMessage: async (text: string) => void editor.notes.push(text),
        setStatusBarMessage: (text: string) => (editor.notes.push(text), disposable),
        showQuickPick: async (items: unknown[]) => items[0],
        showInputBox: async () => "3, 4",
    }),
    workspace: partly({
        textDocuments: [document],
        findFiles: async () => ["/a/b.pbrt", "/a/z.pbrt"].map((fsPath) => ({ fsPath })),
        asRelativePath: ({ fsPath }: { fsPath: string }) => fsPath.slice(3),
        onDidChangeTextDocument: (listener: (event: object) => void) => {
            editor.change = (contentChanges) => listener({ document, contentChanges });
            return disposable;
        },
    }),
});

/** Looks in a fresh editor with a shader. `answers` are those of the server's commands; errors are thrown. */
async function looksWith(answers: Record<string, unknown>) {
    const { Looks } = await loadedWith(vscode, () => import("../src/looks.js"));
    const now = (editor = fresh());
    const memory = {
        get: (key: string, otherwise?: unknown) => now.memory.get(key) ?? otherwise,
        update: async (key: string, value: unknown) => void now.memory.set(key, value),
    };
    const looks = new Looks(memory as never, async (command, argument) => {
        now.asked.push({ command, argument });
        const answer = answers[command];
        if (answer instanceof Error) {
            throw answer;
        }
        // As the client of the server does.
        looks.received(command, answer);
    });
    return { looks, ...now, change: (event: unknown) => now.change(event) };
}

const COSTS = {
    title: "Costs of lines: Wave",
    messages: "",
    files: [
        {
            uri: "file:///a/%77ave.rtsl",
            lines: [
                { line: 1, cost: 0.02 },
                { line: 2, cost: 0.9 },
            ],
        },
    ],
};

test("costs of the class at the cursor colour the margin", async () => {
    const { looks, asked, colors, saved, notes } = await looksWith({ "rtsl.lineCosts": COSTS });
    await looks.costs();
    assert.deepEqual(saved, [SHADER]);
    assert.deepEqual(asked, [{ command: "rtsl.lineCosts", argument: { uri: SHADER, class: "Wave" } }]);
    assert.deepEqual(colors, [[1], [], [], [], [2]]);
    assert.deepEqual(notes, ["Costs of lines: Wave"]);
});

test("colours follow changes until they are cleared", async () => {
    const { looks, colors, change } = await looksWith({ "rtsl.lineCosts": COSTS });
    await looks.costs();
    change([{ range: { start: { line: 0 }, end: { line: 0 } }, text: "// A wave.\n" }]);
    assert.deepEqual(colors, [[2], [], [], [], [3]]);
    change([{ range: { start: { line: 3 }, end: { line: 3 } }, text: "x" }]);
    assert.deepEqual(colors, [[2], [], [], [], []]);
    await looks.clear();
    assert.deepEqual(colors, [[], [], [], [], []]);
});

test("scenes are asked for and remembered", async () => {
    const { looks, asked, memory } = await looksWith({ "rtsl.lineCosts": COSTS });
    await looks.sceneCosts();
    // The last one is the first choice.
    assert.deepEqual(asked, [{ command: "rtsl.lineCosts", argument: { scene: "/a/z.pbrt" } }]);
    assert.equal(memory.get("scene"), "/a/z.pbrt");
});

test("a pixel is asked for and summed up", async () => {
    const answer = {
        title: "Pixel 3,4: z.pbrt",
        color: ["NaN", 0, 0.5],
        prints: [{ text: "x = 1" }],
        notFinite: [{ message: "a value is not finite" }],
        files: [],
    };
    const { looks, asked, notes, memory } = await looksWith({ "rtsl.pixel": answer });
    await looks.inspectPixel();
    assert.deepEqual(asked, [{ command: "rtsl.pixel", argument: { scene: "/a/z.pbrt", x: 3, y: 4 } }]);
    assert.deepEqual(notes, ["Pixel 3,4: z.pbrt: (NaN, 0, 0.5) · prints: x = 1 · a value is not finite"]);
    assert.equal(memory.get("pixel"), "3, 4");
});

test("errors of the server are shown", async () => {
    const { looks, errors } = await looksWith({ "rtsl.lineCosts": new Error("save `wave.rtsl` first") });
    await looks.costs();
    assert.deepEqual(errors, ["save `wave.rtsl` first"]);
});

test("lines have colours by their share of the hottest", () => {
    assert.deepEqual(
        [0.9, 0.4, 0.1, 0.05, 0.001].map((cost) => levelOf(cost, 1)),
        [4, 3, 2, 1, 0],
    );
});

test("lines move with the lines before them", () => {
    const lines = [1, 4, 9].map((line) => ({ line }));
    const moved = movedLines(lines, { first: 3, last: 5, added: 0 });
    assert.deepEqual(moved, [{ line: 1 }, { line: 7 }]);
});
