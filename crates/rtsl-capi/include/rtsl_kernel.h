/* How compiled methods of RTSL classes are called. C99 and C++11. */
#ifndef RTSL_KERNEL_H
#define RTSL_KERNEL_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The version of this interface: that of a library must be the same. */
#define RTSL_ABI 3

/* Rays in one request of a shader to its host. */
#define RTSL_LANES 16
/* A colour has so many components: linear red, green and blue with the primaries of Rec. 709. */
#define RTSL_COLOR_COMPONENTS 3
/* Objects in a block. */
#define RTSL_OBJECTS_IN_BLOCK 8
/* No object, no parameter. */
#define RTSL_NONE UINT32_MAX

/* The components of the state of a ray: each variable's first. What a variable is can differ from role to role; the
   manual's table of roles has all of them. */
enum RtslState {
    RTSL_STATE_TimeSeed = 0, /* float: time within the shutter, in [0,1) */
    RTSL_STATE_ScreenCoord = 1, /* vec2: sample position on the image, [0,1]^2, (0,0) lower left */
    RTSL_STATE_LensCoord = 3, /* vec2: lens sample, [0,1)^2 */
    RTSL_STATE_du = 5, /* float: width of a pixel in `rt_ScreenCoord` */
    RTSL_STATE_dv = 6, /* float: height of a pixel in `rt_ScreenCoord` */
    RTSL_STATE_RayOrigin = 7, /* vec3: origin of the ray, in camera space */
    RTSL_STATE_RayDirection = 10, /* vec3: direction of the ray, in camera space; need not be unit length */
    RTSL_STATE_InverseRayDirection = 13, /* vec3: 1/rt_RayDirection, componentwise; the host computes it after the method */
    RTSL_STATE_Epsilon = 16, /* float: distance beyond which hits count, 0 unless the scene sets `epsilon` */
    RTSL_STATE_HitDistance = 17, /* float: greatest distance at which a hit counts (far clip) */
    RTSL_STATE_SampleColor = 18, /* color: weight of the ray (vignetting) */
    RTSL_STATE_HitPoint = 21, /* vec3: point on the surface, in the primitive's space; `computeNormal` may move it onto the surface */
    RTSL_STATE_BoundMin = 24, /* vec3: least corner of the box */
    RTSL_STATE_BoundMax = 27, /* vec3: greatest corner of the box */
    RTSL_STATE_GeometricNormal = 30, /* vec3: normal of the surface, outward, any length; the host normalises */
    RTSL_STATE_ShadingNormal = 33, /* vec3: normal for shading, outward, any length; the host normalises */
    RTSL_STATE_TextureUV = 36, /* vec2: surface parameters */
    RTSL_STATE_TextureUVW = 38, /* vec3: coordinates for solid textures */
    RTSL_STATE_dPdu = 41, /* vec3: derivative of the surface point by u */
    RTSL_STATE_dPdv = 44, /* vec3: derivative of the surface point by v */
    RTSL_STATE_dsdu = 47, /* float: derivative of the first texture coordinate by u */
    RTSL_STATE_dsdv = 48, /* float: derivative of the first texture coordinate by v */
    RTSL_STATE_dtdu = 49, /* float: derivative of the second texture coordinate by u */
    RTSL_STATE_dtdv = 50, /* float: derivative of the second texture coordinate by v */
    RTSL_STATE_PDF = 51, /* float: density per unit solid angle, seen from `rt_RayOrigin` */
    RTSL_STATE_TextureColor = 52, /* color: the texture's colour */
    RTSL_STATE_FloatTextureValue = 55, /* float: the texture's value; 0 where neither it nor the colour is set */
    RTSL_STATE_LightDirection = 56, /* vec3: unit vector away from the surface, towards the light */
    RTSL_STATE_LightDistance = 59, /* float: distance to the light */
    RTSL_STATE_LightColor = 60, /* color: the light's sample */
    RTSL_STATE_BSDFSeed = 63, /* vec3: uniform in [0,1)^3; z picks the lobe */
    RTSL_STATE_BSDFValue = 66, /* color: the scattering function, without the cosine */
    RTSL_STATE_EmissionColor = 69, /* color: radiance leaving towards the ray's origin */
    RTSL_STATE_SurfaceOffset = 72, /* float: least distance along the geometric normal at which rays that leave the surface begin, in the primitive's space; where `rt_HitPoint` is set, too, the error of `intersect` and of that point */
    RTSL_STATE_RayWidth = 73, /* float: width of the ray's footprint at its origin */
    RTSL_STATE_RaySpread = 74, /* float: growth of the footprint's width with each length of the direction */
    RTSL_STATE_RayDepth = 75, /* float: number of surfaces before: 0 for a camera's ray, 1 for one that a material's `shade` traces there */
    RTSL_STATE_RelativeIndex = 76, /* float: index of refraction on the side of `rt_LightDirection`, over that on the ray's side, whose square divides `rt_BSDFValue`; 1 for what is not refracted */
    RTSL_STATE_Regularization = 77, /* float: width of highlights up to which narrower ones are to be widened, by `regularized`; 0 for none */
    RTSL_STATE_RayType = 78, /* float: type of the ray: `rt_CAMERA_RAY`, or `rt_TRACED_RAY` for one that `trace` traces */
    RTSL_STATE_ObjectNumber = 79, /* float: index of the object in the scene */
    RTSL_STATE_InstanceNumber = 80, /* float: index of the instance that places the object; -1 for objects that none places */
    RTSL_STATE_ElementNumber = 81, /* float: index of the object's element, such as the triangle of a mesh; above 2^24 rounded */
    RTSL_STATE_Presence = 82, /* float: part of the surface that is there: the probability that a ray meets it */
    RTSL_STATE__Attributes = 83, /* float[]: attributes of the object that the ray hit, in the order of the scene's list */
    RTSL_STATE__ToObject = 115, /* float[]: map of points from the world to the object's space: the images of the axes, then that of the origin */
    RTSL_STATE__ToWorld = 127, /* float[]: map of points from the object's space to the world, likewise */
    RTSL_STATE_COMPONENTS = 139
};

