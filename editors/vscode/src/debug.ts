// The debugger: `rtsl dap`, which speaks the debug adapter protocol on its standard streams.

import * as vscode from "vscode";

const TYPE = "rtsl";

/** Registers the debugger. `program` gives the path of the program, or shows why there is none. */
export function registerDebugger(program: () => Promise<string | undefined>): vscode.Disposable {
    const descriptors = vscode.debug.registerDebugAdapterDescriptorFactory(TYPE, {
        async createDebugAdapterDescriptor() {
            const path = await program();
            return path ? new vscode.DebugAdapterExecutable(path, ["dap"]) : undefined;
        },
    });
    const configurations = vscode.debug.registerDebugConfigurationProvider(TYPE, { resolveDebugConfiguration });
    return vscode.Disposable.from(descriptors, configurations);
}

/** Asks for scene and pixel where there is no `launch.json`. Without a result, nothing starts. */
async function resolveDebugConfiguration(
    _folder: vscode.WorkspaceFolder | undefined,
    configuration: vscode.DebugConfiguration,
): Promise<vscode.DebugConfiguration | undefined> {
    if (configuration.type) {
        return configuration;
    }
    const scene = await askScene();
    const pixel = scene ? await askPixel() : undefined;
    return pixel ? { type: TYPE, request: "launch", name: "One pixel", scene, pixel, sample: 0 } : undefined;
}

async function askScene(): Promise<string | undefined> {
    const scenes = await vscode.workspace.findFiles("**/*.{pbrt,gltf,glb}", "**/{node_modules,target}/**", 500);
    const items = scenes.map((uri) => ({ label: vscode.workspace.asRelativePath(uri), path: uri.fsPath }));
    if (items.length === 0) {
        void vscode.window.showErrorMessage(
            "There is no scene (.pbrt, .gltf, .glb) in the folder, so no pixel to follow.",
        );
        return undefined;
    }
    items.sort((one, other) => one.label.localeCompare(other.label));
    return (await vscode.window.showQuickPick(items, { title: "Scene" }))?.path;
}

async function askPixel(): Promise<number[] | undefined> {
    const answer = await vscode.window.showInputBox({
        title: "Pixel: column, row",
        prompt: "Counted from 0, from the top left",
        value: "0, 0",
        validateInput: (text) => (parsePixel(text) ? undefined : "Two whole numbers, such as 320, 240"),
    });
    return answer === undefined ? undefined : parsePixel(answer);
}

const parsePixel = (text: string) => /^\s*(\d+)\s*,\s*(\d+)\s*$/.exec(text)?.slice(1).map(Number);
