//! LLVM text from RTSL packet code