/* What methods find in components that no host sets: initialisers for RTSL_STATE_COMPONENTS floats. */
#define RTSL_STATE_DEFAULTS \
    0.0f, \
    0.0f, 0.0f, \
    0.0f, 0.0f, \
    0.0f, \
    0.0f, \
    0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f, 1.0f, \
    0.0f, 0.0f, 0.0f, \
    0.0f, \
    INFINITY, \
    0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f, 1.0f, \
    0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f, \
    0.0f, 0.0f, 0.0f, \
    1.0f, 0.0f, 0.0f, \
    0.0f, 1.0f, 0.0f, \
    1.0f, \
    0.0f, \
    0.0f, \
    1.0f, \
    0.0f, \
    0.0f, 0.0f, 0.0f, \
    0.0f, \
    0.0f, 0.0f, 1.0f, \
    0.0f, \
    0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f, 0.0f, \
    0.0f, \
    0.0f, \
    0.0f, \
    0.0f, \
    0.0f, \
    0.0f, \
    0.0f, \
    0.0f, \
    0.0f, \
    0.0f, \
    0.0f, \
    0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, \
    1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, \
    1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f

/* Bits of RtslClass.roles. */
enum RtslRole {
    RTSL_CAMERA = 1,
    RTSL_PRIMITIVE = 2,
    RTSL_TEXTURE = 4,
    RTSL_LIGHT = 8,
    RTSL_MATERIAL = 16,
    RTSL_INTEGRATOR = 32
};

/* What the lanes of a call have in common. */
enum RtslShape {
    RTSL_SINGLE = 0,        /* one ray, one object: plain scalar code; the mask is not looked at */
    RTSL_PACKET = 1,        /* many rays, one object */
    RTSL_COMMON_ORIGIN = 2, /* the same, and all rays start where the first does */
    RTSL_STREAM = 3,        /* many rays, each with an object of its own */
    RTSL_LEAF = 4           /* one ray, many objects */
};

/* Types of scalars. All take one word of 4 bytes. A bool is 0 or 1 in blocks, 0 or -1 in lane arrays. */
enum RtslScalar { RTSL_FLOAT = 0, RTSL_INT = 1, RTSL_UINT = 2, RTSL_BOOL = 3 };

/* Bits of RtslCall.status. */
enum RtslStatus {
    RTSL_BUDGET_EXHAUSTED = 1 /* a ray used up its budget of loop iterations; its results are those of the loop cut short */
};

/* Rays of a request, one a lane. */
typedef struct RtslRayLanes {
    float origin[3][RTSL_LANES];    /* world space */
    float direction[3][RTSL_LANES]; /* world space, any length */
    float limit[RTSL_LANES];        /* greatest parameters of a hit */
    float weight[RTSL_LANES];       /* of trace: the greatest factor that the answer is multiplied with; 1 where that is not known, may be NaN */
} RtslRayLanes;

/* Points that ask for light, one a lane. */
typedef struct RtslLightQueryLanes {
    float point[3][RTSL_LANES];  /* world space */
    float normal[3][RTSL_LANES]; /* axes of cones, any length */
    float cosine[RTSL_LANES];    /* least cosines between axis and light; -INFINITY for no cone */
} RtslLightQueryLanes;

