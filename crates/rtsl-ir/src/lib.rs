//! The single-ray intermediate representation of RTSL and its interpreter
