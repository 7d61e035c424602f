// The snippets, as an editor inserts them.

import { readFileSync } from "node:fs";
import * as path from "node:path";

interface Snippet {
    prefix: string;
    description: string;
    body: string[];
}

// The tests run in `out/test`.
const FILE = path.join(__dirname, "../../snippets/rtsl.json");

export const snippets = (): Record<string, Snippet> => JSON.parse(readFileSync(FILE, "utf8"));

/** The text of a snippet with its defaults. */
export function expanded(snippet: Snippet): string {
    const defaults = new Map<string, string>();
    const text = snippet.body.join("\n").replace(/\$\{(\d+):([^}]*)\}/g, (_, number: string, value: string) => {
        defaults.set(number, value);
        return value;
    });
    return `${text.replace(/\$(\d+)/g, (_, number: string) => defaults.get(number) ?? "")}\n`;
}
