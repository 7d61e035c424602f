// The panels of previews: one for each class, drawn anew when a shader is saved.

import { randomBytes } from "node:crypto";
import * as path from "node:path";
import * as vscode from "vscode";

import { Message, page } from "./page";
import { pictures, PreviewError, Settings } from "./renderer";

/** Opens previews, and keeps them current. */
export class Previews implements vscode.Disposable {
    private readonly panels = new Map<string, Preview>();
    private readonly saved: vscode.Disposable;

    /** `program` gives the path of the program, or shows why there is none. */
    constructor(private readonly program: () => Promise<string | undefined>) {
        // Another file may be one that the shader includes.
        this.saved = vscode.workspace.onDidSaveTextDocument((document) => {
            if (document.languageId === "rtsl") {
                this.panels.forEach((preview) => void preview.draw());
            }
        });
    }

    /** Shows a class of a file. */
    open(file: string, className: string): void {
        const key = `${file}\n${className}`;
        const existing = this.panels.get(key);
        if (existing) {
            existing.panel.reveal(undefined, true);
            return;
        }
        const preview = new Preview(file, className, this.program);
        this.panels.set(key, preview);
        preview.panel.onDidDispose(() => this.panels.delete(key));
        void preview.draw();
    }

    dispose(): void {
        this.saved.dispose();
        this.panels.forEach((preview) => preview.panel.dispose());
    }
}

/** The panel of one class. */
class Preview {
    readonly panel: vscode.WebviewPanel;
    /** Ends the drawing that is under way. */
    private drawing = new AbortController();

    constructor(
        private readonly file: string,
        private readonly className: string,
        private readonly program: () => Promise<string | undefined>,
    ) {
        const place = { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true };
        const options = { enableScripts: true, localResourceRoots: [], retainContextWhenHidden: true };
        this.panel = vscode.window.createWebviewPanel("rtsl.preview", `Preview of ${className}`, place, options);
        this.panel.webview.html = page(randomBytes(16).toString("hex"));
        this.panel.onDidDispose(() => this.drawing.abort());
    }

    /** Draws the class, each picture better than the one before. A later call takes the place of an earlier one. */
    async draw(): Promise<void> {
        this.drawing.abort();
        const { signal } = (this.drawing = new AbortController());
        const program = await this.program();
        if (!program || signal.aborted) {
            return;
        }
        this.post({ type: "status", status: "Drawing …" });
        const start = Date.now();
        try {
            for await (const { png, quality, best } of pictures(
                program,
                this.file,
                this.className,
                settings(),
                signal,
            )) {
                const { width, height, samples } = quality;
                const seconds = ((Date.now() - start) / 1000).toFixed(1);
                const status = `${width} × ${height}, ${samples} samples, ${seconds} s${best ? "" : " …"}`;
                this.post({ type: "picture", source: `data:image/png;base64,${png.toString("base64")}`, status });
            }
        } catch (error) {
            if (!signal.aborted) {
                this.post({ type: "error", text: this.explained(error) });
            }
        }
    }

    private explained(error: unknown): string {
        const text = error instanceof Error ? error.message : String(error);
        return error instanceof PreviewError ? text : `${path.basename(this.file)} can't be drawn: ${text}`;
    }

    private post(message: Message): void {
        void this.panel.webview.postMessage(message);
    }
}

function settings(): Settings {
    const configuration = vscode.workspace.getConfiguration("rtsl.preview");
    return {
        width: configuration.get("size", 640),
        samples: configuration.get("samples", 256),
        arguments: configuration.get("arguments", []),
    };
}
