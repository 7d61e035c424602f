//! The RTSL language as data: roles, state variables, built-in functions
