/* What the tests in C share: checks that end the program, and a cube. */
#ifndef SUPPORT_H
#define SUPPORT_H

#include <cbvh.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Ends the program unless something is true. */
#define CHECK(is_true)                                                                                                 \
    do {                                                                                                               \
        if (!(is_true)) {                                                                                              \
            fprintf(stderr, "%s:%d: %s\n    last message: %s\n", __FILE__, __LINE__, #is_true, cbvh_last_message());   \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)

/* Ends the program unless a function succeeded. */
#define OK(call) CHECK((call) == CBVH_OK)

/* Ends the program unless a function failed with a status and a message that contains something. */
#define FAILS(call, expected, text)                                                                                    \
    do {                                                                                                               \
        const cbvh_status found_ = (call);                                                                             \
        if (found_ != (expected) || strstr(cbvh_last_message(), (text)) == NULL) {                                     \
            fprintf(stderr, "%s:%d: %s\n    expected %s and \"%s\"\n    found %d and \"%s\"\n", __FILE__, __LINE__,    \
                    #call, #expected, (text), (int)found_, cbvh_last_message());                                       \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)

static const double CUBE_VERTICES[24] = {-0.5, -0.5, -0.5, 0.5, -0.5, -0.5, -0.5, 0.5, -0.5, 0.5, 0.5, -0.5,
                                         -0.5, -0.5, 0.5,  0.5, -0.5, 0.5,  -0.5, 0.5, 0.5,  0.5, 0.5, 0.5};
static const uint32_t CUBE_FACES[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                        2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};

/* A cube around the origin, closed and oriented. */
static inline cbvh_mesh cube(double size) {
    double vertices[24];
    for (int k = 0; k < 24; k++) {
        vertices[k] = size * CUBE_VERTICES[k];
    }
    cbvh_mesh mesh;
    OK(cbvh_bake(vertices, 8, CUBE_FACES, 12, NULL, &mesh));
    return mesh;
}

/* Two cubes side by side along x in one object, closed and oriented, but not convex. The first one is around the origin. */
static inline cbvh_mesh two_cubes(void) {
    double vertices[48];
    uint32_t faces[72];
    for (int k = 0; k < 24; k++) {
        vertices[k] = CUBE_VERTICES[k];
        vertices[24 + k] = CUBE_VERTICES[k] + (k % 3 == 0 ? 1.25 : 0);
    }
    for (int k = 0; k < 36; k++) {
        faces[k] = CUBE_FACES[k];
        faces[36 + k] = CUBE_FACES[k] + 8;
    }
    cbvh_mesh mesh;
    OK(cbvh_bake(vertices, 16, faces, 24, NULL, &mesh));
    return mesh;
}

static inline cbvh_pose shift(double x, double y, double z) {
    cbvh_pose pose = CBVH_IDENTITY;
    pose.rows[3] = x;
    pose.rows[7] = y;
    pose.rows[11] = z;
    return pose;
}

/* Random numbers: splitmix64 (G. Steele, D. Lea, C. Flood, 2014). */
typedef struct { uint64_t state; } random_source;

static inline uint64_t random_bits(random_source *source) {
    uint64_t z = source->state += 0x9E3779B97F4A7C15u;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
}

static inline size_t random_below(random_source *source, size_t limit) { return (size_t)(random_bits(source) % limit); }

/* From -1 to 1. */
static inline double random_signed(random_source *source) {
    return (double)(random_bits(source) >> 11) * 0x1p-52 - 1;
}

/* A rotation of a random quaternion, and a translation. */
static inline cbvh_pose random_pose(random_source *source, double reach) {
    double q[4], length;
    do {
        length = 0;
        for (int k = 0; k < 4; k++) {
            q[k] = random_signed(source);
            length += q[k] * q[k];
        }
    } while (length < 0.01 || length > 1);
    const double translation[3] = {reach * random_signed(source), reach * random_signed(source),
                                   reach * random_signed(source)};
    for (int k = 0; k < 4; k++) {
        q[k] /= sqrt(length);
    }
    cbvh_pose pose;
    OK(cbvh_pose_from_quaternion(q, translation, &pose));
    return pose;
}

#endif
