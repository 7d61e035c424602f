; Written by `npm run words` in editors/tree-sitter-rtsl from its queries/folds.scm. Do not edit.

[
  (class_declaration)
  (function_definition)
  (constructor_definition)
  (struct_declaration)
  (enum_declaration)
  (block)
  (if_statement)
  (switch_statement)
  (switch_case)
  (for_statement)
  (while_statement)
  (do_statement)
  (illuminance_statement)
  (initializer_list)
  (argument_list)
  (parameter_list)
  (annotation_list)
  (preproc_define)
  (preproc_skipped)
  (comment)
] @fold
