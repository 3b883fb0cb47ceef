/* Threads: several with a querier each and one mesh give the same bits; one querier for two is refused; a mesh, a path
 * and a scene may be freed while others use them; many look at a scene; functions of paths ask by themselves; a scene is
 * changed while others ask, and each answer is that of one scene; a flag stops questions that other threads ask, and bakes. */
#include "support.h"
#include <pthread.h>
#include <time.h>

#define THREADS 4
#define POSES 400
#define ROUNDS 20

static cbvh_mesh mesh;
static cbvh_pose poses[POSES];
static cbvh_distance_answer expected[POSES];

static void *ask(void *unused) {
    cbvh_querier querier;
    cbvh_distance_answer answers[POSES];
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));
    for (int round = 0; round < ROUNDS; round++) {
        memset(answers, 0, sizeof answers);
        OK(cbvh_distances(querier, mesh, mesh, poses, POSES, NULL, answers));
        CHECK(memcmp(answers, expected, sizeof expected) == 0);
        /* One after the other, and with handles that come and go. */
        cbvh_mesh own;
        OK(cbvh_mesh_clone(mesh, &own));
        for (int k = 0; k < POSES; k++) {
            OK(cbvh_distances(querier, own, mesh, &poses[k], 1, NULL, &answers[k]));
        }
        OK(cbvh_mesh_free(own));
        CHECK(memcmp(answers, expected, sizeof expected) == 0);
        FAILS(cbvh_distances(querier, own, mesh, poses, 1, NULL, answers), CBVH_INVALID_HANDLE, "a: ");
    }
    OK(cbvh_querier_free(querier));
    return unused;
}

/* Waits inside a question until the other thread has tried what it must not. */
static pthread_barrier_t barrier;
static cbvh_querier shared;
static cbvh_scene scene;
static int calls;

static int32_t waiting_pose(void *user, double t, cbvh_pose *pose) {
    (void)user;
    *pose = shift(3 + t, 0, 0);
    if (calls++ == 0) {
        pthread_barrier_wait(&barrier);
        pthread_barrier_wait(&barrier);
    }
    return 0;
}

static double no_sagitta(void *user, double radius, double t0, double t1) {
    (void)user, (void)radius, (void)t0, (void)t1;
    return 1e-12;
}

static cbvh_path path;
static cbvh_mesh temporary;

static void *hold(void *unused) {
    bool answer;
    OK(cbvh_are_free(shared, temporary, mesh, &path, 1, NULL, &answer));
    CHECK(answer);
    return unused;
}

static void *hold_scene(void *instance) {
    bool answer;
    OK(cbvh_scene_is_free(scene, instance, &path, 1, NULL, &answer));
    CHECK(answer);
    return NULL;
}

/* Paths whose functions ask by themselves, with a lock held and all cores allowed. */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static cbvh_querier inner;
static cbvh_scene inner_scene;
static int inner_calls;

static int32_t asking_pose(void *user, double t, cbvh_pose *pose) {
    static cbvh_distance_answer found[POSES];
    bool answer;
    cbvh_mesh baked;
    CHECK(pthread_mutex_lock(&lock) == 0);
    OK(cbvh_distances(inner, mesh, mesh, poses, POSES, NULL, found));
    CHECK(memcmp(found, expected, sizeof expected) == 0);
    OK(cbvh_scene_collide(inner_scene, &answer));
    CHECK(answer);
    if (inner_calls++ % 64 == 0) {
        baked = cube(2);
        OK(cbvh_mesh_free(baked));
    }
    CHECK(pthread_mutex_unlock(&lock) == 0);
    *pose = shift(*(const double *)user + t, 0, 0);
    return 0;
}

