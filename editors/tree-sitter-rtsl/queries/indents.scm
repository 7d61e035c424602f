; Captures of nvim-treesitter. The members of a class without braces are not indented.

((class_body
  .
  "{") @indent.begin)

[
  (block)
  (field_list)
  (enumerator_list)
  (initializer_list)
  (argument_list)
  (parameter_list)
  (annotation_list)
  (parenthesized_expression)
  (switch_case)
] @indent.begin

(if_statement
  consequence: (_) @_body
  (#not-kind-eq? @_body "block")) @indent.begin

(for_statement
  body: (_) @_body
  (#not-kind-eq? @_body "block")) @indent.begin

(while_statement
  body: (_) @_body
  (#not-kind-eq? @_body "block")) @indent.begin

[
  "}"
  ")"
  "]"
] @indent.branch @indent.end

[
  (comment)
  (preproc_skipped)
] @indent.auto

[
  (preproc_include)
  (preproc_define)
  (preproc_undef)
  (preproc_if)
  (preproc_ifdef)
  (preproc_elif)
  (preproc_else)
  (preproc_endif)
  (preproc_directive)
] @indent.zero
