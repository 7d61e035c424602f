// Stand-ins for VS Code, of which only the parts exist that a test looks at.

import Module from "node:module";

/** Anything else of VS Code: called or constructed, it gives something of which the same holds. */
function anything(): unknown {
    return new Proxy(class {}, {
        get: (target, key) => (key in target ? Reflect.get(target, key) : key === "then" ? undefined : anything()),
        apply: () => anything(),
    });
}

/** An object that has these members, and any other. */
export const partly = (members: Record<string, unknown>) =>
    new Proxy(members, { get: (target, key) => (key in target ? target[key as string] : anything()) });

/** Runs something that loads the module `vscode`, which is this one. */
export async function loadedWith<Result>(vscode: unknown, run: () => Promise<Result>): Promise<Result> {
    const modules = Module as unknown as { _load(name: string, ...rest: unknown[]): unknown };
    const load = modules._load;
    modules._load = (name, ...rest) => (name === "vscode" ? vscode : load(name, ...rest));
    try {
        return await run();
    } finally {
        modules._load = load;
    }
}
