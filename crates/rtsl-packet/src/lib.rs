//! Packet lowering of RTSL: uniformity and masks
