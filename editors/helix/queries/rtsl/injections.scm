; Written by `npm run words` in editors/tree-sitter-rtsl from its queries/injections.scm. Do not edit.

; The text of a macro is tokens of the language.
((preproc_define
  value: (preproc_text) @injection.content)
  (#set! injection.language "rtsl"))

((comment) @injection.content
  (#set! injection.language "comment"))
