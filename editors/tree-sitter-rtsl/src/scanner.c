// Tokens of directives, whose end and contents depend on lines. Continuation lines and comments are as in the lexer of
// the compiler. The scanner has no state.

#include "tree_sitter/parser.h"

enum TokenType {
    LINE_END,
    PREPROC_TEXT,
    IF_ZERO,
    PREPROC_SKIPPED,
    PARAMETERS_OPEN,
};

void *tree_sitter_rtsl_external_scanner_create(void) { return NULL; }
void tree_sitter_rtsl_external_scanner_destroy(void *payload) { (void)payload; }
void tree_sitter_rtsl_external_scanner_deserialize(void *payload, const char *buffer, unsigned length) {
    (void)payload, (void)buffer, (void)length;
}
unsigned tree_sitter_rtsl_external_scanner_serialize(void *payload, char *buffer) {
    (void)payload, (void)buffer;
    return 0;
}

static bool is_space(int32_t c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

static bool is_word(int32_t c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

static void advance(TSLexer *lexer) { lexer->advance(lexer, false); }

// Consumes a backslash, and the line end after it if there is one.
static void advance_backslash(TSLexer *lexer) {
    advance(lexer);
    if (lexer->lookahead == '\r') advance(lexer);
    if (lexer->lookahead == '\n') advance(lexer);
}

// Consumes a line end, or nothing at the end of the file. False if something else is there.
static bool scan_line_end(TSLexer *lexer) {
    if (lexer->lookahead == '\r') advance(lexer);
    if (lexer->lookahead == '\n') {
        advance(lexer);
        return true;
    }
    return lexer->eof(lexer);
}

// Consumes text up to a comment or the end of the line, without the white space before that.
static bool scan_text(TSLexer *lexer) {
    bool found = false;
    while (!lexer->eof(lexer) && lexer->lookahead != '\n' && lexer->lookahead != '\r') {
        bool blank = is_space(lexer->lookahead);
        if (lexer->lookahead == '/') {
            advance(lexer);
            if (lexer->lookahead == '/' || lexer->lookahead == '*') return found;
        } else if (lexer->lookahead == '\\') {
            advance_backslash(lexer);
        } else {
            advance(lexer);
        }
        if (!blank) {
            lexer->mark_end(lexer);
            found = true;
        }
    }
    return found;
}

// Consumes `if 0` if the line ends after it.
static bool scan_if_zero(TSLexer *lexer) {
    if (lexer->lookahead != 'i') return false;
    advance(lexer);
    if (lexer->lookahead != 'f') return false;
    advance(lexer);
    if (!is_space(lexer->lookahead)) return false;
    while (is_space(lexer->lookahead)) advance(lexer);
    if (lexer->lookahead != '0') return false;
    advance(lexer);
    lexer->mark_end(lexer);
    while (is_space(lexer->lookahead)) advance(lexer);
    return lexer->lookahead == '\n' || lexer->lookahead == '\r' || lexer->lookahead == '/' || lexer->eof(lexer);
}

// Consumes a block comment after its `/`, if it is one.
static void skip_block_comment(TSLexer *lexer) {
    if (lexer->lookahead != '*') return;
    advance(lexer);
    while (!lexer->eof(lexer)) {
        bool star = lexer->lookahead == '*';
        advance(lexer);
        if (star && lexer->lookahead == '/') {
            advance(lexer);
            return;
        }
    }
}

// The directives that matter in skipped text.
enum Directive { OPENS, CONTINUES, CLOSES, OTHER };

static enum Directive read_directive(TSLexer *lexer) {
    char word[8] = {0};
    unsigned length = 0;
    while (is_space(lexer->lookahead)) advance(lexer);
    while (is_word(lexer->lookahead)) {
        if (length < sizeof word - 1) word[length] = (char)lexer->lookahead;
        length++;
        advance(lexer);
    }
    static const struct {
        const char *word;
        enum Directive directive;
    } WORDS[] = {
        {"if", OPENS}, {"ifdef", OPENS}, {"ifndef", OPENS}, {"elif", CONTINUES}, {"else", CONTINUES}, {"endif", CLOSES},
    };
    for (unsigned i = 0; i < sizeof WORDS / sizeof *WORDS; i++) {
        unsigned at = 0;
        while (WORDS[i].word[at] != 0 && WORDS[i].word[at] == word[at]) at++;
        if (WORDS[i].word[at] == word[at] && at == length) return WORDS[i].directive;
    }
    return OTHER;
}

// Consumes the lines up to the directive that ends the group.
static void scan_skipped(TSLexer *lexer) {
    unsigned nesting = 0;
    bool starts_line = true;
    while (!lexer->eof(lexer)) {
        int32_t c = lexer->lookahead;
        if (c == '#' && starts_line) {
            // The group ends before this line if it is the directive.
            lexer->mark_end(lexer);
            advance(lexer);
            enum Directive directive = read_directive(lexer);
            if (nesting == 0 && (directive == CONTINUES || directive == CLOSES)) return;
            if (directive == OPENS) nesting++;
            if (directive == CLOSES) nesting--;
            starts_line = false;
        } else if (c == '\n' || c == '\r') {
            advance(lexer);
            starts_line = true;
        } else if (is_space(c)) {
            advance(lexer);
        } else if (c == '/') {
            advance(lexer);
            skip_block_comment(lexer);
        } else if (c == '\\') {
            advance_backslash(lexer);
        } else {
            advance(lexer);
            starts_line = false;
        }
    }
    lexer->mark_end(lexer);
}

bool tree_sitter_rtsl_external_scanner_scan(void *payload, TSLexer *lexer, const bool *valid) {
    (void)payload;
    // All are valid only while the parser recovers from an error; a guess would not help.
    if (valid[LINE_END] && valid[PREPROC_SKIPPED] && valid[IF_ZERO]) return false;
    if (valid[PREPROC_SKIPPED]) {
        lexer->result_symbol = PREPROC_SKIPPED;
        scan_skipped(lexer);
        return true;
    }
    if (valid[PARAMETERS_OPEN] && lexer->lookahead == '(') {
        advance(lexer);
        lexer->mark_end(lexer);
        lexer->result_symbol = PARAMETERS_OPEN;
        return true;
    }
    if (!valid[LINE_END] && !valid[PREPROC_TEXT] && !valid[IF_ZERO]) return false;
    while (is_space(lexer->lookahead)) lexer->advance(lexer, true);
    if (valid[LINE_END] && scan_line_end(lexer)) {
        lexer->mark_end(lexer);
        lexer->result_symbol = LINE_END;
        return true;
    }
    if (valid[IF_ZERO]) {
        lexer->result_symbol = IF_ZERO;
        return scan_if_zero(lexer);
    }
    if (valid[PREPROC_TEXT]) {
        lexer->result_symbol = PREPROC_TEXT;
        return scan_text(lexer);
    }
    return false;
}
