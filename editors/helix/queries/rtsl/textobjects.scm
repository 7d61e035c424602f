; Written by `npm run words` in editors/tree-sitter-rtsl from its queries/textobjects.scm. Do not edit.

; Captures of Helix.

(class_declaration
  body: (class_body)? @class.inside) @class.around

(struct_declaration
  body: (field_list) @class.inside) @class.around

(enum_declaration
  body: (enumerator_list) @class.inside) @class.around

(function_definition
  body: (block) @function.inside) @function.around

(constructor_definition
  body: (block) @function.inside) @function.around

(parameter_list
  ((parameter) @parameter.inside
    .
    ","? @parameter.around) @parameter.around)

(argument_list
  ((_) @parameter.inside
    .
    ","? @parameter.around) @parameter.around)

(enumerator) @entry.around

(annotation) @entry.around

(comment) @comment.inside

(comment)+ @comment.around