/* Samples of a light, one a lane. */
typedef struct RtslLightLanes {
    float direction[3][RTSL_LANES];                 /* unit vectors towards the light */
    float distance[RTSL_LANES];
    float color[RTSL_COLOR_COMPONENTS][RTSL_LANES]; /* radiance, or the whole contribution where the density is 0 */
    float pdf[RTSL_LANES];                          /* densities per solid angle; 0 for a delta */
} RtslLightLanes;

/* What a shader asks of its renderer. Lane i of a request is ray base + i of the call, and asks if bit i of active is set; only
   its answer is read. An answer must depend on its own ray alone. Requests are 64-byte aligned. No function may throw or
   jump out. Methods of primitives, cameras and textures ask for nothing, rand() apart. */
typedef struct RtslHostFunctions {
    /* the radiance along rays, up to their limits */
    void (*trace)(void *user, uint32_t base, uint32_t active, const RtslRayLanes *rays,
                  float (*radiance)[RTSL_LANES] /* [RTSL_COLOR_COMPONENTS] */);
    /* which lanes have anything on their rays before the limit */
    uint32_t (*occluded)(void *user, uint32_t base, uint32_t active, const RtslRayLanes *rays);
    /* how many light samples there are; the same throughout a call */
    uint32_t (*light_count)(void *user);
    /* light sample index at points: the lanes that the light reaches unshadowed from within their cones */
    uint32_t (*light_sample)(void *user, uint32_t base, uint32_t active, uint32_t index,
                             const RtslLightQueryLanes *query, RtslLightLanes *light);
    /* the scene's ambient light */
    void (*ambient)(void *user, float *color /* [RTSL_COLOR_COMPONENTS] */);
    /* the next dimension of each ray's sampler, in [0,1) */
    void (*rand)(void *user, uint32_t base, uint32_t active, float *values /* [RTSL_LANES] */);
} RtslHostFunctions;

/* A test of a leaf: intersect in the leaf shape does several in a call. */
typedef struct RtslLeafTest {
    uint32_t ray;     /* the lane of the ray in state and scratch */
    uint32_t first;   /* the number of the first object, a multiple of RTSL_OBJECTS_IN_BLOCK */
    uint32_t nearest; /* written: the number of the object with the nearest hit, or RTSL_NONE */
} RtslLeafTest;

/* A call of a kernel. Lane arrays have one word a ray. They are readable and writable up to the count rounded up to the kernel's
   width; what lies past the count, and rays that the mask leaves out, does not change. Zero the struct first: fields that a
   shape has no use for stay 0. */
typedef struct RtslCall {
    float *const *state;           /* a lane array for each of RTSL_STATE_COMPONENTS; those that the method neither reads nor writes may be null */
    float *const *scratch;         /* a lane array for each scratch scalar: what intersect left for the hit is what later methods read */
    const int32_t *mask;           /* 0 or -1 a ray; null: all rays */
    int32_t *accepted;             /* intersect, leaf shape apart: written, -1 for rays with a hit, 0 for others */
    const void *instance;          /* the block of the instance, or of what objects share; 8-byte aligned */
    const void *objects;           /* stream and leaf: blocks of objects, 32-byte aligned. Word w of object n of objects with W words is
                                      word ((n / 8) * W + w) * 8 + n % 8. In the leaf shape, methods but intersect: from the first object on */
    const uint32_t *index;         /* stream: the object of each ray */
    const RtslHostFunctions *host; /* null where the method asks for nothing */
    void *user;                    /* passed to the host's functions */
    uint32_t count;                /* rays; leaf: objects; 1 for RTSL_SINGLE */
    uint32_t status;               /* bits of RtslStatus are set */
    uint32_t test_count;           /* leaf, intersect */
    uint32_t first;                /* with a mask, methods but intersect: the first ray of a chunk before which all rays are off; else 0 */
    RtslLeafTest *tests;           /* leaf, intersect */
} RtslCall;

typedef void (*RtslKernel)(RtslCall *call);

/* A buffer's entry in a block. */
typedef struct RtslBuffer {
    const void *words; /* its scalars, element by element; 4-byte aligned */
    uint32_t count;    /* elements; one without elements reads as zeros */
    uint32_t unused;
} RtslBuffer;

/* Bits of RtslParameter.flags. */
enum RtslParameterFlag {
    RTSL_REQUIRED = 1,    /* the host must set it */
    RTSL_IS_BUFFER = 2,   /* an RtslBuffer stands at the offset */
    RTSL_IS_COLOR = 4     /* linear RGB */
};

