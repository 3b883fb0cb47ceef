/* Every bad argument by itself: the status that it gives, and a message that names it. */
#include "support.h"

static cbvh_mesh mesh;
static cbvh_querier querier;
static cbvh_tracker tracker;
static cbvh_path path;
static cbvh_scene scene;
static cbvh_instance instance;
static cbvh_pose pose = CBVH_IDENTITY;
/* An address that numbers cannot have, in memory that is there. */
static double room[64];
#define MISALIGNED(type) ((type *)(void *)((char *)room + 1))

static void handles(void) {
    const cbvh_mesh no_mesh = {0}, made_up = {0x123456789ABCDEF0u}, a_path = {path.id},
        beyond = {mesh.id + (1ull << 40)};
    bool answer;
    FAILS(cbvh_collide(querier, no_mesh, mesh, &pose, 1, &answer), CBVH_INVALID_HANDLE,
          "a: expected the handle of an open mesh, found 0");
    FAILS(cbvh_collide(querier, mesh, made_up, &pose, 1, &answer), CBVH_INVALID_HANDLE,
          "b: expected the handle of an open mesh, found 0x123456789abcdef0");
    FAILS(cbvh_collide(querier, mesh, a_path, &pose, 1, &answer), CBVH_INVALID_HANDLE, "found the handle of a path");
    FAILS(cbvh_collide(querier, mesh, beyond, &pose, 1, &answer), CBVH_INVALID_HANDLE, "never gave out");
    FAILS(cbvh_mesh_validate(no_mesh), CBVH_INVALID_HANDLE, "mesh: ");
    cbvh_mesh freed;
    OK(cbvh_mesh_clone(mesh, &freed));
    OK(cbvh_collide(querier, freed, mesh, &pose, 1, &answer));
    OK(cbvh_mesh_free(freed));
    /* Also where the querier has the mesh at hand. */
    FAILS(cbvh_collide(querier, freed, mesh, &pose, 1, &answer), CBVH_INVALID_HANDLE,
          "a: expected the handle of an open mesh, found one of a mesh that was freed");
    FAILS(cbvh_mesh_free(freed), CBVH_INVALID_HANDLE, "freed");
    cbvh_mesh next;
    OK(cbvh_mesh_clone(mesh, &next));
    FAILS(cbvh_collide(querier, freed, mesh, &pose, 1, &answer), CBVH_INVALID_HANDLE, "freed");
    OK(cbvh_mesh_free(next));
    OK(cbvh_mesh_free(no_mesh));
    const cbvh_querier no_querier = {0};
    FAILS(cbvh_collide(no_querier, mesh, mesh, &pose, 1, &answer), CBVH_INVALID_HANDLE, "querier: ");
    FAILS(cbvh_querier_set_parallel(no_querier, 1), CBVH_INVALID_HANDLE, "querier: ");
    OK(cbvh_querier_free(no_querier));
    cbvh_querier gone;
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &gone));
    OK(cbvh_querier_free(gone));
    FAILS(cbvh_querier_free(gone), CBVH_INVALID_HANDLE,
          "querier: expected the handle of an open querier, found one of a querier that was freed");
    const cbvh_tracker no_tracker = {0};
    FAILS(cbvh_tracker_collide(no_tracker, querier, mesh, mesh, &pose, 1, &answer), CBVH_INVALID_HANDLE, "tracker: ");
    const cbvh_path no_path = {0};
    FAILS(cbvh_are_free(querier, mesh, mesh, &no_path, 1, NULL, &answer), CBVH_INVALID_HANDLE, "paths[0]: ");
    FAILS(cbvh_path_pose(no_path, 0, &pose), CBVH_INVALID_HANDLE, "path: ");
    const cbvh_stop no_stop = {0}, a_querier = {querier.id};
    FAILS(cbvh_stop_set(no_stop), CBVH_INVALID_HANDLE, "stop: expected the handle of an open stop, found 0");
    FAILS(cbvh_stop_clear(no_stop), CBVH_INVALID_HANDLE, "stop: ");
    FAILS(cbvh_stop_set_after(a_querier, 1), CBVH_INVALID_HANDLE, "found the handle of a querier");
    FAILS(cbvh_querier_set_stop(querier, a_querier), CBVH_INVALID_HANDLE, "stop: expected the handle of an open stop");
    FAILS(cbvh_scene_set_stop(scene, a_querier), CBVH_INVALID_HANDLE, "found the handle of a querier");
    FAILS(cbvh_stop_new(NULL), CBVH_INVALID_ARGUMENT, "stop: ");
    OK(cbvh_stop_free(no_stop));
    const cbvh_scene no_scene = {0};
    FAILS(cbvh_scene_collide(no_scene, &answer), CBVH_INVALID_HANDLE, "scene: ");
    FAILS(cbvh_scene_add(scene, no_mesh, &pose, NULL, NULL), CBVH_INVALID_HANDLE, "mesh: ");
    /* What should have been made is 0 then. */
#define MAKES_NONE(type, call, name)                                                                                   \
    do {                                                                                                               \
        type out = {7};                                                                                                \
        FAILS(call, CBVH_INVALID_HANDLE, name ": expected the handle");                                                \
        CHECK(out.id == 0);                                                                                            \
    } while (0)
    MAKES_NONE(cbvh_mesh, cbvh_mesh_clone(no_mesh, &out), "mesh");
    MAKES_NONE(cbvh_mesh, cbvh_mesh_object(no_mesh, 0, &out), "mesh");
    MAKES_NONE(cbvh_mesh, cbvh_mesh_rounded(no_mesh, 1, &out), "mesh");
    MAKES_NONE(cbvh_mesh, cbvh_mesh_solid(no_mesh, &out), "mesh");
    MAKES_NONE(cbvh_mesh, cbvh_scene_instance_mesh(no_scene, instance, &out), "scene");
    MAKES_NONE(cbvh_scene, cbvh_scene_clone(no_scene, &out), "scene");
    MAKES_NONE(cbvh_scene, cbvh_scene_of_mesh(no_mesh, &out), "mesh");
    MAKES_NONE(cbvh_instance, cbvh_scene_add(no_scene, mesh, &pose, NULL, &out), "scene");
    MAKES_NONE(cbvh_instance, cbvh_scene_add(scene, no_mesh, &pose, NULL, &out), "mesh");
}

