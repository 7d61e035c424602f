// The command lines of the extension's commands, which code lenses of the language server call too.

/** The command line that tests a class of a file, or all its classes. */
export function testCommand(file: string, className?: string): string[] {
    return ["test", file, ...option("--class", className)];
}

/** The command line that measures a method of a class, or all methods. */
export function benchCommand(file: string, className?: string, method?: string): string[] {
    return ["bench", file, ...(method ? [method] : []), ...option("--class", className)];
}

const option = (name: string, value?: string) => (value ? [name, value] : []);
