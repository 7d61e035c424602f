; Scopes

[
  (source_file)
  (class_declaration)
  (function_definition)
  (constructor_definition)
  (block)
  (for_statement)
  (while_statement)
  (switch_body)
] @local.scope

; Definitions

(class_declaration
  name: (type_identifier) @local.definition.type)

(struct_declaration
  name: (type_identifier) @local.definition.type)

(enum_declaration
  name: (type_identifier) @local.definition.type)

(enumerator
  name: (identifier) @local.definition.constant)

(function_definition
  name: (identifier) @local.definition.function)

(parameter
  name: (identifier) @local.definition.parameter)

(declarator
  name: (identifier) @local.definition.var)

(condition_declaration
  name: (identifier) @local.definition.var)

(import_declaration
  alias: (identifier) @local.definition.import)

(preproc_define
  name: (identifier) @local.definition.macro)

; References

(identifier) @local.reference

(type_identifier) @local.reference
