/* Robots: answers against those of queriers about the same shapes where the links are, motions against their samples,
 * changes, every bad argument by itself, and threads.
 *
 *     robots FOLDER_FOR_FILES TESTDATA
 */
#include "support.h"
#include <pthread.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define JOINTS 4
#define LINKS 5
#define ROWS 300
#define PAIRS 50

static const char *testdata, *scratch;
static random_source source = {5};

/* Writes the path of a file that is used next. */
static const char *in(const char *folder, const char *name) {
    static char path[1000];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static const char *urdf(void) { return in(testdata, "robot/robot.urdf"); }

static const char *SRDF = "<robot name=\"small_arm\">\n"
                          "<group name=\"upper\"><joint name=\"waist\"/><joint name=\"elbow\"/></group>\n"
                          "<group name=\"hand\"><joint name=\"wrist\"/></group>\n"
                          "<group_state name=\"bent\" group=\"upper\"><joint name=\"elbow\" value=\"0.5\"/></group_state>\n"
                          "<disable_collisions link1=\"base\" link2=\"turret\" reason=\"Adjacent\"/>\n"
                          "<disable_collisions link1=\"turret\" link2=\"upper_arm\" reason=\"Adjacent\"/>\n"
                          "<disable_collisions link1=\"upper_arm\" link2=\"forearm\" reason=\"Adjacent\"/>\n"
                          "<disable_collisions link1=\"forearm\" link2=\"hand\" reason=\"Adjacent\"/>\n"
                          "<disable_collisions link1=\"forearm\" link2=\"gripper\" reason=\"Never\"/>\n"
                          "</robot>\n";

static void write_file(const char *path, const char *text) {
    FILE *file = fopen(path, "w");
    CHECK(file != NULL && fputs(text, file) >= 0 && fclose(file) == 0);
}

/* The arm, with what its SRDF file says. */
static cbvh_robot arm(void) {
    char srdf[1000], path[1000];
    snprintf(srdf, sizeof srdf, "%s", in(scratch, "robot.srdf"));
    snprintf(path, sizeof path, "%s", urdf());
    write_file(srdf, SRDF);
    const cbvh_robot_options options = {.size = sizeof options, .srdf = srdf};
    cbvh_robot robot;
    OK(cbvh_robot_from_urdf(path, &options, &robot));
    return robot;
}

static cbvh_mesh block(double x, double y, double z) {
    const double sides[3] = {x, y, z};
    cbvh_mesh surface, solid;
    OK(cbvh_bake_box(sides, &surface));
    OK(cbvh_mesh_solid(surface, &solid));
    OK(cbvh_mesh_free(surface));
    return solid;
}

static void add(cbvh_robot robot, const char *name, cbvh_mesh mesh, double x, double y, double z) {
    const cbvh_pose pose = shift(x, y, z);
    OK(cbvh_robot_add_obstacle(robot, name, mesh, &pose, NULL));
}

/* The arm among obstacles, with something in its hand. */
static cbvh_robot cell(void) {
    const cbvh_robot robot = arm();
    const cbvh_mesh pillar = block(0.1, 0.1, 1.5), shelf = block(0.4, 1, 0.02), tool = block(0.02, 0.02, 0.2);
    const cbvh_pose in_hand = shift(0, 0, 0.2);
    const char *const may_touch[1] = {"forearm"};
    add(robot, "pillar", pillar, 0.45, 0, 0.75);
    add(robot, "shelf", shelf, -0.5, 0, 0.9);
    OK(cbvh_robot_attach(robot, "tool", tool, "hand", &in_hand, may_touch, 1, NULL));
    OK(cbvh_mesh_free(pillar));
    OK(cbvh_mesh_free(shelf));
    OK(cbvh_mesh_free(tool));
    return robot;
}

static void random_joints(double *joints, size_t count) {
    const double limits[JOINTS] = {3.1, 2, 2.8, 3.1};
    for (size_t k = 0; k < count * JOINTS; k++) {
        joints[k] = limits[k % JOINTS] * random_signed(&source);
    }
}

static void description(void) {
    const cbvh_robot robot = arm();
    const char *const joints[JOINTS] = {"waist", "shoulder", "elbow", "wrist"};
    const char *const links[LINKS] = {"base", "turret", "upper_arm", "forearm", "hand"};
    cbvh_robot_counts counts;
    cbvh_joint_limits limits[JOINTS];
    cbvh_joint_value values[2];
    cbvh_body bodies[LINKS], found;
    cbvh_body_pair pairs[10];
    char text[100];
    size_t count, length, places[2];
    OK(cbvh_robot_count(robot, &counts));
    CHECK(counts.joints == JOINTS && counts.links == LINKS && counts.groups == 2 && counts.states == 1);
    OK(cbvh_robot_name(robot, text, sizeof text, &length));
    CHECK(strcmp(text, "small_arm") == 0 && length == 9);
    OK(cbvh_robot_limits(robot, limits, JOINTS, &count));
    CHECK(count == JOINTS && limits[1].lower == -2 && limits[2].upper == 2.8);
    for (size_t k = 0; k < JOINTS; k++) {
        OK(cbvh_robot_joint_name(robot, k, text, sizeof text, &length));
        CHECK(strcmp(text, joints[k]) == 0);
    }
    OK(cbvh_robot_links(robot, bodies, LINKS, &count));
    CHECK(count == LINKS);
    for (size_t k = 0; k < LINKS; k++) {
        OK(cbvh_robot_body_name(robot, bodies[k], text, sizeof text, &length));
        CHECK(strcmp(text, links[k]) == 0);
        OK(cbvh_robot_find(robot, text, &found));
        CHECK(found.id == bodies[k].id);
    }
    char warning[2000];
    OK(cbvh_robot_warning(robot, 0, warning, sizeof warning, &length));
    CHECK(strstr(warning, "robot.srdf: line 9, <disable_collisions>: the robot has no link 'gripper'") != NULL);
    FAILS(cbvh_robot_warning(robot, 1, warning, sizeof warning, &length), CBVH_NOT_FOUND, "expected a warning");
    OK(cbvh_robot_group_name(robot, 0, text, sizeof text, &length));
    OK(cbvh_robot_group_joints(robot, 0, places, 2, &count));
    CHECK(strcmp(text, "upper") == 0 && count == 2 && places[0] == 0 && places[1] == 2);
    OK(cbvh_robot_state_name(robot, 0, text, sizeof text, &length));
    CHECK(strcmp(text, "bent") == 0);
    OK(cbvh_robot_state_group(robot, 0, text, sizeof text, &length));
    CHECK(strcmp(text, "upper") == 0);
    OK(cbvh_robot_state_values(robot, 0, values, 2, &count));
    CHECK(count == 1 && values[0].joint == 2 && values[0].value == 0.5);
    /* Ten pairs of links, and four that are adjacent. */
    OK(cbvh_robot_pairs(robot, pairs, 10, &count));
    CHECK(count == 6);
    FAILS(cbvh_robot_pairs(robot, pairs, 5, &count), CBVH_BUFFER_TOO_SMALL, "pairs: expected room for 6 elements");
    FAILS(cbvh_robot_joint_name(robot, 0, text, 3, &length), CBVH_BUFFER_TOO_SMALL, "buffer: expected room for 6");
    CHECK(strcmp(text, "wa") == 0 && length == 5);
    OK(cbvh_robot_free(robot));
    /* Bases that move have more joint values, which come first. Baked meshes are found again in the cache. */
    const size_t expected[3] = {JOINTS, JOINTS + 3, JOINTS + 7};
    char cache[1000];
    snprintf(cache, sizeof cache, "%s", in(scratch, "cache"));
    for (cbvh_robot_base base = CBVH_BASE_FIXED; base <= CBVH_BASE_FLOATING; base++) {
        const cbvh_robot_options options = {.size = sizeof options, .cache = cache, .base = base};
        cbvh_robot other;
        OK(cbvh_robot_from_urdf(urdf(), &options, &other));
        OK(cbvh_robot_count(other, &counts));
        CHECK(counts.joints == expected[base] && counts.states == 0);
        OK(cbvh_robot_joint_name(other, 0, text, sizeof text, &length));
        CHECK(strcmp(text, base == CBVH_BASE_FIXED ? "waist" : "base/x") == 0);
        OK(cbvh_robot_free(other));
    }
    /* There are no visual shapes. */
    const cbvh_robot_options visual = {.size = sizeof visual, .visual = 1};
    cbvh_robot other;
    cbvh_robot_distance_answer nearest;
    const double zeros[JOINTS] = {0};
    OK(cbvh_robot_from_urdf(urdf(), &visual, &other));
    OK(cbvh_robot_distances(other, zeros, JOINTS, 1, &nearest));
    CHECK(!nearest.found && isnan(nearest.nearest.distance) && nearest.pair.a.id == 0);
    cbvh_robot_signed_distance_answer number;
    OK(cbvh_robot_signed_distances(other, zeros, JOINTS, 1, NULL, &number));
    CHECK(!number.found && isnan(number.nearest.lower) && number.pair.a.id == 0 && !number.nearest.is_signed);
    OK(cbvh_robot_free(other));
}

/* A mesh of the arm, baked from its file. */
static cbvh_mesh baked(const char *name) {
    char from[1000], to[1000];
    snprintf(from, sizeof from, "%s/robot/%s.obj", testdata, name);
    snprintf(to, sizeof to, "%s/%s.cbvh", scratch, name);
    const char *const inputs[1] = {from};
    cbvh_mesh mesh;
    OK(cbvh_bake_files(inputs, 1, to, NULL, NULL));
    OK(cbvh_mesh_open(to, CBVH_READ, &mesh));
    return mesh;
}

/* All pairs, with a querier, where the links are. */
static void configurations(int32_t parallel) {
    const cbvh_robot robot = cell();
    enum { BODIES = LINKS + 3 };
    const char *const names[BODIES] = {"base", "turret", "upper_arm", "forearm", "hand", "pillar", "shelf", "tool"};
    cbvh_mesh meshes[BODIES];
    cbvh_pose own[BODIES], far_away;
    cbvh_body bodies[BODIES];
    cbvh_body_pair all[PAIRS];
    static double joints[ROWS * JOINTS];
    static cbvh_pose poses[ROWS * LINKS];
    static bool touching[ROWS];
    static cbvh_robot_distance_answer nearest[ROWS];
    static cbvh_robot_signed_distance_answer numbers[ROWS];
    static cbvh_body_pair contacts[ROWS * PAIRS];
    size_t counts[ROWS], count, pair_count, hits = 0, place = 0;
    cbvh_querier querier;
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));
    OK(cbvh_robot_set_parallel(robot, parallel));
    for (int k = 0; k < BODIES; k++) {
        OK(cbvh_robot_find(robot, names[k], &bodies[k]));
        OK(cbvh_robot_shape(robot, bodies[k], 0, &meshes[k], &own[k]));
        cbvh_mesh more;
        FAILS(cbvh_robot_shape(robot, bodies[k], 1, &more, &far_away), CBVH_NOT_FOUND, "expected a shape");
        CHECK(more.id == 0);
    }
    /* Two of them from their files. */
    OK(cbvh_mesh_free(meshes[0]));
    OK(cbvh_mesh_free(meshes[2]));
    meshes[0] = baked("base");
    meshes[2] = baked("link");
    CHECK(own[1].rows[11] == 0.07 && own[2].rows[11] == 0 && own[5].rows[3] == 0.45 && own[7].rows[11] == 0.2);
    random_joints(joints, ROWS);
    OK(cbvh_robot_pairs(robot, all, PAIRS, &count));
    CHECK(count == 6 + 10 + 3 + 2);
    OK(cbvh_robot_link_poses(robot, joints, JOINTS, ROWS, poses, ROWS * LINKS, &pair_count));
    CHECK(pair_count == ROWS * LINKS);
    OK(cbvh_robot_collide(robot, joints, JOINTS, ROWS, touching));
    OK(cbvh_robot_distances(robot, joints, JOINTS, ROWS, nearest));
    OK(cbvh_robot_signed_distances(robot, joints, JOINTS, ROWS, NULL, numbers));
    OK(cbvh_robot_pairs_in_contact(robot, joints, JOINTS, ROWS, counts, contacts, ROWS * PAIRS, &pair_count));
    for (size_t row = 0; row < ROWS; row++) {
        double least = INFINITY, deepest = INFINITY;
        const size_t first = place;
        bool is_named = false;
        for (size_t k = 0; k < count; k++) {
            cbvh_pose worlds[2], pose;
            cbvh_mesh pair[2];
            const cbvh_body both[2] = {all[k].a, all[k].b};
            for (int side = 0; side < 2; side++) {
                size_t body = 0;
                while (bodies[body].id != both[side].id) {
                    body++;
                }
                pair[side] = meshes[body];
                /* The tool is attached to the hand. */
                const size_t link = body == 7 ? 4 : body;
                worlds[side] = own[body];
                if (link < LINKS) {
                    OK(cbvh_pose_then(&own[body], &poses[row * LINKS + link], &worlds[side]));
                }
            }
            bool touches;
            cbvh_distance_answer distance;
            OK(cbvh_pose_relative(&worlds[0], &worlds[1], &pose));
            OK(cbvh_collide(querier, pair[0], pair[1], &pose, 1, &touches));
            OK(cbvh_distances(querier, pair[0], pair[1], &pose, 1, NULL, &distance));
            if (touches) {
                CHECK(contacts[place].a.id == both[0].id && contacts[place].b.id == both[1].id);
                place++;
            }
            least = fmin(least, distance.distance);
            cbvh_signed_distance number;
            OK(cbvh_signed_distances(querier, pair[0], pair[1], &pose, 1, NULL, &number));
            deepest = fmin(deepest, number.lower);
            is_named |= numbers[row].pair.a.id == both[0].id && numbers[row].pair.b.id == both[1].id &&
                        fabs(number.lower - numbers[row].nearest.lower) < 1e-9;
        }
        CHECK(place - first == counts[row] && touching[row] == (place > first));
        CHECK(nearest[row].found && fabs(nearest[row].nearest.distance - least) < 1e-12);
        const double *const a = nearest[row].nearest.point_a, *const b = nearest[row].nearest.point_b;
        const double way = sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
        CHECK(fabs(way - least) < 1e-9 && fabs(a[2]) < 2 && fabs(b[2]) < 2);
        hits += touching[row];
        /* The points are in the world, and as far apart along the normal as the number says. */
        const cbvh_signed_distance *const of = &numbers[row].nearest;
        double apart = 0, length = 0;
        for (int axis = 0; axis < 3; axis++) {
            apart += of->normal[axis] * (of->point_b[axis] - of->point_a[axis]);
            length += of->translation[axis] * of->translation[axis];
        }
        CHECK(numbers[row].found && is_named && of->is_signed && fabs(of->lower - deepest) < 1e-9);
        CHECK(fabs(apart - deepest) < 1e-9 + 0.02 * fabs(deepest) && fabs(of->point_a[2]) < 2);
        CHECK(fabs(sqrt(length) - fmax(0, -of->lower)) < 1e-12);
        cbvh_robot_signed_distance_answer alone;
        OK(cbvh_robot_signed_distances(robot, &joints[row * JOINTS], JOINTS, 1, NULL, &alone));
        CHECK(memcmp(&alone, &numbers[row], sizeof alone) == 0);
    }
    CHECK(place == pair_count && hits > 15 && hits < ROWS - 15);
    FAILS(cbvh_robot_pairs_in_contact(robot, joints, JOINTS, ROWS, NULL, NULL, 0, &count), CBVH_BUFFER_TOO_SMALL, "pairs");
    CHECK(count == pair_count);
    FAILS(cbvh_robot_link_poses(robot, joints, JOINTS, 2, poses, 9, &count), CBVH_BUFFER_TOO_SMALL, "poses: expected room");
    CHECK(count == 2 * LINKS);
    /* None at all. */
    OK(cbvh_robot_collide(robot, NULL, JOINTS, 0, NULL));
    OK(cbvh_robot_signed_distances(robot, NULL, JOINTS, 0, NULL, NULL));
    OK(cbvh_robot_link_poses(robot, NULL, JOINTS, 0, NULL, 0, &count));
    CHECK(count == 0);
    for (int k = 0; k < BODIES; k++) {
        OK(cbvh_mesh_free(meshes[k]));
    }
    OK(cbvh_querier_free(querier));
    OK(cbvh_robot_free(robot));
}

