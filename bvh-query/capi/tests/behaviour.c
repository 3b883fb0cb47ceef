/* What the header promises beyond answers: lists and text that do not fit, what lives on, borrowed bytes, paths of the
 * caller, files, scenes, and cubes, overlaps, simple shapes and margins whose answers are known. */
#include "support.h"
#include <sys/stat.h>

static cbvh_querier querier;

/* Cubes, whose answers are plain geometry. */
static void cubes(const char *parallel) {
    const cbvh_mesh one = cube(1), quarter = cube(0.25);
    const cbvh_pose poses[4] = {shift(0, 0, 0), shift(1, 0, 0), shift(1.5, 0, 0), shift(2, 2, 0)};
    const double distances[4] = {0, 0, 0.5, sqrt(2)};
    bool touch[4], near[4];
    cbvh_distance_answer answers[4];
    OK(cbvh_collide(querier, one, one, poses, 4, touch));
    OK(cbvh_within(querier, one, one, poses, 4, 0.5, near));
    OK(cbvh_distances(querier, one, one, poses, 4, NULL, answers));
    for (int k = 0; k < 4; k++) {
        CHECK(touch[k] == (k < 2) && near[k] == (k < 3) && answers[k].distance == distances[k]);
        CHECK(answers[k].lower <= answers[k].distance && answers[k].distance <= answers[k].upper);
        double squared = 0;
        for (int axis = 0; axis < 3; axis++) {
            squared += pow(answers[k].point_a[axis] - answers[k].point_b[axis], 2);
        }
        CHECK(fabs(sqrt(squared) - answers[k].distance) < 1e-12);
    }
    size_t first;
    OK(cbvh_first_collision(querier, one, one, poses + 2, 2, &first));
    CHECK(first == 2);
    OK(cbvh_first_collision(querier, one, one, poses, 4, &first));
    CHECK(first == 0);
    const cbvh_pose placed[3] = {shift(0, 0, 0), shift(3, 0, 0), shift(0.5, 0, 0)};
    cbvh_relation relations[3];
    OK(cbvh_relations(querier, one, quarter, placed, 3, relations));
    CHECK(relations[0] == CBVH_B_IN_A && relations[1] == CBVH_APART && relations[2] == CBVH_TOUCHING);
    OK(cbvh_relations(querier, quarter, one, placed, 1, relations));
    CHECK(relations[0] == CBVH_A_IN_B);

    const double points[12] = {0, 0, 0.25, 0, 0, 2, 0.5, 0, 0, 0, 5, 0};
    const cbvh_pose world = shift(0, 0, 0);
    cbvh_side sides[4];
    cbvh_closest_point closest[4];
    OK(cbvh_sides(querier, one, NULL, points, 4, sides));
    CHECK(sides[0] == CBVH_INSIDE && sides[1] == CBVH_OUTSIDE && sides[2] == CBVH_ON && sides[3] == CBVH_OUTSIDE);
    /* The numbers that the command prints. */
    CHECK(sides[0] == 1 && sides[1] == -1 && sides[2] == 0);
    OK(cbvh_signed_point_distances(querier, one, &world, points, 4, 2, closest));
    CHECK(closest[0].distance == 0.25 && closest[0].side == CBVH_INSIDE && closest[1].distance == 1.5);
    CHECK(closest[1].point[2] == 0.5 && closest[2].distance == 0 && closest[2].side == CBVH_ON);
    CHECK(!closest[3].found && isnan(closest[3].distance) && closest[3].side == CBVH_SIDE_NOT_ASKED);
    OK(cbvh_closest_points(querier, one, NULL, points, 4, INFINITY, closest));
    CHECK(closest[3].found && closest[3].distance == 4.5 && closest[3].side == CBVH_SIDE_NOT_ASKED);
    const cbvh_pose above = shift(0, 0, 10);
    const cbvh_ray rays[2] = {{{0.1, 0.2, 5}, {0, 0, -1}, INFINITY}, {{0.1, 0.2, 5}, {0, 0, 1}, INFINITY}};
    cbvh_ray_hit hits[4];
    bool any[2];
    size_t counts[2], count;
    OK(cbvh_first_hits(querier, one, NULL, rays, 2, hits));
    CHECK(hits[0].found && hits[0].t == 4.5 && hits[0].point[2] == 0.5 && !hits[1].found && isnan(hits[1].t));
    OK(cbvh_any_hits(querier, one, &above, rays, 2, any));
    CHECK(!any[0] && any[1]);
    OK(cbvh_all_hits(querier, one, NULL, rays, 2, counts, hits, 4, &count));
    CHECK(count == 2 && counts[0] == 2 && counts[1] == 0 && hits[0].t == 4.5 && hits[1].t == 5.5);
    const cbvh_segment segments[2] = {{{0, 0, 0}, {0, 0, 0.5}}, {{0, 0, 0}, {0, 0, 0.25}}};
    OK(cbvh_segment_hits(querier, one, NULL, segments, 2, any));
    bool sees[2];
    OK(cbvh_visible(querier, one, NULL, segments, 2, 0, sees));
    CHECK(sees[0] == !any[0] && sees[1] == !any[1]);
    OK(cbvh_visible(querier, one, NULL, segments, 2, 0.25, sees));
    CHECK(sees[0] && sees[1]);
    FAILS(cbvh_visible(querier, one, NULL, segments, 2, -1, sees), CBVH_INVALID_ARGUMENT,
          "margin: expected a finite distance of at least 0, found -1");
    CHECK(any[0] && !any[1]);
    OK(cbvh_mesh_free(one));
    OK(cbvh_mesh_free(quarter));
    printf("behaviour: cubes%s\n", parallel);
}

/* Buffers of every size: the count is always that of all, and nothing is written beyond what fits. */
static void lists(void) {
    const cbvh_mesh mesh = cube(1);
    const cbvh_pose poses[3] = {shift(0.5, 0.25, 0.125), shift(3, 0, 0), shift(1, 0, 0)};
    cbvh_contact all[200], some[200], pattern;
    size_t count, counts[3];
    OK(cbvh_contacts(querier, mesh, mesh, poses, 3, counts, all, 200, &count));
    CHECK(count > 10 && count <= 200 && counts[0] + counts[1] + counts[2] == count && counts[0] > 0 && counts[1] == 0);
    memset(&pattern, 0xA5, sizeof pattern);
    for (size_t capacity = 0; capacity <= count; capacity++) {
        size_t found = 999;
        memset(some, 0xA5, sizeof some);
        const cbvh_status status = cbvh_contacts(querier, mesh, mesh, poses, 3, NULL, capacity ? some : NULL, capacity,
            &found);
        CHECK(found == count && status == (capacity < count ? CBVH_BUFFER_TOO_SMALL : CBVH_OK));
        CHECK(memcmp(some, all, capacity * sizeof *some) == 0);
        CHECK(memcmp(&some[capacity], &pattern, sizeof pattern) == 0);
    }
    FAILS(cbvh_contacts(querier, mesh, mesh, poses, 1, NULL, NULL, 0, &count), CBVH_BUFFER_TOO_SMALL,
          "contacts: expected room for");
    size_t size, length;
    FAILS(cbvh_mesh_bytes(mesh, NULL, 0, &size), CBVH_BUFFER_TOO_SMALL, "buffer: expected room for");
    unsigned char *bytes = malloc(size);
    CHECK(bytes != NULL);
    OK(cbvh_mesh_bytes(mesh, bytes, size, &size));
    cbvh_mesh again;
    OK(cbvh_mesh_from_bytes(bytes, size, &again));
    OK(cbvh_mesh_validate(again));
    /* Damage is found by who needs it. */
    bytes[size - 100] ^= 1;
    bytes[4200] ^= 1;
    cbvh_mesh damaged;
    const cbvh_status opened = cbvh_mesh_from_bytes(bytes, size, &damaged);
    if (opened == CBVH_OK) {
        FAILS(cbvh_mesh_validate(damaged), CBVH_DAMAGED, "R");
        OK(cbvh_mesh_free(damaged));
    } else {
        CHECK(opened == CBVH_DAMAGED);
    }
    free(bytes);
    char text[8];
    OK(cbvh_mesh_object_name(mesh, 0, text, sizeof text, &length));
    CHECK(length == 0 && text[0] == 0);
    OK(cbvh_mesh_free(again));
    OK(cbvh_mesh_free(mesh));
}

/* How cubes lie. */
static void clashes(void) {
    const cbvh_mesh one = cube(1), same = cube(1), quarter = cube(0.25), pair = two_cubes();
    cbvh_mesh open;
    OK(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 11, NULL, &open));
    const cbvh_clash_options options = {.size = sizeof options, .clearance = 0.25, .tolerance = 0x1p-10};
    /* The second part and where it is, and the class, the distance and the depth of both, which is NaN where there is none. */
    const struct {
        cbvh_mesh b;
        double x, y;
        cbvh_clash_class kind;
        double distance, depth;
    } cases[] = {
        {one, 1.375, 0.125, CBVH_CLASH_APART, INFINITY, NAN},
        {one, 1.0625, 0.125, CBVH_CLASH_NEAR, 0.0625, NAN},
        {one, 1 + 0x1p-11, 0.125, CBVH_CLASH_TOUCHING, 0x1p-11, 0},
        {one, 1, 0.125, CBVH_CLASH_TOUCHING, 0, 0},
        {one, 0.75, 0.125, CBVH_CLASH_OVERLAPPING, 0, 0.25},
        {quarter, 0.125, 0.125, CBVH_CLASH_CONTAINED, 0, NAN},
        {same, 0x1p-11, 0, CBVH_CLASH_DUPLICATED, 0, NAN},
        {open, 1, 0.125, CBVH_CLASH_INTERSECTING, 0, NAN},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const cbvh_pose pose = shift(cases[k].x, cases[k].y, 0);
        cbvh_clash found;
        cbvh_relation relation;
        OK(cbvh_clashes(querier, one, cases[k].b, &pose, 1, &options, &found));
        OK(cbvh_relations(querier, one, cases[k].b, &pose, 1, &relation));
        CHECK(found.kind == cases[k].kind && found.relation == relation && found.distance == cases[k].distance);
        CHECK(isnan(found.depth.lower) == isnan(cases[k].depth) && isnan(found.depth.upper) == isnan(cases[k].depth));
        CHECK(!(found.depth.lower > cases[k].depth) && !(found.depth.upper < cases[k].depth));
        CHECK(!(found.depth.upper > 1.1 * found.depth.lower + 0x1p-20) && !found.depth.is_spent);
        CHECK(fabs(found.point[0]) <= 0.5 + 0x1p-5 && fabs(found.point[1]) <= 0.5 + 0x1p-5);
    }
    /* By default nothing is near, and the tolerance is a millionth of the side. */
    const cbvh_pose poses[3] = {shift(1.0625, 0.125, 0), shift(1 - 0x1p-21, 0.125, 0), shift(1 - 0x1p-18, 0.125, 0)};
    cbvh_clash several[3];
    OK(cbvh_clashes(querier, one, one, poses, 3, NULL, several));
    CHECK(several[0].kind == CBVH_CLASH_APART && several[1].kind == CBVH_CLASH_TOUCHING &&
          several[2].kind == CBVH_CLASH_OVERLAPPING);
    /* Where the visits end the search, the bounds so far are the answer. A search is only for what is not convex. */
    const cbvh_clash_options few = {.size = sizeof few, .tolerance = 0x1p-10, .relative_gap = 0.01, .visits = 200};
    const cbvh_pose deep = shift(0.96875, 0.125, 0);
    OK(cbvh_clashes(querier, one, pair, &deep, 1, &few, several));
    CHECK(several[0].kind == CBVH_CLASH_UNDECIDED && several[0].depth.is_spent);
    CHECK(several[0].depth.lower <= 0.03125 && several[0].depth.upper >= 0.03125);
    OK(cbvh_mesh_free(one));
    OK(cbvh_mesh_free(same));
    OK(cbvh_mesh_free(quarter));
    OK(cbvh_mesh_free(pair));
    OK(cbvh_mesh_free(open));
}

/* A cube whose sides were scaled. */
static cbvh_mesh block(double x, double y, double z) {
    double vertices[24];
    for (size_t k = 0; k < 24; k++) {
        vertices[k] = CUBE_VERTICES[k] * (k % 3 == 0 ? x : k % 3 == 1 ? y : z);
    }
    cbvh_mesh made;
    OK(cbvh_bake(vertices, 8, CUBE_FACES, 12, NULL, &made));
    return made;
}