static void pointers(void) {
    bool answer;
    size_t count;
    cbvh_mesh made = {7};
    FAILS(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 12, NULL, NULL), CBVH_INVALID_ARGUMENT,
          "mesh: expected a pointer, found NULL");
    FAILS(cbvh_bake(NULL, 8, CUBE_FACES, 12, NULL, &made), CBVH_INVALID_ARGUMENT,
          "vertices: expected a pointer, found NULL");
    CHECK(made.id == 0);
    FAILS(cbvh_bake(CUBE_VERTICES, 8, NULL, 12, NULL, &made), CBVH_INVALID_ARGUMENT,
          "faces: expected a pointer, found NULL");
    FAILS(cbvh_bake(MISALIGNED(double), 1, CUBE_FACES, 12, NULL, &made), CBVH_INVALID_ARGUMENT,
          "vertices: expected an address that is a multiple of 8");
    FAILS(cbvh_bake(CUBE_VERTICES, SIZE_MAX / 8, CUBE_FACES, 12, NULL, &made), CBVH_INVALID_ARGUMENT,
          "vertices: expected at most");
    FAILS(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, SIZE_MAX, NULL, &made), CBVH_INVALID_ARGUMENT,
          "faces: expected at most");
    FAILS(cbvh_collide(querier, mesh, mesh, NULL, 1, &answer), CBVH_INVALID_ARGUMENT,
          "poses: expected a pointer, found NULL");
    FAILS(cbvh_collide(querier, mesh, mesh, MISALIGNED(cbvh_pose), 1, &answer), CBVH_INVALID_ARGUMENT,
          "poses: expected an address");
    FAILS(cbvh_collide(querier, mesh, mesh, &pose, SIZE_MAX / 96 + 1, &answer), CBVH_INVALID_ARGUMENT,
          "poses: expected at most");
    FAILS(cbvh_collide(querier, mesh, mesh, &pose, 1, NULL), CBVH_INVALID_ARGUMENT,
          "answers: expected a pointer, found NULL");
    FAILS(cbvh_distances(querier, mesh, mesh, &pose, 1, NULL, MISALIGNED(cbvh_distance_answer)), CBVH_INVALID_ARGUMENT,
          "answers: expected an address");
    FAILS(cbvh_contacts(querier, mesh, mesh, &pose, 1, NULL, NULL, 4, &count), CBVH_INVALID_ARGUMENT,
          "contacts: expected a pointer, found NULL");
    FAILS(cbvh_contacts(querier, mesh, mesh, &pose, 1, NULL, NULL, 0, NULL), CBVH_INVALID_ARGUMENT,
          "count: expected a pointer, found NULL");
    FAILS(cbvh_contacts(querier, mesh, mesh, &pose, 1, MISALIGNED(size_t), NULL, 0, &count), CBVH_INVALID_ARGUMENT,
          "counts: expected an address");
    FAILS(cbvh_first_collision(querier, mesh, mesh, &pose, 1, NULL), CBVH_INVALID_ARGUMENT, "number: ");
    FAILS(cbvh_closest_points(querier, mesh, NULL, NULL, 1, INFINITY, NULL), CBVH_INVALID_ARGUMENT,
          "points: expected a pointer");
    FAILS(cbvh_first_hits(querier, mesh, NULL, NULL, 1, NULL), CBVH_INVALID_ARGUMENT, "rays: expected a pointer");
    FAILS(cbvh_segment_hits(querier, mesh, NULL, NULL, 1, NULL), CBVH_INVALID_ARGUMENT,
          "segments: expected a pointer");
    FAILS(cbvh_edges_are_free(querier, mesh, mesh, NULL, &pose, 1, NULL, &answer), CBVH_INVALID_ARGUMENT, "starts: ");
    FAILS(cbvh_edges_are_free(querier, mesh, mesh, &pose, NULL, 1, NULL, &answer), CBVH_INVALID_ARGUMENT, "ends: ");
    FAILS(cbvh_motions(querier, mesh, mesh, NULL, 1, NULL, NULL), CBVH_INVALID_ARGUMENT, "paths: ");
    FAILS(cbvh_motions(querier, mesh, mesh, &path, 1, NULL, NULL), CBVH_INVALID_ARGUMENT, "answers: ");
    FAILS(cbvh_querier_new(CBVH_BACKEND_BEST, NULL), CBVH_INVALID_ARGUMENT, "querier: ");
    FAILS(cbvh_querier_stats(querier, NULL), CBVH_INVALID_ARGUMENT, "stats: ");
    FAILS(cbvh_tracker_new(NULL), CBVH_INVALID_ARGUMENT, "tracker: ");
    FAILS(cbvh_scene_new(CBVH_BACKEND_BEST, NULL), CBVH_INVALID_ARGUMENT, "scene: ");
    FAILS(cbvh_path_between(&pose, NULL, NULL), CBVH_INVALID_ARGUMENT, "path: ");
    cbvh_path made_path;
    FAILS(cbvh_path_between(NULL, &pose, &made_path), CBVH_INVALID_ARGUMENT, "start: ");
    FAILS(cbvh_path_between(&pose, NULL, &made_path), CBVH_INVALID_ARGUMENT, "end: ");
    FAILS(cbvh_path_screw(&pose, NULL, room, 1, 1, &made_path), CBVH_INVALID_ARGUMENT, "point: ");
    FAILS(cbvh_path_from_functions(NULL, NULL, NULL, NULL, &made_path), CBVH_INVALID_ARGUMENT,
          "pose: expected a function, found NULL");
    FAILS(cbvh_callback_message(NULL), CBVH_INVALID_ARGUMENT, "message: expected a pointer, found NULL");
    FAILS(cbvh_pose_check(NULL), CBVH_INVALID_ARGUMENT, "pose: ");
    FAILS(cbvh_pose_inverse(&pose, NULL), CBVH_INVALID_ARGUMENT, "result: ");
    FAILS(cbvh_pose_from_quaternion(NULL, room, &pose), CBVH_INVALID_ARGUMENT, "quaternion: ");
    FAILS(cbvh_mesh_open(NULL, CBVH_MAP, &made), CBVH_INVALID_ARGUMENT, "path: expected a pointer, found NULL");
    FAILS(cbvh_mesh_from_bytes(NULL, 1, &made), CBVH_INVALID_ARGUMENT, "bytes: ");
    FAILS(cbvh_mesh_find(mesh, NULL, &count), CBVH_INVALID_ARGUMENT, "name: ");
    FAILS(cbvh_mesh_object_count(mesh, NULL), CBVH_INVALID_ARGUMENT, "count: ");
    FAILS(cbvh_mesh_save(mesh, NULL), CBVH_INVALID_ARGUMENT, "path: ");
    FAILS(cbvh_bake_files(NULL, 1, "x", NULL, NULL), CBVH_INVALID_ARGUMENT, "inputs: expected a pointer");
    const char *none = NULL;
    FAILS(cbvh_bake_files(&none, 1, "x", NULL, NULL), CBVH_INVALID_ARGUMENT, "inputs[0]: expected a pointer");
    FAILS(cbvh_bake_files(&none, 0, "x", NULL, NULL), CBVH_INVALID_ARGUMENT, "inputs: expected at least one path");
    FAILS(cbvh_scene_collide(scene, NULL), CBVH_INVALID_ARGUMENT, "answer: ");
    FAILS(cbvh_scene_set_poses(scene, NULL, &pose, 1), CBVH_INVALID_ARGUMENT, "instances: ");
    FAILS(cbvh_scene_set_poses(scene, &instance, NULL, 1), CBVH_INVALID_ARGUMENT, "worlds: ");
    FAILS(cbvh_scene_find(scene, NULL, &instance), CBVH_INVALID_ARGUMENT, "name: ");
    FAILS(cbvh_abi(NULL), CBVH_INVALID_ARGUMENT, "abi: ");
    /* No elements may be anywhere. */
    OK(cbvh_collide(querier, mesh, mesh, NULL, 0, NULL));
    OK(cbvh_closest_points(querier, mesh, NULL, MISALIGNED(double), 0, 1, NULL));
    OK(cbvh_contacts(querier, mesh, mesh, NULL, 0, NULL, NULL, 0, &count));
    CHECK(count == 0);
}

