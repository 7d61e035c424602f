// Costs of lines and values of a pixel: the commands of the language server that run shaders. The server shows their
// results as hints and diagnostics; this file asks for what they need, and colours the margin.

import * as vscode from "vscode";

import { classAt } from "./classes";
import { COLORS, HotLine, levelOf, movedLines } from "./heat";
import { askPixel, askScene } from "./questions";

/** The commands of the server. */
export const LINE_COSTS = "rtsl.lineCosts";
export const PIXEL = "rtsl.pixel";
export const CLEAR = "rtsl.clearLooks";

/** The parts of the server's answers that are shown here. */
interface Answer {
    title: string;
    messages?: string;
    files: { uri: string; lines: HotLine[] }[];
    color?: unknown[];
    prints?: { text: string }[];
    notFinite?: { message: string }[];
}

/** The time for which the status bar shows a result, in milliseconds. */
const SHOWN = 10_000;

/** Runs the commands, and shows the costs of lines as colours. */
export class Looks implements vscode.Disposable {
    /** The lines with colours, by the URIs of their files. */
    private heat = new Map<string, HotLine[]>();
    /** The greatest cost of a line. */
    private hottest = 0;
    private readonly colors = COLORS.map(colorOfMargin);
    private readonly events: vscode.Disposable[];

    /** `execute` runs a command of the server, whose answer goes to `received`. */
    constructor(
        private readonly memory: vscode.Memento,
        private readonly execute: (command: string, argument: object) => Promise<unknown>,
    ) {
        this.events = [
            vscode.window.onDidChangeVisibleTextEditors(() => this.color()),
            vscode.workspace.onDidChangeTextDocument((change) => this.move(change)),
        ];
    }

    /** Shows the costs of the class at the cursor, for random inputs. */
    async costs(): Promise<void> {
        const editor = vscode.window.activeTextEditor;
        if (editor?.document.languageId !== "rtsl" || editor.document.uri.scheme !== "file") {
            void vscode.window.showErrorMessage("Open a shader first: a file that ends in .rtsl.");
            return;
        }
        const uri = editor.document.uri.toString();
        const className = classAt(editor.document.getText(), editor.selection.active.line)?.name;
        await this.run(LINE_COSTS, { uri, class: className });
    }

    /** Asks for a scene, and shows the costs of all its shaders. */
    async sceneCosts(): Promise<void> {
        const scene = await askScene(this.memory);
        if (scene) {
            await this.run(LINE_COSTS, { scene });
        }
    }

    /** Asks for a pixel of a scene, and shows the values that its shaders compute. */
    async inspectPixel(): Promise<void> {
        const scene = await askScene(this.memory);
        const pixel = scene ? await askPixel(this.memory) : undefined;
        if (pixel) {
            const [x, y] = pixel;
            await this.run(PIXEL, { scene, x, y });
        }
    }

    /** Shows no costs and values any more. */
    async clear(): Promise<void> {
        await this.run(CLEAR, {});
    }

    /** Shows the answer to a command of the server, which code lenses run, too. */
    received(command: string, answer: unknown): void {
        if (command === CLEAR) {
            this.heat.clear();
        } else if (command === LINE_COSTS) {
            const { title, files, messages } = answer as Answer;
            this.heat = new Map(files.map(({ uri, lines }) => [normalised(uri), lines]));
            this.hottest = Math.max(0, ...files.flatMap(({ lines }) => lines.map(({ cost }) => cost)));
            void vscode.window.setStatusBarMessage([title, messages].filter((text) => text).join(". "), SHOWN);
        } else if (command === PIXEL) {
            void vscode.window.showInformationMessage(summary(answer as Answer));
        }
        this.color();
    }

    dispose(): void {
        [...this.events, ...this.colors].forEach((each) => each.dispose());
    }

    /** Runs a command of the server, which reads files: shaders that have changed are saved before. */
    private async run(command: string, argument: object): Promise<void> {
        const shaders = vscode.workspace.textDocuments.filter(({ languageId }) => languageId === "rtsl");
        await Promise.all(shaders.filter(({ isDirty }) => isDirty).map((document) => document.save()));
        try {
            await this.execute(command, argument);
        } catch (error) {
            void vscode.window.showErrorMessage(error instanceof Error ? error.message : String(error));
        }
    }

    /** Colours the margins of all visible editors. */
    private color(): void {
        for (const editor of vscode.window.visibleTextEditors) {
            const lines = this.heat.get(editor.document.uri.toString()) ?? [];
            this.colors.forEach((color, level) => {
                const here = lines.filter(({ cost }) => levelOf(cost, this.hottest) === level);
                editor.setDecorations(
                    color,
                    here.map(({ line }) => new vscode.Range(line, 0, line, 0)),
                );
            });
        }
    }

    /** Moves the colours of a text that changes; lines that change lose theirs. */
    private move({ document, contentChanges }: vscode.TextDocumentChangeEvent): void {
        const uri = document.uri.toString();
        let lines = this.heat.get(uri);
        if (!lines || contentChanges.length === 0) {
            return;
        }
        for (const { range, text } of contentChanges) {
            const added = text.split("\n").length - 1;
            lines = movedLines(lines, { first: range.start.line, last: range.end.line, added });
        }
        this.heat.set(uri, lines);
        this.color();
    }
}

/** A bar beside the numbers of lines, and a mark beside the scroll bar. */
function colorOfMargin(color: string): vscode.TextEditorDecorationType {
    const rectangle = `<rect x="10" width="4" height="16" fill="${color}"/>`;
    const bar = `<svg xmlns="http://www.w3.org/2000/svg" width="16" height="16">${rectangle}</svg>`;
    return vscode.window.createTextEditorDecorationType({
        gutterIconPath: vscode.Uri.parse(`data:image/svg+xml;base64,${Buffer.from(bar).toString("base64")}`),
        gutterIconSize: "contain",
        overviewRulerColor: color,
        overviewRulerLane: vscode.OverviewRulerLane.Left,
    });
}

/** The URI as VS Code writes it: servers and editors escape different characters. */
const normalised = (uri: string) => vscode.Uri.parse(uri).toString();

function summary({ title, color, prints = [], notFinite = [] }: Answer): string {
    const parts = [`${title}: (${(color ?? []).join(", ")})`];
    if (prints.length > 0) {
        const shown = prints.slice(-5).map(({ text }) => text);
        parts.push(`${prints.length > 5 ? "last prints" : "prints"}: ${shown.join("; ")}`);
    }
    parts.push(...notFinite.slice(0, 1).map(({ message }) => message));
    return parts.join(" · ");
}
