[
  (block)
  (class_body)
  (field_list)
  (enumerator_list)
  (initializer_list)
  (switch_body)
  (argument_list)
  (parameter_list)
  (annotation_list)
  (parenthesized_expression)
  (array_size)
  (subscript_expression)
] @rainbow.scope

[
  "("
  ")"
  "["
  "]"
  "{"
  "}"
] @rainbow.bracket
