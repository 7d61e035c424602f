; The members of a class without braces are not indented.

((class_body
  .
  "{") @indent)

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
  ; Lines that go on.
  (expression_statement)
  (declarator)
  (return_statement)
] @indent

; A statement after `case 0:` belongs to the case before it is there.
(switch_case) @extend

(if_statement
  consequence: (_) @indent
  (#not-kind-eq? @indent "block")
  (#set! "scope" "all"))

(for_statement
  body: (_) @indent
  (#not-kind-eq? @indent "block")
  (#set! "scope" "all"))

(while_statement
  body: (_) @indent
  (#not-kind-eq? @indent "block")
  (#set! "scope" "all"))

[
  "}"
  ")"
  "]"
] @outdent