/* What blocks have in common. */
static void intersections(void) {
    const cbvh_mesh one = cube(1), other = block(1.5, 0.75, 0.5), plate = block(4, 3, 0.25), rod = block(0.5, 0.5, 2);
    enum { COUNT = 17 };
    cbvh_pose poses[COUNT];
    cbvh_intersection answers[COUNT], alone;
    cbvh_measured_clash clashes[COUNT];
    for (int k = 0; k < COUNT; k++) {
        poses[k] = shift(k / 8.0 - 1, 0.5, 0.375);
    }
    OK(cbvh_intersections(querier, one, other, poses, COUNT, answers));
    OK(cbvh_measured_clashes(querier, one, other, poses, COUNT, NULL, clashes));
    for (int k = 0; k < COUNT; k++) {
        const double x = k / 8.0 - 1, lo = fmax(-0.5, x - 0.75), hi = fmin(0.5, x + 0.75), side = fmax(hi - lo, 0);
        const cbvh_intersection *found = &answers[k];
        /* 0.375 of the second block's side along each of the other axes. */
        CHECK(fabs(found->volume - side * 0.375 * 0.375) <= found->volume_error && found->volume_error < 1e-12);
        CHECK(fabs(found->area_a + found->area_b - 2 * (0.75 * side + 0.375 * 0.375)) < 1e-14);
        CHECK(found->bounds[0][0] == lo && found->bounds[1][0] == hi && found->bounds[0][1] == 0.125 &&
              found->bounds[1][1] == 0.5 && found->bounds[0][2] == 0.125 && found->bounds[1][2] == 0.5);
        CHECK(isnan(found->pierced_a) && isnan(found->pierced_b));
        OK(cbvh_intersections(querier, one, other, &poses[k], 1, &alone));
        CHECK(memcmp(&alone, found, sizeof alone) == 0);
        CHECK(clashes[k].clash.kind == CBVH_CLASH_PROTRUDING && memcmp(&clashes[k].shared, found, sizeof alone) == 0);
    }
    /* Flush and distant blocks have nothing in common. */
    poses[0] = shift(1.25, 0.125, 0);
    poses[1] = shift(3, 0, 0);
    OK(cbvh_intersections(querier, one, other, poses, 2, answers));
    OK(cbvh_measured_clashes(querier, one, other, poses, 2, NULL, clashes));
    for (int k = 0; k < 2; k++) {
        CHECK(answers[k].volume == 0 && isnan(clashes[k].shared.volume));
    }
    CHECK(isnan(answers[1].bounds[0][0]) && isnan(answers[1].bounds[1][2]));
    CHECK(clashes[0].clash.kind == CBVH_CLASH_TOUCHING && clashes[1].clash.kind == CBVH_CLASH_APART);
    /* A rod passes through a plate, and sticks in it. */
    poses[0] = shift(1, 0.5, 0.25);
    poses[1] = shift(1, 0.5, 1.0625);
    cbvh_clash plain;
    OK(cbvh_measured_clashes(querier, plate, rod, poses, 2, NULL, clashes));
    CHECK(clashes[0].clash.kind == CBVH_CLASH_PIERCING && clashes[0].shared.pierced_a == 0.25);
    CHECK(clashes[1].clash.kind == CBVH_CLASH_PROTRUDING && isnan(clashes[1].shared.pierced_a));
    CHECK(fabs(clashes[0].shared.volume - 0.0625) < 1e-14 && fabs(clashes[1].shared.volume - 0.015625) < 1e-14);
    CHECK(isnan(clashes[0].shared.pierced_b) && isnan(clashes[1].shared.pierced_b));
    OK(cbvh_clashes(querier, plate, rod, poses, 1, NULL, &plain));
    CHECK(plain.kind == CBVH_CLASH_OVERLAPPING && plain.depth.lower == clashes[0].clash.depth.lower);
    const cbvh_pose back = shift(-1, -0.5, -0.25);
    OK(cbvh_intersections(querier, rod, plate, &back, 1, answers));
    CHECK(isnan(answers[0].pierced_a) && answers[0].pierced_b == 0.25);
    /* In a scene, boxes are in the world. */
    cbvh_scene scene;
    cbvh_scene_measured_clash found[1];
    cbvh_instance first, second;
    size_t count;
    OK(cbvh_scene_new(0, &scene));
    poses[0] = shift(10, 0, 0);
    poses[1] = shift(11, 0.5, 0.25);
    OK(cbvh_scene_add(scene, plate, &poses[0], "plate", &first));
    OK(cbvh_scene_add(scene, rod, &poses[1], "rod", &second));
    OK(cbvh_scene_measured_clashes(scene, NULL, found, 1, &count));
    CHECK(count == 1 && found[0].pair.a.id == first.id && found[0].clash.kind == CBVH_CLASH_PIERCING);
    CHECK(found[0].shared.pierced_a == 0.25 && found[0].shared.bounds[0][0] == 10.75 && found[0].shared.bounds[1][0] == 11.25);
    FAILS(cbvh_scene_measured_clashes(scene, NULL, found, 0, &count), CBVH_BUFFER_TOO_SMALL, "clashes: ");
    OK(cbvh_scene_free(scene));
    OK(cbvh_mesh_free(one));
    OK(cbvh_mesh_free(other));
    OK(cbvh_mesh_free(plate));
    OK(cbvh_mesh_free(rod));
}

/* Where and how deep cubes overlap. */
static void overlaps(void) {
    const cbvh_mesh one = cube(1), quarter = cube(0.25), pair = two_cubes();
    /* What they have in common is a box with the sides 1/4, 7/8 and 15/16, and then nothing, and a face. */
    const cbvh_pose poses[4] = {shift(0.75, 0.125, 0.0625), shift(3, 0, 0), shift(1, 0.25, 0), shift(0, 0.125, 0)};
    const double directions[12] = {1, 0, 0, 1, 0, 0, 0, -2, 0, 0, 0, 1};
    cbvh_separation ways[4];
    OK(cbvh_separations(querier, one, one, poses, directions, 3, ways));
    CHECK(ways[0].lower > 0.2499999 && ways[0].lower <= 0.25 && ways[0].upper >= 0.25 && ways[0].upper < 0.2500001);
    CHECK(ways[0].translation[0] >= 0.25 && ways[0].translation[1] == 0 && ways[0].translation[2] == 0);
    CHECK(ways[1].lower == 0 && ways[1].upper == 0 && ways[1].translation[0] == 0);
    const double back[9] = {-3, 0, 0, 0, 0.5, 0, 0, 0, 7}, lengths[3] = {1.75, 0.875, 0.9375};
    const cbvh_pose same[3] = {poses[0], poses[0], poses[0]};
    OK(cbvh_separations(querier, one, one, same, back, 3, ways));
    for (int k = 0; k < 3; k++) {
        CHECK(ways[k].lower <= lengths[k] && lengths[k] <= ways[k].upper && ways[k].upper - ways[k].lower < 1e-6);
    }
    /* However it is turned, both bounds agree, and B is not free before. */
    random_source source = {11};
    for (int k = 0; k < 20; k++) {
        const cbvh_pose turned = random_pose(&source, 0.3);
        const double direction[3] = {random_signed(&source), random_signed(&source), random_signed(&source)};
        OK(cbvh_separations(querier, one, one, &turned, direction, 1, ways));
        CHECK(ways[0].lower > 0.1 && ways[0].lower <= ways[0].upper && ways[0].upper - ways[0].lower < 1e-9);
        for (int part = 0; part < 2; part++) {
            cbvh_pose moved = turned;
            for (int axis = 0; axis < 3; axis++) {
                moved.rows[4 * axis + 3] += (part ? 1 : 0.999999) * ways[0].translation[axis];
            }
            cbvh_relation relation;
            OK(cbvh_relations(querier, one, one, &moved, 1, &relation));
            CHECK(relation == (part ? CBVH_APART : CBVH_TOUCHING));
        }
    }
    cbvh_penetration depths[3];
    OK(cbvh_penetrations(querier, one, one, poses, 3, NULL, depths));
    CHECK(depths[0].lower > 0.247 && depths[0].lower <= 0.25 && depths[0].upper >= 0.25 && depths[0].upper < 0.2525);
    CHECK(depths[0].radii[0] == 0 && depths[0].radii[1] == 0 && !depths[0].is_spent);
    CHECK(depths[0].point[0] > 0.25 && depths[0].point[0] < 0.5 && depths[1].upper == 0);
    CHECK(depths[2].lower == 0 && depths[2].upper < 1e-6);
    /* What is inside another one is that deep, and all translations separate. */
    OK(cbvh_penetrations(querier, one, quarter, &poses[3], 1, NULL, &depths[1]));
    CHECK(depths[1].lower > 0.3 && depths[1].lower <= 0.5 && depths[1].upper >= 0.5 && depths[1].upper < 0.505);
    for (int k = 0; k < 2; k++) {
        const double *by = depths[k].translation, *from = poses[3 * k].rows;
        const cbvh_pose moved = shift(from[3] + by[0], from[7] + by[1], from[11] + by[2]);
        cbvh_relation relation;
        OK(cbvh_relations(querier, one, k ? quarter : one, &moved, 1, &relation));
        CHECK(relation == CBVH_APART && depths[k].upper >= sqrt(by[0] * by[0] + by[1] * by[1] + by[2] * by[2]));
    }
    /* Where a mesh is not convex, balls about one point prove the lower bound. */
    OK(cbvh_penetrations(querier, one, pair, poses, 1, NULL, depths));
    CHECK(depths[0].lower > 0.125 && depths[0].lower <= 0.25 && depths[0].upper >= 0.25 && depths[0].upper < 0.2525);
    CHECK(fabs(depths[0].radii[0] + depths[0].radii[1] - depths[0].lower) < 1e-6 && !depths[0].is_spent);
    /* Its search ends early: at a gap, at a length, and where the budget does. */
    const cbvh_penetration_options gap = {.size = sizeof gap, .relative_gap = 100},
        shallow = {.size = sizeof shallow, .tolerance = 0.01}, deep = {.size = sizeof deep, .tolerance = 0.6};
    OK(cbvh_penetrations(querier, one, pair, poses, 1, &gap, depths));
    CHECK(depths[0].lower > 0 && depths[0].upper <= 101 * depths[0].lower);
    OK(cbvh_penetrations(querier, one, pair, poses, 1, &shallow, depths));
    CHECK(depths[0].lower > 0.01 && depths[0].upper >= 0.25);
    OK(cbvh_penetrations(querier, one, pair, poses, 1, &deep, depths));
    CHECK(depths[0].lower <= 0.25 && depths[0].upper <= 0.6);
    OK(cbvh_querier_set_budget(querier, 100));
    OK(cbvh_penetrations(querier, one, pair, poses, 1, NULL, depths));
    CHECK(depths[0].is_spent && depths[0].lower <= 0.25 && depths[0].upper >= 0.25);
    OK(cbvh_querier_set_budget(querier, UINT64_MAX));

    /* The same pairs as contacts. Points are on both surfaces. */
    static cbvh_contact_region regions[200], some[200], pattern;
    static cbvh_contact contacts[200];
    size_t count, counts[4], contact_count;
    OK(cbvh_contacts(querier, one, one, poses, 4, NULL, contacts, 200, &contact_count));
    OK(cbvh_contact_regions(querier, one, one, poses, 4, counts, regions, 200, &count));
    CHECK(count == contact_count && counts[0] + counts[2] + counts[3] == count && counts[1] == 0);
    for (size_t k = 0; k < count; k++) {
        const size_t pose = k < counts[0] ? 0 : k < counts[0] + counts[2] ? 2 : 3;
        CHECK(memcmp(&regions[k].contact, &contacts[k], sizeof *contacts) == 0);
        CHECK(regions[k].count >= 1 && regions[k].count <= 6 && regions[k].error < 1e-9 && regions[k].overlap == 0);
        for (uint32_t place = 0; place < regions[k].count; place++) {
            double far_a = 0, far_b = 0;
            for (int axis = 0; axis < 3; axis++) {
                const double x = regions[k].points[place][axis];
                far_a = fmax(far_a, fabs(x));
                far_b = fmax(far_b, fabs(x - poses[pose].rows[4 * axis + 3]));
            }
            CHECK(fabs(far_a - 0.5) <= regions[k].error && fabs(far_b - 0.5) <= regions[k].error);
        }
    }
    memset(&pattern, 0xA5, sizeof pattern);
    for (size_t capacity = 0; capacity <= count; capacity++) {
        size_t found = 999;
        memset(some, 0xA5, sizeof some);
        const cbvh_status status = cbvh_contact_regions(querier, one, one, poses, 4, NULL, capacity ? some : NULL,
            capacity, &found);
        CHECK(found == count && status == (capacity < count ? CBVH_BUFFER_TOO_SMALL : CBVH_OK));
        CHECK(memcmp(some, regions, capacity * sizeof *some) == 0);
        CHECK(memcmp(&some[capacity], &pattern, sizeof pattern) == 0);
    }
    /* Both corners that overlap have the same curve: six edges of the box. Faces that touch have an area. */
    const cbvh_pose three[4] = {poses[0], poses[1], poses[2], poses[0]};
    cbvh_patch patches[3];
    cbvh_patch_counts of[4];
    size_t region_count;
    OK(cbvh_patches(querier, one, one, three, 4, NULL, of, patches, 3, &count, some, 200, &region_count));
    CHECK(count == 3 && of[0].patches == 1 && of[1].patches == 0 && of[2].patches == 1 && of[3].patches == 1);
    CHECK(of[0].contacts == counts[0] && of[0].total == counts[0] && of[1].total == 0 && of[2].total == counts[2]);
    CHECK(region_count == 2 * counts[0] + counts[2] && memcmp(some, regions, counts[0] * sizeof *some) == 0);
    CHECK(patches[0].first == 0 && patches[1].first == counts[0] && patches[2].first == counts[0] + counts[2]);
    CHECK(patches[0].count == counts[0] && patches[1].count == counts[2] && patches[2].depth == patches[0].depth);
    const double areas[3] = {0.875 * 0.9375, 0.25 * 0.9375, 0.25 * 0.875};
    const double area = sqrt(areas[0] * areas[0] + areas[1] * areas[1] + areas[2] * areas[2]);
    for (int k = 0; k < 3; k++) {
        CHECK(fabs(patches[0].normal[k] - areas[k] / area) < 1e-9 && fabs(patches[1].normal[k] - (k == 0)) < 1e-12);
    }
    CHECK(fabs(patches[0].length - 2 * (0.25 + 0.875 + 0.9375)) < 1e-9 && patches[0].area == 0);
    CHECK(patches[0].depth > 0.25 && fabs(patches[1].area - 0.75) < 1e-9 && patches[1].depth < 1e-9);
    CHECK(fabs(patches[1].center[0] - 0.5) < 1e-12 && fabs(patches[1].center[1] - 0.125) < 1e-12);
    const cbvh_patch_options few = {.size = sizeof few, .max_contacts = 5};
    OK(cbvh_patches(querier, one, one, three, 1, &few, of, patches, 3, &count, NULL, 0, NULL));
    CHECK(of[0].contacts == 5 && of[0].total == counts[0]);
    FAILS(cbvh_patches(querier, one, one, three, 4, NULL, NULL, patches, 2, &count, some, 200, &region_count),
          CBVH_BUFFER_TOO_SMALL, "patches: expected room for 3 elements, found room for 2");
    CHECK(count == 3 && region_count == 2 * counts[0] + counts[2]);
    FAILS(cbvh_patches(querier, one, one, three, 4, NULL, NULL, patches, 3, &count, some, 4, &region_count),
          CBVH_BUFFER_TOO_SMALL, "regions: expected room for");
    CHECK(count == 3 && region_count == 2 * counts[0] + counts[2]);
    /* The corner of one cube is in the other one, and each pose has its own patches. Flush faces have their corners. */
    cbvh_contact_point points_of[12];
    size_t point_counts[4], patch_count;
    const cbvh_pose sunk[2] = {shift(0.125, 0.25, 0.9375), poses[2]};
    cbvh_patch alone[2];
    OK(cbvh_contact_points(querier, one, one, sunk, 2, NULL, point_counts, points_of, 12, &count, alone, 2,
                           &patch_count));
    CHECK(point_counts[0] == 4 && point_counts[1] == 4 && count == 8 && patch_count == 2);
    CHECK(alone[0].first == 0 && alone[1].first == alone[0].count);
    for (size_t k = 0; k < 8; k++) {
        const cbvh_contact_point *at = &points_of[k];
        CHECK(at->patch == k / 4 && fabs(at->normal[0] * at->normal[0] + at->normal[1] * at->normal[1] +
                                         at->normal[2] * at->normal[2] - 1) < 1e-12);
        CHECK(k < 4 ? at->depth >= 0 && at->depth < 0.064 && at->point[2] > 0.4374 : fabs(at->depth) < 1e-12);
    }
    CHECK(fabs(points_of[0].depth - 0.0625) < 1e-3);
    const cbvh_patch_options single = {.size = sizeof single, .max_points = 1};
    OK(cbvh_contact_points(querier, one, one, sunk, 2, &single, NULL, points_of, 2, &count, NULL, 0, NULL));
    CHECK(count == 2 && points_of[1].patch == 1);
    /* An older program, whose options end before the number of points. */
    const cbvh_patch_options older = {.size = offsetof(cbvh_patch_options, max_points), .max_points = 1};
    OK(cbvh_contact_points(querier, one, one, sunk, 2, &older, NULL, points_of, 12, &count, NULL, 0, NULL));
    CHECK(count == 8);
    FAILS(cbvh_contact_points(querier, one, one, sunk, 2, NULL, NULL, points_of, 7, &count, alone, 1, &patch_count),
          CBVH_BUFFER_TOO_SMALL, "points: expected room for 8 elements, found room for 7");
    CHECK(count == 8 && patch_count == 2);
    /* Each contact of two balls is a point, and two of four are the same. Points that may be far apart are one patch. */
    const double points[6] = {0, 0, 0, 0.5, 0, 0};
    cbvh_mesh cloud, balls;
    OK(cbvh_bake_cloud(points, 2, &cloud));
    OK(cbvh_mesh_rounded(cloud, 0.625, &balls));
    for (int k = 0; k < 2; k++) {
        const cbvh_pose above = shift(0, 0, 1);
        const cbvh_patch_options joined = {.size = sizeof joined, .tolerance = 2};
        OK(cbvh_patches(querier, balls, balls, &above, 1, k ? &joined : NULL, of, patches, 3, &count, NULL, 0, NULL));
        CHECK(of[0].contacts == 4 && count == (k ? 1 : 3) && fabs(patches[0].depth - 0.25) < 1e-12);
    }
    OK(cbvh_mesh_free(cloud));
    OK(cbvh_mesh_free(balls));
    OK(cbvh_mesh_free(one));
    OK(cbvh_mesh_free(quarter));
    OK(cbvh_mesh_free(pair));
}

