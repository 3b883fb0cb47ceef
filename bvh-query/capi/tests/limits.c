/* Little memory and little stack: not under sanitizers, which take more of both.
 *
 *     limits TESTDATA
 */
#include "support.h"
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

/* What the header asks for. */
#define STACK_BYTES (128 * 1024)
/* Triangles around an edge that they share: each touches each. */
#define FAN 2000

static cbvh_mesh fan(void) {
    static double vertices[3 * (FAN + 2)];
    static uint32_t faces[3 * FAN];
    vertices[5] = 1;
    for (uint32_t k = 0; k < FAN; k++) {
        vertices[3 * k + 6] = cos(0.001 * k);
        vertices[3 * k + 7] = sin(0.001 * k);
        faces[3 * k + 1] = 1;
        faces[3 * k + 2] = k + 2;
    }
    cbvh_mesh mesh;
    OK(cbvh_bake(vertices, FAN + 2, faces, FAN, NULL, &mesh));
    return mesh;
}

static char urdf[1000];

/* What the process has already, its threads included. */
static rlim_t address_space(void) {
    unsigned long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    CHECK(file != NULL && fscanf(file, "%lu", &pages) == 1);
    CHECK(fclose(file) == 0);
    return (rlim_t)pages * (rlim_t)sysconf(_SC_PAGESIZE);
}

static void memory(void) {
    cbvh_querier querier;
    const cbvh_pose here = CBVH_IDENTITY;
    const cbvh_mesh mesh = fan();
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));
    bool answer;
    OK(cbvh_collide(querier, mesh, mesh, &here, 1, &answer));
    /* All contacts take 64 MB. */
    struct rlimit limit;
    CHECK(getrlimit(RLIMIT_AS, &limit) == 0);
    const struct rlimit before = limit;
    limit.rlim_cur = address_space() + ((rlim_t)40 << 20);
    CHECK(setrlimit(RLIMIT_AS, &limit) == 0);
    static cbvh_contact some[100];
    size_t count = 0;
    FAILS(cbvh_contacts(querier, mesh, mesh, &here, 1, NULL, NULL, 0, &count), CBVH_BUFFER_TOO_SMALL, "contacts: ");
    CHECK(count == (size_t)FAN * FAN);
    FAILS(cbvh_contacts(querier, mesh, mesh, &here, 1, NULL, some, 100, &count), CBVH_BUFFER_TOO_SMALL, "contacts: ");
    CHECK(count == (size_t)FAN * FAN && some[0].triangle_a == 0);
    for (uint32_t k = 0; k < 100; k++) {
        CHECK(some[k].triangle_a == 0 && some[k].triangle_b == k);
    }
    /* Arrays that are said to be there; nothing of them is read before there is memory for a copy. */
    const size_t many = (size_t)1 << 41;
    const double *numbers = here.rows;
    cbvh_mesh made;
    cbvh_motion_answer motion;
    FAILS(cbvh_collide(querier, mesh, mesh, &here, many, &answer), CBVH_LIMIT, "poses: expected 2");
    FAILS(cbvh_sides(querier, mesh, NULL, numbers, many, (cbvh_side *)(void *)some), CBVH_LIMIT, "points: expected ");
    FAILS(cbvh_any_hits(querier, mesh, NULL, (const cbvh_ray *)(const void *)numbers, many, &answer), CBVH_LIMIT,
          "rays: expected ");
    FAILS(cbvh_segment_hits(querier, mesh, NULL, (const cbvh_segment *)(const void *)numbers, many, &answer),
          CBVH_LIMIT, "segments: expected ");
    FAILS(cbvh_bake(numbers, many, NULL, 0, NULL, &made), CBVH_LIMIT, "vertices: expected ");
    FAILS(cbvh_bake_cloud(numbers, many, &made), CBVH_LIMIT, "points: expected ");
    FAILS(cbvh_bake_voxels((const int32_t *)(const void *)numbers, many, 1, &made), CBVH_LIMIT, "cells: expected ");
    FAILS(cbvh_bake_convex_hull(numbers, many, &made), CBVH_LIMIT, "points: expected ");
    FAILS(cbvh_bake_height_field(numbers, many, 2, numbers, &made), CBVH_LIMIT, "heights: expected ");
    cbvh_robot robot;
    OK(cbvh_robot_from_urdf(urdf, NULL, &robot));
    FAILS(cbvh_robot_collide(robot, numbers, 4, many / 4, &answer), CBVH_LIMIT, "joints: expected ");
    FAILS(cbvh_robot_edges_are_free(robot, numbers, numbers, 4, many / 4, NULL, &answer), CBVH_LIMIT, "starts: expected ");
    OK(cbvh_robot_free(robot));
    FAILS(cbvh_motions(querier, mesh, mesh, (const cbvh_path *)(const void *)numbers, many, NULL, &motion), CBVH_LIMIT,
          "paths: expected ");
    CHECK(setrlimit(RLIMIT_AS, &before) == 0);
    OK(cbvh_querier_free(querier));
    OK(cbvh_mesh_free(mesh));
}

