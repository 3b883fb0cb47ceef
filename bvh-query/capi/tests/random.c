/* Ten thousand calls with arguments at random: right ones, and each kind of wrong one. None crashes, reads or writes
 * where it must not (the address sanitizer looks on), or leaks; handles that calls made are freed, some of them twice.
 *
 *     random TESTDATA
 */
#include "support.h"

#define CALLS 10000
#define KEPT 32

static random_source source = {5};
static size_t below(size_t limit) { return random_below(&source, limit); }

/* Handles of all kinds, open and freed. */
static uint64_t kept[KEPT];

static uint64_t any_handle(uint64_t likely) {
    switch (below(8)) {
    case 0: return kept[below(KEPT)];
    case 1: return below(4) ? 0 : random_bits(&source);
    case 2: return below(2) ? likely + 1 : likely ^ 1ull << below(64);
    default: return likely;
    }
}

/* Frees a handle of whatever kind. */
static bool free_any(uint64_t handle) {
    return cbvh_mesh_free((cbvh_mesh){handle}) == CBVH_OK || cbvh_querier_free((cbvh_querier){handle}) == CBVH_OK ||
           cbvh_tracker_free((cbvh_tracker){handle}) == CBVH_OK || cbvh_path_free((cbvh_path){handle}) == CBVH_OK ||
           cbvh_scene_free((cbvh_scene){handle}) == CBVH_OK || cbvh_robot_free((cbvh_robot){handle}) == CBVH_OK ||
           cbvh_stop_free((cbvh_stop){handle}) == CBVH_OK;
}

/* What calls may be given: arrays that hold `ELEMENTS` of anything, and numbers that are not plain. */
#define ELEMENTS 4
static struct { double numbers[14 * ELEMENTS]; } input;
static struct { double numbers[24 * ELEMENTS]; } output;

static double any_number(void) {
    const double odd[] = {0, -1, 1, NAN, INFINITY, -INFINITY, 1e308, -1e-320, 0x1p-500, 2, 0.5};
    return below(3) ? random_signed(&source) : odd[below(sizeof odd / sizeof *odd)];
}

/* Poses that are right more often than not, as numbers; other functions see points, rays and segments in them. */
static void *any_input(void) {
    for (int element = 0; element < ELEMENTS; element++) {
        const cbvh_pose pose = random_pose(&source, 1);
        memcpy(input.numbers + 12 * element, pose.rows, sizeof pose.rows);
    }
    if (below(3) == 0) {
        input.numbers[below(12 * ELEMENTS)] = any_number();
    }
    const size_t kind = below(12);
    return kind == 0 ? NULL : kind == 1 ? (char *)&input + 1 + below(7) : (char *)&input;
}

/* Room that is filled with a pattern, so that what is not written shows. */
static void *any_output(void) {
    const size_t kind = below(12);
    memset(&output, 0xA5, sizeof output);
    return kind == 0 ? NULL : kind == 1 ? (char *)&output + 1 + below(7) : (char *)&output;
}

/* At most as many as there is room for, or so many that no memory has them. */
static size_t any_count(void) {
    const size_t far[] = {SIZE_MAX, SIZE_MAX / 2, SIZE_MAX / 8, (size_t)1 << 62};
    return below(12) ? below(ELEMENTS) : far[below(4)];
}

static int32_t any_flag(void) { return below(4) ? (int32_t)below(2) : (int32_t)random_bits(&source); }