static void callbacks_that_ask(void) {
    enum { PATHS = 40, QUESTIONS = 3, PLACES = 12 };
    double places[PATHS];
    cbvh_instance moving[PATHS];
    cbvh_scene outer_scene;
    bool answer;
    cbvh_querier outer;
    cbvh_path paths[PATHS];
    bool answers[PATHS];
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &outer));
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &inner));
    OK(cbvh_querier_set_parallel(outer, 1));
    OK(cbvh_querier_set_parallel(inner, 1));
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &inner_scene));
    OK(cbvh_scene_set_parallel(inner_scene, 1));
    for (int k = 0; k < PLACES; k++) {
        OK(cbvh_scene_add(inner_scene, mesh, &poses[k], NULL, NULL));
    }
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &outer_scene));
    OK(cbvh_scene_set_parallel(outer_scene, 1));
    for (int k = 0; k < PATHS; k++) {
        /* Behind each other, and each where the one before will be. */
        places[k] = 2 + 1.5 * k;
        const cbvh_pose place = shift(places[k], 0, 0);
        OK(cbvh_scene_add(outer_scene, mesh, &place, NULL, &moving[k]));
        OK(cbvh_path_from_functions(asking_pose, no_sagitta, NULL, &places[k], &paths[k]));
    }
    for (int round = 0; round < QUESTIONS; round++) {
        OK(cbvh_are_free(outer, mesh, mesh, paths, PATHS, NULL, answers));
        for (int k = 0; k < PATHS; k++) {
            CHECK(answers[k]);
        }
        OK(cbvh_scene_is_free(outer_scene, moving, paths, PATHS, NULL, &answer));
        CHECK(answer);
    }
    OK(cbvh_scene_free(outer_scene));
    for (int k = 0; k < PATHS; k++) {
        OK(cbvh_path_free(paths[k]));
    }
    OK(cbvh_scene_free(inner_scene));
    OK(cbvh_querier_free(inner));
    OK(cbvh_querier_free(outer));
}

/* Looks at a scene, as others do at the same time. */
static void *look(void *instance) {
    for (int round = 0; round < 2000; round++) {
        cbvh_scene copy;
        cbvh_pose world;
        cbvh_stats stats;
        cbvh_instance found;
        size_t count;
        OK(cbvh_scene_clone(scene, &copy));
        OK(cbvh_scene_free(copy));
        OK(cbvh_scene_find(scene, "one", &found));
        CHECK(found.id == ((cbvh_instance *)instance)->id);
        OK(cbvh_scene_instance_pose(scene, found, &world));
        OK(cbvh_scene_stats(scene, &stats));
        OK(cbvh_scene_instances(scene, &found, 1, &count));
    }
    return NULL;
}

static void lookers(void) {
    pthread_t threads[THREADS];
    const cbvh_pose here = CBVH_IDENTITY;
    cbvh_instance one;
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
    OK(cbvh_scene_add(scene, mesh, &here, "one", &one));
    for (int k = 0; k < THREADS; k++) {
        CHECK(pthread_create(&threads[k], NULL, look, &one) == 0);
    }
    for (int k = 0; k < THREADS; k++) {
        CHECK(pthread_join(threads[k], NULL) == 0);
    }
    OK(cbvh_scene_free(scene));
}

/* Threads that ask while another one swaps the mesh of an instance back and forth. */
static cbvh_scene swapped;
static cbvh_scene_contact both[2][500];
static size_t counts_of[2];
static int is_over, seen[2];

static void *ask_swapped(void *unused) {
    static const cbvh_scene_contact nothing;
    while (!__atomic_load_n(&is_over, __ATOMIC_RELAXED)) {
        cbvh_scene_contact found[500];
        size_t count;
        memset(found, 0, sizeof found);
        OK(cbvh_scene_contacts(swapped, found, 500, &count));
        const int which = count != counts_of[0];
        CHECK(count == counts_of[which] && memcmp(found, both[which], count * sizeof nothing) == 0);
        __atomic_fetch_add(&seen[which], 1, __ATOMIC_RELAXED);
    }
    return unused;
}