/* Pairs that are near: those of a querier, with derivatives that are those of differences. */
static void near_pairs(int32_t parallel) {
    enum { FEW = 60, MOST = FEW * PAIRS };
    const cbvh_robot robot = cell();
    const double margin = 0.1;
    static double joints[FEW * JOINTS], slopes[MOST * JOINTS], few_slopes[JOINTS];
    static cbvh_robot_near_pair pairs[MOST], others[MOST];
    static cbvh_robot_signed_distance_answer least[FEW];
    size_t counts[FEW], count, few, place = 0, compared = 0, overlapping = 0;
    OK(cbvh_robot_set_parallel(robot, parallel));
    /* Other tests have the configurations that they would have without this one. */
    const random_source before = source;
    random_joints(joints, FEW);
    source = before;
    OK(cbvh_robot_near_pairs(robot, joints, JOINTS, FEW, margin, NULL, counts, pairs, slopes, MOST, &count));
    OK(cbvh_robot_signed_distances(robot, joints, JOINTS, FEW, NULL, least));
    for (size_t row = 0; row < FEW; row++) {
        double lowest = INFINITY;
        for (size_t k = place; k < place + counts[row]; k++) {
            const cbvh_signed_distance *const of = &pairs[k].nearest;
            lowest = fmin(lowest, of->lower);
            CHECK(of->lower <= pairs[k].distance && pairs[k].distance <= of->upper && of->lower <= margin);
            overlapping += of->lower < 0;
        }
        /* The least one is among them, unless it is farther. */
        CHECK(counts[row] == 0 ? least[row].nearest.lower > margin : lowest == least[row].nearest.lower);
        /* One alone has the same answer. */
        OK(cbvh_robot_near_pairs(robot, &joints[row * JOINTS], JOINTS, 1, margin, NULL, NULL, others, NULL, MOST, &few));
        CHECK(few == counts[row] && memcmp(others, &pairs[place], few * sizeof *others) == 0);
        for (size_t number = 0; counts[row] > 0 && number < JOINTS; number++) {
            double ends[2], moved[JOINTS];
            for (int side = 0; side < 2; side++) {
                memcpy(moved, &joints[row * JOINTS], sizeof moved);
                moved[number] += side == 0 ? -1e-6 : 1e-6;
                OK(cbvh_robot_near_pairs(robot, moved, JOINTS, 1, 2 * margin, NULL, NULL, others, NULL, MOST, &few));
                size_t same = 0;
                while (others[same].pair.a.id != pairs[place].pair.a.id || others[same].pair.b.id != pairs[place].pair.b.id) {
                    same++;
                }
                ends[side] = others[same].distance;
            }
            /* Searches for depths may end elsewhere, and nearest points may jump. */
            if (pairs[place].distance > 1e-3 && fabs(ends[0] - 2 * pairs[place].distance + ends[1]) < 1e-10) {
                CHECK(fabs(slopes[place * JOINTS + number] - (ends[1] - ends[0]) / 2e-6) < 1e-6);
                compared++;
            }
        }
        place += counts[row];
    }
    CHECK(place == count && count > 30 && compared > 80 && overlapping > 5);
    /* Too little room: as much as there is of it is used. */
    others[0] = others[1] = pairs[2];
    FAILS(cbvh_robot_near_pairs(robot, joints, JOINTS, FEW, margin, NULL, NULL, others, few_slopes, 1, &few),
          CBVH_BUFFER_TOO_SMALL, "pairs: expected room for");
    CHECK(few == count && memcmp(&others[0], &pairs[0], sizeof *pairs) == 0 && memcmp(few_slopes, slopes, sizeof few_slopes) == 0);
    CHECK(memcmp(&others[1], &pairs[2], sizeof *pairs) == 0);
    /* None at all. */
    OK(cbvh_robot_near_pairs(robot, NULL, JOINTS, 0, margin, NULL, NULL, NULL, NULL, 0, &few));
    CHECK(few == 0);
    OK(cbvh_robot_free(robot));
}

