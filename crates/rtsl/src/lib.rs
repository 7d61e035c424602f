//! RTSL, the Ray Tracing Shading Language: compile, link, set parameters, call