static void swaps(void) {
    const cbvh_mesh meshes[2] = {cube(1), cube(4)};
    pthread_t threads[THREADS];
    cbvh_instance one, other;
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &swapped));
    OK(cbvh_scene_set_tracking(swapped, 1));
    for (int k = 0; k < 8; k++) {
        const cbvh_pose place = shift(0.75 * k, 0.3, 0.1);
        OK(cbvh_scene_add(swapped, mesh, &place, NULL, &other));
    }
    const cbvh_pose here = CBVH_IDENTITY;
    OK(cbvh_scene_add(swapped, mesh, &here, "swapped", &one));
    for (int k = 1; k >= 0; k--) {
        OK(cbvh_scene_set_mesh(swapped, one, meshes[k]));
        OK(cbvh_scene_contacts(swapped, both[k], 500, &counts_of[k]));
    }
    CHECK(counts_of[0] != counts_of[1] && counts_of[0] > 0);
    for (int k = 0; k < THREADS; k++) {
        CHECK(pthread_create(&threads[k], NULL, ask_swapped, NULL) == 0);
    }
    for (int k = 0; k < 1000000; k++) {
        OK(cbvh_scene_set_mesh(swapped, one, meshes[k % 2]));
        if (__atomic_load_n(&seen[0], __ATOMIC_RELAXED) > 20 && __atomic_load_n(&seen[1], __ATOMIC_RELAXED) > 20) {
            break;
        }
    }
    __atomic_store_n(&is_over, 1, __ATOMIC_RELAXED);
    for (int k = 0; k < THREADS; k++) {
        CHECK(pthread_join(threads[k], NULL) == 0);
    }
    CHECK(seen[0] > 20 && seen[1] > 20);
    OK(cbvh_scene_free(swapped));
    OK(cbvh_mesh_free(meshes[0]));
    OK(cbvh_mesh_free(meshes[1]));
}

/* Sets a flag a moment later, while another thread asks. */
static cbvh_stop stop;

static void *set_soon(void *unused) {
    const struct timespec moment = {0, 20000000};
    CHECK(nanosleep(&moment, NULL) == 0);
    OK(cbvh_stop_set(stop));
    return unused;
}

static double seconds(void) {
    struct timespec now;
    CHECK(clock_gettime(CLOCK_MONOTONIC, &now) == 0);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* A bake under way ends with the flag or when its time is over, and gives no mesh. */
static void bakes_stop(void) {
    enum { SIDE = 600 };
    double *const vertices = malloc(3 * sizeof(double) * SIDE * SIDE);
    uint32_t *const faces = malloc(6 * sizeof(uint32_t) * (SIDE - 1) * (SIDE - 1));
    size_t face_count = 0;
    CHECK(vertices != NULL && faces != NULL);
    for (uint32_t k = 0; k < SIDE * SIDE; k++) {
        const uint32_t x = k % SIDE, y = k / SIDE;
        vertices[3 * k] = x;
        vertices[3 * k + 1] = y;
        vertices[3 * k + 2] = (x * x + y * y) % 7;
        if (x + 1 < SIDE && y + 1 < SIDE) {
            const uint32_t corners[6] = {k, k + 1, k + SIDE, k + 1, k + SIDE + 1, k + SIDE};
            memcpy(faces + 3 * face_count, corners, sizeof corners);
            face_count += 2;
        }
    }
    const cbvh_bake_options options = {.size = sizeof options, .stop = stop};
    const cbvh_bake_options wrong = {.size = sizeof wrong, .stop = {mesh.id}};
    const cbvh_bake_options quick = {.size = sizeof quick, .effort = "quick", .stop = stop};
    cbvh_mesh made = {7};
    pthread_t thread;
    FAILS(cbvh_bake(vertices, SIDE * SIDE, faces, face_count, &wrong, &made), CBVH_INVALID_HANDLE,
          "options.stop: expected the handle of an open stop, found the handle of a mesh");
    CHECK(pthread_create(&thread, NULL, set_soon, NULL) == 0);
    FAILS(cbvh_bake(vertices, SIDE * SIDE, faces, face_count, &options, &made), CBVH_STOPPED, "found it stopped");
    CHECK(made.id == 0);
    CHECK(pthread_join(thread, NULL) == 0);
    FAILS(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 12, &quick, &made), CBVH_STOPPED, "");
    OK(cbvh_stop_clear(stop));
    OK(cbvh_stop_set_after(stop, 0.02));
    FAILS(cbvh_bake(vertices, SIDE * SIDE, faces, face_count, &quick, &made), CBVH_STOPPED, "its time is over");
    OK(cbvh_stop_clear(stop));
    OK(cbvh_bake(vertices, SIDE * SIDE, faces, face_count, &quick, &made));
    OK(cbvh_mesh_free(made));
    free(vertices);
    free(faces);
}