static void numbers(void) {
    bool answers[2];
    cbvh_pose poses[2] = {CBVH_IDENTITY, CBVH_IDENTITY};
    cbvh_distance_answer distance;
    cbvh_closest_point closest;
    const struct { int entry; double value; const char *text; } bad[] = {
        {3, NAN, "poses[1]: row 1, column 4: expected a finite number, found NaN"},
        {0, -INFINITY, "poses[1]: row 1, column 1: expected a finite number, found infinity"},
        {0, 2, "poses[1]: expected a rotation, found a matrix"},
        {0, -1, "poses[1]: expected a rotation, found a reflection"},
        {11, 1e300, "poses[1]: expected a translation of at most 2^120"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        poses[1] = poses[0];
        poses[1].rows[bad[k].entry] = bad[k].value;
        FAILS(cbvh_collide(querier, mesh, mesh, poses, 2, answers), CBVH_INVALID_ARGUMENT, bad[k].text);
    }
    poses[1] = poses[0];
    const double ds[] = {NAN, -1, INFINITY};
    for (int k = 0; k < 3; k++) {
        FAILS(cbvh_within(querier, mesh, mesh, poses, 2, ds[k], answers), CBVH_INVALID_ARGUMENT,
              "d: expected a finite distance of at least 0");
        FAILS(cbvh_scene_within(scene, ds[k], answers), CBVH_INVALID_ARGUMENT, "d: expected a finite distance");
    }
    FAILS(cbvh_closest_points(querier, mesh, NULL, room, 1, NAN, &closest), CBVH_INVALID_ARGUMENT, "within: ");
    const double point[3] = {0, NAN, 0};
    cbvh_side side;
    FAILS(cbvh_sides(querier, mesh, NULL, point, 1, &side), CBVH_INVALID_ARGUMENT, "NaN");
    cbvh_pose scaled = CBVH_IDENTITY;
    scaled.rows[0] = scaled.rows[5] = scaled.rows[10] = 25.4;
    FAILS(cbvh_sides(querier, mesh, &scaled, room, 1, &side), CBVH_INVALID_ARGUMENT,
          "pose: expected a rotation, found a matrix scaled by 25.4");
    cbvh_ray ray = {{0, 0, 0}, {0, 0, 0}, INFINITY};
    FAILS(cbvh_any_hits(querier, mesh, NULL, &ray, 1, answers), CBVH_INVALID_ARGUMENT, "direction");
    ray.direction[0] = 1;
    ray.until = -1;
    FAILS(cbvh_any_hits(querier, mesh, NULL, &ray, 1, answers), CBVH_INVALID_ARGUMENT, "until");
    cbvh_mesh opened;
    FAILS(cbvh_mesh_open("x", 4, &opened), CBVH_INVALID_ARGUMENT,
          "mode: expected a number of cbvh_open_mode, 0 to 3, found 4");
    FAILS(cbvh_querier_new(-1, &(cbvh_querier){0}), CBVH_INVALID_ARGUMENT,
          "backend: expected a number of cbvh_backend, 0 to 4, found -1");
    FAILS(cbvh_querier_set_parallel(querier, 2), CBVH_INVALID_ARGUMENT, "parallel: expected 0 or 1, found 2");
    FAILS(cbvh_scene_set_tracking(scene, -1), CBVH_INVALID_ARGUMENT, "tracking: expected 0 or 1, found -1");
    FAILS(cbvh_scene_set_allowed(scene, instance, instance, 3), CBVH_INVALID_ARGUMENT, "allowed: expected 0 or 1, found 3");
    cbvh_pose result;
    FAILS(cbvh_path_pose(path, 1.5, &result), CBVH_INVALID_ARGUMENT, "t: expected a time from 0 to 1, found 1.5");
    FAILS(cbvh_path_pose(path, NAN, &result), CBVH_INVALID_ARGUMENT, "t: expected a time from 0 to 1, found NaN");
    double bound;
    FAILS(cbvh_path_reach(mesh, path, 0.5, 0.25, &bound), CBVH_INVALID_ARGUMENT, "t1: expected a time from t0 to 1");
    const double quaternion[4] = {0, 3, 0, 4};
    FAILS(cbvh_pose_from_quaternion(quaternion, room, &result), CBVH_INVALID_ARGUMENT,
          "expected a quaternion of length 1, found length 5");
    cbvh_path made;
    FAILS(cbvh_path_polyline(poses, 1, &made), CBVH_INVALID_ARGUMENT, "poses: expected at least two poses, found 1");
    CHECK(made.id == 0);
    cbvh_pose half_turn = CBVH_IDENTITY;
    half_turn.rows[0] = half_turn.rows[5] = -1;
    FAILS(cbvh_path_between(&pose, &half_turn, &made), CBVH_INVALID_ARGUMENT,
          "start and end: expected a turn of less than half a circle");
    FAILS(cbvh_edges_are_free(querier, mesh, mesh, &pose, &half_turn, 1, NULL, answers), CBVH_INVALID_ARGUMENT,
          "starts[0] and ends[0]: expected a turn");
    const double x_axis[3] = {1, 0, 0};
    FAILS(cbvh_path_screw(&pose, room, room, 1, 1, &made), CBVH_INVALID_ARGUMENT, "direction: ");
    FAILS(cbvh_path_screw(&pose, room, x_axis, NAN, 1, &made), CBVH_INVALID_ARGUMENT, "angle: ");
    /* Options: sizes first. */
    cbvh_distance_options allowed = {.size = 0};
    const size_t sizes[] = {0, 1, 8, 15, sizeof allowed - 1, sizeof allowed + 1, 4104, SIZE_MAX - 7, SIZE_MAX};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        allowed.size = sizes[k];
        FAILS(cbvh_distances(querier, mesh, mesh, &pose, 1, &allowed, &distance), CBVH_INVALID_ARGUMENT,
              "options.size: expected 24");
    }
    /* Those of a newer header, whose fields are not known here. */
    struct {
        cbvh_distance_options known;
        double later[3];
    } newer = {.known = {.size = sizeof newer}};
    OK(cbvh_distances(querier, mesh, mesh, &pose, 1, &newer.known, &distance));
    newer.later[1] = 1;
    FAILS(cbvh_distances(querier, mesh, mesh, &pose, 1, &newer.known, &distance), CBVH_INVALID_ARGUMENT,
          "options: expected 0 in all bytes from 24 on, which only newer versions of the library know, found 240 in byte 38");
    /* Those of an older header, which ended earlier: what follows them is not read. */
    allowed = (cbvh_distance_options){.size = offsetof(cbvh_distance_options, abs_err), .abs_err = NAN};
    OK(cbvh_distances(querier, mesh, mesh, &pose, 1, &allowed, &distance));
    allowed = (cbvh_distance_options){.size = sizeof allowed, .rel_err = -1};
    FAILS(cbvh_distances(querier, mesh, mesh, &pose, 1, &allowed, &distance), CBVH_INVALID_ARGUMENT,
          "rel_err: expected a finite fraction");
    cbvh_motion_options motion = {.size = 1};
    FAILS(cbvh_are_free(querier, mesh, mesh, &path, 1, &motion, answers), CBVH_INVALID_ARGUMENT,
          "options.size: expected 24");
    motion = (cbvh_motion_options){.size = sizeof motion, .clearance = NAN};
    FAILS(cbvh_are_free(querier, mesh, mesh, &path, 1, &motion, answers), CBVH_INVALID_ARGUMENT, "clearance: ");
    motion = (cbvh_motion_options){.size = sizeof motion, .tolerance = -1};
    FAILS(cbvh_scene_is_free(scene, &instance, &path, 1, &motion, answers), CBVH_INVALID_ARGUMENT, "tolerance: ");
}

