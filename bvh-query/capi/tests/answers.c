/* Prints the bits of answers, a line per question, for `compare.py` to compare with those of the command. Each question
 * is asked on one core and on all, and both must agree to the last bit.
 *
 *     answers collide|contacts|distance|within|relation A B POSES D
 *     answers motion A B MOTIONS CLEARANCE
 *     answers closest|side|ray|segment MESH PROBES
 *     answers scene-collide|scene-pairs|scene-distance|scene-within LIST WORLDS FRAMES D
 *
 * POSES, MOTIONS, PROBES, WORLDS and FRAMES are files of doubles. LIST has a line "FILE MOVES" per instance, and then
 * a line "allow A B" per pair that may touch. */
#include "support.h"

typedef struct { double *at; size_t count; } numbers;

static numbers read_numbers(const char *path) {
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL);
    numbers of = {malloc(sizeof(double)), 0};
    for (double number; fread(&number, sizeof number, 1, file) == 1;) {
        of.at = realloc(of.at, (of.count + 1) * sizeof number);
        CHECK(of.at != NULL);
        of.at[of.count++] = number;
    }
    CHECK(fclose(file) == 0);
    return of;
}

static void *room(size_t count, size_t size) {
    void *of = calloc(count + 1, size);
    CHECK(of != NULL);
    return of;
}

static void print_bits(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    printf("%016llx ", (unsigned long long)bits);
}

static bool is(const char *mode, const char *other) { return strcmp(mode, other) == 0; }

static cbvh_querier querier;
static cbvh_mesh a, b;

/* Asks about poses, and keeps a number for each. */
static void ask_pairs(const char *mode, const cbvh_pose *poses, size_t count, double d, double *values) {
    bool *yes = room(count, sizeof *yes);
    if (is(mode, "collide") || is(mode, "within")) {
        OK(is(mode, "within") ? cbvh_within(querier, a, b, poses, count, d, yes)
                              : cbvh_collide(querier, a, b, poses, count, yes));
        for (size_t k = 0; k < count; k++) {
            values[k] = yes[k];
        }
    } else if (is(mode, "contacts")) {
        size_t all, *counts = room(count, sizeof *counts);
        const cbvh_status status = cbvh_contacts(querier, a, b, poses, count, counts, NULL, 0, &all);
        CHECK(status == (all > 0 ? CBVH_BUFFER_TOO_SMALL : CBVH_OK));
        for (size_t k = 0; k < count; k++) {
            values[k] = (double)counts[k];
        }
        free(counts);
    } else if (is(mode, "relation")) {
        cbvh_relation *relations = room(count, sizeof *relations);
        OK(cbvh_relations(querier, a, b, poses, count, relations));
        for (size_t k = 0; k < count; k++) {
            values[k] = relations[k];
        }
        free(relations);
    } else {
        CHECK(is(mode, "distance"));
        cbvh_distance_answer *distances = room(count, sizeof *distances);
        OK(cbvh_distances(querier, a, b, poses, count, NULL, distances));
        for (size_t k = 0; k < count; k++) {
            values[k] = distances[k].distance;
        }
        free(distances);
    }
    free(yes);
}

/* Asks about motions: three numbers for each. */
static void ask_motions(const cbvh_pose *poses, size_t count, double clearance, double *values) {
    cbvh_pose *starts = room(count, sizeof *starts), *ends = room(count, sizeof *ends);
    cbvh_motion_answer *answers = room(count, sizeof *answers);
    bool *free_ways = room(count, sizeof *free_ways);
    for (size_t k = 0; k < count; k++) {
        starts[k] = poses[2 * k];
        ends[k] = poses[2 * k + 1];
    }
    const cbvh_motion_options options = {.size = sizeof options, .clearance = clearance};
    OK(cbvh_edge_motions(querier, a, b, starts, ends, count, &options, answers));
    OK(cbvh_edges_are_free(querier, a, b, starts, ends, count, &options, free_ways));
    for (size_t k = 0; k < count; k++) {
        const bool is_free = answers[k].outcome == CBVH_FREE;
        CHECK(free_ways[k] == is_free);
        values[3 * k] = answers[k].outcome;
        values[3 * k + 1] = is_free ? 0 : answers[k].free_until;
        values[3 * k + 2] = is_free ? 0 : answers[k].at;
        cbvh_path path;
        cbvh_motion_answer again;
        OK(cbvh_path_between(&starts[k], &ends[k], &path));
        OK(cbvh_motions(querier, a, b, &path, 1, &options, &again));
        CHECK(memcmp(&again, &answers[k], sizeof again) == 0);
        OK(cbvh_path_free(path));
    }
    free(starts), free(ends), free(answers), free(free_ways);
}

/* Asks about points, rays and segments; a ray that hits nothing has -1, as the command prints it. */
static void ask_probes(const char *mode, const double *probes, size_t count, double *values) {
    if (is(mode, "closest")) {
        cbvh_closest_point *answers = room(count, sizeof *answers);
        OK(cbvh_closest_points(querier, a, NULL, probes, count, INFINITY, answers));
        for (size_t k = 0; k < count; k++) {
            values[k] = answers[k].distance;
        }
        free(answers);
    } else if (is(mode, "side")) {
        cbvh_side *answers = room(count, sizeof *answers);
        OK(cbvh_sides(querier, a, NULL, probes, count, answers));
        for (size_t k = 0; k < count; k++) {
            values[k] = answers[k];
        }
        free(answers);
    } else if (is(mode, "ray")) {
        cbvh_ray *rays = room(count, sizeof *rays);
        cbvh_ray_hit *answers = room(count, sizeof *answers);
        for (size_t k = 0; k < count; k++) {
            memcpy(rays[k].origin, probes + 6 * k, sizeof rays[k].origin);
            memcpy(rays[k].direction, probes + 6 * k + 3, sizeof rays[k].direction);
            rays[k].until = INFINITY;
        }
        OK(cbvh_first_hits(querier, a, NULL, rays, count, answers));
        for (size_t k = 0; k < count; k++) {
            values[k] = answers[k].found ? answers[k].t : -1;
        }
        free(rays), free(answers);
    } else {
        CHECK(is(mode, "segment"));
        bool *answers = room(count, sizeof *answers);
        OK(cbvh_segment_hits(querier, a, NULL, (const cbvh_segment *)(const void *)probes, count, answers));
        for (size_t k = 0; k < count; k++) {
            values[k] = answers[k];
        }
        free(answers);
    }
}