/* What a host may set. A parameter that is a struct appears field by field, as "light.position"; one of a class that a
   reference was bound to as "kd.scale". */
typedef struct RtslParameter {
    const char *name;
    const char *type;          /* as RTSL writes it: "float", "vec3", "color", "float[4]", "vec3[]" */
    const char *label;         /* a name for people, or null */
    const char *documentation; /* or null */
    uint32_t scalar;           /* an RtslScalar */
    uint32_t count;            /* scalars; of a buffer, in one element */
    uint32_t offset;           /* its first word in the block */
    uint32_t flags;            /* bits of RtslParameterFlag */
    float minimum;             /* what the class allows; -INFINITY and INFINITY where it does not say */
    float maximum;
} RtslParameter;

/* Bits of RtslMethod.flags. */
enum RtslMethodFlag {
    RTSL_READS_SCRATCH = 1,
    RTSL_WRITES_SCRATCH = 2,
    RTSL_LEAVES_ZEROS = 4 /* in all that it sets, whatever it is called for: a BSDF that does so is specular */
};

/* A kernel: a method in one shape and width. */
typedef struct RtslMethod {
    const char *name; /* "intersect" */
    RtslKernel kernel;
    const uint32_t *reads;  /* the state components that it reads */
    const uint32_t *writes; /* those that it sets; of intersect, for rays with a hit alone */
    uint32_t read_count;
    uint32_t write_count;
    uint32_t shape; /* an RtslShape */
    uint32_t width; /* rays at a time */
    uint32_t flags; /* bits of RtslMethodFlag */
    uint32_t unused;
} RtslMethod;

/* A class. An instance is a block of words, 8-byte aligned. To make one: copy initial to a block of construct_words, set parameters at
   their offsets, call construct if it is not null. The first block_words words are then the instance; to change a parameter, do the
   same again. Construct gives bits of RtslStatus. */
typedef struct RtslClass {
    const char *name;
    const char *documentation; /* or null */
    const RtslParameter *parameters;
    const RtslMethod *methods;
    const uint32_t *initial;
    uint32_t (*construct)(void *block);
    uint32_t roles; /* bits of RtslRole */
    uint32_t parameter_count;
    uint32_t method_count;
    uint32_t block_words;
    uint32_t construct_words;
    uint32_t scratch_arrays;
    uint32_t element_parameter; /* a parameter that counts the objects that hosts make of one set of parameters, such as the triangles of a
                                   mesh; RTSL_NONE where there is none */
    uint32_t element_buffer;    /* the parameter whose elements it counts, element_stride at a time */
    uint32_t element_stride;
    uint32_t unused;
} RtslClass;

/* Classes that were compiled together. Its symbol is "rtsl_library", or what stands for "rtsl" in the library. */
typedef struct RtslLibrary {
    uint32_t abi; /* RTSL_ABI */
    uint32_t class_count;
    const RtslClass *const *classes;
    const char *version; /* of the compiler */
    const char *target;  /* the processor that the code is for, as "x86-64-v3" */
} RtslLibrary;

/* The class of a name, or null. */
static inline const RtslClass *rtsl_find_class(const RtslLibrary *library, const char *name)
{
    for (uint32_t i = 0; i < library->class_count; i++)
        if (strcmp(library->classes[i]->name, name) == 0)
            return library->classes[i];
    return NULL;
}

/* The parameter of a name, or null. */
static inline const RtslParameter *rtsl_find_parameter(const RtslClass *cls, const char *name)
{
    for (uint32_t i = 0; i < cls->parameter_count; i++)
        if (strcmp(cls->parameters[i].name, name) == 0)
            return &cls->parameters[i];
    return NULL;
}

/* A kernel of a method, or null; any width where it is 0. */
static inline const RtslMethod *rtsl_find_method(const RtslClass *cls, const char *name, uint32_t shape, uint32_t width)
{
    for (uint32_t i = 0; i < cls->method_count; i++) {
        const RtslMethod *method = &cls->methods[i];
        if (method->shape == shape && (width == 0 || method->width == width) && strcmp(method->name, name) == 0)
            return method;
    }
    return NULL;
}

/* Begins an instance in a block of construct_words words. */
static inline void rtsl_begin_instance(const RtslClass *cls, void *block)
{
    if (cls->construct_words > 0)
        memcpy(block, cls->initial, cls->construct_words * sizeof(uint32_t));
}

/* Ends an instance whose parameters are set: bits of RtslStatus. */
static inline uint32_t rtsl_end_instance(const RtslClass *cls, void *block)
{
    return cls->construct ? cls->construct(block) : 0;
}

#ifdef __cplusplus
}
#endif

#endif /* RTSL_KERNEL_H */
