/**
 * @file Tree-sitter grammar of RTSL, the ray tracing shading language.
 * @license MIT OR Apache-2.0
 *
 * Texts are parsed before preprocessing. Directives may stand between any two tokens, as in the language, so they are
 * extras: the branches of `#if` follow one another in the tree. The text of `#if 0` is one node. Macros that do not
 * look like names or calls are errors of the tree.
 */

/// <reference types="tree-sitter-cli/dsl" />
// @ts-check

// From the compiler's tables; a test of the crate `rtsl` keeps the file current.
const words = require("./words.json");

// In the order of `crates/rtsl-syntax/src/parser/operators.rs`; a greater number binds more tightly.
const PRECEDENCE = {
    sequence: 1,
    assignment: 2,
    // As `=`, which the last operand may contain.
    conditional: 2,
    unary: 15,
    postfix: 16,
};

const BINARY_OPERATORS = [
    ["||", 4],
    ["^^", 5],
    ["&&", 6],
    ["|", 7],
    ["^", 8],
    ["&", 9],
    ["==", 10],
    ["!=", 10],
    ["<", 11],
    [">", 11],
    ["<=", 11],
    [">=", 11],
    ["<<", 12],
    [">>", 12],
    ["+", 13],
    ["-", 13],
    ["*", 14],
    ["/", 14],
    ["%", 14],
];

const ASSIGNMENT_OPERATORS = ["=", "+=", "-=", "*=", "/=", "%=", "<<=", ">>=", "&=", "^=", "|="];

// Words that mean something in one place, and are names in all others.
const CONTEXTUAL_KEYWORDS = ["as", "constructor", "import", "print", "static_assert", "texture"];

const commaSeparated = (rule) => seq(rule, repeat(seq(",", rule)));
const commaSeparatedWithTrailing = (rule) => seq(rule, repeat(seq(",", rule)), optional(","));