/* Whether what an answer says of itself holds: its normal, its points and its translation. */
static bool is_consistent(cbvh_mesh a, cbvh_mesh b, const cbvh_pose *pose, const cbvh_signed_distance *of) {
    double length = 0, apart = 0, way = 0;
    cbvh_pose moved = *pose;
    for (int axis = 0; axis < 3; axis++) {
        length += of->normal[axis] * of->normal[axis];
        apart += of->normal[axis] * (of->point_b[axis] - of->point_a[axis]);
        way += of->translation[axis] * of->translation[axis];
        moved.rows[4 * axis + 3] += of->translation[axis];
    }
    cbvh_relation relation = CBVH_APART;
    if (of->lower < 0) {
        OK(cbvh_relations(querier, a, b, &moved, 1, &relation));
    }
    const double slack = 1e-9 + 0.02 * fabs(of->lower);
    return of->lower <= of->upper && fabs(length - 1) < 1e-12 && relation == CBVH_APART &&
           fabs(sqrt(way) - fmax(0, -of->lower)) < 1e-12 && of->lower - slack <= apart && apart <= of->upper + slack;
}

/* How far apart or how deep in each other blocks and other shapes are. */
static void signed_distances(void) {
    /* A block passes through another one along x, from one side to the other: the number is a known function of the way. */
    const double sides[2][3] = {{2, 4, 4}, {1, 1, 1}};
    cbvh_mesh blocks[2];
    OK(cbvh_bake_box(sides[0], &blocks[0]));
    OK(cbvh_bake_box(sides[1], &blocks[1]));
    cbvh_pose way[49];
    cbvh_signed_distance numbers[49], alone;
    for (int step = 0; step < 49; step++) {
        way[step] = shift((step - 24) / 8.0, 0.25, 0);
    }
    OK(cbvh_signed_distances(querier, blocks[0], blocks[1], way, 49, NULL, numbers));
    for (int step = 0; step < 49; step++) {
        const double x = way[step].rows[3], expected = fabs(x) - 1.5;
        CHECK(numbers[step].lower <= expected && expected <= numbers[step].upper);
        CHECK(numbers[step].upper - numbers[step].lower < 1e-9 && numbers[step].is_signed && !numbers[step].is_spent);
        CHECK(is_consistent(blocks[0], blocks[1], &way[step], &numbers[step]));
        CHECK(x == 0 || fabs(numbers[step].normal[0] - (x > 0 ? 1 : -1)) < 1e-9);
        OK(cbvh_signed_distances(querier, blocks[0], blocks[1], &way[step], 1, NULL, &alone));
        CHECK(memcmp(&alone, &numbers[step], sizeof alone) == 0);
    }
    /* It is the distance, or minus the depth with the same options, of meshes that are not convex as well. */
    const cbvh_mesh one = cube(1), pair = two_cubes();
    const cbvh_penetration_options options[2] = {{.size = sizeof *options}, {.size = sizeof *options, .relative_gap = 100}};
    random_source source = {12};
    int apart = 0, loose = 0;
    for (int k = 0; k < 40; k++) {
        const cbvh_pose pose = random_pose(&source, 1.5);
        cbvh_relation relation;
        OK(cbvh_relations(querier, one, pair, &pose, 1, &relation));
        for (int option = 0; option < 2; option++) {
            OK(cbvh_signed_distances(querier, one, pair, &pose, 1, &options[option], &alone));
            CHECK(is_consistent(one, pair, &pose, &alone) && alone.is_signed && !alone.is_spent);
            if (relation == CBVH_APART) {
                cbvh_distance_answer distance;
                OK(cbvh_distances(querier, one, pair, &pose, 1, NULL, &distance));
                CHECK(alone.lower == distance.lower && alone.upper == distance.upper);
                apart++;
            } else {
                cbvh_penetration depth;
                OK(cbvh_penetrations(querier, one, pair, &pose, 1, &options[option], &depth));
                CHECK(alone.lower == -depth.upper && alone.upper == -depth.lower);
                loose += option == 1 && alone.upper - alone.lower > 0.01 * -alone.upper;
            }
        }
    }
    CHECK(apart > 10 && apart < 70 && loose > 0);
    /* Where the budget ends the search, the bounds so far are the answer. */
    const cbvh_pose deep = shift(0.375, 0.125, 0.0625);
    OK(cbvh_querier_set_budget(querier, 200));
    OK(cbvh_signed_distances(querier, one, pair, &deep, 1, NULL, &alone));
    CHECK(alone.is_spent && alone.lower < 0 && alone.upper <= 0);
    OK(cbvh_querier_set_budget(querier, UINT64_MAX));
    /* What has no inside has a distance only, and the answer says so; a radius gives an inside to a point. */
    const double middle[3] = {0, 0, 0};
    cbvh_mesh open, point, ball;
    OK(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 11, NULL, &open));
    OK(cbvh_bake_cloud(middle, 1, &point));
    OK(cbvh_mesh_rounded(point, 0.25, &ball));
    const struct {
        cbvh_mesh b;
        double x, expected;
        bool is_signed;
    } cases[] = {{open, 2, 1, false}, {open, 0.75, 0, false}, {point, 1, 0.5, false}, {point, 0.25, 0.25, false},
                 {ball, 1, 0.25, true}, {ball, 0.625, -0.125, true}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const cbvh_pose pose = shift(cases[k].x, 0, 0);
        OK(cbvh_signed_distances(querier, one, cases[k].b, &pose, 1, NULL, &alone));
        CHECK(alone.is_signed == cases[k].is_signed && alone.lower <= cases[k].expected);
        CHECK(cases[k].expected <= alone.upper && alone.upper - alone.lower < 1e-9);
        CHECK(alone.is_signed || (alone.lower >= 0 && alone.translation[0] == 0));
    }
    OK(cbvh_mesh_free(blocks[0]));
    OK(cbvh_mesh_free(blocks[1]));
    OK(cbvh_mesh_free(one));
    OK(cbvh_mesh_free(pair));
    OK(cbvh_mesh_free(open));
    OK(cbvh_mesh_free(point));
    OK(cbvh_mesh_free(ball));
}

