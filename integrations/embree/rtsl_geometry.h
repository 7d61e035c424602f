/* Instances of an RTSL class as a user geometry of Embree. */
#ifndef RTSL_GEOMETRY_H
#define RTSL_GEOMETRY_H

#include "embree.h"
#include "rtsl.h"

typedef struct RtslGeometry RtslGeometry;

/* A geometry whose primitive i is instance i. The instances are of one class, refer to instances of the same classes, are
   committed, and must not be committed again or released before the geometry is freed. Null where that fails, which it has
   told on standard error. */
RtslGeometry *rtsl_geometry_new(const Embree *embree, RtslEngineId engine, const RtslInstanceId *instances, uint32_t count);

/* Frees it; no scene may use it any more. */
void rtsl_geometry_free(RtslGeometry *geometry);

/* Makes Embree's geometry of it. Its callbacks set, for rays that hit, the far end, the normal as computeNormal gives it, and
   the numbers of primitive, geometry and instance. Texture coordinates of the hit and filter functions are left alone. */
EmbreeGeometry rtsl_geometry_attach(RtslGeometry *geometry, const Embree *embree, EmbreeDevice device);

#endif
