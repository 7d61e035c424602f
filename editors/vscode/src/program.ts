// The program `rtsl`: where it is, and one run of it.

import { spawn } from "node:child_process";
import { accessSync, constants, readFileSync, statSync } from "node:fs";
import { homedir } from "node:os";
import * as path from "node:path";

/** The environment in which a program is searched for. */
export interface Environment {
    variables: NodeJS.ProcessEnv;
    windows: boolean;
    home: string;
}

export const thisEnvironment = (): Environment => ({
    variables: process.env,
    windows: process.platform === "win32",
    home: homedir(),
});

/**
 * The path of the program that a setting names: a path, in which `~` is the home folder, or a name that is searched for
 * on the `PATH` and in Cargo's folder. Without a result, there is no such program.
 */
export function findProgram(setting: string, environment: Environment): string | undefined {
    const name = setting.trim() || "rtsl";
    const expanded = name.replace(/^~(?=[/\\])/, environment.home);
    const extensions = environment.windows ? ["", ".exe"] : [""];
    const isPath = /[/\\]/.test(expanded);
    const folders = isPath ? [""] : searchedFolders(environment);
    const candidates = folders.flatMap((folder) => extensions.map((each) => path.join(folder, expanded + each)));
    return candidates.find(isExecutable);
}

/** The folders of the `PATH`, and the one where `cargo install` puts programs. */
function searchedFolders(environment: Environment): string[] {
    const { variables, windows, home } = environment;
    const listed = (variables.PATH ?? variables.Path ?? "").split(windows ? ";" : ":").filter((folder) => folder);
    return [...listed, path.join(variables.CARGO_HOME ?? path.join(home, ".cargo"), "bin")];
}

function isExecutable(file: string): boolean {
    try {
        accessSync(file, constants.X_OK);
        return statSync(file).isFile();
    } catch {
        return false;
    }
}

/** The result of a run. */
export interface Outcome {
    /** The exit code; `null` if a signal ended the run. */
    code: number | null;
    stdout: string;
    stderr: string;
}

/** Runs a program to its end. It fails if the program can't be started or the run is aborted. */
export function run(
    program: string,
    words: string[],
    options: { cwd?: string; signal?: AbortSignal } = {},
): Promise<Outcome> {
    return new Promise((resolve, reject) => {
        const child = spawn(program, words, { ...options, stdio: ["ignore", "pipe", "pipe"], windowsHide: true });
        const outcome: Outcome = { code: null, stdout: "", stderr: "" };
        child.stdout.setEncoding("utf8").on("data", (text: string) => (outcome.stdout += text));
        child.stderr.setEncoding("utf8").on("data", (text: string) => (outcome.stderr += text));
        child.on("error", reject);
        child.on("close", (code) => resolve({ ...outcome, code }));
    });
}

/** The folders of `search-path` in the file `rtsl.toml` beside a shader, which has no other key. */
export function searchPath(folder: string): string[] {
    let text: string;
    try {
        text = readFileSync(path.join(folder, "rtsl.toml"), "utf8");
    } catch {
        return [];
    }
    const list = /^\s*search-path\s*=\s*\[([^\]]*)\]/m.exec(text)?.[1] ?? "";
    const withoutComments = list.replace(/#.*$/gm, "");
    return [...withoutComments.matchAll(/"([^"]*)"|'([^']*)'/g)].map((found) =>
        path.resolve(folder, found[1] ?? found[2]),
    );
}
