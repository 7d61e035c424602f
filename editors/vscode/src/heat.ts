// Colours of lines by their costs.

/** A line with its share of the cost. */
export interface HotLine {
    /** The line, from 0. */
    line: number;
    cost: number;
}

/** A change of a text: the lines from `first` to `last` get `added` line breaks instead of theirs. */
export interface Change {
    first: number;
    last: number;
    added: number;
}

/** The colours, from the coldest lines to the hottest. */
export const COLORS = ["#4b74b9", "#5fa8a0", "#c9b458", "#d9853b", "#d0453f"];

/** The cost of lines of each colour, as a share of that of the hottest line. */
const LEVELS = [0, 0.03, 0.1, 0.3, 0.7];

/** The colour of a line: its index. */
export function levelOf(cost: number, hottest: number): number {
    return LEVELS.filter((least) => cost >= least * hottest).length - 1;
}

/** The lines after a change. Those that change lose their colours. */
export function movedLines<Line extends { line: number }>(lines: Line[], { first, last, added }: Change): Line[] {
    const moved = added - (last - first);
    return lines
        .filter(({ line }) => line < first || line > last)
        .map((each) => (each.line > last ? { ...each, line: each.line + moved } : each));
}