/* All kinds of questions, on a thread with little stack. */
static void *ask(void *parallel) {
    const int32_t cores = *(const int32_t *)parallel;
    random_source source = {1};
    cbvh_querier querier;
    cbvh_tracker tracker;
    cbvh_scene scene;
    cbvh_instance instance;
    cbvh_path path;
    const cbvh_mesh mesh = cube(1), other = fan(), pair = two_cubes();
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));
    OK(cbvh_querier_set_parallel(querier, cores));
    OK(cbvh_tracker_new(&tracker));
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
    OK(cbvh_scene_set_parallel(scene, cores));
    const cbvh_pose start = shift(-4, 0.25, 0), end = shift(4, 0.5, 0);
    OK(cbvh_path_between(&start, &end, &path));
    OK(cbvh_scene_add(scene, mesh, &start, NULL, NULL));
    OK(cbvh_scene_add(scene, other, &end, NULL, &instance));
    for (int round = 0; round < 20; round++) {
        cbvh_pose poses[4];
        bool answer[4];
        cbvh_distance_answer distance[4];
        cbvh_relation relation[4];
        cbvh_motion_answer motion;
        cbvh_closest_point closest;
        cbvh_ray_hit hit;
        cbvh_scene_distance_answer nearest;
        cbvh_scene_signed_distance_answer least;
        size_t count;
        for (int k = 0; k < 4; k++) {
            poses[k] = random_pose(&source, 1.5);
        }
        OK(cbvh_collide(querier, mesh, other, poses, 4, answer));
        OK(cbvh_distances(querier, mesh, other, poses, 4, NULL, distance));
        OK(cbvh_tracker_distance(tracker, querier, mesh, other, poses, 4, distance));
        OK(cbvh_relations(querier, mesh, other, poses, 4, relation));
        (void)cbvh_contacts(querier, mesh, other, poses, 4, NULL, NULL, 0, &count);
        OK(cbvh_motions(querier, other, mesh, &path, 1, NULL, &motion));
        OK(cbvh_signed_point_distances(querier, mesh, NULL, poses[0].rows, 1, INFINITY, &closest));
        const cbvh_ray ray = {{0, 0, 5}, {0.01, 0.02, -1}, INFINITY};
        OK(cbvh_first_hits(querier, other, NULL, &ray, 1, &hit));
        OK(cbvh_scene_distance(scene, &nearest));
        OK(cbvh_scene_signed_distance(scene, NULL, &least));
        (void)cbvh_scene_near_pairs(scene, 1, NULL, NULL, 0, &count);
        OK(cbvh_scene_motion(scene, &instance, &path, 1, NULL, &motion));
        OK(cbvh_scene_is_free(scene, &instance, &path, 1, NULL, answer));
    }
    const cbvh_pose near = shift(0.75, 0.125, 0.0625);
    const double x_axis[3] = {1, 0, 0};
    cbvh_separation way;
    cbvh_penetration depth;
    cbvh_signed_distance number;
    cbvh_clash clash;
    cbvh_measured_clash measured;
    cbvh_intersection shared;
    size_t count;
    OK(cbvh_separations(querier, mesh, mesh, &near, x_axis, 1, &way));
    OK(cbvh_penetrations(querier, mesh, mesh, &near, 1, NULL, &depth));
    OK(cbvh_penetrations(querier, mesh, pair, &near, 1, NULL, &depth));
    OK(cbvh_signed_distances(querier, mesh, mesh, &near, 1, NULL, &number));
    OK(cbvh_signed_distances(querier, mesh, pair, &near, 1, NULL, &number));
    OK(cbvh_signed_distances(querier, mesh, other, &near, 1, NULL, &number));
    OK(cbvh_clashes(querier, mesh, mesh, &near, 1, NULL, &clash));
    OK(cbvh_measured_clashes(querier, mesh, pair, &near, 1, NULL, &measured));
    OK(cbvh_intersections(querier, mesh, pair, &near, 1, &shared));
    (void)cbvh_patches(querier, mesh, other, &near, 1, NULL, NULL, NULL, 0, &count, NULL, 0, NULL);
    (void)cbvh_self_contacts(querier, other, NULL, 0, &count);
    cbvh_mesh cylinder, solid, padded;
    bool touching;
    cbvh_distance_answer apart;
    OK(cbvh_bake_cylinder(0.5, 1, 0.001, NULL, &cylinder));
    OK(cbvh_mesh_solid(cylinder, &solid));
    OK(cbvh_mesh_rounded(solid, 0.25, &padded));
    OK(cbvh_collide(querier, padded, other, &start, 1, &touching));
    OK(cbvh_distances(querier, padded, other, &start, 1, NULL, &apart));
    cbvh_robot robot;
    cbvh_robot_distance_answer near_robot[2];
    cbvh_robot_signed_distance_answer deep_robot[2];
    cbvh_robot_motion_answer motion_of_robot;
    const double zeros[8] = {0}, ends[4] = {3, 2, 2.5, 1};
    OK(cbvh_robot_from_urdf(urdf, NULL, &robot));
    OK(cbvh_robot_set_parallel(robot, cores));
    OK(cbvh_robot_add_obstacle(robot, "obstacle", other, &near, NULL));
    OK(cbvh_robot_distances(robot, zeros, 4, 2, near_robot));
    OK(cbvh_robot_signed_distances(robot, zeros, 4, 2, NULL, deep_robot));
    (void)cbvh_robot_near_pairs(robot, zeros, 4, 2, 1, NULL, NULL, NULL, NULL, 0, &count);
    OK(cbvh_robot_edge_motions(robot, zeros, ends, 4, 1, NULL, &motion_of_robot));
    OK(cbvh_robot_free(robot));
    OK(cbvh_mesh_free(cylinder));
    OK(cbvh_mesh_free(solid));
    OK(cbvh_mesh_free(padded));
    OK(cbvh_path_free(path));
    OK(cbvh_scene_free(scene));
    OK(cbvh_tracker_free(tracker));
    OK(cbvh_querier_free(querier));
    OK(cbvh_mesh_free(mesh));
    OK(cbvh_mesh_free(other));
    OK(cbvh_mesh_free(pair));
    return NULL;
}

int main(int count, char **arguments) {
    CHECK(count == 2);
    snprintf(urdf, sizeof urdf, "%s/robot/robot.urdf", arguments[1]);
    memory();
    pthread_attr_t attributes;
    CHECK(pthread_attr_init(&attributes) == 0);
    CHECK(pthread_attr_setstacksize(&attributes, STACK_BYTES) == 0);
    for (int32_t parallel = 0; parallel < 2; parallel++) {
        pthread_t thread;
        CHECK(pthread_create(&thread, &attributes, ask, &parallel) == 0);
        CHECK(pthread_join(thread, NULL) == 0);
    }
    puts("limits: a status where memory runs out, and 128 KiB of stack suffice");
    return 0;
}