/* Samples of motions, and motions on polynomials. */
static void motions(int32_t parallel) {
    enum { EDGES = 40, SAMPLES = 200 };
    const cbvh_robot robot = cell();
    static double starts[EDGES * JOINTS], ends[EDGES * JOINTS], lines[EDGES * JOINTS * 2], curves[EDGES * JOINTS * 3];
    static double samples[SAMPLES * JOINTS];
    static bool is_free[EDGES], same[EDGES], touching[SAMPLES];
    static cbvh_robot_motion_answer answers[EDGES], others[EDGES];
    OK(cbvh_robot_set_parallel(robot, parallel));
    random_joints(starts, EDGES);
    random_joints(ends, EDGES);
    for (size_t k = 0; k < EDGES * JOINTS; k++) {
        ends[k] = starts[k] + (k < EDGES * JOINTS / 2 ? 1 : 0.1) * (ends[k] - starts[k]);
        lines[2 * k] = curves[3 * k] = starts[k];
        lines[2 * k + 1] = curves[3 * k + 2] = ends[k] - starts[k];
    }
    OK(cbvh_robot_edges_are_free(robot, starts, ends, JOINTS, EDGES, NULL, is_free));
    OK(cbvh_robot_edge_motions(robot, starts, ends, JOINTS, EDGES, NULL, answers));
    size_t free_count = 0;
    for (size_t edge = 0; edge < EDGES; edge++) {
        const cbvh_robot_motion_answer *const answer = &answers[edge];
        CHECK(is_free[edge] == (answer->outcome == CBVH_FREE) && answer->free_until >= 0 && answer->free_until <= 1);
        for (size_t k = 0; k < SAMPLES; k++) {
            for (size_t joint = 0; joint < JOINTS; joint++) {
                const size_t number = edge * JOINTS + joint;
                const double t = answer->free_until * (double)k / SAMPLES;
                samples[k * JOINTS + joint] = starts[number] + t * (ends[number] - starts[number]);
            }
        }
        OK(cbvh_robot_collide(robot, samples, JOINTS, SAMPLES, touching));
        for (size_t k = 0; k < SAMPLES && answer->free_until > 0; k++) {
            CHECK(!touching[k]);
        }
        if (is_free[edge]) {
            CHECK(answer->free_until == 1 && isnan(answer->at) && answer->pair.a.id == 0);
            CHECK(isnan(answer->nearest.distance));
            free_count++;
        } else {
            cbvh_body_pair pairs[PAIRS];
            size_t count, found = 0;
            CHECK(answer->outcome == CBVH_HIT && answer->at >= answer->free_until);
            for (size_t joint = 0; joint < JOINTS; joint++) {
                const size_t number = edge * JOINTS + joint;
                samples[joint] = starts[number] + answer->at * (ends[number] - starts[number]);
            }
            OK(cbvh_robot_pairs_in_contact(robot, samples, JOINTS, 1, NULL, pairs, PAIRS, &count));
            for (size_t k = 0; k < count; k++) {
                found += pairs[k].a.id == answer->pair.a.id && pairs[k].b.id == answer->pair.b.id;
            }
            CHECK(found == 1 && answer->nearest.distance == 0);
            CHECK(fabs(answer->nearest.point_a[0] - answer->nearest.point_b[0]) < 1e-9);
        }
    }
    CHECK(free_count > 5 && free_count < EDGES - 5);
    OK(cbvh_robot_are_free(robot, lines, 2, JOINTS, EDGES, NULL, same));
    CHECK(memcmp(same, is_free, sizeof same) == 0);
    OK(cbvh_robot_motions(robot, lines, 2, JOINTS, EDGES, NULL, others));
    CHECK(memcmp(others, answers, sizeof others) == 0);
    /* The same way at another pace. */
    OK(cbvh_robot_are_free(robot, curves, 3, JOINTS, EDGES, NULL, same));
    CHECK(memcmp(same, is_free, sizeof same) == 0);
    OK(cbvh_robot_motions(robot, curves, 3, JOINTS, EDGES, NULL, others));
    for (size_t edge = 0; edge < EDGES; edge++) {
        CHECK(is_free[edge] || fabs(others[edge].at * others[edge].at - answers[edge].at) < 1e-3);
    }
    /* A clearance as wide as the room. */
    const cbvh_motion_options wide = {.size = sizeof wide, .clearance = 10};
    OK(cbvh_robot_edges_are_free(robot, starts, ends, JOINTS, EDGES, &wide, same));
    for (size_t edge = 0; edge < EDGES; edge++) {
        CHECK(!same[edge]);
    }
    OK(cbvh_robot_free(robot));
}