static void bakes(void) {
    cbvh_mesh made;
    const uint32_t faces[3] = {0, 1, 8};
    FAILS(cbvh_bake(CUBE_VERTICES, 8, faces, 1, NULL, &made), CBVH_BAKE_FAILED, "8");
    FAILS(cbvh_bake(CUBE_VERTICES, 8, faces, 0, NULL, &made), CBVH_BAKE_FAILED, "triangle");
    const double vertices[9] = {0, 0, NAN, 1, 0, 0, 0, 1, 0};
    const uint32_t first[3] = {0, 1, 2};
    FAILS(cbvh_bake(vertices, 3, first, 1, NULL, &made), CBVH_BAKE_FAILED, "NaN");
#define OPTION(field, value, text)                                                                                     \
    do {                                                                                                               \
        const cbvh_bake_options wrong = {.size = sizeof wrong, .field = value};                                        \
        FAILS(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 12, &wrong, &made), CBVH_INVALID_ARGUMENT, text);                \
    } while (0)
    OPTION(profile, "dop7", "options.profile: expected NULL or one of dop14-u8");
    OPTION(triangles, "small", "options.triangles: expected NULL or one of f32, packed, quantized, found \"small\"");
    OPTION(effort, "low", "options.effort: expected NULL or one of quick, default");
    OPTION(effort, "\xFF", "options.effort: expected text in UTF-8");
    OPTION(round, "f16", "options.round: expected NULL or one of none, f32, found \"f16\"");
    OPTION(max_error, -1, "options.max_error: expected 0 or a finite length above 0");
    OPTION(radius, -1, "options.radius: expected a length from 0 to 2^118, found -1");
    OPTION(weld, -1, "options.weld: expected 0 or a finite length above 0, found -1");
    OPTION(weld, NAN, "options.weld: expected");
    OPTION(radius, NAN, "options.radius: expected");
    OPTION(radius, INFINITY, "options.radius: expected");
    OPTION(no_ids, 2, "options.no_ids: expected 0 or 1, found 2");
    OPTION(solid, -1, "options.solid: expected 0 or 1, found -1");
    OPTION(drop_nan, 2, "options.drop_nan: expected 0 or 1, found 2");
    OPTION(scene, 1, "options.scene: expected nothing");
    OPTION(max_memory, 1, "options.max_memory: expected nothing");
    FAILS(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 12, &(cbvh_bake_options){.size = 8}, &made), CBVH_INVALID_ARGUMENT,
          "options.size: expected 120");
    const char *missing = "/no such folder/x.obj";
    FAILS(cbvh_bake_files(&missing, 1, "/no such folder/x.cbvh", NULL, NULL), CBVH_SYSTEM, "x.obj");
    FAILS(cbvh_mesh_open("/no such folder/x.cbvh", CBVH_READ, &made), CBVH_SYSTEM, "x.cbvh");
    CHECK(made.id == 0);
    FAILS(cbvh_mesh_from_bytes("nothing of the kind", 19, &made), CBVH_DAMAGED, "bytes: ");
    FAILS(cbvh_mesh_from_bytes(NULL, 0, &made), CBVH_DAMAGED, "bytes: ");
    FAILS(cbvh_mesh_save(mesh, "/no such folder/x.cbvh"), CBVH_SYSTEM, "x.cbvh");
    FAILS(cbvh_mesh_object(mesh, 1, &made), CBVH_NOT_FOUND, "number: expected a number below 1, found 1");
    size_t number;
    FAILS(cbvh_mesh_find(mesh, "x", &number), CBVH_NOT_FOUND, "name: expected the name of an object, found \"x\"");
    FAILS(cbvh_mesh_object_name(mesh, 7, NULL, 0, &number), CBVH_NOT_FOUND,
          "number: expected a number below 1, found 7");
}