/* The least signed distance of all pairs of a scene. */
static void signed_distances_of_scenes(int32_t parallel, int32_t tracking) {
    /* A block passes through a large one, and a third one is always 0.75 from that. */
    const double sides[3] = {2, 4, 4};
    const cbvh_mesh one = cube(1), pair = two_cubes();
    const cbvh_pose origin = CBVH_IDENTITY, beside = shift(0, -3.25, 0);
    cbvh_mesh large, open;
    cbvh_scene scene;
    cbvh_instance a, b, c;
    cbvh_scene_signed_distance_answer answer;
    cbvh_signed_distance number;
    OK(cbvh_bake_box(sides, &large));
    OK(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 10, NULL, &open));
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
    OK(cbvh_scene_set_parallel(scene, parallel));
    OK(cbvh_scene_set_tracking(scene, tracking));
    OK(cbvh_scene_signed_distance(scene, NULL, &answer));
    CHECK(!answer.found && isnan(answer.nearest.lower) && answer.pair.a.id == 0);
    OK(cbvh_scene_add(scene, large, &origin, NULL, &a));
    OK(cbvh_scene_add(scene, one, &origin, NULL, &b));
    OK(cbvh_scene_add(scene, one, &beside, NULL, &c));
    const cbvh_penetration_options exact = {.size = sizeof exact, .relative_gap = 1e-6};
    for (int step = -24; step <= 24; step++) {
        const double x = step / 8.0;
        const cbvh_pose way = shift(x, 0.25, 0);
        OK(cbvh_scene_set_poses(scene, &b, &way, 1));
        OK(cbvh_scene_signed_distance(scene, &exact, &answer));
        const bool is_near = fabs(x) < 2.25;
        const double expected = fmin(fabs(x) - 1.5, 0.75);
        CHECK(answer.found && answer.nearest.lower <= expected && expected <= answer.nearest.upper);
        CHECK(answer.nearest.upper - answer.nearest.lower < 1e-9 && answer.nearest.is_signed && !answer.nearest.is_spent);
        CHECK(answer.pair.a.id == a.id && (fabs(x) == 2.25 || answer.pair.b.id == (is_near ? b.id : c.id)));
        if (fabs(x) != 2.25) {
            OK(cbvh_signed_distances(querier, large, one, is_near ? &way : &beside, 1, &exact, &number));
            CHECK(memcmp(&number, &answer.nearest, sizeof number) == 0);
        }
    }
    /* What is not closed has no depth. */
    const cbvh_pose across = shift(1, 0.25, 0);
    OK(cbvh_scene_set_poses(scene, &b, &across, 1));
    OK(cbvh_scene_set_mesh(scene, b, open));
    OK(cbvh_scene_signed_distance(scene, NULL, &answer));
    CHECK(answer.pair.b.id == b.id && answer.nearest.lower == 0 && answer.nearest.upper == 0 && !answer.nearest.is_signed);
    OK(cbvh_scene_free(scene));
    /* Of all pairs of several meshes it is the least. */
    const cbvh_mesh meshes[4] = {one, pair, open, large};
    random_source source = {13};
    cbvh_scene_near_pair near[6];
    size_t near_count;
    int deep = 0, some_are_near = 0;
    for (int round = 0; round < 20; round++) {
        cbvh_pose worlds[4], pose;
        cbvh_instance instances[4];
        OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
        OK(cbvh_scene_set_parallel(scene, parallel));
        OK(cbvh_scene_set_tracking(scene, tracking));
        for (int k = 0; k < 4; k++) {
            worlds[k] = random_pose(&source, 3);
            OK(cbvh_scene_add(scene, meshes[k], &worlds[k], NULL, &instances[k]));
        }
        OK(cbvh_scene_signed_distance(scene, NULL, &answer));
        /* Those that are near are in the order of their instances. */
        OK(cbvh_scene_near_pairs(scene, 0.5, NULL, near, 6, &near_count));
        double least = INFINITY;
        size_t listed = 0;
        for (int j = 0; j < 4; j++) {
            for (int k = j + 1; k < 4; k++) {
                OK(cbvh_pose_relative(&worlds[j], &worlds[k], &pose));
                OK(cbvh_signed_distances(querier, meshes[j], meshes[k], &pose, 1, NULL, &number));
                least = fmin(least, number.lower);
                if (number.upper <= 0.5) {
                    CHECK(near[listed].pair.a.id == instances[j].id && near[listed].pair.b.id == instances[k].id);
                    CHECK(memcmp(&number, &near[listed].nearest, sizeof number) == 0);
                    CHECK(number.lower <= near[listed].distance && near[listed].distance <= number.upper);
                    listed++;
                }
                CHECK(answer.pair.a.id != instances[j].id || answer.pair.b.id != instances[k].id ||
                      memcmp(&number, &answer.nearest, sizeof number) == 0);
            }
        }
        CHECK(answer.nearest.lower == least && listed == near_count);
        some_are_near += listed > 0 && listed < 6;
        deep += least < 0;
        OK(cbvh_scene_free(scene));
    }
    CHECK(deep > 0 && deep < 20 && some_are_near > 5);
    OK(cbvh_mesh_free(one));
    OK(cbvh_mesh_free(pair));
    OK(cbvh_mesh_free(open));
    OK(cbvh_mesh_free(large));
}

/* Where a mesh meets itself: pairs of triangles of each kind, far apart from each other. */
static void self_contacts(void) {
    const double vertices[3 * 24] = {
        0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, -1, 0.3, 0.2, -1, 0.2, 0.2, 1,   /* They cross. */
        0, 0, 9, 1, 0, 9, 0, 1, 9, 0, 0, 9, 1, 1, 8, 1, 1, 10,                /* They share a corner. */
        0, 0, 20, 1, 0, 20, 0, 1, 20, 0, 0, 20, 1, 0, 20, 0.2, 0.5, 20,       /* They share an edge. */
        0, 0, 30, 1, 0, 30, 0, 1, 30, 0, 0, 30, 1, 0, 30, 0, 1, 30};          /* They are one. */
    uint32_t faces[24];
    for (uint32_t k = 0; k < 24; k++) {
        faces[k] = k;
    }
    const cbvh_mesh fine = cube(1);
    cbvh_mesh mesh;
    cbvh_self_contact found[5], some[5], pattern;
    size_t count = 7;
    OK(cbvh_bake(vertices, 24, faces, 8, NULL, &mesh));
    OK(cbvh_self_contacts(querier, mesh, found, 5, &count));
    CHECK(count == 4);
    for (uint32_t k = 0; k < 4; k++) {
        CHECK(found[k].triangle_a == 2 * k && found[k].triangle_b == 2 * k + 1 && found[k].kind == (int32_t)k);
        CHECK(found[k].object_a == 0 && found[k].object_b == 0);
    }
    CHECK(found[0].kind == CBVH_SELF_CROSSING && found[3].kind == CBVH_SELF_DUPLICATE);
    memset(&pattern, 0xA5, sizeof pattern);
    for (size_t capacity = 0; capacity < 4; capacity++) {
        memset(some, 0xA5, sizeof some);
        FAILS(cbvh_self_contacts(querier, mesh, capacity ? some : NULL, capacity, &count), CBVH_BUFFER_TOO_SMALL,
              "contacts: expected room for 4 elements");
        CHECK(count == 4 && memcmp(some, found, capacity * sizeof *some) == 0);
        CHECK(memcmp(&some[capacity], &pattern, sizeof pattern) == 0);
    }
    OK(cbvh_self_contacts(querier, fine, NULL, 0, &count));
    CHECK(count == 0);
    OK(cbvh_mesh_free(mesh));
    OK(cbvh_mesh_free(fine));
}

/* Why a mesh is open: a tetrahedron whose last face has a corner of its own, a little off, and one without that face. */
static void open_edges(void) {
    const double vertices[3 * 5] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1e-6};
    const uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 4, 2, 3};
    cbvh_mesh cracked, open, closed, solid;
    cbvh_open_edge_counts counts;
    cbvh_open_edge edges[8];
    size_t count;
    char text[200];
    OK(cbvh_bake(vertices, 5, faces, 4, NULL, &cracked));
    OK(cbvh_bake(vertices, 5, faces, 3, NULL, &open));
    OK(cbvh_mesh_open_edge_counts(cracked, &counts));
    CHECK(counts.boundary == 4 && counts.flipped == 0 && counts.crowded == 0 && counts.cracks == 4);
    CHECK(counts.nearest_gap > 0.99e-6 && counts.widest_crack < 1.01e-6 && counts.proposed_weld == 1e-5);
    OK(cbvh_mesh_open_edges(cracked, edges, 8, &count));
    CHECK(count == 4 && edges[0].kind == CBVH_OPEN_BOUNDARY && edges[0].triangle_count == 1 && edges[0].object == 0);
    CHECK(edges[0].gap == counts.nearest_gap && edges[3].triangles[0] == 3);
    FAILS(cbvh_mesh_open_edges(cracked, edges, 3, &count), CBVH_BUFFER_TOO_SMALL, "edges: expected room for 4 elements");
    OK(cbvh_mesh_open_edges_text(cracked, text, sizeof text, &count));
    CHECK(strncmp(text, "4 edges have one triangle; the nearest gap is ", 46) == 0 && strstr(text, "--weld 1e-5") != NULL);
    FAILS(cbvh_mesh_solid(cracked, &solid), CBVH_INVALID_ARGUMENT, text);
    OK(cbvh_mesh_open_edge_counts(open, &counts));
    CHECK(counts.boundary == 3 && counts.cracks == 0 && isnan(counts.widest_crack) && isnan(counts.proposed_weld));
    const cbvh_bake_options options = {.size = sizeof options, .weld = 1e-5};
    OK(cbvh_bake(vertices, 5, faces, 4, &options, &closed));
    OK(cbvh_mesh_open_edge_counts(closed, &counts));
    CHECK(counts.boundary == 0 && isnan(counts.nearest_gap));
    OK(cbvh_mesh_open_edges(closed, NULL, 0, &count));
    CHECK(count == 0);
    OK(cbvh_mesh_solid(closed, &solid));
    OK(cbvh_mesh_free(solid));
    OK(cbvh_mesh_free(closed));
    OK(cbvh_mesh_free(open));
    OK(cbvh_mesh_free(cracked));
}

static int released;
static void release(void *user) {
    released++;
    free(user);
}

/* Bytes of the caller are used until the last one who needs them is gone. */
static void borrowed(void) {
    const cbvh_mesh mesh = cube(1);
    size_t size;
    (void)cbvh_mesh_bytes(mesh, NULL, 0, &size);
    unsigned char *bytes = malloc(size + 1);
    CHECK(bytes != NULL);
    /* At an odd address. */
    OK(cbvh_mesh_bytes(mesh, bytes + 1, size, &size));
    cbvh_mesh lent, copy;
    cbvh_scene scene, second;
    FAILS(cbvh_mesh_borrow_bytes(bytes + 2, size - 1, release, bytes, &lent), CBVH_DAMAGED, "bytes: ");
    CHECK(released == 0);
    OK(cbvh_mesh_borrow_bytes(bytes + 1, size, release, bytes, &lent));
    OK(cbvh_mesh_clone(lent, &copy));
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
    const cbvh_pose here = CBVH_IDENTITY;
    OK(cbvh_scene_add(scene, lent, &here, NULL, NULL));
    OK(cbvh_scene_clone(scene, &second));
    OK(cbvh_mesh_free(lent));
    OK(cbvh_mesh_free(copy));
    OK(cbvh_scene_free(scene));
    const double point[3] = {0, 0, 2};
    cbvh_closest_point closest;
    OK(cbvh_scene_closest_points(second, point, 1, INFINITY, &closest));
    CHECK(closest.distance == 1.5 && released == 0);
    OK(cbvh_scene_free(second));
    CHECK(released == 1);
    /* A querier keeps what it was asked about until it is asked about something else. */
    bytes = malloc(size);
    CHECK(bytes != NULL);
    OK(cbvh_mesh_bytes(mesh, bytes, size, &size));
    OK(cbvh_mesh_borrow_bytes(bytes, size, release, bytes, &lent));
    bool answer;
    OK(cbvh_collide(querier, lent, lent, &here, 1, &answer));
    OK(cbvh_collide(querier, mesh, mesh, &here, 1, &answer));
    OK(cbvh_mesh_free(lent));
    CHECK(released == 1);
    /* Also about a mesh that it has had at hand all the time. */
    OK(cbvh_collide(querier, mesh, mesh, &here, 1, &answer));
    CHECK(released == 2);
    /* More meshes than a querier has at hand. */
    cbvh_mesh many[20];
    for (int k = 0; k < 20; k++) {
        many[k] = cube(k + 1);
    }
    for (int a = 0; a < 20; a++) {
        for (int b = 0; b < 20; b++) {
            const cbvh_pose aside = shift(0, (a + b + 2) / 2.0 + 1, 0);
            cbvh_distance_answer distance;
            OK(cbvh_distances(querier, many[a], many[b], &aside, 1, NULL, &distance));
            CHECK(distance.distance == 1);
        }
    }
    for (int k = 0; k < 20; k++) {
        OK(cbvh_mesh_free(many[k]));
    }
    OK(cbvh_mesh_free(mesh));
}

/* A cube that moves along x, turning about it, by functions of the caller. */
typedef struct { double from, to; int fails_after, code, breaks, has_failed, late_calls; cbvh_querier querier; } course;

static int32_t course_pose(void *user, double t, cbvh_pose *pose) {
    course *of = user;
    of->late_calls += of->has_failed;
    if (of->fails_after-- == 0) {
        of->has_failed = 1;
        return of->code;
    }
    *pose = shift((1 - t) * of->from + t * of->to, 0, 0);
    if (of->breaks) {
        pose->rows[0] = 2;
    }
    if (of->querier.id != 0) {
        bool answer;
        const cbvh_mesh none = {0};
        FAILS(cbvh_collide(of->querier, none, none, pose, 1, &answer), CBVH_BUSY, "querier: ");
    }
    return 0;
}

/* A bound that is none, for a reason. */
static double no_bound(void *user, double radius, double t0, double t1) {
    (void)radius, (void)t0, (void)t1;
    const double *bound = user;
    if (*bound < 0) {
        OK(cbvh_callback_message("below the ground"));
    }
    return *bound;
}

static int32_t stands_still(void *user, double t, cbvh_pose *pose) {
    (void)user, (void)t;
    *pose = shift(3, 0, 0);
    return 0;
}

static int32_t no_pose(void *user, double t, cbvh_pose *pose) {
    (void)user, (void)t, (void)pose;
    OK(cbvh_callback_message("the joint is at its end"));
    return 3;
}

static double course_sagitta(void *user, double radius, double t0, double t1) {
    (void)user, (void)radius, (void)t0, (void)t1;
    /* A line, but for the rounding of two products and a sum of numbers up to 8. */
    return 0x1p-48;
}

