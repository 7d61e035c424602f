// Writes what follows from `words.json` and from the queries here: the lists in `queries/highlights.scm`, the queries
// of Neovim and Helix, and the TextMate grammar of the extension for VS Code. With `--check` it compares, and fails if
// a file is stale.

import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";

const FOLDER = fileURLToPath(new URL("..", import.meta.url));
const WIDTH = 120;

/** The captures of Helix that have other names than those of tree-sitter and Neovim. */
const HELIX_CAPTURES = new Map(
    Object.entries({
        boolean: "constant.builtin.boolean",
        "comment.documentation": "comment.block.documentation",
        "constant.macro": "constant",
        "function.call": "function",
        "function.method.call": "function.method",
        "keyword.conditional": "keyword.control.conditional",
        "keyword.conditional.ternary": "keyword.control.conditional",
        "keyword.directive.define": "keyword.directive",
        "keyword.import": "keyword.control.import",
        "keyword.modifier": "keyword.storage.modifier",
        "keyword.repeat": "keyword.control.repeat",
        "keyword.return": "keyword.control.return",
        "keyword.type": "keyword.storage.type",
        module: "namespace",
        number: "constant.numeric.integer",
        "number.float": "constant.numeric.float",
        "string.escape": "constant.character.escape",
        "variable.member": "variable.other.member",
    }),
);

const read = (path) => readFileSync(FOLDER + path, "utf8");

/** Fills the lists of a query: each predicate between `; words: KEYS` and `; end` gets the words of these keys. */
function fillLists(query, words) {
    const list = /( *); words: (.*)\n *\(#any-of\? (@[\w.]+)[^)]*\)\n *; end/g;
    return query.replace(list, (_, indent, keys, capture) => {
        const lines = [`${indent}(#any-of? ${capture}`];
        for (const word of keys.split(" ").flatMap((key) => words[key])) {
            const item = ` "${word}"`;
            if ((lines.at(-1) + item).length >= WIDTH) {
                lines.push(`${indent} `);
            }
            lines[lines.length - 1] += item;
        }
        return `${indent}; words: ${keys}\n${lines.join("\n")})\n${indent}; end`;
    });
}

const forHelix = (query) => query.replace(/@([\w.]+)/g, (_, name) => `@${HELIX_CAPTURES.get(name) ?? name}`);

const copied = (name, query) =>
    `; Written by \`npm run words\` in editors/tree-sitter-rtsl from its queries/${name}.scm. Do not edit.\n\n${query}`;

/** Fills the alternatives of a TextMate grammar: `{{KEY}}` becomes the words of this key. */
const fillAlternatives = (grammar, words) => grammar.replace(/\{\{(\w+)\}\}/g, (_, key) => words[key].join("|"));

/** The files with their texts. */
function files() {
    const words = JSON.parse(read("words.json"));
    const highlights = fillLists(read("queries/highlights.scm"), words);
    const texts = { "queries/highlights.scm": highlights };
    for (const name of ["highlights", "injections", "locals", "folds", "indents"]) {
        const query = name === "highlights" ? highlights : read(`queries/${name}.scm`);
        texts[`../neovim/queries/rtsl/${name}.scm`] = copied(name, query);
    }
    for (const name of ["highlights", "injections", "locals", "tags", "textobjects"]) {
        const query = name === "highlights" ? highlights : read(`queries/${name}.scm`);
        texts[`../helix/queries/rtsl/${name}.scm`] = copied(name, forHelix(query));
    }
    const textMate = "../vscode/syntaxes/rtsl.tmLanguage";
    texts[`${textMate}.json`] = fillAlternatives(read(`${textMate}.in.json`), words);
    return texts;
}

const check = process.argv.includes("--check");
for (const [path, text] of Object.entries(files())) {
    if (!check) {
        writeFileSync(FOLDER + path, text);
    } else if (read(path) !== text) {
        console.error(`${path} is stale; \`npm run words\` renews it`);
        process.exitCode = 1;
    }
}