/* Radii, lengths, arrays and counts of shapes. */
static void shapes(void) {
    const cbvh_mesh no_mesh = {0};
    cbvh_mesh made = {7};
    double number;
    bool is_solid;
    const double wrong[] = {NAN, -1, INFINITY, -INFINITY, 0x1.0000000000001p118, -0x1p-1074};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        FAILS(cbvh_mesh_rounded(mesh, wrong[k], &made), CBVH_INVALID_ARGUMENT,
              "radius: expected a length from 0 to 2^118, found");
        CHECK(made.id == 0);
        FAILS(cbvh_scene_set_margin(scene, instance, wrong[k]), CBVH_INVALID_ARGUMENT,
              "margin: expected a length from 0 to 2^118, found");
        FAILS(cbvh_scene_set_pair_margin(scene, instance, instance, wrong[k]), CBVH_INVALID_ARGUMENT, "margin: ");
    }
    OK(cbvh_mesh_rounded(mesh, 0x1p118, &made));
    OK(cbvh_mesh_free(made));
    FAILS(cbvh_mesh_rounded(no_mesh, 1, &made), CBVH_INVALID_HANDLE, "mesh: ");
    CHECK(made.id == 0);
    FAILS(cbvh_mesh_solid(no_mesh, &made), CBVH_INVALID_HANDLE, "mesh: ");
    FAILS(cbvh_mesh_radius(no_mesh, &number), CBVH_INVALID_HANDLE, "mesh: ");
    FAILS(cbvh_mesh_is_solid(no_mesh, &is_solid), CBVH_INVALID_HANDLE, "mesh: ");
    FAILS(cbvh_mesh_rounded(mesh, 1, NULL), CBVH_INVALID_ARGUMENT, "rounded: expected a pointer, found NULL");
    FAILS(cbvh_mesh_solid(mesh, NULL), CBVH_INVALID_ARGUMENT, "solid: expected a pointer, found NULL");
    FAILS(cbvh_mesh_radius(mesh, NULL), CBVH_INVALID_ARGUMENT, "radius: expected a pointer, found NULL");
    FAILS(cbvh_mesh_is_solid(mesh, NULL), CBVH_INVALID_ARGUMENT, "is_solid: expected a pointer, found NULL");
    const cbvh_bake_options bare = {.size = sizeof bare, .no_topology = 1};
    cbvh_mesh unknown;
    OK(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 12, &bare, &unknown));
    FAILS(cbvh_mesh_solid(unknown, &made), CBVH_INVALID_ARGUMENT, "does not say which objects are closed");
    OK(cbvh_mesh_free(unknown));
    const cbvh_instance none = {0};
    FAILS(cbvh_scene_set_margin(scene, none, 1), CBVH_NOT_FOUND, "instance");
    FAILS(cbvh_scene_set_pair_margin(scene, instance, none, 1), CBVH_NOT_FOUND, "instance");
    FAILS(cbvh_scene_instance_margin(scene, none, &number), CBVH_NOT_FOUND, "instance");
    FAILS(cbvh_scene_pair_margin(scene, none, instance, &number), CBVH_NOT_FOUND, "instance");
    cbvh_instance parent;
    FAILS(cbvh_scene_attach(scene, none, instance), CBVH_NOT_FOUND, "instance");
    FAILS(cbvh_scene_attach(scene, instance, none), CBVH_NOT_FOUND, "instance");
    FAILS(cbvh_scene_detach(scene, none), CBVH_NOT_FOUND, "instance");
    FAILS(cbvh_scene_parent(scene, none, &parent), CBVH_NOT_FOUND, "instance");
    FAILS(cbvh_scene_parent(scene, instance, NULL), CBVH_INVALID_ARGUMENT, "parent: expected a pointer, found NULL");
    FAILS(cbvh_scene_set_mesh(scene, none, mesh), CBVH_NOT_FOUND, "instance");
    FAILS(cbvh_scene_set_mesh(scene, instance, no_mesh), CBVH_INVALID_HANDLE, "mesh: ");
    FAILS(cbvh_scene_instance_margin(scene, instance, NULL), CBVH_INVALID_ARGUMENT, "margin: expected a pointer");
    FAILS(cbvh_scene_pair_margin(scene, instance, instance, NULL), CBVH_INVALID_ARGUMENT, "margin: expected a pointer");
    /* Points and cells: none, too many, not there, not finite. */
    const int32_t cells[3] = {0, 0, 0};
    const double points[6] = {0, 0, 0, 1, NAN, 0}, far[3] = {0, 0, INFINITY};
    FAILS(cbvh_bake_cloud(points, 0, &made), CBVH_BAKE_FAILED, "triangle");
    FAILS(cbvh_bake_cloud(NULL, 0, &made), CBVH_BAKE_FAILED, "triangle");
    FAILS(cbvh_bake_cloud(points, 2, &made), CBVH_BAKE_FAILED, "NaN");
    FAILS(cbvh_bake_cloud(NULL, 1, &made), CBVH_INVALID_ARGUMENT, "points: expected a pointer, found NULL");
    FAILS(cbvh_bake_cloud(MISALIGNED(double), 1, &made), CBVH_INVALID_ARGUMENT, "points: expected an address");
    FAILS(cbvh_bake_cloud(points, SIZE_MAX / 8, &made), CBVH_INVALID_ARGUMENT, "points: expected at most");
    FAILS(cbvh_bake_cloud(points, 1, NULL), CBVH_INVALID_ARGUMENT, "mesh: expected a pointer, found NULL");
    FAILS(cbvh_bake_segment(points, far, &made), CBVH_BAKE_FAILED, "inf");
    FAILS(cbvh_bake_segment(NULL, far, &made), CBVH_INVALID_ARGUMENT, "from: expected a pointer, found NULL");
    FAILS(cbvh_bake_segment(points, NULL, &made), CBVH_INVALID_ARGUMENT, "to: expected a pointer, found NULL");
    FAILS(cbvh_bake_voxels(cells, 0, 1, &made), CBVH_BAKE_FAILED, "triangle");
    FAILS(cbvh_bake_voxels(NULL, 1, 1, &made), CBVH_INVALID_ARGUMENT, "cells: expected a pointer, found NULL");
    FAILS(cbvh_bake_voxels(cells, SIZE_MAX, 1, &made), CBVH_INVALID_ARGUMENT, "cells: expected at most");
    const uint32_t sizes[2] = {3, 2};
    const double flat[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    FAILS(cbvh_bake_octree(cells, sizes, 1, 1, &made), CBVH_INVALID_ARGUMENT, "cells: expected as size a power of two");
    FAILS(cbvh_bake_octree(cells, NULL, 1, 1, &made), CBVH_INVALID_ARGUMENT, "sizes: expected a pointer, found NULL");
    FAILS(cbvh_bake_octree(NULL, sizes, 1, 1, &made), CBVH_INVALID_ARGUMENT, "cells: expected a pointer, found NULL");
    FAILS(cbvh_bake_octree(NULL, NULL, 0, 1, &made), CBVH_BAKE_FAILED, "triangle");
    FAILS(cbvh_bake_convex_hull(flat, 3, &made), CBVH_INVALID_ARGUMENT, "points: expected four or more");
    FAILS(cbvh_bake_convex_hull(NULL, 0, &made), CBVH_INVALID_ARGUMENT, "points: expected four or more");
    FAILS(cbvh_bake_convex_hull(points, 2, &made), CBVH_INVALID_ARGUMENT, "points: expected finite coordinates");
    FAILS(cbvh_bake_box(NULL, &made), CBVH_INVALID_ARGUMENT, "sides: expected a pointer, found NULL");
    FAILS(cbvh_bake_ground(NULL, 1, &made), CBVH_INVALID_ARGUMENT, "sides: expected a pointer, found NULL");
    FAILS(cbvh_bake_cylinder(1, 1, 0.1, MISALIGNED(double), &made), CBVH_INVALID_ARGUMENT,
          "error: expected an address");
    FAILS(cbvh_bake_cone(1, 1, 0.1, MISALIGNED(double), &made), CBVH_INVALID_ARGUMENT, "error: expected an address");
    /* Lengths. */
    const double lengths[] = {NAN, 0, -1, INFINITY};
    for (int k = 0; k < 4; k++) {
        const double l = lengths[k], sides[3] = {1, l, 1}, one[3] = {1, 1, 1};
        FAILS(cbvh_bake_box(sides, &made), CBVH_INVALID_ARGUMENT, "side: expected a finite length above 0, found");
        FAILS(cbvh_bake_ground(sides, 1, &made), CBVH_INVALID_ARGUMENT, "side: ");
        FAILS(cbvh_bake_ground(one, l, &made), CBVH_INVALID_ARGUMENT, "thickness: ");
        FAILS(cbvh_bake_cylinder(l, 1, 0.1, &number, &made), CBVH_INVALID_ARGUMENT, "radius: ");
        FAILS(cbvh_bake_cylinder(1, l, 0.1, &number, &made), CBVH_INVALID_ARGUMENT, "length: ");
        FAILS(cbvh_bake_cylinder(1, 1, l, &number, &made), CBVH_INVALID_ARGUMENT, "max_error: ");
        FAILS(cbvh_bake_cone(l, 1, 0.1, NULL, &made), CBVH_INVALID_ARGUMENT, "radius: ");
        FAILS(cbvh_bake_cone(1, l, 0.1, NULL, &made), CBVH_INVALID_ARGUMENT, "height: ");
        FAILS(cbvh_bake_voxels(cells, 1, l, &made), CBVH_INVALID_ARGUMENT, "side: ");
        FAILS(cbvh_bake_height_field(room, 2, 2, sides, &made), CBVH_INVALID_ARGUMENT,
              "cell: expected a finite length");
        CHECK(made.id == 0);
    }
    FAILS(cbvh_bake_cone(1, 1, 1e-12, NULL, &made), CBVH_INVALID_ARGUMENT, "max_error: expected an error for which");
    const double endless[2] = {1, INFINITY};
    FAILS(cbvh_bake_ground(endless, 1, &made), CBVH_INVALID_ARGUMENT, "a half-space cannot be baked; make a ground");
    const double box_beyond[3] = {1e300, 1, 1};
    FAILS(cbvh_bake_box(box_beyond, &made), CBVH_BAKE_FAILED, "2^120");
    /* Grids. */
    const double cell[2] = {1, 1};
    const size_t grids[][2] = {{0, 0}, {0, 2}, {2, 0}, {1, 2}, {2, 1}, {SIZE_MAX, 0}};
    for (size_t k = 0; k < sizeof grids / sizeof *grids; k++) {
        FAILS(cbvh_bake_height_field(room, grids[k][0], grids[k][1], cell, &made), CBVH_INVALID_ARGUMENT,
              "heights: expected two or more rows of two or more columns");
    }
    /* A product that wraps around to a small one is not small. */
    FAILS(cbvh_bake_height_field(room, SIZE_MAX / 2 + 2, 2, cell, &made), CBVH_INVALID_ARGUMENT,
          "heights: expected at most");
    FAILS(cbvh_bake_height_field(room, SIZE_MAX, SIZE_MAX, cell, &made), CBVH_INVALID_ARGUMENT,
          "heights: expected at most");
    FAILS(cbvh_bake_height_field(NULL, 2, 2, cell, &made), CBVH_INVALID_ARGUMENT,
          "heights: expected a pointer, found NULL");
    FAILS(cbvh_bake_height_field(room, 2, 2, NULL, &made), CBVH_INVALID_ARGUMENT,
          "cell: expected a pointer, found NULL");
}