static void paths(void) {
    const cbvh_mesh mesh = cube(1);
    const cbvh_pose start = shift(-4, 0, 0), end = shift(4, 0, 0), aside_start = shift(-4, 2, 0), aside_end = shift(4,
        2, 0);
    course of = {.from = -4, .to = 4, .fails_after = -1};
    cbvh_path own, between, screw, polyline;
    const double origin[3] = {0, 0, 0}, x_axis[3] = {1, 0, 0};
    const cbvh_pose knots[3] = {shift(-4, 0, 0), shift(0, 0, 0), shift(4, 0, 0)};
    OK(cbvh_path_from_functions(course_pose, course_sagitta, NULL, &of, &own));
    OK(cbvh_path_between(&start, &end, &between));
    OK(cbvh_path_screw(&start, origin, x_axis, 0, 8, &screw));
    OK(cbvh_path_polyline(knots, 3, &polyline));
    const cbvh_path all[4] = {own, between, screw, polyline};
    cbvh_motion_answer answers[4], edges[2];
    bool free_ways[4];
    for (int parallel = 0; parallel < 2; parallel++) {
        OK(cbvh_querier_set_parallel(querier, parallel));
        OK(cbvh_motions(querier, mesh, mesh, all, 4, NULL, answers));
        OK(cbvh_are_free(querier, mesh, mesh, all, 4, NULL, free_ways));
        for (int k = 0; k < 4; k++) {
            /* The cubes touch from x = -1, three eighths of the way. */
            CHECK(!free_ways[k] && answers[k].outcome == CBVH_HIT && answers[k].free_until <= 0.375);
            CHECK(answers[k].at >= 0.375 && answers[k].at < 0.37501 && answers[k].nearest.distance == 0);
            cbvh_pose at;
            OK(cbvh_path_pose(all[k], 0.25, &at));
            CHECK(at.rows[3] == -2);
        }
        const cbvh_motion_options clear = {.size = sizeof clear, .clearance = 1, .tolerance = 1e-3};
        OK(cbvh_motions(querier, mesh, mesh, all, 1, &clear, answers));
        CHECK(answers[0].outcome == CBVH_HIT && fabs(answers[0].at - 0.25) < 1e-3 && answers[0].free_until <= 0.25);
        const cbvh_pose starts[2] = {start, aside_start}, ends[2] = {end, aside_end};
        OK(cbvh_edge_motions(querier, mesh, mesh, starts, ends, 2, NULL, edges));
        OK(cbvh_edges_are_free(querier, mesh, mesh, starts, ends, 2, NULL, free_ways));
        CHECK(edges[0].outcome == CBVH_HIT && !free_ways[0] && edges[1].outcome == CBVH_FREE && free_ways[1]);
        CHECK(edges[1].free_until == 1 && isnan(edges[1].at) && isnan(edges[1].nearest.distance));
    }
    OK(cbvh_querier_set_parallel(querier, 0));
    /* A hair's breadth is neither free nor a hit within a coarse tolerance. */
    const cbvh_pose hair_start = shift(-4, 1 + 1e-9, 0), hair_end = shift(4, 1 + 1e-9, 0);
    const cbvh_motion_options coarse = {.size = sizeof coarse, .tolerance = 0.125};
    OK(cbvh_edge_motions(querier, mesh, mesh, &hair_start, &hair_end, 1, &coarse, edges));
    CHECK(edges[0].outcome == CBVH_NEAR && edges[0].nearest.distance > 0 && edges[0].nearest.distance <= 0.125);
    /* Nor is a rounding, along all of a slide: few intervals show that. */
    const double rounding = nextafter(1, 2);
    const cbvh_pose slide_start = shift(-4, rounding, 0), slide_end = shift(4, rounding, 0);
    cbvh_path slide;
    OK(cbvh_path_between(&slide_start, &slide_end, &slide));
    OK(cbvh_querier_set_budget(querier, 1 << 14));
    OK(cbvh_motions(querier, mesh, mesh, &slide, 1, NULL, answers));
    OK(cbvh_edge_motions(querier, mesh, mesh, &slide_start, &slide_end, 1, NULL, edges));
    CHECK(answers[0].outcome == CBVH_NEAR && edges[0].outcome == CBVH_NEAR && answers[0].at == edges[0].at);
    OK(cbvh_querier_set_budget(querier, UINT64_MAX));
    OK(cbvh_path_free(slide));
    double reach, moved;
    OK(cbvh_path_reach(mesh, between, 0, 1, &reach));
    CHECK(reach >= 4 && reach < 4.001);
    OK(cbvh_displacement(mesh, &start, &end, &moved));
    CHECK(moved >= 8 && moved < 8.001);

    /* A callback may call the library, but not with the querier in use. */
    of.querier = querier;
    OK(cbvh_are_free(querier, mesh, mesh, &own, 1, NULL, free_ways));
    of.querier.id = 0;
    /* Failures of functions take the place of an answer, whenever they come. */
    bool answer;
    for (int fails_after = 0; fails_after < 12; fails_after++) {
        for (int parallel = 0; parallel < 2; parallel++) {
            OK(cbvh_querier_set_parallel(querier, parallel));
            of.fails_after = fails_after;
            of.code = 7;
            of.has_failed = 0;
            const cbvh_status status = cbvh_are_free(querier, mesh, mesh, &own, 1, NULL, &answer);
            if (status != CBVH_OK) {
                FAILS(status, CBVH_CALLBACK_FAILED, "found the code 7 of its function");
            } else {
                CHECK(of.fails_after >= 0 && fails_after > 0);
            }
            of.has_failed = 0;
            of.fails_after = fails_after;
            /* Left as it was: no pose. */
            of.code = 0;
            (void)cbvh_motions(querier, mesh, mesh, &own, 1, NULL, answers);
            of.has_failed = 0;
        }
    }
    OK(cbvh_querier_set_parallel(querier, 0));
    /* After its first failure a function is not called again: the question ends. */
    CHECK(of.late_calls == 0);
    of.fails_after = -1;
    of.breaks = 1;
    FAILS(cbvh_are_free(querier, mesh, mesh, &own, 1, NULL, &answer), CBVH_CALLBACK_FAILED,
          "path: the pose at t = 0: expected a rotation");
    cbvh_pose at;
    FAILS(cbvh_path_pose(own, 0.5, &at), CBVH_CALLBACK_FAILED, "at t = 0.5");
    /* A sagitta that is none is a failure, too, but it may be infinite. */
    of.breaks = 0;
    double bounds[3] = {NAN, -1, INFINITY};
    cbvh_path unbounded;
    for (int k = 0; k < 3; k++) {
        OK(cbvh_path_from_functions(stands_still, no_bound, NULL, &bounds[k], &unbounded));
        const cbvh_status status = cbvh_are_free(querier, mesh, mesh, &unbounded, 1, NULL, &answer);
        const char *texts[2] = {"sagitta: expected a bound of at least 0 from t = 0 to t =",
                                "found -1: below the ground"};
        if (k < 2) {
            FAILS(status, CBVH_CALLBACK_FAILED, texts[k]);
        } else {
            CHECK(status != CBVH_CALLBACK_FAILED);
        }
        OK(cbvh_path_free(unbounded));
    }
    OK(cbvh_path_from_functions(no_pose, no_bound, NULL, bounds, &unbounded));
    FAILS(cbvh_path_pose(unbounded, 0.5, &at), CBVH_CALLBACK_FAILED, "the code 3 of its function: the joint is at its end");
    OK(cbvh_path_free(unbounded));
    /* What functions use is released when the path is, but not after a failure to make it. */
    released = 0;
    void *used = malloc(1);
    FAILS(cbvh_path_from_functions(NULL, no_bound, release, used, &unbounded), CBVH_INVALID_ARGUMENT, "pose: ");
    CHECK(released == 0);
    OK(cbvh_path_from_functions(stands_still, no_bound, release, used, &unbounded));
    CHECK(released == 0);
    OK(cbvh_path_free(unbounded));
    CHECK(released == 1);
    for (int k = 0; k < 4; k++) {
        OK(cbvh_path_free(all[k]));
    }
    FAILS(cbvh_are_free(querier, mesh, mesh, &own, 1, NULL, &answer), CBVH_INVALID_HANDLE,
          "paths[0]: expected the handle of an open path");
    OK(cbvh_mesh_free(mesh));
}

/* A path of poses: a tracker answers as a querier does, to the bit. */
static void trackers(void) {
    const cbvh_mesh mesh = cube(1);
    enum { STEPS = 200 };
    static cbvh_pose poses[STEPS];
    static cbvh_distance_answer one[STEPS], other[STEPS];
    static bool touch[STEPS], near[STEPS], tracked[STEPS];
    for (int k = 0; k < STEPS; k++) {
        const double angle = 0.01 * k;
        const cbvh_pose turned = {{cos(angle), -sin(angle), 0, 2 - 0.01 * k, sin(angle), cos(angle), 0, 0, 0, 0, 1, 0}};
        poses[k] = turned;
    }
    cbvh_tracker tracker;
    OK(cbvh_tracker_new(&tracker));
    OK(cbvh_collide(querier, mesh, mesh, poses, STEPS, touch));
    OK(cbvh_tracker_collide(tracker, querier, mesh, mesh, poses, STEPS, tracked));
    CHECK(memcmp(touch, tracked, sizeof touch) == 0 && !touch[0] && touch[STEPS - 1]);
    OK(cbvh_within(querier, mesh, mesh, poses, STEPS, 0.25, near));
    OK(cbvh_tracker_within(tracker, querier, mesh, mesh, poses, STEPS, 0.25, tracked));
    CHECK(memcmp(near, tracked, sizeof near) == 0 && memcmp(near, touch, sizeof near) != 0);
    OK(cbvh_distances(querier, mesh, mesh, poses, STEPS, NULL, one));
    OK(cbvh_tracker_distance(tracker, querier, mesh, mesh, poses, STEPS, other));
    CHECK(memcmp(one, other, sizeof one) == 0);
    static cbvh_signed_distance signed_one[STEPS], signed_other[STEPS];
    OK(cbvh_signed_distances(querier, mesh, mesh, poses, STEPS, NULL, signed_one));
    OK(cbvh_tracker_signed_distance(tracker, querier, mesh, mesh, poses, STEPS, NULL, signed_other));
    CHECK(memcmp(signed_one, signed_other, sizeof signed_one) == 0);
    CHECK(signed_one[0].lower > 0.9 && signed_one[STEPS - 1].upper < -0.5);
    const cbvh_penetration_options wrong = {.size = sizeof wrong, .relative_gap = -1};
    FAILS(cbvh_tracker_signed_distance(tracker, querier, mesh, mesh, poses, STEPS, &wrong, signed_other),
          CBVH_INVALID_ARGUMENT, "relative_gap: ");
    OK(cbvh_tracker_free(tracker));
    FAILS(cbvh_tracker_free(tracker), CBVH_INVALID_HANDLE, "tracker: ");
    /* With an allowed error, the answer is between the bounds that it states. */
    const cbvh_distance_options loose = {.size = sizeof loose, .rel_err = 0.5};
    OK(cbvh_distances(querier, mesh, mesh, poses, 1, &loose, other));
    CHECK(other[0].lower <= one[0].distance && one[0].distance <= other[0].upper &&
          other[0].upper <= 1.5 * one[0].distance + 1e-9);
    cbvh_stats stats;
    OK(cbvh_querier_stats(querier, &stats));
    CHECK(stats.node_tests + stats.packet_tests > 0 && stats.pairs == 1);
    OK(cbvh_mesh_free(mesh));
}

