//! Renderers that speak RTSL: scenes, acceleration, film