/* What is added, moved, allowed and removed. */
static void changes(void) {
    const cbvh_robot robot = arm();
    cbvh_robot other;
    cbvh_body one, two, found;
    cbvh_robot_distance_answer nearest;
    const double zeros[JOINTS] = {0};
    const cbvh_mesh cube_mesh = block(0.1, 0.1, 0.1);
    const cbvh_pose place = shift(0.5, 0, 0.6), farther = shift(0.75, 0, 0.6);
    char text[100];
    size_t length, count;
    bool touching;
    OK(cbvh_robot_distances(robot, zeros, JOINTS, 1, &nearest));
    const double before = nearest.nearest.distance;
    OK(cbvh_robot_add_obstacle(robot, "one", cube_mesh, &place, &one));
    OK(cbvh_robot_clone(robot, &other));
    /* Only the obstacle counts. */
    const char *const links[LINKS] = {"base", "turret", "upper_arm", "forearm", "hand"};
    for (int a = 0; a < LINKS; a++) {
        for (int b = 0; b < a; b++) {
            OK(cbvh_robot_set_allowed(robot, links[a], links[b], 1));
        }
    }
    FAILS(cbvh_robot_pairs(robot, NULL, 0, &count), CBVH_BUFFER_TOO_SMALL, "pairs: expected room for 5 elements");
    CHECK(count == LINKS);
    OK(cbvh_robot_distances(robot, zeros, JOINTS, 1, &nearest));
    const double near = nearest.nearest.distance;
    CHECK(nearest.pair.b.id == one.id && near > 0.2 && near < 0.5);
    OK(cbvh_robot_set_pose(robot, "one", &farther));
    OK(cbvh_robot_distances(robot, zeros, JOINTS, 1, &nearest));
    const double far = nearest.nearest.distance;
    CHECK(far > near + 0.2 && far < near + 0.25 + 1e-9);
    OK(cbvh_robot_set_margin(robot, "one", 0.125));
    OK(cbvh_robot_set_margin(robot, "upper_arm", 0.125));
    OK(cbvh_robot_distances(robot, zeros, JOINTS, 1, &nearest));
    CHECK(nearest.nearest.distance < far - 0.125 + 1e-9 && nearest.nearest.distance > far - 0.25 - 1e-9);
    OK(cbvh_robot_set_margin(robot, "one", 1));
    OK(cbvh_robot_collide(robot, zeros, JOINTS, 1, &touching));
    CHECK(touching);
    for (int k = 0; k < LINKS; k++) {
        OK(cbvh_robot_set_allowed(robot, "one", links[k], 1));
    }
    OK(cbvh_robot_collide(robot, zeros, JOINTS, 1, &touching));
    CHECK(!touching);
    OK(cbvh_robot_set_allowed(robot, "hand", "one", 0));
    OK(cbvh_robot_collide(robot, zeros, JOINTS, 1, &touching));
    CHECK(touching);
    OK(cbvh_robot_remove(robot, "one"));
    OK(cbvh_robot_collide(robot, zeros, JOINTS, 1, &touching));
    CHECK(!touching);
    FAILS(cbvh_robot_body_name(robot, one, text, sizeof text, &length), CBVH_NOT_FOUND, "expected a body of the robot");
    FAILS(cbvh_robot_find(robot, "one", &found), CBVH_NOT_FOUND, "found 'one'");
    /* The number is not given again, and the copy has not changed. */
    OK(cbvh_robot_add_obstacle(robot, "one", cube_mesh, &place, &two));
    CHECK(two.id != one.id);
    OK(cbvh_robot_body_name(other, one, text, sizeof text, &length));
    OK(cbvh_robot_distances(other, zeros, JOINTS, 1, &nearest));
    CHECK(strcmp(text, "one") == 0 && nearest.nearest.distance == fmin(before, near));
    OK(cbvh_robot_free(other));
    OK(cbvh_mesh_free(cube_mesh));
    OK(cbvh_robot_free(robot));
    /* Pairs that touch in most configurations: those of links that a joint connects. */
    cbvh_robot plain;
    cbvh_frequent_pair frequent[10];
    size_t after;
    OK(cbvh_robot_from_urdf(urdf(), NULL, &plain));
    FAILS(cbvh_robot_allow_frequent(plain, 200, 0.9, NULL, 0, &count), CBVH_BUFFER_TOO_SMALL, "pairs: expected room for");
    /* Of these, the hand begins where the forearm ends. */
    CHECK(count == 3);
    (void)cbvh_robot_pairs(plain, NULL, 0, &after);
    CHECK(after == 10);
    OK(cbvh_robot_allow_frequent(plain, 200, 0.9, frequent, 10, &count));
    (void)cbvh_robot_pairs(plain, NULL, 0, &after);
    CHECK(after == 10 - count && frequent[0].share >= 0.9 && frequent[0].share <= 1);
    OK(cbvh_robot_free(plain));
}