/* Options of a bake, whose fields are addresses, too, or others, whose fields are numbers in whatever question they are given. */
static const void *any_options(bool of_bake) {
    /* Whichever options it holds, the bytes of every size below its own are there. */
    static union any {
        cbvh_bake_options bake;
        cbvh_motion_options motion;
        cbvh_distance_options distance;
        cbvh_clash_options clash;
        char bytes[200];
    } kinds[2];
    union any *const options = &kinds[of_bake];
    const char *const names[] = {NULL, "", "f32", "dop6-u8", "quick", "\xC3(", "packed"};
    const size_t size = below(4) ? 0 : below(sizeof *options);
    memset(options, 0, sizeof *options);
    if (of_bake) {
        options->bake = (cbvh_bake_options){.size = size ? size : sizeof options->bake, .profile = names[below(7)],
            .triangles = names[below(7)], .effort = below(2) ? NULL : names[below(7)],
            .round = below(2) ? NULL : names[below(7)], .max_error = below(2) ? 0 : any_number(), .no_ids = any_flag(),
            .force = below(8) == 0};
        return below(5) ? options : NULL;
    }
    switch (below(4)) {
    case 0:
        options->motion = (cbvh_motion_options){size ? size : sizeof options->motion, fabs(any_number()),
            below(2) ? 0 : any_number()};
        return options;
    case 1:
        options->distance = (cbvh_distance_options){size ? size : sizeof options->distance, any_number(),
            below(2) ? 0 : any_number()};
        return options;
    case 2:
        options->clash = (cbvh_clash_options){size ? size : sizeof options->clash, fabs(any_number()),
            below(2) ? 0 : any_number(), below(2) ? 0 : fabs(any_number()), below(2000)};
        return options;
    default: return NULL;
    }
}

static const cbvh_robot_options *any_robot_options(void) {
    static cbvh_robot_options options;
    options = (cbvh_robot_options){.size = below(4) ? sizeof options : below(sizeof options), .visual = any_flag(),
        .cylinder_error = below(2) ? 0 : any_number(), .base = any_flag(), .apply_up_axis = any_flag()};
    return below(2) ? &options : NULL;
}

static int32_t any_pose(void *user, double t, cbvh_pose *pose) {
    (void)user;
    if (below(16) == 0) {
        return (int32_t)below(3);
    }
    *pose = shift(3 - 6 * t, 0, 0);
    if (below(32) == 0) {
        pose->rows[below(12)] = any_number();
    }
    return 0;
}

static double any_sagitta(void *user, double radius, double t0, double t1) {
    (void)user, (void)radius, (void)t0, (void)t1;
    return below(8) ? 1e-9 : any_number();
}

