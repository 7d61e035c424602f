//! Passes over the single-ray intermediate representation of RTSL