/* A robot in a room is told apart from a free one, and collides with the room if that is solid. */
static void insides(int32_t parallel) {
    const cbvh_robot robot = arm();
    const char *const links[LINKS] = {"base", "turret", "upper_arm", "forearm", "hand"};
    const cbvh_mesh room = cube(9), pea = cube(0.002);
    const cbvh_pose here = CBVH_IDENTITY, there = shift(30, 0, 0);
    cbvh_body outer, inner, bodies[LINKS];
    cbvh_body_pair pairs[3 * LINKS];
    double joints[3 * JOINTS] = {0};
    size_t count, counts[3];
    bool touching[3], is_free[3];
    OK(cbvh_robot_set_parallel(robot, parallel));
    OK(cbvh_robot_links(robot, bodies, LINKS, &count));
    OK(cbvh_robot_pairs_inside(robot, joints, JOINTS, 3, counts, NULL, 0, &count));
    CHECK(count == 0 && counts[0] == 0 && counts[2] == 0);
    OK(cbvh_robot_add_obstacle(robot, "room", room, &here, &outer));
    OK(cbvh_robot_collide(robot, joints, JOINTS, 3, touching));
    OK(cbvh_robot_edges_are_free(robot, joints, joints, JOINTS, 3, NULL, is_free));
    CHECK(!touching[0] && is_free[0] && !touching[2] && is_free[2]);
    OK(cbvh_robot_pairs_inside(robot, joints, JOINTS, 3, counts, pairs, 3 * LINKS, &count));
    CHECK(count == 3 * LINKS && counts[1] == LINKS);
    for (size_t k = 0; k < count; k++) {
        CHECK(pairs[k].a.id == bodies[k % LINKS].id && pairs[k].b.id == outer.id);
    }
    FAILS(cbvh_robot_pairs_inside(robot, joints, JOINTS, 1, NULL, pairs, 2, &count), CBVH_BUFFER_TOO_SMALL, "pairs: expected room");
    CHECK(count == LINKS);
    OK(cbvh_robot_set_pose(robot, "room", &there));
    OK(cbvh_robot_pairs_inside(robot, joints, JOINTS, 1, NULL, pairs, 2, &count));
    CHECK(count == 0);
    OK(cbvh_robot_set_pose(robot, "room", &here));
    OK(cbvh_robot_make_solid(robot, "room"));
    OK(cbvh_robot_collide(robot, joints, JOINTS, 3, touching));
    OK(cbvh_robot_pairs_inside(robot, joints, JOINTS, 3, NULL, NULL, 0, &count));
    CHECK(touching[0] && touching[2] && count == 0);
    OK(cbvh_robot_remove(robot, "room"));
    /* What is inside a link. */
    const cbvh_pose in_link = shift(0, 0, 0.4);
    OK(cbvh_robot_add_obstacle(robot, "pea", pea, &in_link, &inner));
    OK(cbvh_robot_pairs_inside(robot, joints, JOINTS, 1, NULL, pairs, 2, &count));
    CHECK(count == 1 && pairs[0].a.id == inner.id && pairs[0].b.id == bodies[2].id);
    OK(cbvh_robot_make_solid(robot, "upper_arm"));
    OK(cbvh_robot_collide(robot, joints, JOINTS, 1, touching));
    CHECK(touching[0]);
    FAILS(cbvh_robot_make_solid(robot, "nothing"), CBVH_NOT_FOUND, "found 'nothing'");
    FAILS(cbvh_robot_make_solid(robot, NULL), CBVH_INVALID_ARGUMENT, "name: ");
    OK(cbvh_robot_remove(robot, "pea"));
    const double corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const uint32_t face[3] = {0, 1, 2};
    cbvh_mesh sheet;
    OK(cbvh_bake(corners, 3, face, 1, NULL, &sheet));
    OK(cbvh_robot_add_obstacle(robot, "sheet", sheet, &there, NULL));
    FAILS(cbvh_robot_make_solid(robot, "sheet"), CBVH_INVALID_ARGUMENT, "sheet: expected closed objects");
    OK(cbvh_robot_remove(robot, "sheet"));
    OK(cbvh_mesh_free(sheet));
    OK(cbvh_mesh_free(room));
    OK(cbvh_mesh_free(pea));
    /* The margin of a link is not that of what it carries. */
    const cbvh_mesh tool = block(0.02, 0.02, 0.2), lamp = block(0.1, 0.1, 0.1);
    const cbvh_pose in_hand = shift(0, 0, 0.2);
    cbvh_robot_distance_answer near;
    OK(cbvh_robot_attach(robot, "tool", tool, "hand", &in_hand, links, LINKS, NULL));
    for (int a = 0; a < LINKS; a++) {
        for (int b = 0; b < a; b++) {
            OK(cbvh_robot_set_allowed(robot, links[a], links[b], 1));
        }
    }
    add(robot, "lamp", lamp, 0, 0, 1.5);
    OK(cbvh_robot_distances(robot, joints, JOINTS, 1, &near));
    const double gap = near.nearest.distance;
    CHECK(gap > 0.1);
    OK(cbvh_robot_set_margin(robot, "hand", 0.01));
    OK(cbvh_robot_distances(robot, joints, JOINTS, 1, &near));
    CHECK(near.nearest.distance == gap);
    OK(cbvh_robot_set_margin(robot, "tool", 0.01));
    OK(cbvh_robot_distances(robot, joints, JOINTS, 1, &near));
    CHECK(fabs(near.nearest.distance - (gap - 0.01)) < 1e-12);
    OK(cbvh_mesh_free(tool));
    OK(cbvh_mesh_free(lamp));
    OK(cbvh_robot_free(robot));
}

/* A continuous joint goes the short way to the end that is nearest, and a joint with limits stays. */
static void turns(void) {
    char path[1000];
    snprintf(path, sizeof path, "%s", in(scratch, "turning.urdf"));
    write_file(path, "<robot name=\"r\"><link name=\"root\"/><link name=\"arm\"><collision><origin xyz=\"1 0 0\"/>"
        "<geometry><sphere radius=\"0.1\"/></geometry></collision></link><link name=\"b\"/>"
        "<joint name=\"turn\" type=\"continuous\"><parent link=\"root\"/><child link=\"arm\"/><axis xyz=\"0 0 1\"/></joint>"
        "<joint name=\"limited\" type=\"revolute\"><parent link=\"root\"/><child link=\"b\"/>"
        "<limit lower=\"-6.3\" upper=\"6.3\" effort=\"1\" velocity=\"1\"/></joint></robot>");
    cbvh_robot robot;
    OK(cbvh_robot_from_urdf(path, NULL, &robot));
    const cbvh_mesh ball = block(0.3, 0.3, 0.3);
    add(robot, "ball", ball, 1, 0, 0);
    const double starts[4] = {3, 3, 1, 1}, ends[4] = {-3, -3, 1.5, -5};
    double nearest[4];
    bool is_free[2];
    OK(cbvh_robot_nearest_turns(robot, starts, ends, 2, 2, nearest));
    CHECK(fabs(nearest[0] - 3.2831853) < 1e-6 && nearest[1] == -3 && nearest[2] == 1.5 && nearest[3] == -5);
    OK(cbvh_robot_edges_are_free(robot, starts, ends, 2, 1, NULL, is_free));
    OK(cbvh_robot_edges_are_free(robot, starts, nearest, 2, 1, NULL, is_free + 1));
    CHECK(!is_free[0] && is_free[1]);
    /* In place, and none at all. */
    double same[4] = {-3, -3, 1.5, -5};
    OK(cbvh_robot_nearest_turns(robot, starts, same, 2, 2, same));
    CHECK(memcmp(same, nearest, sizeof same) == 0);
    OK(cbvh_robot_nearest_turns(robot, NULL, NULL, 2, 0, NULL));
    FAILS(cbvh_robot_nearest_turns(robot, starts, ends, 2, 2, NULL), CBVH_INVALID_ARGUMENT, "nearest: expected a pointer");
    FAILS(cbvh_robot_nearest_turns(robot, NULL, ends, 2, 2, nearest), CBVH_INVALID_ARGUMENT, "starts: expected a pointer");
    FAILS(cbvh_robot_nearest_turns(robot, starts, ends, 3, 1, nearest), CBVH_INVALID_ARGUMENT, "joint_count: expected 2");
    same[2] = NAN;
    FAILS(cbvh_robot_nearest_turns(robot, starts, same, 2, 2, nearest), CBVH_INVALID_ARGUMENT, "ends[1]: joint turn: expected a finite");
    same[2] = 2e9;
    FAILS(cbvh_robot_nearest_turns(robot, starts, same, 2, 2, nearest), CBVH_INVALID_ARGUMENT, "ends[1]: joint turn: expected an angle within");
    OK(cbvh_mesh_free(ball));
    OK(cbvh_robot_free(robot));
}

/* Bytes of the caller are released when no robot uses them any more. */
static void release(void *user) { ++*(int *)user; }

static void lets_go(void) {
    const cbvh_robot robot = arm();
    const cbvh_pose here = shift(1, 1, 1);
    const double zeros[JOINTS] = {0};
    cbvh_mesh mesh = cube(0.1), borrowed;
    size_t size;
    int released = 0;
    bool touching;
    (void)cbvh_mesh_bytes(mesh, NULL, 0, &size);
    void *const bytes = malloc(size);
    CHECK(bytes != NULL);
    OK(cbvh_mesh_bytes(mesh, bytes, size, &size));
    OK(cbvh_mesh_borrow_bytes(bytes, size, release, &released, &borrowed));
    OK(cbvh_robot_add_obstacle(robot, "borrowed", borrowed, &here, NULL));
    OK(cbvh_mesh_free(borrowed));
    OK(cbvh_robot_collide(robot, zeros, JOINTS, 1, &touching));
    CHECK(released == 0);
    OK(cbvh_robot_remove(robot, "borrowed"));
    CHECK(released == 1);
    free(bytes);
    OK(cbvh_mesh_free(mesh));
    OK(cbvh_robot_free(robot));
}