int main(int argument_count, char **arguments) {
    const cbvh_mesh mesh = cube(1), other = cube(0.5);
    const cbvh_pose here = CBVH_IDENTITY, there = shift(3, 0, 0);
    cbvh_querier querier;
    cbvh_tracker tracker;
    cbvh_path path;
    cbvh_scene scene;
    cbvh_instance instance;
    cbvh_robot robot;
    cbvh_body body;
    cbvh_stop stop;
    char urdf[1000];
    CHECK(argument_count == 2);
    snprintf(urdf, sizeof urdf, "%s/robot/robot.urdf", arguments[1]);
    OK(cbvh_robot_from_urdf(urdf, NULL, &robot));
    OK(cbvh_robot_find(robot, "hand", &body));
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));
    OK(cbvh_tracker_new(&tracker));
    OK(cbvh_stop_new(&stop));
    OK(cbvh_path_between(&here, &there, &path));
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
    OK(cbvh_scene_add(scene, mesh, &here, "here", &instance));
    OK(cbvh_scene_add(scene, other, &there, NULL, NULL));
    /* A way that is decided slowly is not what is looked for. */
    OK(cbvh_querier_set_budget(querier, 20000));
    OK(cbvh_scene_set_budget(scene, 20000));
    size_t statuses[12] = {0};
    for (int call = 0; call < CALLS; call++) {
        const cbvh_mesh a = {any_handle(mesh.id)}, b = {any_handle(other.id)};
        const cbvh_querier q = {any_handle(querier.id)};
        const cbvh_tracker r = {any_handle(tracker.id)};
        const cbvh_path p = {any_handle(path.id)};
        const cbvh_scene s = {any_handle(scene.id)};
        const cbvh_instance i = {any_handle(instance.id)};
        const cbvh_robot o = {any_handle(robot.id)};
        const cbvh_body d = {any_handle(body.id)};
        const cbvh_stop t = {any_handle(stop.id)};
        const char *const links[4] = {"base", "hand", below(8) ? "forearm" : "nothing", below(8) ? "x" : NULL};
        const char *const link = links[below(4)];
        const size_t joint_count = below(8) ? 4 : below(6);
        const cbvh_path paths[2] = {p, path};
        const cbvh_instance instances[2] = {i, instance};
        void *in = any_input(), *out = any_output();
        void *const more = below(8) ? &input : NULL;
        const void *const options = any_options(false), *const baking = any_options(true);
        const size_t n = any_count(), capacity = below(ELEMENTS);
        const double x = any_number(), y = any_number();
        size_t count = 0, counts[ELEMENTS];
        uint64_t made = 0;
        char name[3] = {(char)('a' + below(26)), 0, 0};
        cbvh_status status = CBVH_OK;
        switch (below(118)) {
        case 0: status = cbvh_collide(q, a, b, in, n, out); break;
        case 1: status = cbvh_within(q, a, b, in, n, x, out); break;
        case 2: status = cbvh_relations(q, a, b, in, n, out); break;
        case 3: status = cbvh_distances(q, a, b, in, n, options, out); break;
        case 4: status = cbvh_contacts(q, a, b, in, n, below(2) ? NULL : counts, out, capacity, &count); break;
        case 5: status = cbvh_first_collision(q, a, b, in, n, out); break;
        case 6: status = cbvh_displacement(a, in, more, out); break;
        case 7: status = cbvh_tracker_collide(r, q, a, b, in, n, out); break;
        case 8: status = cbvh_tracker_within(r, q, a, b, in, n, x, out); break;
        case 9: status = below(2) ? cbvh_tracker_distance(r, q, a, b, in, n, out)
                                : cbvh_tracker_signed_distance(r, q, a, b, in, n, options, out); break;
        case 10: status = cbvh_motions(q, a, b, paths, below(3), options, out); break;
        case 11: status = cbvh_are_free(q, a, b, paths, below(3), options, out); break;
        case 12: status = cbvh_edge_motions(q, a, b, in, more, n, options, out); break;
        case 13: status = cbvh_edges_are_free(q, a, b, in, more, n, options, out); break;
        case 14: status = cbvh_closest_points(q, a, more, in, n, x, out); break;
        case 15: status = cbvh_sides(q, a, more, in, n, out); break;
        case 16: status = cbvh_signed_point_distances(q, a, more, in, n, x, out); break;
        case 17: status = cbvh_first_hits(q, a, more, in, n, out); break;
        case 18: status = cbvh_any_hits(q, a, more, in, n, out); break;
        case 19: status = cbvh_all_hits(q, a, more, in, n, below(2) ? NULL : counts, out, capacity, &count); break;
        case 20: status = below(2) ? cbvh_segment_hits(q, a, more, in, n, out) : cbvh_visible(q, a, more, in, n, x, out); break;
        case 21: status = cbvh_mesh_clone(a, (cbvh_mesh *)&made); break;
        case 22: status = cbvh_mesh_object(a, below(3), (cbvh_mesh *)&made); break;
        case 23: status = cbvh_mesh_object_name(a, below(3), out, capacity, &count); break;
        case 24: status = cbvh_mesh_find(a, below(4) ? name : NULL, out); break;
        case 25: status = cbvh_mesh_triangle_count(a, out); break;
        case 26: status = cbvh_mesh_bytes(a, out, below(sizeof output - 8), &count); break;
        case 27: status = cbvh_mesh_duplicates(a, (uint32_t)below(20), out, capacity, &count); break;
        case 28: status = cbvh_mesh_from_bytes(in, below(sizeof input - 8), (cbvh_mesh *)&made); break;
        case 29: status = cbvh_mesh_validate(a); break;
        case 30: status = cbvh_bake(in, n, (uint32_t *)more, below(ELEMENTS), baking, (cbvh_mesh *)&made); break;
        case 31: status = cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, below(13), baking, (cbvh_mesh *)&made); break;
        case 32: status = cbvh_querier_new(any_flag(), (cbvh_querier *)&made); break;
        case 33: status = cbvh_querier_set_parallel(q, any_flag()); break;
        case 34: status = cbvh_querier_stats(q, out); break;
        case 35: status = cbvh_tracker_new((cbvh_tracker *)&made); break;
        case 36: status = cbvh_path_between(in, more, (cbvh_path *)&made); break;
        case 37: status = cbvh_path_screw(in, more, &x, y, y, (cbvh_path *)(n == 0 ? &made : NULL)); break;
        case 38: status = cbvh_path_polyline(in, n, (cbvh_path *)&made); break;
        case 39: status = cbvh_path_from_functions(below(4) ? any_pose : NULL, any_sagitta, NULL, NULL,
            (cbvh_path *)&made); break;
        case 40: status = cbvh_path_pose(p, x, out); break;
        case 41: status = cbvh_path_reach(a, p, x, y, out); break;
        case 42: status = cbvh_scene_new(any_flag(), (cbvh_scene *)&made); break;
        case 43: status = cbvh_scene_clone(s, (cbvh_scene *)&made); break;
        case 44: status = cbvh_scene_add(s, a, in, below(2) ? NULL : name, (cbvh_instance *)&count); break;
        case 45: status = cbvh_scene_remove(s, i.id == instance.id ? (cbvh_instance){below(40)} : i); break;
        case 46: status = cbvh_scene_set_poses(s, instances, in, below(3)); break;
        case 47: status = cbvh_scene_set_groups(s, i, (uint32_t)below(4), ~0u); break;
        case 48: status = cbvh_scene_set_allowed(s, i, instance, any_flag()); break;
        case 49: status = cbvh_scene_instances(s, out, capacity, &count); break;
        case 50: status = cbvh_scene_pairs_within(s, x, out, capacity, &count); break;
        case 51: status = cbvh_scene_contacts(s, out, capacity, &count); break;
        case 52: status = below(2) ? cbvh_scene_distance(s, out)
                          : below(2) ? cbvh_scene_signed_distance(s, options, out)
                                     : cbvh_scene_near_pairs(s, x, options, out, capacity, &count); break;
        case 53: status = cbvh_scene_motion(s, instances, paths, below(3), options, out); break;
        case 54: status = cbvh_scene_first_hits(s, in, n, out); break;
        case 55: status = cbvh_scene_signed_point_distances(s, in, n, x, out); break;
        case 56: status = cbvh_pose_then(in, more, out); break;
        case 57: status = cbvh_mesh_rounded(a, below(2) ? fabs(x) : x, (cbvh_mesh *)&made); break;
        case 58: status = cbvh_mesh_solid(a, (cbvh_mesh *)&made); break;
        case 59: status = cbvh_mesh_radius(a, out); break;
        case 60: status = cbvh_mesh_is_solid(a, out); break;
        case 61: status = cbvh_bake_cloud(in, n, (cbvh_mesh *)&made); break;
        case 62: status = cbvh_bake_segment(in, more, (cbvh_mesh *)&made); break;
        case 63: status = cbvh_bake_box(in, (cbvh_mesh *)&made); break;
        case 64: status = cbvh_bake_ground(in, x, (cbvh_mesh *)&made); break;
        case 65: status = cbvh_bake_cylinder(fabs(x), fabs(y), 0.5, below(2) ? NULL : out, (cbvh_mesh *)&made); break;
        case 66: status = cbvh_bake_cone(fabs(x), y, 0.5, below(2) ? NULL : out, (cbvh_mesh *)&made); break;
        case 67: status = cbvh_bake_height_field(in, n, any_count(), more, (cbvh_mesh *)&made); break;
        case 68: status = cbvh_bake_voxels(in, n, x, (cbvh_mesh *)&made); break;
        case 69: status = cbvh_scene_set_margin(s, i, below(2) ? fabs(x) : x); break;
        case 70: status = cbvh_scene_set_pair_margin(s, i, instance, x); break;
        case 71: status = cbvh_scene_instance_margin(s, i, out); break;
        case 72: status = cbvh_scene_pair_margin(s, instance, i, out); break;
        case 73: status = cbvh_scene_collide(s, out); break;
        case 74: status = cbvh_bake_octree(in, in, n, x, (cbvh_mesh *)&made); break;
        case 75: status = cbvh_bake_convex_hull(in, n, (cbvh_mesh *)&made); break;
        case 76: status = cbvh_scene_attach(s, i, instance); break;
        case 77: status = cbvh_scene_detach(s, i); break;
        case 78: status = cbvh_scene_parent(s, i, out); break;
        case 79: status = cbvh_scene_set_mesh(s, i, a); break;
        case 80: status = cbvh_separations(q, a, b, in, more, n, out); break;
        case 81: status = below(2) ? cbvh_penetrations(q, a, b, in, n, options, out) : cbvh_intersections(q, a, b, in, n, out); break;
        case 82: status = cbvh_contact_regions(q, a, b, in, n, below(2) ? NULL : counts, out, capacity, &count); break;
        case 83: status = below(2) ? cbvh_patches(q, a, b, in, n, options, NULL, out, capacity, &count, NULL, 0,
                                                  below(2) ? NULL : counts)
                                   : cbvh_contact_points(q, a, b, in, n, options, below(2) ? NULL : counts, out, capacity,
                                                         &count, NULL, 0, NULL); break;
        case 84: status = cbvh_self_contacts(q, a, out, capacity, &count); break;
        case 85: status = (below(2) ? cbvh_clashes(q, a, b, in, n, options, out)
            : cbvh_measured_clashes(q, a, b, in, n, options, out)); break;
        case 86: status = (below(2) ? cbvh_scene_clashes(s, options, out, capacity, &count)
            : cbvh_scene_measured_clashes(s, options, out, capacity, &count)); break;
        case 87: status = cbvh_robot_from_urdf(below(4) ? urdf : name, any_robot_options(), (cbvh_robot *)&made); break;
        case 88: status = cbvh_robot_clone(o, (cbvh_robot *)&made); break;
        case 89: status = cbvh_robot_set_parallel(o, any_flag()); break;
        case 90: status = cbvh_robot_count(o, out); break;
        case 91: status = cbvh_robot_name(o, out, capacity, &count); break;
        case 92: status = cbvh_robot_joint_name(o, any_count(), out, capacity, &count); break;
        case 93: status = cbvh_robot_limits(o, out, capacity, &count); break;
        case 94: status = cbvh_robot_group_joints(o, any_count(), out, capacity, &count); break;
        case 95: status = cbvh_robot_state_values(o, any_count(), out, capacity, &count); break;
        case 96: status = cbvh_robot_links(o, out, capacity, &count); break;
        case 97: status = cbvh_robot_find(o, link, out); break;
        case 98: status = cbvh_robot_body_name(o, d, out, capacity, &count); break;
        case 99: status = cbvh_robot_shape(o, d, below(2), (cbvh_mesh *)&made, out); break;
        case 100: status = cbvh_robot_pairs(o, out, capacity, &count); break;
        case 101: status = cbvh_robot_add_obstacle(o, "x", a, in, below(2) ? NULL : (cbvh_body *)&count); break;
        case 102: status = cbvh_robot_attach(o, "x", a, link, in, links, below(4), NULL); break;
        case 103: status = cbvh_robot_remove(o, link); break;
        case 104: status = cbvh_robot_set_pose(o, link, in); break;
        case 105: status = cbvh_robot_set_margin(o, link, below(2) ? fabs(x) : x); break;
        case 106: status = cbvh_robot_set_allowed(o, link, links[below(4)], any_flag()); break;
        case 107: status = cbvh_robot_allow_frequent(o, below(4), x, out, capacity, &count); break;
        case 108: status = below(2) ? cbvh_robot_collide(o, in, joint_count, n, out)
                                    : cbvh_robot_distances(o, in, joint_count, n, out); break;
        case 109: status = below(2) ? cbvh_robot_pairs_in_contact(o, in, joint_count, n, below(2) ? NULL : counts, out, capacity,
                                                                  &count)
                                    : cbvh_robot_near_pairs(o, in, joint_count, n, x, options, below(2) ? NULL : counts, out,
                                                            below(2) ? NULL : more, capacity, &count); break;
        case 110: status = below(2) ? cbvh_robot_link_poses(o, in, joint_count, n, out, capacity, &count)
                                    : cbvh_robot_signed_distances(o, in, joint_count, n, options, out); break;
        case 111: status = below(2) ? cbvh_robot_edges_are_free(o, in, more, joint_count, n, options, out)
                                    : cbvh_robot_edge_motions(o, more, in, joint_count, n, options, out); break;
        case 112: status = below(2) ? cbvh_robot_are_free(o, in, below(4), joint_count, n, options, out)
                                    : cbvh_robot_motions(o, in, below(4), joint_count, n, options, out); break;
        case 113: status = below(2) ? cbvh_mesh_open_edges(a, out, capacity, &count) : cbvh_mesh_open_edge_counts(a, out); break;
        /* No flag is set, so that questions have answers. */
        case 115: status = below(2) ? cbvh_stop_new((cbvh_stop *)&made)
                                : below(2) ? cbvh_stop_clear(t) : cbvh_stop_set_after(t, below(2) ? 1e6 : -1 - fabs(x)); break;
        case 116: status = below(3) == 0 ? cbvh_querier_set_stop(q, t)
                                : below(2) ? cbvh_scene_set_stop(s, t) : cbvh_robot_set_stop(o, t); break;
        case 114: status = cbvh_signed_distances(q, a, b, in, n, options, out); break;
        default:
            /* Frees one, as every kind. */
            status = free_any(kept[below(KEPT)]) ? CBVH_OK : CBVH_INVALID_HANDLE;
        }
        CHECK(status >= CBVH_OK && status < CBVH_INTERNAL);
        CHECK(status == CBVH_OK || *cbvh_last_message() != 0);
        CHECK(status == CBVH_OK || made == 0);
        statuses[status]++;
        if (made != 0) {
            /* The handle that was there is freed, unless it has been. */
            const size_t place = below(KEPT);
            free_any(kept[place]);
            kept[place] = made;
        }
    }
    /* The first ones still answer. */
    bool answer;
    OK(cbvh_querier_set_parallel(querier, 0));
    OK(cbvh_collide(querier, mesh, other, &here, 1, &answer));
    CHECK(!answer);
    printf("random misuse: %d calls:", CALLS);
    for (int status = 0; status < 12; status++) {
        printf(" %zu", statuses[status]);
    }
    puts(" by status");
    /* Both what is right and what is wrong was called often. */
    CHECK(statuses[CBVH_OK] > CALLS / 10 && statuses[CBVH_INVALID_ARGUMENT] > CALLS / 10);
    CHECK(statuses[CBVH_INVALID_HANDLE] > CALLS / 20 && statuses[CBVH_BUFFER_TOO_SMALL] > 0);
    for (size_t place = 0; place < KEPT; place++) {
        free_any(kept[place]);
    }
    OK(cbvh_stop_free(stop));
    OK(cbvh_robot_free(robot));
    OK(cbvh_scene_free(scene));
    OK(cbvh_path_free(path));
    OK(cbvh_tracker_free(tracker));
    OK(cbvh_querier_free(querier));
    OK(cbvh_mesh_free(other));
    OK(cbvh_mesh_free(mesh));
    return 0;
}