module.exports = grammar({
    name: "rtsl",

    word: ($) => $.identifier,

    externals: ($) => [
        // The end of a directive's line, or of the file.
        $._line_end,
        // A part of a directive's line that is not parsed: the text of a macro, of `#error` and so on.
        $.preproc_text,
        // `if 0` in a directive, where nothing follows on the line.
        $._if_zero,
        // The lines after `#if 0`, maybe none, up to the `#else`, `#elif` or `#endif` that belongs to it.
        $.preproc_skipped,
        // The `(` of a macro's parameters, which follows the name at once.
        $._parameters_open,
    ],

    extras: ($) => [
        /[\s\uFEFF]|\\\r?\n/,
        $.comment,
        $.preproc_include,
        $.preproc_define,
        $.preproc_undef,
        $.preproc_if,
        $.preproc_ifdef,
        $.preproc_elif,
        $.preproc_else,
        $.preproc_endif,
        $.preproc_directive,
        $.preproc_empty,
    ],

    conflicts: ($) => [
        // `a.b c;` and `a[2] b;` declare, `a.b = c;` and `a[2]++;` do not: the word after the type decides.
        [$._type_name, $._expression],
        [$.qualified_type, $._expression],
        // `static_assert(...)` and `print(...)` are calls unless they contain text.
        [$.static_assertion, $._expression],
        [$.print_statement, $._expression],
        // `texture x` may declare a variable of a type with this name.
        [$._qualifier, $._type_name],
        // The parentheses of `illuminance (a, b) c;`.
        [$._any_expression, $.argument_list],
    ],

    supertypes: ($) => [$._expression, $._statement, $._declaration],

    inline: ($) => [$._name, $._type_word],

    rules: {
        source_file: ($) => repeat(choice($.import_declaration, $.class_declaration, $._declaration)),

        // Names.

        identifier: () => /[A-Za-z_][A-Za-z0-9_]*/,

        _name: ($) => choice($.identifier, alias(choice(...CONTEXTUAL_KEYWORDS), $.identifier)),

        // After `import`, a name is that of a module, so no type has this name.
        _type_word: ($) =>
            choice(
                alias($.identifier, $.type_identifier),
                alias(choice(...CONTEXTUAL_KEYWORDS.filter((word) => word !== "import")), $.type_identifier),
            ),

        // Modules and classes.

        import_declaration: ($) =>
            seq("import", field("path", $.module_path), optional(seq("as", field("alias", $._name))), ";"),

        module_path: ($) => seq($._name, repeat(seq(".", $._name))),

        class_declaration: ($) =>
            prec.right(
                seq(
                    "class",
                    field("name", alias($._name, $.type_identifier)),
                    optional($.base_clause),
                    choice(
                        seq(field("body", $.class_body), optional(";")),
                        // The members of a class without braces follow, up to the next class or the end of the file.
                        seq(";", optional(field("body", alias($.open_class_body, $.class_body)))),
                    ),
                ),
            ),

        base_clause: ($) => seq(":", commaSeparated($._type_name)),

        class_body: ($) => seq("{", repeat($._declaration), "}"),

        open_class_body: ($) => prec.right(repeat1($._declaration)),

        // Declarations at file scope and in classes.

        _declaration: ($) =>
            choice(
                $.declaration,
                $.function_definition,
                $.function_declaration,
                $.constructor_definition,
                $.struct_declaration,
                $.enum_declaration,
                $.static_assertion,
                $.precision_statement,
                $.macro_invocation,
                $.empty_declaration,
            ),

        // GLSL allows `float;`, too. In functions, that is an expression here.
        empty_declaration: ($) => seq(optional($.primitive_type), ";"),

        declaration: ($) =>
            seq(
                repeat($.annotation_list),
                repeat($._qualifier),
                field("type", $.type),
                commaSeparated(field("declarator", $.declarator)),
                ";",
            ),

        declarator: ($) =>
            seq(field("name", $._name), repeat($.array_size), optional(seq("=", field("value", $._initializer)))),

        _initializer: ($) => choice($._expression, $.initializer_list),

        initializer_list: ($) => seq("{", optional(commaSeparatedWithTrailing($._initializer)), "}"),

        function_definition: ($) => seq($._function_header, field("body", $.block)),

        function_declaration: ($) => seq($._function_header, ";"),

        _function_header: ($) =>
            seq(
                repeat($._qualifier),
                field("type", $.type),
                field("name", $._name),
                field("parameters", $.parameter_list),
            ),

        constructor_definition: ($) =>
            seq(
                field("name", alias("constructor", $.identifier)),
                field("parameters", $.parameter_list),
                choice(field("body", $.block), ";"),
            ),

        parameter_list: ($) => seq("(", optional(commaSeparated($.parameter)), ")"),

        parameter: ($) =>
            seq(
                repeat($.annotation_list),
                repeat($._qualifier),
                field("type", $.type),
                optional(seq(field("name", $._name), repeat($.array_size))),
                optional(seq("=", field("default", $._initializer))),
            ),

        struct_declaration: ($) =>
            seq(
                repeat($.annotation_list),
                repeat($._qualifier),
                "struct",
                optional(field("name", alias($._name, $.type_identifier))),
                field("body", $.field_list),
                optional(commaSeparated(field("declarator", $.declarator))),
                ";",
            ),

        field_list: ($) => seq("{", repeat($.field_declaration), "}"),

        field_declaration: ($) =>
            seq(
                repeat($._qualifier),
                field("type", $.type),
                commaSeparated(field("declarator", $.field_declarator)),
                ";",
            ),

        field_declarator: ($) => seq(field("name", $._name), repeat($.array_size)),

        enum_declaration: ($) =>
            prec.right(
                seq(
                    "enum",
                    field("name", alias($._name, $.type_identifier)),
                    field("body", $.enumerator_list),
                    optional(";"),
                ),
            ),

        enumerator_list: ($) => seq("{", optional(commaSeparatedWithTrailing($.enumerator)), "}"),

        enumerator: ($) => seq(field("name", $._name), optional(seq("=", field("value", $._expression)))),

        static_assertion: ($) =>
            seq(
                "static_assert",
                "(",
                field("condition", $._expression),
                ",",
                field("message", repeat1($.string)),
                ")",
                ";",
            ),

        // A macro whose text is declarations.
        macro_invocation: ($) =>
            prec.right(seq(field("name", $.identifier), field("arguments", $.argument_list), optional(";"))),

        precision_statement: ($) => seq("precision", $.precision_qualifier, $._type_name, ";"),

        // Annotations.

        annotation_list: ($) =>
            seq("[", token.immediate("["), optional(commaSeparatedWithTrailing($.annotation)), "]", "]"),

        annotation: ($) =>
            seq(
                field("key", $.annotation_key),
                optional("="),
                optional(field("value", choice(repeat1($.string), $._expression))),
            ),

        annotation_key: ($) => choice($._name, ...words.keywords, $.primitive_type),

        // Qualifiers and types.

        _qualifier: ($) => choice($.qualifier, alias("texture", $.qualifier), $.precision_qualifier),

        qualifier: () => choice(...words.qualifiers),

        precision_qualifier: () => choice("lowp", "mediump", "highp"),

        type: ($) => seq($._type_name, repeat($.array_size)),

        _type_name: ($) => choice($.primitive_type, $._type_word, $.qualified_type),

        qualified_type: ($) => seq(field("module", $._name), ".", field("name", alias($._name, $.type_identifier))),

        primitive_type: () => choice(...words.types),

        array_size: ($) => seq("[", optional($._any_expression), "]"),

        // Statements.

        block: ($) => seq("{", repeat($._statement), "}"),

        _statement: ($) =>
            choice(
                $.block,
                $.declaration_statement,
                $.if_statement,
                $.switch_statement,
                $.for_statement,
                $.while_statement,
                $.do_statement,
                $.illuminance_statement,
                $.return_statement,
                $.break_statement,
                $.continue_statement,
                $.print_statement,
                $.expression_statement,
                $.empty_statement,
            ),

        empty_statement: () => ";",

        declaration_statement: ($) =>
            choice(
                $.declaration,
                $.function_declaration,
                $.struct_declaration,
                $.static_assertion,
                $.precision_statement,
            ),

        expression_statement: ($) => seq($._any_expression, ";"),

        if_statement: ($) =>
            prec.right(
                seq(
                    "if",
                    field("condition", $.parenthesized_expression),
                    field("consequence", $._statement),
                    optional(field("alternative", $.else_clause)),
                ),
            ),

        else_clause: ($) => seq("else", $._statement),

        switch_statement: ($) =>
            seq("switch", field("value", $.parenthesized_expression), field("body", $.switch_body)),

        switch_body: ($) => seq("{", repeat($.switch_case), "}"),

        switch_case: ($) =>
            seq(choice(seq("case", field("value", $._any_expression)), "default"), ":", repeat($._statement)),

        for_statement: ($) =>
            seq(
                "for",
                "(",
                field("initializer", choice($.declaration, $.expression_statement, $.empty_statement)),
                field("condition", optional(choice($._any_expression, $.condition_declaration))),
                ";",
                field("update", optional($._any_expression)),
                ")",
                field("body", $._statement),
            ),

        condition_declaration: ($) =>
            seq(
                repeat($._qualifier),
                field("type", $.type),
                field("name", $._name),
                "=",
                field("value", $._initializer),
            ),

        while_statement: ($) =>
            seq(
                "while",
                "(",
                field("condition", choice($._any_expression, $.condition_declaration)),
                ")",
                field("body", $._statement),
            ),

        do_statement: ($) =>
            seq("do", field("body", $._statement), "while", field("condition", $.parenthesized_expression), ";"),

        illuminance_statement: ($) =>
            seq(
                "illuminance",
                choice(
                    prec.dynamic(1, seq(field("arguments", $.argument_list), field("body", $._statement))),
                    field("body", $._statement),
                ),
            ),

        return_statement: ($) => seq("return", optional($._any_expression), ";"),

        break_statement: () => seq("break", ";"),

        continue_statement: () => seq("continue", ";"),

        print_statement: ($) =>
            seq(
                "print",
                "(",
                field("format", repeat1($.string)),
                repeat(seq(",", field("argument", $._expression))),
                ")",
                ";",
            ),

        // Expressions. `_any_expression` includes the comma operator.

        _any_expression: ($) => choice($._expression, $.sequence_expression),

        sequence_expression: ($) => prec.left(PRECEDENCE.sequence, seq($._any_expression, ",", $._expression)),

        _expression: ($) =>
            choice(
                alias($._name, $.identifier),
                $.primitive_type,
                $.number,
                $.boolean,
                $.parenthesized_expression,
                $.assignment_expression,
                $.conditional_expression,
                $.binary_expression,
                $.unary_expression,
                $.update_expression,
                $.call_expression,
                $.member_expression,
                $.subscript_expression,
            ),

        parenthesized_expression: ($) => seq("(", $._any_expression, ")"),

        assignment_expression: ($) =>
            prec.right(
                PRECEDENCE.assignment,
                seq(
                    field("left", $._expression),
                    field("operator", choice(...ASSIGNMENT_OPERATORS)),
                    field("right", $._expression),
                ),
            ),

        conditional_expression: ($) =>
            prec.right(
                PRECEDENCE.conditional,
                seq(
                    field("condition", $._expression),
                    "?",
                    field("consequence", $._any_expression),
                    ":",
                    field("alternative", $._expression),
                ),
            ),

        binary_expression: ($) =>
            choice(
                ...BINARY_OPERATORS.map(([operator, precedence]) =>
                    prec.left(
                        precedence,
                        seq(field("left", $._expression), field("operator", operator), field("right", $._expression)),
                    ),
                ),
            ),

        unary_expression: ($) =>
            prec(PRECEDENCE.unary, seq(field("operator", choice("-", "+", "!", "~")), field("operand", $._expression))),

        update_expression: ($) =>
            choice(
                prec(PRECEDENCE.unary, seq(field("operator", choice("++", "--")), field("operand", $._expression))),
                prec(PRECEDENCE.postfix, seq(field("operand", $._expression), field("operator", choice("++", "--")))),
            ),

        call_expression: ($) =>
            prec(PRECEDENCE.postfix, seq(field("function", $._expression), field("arguments", $.argument_list))),

        argument_list: ($) => seq("(", optional(commaSeparated($._expression)), ")"),

        member_expression: ($) =>
            prec(
                PRECEDENCE.postfix,
                seq(field("object", $._expression), ".", field("member", alias($._name, $.field_identifier))),
            ),

        subscript_expression: ($) =>
            prec(
                PRECEDENCE.postfix,
                seq(field("array", $._expression), "[", optional(field("index", $._any_expression)), "]"),
            ),

        // Literals and comments.

        boolean: () => choice("true", "false"),

        // As the preprocessor reads numbers; the compiler checks their form.
        number: () => token(/(0[xX][A-Za-z0-9_.]*|\.?[0-9]([eE][+-]|[A-Za-z0-9_.])*)/),

        string: ($) =>
            seq(
                '"',
                repeat(choice($.escape_sequence, alias(token.immediate(prec(1, /[^"\\\r\n]+/)), $.string_content))),
                token.immediate('"'),
            ),

        escape_sequence: () => token.immediate(/\\[^\r\n]/),

        comment: () => token(choice(seq("//", /(\\+(.|\r?\n)|[^\\\n])*/), seq("/*", /[^*]*\*+([^/*][^*]*\*+)*/, "/"))),

        // The preprocessor.

        preproc_include: ($) => seq("#", "include", field("path", choice($.string, $.identifier)), $._line_end),

        preproc_define: ($) =>
            seq(
                "#",
                "define",
                field("name", $.identifier),
                optional(field("parameters", $.preproc_parameters)),
                field("value", repeat($.preproc_text)),
                $._line_end,
            ),

        preproc_parameters: ($) => seq(alias($._parameters_open, "("), optional(commaSeparated($.identifier)), ")"),

        preproc_undef: ($) => seq("#", "undef", field("name", $.identifier), $._line_end),

        preproc_if: ($) =>
            choice(
                seq("#", "if", field("condition", $._preproc_condition), $._line_end),
                seq("#", alias($._if_zero, "if"), $._line_end, $.preproc_skipped),
            ),

        preproc_ifdef: ($) => seq("#", choice("ifdef", "ifndef"), field("name", $.identifier), $._line_end),

        preproc_elif: ($) => seq("#", "elif", field("condition", $._preproc_condition), $._line_end),

        preproc_else: ($) => seq("#", "else", $._line_end),

        preproc_endif: ($) => seq("#", "endif", $._line_end),

        preproc_directive: ($) =>
            seq(
                "#",
                field("directive", alias(choice("error", "pragma", "version", "extension", "line"), $.directive)),
                field("argument", repeat($.preproc_text)),
                $._line_end,
            ),

        preproc_empty: ($) => seq("#", $._line_end),

        _preproc_condition: ($) =>
            choice(
                $.identifier,
                $.number,
                $.preproc_defined,
                alias($.preproc_call, $.call_expression),
                alias($.preproc_parenthesized, $.parenthesized_expression),
                alias($.preproc_unary, $.unary_expression),
                alias($.preproc_binary, $.binary_expression),
            ),

        preproc_defined: ($) => seq("defined", choice($.identifier, seq("(", $.identifier, ")"))),

        preproc_call: ($) =>
            prec(
                PRECEDENCE.postfix,
                seq(field("function", $.identifier), "(", optional(commaSeparated($._preproc_condition)), ")"),
            ),

        preproc_parenthesized: ($) => seq("(", $._preproc_condition, ")"),

        preproc_unary: ($) =>
            prec(
                PRECEDENCE.unary,
                seq(field("operator", choice("-", "+", "!", "~")), field("operand", $._preproc_condition)),
            ),

        preproc_binary: ($) =>
            choice(
                ...BINARY_OPERATORS.filter(([operator]) => operator !== "^^").map(([operator, precedence]) =>
                    prec.left(
                        precedence,
                        seq(
                            field("left", $._preproc_condition),
                            field("operator", operator),
                            field("right", $._preproc_condition),
                        ),
                    ),
                ),
            ),
    },
});