/* Where and how deep meshes overlap. */
static void overlaps(void) {
    const cbvh_mesh no_mesh = {0};
    cbvh_pose poses[2] = {CBVH_IDENTITY, CBVH_IDENTITY};
    cbvh_separation ways[2];
    cbvh_penetration depths[2];
    cbvh_signed_distance numbers[2];
    cbvh_clash clashes[2];
    cbvh_measured_clash measured[2];
    cbvh_intersection shared[2];
    cbvh_contact_region regions[1];
    cbvh_patch patches[1];
    cbvh_self_contact contacts[1];
    size_t count, region_count;
    double directions[6] = {1, 0, 0, 0, 1, 0};
    FAILS(cbvh_separations(querier, no_mesh, mesh, poses, directions, 2, ways), CBVH_INVALID_HANDLE, "a: ");
    FAILS(cbvh_separations(querier, mesh, mesh, NULL, directions, 2, ways), CBVH_INVALID_ARGUMENT,
          "poses: expected a pointer, found NULL");
    FAILS(cbvh_separations(querier, mesh, mesh, poses, NULL, 2, ways), CBVH_INVALID_ARGUMENT,
          "directions: expected a pointer, found NULL");
    FAILS(cbvh_separations(querier, mesh, mesh, poses, MISALIGNED(double), 2, ways), CBVH_INVALID_ARGUMENT,
          "directions: expected an address");
    FAILS(cbvh_separations(querier, mesh, mesh, poses, directions, SIZE_MAX / 24 + 1, ways), CBVH_INVALID_ARGUMENT,
          "directions: expected at most");
    FAILS(cbvh_separations(querier, mesh, mesh, poses, directions, 2, NULL), CBVH_INVALID_ARGUMENT,
          "answers: expected a pointer, found NULL");
    const double bad[] = {NAN, INFINITY, 0, 0x1p-501, 0x1p501};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        directions[4] = bad[k];
        FAILS(cbvh_separations(querier, mesh, mesh, poses, directions, 2, ways), CBVH_INVALID_ARGUMENT,
              "directions[1]: direction: expected numbers");
    }
    FAILS(cbvh_penetrations(querier, mesh, no_mesh, poses, 2, NULL, depths), CBVH_INVALID_HANDLE, "b: ");
    FAILS(cbvh_penetrations(querier, mesh, mesh, NULL, 2, NULL, depths), CBVH_INVALID_ARGUMENT,
          "poses: expected a pointer, found NULL");
    FAILS(cbvh_penetrations(querier, mesh, mesh, poses, 2, NULL, NULL), CBVH_INVALID_ARGUMENT,
          "answers: expected a pointer, found NULL");
    FAILS(cbvh_signed_distances(querier, mesh, no_mesh, poses, 2, NULL, numbers), CBVH_INVALID_HANDLE, "b: ");
    FAILS(cbvh_signed_distances(querier, mesh, mesh, NULL, 2, NULL, numbers), CBVH_INVALID_ARGUMENT,
          "poses: expected a pointer, found NULL");
    FAILS(cbvh_signed_distances(querier, mesh, mesh, poses, 2, NULL, NULL), CBVH_INVALID_ARGUMENT,
          "answers: expected a pointer, found NULL");
    const double wrong[] = {NAN, -1, INFINITY, -0x1p-1074};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        const cbvh_penetration_options gap = {.size = sizeof gap, .relative_gap = wrong[k]},
            tolerance = {.size = sizeof tolerance, .tolerance = wrong[k]};
        const cbvh_patch_options apart = {.size = sizeof apart, .tolerance = wrong[k]};
        const cbvh_clash_options near = {.size = sizeof near, .clearance = wrong[k]},
            deep = {.size = sizeof deep, .tolerance = wrong[k]}, part = {.size = sizeof part, .relative_gap = wrong[k]};
        FAILS(cbvh_clashes(querier, mesh, mesh, poses, 2, &near, clashes), CBVH_INVALID_ARGUMENT, "clearance: ");
        FAILS(cbvh_clashes(querier, mesh, mesh, poses, 2, &deep, clashes), CBVH_INVALID_ARGUMENT, "tolerance: ");
        FAILS(cbvh_clashes(querier, mesh, mesh, poses, 2, &part, clashes), CBVH_INVALID_ARGUMENT, "relative_gap: ");
        FAILS(cbvh_penetrations(querier, mesh, mesh, poses, 2, &gap, depths), CBVH_INVALID_ARGUMENT, "relative_gap: ");
        FAILS(cbvh_penetrations(querier, mesh, mesh, poses, 2, &tolerance, depths), CBVH_INVALID_ARGUMENT,
              "tolerance: ");
        FAILS(cbvh_signed_distances(querier, mesh, mesh, poses, 2, &gap, numbers), CBVH_INVALID_ARGUMENT,
              "relative_gap: ");
        FAILS(cbvh_signed_distances(querier, mesh, mesh, poses, 2, &tolerance, numbers), CBVH_INVALID_ARGUMENT,
              "tolerance: ");
        FAILS(cbvh_patches(querier, mesh, mesh, poses, 2, &apart, NULL, patches, 1, &count, NULL, 0, NULL),
              CBVH_INVALID_ARGUMENT, "tolerance: ");
        FAILS(cbvh_contact_points(querier, mesh, mesh, poses, 2, &apart, NULL, NULL, 0, &count, NULL, 0, NULL),
              CBVH_INVALID_ARGUMENT, "tolerance: ");
    }
    const cbvh_penetration_options other = {.size = 8}, all = {.size = sizeof all};
    FAILS(cbvh_penetrations(querier, mesh, mesh, poses, 2, &other, depths), CBVH_INVALID_ARGUMENT,
          "options.size: expected 24");
    FAILS(cbvh_signed_distances(querier, mesh, mesh, poses, 2, &other, numbers), CBVH_INVALID_ARGUMENT,
          "options.size: expected 24");
    const cbvh_clash_options smaller = {.size = 20};
    FAILS(cbvh_clashes(querier, mesh, mesh, poses, 2, &smaller, clashes), CBVH_INVALID_ARGUMENT,
          "options.size: expected 40");
    const cbvh_clash_options older = {.size = offsetof(cbvh_clash_options, relative_gap), .relative_gap = NAN};
    OK(cbvh_clashes(querier, mesh, mesh, poses, 2, &older, clashes));
    FAILS(cbvh_clashes(querier, no_mesh, mesh, poses, 2, NULL, clashes), CBVH_INVALID_HANDLE, "a: ");
    FAILS(cbvh_clashes(querier, mesh, mesh, NULL, 2, NULL, clashes), CBVH_INVALID_ARGUMENT,
          "poses: expected a pointer, found NULL");
    FAILS(cbvh_clashes(querier, mesh, mesh, poses, 2, NULL, NULL), CBVH_INVALID_ARGUMENT,
          "answers: expected a pointer, found NULL");
    OK(cbvh_clashes(querier, mesh, mesh, NULL, 0, NULL, NULL));
    /* 0 stands for the defaults. */
    cbvh_penetration by_default;
    OK(cbvh_penetrations(querier, mesh, mesh, poses, 1, &all, depths));
    OK(cbvh_penetrations(querier, mesh, mesh, poses, 1, NULL, &by_default));
    CHECK(memcmp(depths, &by_default, sizeof by_default) == 0);
    OK(cbvh_signed_distances(querier, mesh, mesh, poses, 1, &all, &numbers[0]));
    OK(cbvh_signed_distances(querier, mesh, mesh, poses, 1, NULL, &numbers[1]));
    CHECK(memcmp(&numbers[0], &numbers[1], sizeof *numbers) == 0);
    FAILS(cbvh_intersections(querier, mesh, no_mesh, poses, 2, shared), CBVH_INVALID_HANDLE, "b: ");
    FAILS(cbvh_intersections(querier, mesh, mesh, NULL, 2, shared), CBVH_INVALID_ARGUMENT,
          "poses: expected a pointer, found NULL");
    FAILS(cbvh_intersections(querier, mesh, mesh, poses, 2, NULL), CBVH_INVALID_ARGUMENT,
          "answers: expected a pointer, found NULL");
    FAILS(cbvh_measured_clashes(querier, no_mesh, mesh, poses, 2, NULL, measured), CBVH_INVALID_HANDLE, "a: ");
    FAILS(cbvh_measured_clashes(querier, mesh, mesh, poses, 2, &smaller, measured), CBVH_INVALID_ARGUMENT,
          "options.size: ");
    FAILS(cbvh_measured_clashes(querier, mesh, mesh, poses, 2, NULL, NULL), CBVH_INVALID_ARGUMENT,
          "answers: expected a pointer, found NULL");
    /* One triangle has no inside, and nobody knows of a mesh that was baked without topology. */
    cbvh_mesh open, unknown;
    const cbvh_bake_options bare = {.size = sizeof bare, .no_topology = 1};
    OK(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 1, NULL, &open));
    OK(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 12, &bare, &unknown));
    directions[4] = 1;
    FAILS(cbvh_separations(querier, open, mesh, poses, directions, 2, ways), CBVH_INVALID_ARGUMENT, "closed objects");
    FAILS(cbvh_penetrations(querier, mesh, open, poses, 2, NULL, depths), CBVH_INVALID_ARGUMENT, "closed objects");
    FAILS(cbvh_separations(querier, mesh, unknown, poses, directions, 2, ways), CBVH_INVALID_ARGUMENT,
          "does not say which objects are closed");
    FAILS(cbvh_penetrations(querier, unknown, mesh, poses, 2, NULL, depths), CBVH_INVALID_ARGUMENT,
          "does not say which objects are closed");
    FAILS(cbvh_signed_distances(querier, unknown, mesh, poses, 2, NULL, numbers), CBVH_INVALID_ARGUMENT,
          "does not say which objects are closed");
    FAILS(cbvh_intersections(querier, open, mesh, poses, 2, shared), CBVH_INVALID_ARGUMENT, "closed objects");
    FAILS(cbvh_intersections(querier, mesh, unknown, poses, 2, shared), CBVH_INVALID_ARGUMENT,
          "does not say which objects are closed");
    OK(cbvh_measured_clashes(querier, mesh, open, poses, 2, NULL, measured));
    CHECK(measured[0].clash.kind == CBVH_CLASH_INTERSECTING && isnan(measured[0].shared.volume));
    OK(cbvh_mesh_free(open));
    OK(cbvh_mesh_free(unknown));
    FAILS(cbvh_contact_regions(querier, mesh, mesh, poses, 2, NULL, NULL, 1, &count), CBVH_INVALID_ARGUMENT,
          "regions: expected a pointer, found NULL");
    FAILS(cbvh_contact_regions(querier, mesh, mesh, poses, 2, NULL, regions, 1, NULL), CBVH_INVALID_ARGUMENT,
          "count: expected a pointer, found NULL");
    FAILS(cbvh_contact_regions(querier, mesh, mesh, poses, 2, MISALIGNED(size_t), regions, 1, &count),
          CBVH_INVALID_ARGUMENT, "counts: expected an address");
    FAILS(cbvh_patches(querier, mesh, mesh, poses, 2, NULL, NULL, NULL, 1, &count, regions, 1, &region_count),
          CBVH_INVALID_ARGUMENT, "patches: expected a pointer, found NULL");
    FAILS(cbvh_patches(querier, mesh, mesh, poses, 2, NULL, NULL, patches, 1, NULL, regions, 1, &region_count),
          CBVH_INVALID_ARGUMENT, "count: expected a pointer, found NULL");
    FAILS(cbvh_patches(querier, mesh, mesh, poses, 2, NULL, NULL, patches, 1, &count, NULL, 1, &region_count),
          CBVH_INVALID_ARGUMENT, "regions: expected a pointer, found NULL");
    FAILS(cbvh_patches(querier, mesh, mesh, poses, 2, NULL, MISALIGNED(cbvh_patch_counts), patches, 1, &count, NULL, 0,
              NULL), CBVH_INVALID_ARGUMENT, "counts: expected an address");
    cbvh_contact_point points[4];
    FAILS(cbvh_contact_points(querier, mesh, no_mesh, poses, 2, NULL, NULL, points, 4, &count, NULL, 0, NULL),
          CBVH_INVALID_HANDLE, "b: ");
    FAILS(cbvh_contact_points(querier, mesh, mesh, poses, 2, NULL, NULL, NULL, 1, &count, NULL, 0, NULL),
          CBVH_INVALID_ARGUMENT, "points: expected a pointer, found NULL");
    FAILS(cbvh_contact_points(querier, mesh, mesh, poses, 2, NULL, NULL, points, 4, NULL, NULL, 0, NULL),
          CBVH_INVALID_ARGUMENT, "count: expected a pointer, found NULL");
    FAILS(cbvh_contact_points(querier, mesh, mesh, poses, 2, NULL, NULL, points, 4, &count, NULL, 1, &region_count),
          CBVH_INVALID_ARGUMENT, "patches: expected a pointer, found NULL");
    cbvh_open_edge_counts counted;
    FAILS(cbvh_mesh_open_edge_counts(no_mesh, &counted), CBVH_INVALID_HANDLE, "mesh: ");
    FAILS(cbvh_mesh_open_edge_counts(mesh, NULL), CBVH_INVALID_ARGUMENT, "counts: expected a pointer, found NULL");
    FAILS(cbvh_mesh_open_edges(mesh, NULL, 1, &count), CBVH_INVALID_ARGUMENT, "edges: expected a pointer, found NULL");
    FAILS(cbvh_self_contacts(querier, no_mesh, contacts, 1, &count), CBVH_INVALID_HANDLE, "mesh: ");
    FAILS(cbvh_self_contacts(querier, mesh, NULL, 1, &count), CBVH_INVALID_ARGUMENT,
          "contacts: expected a pointer, found NULL");
    FAILS(cbvh_self_contacts(querier, mesh, contacts, 1, NULL), CBVH_INVALID_ARGUMENT,
          "count: expected a pointer, found NULL");
    OK(cbvh_separations(querier, mesh, mesh, NULL, NULL, 0, NULL));
    OK(cbvh_penetrations(querier, mesh, mesh, NULL, 0, NULL, NULL));
    OK(cbvh_signed_distances(querier, mesh, mesh, NULL, 0, NULL, NULL));
    OK(cbvh_intersections(querier, mesh, mesh, NULL, 0, NULL));
    OK(cbvh_measured_clashes(querier, mesh, mesh, NULL, 0, NULL, NULL));
    OK(cbvh_patches(querier, mesh, mesh, NULL, 0, NULL, NULL, NULL, 0, &count, NULL, 0, &region_count));
    CHECK(count == 0 && region_count == 0);
    /* A budget that ends all of them. */
    OK(cbvh_querier_set_budget(querier, 0));
    FAILS(cbvh_penetrations(querier, mesh, mesh, poses, 1, NULL, depths), CBVH_LIMIT, "budget");
    FAILS(cbvh_signed_distances(querier, mesh, mesh, poses, 1, NULL, numbers), CBVH_LIMIT, "budget");
    FAILS(cbvh_separations(querier, mesh, mesh, poses, directions, 1, ways), CBVH_LIMIT, "budget");
    FAILS(cbvh_clashes(querier, mesh, mesh, poses, 1, NULL, clashes), CBVH_LIMIT, "budget");
    FAILS(cbvh_intersections(querier, mesh, mesh, poses, 1, shared), CBVH_LIMIT, "budget");
    FAILS(cbvh_measured_clashes(querier, mesh, mesh, poses, 1, NULL, measured), CBVH_LIMIT, "budget");
    FAILS(cbvh_self_contacts(querier, mesh, contacts, 1, &count), CBVH_LIMIT, "budget");
    OK(cbvh_querier_set_budget(querier, UINT64_MAX));
}

