// What reads calls, makes them, and writes what they leave.
#include <cstdio>
#include <cstdlib>
#include <type_traits>
#include <vector>

static std::vector<uint32_t> input;
static std::vector<uint32_t> output;
static size_t position;

static std::vector<uint32_t> read(size_t count) {
    std::vector<uint32_t> words(input.begin() + position, input.begin() + position + count);
    position += count;
    words.push_back(0);
    return words;
}

static float as_float(uint32_t word) {
    float value;
    memcpy(&value, &word, sizeof value);
    return value;
}

static void write(uint32_t word) { output.push_back(word); }
static void write(int32_t word) { output.push_back(uint32_t(word)); }
static void write(bool word) { output.push_back(word); }

static void write(float value) {
    uint32_t word;
    memcpy(&word, &value, sizeof word);
    output.push_back(word);
}

static void set_words(void *to, const std::vector<uint32_t> &words) {
    memcpy(to, words.data(), (words.size() - 1) * 4);
}

static void write_words(const void *from, size_t count) {
    for (size_t i = 0; i < count; i++) {
        uint32_t word;
        memcpy(&word, static_cast<const char *>(from) + 4 * i, 4);
        output.push_back(word);
    }
}

template <typename T>
static void set(T &object, const std::vector<uint32_t> &words) {
    if (!std::is_empty<T>::value) memcpy(static_cast<void *>(&object), words.data(), sizeof object);
}

template <typename T>
static std::vector<uint32_t> read_buffer(T &object, size_t offset, size_t scalars) {
    const uint32_t count = input[position++];
    std::vector<uint32_t> words = read(count * scalars);
    const void *address = words.data();
    char *entry = reinterpret_cast<char *>(&object) + offset * 4;
    memcpy(entry, &address, 8);
    memcpy(entry + 8, &count, 4);
    return words;
}

/// The members, with zeros for what stands in entries of buffers.
template <typename T>
static void write_block(const T &object, size_t count) {
    write_words(&object, count);
}

template <typename F, typename std::enable_if<std::is_void<decltype(std::declval<F>()())>::value, int>::type = 0>
static bool finished(F construct) {
    construct();
    return true;
}

template <typename F, typename std::enable_if<!std::is_void<decltype(std::declval<F>()())>::value, int>::type = 0>
static bool finished(F construct) {
    return construct();
}

template <typename S>
static auto exceeded(const S &state, int) -> decltype(state.budget_exceeded) {
    return state.budget_exceeded;
}

template <typename S>
static bool exceeded(const S &, long) {
    return false;
}

static uint64_t mix(uint64_t state) {
    state = state * 0x9e3779b97f4a7c15 + 0x9e3779b97f4a7c15;
    state = (state ^ state >> 30) * 0xbf58476d1ce4e5b9;
    state = (state ^ state >> 27) * 0x94d049bb133111eb;
    return state ^ state >> 31;
}

static float unit(uint64_t hash, int component) {
    return float(mix(hash + component) >> 40) / float(1 << 24);
}

/// The test host of the representation, for ray 0.
struct Hashes {
    uint32_t requests = 0;
    uint64_t hash = 0;

    void begin() { hash = mix(0) ^ ++requests; }

    void add(float value) {
        uint32_t word;
        memcpy(&word, &value, sizeof word);
        hash = mix(hash ^ (value != value ? 0x7fc00000u : word));
    }

    void add(const float (&vector)[3]) {
        for (float value : vector) add(value);
    }

    void add(const float (&vector)[3][16]) {
        for (const float (&lanes)[16] : vector) add(lanes[0]);
    }
};

template <typename Base, typename Light>
struct HashHost : Base {
    Hashes hashes;

    void trace(const float (&origin)[3], const float (&direction)[3], float limit, float weight,
               float (&radiance)[3]) override {
        hashes.begin();
        hashes.add(origin);
        hashes.add(direction);
        hashes.add(limit);
        hashes.add(weight);
        for (int i = 0; i < 3; i++) radiance[i] = unit(hashes.hash, i);
    }

    bool occluded(const float (&origin)[3], const float (&direction)[3], float limit) override {
        hashes.begin();
        hashes.add(origin);
        hashes.add(direction);
        hashes.add(limit);
        return hashes.hash & 1;
    }

    int32_t light_count() override { return 3; }

    bool light_sample(int32_t index, const float (&point)[3], const float (&normal)[3], float cosine,
                      Light &light) override {
        hashes.begin();
        hashes.add(point);
        hashes.add(normal);
        hashes.add(cosine);
        hashes.add(float(uint32_t(index)));
        for (int i = 0; i < 3; i++) light.direction[i] = unit(hashes.hash, i);
        light.distance = unit(hashes.hash, 3);
        for (int i = 0; i < 3; i++) light.color[i] = unit(hashes.hash, 4 + i);
        light.pdf = unit(hashes.hash, 7);
        return (hashes.hash & 3) != 0;
    }

    void ambient(float (&color)[3]) override {
        for (int i = 0; i < 3; i++) color[i] = unit(7, i);
    }

    float rand() override {
        hashes.begin();
        return unit(hashes.hash, 0);
    }
};

#ifdef KERNELS

static Hashes &begin(void *user) {
    Hashes &hashes = *static_cast<Hashes *>(user);
    hashes.begin();
    return hashes;
}