static void stops(void) {
    /* Triangles that all contain a point, each beside the others: all pairs touch. */
    enum { TRIANGLES = 4096, INSTANCES = 3 };
    static double vertices[9 * TRIANGLES];
    static uint32_t faces[3 * TRIANGLES];
    const cbvh_stop no_stop = {0};
    const cbvh_robot no_robot = {0};
    const cbvh_pose here = CBVH_IDENTITY;
    cbvh_mesh fan;
    cbvh_scene many;
    cbvh_querier querier;
    cbvh_tracker tracker;
    pthread_t thread;
    bool answer;
    size_t count;
    for (uint32_t k = 0; k < TRIANGLES; k++) {
        const double corners[9] = {0, 0, 0, 1, 0, 0, k, 1, 0};
        memcpy(vertices + 9 * k, corners, sizeof corners);
        for (uint32_t corner = 0; corner < 3; corner++) {
            faces[3 * k + corner] = 3 * k + corner;
        }
    }
    OK(cbvh_bake(vertices, 3 * (size_t)TRIANGLES, faces, TRIANGLES, NULL, &fan));
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));
    OK(cbvh_tracker_new(&tracker));
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &many));
    for (int k = 0; k < INSTANCES; k++) {
        OK(cbvh_scene_add(many, fan, &here, NULL, NULL));
    }
    OK(cbvh_stop_new(&stop));
    OK(cbvh_querier_set_stop(querier, stop));
    OK(cbvh_scene_set_stop(many, stop));
    FAILS(cbvh_robot_set_stop(no_robot, stop), CBVH_INVALID_HANDLE, "robot: ");
    for (int32_t parallel = 0; parallel < 2; parallel++) {
        OK(cbvh_querier_set_parallel(querier, parallel));
        OK(cbvh_scene_set_parallel(many, parallel));
        /* One that is under way. */
        CHECK(pthread_create(&thread, NULL, set_soon, NULL) == 0);
        FAILS(cbvh_contacts(querier, fan, fan, &here, 1, NULL, NULL, 0, &count), CBVH_STOPPED, "found the query stopped");
        CHECK(pthread_join(thread, NULL) == 0);
        /* New ones, until the flag is cleared. */
        FAILS(cbvh_collide(querier, mesh, mesh, poses, 1, &answer), CBVH_STOPPED, "its flag is set");
        FAILS(cbvh_tracker_collide(tracker, querier, mesh, mesh, poses, 1, &answer), CBVH_STOPPED, "");
        FAILS(cbvh_scene_collide(many, &answer), CBVH_STOPPED, "");
        OK(cbvh_stop_clear(stop));
        CHECK(pthread_create(&thread, NULL, set_soon, NULL) == 0);
        FAILS(cbvh_scene_contacts(many, NULL, 0, &count), CBVH_STOPPED, "");
        CHECK(pthread_join(thread, NULL) == 0);
        OK(cbvh_stop_clear(stop));
        cbvh_distance_answer answers[POSES];
        OK(cbvh_distances(querier, mesh, mesh, poses, POSES, NULL, answers));
        CHECK(memcmp(answers, expected, sizeof expected) == 0);
    }
    CHECK(cbvh_contacts(querier, fan, fan, &here, 1, NULL, NULL, 0, &count) == CBVH_BUFFER_TOO_SMALL);
    CHECK(count == (size_t)TRIANGLES * TRIANGLES);
    /* After a time: a question under way on one core and on all, and new ones until the flag is cleared. */
    for (int32_t parallel = 0; parallel < 2; parallel++) {
        OK(cbvh_querier_set_parallel(querier, parallel));
        OK(cbvh_scene_set_parallel(many, parallel));
        const double began = seconds();
        OK(cbvh_stop_set_after(stop, 0.02));
        FAILS(cbvh_contacts(querier, fan, fan, &here, 1, NULL, NULL, 0, &count), CBVH_STOPPED, "its time is over");
        CHECK(seconds() - began >= 0.02);
        FAILS(cbvh_collide(querier, mesh, mesh, poses, 1, &answer), CBVH_STOPPED, "");
        FAILS(cbvh_scene_collide(many, &answer), CBVH_STOPPED, "");
        /* The last call counts, and what is refused changes nothing. */
        OK(cbvh_stop_set_after(stop, 1000));
        FAILS(cbvh_stop_set_after(stop, -1e-300), CBVH_INVALID_ARGUMENT, "seconds: expected at least 0, found -1e-300");
        FAILS(cbvh_stop_set_after(stop, NAN), CBVH_INVALID_ARGUMENT, "seconds: expected at least 0, found NaN");
        FAILS(cbvh_stop_set_after(stop, -INFINITY), CBVH_INVALID_ARGUMENT, "seconds: expected at least 0, found -inf");
        OK(cbvh_collide(querier, mesh, mesh, poses, 1, &answer));
        OK(cbvh_stop_set_after(stop, 0.02));
        FAILS(cbvh_scene_contacts(many, NULL, 0, &count), CBVH_STOPPED, "");
        OK(cbvh_stop_set_after(stop, INFINITY));
        OK(cbvh_scene_collide(many, &answer));
        OK(cbvh_stop_set_after(stop, 0));
        FAILS(cbvh_scene_collide(many, &answer), CBVH_STOPPED, "");
        OK(cbvh_stop_set_after(stop, 1e300));
        OK(cbvh_scene_collide(many, &answer));
        /* A flag that is set stays set. */
        OK(cbvh_stop_set(stop));
        OK(cbvh_stop_set_after(stop, 1000));
        FAILS(cbvh_scene_collide(many, &answer), CBVH_STOPPED, "");
        OK(cbvh_stop_set_after(stop, -0.0));
        OK(cbvh_stop_clear(stop));
        OK(cbvh_scene_collide(many, &answer));
        cbvh_distance_answer answers[POSES];
        OK(cbvh_stop_set_after(stop, 1000));
        OK(cbvh_distances(querier, mesh, mesh, poses, POSES, NULL, answers));
        CHECK(memcmp(answers, expected, sizeof expected) == 0);
    }
    OK(cbvh_stop_clear(stop));
    bakes_stop();
    /* Without a flag, or with one whose handle is gone. */
    OK(cbvh_stop_set(stop));
    OK(cbvh_scene_set_stop(many, no_stop));
    OK(cbvh_scene_collide(many, &answer));
    CHECK(answer);
    OK(cbvh_stop_free(stop));
    FAILS(cbvh_stop_clear(stop), CBVH_INVALID_HANDLE, "found one of a stop that was freed");
    FAILS(cbvh_collide(querier, mesh, mesh, poses, 1, &answer), CBVH_STOPPED, "");
    OK(cbvh_querier_set_stop(querier, no_stop));
    OK(cbvh_collide(querier, mesh, mesh, poses, 1, &answer));
    OK(cbvh_scene_free(many));
    OK(cbvh_tracker_free(tracker));
    OK(cbvh_querier_free(querier));
    OK(cbvh_mesh_free(fan));
}

