// Classes and methods in the text of a shader, found by its lines: enough to tell where the cursor is. The language
// server knows more, but need not have started.

/** A class that a text declares. */
export interface DeclaredClass {
    name: string;
    /** The line of the keyword `class`, from 0. */
    line: number;
}

const CLASS = /^\s*class\s+([A-Za-z_]\w*)/;
const METHOD = /^\s*(?:[A-Za-z_][\w.]*(?:\s*\[[^\]]*\])*\s+)+([A-Za-z_]\w*)\s*\(([^]*)$/;
const STATEMENT = /^\s*(?:return|else|if|for|while|do|switch|case|illuminance|class|struct|enum|import|print)\b/;
const PARAMETERS = /^\s*\/\/\s*preview:(.*)$/;

/** The lines of a text, without what comments contain; lines and columns stay as they are. */
function codeLines(text: string): string[] {
    const blank = (comment: string) => comment.replace(/[^\r\n]/g, " ");
    return text
        .replace(/"(?:[^"\\\r\n]|\\.)*"|\/\/[^\r\n]*|\/\*[^]*?(?:\*\/|$)/g, (part) =>
            part.startsWith("/") ? blank(part) : part,
        )
        .split(/\r?\n/);
}

/** The classes of a text, in its order. */
export function declaredClasses(text: string): DeclaredClass[] {
    return codeLines(text).flatMap((code, line) => {
        const found = CLASS.exec(code);
        return found ? [{ name: found[1], line }] : [];
    });
}

/** The class at a line, counted from 0: the last one that begins there or before, or else the first one. */
export function classAt(text: string, line: number): DeclaredClass | undefined {
    const classes = declaredClasses(text);
    const comments = (each: DeclaredClass) => each.line - commentsBefore(text, each.line).length;
    return classes.filter((each) => comments(each) <= line).at(-1) ?? classes[0];
}

/** The function or method whose head or body contains a line, counted from 0. */
export function methodAt(text: string, line: number): string | undefined {
    const lines = codeLines(text);
    const depths = braceDepths(lines);
    for (let at = Math.min(line, lines.length - 1); at >= 0 && !CLASS.test(lines[at]); at--) {
        const name = declaredMethod(lines[at]);
        if (name) {
            const body = lines.findIndex((code, index) => index >= at && code.includes("{"));
            const inside = depths.slice(body + 1, line + 1).every((depth) => depth > depths[at]);
            return body >= 0 && inside ? name : undefined;
        }
    }
    return undefined;
}

/** The function that a line begins to define. */
function declaredMethod(code: string): string | undefined {
    const [, name, rest] = METHOD.exec(code) ?? [];
    const isPrototype = rest !== undefined && !rest.includes("{") && rest.trimEnd().endsWith(";");
    return STATEMENT.test(code) || isPrototype ? undefined : name;
}

/** The number of open braces at the start of each line. */
function braceDepths(lines: string[]): number[] {
    let depth = 0;
    return lines.map((code) => {
        const before = depth;
        for (const character of code) {
            depth += character === "{" ? 1 : character === "}" ? -1 : 0;
        }
        return before;
    });
}

/** The lines of comments just before a line. */
function commentsBefore(text: string, line: number): string[] {
    const lines = text.split(/\r?\n/);
    let first = line;
    while (first > 0 && /^\s*\/\//.test(lines[first - 1])) {
        first--;
    }
    return lines.slice(first, line);
}

/** The parameters for previews in the comments before a class: what follows `// preview:`. */
export function previewParameters(text: string, declared: DeclaredClass): string {
    const found = commentsBefore(text, declared.line).map((comment) => PARAMETERS.exec(comment)?.[1].trim());
    return found.filter((each) => each).join(" ");
}
