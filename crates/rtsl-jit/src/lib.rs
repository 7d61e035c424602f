//! Finds LLVM at run time and compiles RTSL kernels with it
