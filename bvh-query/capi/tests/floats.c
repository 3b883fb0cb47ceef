/* Threads that round otherwise, flush subnormal numbers or trap: the bits of answers and the bytes of bakes are those of
 * a thread in the default state, and the state is the caller's afterwards and in its functions. */
#define _GNU_SOURCE
#include "support.h"
#include <fenv.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

/* A state of floating-point arithmetic. */
typedef struct { const char *name; int rounding, traps; unsigned flushes; } state;

static const state STATES[] = {
    {"upward", FE_UPWARD, 0, 0},
    {"downward", FE_DOWNWARD, 0, 0},
    {"toward zero", FE_TOWARDZERO, 0, 0},
    {"traps", FE_TONEAREST, FE_ALL_EXCEPT, 0},
    {"traps but for inexact numbers", FE_UPWARD, FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW | FE_UNDERFLOW, 0},
#ifdef __SSE__
    {"no subnormal numbers", FE_TONEAREST, 0, 0x8040},
    {"no subnormal results", FE_TONEAREST, 0, 0x8000},
    {"no subnormal operands", FE_DOWNWARD, 0, 0x0040},
#endif
};
enum { STATE_COUNT = sizeof STATES / sizeof *STATES };

/* Puts the thread in a state, whose traps are those of SSE and of the x87. */
static void enter(const state *of) {
    CHECK(fesetround(of->rounding) == 0);
#ifdef __SSE__
    _mm_setcsr((_mm_getcsr() & ~0x8040u) | of->flushes);
#endif
#ifdef __GLIBC__
    feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(of->traps);
#endif
}

static bool is_in(const state *of) {
#ifdef __SSE__
    /* What fegetround and fegetexcept return is the state of the x87. */
    const unsigned found = _mm_getcsr();
    return (found & 0x8040) == of->flushes && (found & 0x6000) == (unsigned)of->rounding << 3 &&
           (~found >> 7 & FE_ALL_EXCEPT) == (unsigned)of->traps;
#else
    return fegetround() == of->rounding;
#endif
}

static void leave(void) {
    const state usual = {"", FE_TONEAREST, 0, 0};
#ifdef __GLIBC__
    fedisableexcept(FE_ALL_EXCEPT);
#endif
    enter(&usual);
}

/* The state that functions of the caller have to be in, and how often they were called. */
static const state *present;
static int pose_calls, sagitta_calls, releases;

/* Nothing is computed here, so that no state matters: a path that stands still at a pose, given by `user`. */
static int32_t given_pose(void *user, double t, cbvh_pose *pose) {
    (void)t;
    CHECK(present == NULL || is_in(present));
    __atomic_add_fetch(&pose_calls, 1, __ATOMIC_RELAXED);
    memcpy(pose, user, sizeof *pose);
    return 0;
}

static double given_sagitta(void *user, double radius, double t0, double t1) {
    (void)user, (void)radius, (void)t0, (void)t1;
    CHECK(present == NULL || is_in(present));
    __atomic_add_fetch(&sagitta_calls, 1, __ATOMIC_RELAXED);
    return 0;
}

static void release(void *user) {
    (void)user;
    CHECK(present == NULL || is_in(present));
    releases++;
}

enum { POSES = 200, VERTICES = 400, FACES = 600, PATHS = 8 };
static double vertices[3 * VERTICES], small_vertices[3 * VERTICES], points[3 * POSES];
static uint32_t faces[3 * FACES];
static cbvh_pose poses[POSES], small_poses[POSES], starts[PATHS], ends[PATHS];

/* All that is compared. */
typedef struct {
    unsigned char bytes[2][200000];
    size_t sizes[2];
    bool touch[2][POSES], near[2][POSES], free_ways[PATHS], free_paths[PATHS], scene_touches;
    cbvh_distance_answer distances[2][POSES];
    size_t contacts[2];
    cbvh_closest_point closest[POSES];
    cbvh_motion_answer motions[PATHS];
    double moved, reach;
    cbvh_pose turned;
} answers;

