// The extension: what VS Code calls, and what calls it.

import * as vscode from "vscode";

import { classAt, methodAt } from "./classes";
import { LanguageServer } from "./client";
import { benchCommand, testCommand } from "./commands";
import { registerDebugger } from "./debug";
import { Looks } from "./looks";
import { Previews } from "./preview/panel";
import { findProgram, thisEnvironment } from "./program";

const INSTRUCTIONS = "https://github.com/rtsl-lang/rtsl/blob/main/docs/src/how-to/editors.md";

export async function activate(context: vscode.ExtensionContext): Promise<void> {
    const server: LanguageServer = new LanguageServer(program, (...answer) => looks.received(...answer));
    const looks = new Looks(context.workspaceState, (...asked) => server.execute(...asked));
    const previews = new Previews(program);
    const command = (name: string, run: (...values: unknown[]) => unknown) =>
        vscode.commands.registerCommand(name, run);
    context.subscriptions.push(
        previews,
        looks,
        { dispose: () => void server.dispose() },
        registerDebugger(context.workspaceState, program),
        command("rtsl.restart", () => server.restart()),
        command("rtsl.preview", () => preview(previews)),
        command("rtsl.test", (...place) => runInTerminal("Test", place, testCommand)),
        command("rtsl.bench", (...place) => runInTerminal("Bench", place, benchCommand)),
        command("rtsl.costs", () => looks.costs()),
        command("rtsl.sceneCosts", () => looks.sceneCosts()),
        command("rtsl.inspectPixel", () => looks.inspectPixel()),
        command("rtsl.clear", () => looks.clear()),
        vscode.workspace.onDidChangeConfiguration((change) => {
            if (change.affectsConfiguration("rtsl.path")) {
                void server.restart();
            }
        }),
    );
    await server.restart();
}

/** The path of the program. If there is none, a message has the remedies. */
async function program(): Promise<string | undefined> {
    const setting = vscode.workspace.getConfiguration("rtsl").get("path", "rtsl");
    const found = findProgram(setting, thisEnvironment());
    if (!found) {
        void reportMissing(setting);
    }
    return found;
}

async function reportMissing(setting: string): Promise<void> {
    const [settings, instructions] = ["Set its path", "Installation"];
    const text =
        `The program \`${setting}\` was not found. \`cargo install --path crates/rtsl-cli\` in a checkout of RTSL ` +
        "installs it; the setting `rtsl.path` names one in another place.";
    const choice = await vscode.window.showErrorMessage(text, settings, instructions);
    if (choice === settings) {
        await vscode.commands.executeCommand("workbench.action.openSettings", "rtsl.path");
    } else if (choice === instructions) {
        await vscode.env.openExternal(vscode.Uri.parse(INSTRUCTIONS));
    }
}

/** A place in a file: what code lenses give, or where the cursor is. */
interface Place {
    file: string;
    className?: string;
    method?: string;
}

/** The place at the cursor of the active editor. Without a result, a message has told why. */
async function placeAtCursor(): Promise<Place | undefined> {
    const editor = vscode.window.activeTextEditor;
    if (editor?.document.languageId !== "rtsl" || editor.document.uri.scheme !== "file") {
        void vscode.window.showErrorMessage("Open a shader first: a file that ends in .rtsl.");
        return undefined;
    }
    // The program reads files.
    await editor.document.save();
    const text = editor.document.getText();
    const { line } = editor.selection.active;
    return {
        file: editor.document.uri.fsPath,
        className: classAt(text, line)?.name,
        method: methodAt(text, line),
    };
}

async function preview(previews: Previews): Promise<void> {
    const place = await placeAtCursor();
    if (place?.className) {
        previews.open(place.file, place.className);
    } else if (place) {
        void vscode.window.showErrorMessage("The file declares no class, so there is nothing to show.");
    }
}

/** Runs a command for a place: that of the arguments `[uri, class, method]`, or the one at the cursor. */
async function runInTerminal(
    name: string,
    values: unknown[],
    words: (file: string, className?: string, method?: string) => string[],
): Promise<void> {
    const place = placeOf(values) ?? (await placeAtCursor());
    const path = place && (await program());
    if (!path) {
        return;
    }
    const line = words(place.file, place.className, place.method);
    const execution = new vscode.ProcessExecution(path, line);
    const title = [name, place.className ?? place.file].join(" ");
    const folder = vscode.workspace.getWorkspaceFolder(vscode.Uri.file(place.file)) ?? vscode.TaskScope.Global;
    const task = new vscode.Task({ type: "process" }, folder, title, "RTSL", execution, "$rtsl");
    task.presentationOptions = { clear: true, panel: vscode.TaskPanelKind.Dedicated };
    await vscode.tasks.executeTask(task);
}

/** The place that a code lens gives. Menus give the URI of the editor alone, or of a file, whose cursor counts. */
function placeOf([uri, className, method]: unknown[]): Place | undefined {
    if (typeof uri !== "string") {
        return undefined;
    }
    const text = (value: unknown) => (typeof value === "string" ? value : undefined);
    return { file: vscode.Uri.parse(uri).fsPath, className: text(className), method: text(method) };
}
