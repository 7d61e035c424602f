; Written by `npm run words` in editors/tree-sitter-rtsl from its queries/tags.scm. Do not edit.

((comment)* @doc
  .
  (class_declaration
    name: (type_identifier) @name) @definition.class
  (#strip! @doc "^(///?|/\\*\\*?)\\s*|\\s*\\*/$")
  (#select-adjacent! @doc @definition.class))

(struct_declaration
  name: (type_identifier) @name) @definition.class

(enum_declaration
  name: (type_identifier) @name) @definition.enum

(enumerator
  name: (identifier) @name) @definition.constant

(source_file
  ((comment)* @doc
    .
    (function_definition
      name: (identifier) @name) @definition.function
    (#strip! @doc "^(///?|/\\*\\*?)\\s*|\\s*\\*/$")
    (#select-adjacent! @doc @definition.function)))

(class_body
  ((comment)* @doc
    .
    (function_definition
      name: (identifier) @name) @definition.method
    (#strip! @doc "^(///?|/\\*\\*?)\\s*|\\s*\\*/$")
    (#select-adjacent! @doc @definition.method)))

(constructor_definition
  name: (identifier) @name) @definition.method

(class_body
  (declaration
    declarator: (declarator
      name: (identifier) @name) @definition.field))

(preproc_define
  name: (identifier) @name) @definition.macro

(call_expression
  function: (identifier) @name) @reference.call

(call_expression
  function: (member_expression
    member: (field_identifier) @name)) @reference.call

(base_clause
  (type_identifier) @name) @reference.class

(type
  (type_identifier) @name) @reference.class
