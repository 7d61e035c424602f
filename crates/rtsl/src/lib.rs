//! RTSL, the Ray Tracing Shading Language: compile, link, set parameters, call

pub use rtsl_source::{
    Code, Diagnostic, Diagnostics, FileId, Label, Position, Severity, SourceFile, SourceMap, Span,
    Suggestion, code_info, codes, diagnostic_codes, most_similar, render,
};