static void scenes(int parallel, int tracking) {
    const cbvh_mesh mesh = cube(1), small = cube(0.25);
    cbvh_scene scene;
    cbvh_instance a, b, c, found[4];
    const cbvh_pose at_a = shift(0, 0, 0), at_b = shift(1.5, 0, 0), at_c = shift(0, 0, 0.1);
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
    OK(cbvh_scene_set_parallel(scene, parallel));
    OK(cbvh_scene_set_tracking(scene, tracking));
    OK(cbvh_scene_add(scene, mesh, &at_a, "a", &a));
    OK(cbvh_scene_add(scene, mesh, &at_b, "b", &b));
    OK(cbvh_scene_add(scene, small, &at_c, NULL, &c));
    OK(cbvh_mesh_free(mesh));
    OK(cbvh_mesh_free(small));
    bool answer;
    OK(cbvh_scene_collide(scene, &answer));
    CHECK(!answer);
    OK(cbvh_scene_within(scene, 0.5, &answer));
    CHECK(answer);
    cbvh_scene_distance_answer nearest;
    OK(cbvh_scene_distance(scene, &nearest));
    CHECK(nearest.found && nearest.pair.a.id == a.id && nearest.pair.b.id == c.id &&
          nearest.nearest.distance == 0.275);
    size_t count;
    cbvh_scene_relation relations[3];
    OK(cbvh_scene_relations(scene, relations, 3, &count));
    CHECK(count == 1 && relations[0].relation == CBVH_B_IN_A && relations[0].pair.b.id == c.id);
    cbvh_scene_pair pairs[3];
    OK(cbvh_scene_pairs_within(scene, 0.5, pairs, 3, &count));
    CHECK(count == 2 && pairs[0].a.id == a.id && pairs[0].b.id == b.id && pairs[1].b.id == c.id);
    FAILS(cbvh_scene_pairs_within(scene, 0.5, pairs, 1, &count), CBVH_BUFFER_TOO_SMALL,
          "pairs: expected room for 2 elements, found room for 1");
    CHECK(count == 2);
    const cbvh_pose touching = shift(1, 0, 0);
    OK(cbvh_scene_set_poses(scene, &b, &touching, 1));
    OK(cbvh_scene_pairs_in_contact(scene, pairs, 3, &count));
    CHECK(count == 1 && pairs[0].a.id == a.id && pairs[0].b.id == b.id);
    cbvh_scene_clash clash[3];
    const cbvh_clash_options near = {.size = sizeof near, .clearance = 0.5};
    OK(cbvh_scene_clashes(scene, &near, clash, 3, &count));
    CHECK(count == 3 && clash[0].pair.b.id == b.id && clash[1].pair.b.id == c.id && clash[2].pair.a.id == b.id);
    CHECK(clash[0].clash.kind == CBVH_CLASH_TOUCHING && clash[0].clash.depth.lower == 0);
    CHECK(clash[1].clash.kind == CBVH_CLASH_CONTAINED && clash[1].clash.relation == CBVH_B_IN_A);
    CHECK(clash[2].clash.kind == CBVH_CLASH_NEAR && clash[2].clash.distance == 0.375);
    FAILS(cbvh_scene_clashes(scene, NULL, clash, 1, &count), CBVH_BUFFER_TOO_SMALL, "clashes: ");
    CHECK(count == 2);
    FAILS(cbvh_scene_contacts(scene, NULL, 0, &count), CBVH_BUFFER_TOO_SMALL, "contacts: ");
    CHECK(count > 0);
    OK(cbvh_scene_set_allowed(scene, a, b, 1));
    OK(cbvh_scene_collide(scene, &answer));
    CHECK(!answer);
    OK(cbvh_scene_set_allowed(scene, a, b, 0));
    OK(cbvh_scene_set_groups(scene, b, 1, 2));
    OK(cbvh_scene_set_groups(scene, a, 1, 2));
    OK(cbvh_scene_collide(scene, &answer));
    CHECK(!answer);
    OK(cbvh_scene_set_groups(scene, a, ~0u, ~0u));
    OK(cbvh_scene_set_groups(scene, b, ~0u, ~0u));
    /* The small cube comes out of the large one, through its face: from 0.1 to 1.1 along z, it touches at once it
     * reaches 0.375. */
    const cbvh_pose out = shift(0, 0, 1.1);
    cbvh_path path;
    cbvh_motion_answer way;
    OK(cbvh_path_between(&at_c, &out, &path));
    OK(cbvh_scene_motion(scene, &c, &path, 1, NULL, &way));
    CHECK(way.outcome == CBVH_HIT && way.instance_a.id == a.id && way.instance_b.id == c.id);
    CHECK(way.at >= 0.2749 && way.at < 0.2751 && way.free_until <= 0.275);
    OK(cbvh_scene_is_free(scene, &c, &path, 1, NULL, &answer));
    CHECK(!answer);
    OK(cbvh_path_free(path));
    course of = {.from = 4, .to = 3, .fails_after = 3, .code = 5};
    OK(cbvh_path_from_functions(course_pose, course_sagitta, NULL, &of, &path));
    FAILS(cbvh_scene_is_free(scene, &c, &path, 1, NULL, &answer), CBVH_CALLBACK_FAILED, "the code 5");
    of.fails_after = -1;
    OK(cbvh_scene_is_free(scene, &c, &path, 1, NULL, &answer));
    CHECK(answer);
    OK(cbvh_path_free(path));
    const double points[6] = {0, 0, 0.45, 5, 0, 0};
    cbvh_closest_point closest[2];
    cbvh_side sides[2];
    OK(cbvh_scene_signed_point_distances(scene, points, 2, INFINITY, closest));
    CHECK(closest[0].side == CBVH_INSIDE && fabs(closest[0].distance - 0.05) < 1e-15 && closest[0].instance.id == a.id);
    CHECK(closest[1].side == CBVH_OUTSIDE && closest[1].distance == 3.5 && closest[1].instance.id == b.id);
    OK(cbvh_scene_sides(scene, points, 2, sides));
    CHECK(sides[0] == CBVH_INSIDE && sides[1] == CBVH_OUTSIDE);
    const cbvh_ray ray = {{0.05, 0.05, 5}, {0, 0, -1}, INFINITY};
    cbvh_ray_hit hits[4];
    size_t hit_count;
    OK(cbvh_scene_all_hits(scene, &ray, 1, &hit_count, hits, 4, &count));
    CHECK(count == 4 && hit_count == 4 && hits[0].t == 4.5 && hits[0].instance.id == a.id &&
          hits[1].instance.id == c.id);
    OK(cbvh_scene_first_hits(scene, &ray, 1, hits));
    OK(cbvh_scene_any_hits(scene, &ray, 1, &answer));
    CHECK(hits[0].t == 4.5 && answer);
    const cbvh_segment segment = {{0, 0, 3}, {0, 0, 2}};
    bool sees;
    OK(cbvh_scene_visible(scene, &segment, 1, 0, &sees));
    OK(cbvh_scene_segment_hits(scene, &segment, 1, &answer));
    CHECK(sees == !answer);
    CHECK(!answer);
    char name[2];
    size_t length;
    cbvh_mesh of_c;
    OK(cbvh_scene_instance_name(scene, b, name, 2, &length));
    CHECK(length == 1 && strcmp(name, "b") == 0);
    FAILS(cbvh_scene_instance_name(scene, b, name, 1, &length), CBVH_BUFFER_TOO_SMALL,
          "buffer: expected room for 2 bytes, found room for 1");
    CHECK(length == 1 && name[0] == 0);
    OK(cbvh_scene_instance_name(scene, c, name, 2, &length));
    CHECK(length == 0);
    /* Text is cut between characters. */
    cbvh_instance accented;
    const cbvh_pose far = shift(0, 50, 0);
    char cut[4];
    OK(cbvh_scene_instance_mesh(scene, c, &of_c));
    OK(cbvh_scene_add(scene, of_c, &far, "a\u00e9", &accented));
    FAILS(cbvh_scene_instance_name(scene, accented, cut, 3, &length), CBVH_BUFFER_TOO_SMALL, "buffer: ");
    CHECK(length == 3 && strcmp(cut, "a") == 0);
    OK(cbvh_scene_instance_name(scene, accented, cut, 4, &length));
    CHECK(strcmp(cut, "a\u00e9") == 0);
    OK(cbvh_scene_remove(scene, accented));
    OK(cbvh_mesh_free(of_c));
    OK(cbvh_scene_remove(scene, b));
    FAILS(cbvh_scene_remove(scene, b), CBVH_NOT_FOUND, "was it removed?");
    cbvh_pose world;
    OK(cbvh_scene_instance_pose(scene, c, &world));
    CHECK(world.rows[11] == 0.1);
    uint64_t triangles;
    OK(cbvh_scene_instance_mesh(scene, c, &of_c));
    OK(cbvh_mesh_triangle_count(of_c, &triangles));
    CHECK(triangles == 12);
    OK(cbvh_scene_add(scene, of_c, &at_b, "b", &b));
    OK(cbvh_mesh_free(of_c));
    OK(cbvh_scene_instances(scene, found, 4, &count));
    CHECK(count == 3 && found[0].id == a.id && found[1].id == b.id && found[2].id == c.id);
    OK(cbvh_scene_find(scene, "b", &found[0]));
    CHECK(found[0].id == b.id);
    cbvh_stats stats;
    OK(cbvh_scene_stats(scene, &stats));
    OK(cbvh_scene_free(scene));
}

/* A ball around the origin. */
static cbvh_mesh ball(double radius) {
    const double origin[3] = {0, 0, 0};
    cbvh_mesh core, rounded;
    OK(cbvh_bake_cloud(origin, 1, &core));
    OK(cbvh_mesh_rounded(core, radius, &rounded));
    OK(cbvh_mesh_free(core));
    return rounded;
}

static bool touch(cbvh_mesh a, cbvh_mesh b, cbvh_pose pose) {
    bool answer;
    OK(cbvh_collide(querier, a, b, &pose, 1, &answer));
    return answer;
}

static double gap(cbvh_mesh a, cbvh_mesh b, cbvh_pose pose) {
    cbvh_distance_answer answer;
    OK(cbvh_distances(querier, a, b, &pose, 1, NULL, &answer));
    CHECK(answer.lower <= answer.distance && answer.distance <= answer.upper);
    return answer.distance;
}

/* Makes a mesh solid, and frees the handle that it was. */
static cbvh_mesh solid_of(cbvh_mesh core) {
    cbvh_mesh solid;
    OK(cbvh_mesh_solid(core, &solid));
    OK(cbvh_mesh_free(core));
    return solid;
}

/* Radii: balls, capsules and clouds, and what rays and points find of them. */
static void rounded(void) {
    const cbvh_mesh two = ball(2), three = ball(3), less = ball(3 - 0x1p-50), point = ball(0);
    const cbvh_pose here = shift(0, 0, 0), away = shift(3, 4, 0), far = shift(6, 8, 0);
    CHECK(touch(two, three, away) && !touch(two, less, away) && touch(three, two, away));
    CHECK(gap(two, three, far) == 5 && gap(two, three, away) == 0 && gap(two, less, away) > 0);
    bool near;
    OK(cbvh_within(querier, two, three, &far, 1, 5, &near));
    CHECK(near);
    double radius;
    bool is_solid;
    OK(cbvh_mesh_radius(two, &radius));
    OK(cbvh_mesh_is_solid(two, &is_solid));
    CHECK(radius == 2 && !is_solid);
    /* A radius replaces the last one, a clone has it, and neither the file nor an object of it. */
    cbvh_mesh again, other;
    OK(cbvh_mesh_rounded(two, 4, &again));
    OK(cbvh_mesh_clone(again, &other));
    OK(cbvh_mesh_free(again));
    OK(cbvh_mesh_radius(other, &radius));
    CHECK(radius == 4);
    OK(cbvh_mesh_object(other, 0, &again));
    OK(cbvh_mesh_radius(again, &radius));
    CHECK(radius == 0);
    OK(cbvh_mesh_free(again));
    OK(cbvh_mesh_free(other));
    unsigned char bytes[16384];
    size_t size;
    OK(cbvh_mesh_bytes(two, bytes, sizeof bytes, &size));
    OK(cbvh_mesh_from_bytes(bytes, size, &again));
    OK(cbvh_mesh_radius(again, &radius));
    CHECK(radius == 2);
    OK(cbvh_mesh_free(again));
    /* Points on all sides of a ball, and rays through it, past it and along it. */
    const double points[9] = {1, 0, 0, 2, 0, 0, 5, 0, 0};
    cbvh_side sides[3];
    cbvh_closest_point closest[3];
    OK(cbvh_sides(querier, two, NULL, points, 3, sides));
    CHECK(sides[0] == CBVH_INSIDE && sides[1] == CBVH_ON && sides[2] == CBVH_OUTSIDE);
    OK(cbvh_closest_points(querier, two, NULL, points, 3, INFINITY, closest));
    CHECK(closest[0].distance == 0 && closest[1].distance == 0 && closest[2].distance == 3);
    OK(cbvh_signed_point_distances(querier, two, NULL, points, 3, INFINITY, closest));
    CHECK(closest[0].side == CBVH_INSIDE && closest[0].distance == 1 && closest[2].distance == 3);
    const cbvh_ray rays[3] = {{{-5, 0, 0}, {1, 0, 0}, INFINITY},
                              {{-5, 2, 0}, {1, 0, 0}, INFINITY},
                              {{-5, 2 + 0x1p-50, 0}, {1, 0, 0}, INFINITY}};
    bool any[3];
    cbvh_ray_hit hits[3];
    size_t count;
    OK(cbvh_any_hits(querier, two, NULL, rays, 3, any));
    CHECK(any[0] && any[1] && !any[2]);
    OK(cbvh_first_hits(querier, two, NULL, rays, 3, hits));
    CHECK(fabs(hits[0].t - 3) < 1e-9 && hits[1].found && !hits[2].found);
    size_t counts[3];
    cbvh_ray_hit ends[4];
    OK(cbvh_all_hits(querier, two, NULL, rays, 3, counts, ends, 4, &count));
    CHECK(count == 4 && counts[0] == 2 && counts[1] == 2 && counts[2] == 0);
    CHECK(fabs(ends[0].t - 3) < 1e-9 && fabs(ends[1].t - 7) < 1e-9);
    OK(cbvh_all_hits(querier, point, NULL, rays, 3, NULL, hits, 3, &count));
    /* A capsule along z: beside its axis, and beyond a cap by 3-4-5. */
    const double from[3] = {0, 0, -1}, to[3] = {0, 0, 1};
    cbvh_mesh axis, capsule;
    OK(cbvh_bake_segment(from, to, &axis));
    OK(cbvh_mesh_rounded(axis, 0.5, &capsule));
    CHECK(gap(capsule, point, shift(2, 0, 0.75)) == 1.5 && gap(capsule, point, shift(3, 0, 5)) == 4.5);
    CHECK(touch(capsule, point, shift(0.5, 0, 0.25)) && !touch(capsule, point, shift(0.5, 0, 1 + 0x1p-20)));
    OK(cbvh_mesh_free(axis));
    OK(cbvh_mesh_free(capsule));
    /* Equal points of a cloud stay. */
    const double twice[9] = {0, 0, 0, 9, 0, 0, 0, 0, 0};
    cbvh_mesh core, cloud;
    OK(cbvh_bake_cloud(twice, 3, &core));
    OK(cbvh_mesh_rounded(core, 1, &cloud));
    cbvh_contact contacts[4];
    OK(cbvh_contacts(querier, cloud, point, &here, 1, NULL, contacts, 4, &count));
    CHECK(count == 2 && contacts[0].triangle_a == 0 && contacts[1].triangle_a == 2);
    CHECK(gap(cloud, two, shift(14, 0, 0)) == 2);
    OK(cbvh_mesh_free(core));
    OK(cbvh_mesh_free(cloud));
    /* A ball that moves at a ball: from 9 to 0, and they meet at 5. */
    cbvh_path path;
    cbvh_motion_answer motion;
    const cbvh_pose start = shift(9, 0, 0);
    OK(cbvh_path_between(&start, &here, &path));
    OK(cbvh_motions(querier, two, three, &path, 1, NULL, &motion));
    CHECK(motion.outcome == CBVH_HIT && fabs(motion.at - 4.0 / 9) < 1e-5 && motion.free_until <= 4.0 / 9);
    OK(cbvh_path_free(path));
    OK(cbvh_mesh_free(two));
    OK(cbvh_mesh_free(three));
    OK(cbvh_mesh_free(less));
    OK(cbvh_mesh_free(point));
}