/* Asks everything in a state, without a computation of its own. */
static void ask(answers *found, const state *of, int32_t parallel) {
    const double *corners[2] = {vertices, small_vertices};
    const cbvh_pose *places[2] = {poses, small_poses};
    const double ds[2] = {0.25, 2.5e-37};
    cbvh_querier querier;
    cbvh_scene scene;
    cbvh_path paths[PATHS];
    memset(found, 0, sizeof *found);
    present = of;
    if (of != NULL) {
        enter(of);
    }
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));
    OK(cbvh_querier_set_parallel(querier, parallel));
    for (int k = 0; k < 2; k++) {
        cbvh_mesh mesh;
        OK(cbvh_bake(corners[k], VERTICES, faces, FACES, NULL, &mesh));
        OK(cbvh_mesh_bytes(mesh, found->bytes[k], sizeof found->bytes[k], &found->sizes[k]));
        OK(cbvh_collide(querier, mesh, mesh, places[k], POSES, found->touch[k]));
        OK(cbvh_within(querier, mesh, mesh, places[k], POSES, ds[k], found->near[k]));
        OK(cbvh_distances(querier, mesh, mesh, places[k], POSES, NULL, found->distances[k]));
        FAILS(cbvh_contacts(querier, mesh, mesh, places[k], POSES, NULL, NULL, 0, &found->contacts[k]),
              CBVH_BUFFER_TOO_SMALL, "contacts: ");
        if (k == 0) {
            OK(cbvh_closest_points(querier, mesh, NULL, points, POSES, INFINITY, found->closest));
            OK(cbvh_edge_motions(querier, mesh, mesh, starts, ends, PATHS, NULL, found->motions));
            OK(cbvh_edges_are_free(querier, mesh, mesh, starts, ends, PATHS, NULL, found->free_ways));
            OK(cbvh_displacement(mesh, &starts[0], &ends[0], &found->moved));
            OK(cbvh_pose_relative(&starts[0], &ends[1], &found->turned));
            for (int p = 0; p < PATHS; p++) {
                OK(cbvh_path_from_functions(given_pose, given_sagitta, release, &starts[p], &paths[p]));
            }
            OK(cbvh_are_free(querier, mesh, mesh, paths, PATHS, NULL, found->free_paths));
            OK(cbvh_path_reach(mesh, paths[0], 0, 1, &found->reach));
            for (int p = 0; p < PATHS; p++) {
                OK(cbvh_path_free(paths[p]));
            }
            OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
            OK(cbvh_scene_set_parallel(scene, parallel));
            OK(cbvh_scene_add(scene, mesh, &starts[0], NULL, NULL));
            OK(cbvh_scene_add(scene, mesh, &starts[1], NULL, NULL));
            OK(cbvh_scene_add(scene, mesh, &starts[2], NULL, NULL));
            OK(cbvh_scene_collide(scene, &found->scene_touches));
            OK(cbvh_scene_free(scene));
        }
        OK(cbvh_mesh_free(mesh));
    }
    OK(cbvh_querier_free(querier));
    CHECK(of == NULL || is_in(of));
    leave();
    present = NULL;
}

static void same(const answers *a, const answers *b, const char *name) {
    const char *what = memcmp(a->bytes, b->bytes, sizeof a->bytes) != 0          ? "bytes of a bake"
                       : memcmp(a->touch, b->touch, sizeof a->touch) != 0        ? "collide"
                       : memcmp(a->distances, b->distances, sizeof a->distances) ? "distance"
                       : memcmp(a, b, sizeof *a) != 0                            ? "other answers"
                                                                                 : NULL;
    if (what != NULL) {
        fprintf(stderr, "%s: other %s\n", name, what);
        exit(1);
    }
}

/* Triangles here and there, also at the scale where products of coordinates are subnormal numbers. */
static void prepare(void) {
    random_source source = {5};
    for (int k = 0; k < VERTICES; k++) {
        for (int axis = 0; axis < 3; axis++) {
            vertices[3 * k + axis] = random_signed(&source);
            small_vertices[3 * k + axis] = 1e-36 * random_signed(&source);
        }
    }
    for (int k = 0; k < 3 * FACES; k++) {
        faces[k] = (uint32_t)random_below(&source, VERTICES);
    }
    for (int k = 0; k < POSES; k++) {
        poses[k] = random_pose(&source, 3);
        small_poses[k] = poses[k];
        for (int axis = 0; axis < 3; axis++) {
            small_poses[k].rows[4 * axis + 3] *= 1e-36;
            points[3 * k + axis] = 2 * random_signed(&source);
        }
    }
    for (int k = 0; k < PATHS; k++) {
        starts[k] = shift(4, k, 0.5 * k - 2);
        ends[k] = shift(-4, 0.5 * k, 0.25 * k);
    }
}

int main(void) {
    static answers expected, found;
    prepare();
    /* The first question starts the threads of the library, which have a state of their own from here on. */
    ask(&found, &STATES[0], 1);
    ask(&expected, NULL, 0);
    CHECK(expected.sizes[0] > 0 && expected.contacts[0] > 0 && expected.contacts[1] > 0);
    same(&found, &expected, "the first question");
    for (int k = 0; k < STATE_COUNT; k++) {
        for (int32_t parallel = 0; parallel < 2; parallel++) {
            ask(&found, &STATES[k], parallel);
            same(&found, &expected, STATES[k].name);
        }
    }
    CHECK(pose_calls > 0 && sagitta_calls > 0 && releases == PATHS * (2 + 2 * STATE_COUNT));
    printf("floats: the same bits in %d states of the caller\n", STATE_COUNT);
    return 0;
}
