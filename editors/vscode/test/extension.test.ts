// The bundle of the extension, in a VS Code of which only the parts exist that these tests look at.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import * as path from "node:path";
import test from "node:test";

import { loadedWith, partly } from "./stand-in";

const FOLDER = path.join(__dirname, "../..");
const MANIFEST = JSON.parse(readFileSync(path.join(FOLDER, "package.json"), "utf8"));

type Command = (...values: unknown[]) => unknown;

/** What the extension did. */
interface Recorded {
    commands: Map<string, Command>;
    errors: string[];
    tasks: { title: string; process: string; words: string[]; matcher: string }[];
    debuggers: Map<string, { createDebugAdapterDescriptor(): Promise<unknown> }>;
}

function fakeVscode(program: string, recorded: Recorded) {
    const disposable = { dispose() {} };
    return partly({
        version: "1.91.0",
        Disposable: { from: () => disposable },
        EventEmitter: class {
            event = () => disposable;
            fire() {}
            dispose() {}
        },
        Uri: {
            parse: (text: string) => ({ fsPath: new URL(text).pathname }),
            file: (file: string) => ({ fsPath: file }),
        },
        OverviewRulerLane: { Left: 1 },
        TaskScope: { Global: 1 },
        TaskPanelKind: { Dedicated: 2 },
        ProcessExecution: class {
            constructor(
                readonly process: string,
                readonly args: string[],
            ) {}
        },
        DebugAdapterExecutable: class {
            constructor(
                readonly command: string,
                readonly args: string[],
            ) {}
        },
        Task: class {
            constructor(
                _: unknown,
                __: unknown,
                readonly name: string,
                ___: string,
                readonly execution: never,
                readonly matcher: string,
            ) {}
        },
        workspace: partly({
            getConfiguration: () => ({
                get: (key: string, otherwise: unknown) => (key === "path" ? program : otherwise),
            }),
            getWorkspaceFolder: () => undefined,
            textDocuments: [],
            onDidSaveTextDocument: () => disposable,
            onDidChangeConfiguration: () => disposable,
            createFileSystemWatcher: () => disposable,
        }),
        commands: partly({
            registerCommand: (name: string, run: Command) => (recorded.commands.set(name, run), disposable),
        }),
        window: partly({
            activeTextEditor: undefined,
            visibleTextEditors: [],
            showErrorMessage: async (text: string) => void recorded.errors.push(text),
        }),
        debug: partly({
            registerDebugAdapterDescriptorFactory: (type: string, factory: never) =>
                recorded.debuggers.set(type, factory),
            registerDebugConfigurationProvider: () => disposable,
        }),
        tasks: partly({
            executeTask: async ({
                name,
                execution,
                matcher,
            }: {
                name: string;
                execution: { process: string; args: string[] };
                matcher: string;
            }) => recorded.tasks.push({ title: name, process: execution.process, words: execution.args, matcher }),
        }),
    });
}

/** Activates the extension where this is the program. */
async function activated(program: string): Promise<Recorded> {
    const recorded: Recorded = { commands: new Map(), errors: [], tasks: [], debuggers: new Map() };
    const bundle = path.join(FOLDER, MANIFEST.main);
    await loadedWith(fakeVscode(program, recorded), async () => {
        delete require.cache[bundle];
        // Not bundled with the test.
        const { activate } = module.require(bundle);
        await activate({ subscriptions: [], workspaceState: partly({}) });
    });
    return recorded;
}

test("the commands of the manifest exist", async () => {
    const { commands } = await activated("/nowhere/rtsl");
    const declared = MANIFEST.contributes.commands.map(({ command }: { command: string }) => command);
    assert.deepEqual([...commands.keys()].sort(), declared.sort());
});

test("a missing program is reported with the remedy", async () => {
    const { errors } = await activated("/nowhere/rtsl");
    assert.equal(errors.length, 1);
    assert.match(errors[0], /`\/nowhere\/rtsl` was not found.*cargo install.*rtsl\.path/s);
});

test("code lenses run the program in a terminal", async () => {
    // A program that is no language server: it ends at once.
    const program = "/bin/true";
    const { commands, tasks } = await activated(program);
    await commands.get("rtsl.test")!("file:///tmp/a.rtsl", "Ball", null);
    await commands.get("rtsl.bench")!("file:///tmp/a.rtsl", "Ball", "intersect");
    assert.deepEqual(tasks, [
        { title: "Test Ball", process: program, words: ["test", "/tmp/a.rtsl", "--class", "Ball"], matcher: "$rtsl" },
        {
            title: "Bench Ball",
            process: program,
            words: ["bench", "/tmp/a.rtsl", "intersect", "--class", "Ball"],
            matcher: "$rtsl",
        },
    ]);
});

test("a program without a language server is reported", async () => {
    const { errors } = await activated("/bin/true");
    // The library of the client has a message of its own.
    assert.match(errors.at(-1)!, /language server did not start: .*\. Does `\/bin\/true lsp`/s);
});

test("commands without a shader say so", async () => {
    const { commands, errors, tasks } = await activated("/bin/true");
    const before = errors.length;
    await commands.get("rtsl.preview")!();
    await commands.get("rtsl.test")!();
    assert.deepEqual(
        errors.slice(before).map((text) => text.includes("Open a shader first")),
        [true, true],
    );
    assert.deepEqual(tasks, []);
});

test("costs without a shader or a server say so", async () => {
    const { commands, errors } = await activated("/nowhere/rtsl");
    const before = errors.length;
    await commands.get("rtsl.costs")!();
    await commands.get("rtsl.clear")!();
    assert.match(errors[before], /Open a shader first/);
    assert.match(errors[before + 1], /language server does not run.*Restart language server/);
});

test("the debugger is the program's", async () => {
    const { debuggers } = await activated("/bin/true");
    const descriptor = await debuggers.get("rtsl")!.createDebugAdapterDescriptor();
    assert.deepEqual({ ...(descriptor as object) }, { command: "/bin/true", args: ["dap"] });
});

test("the problem matcher reads diagnostics", () => {
    const [{ pattern }] = MANIFEST.contributes.problemMatchers;
    const [first, second] = pattern.map(({ regexp }: { regexp: string }) => new RegExp(regexp));
    assert.deepEqual(first.exec("error[E0201]: unknown name `x`")?.slice(1), ["error", "E0201", "unknown name `x`"]);
    assert.deepEqual(second.exec("  ┌─ a b.rtsl:3:35")?.slice(1), ["a b.rtsl", "3", "35"]);
});

test("a folder chooses neither the program nor what it is given", () => {
    const { properties } = MANIFEST.contributes.configuration;
    for (const name of ["rtsl.path", "rtsl.preview.arguments"]) {
        assert.equal(properties[name].scope, "machine", name);
    }
});