static void scenes(void) {
    cbvh_instance none = {0}, found, foreign = {1ull << 40};
    cbvh_pose rounded = CBVH_IDENTITY;
    rounded.rows[1] = 0x1p-21;
    OK(cbvh_pose_check(&rounded));
    FAILS(cbvh_scene_add(scene, mesh, &rounded, "rounded", &found), CBVH_INVALID_ARGUMENT,
          "instance rounded: expected");
    FAILS(cbvh_scene_add(scene, mesh, NULL, NULL, &found), CBVH_INVALID_ARGUMENT, "world: ");
    FAILS(cbvh_scene_add(scene, mesh, &pose, "one", &found), CBVH_INVALID_ARGUMENT,
          "instance \"one\": expected a name of its own");
    FAILS(cbvh_scene_remove(scene, none), CBVH_NOT_FOUND, "expected an instance of the scene, found none");
    FAILS(cbvh_scene_set_poses(scene, &foreign, &pose, 1), CBVH_NOT_FOUND, "expected an instance of the scene");
    FAILS(cbvh_scene_set_groups(scene, foreign, 1, 1), CBVH_NOT_FOUND, "instance");
    FAILS(cbvh_scene_instance_pose(scene, none, &rounded), CBVH_NOT_FOUND, "instance");
    FAILS(cbvh_scene_find(scene, "two", &found), CBVH_NOT_FOUND,
          "name: expected the name of an instance, found \"two\"");
    cbvh_scene_signed_distance_answer number;
    size_t near_count;
    const double wrong[] = {NAN, -1, INFINITY, -0x1p-1074};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        const cbvh_penetration_options gap = {.size = sizeof gap, .relative_gap = wrong[k]},
                                       tolerance = {.size = sizeof tolerance, .tolerance = wrong[k]};
        FAILS(cbvh_scene_signed_distance(scene, &gap, &number), CBVH_INVALID_ARGUMENT, "relative_gap: expected");
        FAILS(cbvh_scene_signed_distance(scene, &tolerance, &number), CBVH_INVALID_ARGUMENT, "tolerance: expected");
        FAILS(cbvh_scene_near_pairs(scene, 1, &gap, NULL, 0, &near_count), CBVH_INVALID_ARGUMENT, "relative_gap: expected");
    }
    const cbvh_penetration_options cut = {.size = 12};
    const cbvh_scene no_scene = {0};
    FAILS(cbvh_scene_signed_distance(scene, &cut, &number), CBVH_INVALID_ARGUMENT, "options.size: expected 24");
    const double margins[] = {NAN, INFINITY, -1};
    for (size_t k = 0; k < 3; k++) {
        FAILS(cbvh_scene_near_pairs(scene, margins[k], NULL, NULL, 0, &near_count), CBVH_INVALID_ARGUMENT,
              "margin: expected a finite distance of at least 0");
    }
    FAILS(cbvh_scene_near_pairs(scene, 1, NULL, NULL, 1, &near_count), CBVH_INVALID_ARGUMENT, "pairs: expected a pointer");
    FAILS(cbvh_scene_near_pairs(scene, 1, NULL, NULL, 0, NULL), CBVH_INVALID_ARGUMENT, "count: expected a pointer");
    FAILS(cbvh_scene_near_pairs(no_scene, 1, NULL, NULL, 0, &near_count), CBVH_INVALID_HANDLE, "scene: ");
    FAILS(cbvh_scene_signed_distance(scene, NULL, NULL), CBVH_INVALID_ARGUMENT, "answer: expected a pointer, found NULL");
    FAILS(cbvh_scene_signed_distance(no_scene, NULL, &number), CBVH_INVALID_HANDLE, "scene: ");
    cbvh_motion_answer answer;
    FAILS(cbvh_scene_motion(scene, &none, &path, 1, NULL, &answer), CBVH_NOT_FOUND, "instance");
    const cbvh_instance twice[3] = {instance, none, instance};
    const cbvh_path ways[3] = {path, path, path};
    bool is_free;
    FAILS(cbvh_scene_is_free(scene, twice, ways, 3, NULL, &is_free), CBVH_INVALID_ARGUMENT,
          "instances[2]: expected each instance once, found that of instances[0]");
    FAILS(cbvh_scene_motion(scene, twice, ways, 3, NULL, &answer), CBVH_INVALID_ARGUMENT, "each instance once");
    cbvh_scene made;
    FAILS(cbvh_scene_of_mesh(mesh, &made), CBVH_INVALID_ARGUMENT,
          "mesh: expected a scene, a file with instances, found none");
    FAILS(cbvh_scene_open("/no such folder/x.cbvh", &made), CBVH_SYSTEM, "x.cbvh");
}

