/* Spheres as a user geometry of Embree with callbacks written by hand in C: what RTSL's are raced against. */
#ifndef HAND_SPHERE_H
#define HAND_SPHERE_H

#include "embree.h"

typedef struct HandSphere {
    float center[3];
    float radius;
} HandSphere;

/* A geometry of spheres, which must stay where they are. Callbacks set what those of rtsl_geometry.h set, but for instances. */
EmbreeGeometry hand_sphere_geometry(const Embree *embree, EmbreeDevice device, HandSphere *spheres, uint32_t count);

#endif