/* Solids: what is inside touches, from either side, and nothing outside does. */
static void solids(void) {
    const cbvh_mesh point = ball(0), hollow = cube(1);
    const double cell[2] = {1, 2}, block[3] = {1, 1, 1}, plain[2] = {10, 4};
    const int32_t cells[12] = {0, 0, 0, 0, 0, -1, 0, 0, 0, -1, 0, 0};
    const int32_t parts[6] = {-2, 0, 0, 0, 0, 1};
    const uint32_t sizes[2] = {2, 1};
    const double points[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.25, 0.25, 0.25};
    cbvh_mesh all[8];
    double error_of_cylinder, error_of_cone;
    OK(cbvh_bake_box(block, &all[0]));
    OK(cbvh_bake_ground(plain, 0.75, &all[1]));
    OK(cbvh_bake_cylinder(0.5, 1, 0.001, &error_of_cylinder, &all[2]));
    OK(cbvh_bake_cone(0.5, 1, 0.001, &error_of_cone, &all[3]));
    OK(cbvh_bake_voxels(cells, 4, 0.5, &all[4]));
    OK(cbvh_mesh_clone(hollow, &all[5]));
    OK(cbvh_bake_octree(parts, sizes, 2, 0.5, &all[6]));
    OK(cbvh_bake_convex_hull(points, 5, &all[7]));
    /* The polyhedra are larger, by as much as they say. */
    CHECK(error_of_cylinder > 0 && error_of_cylinder < 0.001001 && error_of_cone > 0 && error_of_cone < 0.001001);
    const double beside = gap(all[2], point, shift(0.4, 0.6, 0)), exact = sqrt(0.52) - 0.5;
    CHECK(beside < exact && beside >= exact - error_of_cylinder);
    /* Each with a point inside, one beside it, and how far away that is at least. */
    const struct { double inside[3], outside[3], gap; } places[8] = {
        {{0.25, 0, 0}, {0, 2, 0}, 1.5},   {{4.5, 1, -0.5}, {0, 0, 1}, 1}, {{0.25, 0.25, 0}, {0, 0, 2.5}, 2},
        {{0, 0.25, 0.25}, {0, 0, -1}, 1}, {{-0.25, 0.125, 0.25}, {0.25, 0.25, 2}, 1.5}, {{0.125, 0, 0}, {1, 0, 0}, 0.5},
        {{0.25, 0.25, 0.75}, {1, 0.25, 0.75}, 0.5}, {{0.125, 0.25, 0.125}, {0.25, 0.25, -2}, 2},
    };
    for (int k = 0; k < 8; k++) {
        const cbvh_pose inside = shift(places[k].inside[0], places[k].inside[1], places[k].inside[2]);
        const cbvh_pose outside = shift(places[k].outside[0], places[k].outside[1], places[k].outside[2]);
        cbvh_pose back;
        OK(cbvh_pose_inverse(&inside, &back));
        CHECK(!touch(all[k], point, inside) && gap(all[k], point, inside) > 0);
        const cbvh_mesh solid = solid_of(all[k]);
        bool is_solid;
        OK(cbvh_mesh_is_solid(solid, &is_solid));
        CHECK(is_solid && touch(solid, point, inside) && touch(point, solid, back) && gap(solid, point, inside) == 0);
        const double least = places[k].gap - (k == 2 ? error_of_cylinder : 0), found = gap(solid, point, outside);
        CHECK(!touch(solid, point, outside) && least <= found && found <= places[k].gap);
        /* A radius keeps it solid, and is around it. */
        cbvh_mesh padded;
        OK(cbvh_mesh_rounded(solid, 0.125, &padded));
        OK(cbvh_mesh_is_solid(padded, &is_solid));
        CHECK(is_solid && touch(padded, point, inside) && gap(padded, point, outside) == found - 0.125);
        size_t count;
        OK(cbvh_contacts(querier, solid, point, &inside, 1, NULL, NULL, 0, &count));
        CHECK(count == 0);
        OK(cbvh_mesh_free(padded));
        OK(cbvh_mesh_free(solid));
    }
    /* Nobody may want to know how much larger they are. */
    cbvh_mesh mesh;
    OK(cbvh_bake_cylinder(1, 1, 10, NULL, &mesh));
    OK(cbvh_mesh_free(mesh));
    OK(cbvh_bake_cone(1, 1, 10, NULL, &mesh));
    OK(cbvh_mesh_free(mesh));
    /* Rows go along y: the point at x = 0, y = 2 has the fourth height. */
    const double heights[6] = {0, 0, 0, 1, 0, 0};
    uint64_t triangles;
    OK(cbvh_bake_height_field(heights, 3, 2, cell, &mesh));
    OK(cbvh_mesh_triangle_count(mesh, &triangles));
    CHECK(triangles == 4 && gap(mesh, point, shift(0, 2, 3)) == 2 && gap(mesh, point, shift(4, 0, 0)) == 2);
    cbvh_mesh solid = {7};
    FAILS(cbvh_mesh_solid(mesh, &solid), CBVH_INVALID_ARGUMENT,
          "expected closed objects, found object 0");
    CHECK(solid.id == 0);
    OK(cbvh_mesh_free(mesh));
    OK(cbvh_mesh_free(hollow));
    OK(cbvh_mesh_free(point));
}

/* Margins in a scene: of an instance, of a pair, and of copies. */
static void margins(void) {
    const cbvh_mesh one = ball(1);
    cbvh_scene scene, copy;
    cbvh_instance a, b, c;
    const cbvh_pose here = shift(0, 0, 0), at_b = shift(3, 4, 0), at_c = shift(0, 0, 100);
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
    OK(cbvh_scene_add(scene, one, &here, NULL, &a));
    OK(cbvh_scene_add(scene, one, &at_b, NULL, &b));
    OK(cbvh_scene_add(scene, one, &at_c, NULL, &c));
    OK(cbvh_mesh_free(one));
    bool answer;
    double margin, between;
    cbvh_scene_distance_answer nearest;
    OK(cbvh_scene_instance_margin(scene, a, &margin));
    OK(cbvh_scene_pair_margin(scene, a, b, &between));
    CHECK(margin == 0 && between == 0);
    OK(cbvh_scene_distance(scene, &nearest));
    CHECK(nearest.nearest.distance == 3);
    OK(cbvh_scene_set_margin(scene, a, 1));
    OK(cbvh_scene_set_pair_margin(scene, b, a, 1.5));
    OK(cbvh_scene_distance(scene, &nearest));
    CHECK(nearest.nearest.distance == 0.5 && nearest.pair.a.id == a.id && nearest.pair.b.id == b.id);
    OK(cbvh_scene_collide(scene, &answer));
    CHECK(!answer);
    OK(cbvh_scene_clone(scene, &copy));
    OK(cbvh_scene_set_margin(scene, b, 0.5));
    OK(cbvh_scene_collide(scene, &answer));
    CHECK(answer);
    OK(cbvh_scene_collide(copy, &answer));
    CHECK(!answer);
    OK(cbvh_scene_instance_margin(copy, a, &margin));
    OK(cbvh_scene_pair_margin(copy, a, b, &between));
    CHECK(margin == 1 && between == 1.5);
    OK(cbvh_scene_instance_margin(copy, b, &margin));
    OK(cbvh_scene_pair_margin(copy, c, b, &between));
    CHECK(margin == 0 && between == 0);
    /* The mesh of an instance has its own radius. */
    cbvh_mesh of_a;
    double radius;
    OK(cbvh_scene_instance_mesh(scene, a, &of_a));
    OK(cbvh_mesh_radius(of_a, &radius));
    CHECK(radius == 1);
    OK(cbvh_mesh_free(of_a));
    /* A margin is around an instance for probes, too. */
    const double point[3] = {0, 0, 5};
    cbvh_closest_point closest;
    OK(cbvh_scene_closest_points(scene, point, 1, INFINITY, &closest));
    CHECK(closest.distance == 3 && closest.instance.id == a.id);
    const cbvh_ray ray = {{0, 0, 50}, {0, 0, -1}, INFINITY};
    cbvh_ray_hit hits[2];
    size_t count;
    OK(cbvh_scene_all_hits(scene, &ray, 1, NULL, hits, 2, &count));
    CHECK(count == 2 && fabs(hits[0].t - 48) < 1e-9 && fabs(hits[1].t - 52) < 1e-9);
    /* What is removed takes the margins of its pairs along, and who is refused one keeps the last. */
    FAILS(cbvh_scene_set_margin(scene, a, -1), CBVH_INVALID_ARGUMENT,
          "margin: expected a length from 0 to 2^118, found -1");
    OK(cbvh_scene_instance_margin(scene, a, &margin));
    CHECK(margin == 1);
    OK(cbvh_scene_remove(scene, b));
    FAILS(cbvh_scene_set_margin(scene, b, 1), CBVH_NOT_FOUND, "was it removed?");
    FAILS(cbvh_scene_pair_margin(scene, a, b, &between), CBVH_NOT_FOUND, "was it removed?");
    OK(cbvh_scene_free(scene));
    OK(cbvh_scene_free(copy));
}

/* A radius and solidity that a file states are those of the mesh, and are saved. */
static void stated_radius(const char *folder) {
    cbvh_mesh mesh;
    const cbvh_bake_options options = {.size = sizeof options, .solid = 1, .radius = 0.25};
    OK(cbvh_bake(CUBE_VERTICES, 8, CUBE_FACES, 12, &options, &mesh));
    double radius = 0;
    OK(cbvh_mesh_radius(mesh, &radius));
    CHECK(radius == 0.25);
    char output[1000];
    snprintf(output, sizeof output, "%s/rounded.cbvh", folder);
    cbvh_mesh rounded, opened;
    OK(cbvh_mesh_rounded(mesh, 0.5, &rounded));
    OK(cbvh_mesh_save(rounded, output));
    OK(cbvh_mesh_open(output, CBVH_READ, &opened));
    OK(cbvh_mesh_radius(opened, &radius));
    CHECK(radius == 0.5);
    OK(cbvh_mesh_free(opened));
    OK(cbvh_mesh_free(rounded));
    OK(cbvh_mesh_free(mesh));
}

/* On request, coordinates are the nearest floats. That of 1000.3 is below it, so that the triangle does not reach it as it is
 * given. */
static void rounding(void) {
    const double far[] = {1000.3, 0, 0, 1000.4, 0, 0, 1000.3, 0.1, 0}, at[] = {(double)1000.3f, 0, 0};
    const uint32_t face[] = {0, 1, 2};
    const cbvh_bake_options to_float = {.size = sizeof to_float, .round = "f32"};
    cbvh_mesh mesh, dot;
    bool touches = false;
    OK(cbvh_bake(far, 3, face, 1, &to_float, &mesh));
    OK(cbvh_bake_cloud(at, 1, &dot));
    const cbvh_pose here = shift(0, 0, 0);
    OK(cbvh_collide(querier, mesh, dot, &here, 1, &touches));
    CHECK(touches);
    OK(cbvh_mesh_free(mesh));
    const cbvh_bake_options as_given = {.size = sizeof as_given, .round = "none"};
    OK(cbvh_bake(far, 3, face, 1, &as_given, &mesh));
    OK(cbvh_collide(querier, mesh, dot, &here, 1, &touches));
    CHECK(!touches);
    OK(cbvh_mesh_free(mesh));
    OK(cbvh_mesh_free(dot));
}