static void limits(void) {
    bool answer;
    OK(cbvh_querier_set_budget(querier, 0));
    FAILS(cbvh_collide(querier, mesh, mesh, &pose, 1, &answer), CBVH_LIMIT, "budget");
    OK(cbvh_querier_set_parallel(querier, 1));
    FAILS(cbvh_collide(querier, mesh, mesh, &pose, 1, &answer), CBVH_LIMIT, "budget");
    OK(cbvh_querier_set_parallel(querier, 0));
    OK(cbvh_querier_set_budget(querier, UINT64_MAX));
    OK(cbvh_collide(querier, mesh, mesh, &pose, 1, &answer));
    CHECK(answer);
    cbvh_mesh open;
    cbvh_relation relation;
    const cbvh_bake_options options = {.size = sizeof options, .no_topology = 1};
    OK(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 12, &options, &open));
    cbvh_mesh small = cube(0.25);
    FAILS(cbvh_relations(querier, open, small, &pose, 1, &relation), CBVH_INVALID_ARGUMENT,
          "does not say which objects are closed");
    OK(cbvh_mesh_free(small));
    OK(cbvh_mesh_free(open));
}

int main(void) {
    CHECK(strcmp(cbvh_last_message(), "") == 0);
    mesh = cube(1);
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));
    OK(cbvh_tracker_new(&tracker));
    const cbvh_pose end = shift(3, 0, 0);
    OK(cbvh_path_between(&pose, &end, &path));
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
    OK(cbvh_scene_add(scene, mesh, &pose, "one", &instance));
    handles();
    pointers();
    numbers();
    bakes();
    shapes();
    overlaps();
    scenes();
    limits();
    OK(cbvh_scene_free(scene));
    OK(cbvh_path_free(path));
    OK(cbvh_tracker_free(tracker));
    OK(cbvh_querier_free(querier));
    OK(cbvh_mesh_free(mesh));
    puts("misuse: every bad argument has its status and its message");
    return 0;
}