static void misuse(void) {
    const cbvh_robot robot = cell(), none = {0};
    const cbvh_mesh mesh = cube(0.1), no_mesh = {0};
    const cbvh_robot a_mesh = {mesh.id};
    static double room[200];
    double joints[3 * JOINTS] = {0};
    bool answers[3];
    size_t count, counts[3];
    cbvh_robot made = {7};
    cbvh_body body = {7};
    cbvh_body_pair pairs[9];
    cbvh_pose pose = CBVH_IDENTITY;
    cbvh_robot_distance_answer nearest[3];
    cbvh_robot_signed_distance_answer numbers[3];
    static cbvh_robot_near_pair near[9];
    cbvh_robot_motion_answer motion[3];
    cbvh_robot_counts sizes;
    cbvh_frequent_pair pairs_of_many[1];
    cbvh_mesh shape;
    char text[10];
    /* Files and options. */
    FAILS(cbvh_robot_from_urdf("/no such folder/x.urdf", NULL, &made), CBVH_SYSTEM, "x.urdf");
    CHECK(made.id == 0);
    FAILS(cbvh_robot_from_urdf(NULL, NULL, &made), CBVH_INVALID_ARGUMENT, "path: expected a pointer, found NULL");
    FAILS(cbvh_robot_from_urdf(urdf(), NULL, NULL), CBVH_INVALID_ARGUMENT, "robot: expected a pointer, found NULL");
    FAILS(cbvh_robot_from_urdf(testdata, NULL, &made), CBVH_SYSTEM, "");
    FAILS(cbvh_robot_from_urdf(in(testdata, "robot/base.obj"), NULL, &made), CBVH_INVALID_ARGUMENT, "expected the element <robot>");
    CHECK(mkfifo(in(scratch, "pipe"), 0600) == 0);
    FAILS(cbvh_robot_from_urdf(in(scratch, "pipe"), NULL, &made), CBVH_SYSTEM, "pipe: expected a regular file");
    char pipe[1000];
    snprintf(pipe, sizeof pipe, "%s", in(scratch, "pipe"));
    const cbvh_robot_options from_pipe = {.size = sizeof from_pipe, .srdf = pipe};
    FAILS(cbvh_robot_from_urdf(urdf(), &from_pipe, &made), CBVH_SYSTEM, "pipe: expected a regular file");
    write_file(in(scratch, "away.urdf"), "<robot name=\"r\"><link name=\"a\"><collision><geometry>"
        "<mesh filename=\"package://p/x.stl\"/></geometry></collision></link></robot>");
    FAILS(cbvh_robot_from_urdf(in(scratch, "away.urdf"), NULL, &made), CBVH_SYSTEM,
          "link a: expected the mesh package://p/x.stl, found none at");
    /* A mesh of another folder. */
    char outside[2200], folder[1000] = "";
    CHECK(*testdata == '/' || getcwd(folder, sizeof folder) != NULL);
    snprintf(outside, sizeof outside, "<robot name=\"r\"><link name=\"a\"><collision><geometry><mesh filename=\"%s/%s\"/>"
        "</geometry></collision></link></robot>", folder, in(testdata, "robot/base.obj"));
    write_file(in(scratch, "outside.urdf"), outside);
    FAILS(cbvh_robot_from_urdf(in(scratch, "outside.urdf"), NULL, &made), CBVH_INVALID_ARGUMENT, "or set allow_outside");
    const cbvh_robot_options anywhere = {.size = sizeof anywhere, .allow_outside = 1};
    OK(cbvh_robot_from_urdf(in(scratch, "outside.urdf"), &anywhere, &made));
    OK(cbvh_robot_free(made));
    const char *const folders[2] = {testdata, NULL};
    const cbvh_robot_options options[] = {
        {.size = 8},
        {.size = sizeof made, .base = 1},
        {.size = sizeof *options, .base = 3},
        {.size = sizeof *options, .visual = 2},
        {.size = sizeof *options, .allow_outside = 2},
        {.size = sizeof *options, .apply_up_axis = 2},
        {.size = sizeof *options, .cylinder_error = -1},
        {.size = sizeof *options, .cylinder_error = NAN},
        {.size = sizeof *options, .package_count = 1},
        {.size = sizeof *options, .packages = folders, .package_count = 2},
    };
    const char *const messages[] = {"options.size: expected 64", "options.size", "options.base: expected a number of",
        "options.visual: expected 0 or 1", "options.allow_outside: expected 0 or 1", "options.apply_up_axis: expected 0 or 1",
        "options.cylinder_error: expected 0 or", "options.cylinder_error",
        "options.packages: expected a pointer, found NULL", "options.packages[1]: expected a pointer, found NULL"};
    for (size_t k = 0; k < sizeof options / sizeof *options; k++) {
        FAILS(cbvh_robot_from_urdf(urdf(), &options[k], &made), CBVH_INVALID_ARGUMENT, messages[k]);
    }
    const cbvh_robot_options no_srdf = {.size = sizeof no_srdf, .srdf = "/no such folder/x.srdf"};
    FAILS(cbvh_robot_from_urdf(urdf(), &no_srdf, &made), CBVH_SYSTEM, "x.srdf");
    /* Handles. */
    FAILS(cbvh_robot_collide(none, joints, JOINTS, 1, answers), CBVH_INVALID_HANDLE,
          "robot: expected the handle of an open robot, found 0, no handle");
    FAILS(cbvh_robot_collide(a_mesh, joints, JOINTS, 1, answers), CBVH_INVALID_HANDLE, "found the handle of a mesh");
    FAILS(cbvh_robot_clone(none, &made), CBVH_INVALID_HANDLE, "robot: ");
    FAILS(cbvh_robot_set_parallel(none, 1), CBVH_INVALID_HANDLE, "robot: ");
    FAILS(cbvh_robot_set_parallel(robot, 2), CBVH_INVALID_ARGUMENT, "parallel: expected 0 or 1");
    FAILS(cbvh_robot_count(robot, NULL), CBVH_INVALID_ARGUMENT, "counts: ");
    FAILS(cbvh_robot_count(none, &sizes), CBVH_INVALID_HANDLE, "robot: ");
    FAILS(cbvh_robot_add_obstacle(none, "x", mesh, &pose, &body), CBVH_INVALID_HANDLE, "robot: ");
    FAILS(cbvh_robot_add_obstacle(robot, "x", no_mesh, &pose, &body), CBVH_INVALID_HANDLE, "mesh: ");
    CHECK(body.id == 0);
    OK(cbvh_robot_free(none));
    OK(cbvh_robot_clone(robot, &made));
    OK(cbvh_robot_free(made));
    FAILS(cbvh_robot_free(made), CBVH_INVALID_HANDLE, "one of a robot that was freed");
    /* Numbers and names that there are not. */
    FAILS(cbvh_robot_joint_name(robot, 4, text, 10, &count), CBVH_NOT_FOUND, "expected a joint value of the robot, found the number 4");
    FAILS(cbvh_robot_group_name(robot, 2, text, 10, &count), CBVH_NOT_FOUND, "expected a group");
    FAILS(cbvh_robot_group_joints(robot, SIZE_MAX, NULL, 0, &count), CBVH_NOT_FOUND, "expected a group");
    FAILS(cbvh_robot_state_values(robot, 1, NULL, 0, &count), CBVH_NOT_FOUND, "expected a state");
    const cbvh_body no_body = {0}, foreign = {UINT64_MAX};
    FAILS(cbvh_robot_body_name(robot, no_body, text, 10, &count), CBVH_NOT_FOUND, "expected a body");
    FAILS(cbvh_robot_shape(robot, foreign, 0, &shape, &pose), CBVH_NOT_FOUND, "expected a body");
    FAILS(cbvh_robot_find(robot, "nothing", &body), CBVH_NOT_FOUND,
          "expected the name of a body, found 'nothing'; there are base, turret");
    FAILS(cbvh_robot_find(robot, NULL, &body), CBVH_INVALID_ARGUMENT, "name: expected a pointer, found NULL");
    FAILS(cbvh_robot_find(robot, "\xff", &body), CBVH_INVALID_ARGUMENT, "name: expected text in UTF-8");
    FAILS(cbvh_robot_remove(robot, "base"), CBVH_NOT_FOUND, "expected the name of an obstacle or attached object");
    FAILS(cbvh_robot_remove(robot, "nothing"), CBVH_NOT_FOUND, "found 'nothing'");
    FAILS(cbvh_robot_set_pose(robot, "base", &pose), CBVH_NOT_FOUND, "found 'base'");
    FAILS(cbvh_robot_set_allowed(robot, "base", "nothing", 1), CBVH_NOT_FOUND, "found 'nothing'");
    FAILS(cbvh_robot_set_allowed(robot, "base", "hand", 2), CBVH_INVALID_ARGUMENT, "allowed: expected 0 or 1");
    FAILS(cbvh_robot_attach(robot, "x", mesh, "nothing", &pose, NULL, 0, NULL), CBVH_NOT_FOUND,
          "expected the name of a link, found 'nothing'");
    FAILS(cbvh_robot_attach(robot, "x", mesh, NULL, &pose, NULL, 0, NULL), CBVH_INVALID_ARGUMENT, "link: ");
    FAILS(cbvh_robot_attach(robot, "x", mesh, "hand", &pose, NULL, 1, NULL), CBVH_INVALID_ARGUMENT, "may_touch: ");
    FAILS(cbvh_robot_attach(robot, "x", mesh, "hand", &pose, folders + 1, 1, NULL), CBVH_INVALID_ARGUMENT, "may_touch[0]: ");
    FAILS(cbvh_robot_add_obstacle(robot, "pillar", mesh, &pose, NULL), CBVH_INVALID_ARGUMENT, "found 'pillar'");
    FAILS(cbvh_robot_add_obstacle(robot, "x", mesh, NULL, NULL), CBVH_INVALID_ARGUMENT, "pose: expected a pointer");
    pose.rows[0] = 2;
    FAILS(cbvh_robot_add_obstacle(robot, "x", mesh, &pose, NULL), CBVH_INVALID_ARGUMENT, "pose: ");
    FAILS(cbvh_robot_set_pose(robot, "pillar", &pose), CBVH_INVALID_ARGUMENT, "pose: ");
    const double margins[] = {NAN, -1, INFINITY};
    for (size_t k = 0; k < 3; k++) {
        FAILS(cbvh_robot_set_margin(robot, "pillar", margins[k]), CBVH_INVALID_ARGUMENT, "margin: expected a finite distance of at least 0");
    }
    /* Configurations. */
    FAILS(cbvh_robot_collide(robot, joints, 3, 1, answers), CBVH_INVALID_ARGUMENT,
          "joint_count: expected 4, as many as the robot has joint values, found 3");
    FAILS(cbvh_robot_collide(robot, NULL, JOINTS, 1, answers), CBVH_INVALID_ARGUMENT, "joints: expected a pointer");
    FAILS(cbvh_robot_collide(robot, joints, JOINTS, 1, NULL), CBVH_INVALID_ARGUMENT, "answers: expected a pointer");
    FAILS(cbvh_robot_collide(robot, joints, JOINTS, SIZE_MAX, answers), CBVH_INVALID_ARGUMENT, "joints: expected at most");
    FAILS(cbvh_robot_collide(robot, (double *)(void *)((char *)room + 1), JOINTS, 1, answers), CBVH_INVALID_ARGUMENT,
          "joints: expected an address");
    for (int32_t parallel = 0; parallel < 2; parallel++) {
        OK(cbvh_robot_set_parallel(robot, parallel));
        joints[2 * JOINTS + 1] = NAN;
        const char *const message = "joints[2]: joint shoulder: expected a finite value, found NaN";
        FAILS(cbvh_robot_collide(robot, joints, JOINTS, 3, answers), CBVH_INVALID_ARGUMENT, message);
        FAILS(cbvh_robot_distances(robot, joints, JOINTS, 3, nearest), CBVH_INVALID_ARGUMENT, message);
        FAILS(cbvh_robot_signed_distances(robot, joints, JOINTS, 3, NULL, numbers), CBVH_INVALID_ARGUMENT, message);
        FAILS(cbvh_robot_pairs_in_contact(robot, joints, JOINTS, 3, counts, pairs, 9, &count), CBVH_INVALID_ARGUMENT, message);
        FAILS(cbvh_robot_near_pairs(robot, joints, JOINTS, 3, 1, NULL, counts, near, room, 9, &count), CBVH_INVALID_ARGUMENT,
              message);
        FAILS(cbvh_robot_link_poses(robot, joints, JOINTS, 3, NULL, 0, &count), CBVH_INVALID_ARGUMENT, message);
        joints[2 * JOINTS + 1] = 0;
        room[2 * JOINTS] = INFINITY;
        FAILS(cbvh_robot_edges_are_free(robot, joints, room, JOINTS, 3, NULL, answers), CBVH_INVALID_ARGUMENT,
              "ends[2]: joint waist: expected a finite value, found inf");
        FAILS(cbvh_robot_edge_motions(robot, room, joints, JOINTS, 3, NULL, motion), CBVH_INVALID_ARGUMENT, "starts[2]: ");
        FAILS(cbvh_robot_are_free(robot, room, 2, JOINTS, 2, NULL, answers), CBVH_INVALID_ARGUMENT, "coefficients[1]: joint waist");
        room[2 * JOINTS] = 0;
        const cbvh_motion_options bad = {.size = sizeof bad, .clearance = -1}, small = {.size = 12};
        FAILS(cbvh_robot_edges_are_free(robot, joints, joints, JOINTS, 3, &bad, answers), CBVH_INVALID_ARGUMENT, "clearance");
        FAILS(cbvh_robot_edge_motions(robot, joints, joints, JOINTS, 3, &small, motion), CBVH_INVALID_ARGUMENT,
              "options.size: expected 24");
        for (size_t k = 0; k < 3; k++) {
            const cbvh_penetration_options gap = {.size = sizeof gap, .relative_gap = margins[k]},
                                           tolerance = {.size = sizeof tolerance, .tolerance = margins[k]};
            /* Also where no configuration is asked about. */
            FAILS(cbvh_robot_signed_distances(robot, joints, JOINTS, k, &gap, numbers), CBVH_INVALID_ARGUMENT,
                  "relative_gap: expected");
            FAILS(cbvh_robot_signed_distances(robot, joints, JOINTS, 3, &tolerance, numbers), CBVH_INVALID_ARGUMENT,
                  "tolerance: expected");
            FAILS(cbvh_robot_near_pairs(robot, joints, JOINTS, k, margins[k], NULL, counts, near, room, 9, &count),
                  CBVH_INVALID_ARGUMENT, "margin: expected a finite distance of at least 0");
            FAILS(cbvh_robot_near_pairs(robot, joints, JOINTS, 3, 1, &gap, counts, near, room, 9, &count),
                  CBVH_INVALID_ARGUMENT, "relative_gap: expected");
        }
        FAILS(cbvh_robot_near_pairs(none, joints, JOINTS, 3, 1, NULL, counts, near, room, 9, &count), CBVH_INVALID_HANDLE,
              "robot: ");
        FAILS(cbvh_robot_near_pairs(robot, joints, JOINTS, 3, 1, NULL, counts, NULL, room, 9, &count), CBVH_INVALID_ARGUMENT,
              "pairs: expected a pointer");
        FAILS(cbvh_robot_near_pairs(robot, joints, JOINTS, 3, 1, NULL, counts, near, room, 9, NULL), CBVH_INVALID_ARGUMENT,
              "count: expected a pointer");
        FAILS(cbvh_robot_near_pairs(robot, joints, JOINTS, 3, 1, NULL, counts, near, (double *)(void *)((char *)room + 1), 9,
                                    &count),
              CBVH_INVALID_ARGUMENT, "gradients: expected an address");
        FAILS(cbvh_robot_near_pairs(robot, joints, JOINTS, 3, 1, NULL, counts, near, room, SIZE_MAX, &count),
              CBVH_INVALID_ARGUMENT, "expected at most");
        const cbvh_penetration_options cut = {.size = 12};
        FAILS(cbvh_robot_signed_distances(robot, joints, JOINTS, 3, &cut, numbers), CBVH_INVALID_ARGUMENT,
              "options.size: expected 24");
        FAILS(cbvh_robot_signed_distances(robot, joints, JOINTS, 3, NULL, NULL), CBVH_INVALID_ARGUMENT, "answers: ");
        FAILS(cbvh_robot_signed_distances(none, joints, JOINTS, 3, NULL, numbers), CBVH_INVALID_HANDLE, "robot: ");
    }
    FAILS(cbvh_robot_edges_are_free(robot, joints, NULL, JOINTS, 1, NULL, answers), CBVH_INVALID_ARGUMENT, "ends: ");
    FAILS(cbvh_robot_edges_are_free(robot, joints, joints, 5, 1, NULL, answers), CBVH_INVALID_ARGUMENT, "joint_count: ");
    FAILS(cbvh_robot_motions(robot, joints, 0, JOINTS, 1, NULL, motion), CBVH_INVALID_ARGUMENT,
          "coefficient_count: expected at least 1, found 0");
    FAILS(cbvh_robot_motions(robot, joints, SIZE_MAX / 2, JOINTS, 1, NULL, motion), CBVH_INVALID_ARGUMENT,
          "coefficients: expected at most");
    FAILS(cbvh_robot_motions(robot, joints, 1, JOINTS, 1, NULL, NULL), CBVH_INVALID_ARGUMENT, "answers: ");
    FAILS(cbvh_robot_allow_frequent(robot, 10, 0.5, NULL, 1, &count), CBVH_INVALID_ARGUMENT, "pairs: ");
    FAILS(cbvh_robot_allow_frequent(robot, SIZE_MAX / 2, 0.5, pairs_of_many, 1, &count), CBVH_LIMIT, "samples: expected");
    OK(cbvh_robot_allow_frequent(robot, 0, NAN, pairs_of_many, 1, &count));
    /* All of that changed nothing. */
    OK(cbvh_robot_collide(robot, joints, JOINTS, 3, answers));
    CHECK(!answers[0] && !answers[2]);
    OK(cbvh_mesh_free(mesh));
    OK(cbvh_robot_free(robot));
}

