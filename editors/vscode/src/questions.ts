// Questions about scenes and pixels. The answers are remembered, and are the first choice the next time.

import * as vscode from "vscode";

const SCENE = "scene";
const PIXEL = "pixel";

/** Asks for a scene of the folder. Without a result, a message has told why, or the user wants none. */
export async function askScene(memory: vscode.Memento): Promise<string | undefined> {
    const scenes = await vscode.workspace.findFiles("**/*.{pbrt,gltf,glb}", "**/{node_modules,target}/**", 500);
    const items = scenes.map((uri) => ({ label: vscode.workspace.asRelativePath(uri), path: uri.fsPath }));
    if (items.length === 0) {
        void vscode.window.showErrorMessage("There is no scene (.pbrt, .gltf, .glb) in the folder.");
        return undefined;
    }
    const last = memory.get<string>(SCENE);
    const rank = ({ path }: { path: string }) => (path === last ? 0 : 1);
    items.sort((one, other) => rank(one) - rank(other) || one.label.localeCompare(other.label));
    const chosen = (await vscode.window.showQuickPick(items, { title: "Scene" }))?.path;
    if (chosen) {
        await memory.update(SCENE, chosen);
    }
    return chosen;
}

/** Asks for the column and the row of a pixel. */
export async function askPixel(memory: vscode.Memento): Promise<[number, number] | undefined> {
    const answer = await vscode.window.showInputBox({
        title: "Pixel: column, row",
        prompt: "Counted from 0, from the top left",
        value: memory.get(PIXEL, "0, 0"),
        validateInput: (text) => (parsePixel(text) ? undefined : "Two whole numbers, such as 320, 240"),
    });
    const pixel = answer === undefined ? undefined : parsePixel(answer);
    if (pixel) {
        await memory.update(PIXEL, answer);
    }
    return pixel;
}

function parsePixel(text: string): [number, number] | undefined {
    const [, column, row] = /^\s*(\d+)\s*,\s*(\d+)\s*$/.exec(text) ?? [];
    return row === undefined ? undefined : [Number(column), Number(row)];
}