static void trace(void *user, uint32_t, uint32_t, const RtslRayLanes *rays, float (*radiance)[RTSL_LANES]) {
    Hashes &hashes = begin(user);
    hashes.add(rays->origin);
    hashes.add(rays->direction);
    hashes.add(rays->limit[0]);
    hashes.add(rays->weight[0]);
    for (int i = 0; i < 3; i++) radiance[i][0] = unit(hashes.hash, i);
}

static uint32_t occluded(void *user, uint32_t, uint32_t, const RtslRayLanes *rays) {
    Hashes &hashes = begin(user);
    hashes.add(rays->origin);
    hashes.add(rays->direction);
    hashes.add(rays->limit[0]);
    return hashes.hash & 1;
}

static uint32_t light_count(void *) { return 3; }

static uint32_t light_sample(void *user, uint32_t, uint32_t, uint32_t index,
                             const RtslLightQueryLanes *query, RtslLightLanes *light) {
    Hashes &hashes = begin(user);
    hashes.add(query->point);
    hashes.add(query->normal);
    hashes.add(query->cosine[0]);
    hashes.add(float(index));
    for (int i = 0; i < 3; i++) light->direction[i][0] = unit(hashes.hash, i);
    light->distance[0] = unit(hashes.hash, 3);
    for (int i = 0; i < 3; i++) light->color[i][0] = unit(hashes.hash, 4 + i);
    light->pdf[0] = unit(hashes.hash, 7);
    return (hashes.hash & 3) != 0;
}

static void ambient(void *, float *color) {
    for (int i = 0; i < 3; i++) color[i] = unit(7, i);
}

static void random_number(void *user, uint32_t, uint32_t, float *values) {
    values[0] = unit(begin(user).hash, 0);
}

/// The same host for kernels.
static const RtslHostFunctions host_functions = {trace,        occluded, light_count,
                                                 light_sample, ambient,  random_number};

static void check(bool is_right, const char *name, const char *method, const char *what) {
    if (is_right) return;
    fprintf(stderr, "%s.%s: the kernel gives another %s\n", name, method, what);
    exit(1);
}

static bool is_same(uint32_t a, uint32_t b) {
    return a == b || (as_float(a) != as_float(a) && as_float(b) != as_float(b));
}

struct StateWords {
    const uint32_t *components;
    const std::vector<uint32_t> &before;
    const void *after;
};

struct ScratchWords {
    /// b for bools, w for other words.
    const char *kinds;
    const std::vector<uint32_t> &before;
    /// Where they are in the output.
    size_t after;
};

/// The same call by the class's kernel.
static void check_kernel(const RtslLibrary &library, const char *name, const char *method_name,
                         const void *block, StateWords words, ScratchWords kept, bool accepts) {
    const RtslClass *its_class = rtsl_find_class(&library, name);
    const RtslMethod *method = rtsl_find_method(its_class, method_name, RTSL_SINGLE, 1);
    check(library.abi == RTSL_ABI && method, name, method_name, "table");
    static float lanes[RTSL_STATE_COMPONENTS][RTSL_LANES], kept_lanes[256][RTSL_LANES];
    float *state[RTSL_STATE_COMPONENTS], *scratch[256];
    for (int i = 0; i < RTSL_STATE_COMPONENTS; i++) state[i] = lanes[i];
    for (int i = 0; i < 256; i++) scratch[i] = kept_lanes[i];
    const size_t count = words.before.size() - 1, kept_count = strlen(kept.kinds);
    for (size_t i = 0; i < count; i++) memcpy(state[words.components[i]], &words.before[i], 4);
    for (size_t i = 0; i < kept_count; i++) {
        const uint32_t word = kept.kinds[i] == 'b' && kept.before[i] ? 0xffffffff : kept.before[i];
        memcpy(scratch[i], &word, 4);
    }
    Hashes hashes;
    int32_t accepted[RTSL_LANES] = {};
    RtslCall call = {};
    call.state = state;
    call.scratch = scratch;
    call.accepted = accepted;
    call.instance = block;
    call.host = &host_functions;
    call.user = &hashes;
    call.count = 1;
    method->kernel(&call);
    check(accepted[0] == (accepts ? -1 : 0), name, method_name, "answer");
    for (size_t i = 0; i < count; i++) {
        uint32_t found, expected;
        memcpy(&found, state[words.components[i]], 4);
        memcpy(&expected, static_cast<const char *>(words.after) + 4 * i, 4);
        check(is_same(found, expected), name, method_name, "state");
    }
    for (size_t i = 0; i < kept_count; i++) {
        uint32_t found, expected = output[kept.after + i];
        memcpy(&found, scratch[i], 4);
        if (kept.kinds[i] == 'b') expected = expected ? 0xffffffff : 0;
        check(is_same(found, expected), name, method_name, "scratch");
    }
}

/// The same construction by the class's function.
template <typename T>
static void check_constructor(uint32_t (*construct)(void *), const T &object, size_t words,
                              const std::vector<uint32_t> &block) {
    std::vector<uint64_t> own((block.size() + 1) / 2);
    memcpy(own.data(), block.data(), block.size() * 4);
    construct(own.data());
    for (size_t i = 0; i < words; i++) {
        uint32_t found, expected;
        memcpy(&found, reinterpret_cast<const char *>(own.data()) + 4 * i, 4);
        memcpy(&expected, reinterpret_cast<const char *>(&object) + 4 * i, 4);
        check(is_same(found, expected), "construct", "", "block");
    }
}

#endif