static cbvh_scene scene;
static cbvh_instance moving[1000];
static size_t moving_count;

/* Instances in groups so that what stands still is asked about with what moves alone, as the command does. */
static void make_scene(const char *list, const char *worlds_file) {
    const numbers worlds = read_numbers(worlds_file);
    FILE *file = fopen(list, "r");
    CHECK(file != NULL);
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
    static cbvh_instance instances[1000];
    char name[1000];
    size_t number = 0, first, second;
    while (fscanf(file, "%999s", name) == 1) {
        if (is(name, "allow")) {
            CHECK(fscanf(file, "%zu %zu", &first, &second) == 2 && first < number && second < number);
            OK(cbvh_scene_set_allowed(scene, instances[first], instances[second], 1));
            continue;
        }
        int moves;
        CHECK(fscanf(file, "%d", &moves) == 1 && number < 1000 && 12 * number < worlds.count);
        cbvh_mesh mesh;
        cbvh_pose world;
        memcpy(world.rows, worlds.at + 12 * number, sizeof world.rows);
        OK(cbvh_mesh_open(name, CBVH_MAP, &mesh));
        OK(cbvh_scene_add(scene, mesh, &world, NULL, &instances[number]));
        OK(cbvh_mesh_free(mesh));
        OK(cbvh_scene_set_groups(scene, instances[number], moves ? 2 : 1, moves ? 3 : 2));
        if (moves) {
            moving[moving_count++] = instances[number];
        }
        number++;
    }
    CHECK(fclose(file) == 0);
    free(worlds.at);
}

static double ask_scene(const char *mode, double d) {
    bool answer;
    size_t count;
    cbvh_scene_distance_answer nearest;
    cbvh_scene_pair pairs[10000];
    if (is(mode, "collide")) {
        OK(cbvh_scene_collide(scene, &answer));
        return answer;
    }
    if (is(mode, "distance")) {
        OK(cbvh_scene_distance(scene, &nearest));
        return nearest.nearest.distance;
    }
    OK(is(mode, "pairs") ? cbvh_scene_pairs_in_contact(scene, pairs, 10000, &count)
                         : cbvh_scene_pairs_within(scene, d, pairs, 10000, &count));
    return (double)count;
}

static void ask_frames(const char *mode, const cbvh_pose *poses, size_t count, double d, double *values) {
    for (size_t k = 0; k < count; k++) {
        OK(cbvh_scene_set_poses(scene, moving, poses + k * moving_count, moving_count));
        values[k] = ask_scene(mode, d);
    }
}

int main(int count, char **arguments) {
    CHECK(count >= 4);
    const char *const mode = arguments[1];
    const bool is_scene = strncmp(mode, "scene-", 6) == 0, is_motion = is(mode, "motion");
    const bool is_probe = is(mode, "closest") || is(mode, "side") || is(mode, "ray") || is(mode, "segment");
    CHECK(count == (is_probe ? 4 : 6));
    const double number = is_probe ? 0 : strtod(arguments[5], NULL);
    const numbers of = read_numbers(arguments[is_probe ? 3 : 4]);
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));
    if (is_scene) {
        make_scene(arguments[2], arguments[3]);
    } else {
        OK(cbvh_mesh_open(arguments[2], CBVH_MAP, &a));
        if (!is_probe) {
            OK(cbvh_mesh_open(arguments[3], CBVH_MAP, &b));
        }
    }
    const size_t fields = is_motion ? 24 : is_scene ? 12 * moving_count : !is_probe ? 12
                          : is(mode, "ray") || is(mode, "segment") ? 6 : 3;
    const size_t questions = of.count / fields, values = is_motion ? 3 : 1;
    double *one_core = room(questions * values, sizeof(double)), *all_cores = room(questions * values, sizeof(double));
    const cbvh_pose *const poses = (const cbvh_pose *)(const void *)of.at;
    for (int parallel = 0; parallel < 2; parallel++) {
        double *const found = parallel ? all_cores : one_core;
        OK(cbvh_querier_set_parallel(querier, parallel));
        if (is_scene) {
            OK(cbvh_scene_set_parallel(scene, parallel));
            OK(cbvh_scene_set_tracking(scene, parallel));
            ask_frames(mode + 6, poses, questions, number, found);
        } else if (is_motion) {
            ask_motions(poses, questions, number, found);
        } else if (is_probe) {
            ask_probes(mode, of.at, questions, found);
        } else {
            ask_pairs(mode, poses, questions, number, found);
        }
    }
    CHECK(memcmp(one_core, all_cores, questions * values * sizeof(double)) == 0);
    for (size_t k = 0; k < questions * values; k++) {
        print_bits(one_core[k]);
        if (k % values == values - 1) {
            putchar('\n');
        }
    }
    free(one_core), free(all_cores), free(of.at);
    OK(cbvh_scene_free(scene));
    OK(cbvh_mesh_free(b));
    OK(cbvh_mesh_free(a));
    OK(cbvh_querier_free(querier));
    return 0;
}