/* Attached instances follow their parents, in poses and on motions, and a mesh that is swapped keeps the rest. */
static void attached(void) {
    const cbvh_mesh one = cube(1), large = cube(6);
    cbvh_scene scene, copy;
    cbvh_instance wall, gripper, part, label, found;
    const cbvh_pose at_wall = shift(3, 0, 0), at_gripper = shift(0, 3, 0), at_part = shift(0, 0, 0), at_label = shift(0, 0, 5);
    OK(cbvh_scene_new(CBVH_BACKEND_BEST, &scene));
    OK(cbvh_scene_add(scene, one, &at_wall, NULL, &wall));
    OK(cbvh_scene_add(scene, one, &at_gripper, NULL, &gripper));
    OK(cbvh_scene_add(scene, one, &at_part, NULL, &part));
    OK(cbvh_scene_add(scene, one, &at_label, NULL, &label));
    FAILS(cbvh_scene_parent(scene, part, &found), CBVH_NOT_FOUND, "child: expected an attached instance, found");
    cbvh_path path;
    const cbvh_pose at_end = shift(8, 3, 0);
    bool answer;
    OK(cbvh_path_between(&at_gripper, &at_end, &path));
    OK(cbvh_scene_is_free(scene, &gripper, &path, 1, NULL, &answer));
    CHECK(answer);
    OK(cbvh_scene_attach(scene, part, gripper));
    OK(cbvh_scene_attach(scene, label, part));
    OK(cbvh_scene_parent(scene, label, &found));
    CHECK(found.id == part.id);
    cbvh_motion_answer motion;
    OK(cbvh_scene_motion(scene, &gripper, &path, 1, NULL, &motion));
    /* At 8 t = 2 the part touches the wall. */
    CHECK(motion.outcome == CBVH_HIT && motion.instance_a.id == wall.id && motion.instance_b.id == part.id);
    CHECK(motion.free_until <= 0.25 && motion.at >= 0.25 && motion.at < 0.25 + 1e-6);
    FAILS(cbvh_scene_attach(scene, gripper, label), CBVH_INVALID_ARGUMENT,
          "instance 1: expected a parent that does not move with it, found 3");
    FAILS(cbvh_scene_attach(scene, part, part), CBVH_INVALID_ARGUMENT, "instance 2: expected a parent");
    const cbvh_pose turned = random_pose(&(random_source){9}, 2);
    cbvh_pose world[2];
    const cbvh_instance both[2] = {gripper, part};
    OK(cbvh_scene_clone(scene, &copy));
    OK(cbvh_scene_set_poses(scene, &gripper, &turned, 1));
    for (int k = 0; k < 2; k++) {
        const cbvh_pose kept = shift(0, -3, k == 0 ? 0 : 5);
        cbvh_pose expected;
        OK(cbvh_pose_then(&kept, &turned, &expected));
        OK(cbvh_scene_instance_pose(scene, k == 0 ? part : label, &world[0]));
        for (int n = 0; n < 12; n++) {
            CHECK(fabs(world[0].rows[n] - expected.rows[n]) < 1e-14);
        }
    }
    OK(cbvh_scene_instance_pose(copy, part, &world[0]));
    CHECK(memcmp(&world[0], &at_part, sizeof at_part) == 0);
    /* Each where it is put, in any order; and none, if one that follows would be too far away. */
    const cbvh_pose places[2] = {shift(0, 9, 0), shift(0, 8, 0)}, far_away = shift(0x1p118, 0, 0);
    OK(cbvh_scene_set_poses(scene, both, places, 2));
    OK(cbvh_scene_instance_pose(scene, part, &world[1]));
    CHECK(memcmp(&world[1], &places[1], sizeof *world) == 0);
    const cbvh_pose near_far = shift(0x1p117, 0, 0);
    OK(cbvh_scene_set_poses(scene, &part, &near_far, 1));
    FAILS(cbvh_scene_set_poses(scene, &gripper, &far_away, 1), CBVH_INVALID_ARGUMENT, "instance 2: expected a translation");
    OK(cbvh_scene_instance_pose(scene, gripper, &world[0]));
    CHECK(memcmp(&world[0], &places[0], sizeof *world) == 0);
    OK(cbvh_scene_detach(scene, part));
    OK(cbvh_scene_detach(scene, part));
    OK(cbvh_scene_remove(scene, gripper));
    FAILS(cbvh_scene_detach(scene, gripper), CBVH_NOT_FOUND, "was it removed?");
    FAILS(cbvh_scene_attach(scene, part, gripper), CBVH_NOT_FOUND, "was it removed?");
    /* Another mesh in the same place. */
    OK(cbvh_scene_set_margin(copy, wall, 0.25));
    OK(cbvh_scene_collide(copy, &answer));
    CHECK(!answer);
    OK(cbvh_scene_set_mesh(copy, wall, large));
    OK(cbvh_scene_collide(copy, &answer));
    CHECK(answer);
    double margin;
    OK(cbvh_scene_instance_margin(copy, wall, &margin));
    CHECK(margin == 0.25);
    FAILS(cbvh_scene_set_mesh(copy, gripper, (cbvh_mesh){0}), CBVH_INVALID_HANDLE, "mesh: ");
    FAILS(cbvh_scene_set_mesh(scene, gripper, one), CBVH_NOT_FOUND, "was it removed?");
    OK(cbvh_path_free(path));
    OK(cbvh_scene_free(scene));
    OK(cbvh_scene_free(copy));
    OK(cbvh_mesh_free(one));
    OK(cbvh_mesh_free(large));
}

/* The warnings of a bake: those of the last one, once for what it left out. */
static void bake_warnings(const char *folder) {
    char input[1000], output[1000], warning[2000];
    const char *const inputs[1] = {input};
    size_t length = 0;
    snprintf(input, sizeof input, "%s/line.obj", folder);
    snprintf(output, sizeof output, "%s/line.cbvh", folder);
    FAILS(cbvh_bake_warning(0, warning, sizeof warning, &length), CBVH_NOT_FOUND, "expected a warning of the last bake");
    FILE *file = fopen(input, "w");
    CHECK(file != NULL);
    CHECK(fputs("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2\n", file) >= 0);
    CHECK(fclose(file) == 0);
    OK(cbvh_bake_files(inputs, 1, output, NULL, NULL));
    OK(cbvh_bake_warning(0, warning, sizeof warning, &length));
    CHECK(strstr(warning, "line.obj: line 5: left out 1 face of fewer than three corners") != NULL);
    CHECK(length == strlen(warning));
    FAILS(cbvh_bake_warning(0, warning, 9, &length), CBVH_BUFFER_TOO_SMALL, "buffer: ");
    CHECK(length > 9 && strlen(warning) == 8);
    FAILS(cbvh_bake_warning(1, warning, sizeof warning, &length), CBVH_NOT_FOUND, "found the number 1");
    OK(cbvh_bake_files(inputs, 1, output, NULL, NULL));
    FAILS(cbvh_bake_warning(0, warning, sizeof warning, &length), CBVH_NOT_FOUND, "found the number 0");
}

/* Files: baked, opened in all ways, and a scene file, in the folder that the program is given. */
static void files(const char *folder, const char *testdata) {
    char input[1000], output[1000];
    const char *const inputs[1] = {input};
    snprintf(input, sizeof input, "%s/fclrob.obj", testdata);
    snprintf(output, sizeof output, "%s/fclrob.cbvh", folder);
    int32_t up_to_date = 7;
    const cbvh_bake_options packed = {.size = sizeof packed, .triangles = "packed"};
    OK(cbvh_bake_files(inputs, 1, output, &packed, &up_to_date));
    CHECK(up_to_date == 0);
    OK(cbvh_bake_files(inputs, 1, output, &packed, &up_to_date));
    CHECK(up_to_date == 1);
    /* A bake that is stopped leaves the output as it is. */
    cbvh_bake_options stopped = {.size = sizeof stopped, .force = 1};
    OK(cbvh_stop_new(&stopped.stop));
    OK(cbvh_stop_set(stopped.stop));
    FAILS(cbvh_bake_files(inputs, 1, output, &stopped, &up_to_date), CBVH_STOPPED, "found it stopped");
    OK(cbvh_stop_free(stopped.stop));
    OK(cbvh_bake_files(inputs, 1, output, &packed, &up_to_date));
    CHECK(up_to_date == 1);
    bake_warnings(folder);
    uint64_t triangles[4];
    cbvh_mesh opened[4];
    for (cbvh_open_mode mode = CBVH_MAP; mode <= CBVH_READ; mode++) {
        OK(cbvh_mesh_open(output, mode, &opened[mode]));
        OK(cbvh_mesh_validate(opened[mode]));
        OK(cbvh_mesh_triangle_count(opened[mode], &triangles[mode]));
        CHECK(triangles[mode] == 216);
    }
    OK(cbvh_mesh_save(opened[1], output));
    for (int mode = 0; mode < 4; mode++) {
        OK(cbvh_mesh_free(opened[mode]));
    }
    snprintf(input, sizeof input, "%s/ok-scene.cbvh", testdata);
    cbvh_scene scene, again;
    size_t count, objects, length;
    OK(cbvh_scene_open(input, &scene));
    FAILS(cbvh_scene_instances(scene, NULL, 0, &count), CBVH_BUFFER_TOO_SMALL, "instances: ");
    CHECK(count > 0);
    cbvh_mesh mesh, object;
    OK(cbvh_mesh_open(input, CBVH_MAP, &mesh));
    OK(cbvh_scene_of_mesh(mesh, &again));
    OK(cbvh_mesh_object_count(mesh, &objects));
    for (size_t number = 0; number < objects; number++) {
        char name[100];
        size_t same;
        OK(cbvh_mesh_object_name(mesh, number, name, sizeof name, &length));
        CHECK(strlen(name) == length);
        OK(cbvh_mesh_find(mesh, name, &same));
        CHECK(same <= number);
        OK(cbvh_mesh_object(mesh, number, &object));
        OK(cbvh_mesh_free(object));
    }
    OK(cbvh_mesh_free(mesh));
    OK(cbvh_scene_free(again));
    OK(cbvh_scene_free(scene));
    snprintf(input, sizeof input, "%s/bad-R05-truncated.cbvh", testdata);
    FAILS(cbvh_mesh_open(input, CBVH_MAP, &mesh), CBVH_DAMAGED, "R05");
    snprintf(input, sizeof input, "%s/bad-R27-flipped-bit.cbvh", testdata);
    OK(cbvh_mesh_open(input, CBVH_MAP, &mesh));
    FAILS(cbvh_mesh_validate(mesh), CBVH_DAMAGED, "R27");
    OK(cbvh_mesh_free(mesh));
    /* A pipe that nobody writes to. */
    snprintf(output, sizeof output, "%s/pipe", folder);
    CHECK(mkfifo(output, 0600) == 0);
    FAILS(cbvh_mesh_open(output, CBVH_MAP, &mesh), CBVH_SYSTEM, "pipe: expected a regular file, found another kind");
    FAILS(cbvh_scene_open(output, &scene), CBVH_SYSTEM, "pipe: expected a regular file");
    FAILS(cbvh_mesh_open(folder, CBVH_READ, &mesh), CBVH_SYSTEM, folder);
    /* Duplicates are stored once. */
    const uint32_t faces[9] = {0, 1, 2, 0, 1, 3, 0, 1, 2};
    uint32_t twins[2];
    OK(cbvh_bake(CUBE_VERTICES, 8, faces, 3, NULL, &mesh));
    OK(cbvh_mesh_triangle_count(mesh, &triangles[0]));
    OK(cbvh_mesh_duplicates(mesh, 0, twins, 2, &count));
    CHECK(triangles[0] == 2 && count == 1 && twins[0] == 2);
    OK(cbvh_mesh_free(mesh));
}

int main(int count, char **arguments) {
    CHECK(count == 3);
    uint32_t abi = 7;
    OK(cbvh_abi(&abi));
    CHECK(abi == CBVH_ABI);
    OK(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));
    cubes(", one core");
    OK(cbvh_querier_set_parallel(querier, 1));
    cubes(", all cores");
    OK(cbvh_querier_set_parallel(querier, 0));
    lists();
    overlaps();
    signed_distances();
    for (int32_t choices = 0; choices < 4; choices++) {
        signed_distances_of_scenes(choices & 1, choices >> 1);
    }
    clashes();
    intersections();
    self_contacts();
    open_edges();
    borrowed();
    paths();
    trackers();
    scenes(0, 0);
    scenes(1, 1);
    rounded();
    solids();
    margins();
    stated_radius(arguments[1]);
    rounding();
    attached();
    files(arguments[1], arguments[2]);
    OK(cbvh_querier_free(querier));
    puts("behaviour: as the header says");
    return 0;
}
