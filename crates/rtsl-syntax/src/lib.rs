//! Preprocessor, lexer and parser of RTSL
