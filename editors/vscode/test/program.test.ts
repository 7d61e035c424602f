import assert from "node:assert/strict";
import { chmodSync, mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import * as path from "node:path";
import test from "node:test";

import { benchCommand, testCommand } from "../src/commands";
import { findProgram, run, searchPath } from "../src/program";

function inFolder(check: (folder: string) => void): void {
    const folder = mkdtempSync(path.join(tmpdir(), "rtsl-test-"));
    try {
        check(folder);
    } finally {
        rmSync(folder, { recursive: true });
    }
}

function makeProgram(...parts: string[]): string {
    const file = path.join(...parts);
    mkdirSync(path.dirname(file), { recursive: true });
    writeFileSync(file, "#!/bin/sh\n");
    chmodSync(file, 0o755);
    return file;
}

test("the program is the one of the PATH", () => {
    inFolder((home) => {
        const environment = { variables: { PATH: `/nowhere:${home}/tools` }, windows: false, home };
        assert.equal(findProgram("rtsl", environment), undefined);
        mkdirSync(path.join(home, "tools", "rtsl"), { recursive: true });
        assert.equal(findProgram("rtsl", environment), undefined, "a folder is no program");
        const own = makeProgram(home, ".cargo", "bin", "rtsl");
        assert.equal(findProgram("", environment), own, "Cargo's folder comes last");
        const other = makeProgram(home, "tools", "rtsl-dev");
        assert.equal(findProgram("rtsl-dev", environment), other);
        assert.equal(findProgram("~/tools/rtsl-dev", environment), other);
        assert.equal(findProgram("/nowhere/rtsl", environment), undefined);
    });
});

test("on Windows the program has an extension", () => {
    inFolder((home) => {
        const environment = { variables: { Path: `${home};x` }, windows: true, home };
        const own = makeProgram(home, "rtsl.exe");
        assert.equal(findProgram("rtsl", environment), own);
    });
});

test("runs give the code and both outputs", async () => {
    const script = "console.log('out'); console.error('err'); process.exit(3)";
    assert.deepEqual(await run(process.execPath, ["-e", script]), { code: 3, stdout: "out\n", stderr: "err\n" });
    await assert.rejects(run("/nowhere/rtsl", []), /ENOENT/);
    const signal = AbortSignal.timeout(50);
    await assert.rejects(run(process.execPath, ["-e", "setTimeout(() => {}, 60000)"], { signal }), /abort/i);
});

test("the search path is that of rtsl.toml", () => {
    inFolder((folder) => {
        assert.deepEqual(searchPath(folder), []);
        writeFileSync(path.join(folder, "rtsl.toml"), 'search-path = [\n  "lib", # "none"\n  \'../shaders\',\n]\n');
        assert.deepEqual(searchPath(folder), [path.join(folder, "lib"), path.resolve(folder, "../shaders")]);
    });
});

test("code lenses give class and method", () => {
    assert.deepEqual(testCommand("a b.rtsl"), ["test", "a b.rtsl"]);
    assert.deepEqual(testCommand("a.rtsl", "Ball"), ["test", "a.rtsl", "--class", "Ball"]);
    assert.deepEqual(benchCommand("a.rtsl", "Ball", "intersect"), ["bench", "a.rtsl", "intersect", "--class", "Ball"]);
    assert.deepEqual(benchCommand("a.rtsl"), ["bench", "a.rtsl"]);
});