int main(void) {
    /* More threads than cores, so that some wait for others. */
    CHECK(setenv("RAYON_NUM_THREADS", "8", 1) == 0);
    random_source source = {3};
    mesh = cube(1);
    cbvh_querier querier;
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));
    for (int k = 0; k < POSES; k++) {
        poses[k] = random_pose(&source, 1.5);
    }
    OK(cbvh_distances(querier, mesh, mesh, poses, POSES, NULL, expected));
    cbvh_distance_answer answers[POSES];
    OK(cbvh_querier_set_parallel(querier, 1));
    OK(cbvh_distances(querier, mesh, mesh, poses, POSES, NULL, answers));
    CHECK(memcmp(answers, expected, sizeof expected) == 0);

    pthread_t threads[THREADS];
    for (int k = 0; k < THREADS; k++) {
        CHECK(pthread_create(&threads[k], NULL, ask, NULL) == 0);
    }
    for (int k = 0; k < THREADS; k++) {
        CHECK(pthread_join(threads[k], NULL) == 0);
    }

    callbacks_that_ask();
    lookers();
    swaps();
    stops();

    CHECK(pthread_barrier_init(&barrier, NULL, 2) == 0);
    OK(cbvh_path_from_functions(waiting_pose, no_sagitta, NULL, NULL, &path));
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &shared));
    OK(cbvh_mesh_clone(mesh, &temporary));
    CHECK(pthread_create(&threads[0], NULL, hold, NULL) == 0);
    pthread_barrier_wait(&barrier);
    bool answer;
    FAILS(cbvh_collide(shared, mesh, mesh, poses, 1, &answer), CBVH_BUSY,
          "querier: expected a querier that nobody uses, found it in use");
    FAILS(cbvh_querier_free(shared), CBVH_BUSY, "querier: ");
    FAILS(cbvh_querier_set_budget(shared, 1), CBVH_BUSY, "querier: ");
    /* The question goes on with what is freed meanwhile. */
    OK(cbvh_mesh_free(temporary));
    OK(cbvh_path_free(path));
    pthread_barrier_wait(&barrier);
    CHECK(pthread_join(threads[0], NULL) == 0);
    OK(cbvh_collide(shared, mesh, mesh, poses, 1, &answer));
    OK(cbvh_querier_free(shared));

    calls = 0;
    cbvh_instance instances[2];
    const cbvh_pose here = CBVH_IDENTITY, there = shift(3, 0, 0);
    OK(cbvh_path_from_functions(waiting_pose, no_sagitta, NULL, NULL, &path));
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
    OK(cbvh_scene_add(scene, mesh, &here, NULL, &instances[0]));
    OK(cbvh_scene_add(scene, mesh, &there, NULL, &instances[1]));
    CHECK(pthread_create(&threads[0], NULL, hold_scene, &instances[1]) == 0);
    pthread_barrier_wait(&barrier);
    /* Others ask and change the scene meanwhile, and free it: the question is about the scene as it was. */
    OK(cbvh_scene_collide(scene, &answer));
    CHECK(!answer);
    const cbvh_pose in_the_way = shift(3.5, 0, 0);
    OK(cbvh_scene_set_poses(scene, &instances[0], &in_the_way, 1));
    OK(cbvh_scene_collide(scene, &answer));
    CHECK(answer);
    OK(cbvh_scene_remove(scene, instances[1]));
    OK(cbvh_scene_free(scene));
    pthread_barrier_wait(&barrier);
    CHECK(pthread_join(threads[0], NULL) == 0);
    FAILS(cbvh_scene_collide(scene, &answer), CBVH_INVALID_HANDLE, "scene: ");
    OK(cbvh_path_free(path));
    OK(cbvh_querier_free(querier));
    OK(cbvh_mesh_free(mesh));
    puts("threads: the same bits, and no querier for two");
    return 0;
}