/* Threads that ask while another one moves an obstacle back and forth: each answer is one of both. */
static cbvh_robot shared;
static double asked[8 * JOINTS];
static cbvh_robot_distance_answer both[2][8];
static int is_over, seen[2];

static void *ask(void *unused) {
    while (!__atomic_load_n(&is_over, __ATOMIC_RELAXED)) {
        cbvh_robot_distance_answer found[8];
        OK(cbvh_robot_distances(shared, asked, JOINTS, 8, found));
        const int which = memcmp(found, both[0], sizeof found) != 0;
        CHECK(memcmp(found, both[which], sizeof found) == 0);
        __atomic_fetch_add(&seen[which], 1, __ATOMIC_RELAXED);
    }
    return unused;
}

static void threads(void) {
    enum { THREADS = 4 };
    pthread_t running[THREADS];
    const cbvh_pose places[2] = {shift(0.45, 0, 0.75), shift(0.3, 0.3, 0.75)};
    shared = cell();
    random_joints(asked, 8);
    for (int k = 1; k >= 0; k--) {
        OK(cbvh_robot_set_pose(shared, "pillar", &places[k]));
        OK(cbvh_robot_distances(shared, asked, JOINTS, 8, both[k]));
    }
    CHECK(memcmp(both[0], both[1], sizeof both[0]) != 0);
    for (int k = 0; k < THREADS; k++) {
        CHECK(pthread_create(&running[k], NULL, ask, NULL) == 0);
    }
    for (int k = 0; k < 1000000; k++) {
        OK(cbvh_robot_set_pose(shared, "pillar", &places[k % 2]));
        if (__atomic_load_n(&seen[0], __ATOMIC_RELAXED) > 20 && __atomic_load_n(&seen[1], __ATOMIC_RELAXED) > 20) {
            break;
        }
    }
    __atomic_store_n(&is_over, 1, __ATOMIC_RELAXED);
    for (int k = 0; k < THREADS; k++) {
        CHECK(pthread_join(running[k], NULL) == 0);
    }
    CHECK(seen[0] > 20 && seen[1] > 20);
    OK(cbvh_robot_free(shared));
}

