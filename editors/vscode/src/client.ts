// The language server: `rtsl lsp`.

import * as vscode from "vscode";
import {
    CloseAction,
    ErrorAction,
    ErrorHandler,
    LanguageClient,
    LanguageClientOptions,
    ServerOptions,
    TransportKind,
} from "vscode-languageclient/node";

/** Starts, restarts and ends the language server. */
export class LanguageServer implements vscode.Disposable {
    private client: LanguageClient | undefined;
    private readonly files = vscode.workspace.createFileSystemWatcher("**/{*.rtsl,rtsl.toml}");
    /** The last start or end; each waits for the one before. */
    private last: Promise<void> = Promise.resolve();

    /**
     * `program` gives the path of the program, or shows why there is none; `received` gets the answers to commands of
     * the server, those of code lenses too.
     */
    constructor(
        private readonly program: () => Promise<string | undefined>,
        private readonly received: (command: string, answer: unknown) => void,
    ) {}

    /** Runs a command of the server, and returns its answer. */
    async execute(command: string, argument: object): Promise<unknown> {
        if (!this.client) {
            throw new Error("The language server does not run. The command *RTSL: Restart language server* starts it.");
        }
        // The client has registered the commands of the server.
        return vscode.commands.executeCommand(command, argument);
    }

    /** Ends the server that runs, if any, and starts one. */
    restart(): Promise<void> {
        return this.next(async () => {
            await this.end();
            await this.start();
        });
    }

    dispose(): Promise<void> {
        this.files.dispose();
        return this.next(() => this.end());
    }

    private next(step: () => Promise<void>): Promise<void> {
        this.last = this.last.then(step, step);
        return this.last;
    }

    private async start(): Promise<void> {
        const command = await this.program();
        if (!command) {
            return;
        }
        const server: ServerOptions = { command, args: ["lsp"], transport: TransportKind.stdio };
        const startup = new Startup();
        const options: LanguageClientOptions = {
            documentSelector: [{ language: "rtsl" }],
            synchronize: { fileEvents: this.files },
            errorHandler: startup,
            initializationFailedHandler: () => false,
            middleware: {
                executeCommand: async (command, values, next) => {
                    const answer = await next(command, values);
                    this.received(command, answer);
                    return answer;
                },
            },
        };
        const client = new LanguageClient("rtsl", "RTSL", server, options);
        try {
            await client.start();
            startup.endsWith(client.createDefaultErrorHandler());
            this.client = client;
        } catch (error) {
            this.report(command, error, client);
        }
    }

    private report(command: string, error: unknown, client: LanguageClient): void {
        const reason = (error instanceof Error ? error.message : String(error)).replace(/\.?\s*$/, ".");
        const show = "Show output";
        const remedy = `Does \`${command} lsp\` exist? Older versions have none.`;
        const text = `The language server did not start: ${reason} ${remedy}`;
        void vscode.window
            .showErrorMessage(text, show)
            .then((choice) => choice === show && client.outputChannel.show());
    }

    private async end(): Promise<void> {
        const { client } = this;
        this.client = undefined;
        await client?.dispose();
    }
}

/** Handles errors silently while the server starts, since the start then fails, and leaves later ones to another. */
class Startup implements ErrorHandler {
    private later: ErrorHandler | undefined;

    endsWith(handler: ErrorHandler): void {
        this.later = handler;
    }

    error(...details: Parameters<ErrorHandler["error"]>): ReturnType<ErrorHandler["error"]> {
        return this.later?.error(...details) ?? { action: ErrorAction.Shutdown, handled: true };
    }

    closed(): ReturnType<ErrorHandler["closed"]> {
        return this.later?.closed() ?? { action: CloseAction.DoNotRestart, handled: true };
    }
}
