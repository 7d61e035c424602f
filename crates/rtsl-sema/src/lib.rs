//! Names, types and lowering of RTSL
