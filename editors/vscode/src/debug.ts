// The debugger: `rtsl dap`, which speaks the debug adapter protocol on its standard streams.

import * as vscode from "vscode";

import { askPixel, askScene } from "./questions";

const TYPE = "rtsl";

/** Registers the debugger. `program` gives the path of the program, or shows why there is none. */
export function registerDebugger(
    memory: vscode.Memento,
    program: () => Promise<string | undefined>,
): vscode.Disposable {
    const descriptors = vscode.debug.registerDebugAdapterDescriptorFactory(TYPE, {
        async createDebugAdapterDescriptor() {
            const path = await program();
            return path ? new vscode.DebugAdapterExecutable(path, ["dap"]) : undefined;
        },
    });
    const configurations = vscode.debug.registerDebugConfigurationProvider(TYPE, {
        resolveDebugConfiguration: (_folder, configuration) => resolved(memory, configuration),
    });
    return vscode.Disposable.from(descriptors, configurations);
}

/** Asks for scene and pixel where there is no `launch.json`. Without a result, nothing starts. */
async function resolved(
    memory: vscode.Memento,
    configuration: vscode.DebugConfiguration,
): Promise<vscode.DebugConfiguration | undefined> {
    if (configuration.type) {
        return configuration;
    }
    const scene = await askScene(memory);
    const pixel = scene ? await askPixel(memory) : undefined;
    return pixel ? { type: TYPE, request: "launch", name: "One pixel", scene, pixel, sample: 0 } : undefined;
}