/* Sets a flag a moment later, while another thread asks. */
static cbvh_stop stop;

static void *set_soon(void *unused) {
    const struct timespec moment = {0, 20000000};
    CHECK(nanosleep(&moment, NULL) == 0);
    OK(cbvh_stop_set(stop));
    return unused;
}

static void stops(int32_t parallel) {
    enum { MANY = 200000, FEW = 20 };
    const cbvh_stop no_stop = {0};
    const cbvh_robot robot = cell();
    cbvh_robot clone;
    pthread_t thread;
    double *const starts = malloc(2 * sizeof(double) * JOINTS * MANY), *const ends = starts + JOINTS * MANY;
    bool *const are_free = malloc(MANY), expected[FEW], touches;
    CHECK(starts != NULL && are_free != NULL);
    random_joints(starts, 2 * (size_t)MANY);
    OK(cbvh_robot_set_parallel(robot, parallel));
    OK(cbvh_robot_edges_are_free(robot, starts, ends, JOINTS, FEW, NULL, expected));
    OK(cbvh_stop_new(&stop));
    OK(cbvh_robot_set_stop(robot, stop));
    CHECK(pthread_create(&thread, NULL, set_soon, NULL) == 0);
    FAILS(cbvh_robot_edges_are_free(robot, starts, ends, JOINTS, MANY, NULL, are_free), CBVH_STOPPED,
          "found the query stopped");
    CHECK(pthread_join(thread, NULL) == 0);
    FAILS(cbvh_robot_collide(robot, starts, JOINTS, 1, &touches), CBVH_STOPPED, "");
    OK(cbvh_robot_clone(robot, &clone));
    FAILS(cbvh_robot_collide(clone, starts, JOINTS, 1, &touches), CBVH_STOPPED, "");
    OK(cbvh_stop_clear(stop));
    OK(cbvh_robot_collide(clone, starts, JOINTS, 1, &touches));
    OK(cbvh_robot_edges_are_free(robot, starts, ends, JOINTS, FEW, NULL, are_free));
    CHECK(memcmp(are_free, expected, sizeof expected) == 0);
    OK(cbvh_stop_set(stop));
    OK(cbvh_robot_set_stop(robot, no_stop));
    OK(cbvh_robot_edges_are_free(robot, starts, ends, JOINTS, FEW, NULL, are_free));
    CHECK(memcmp(are_free, expected, sizeof expected) == 0);
    OK(cbvh_stop_free(stop));
    OK(cbvh_robot_free(clone));
    OK(cbvh_robot_free(robot));
    free(starts);
    free(are_free);
}

int main(int count, char **arguments) {
    CHECK(count == 3);
    scratch = arguments[1];
    testdata = arguments[2];
    description();
    for (int32_t parallel = 0; parallel < 2; parallel++) {
        configurations(parallel);
        near_pairs(parallel);
        motions(parallel);
        insides(parallel);
        stops(parallel);
    }
    turns();
    changes();
    lets_go();
    misuse();
    threads();
    puts("robots: as queriers answer where the links are, and certain on motions");
    return 0;
}
