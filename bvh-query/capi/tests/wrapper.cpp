// The C++ header: handles that are freed once, copies, moves, exceptions, matrices of other libraries, and answers.
#include <cbvh.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <unordered_set>

#define CHECK(is_true)                                                                                                 \
    do {                                                                                                               \
        if (!(is_true)) {                                                                                              \
            std::fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #is_true);                                         \
            std::exit(1);                                                                                              \
        }                                                                                                              \
    } while (0)

namespace {

// The status and message of the Error that a call throws.
template <class Call> void fails(Call call, cbvh_status status, const char *text, int line) {
    try {
        call();
    } catch (const cbvh::Error &error) {
        if (error.status() == status && std::strstr(error.what(), text) != nullptr) {
            return;
        }
        std::fprintf(stderr, "line %d: %d, %s\n", line, error.status(), error.what());
        std::exit(1);
    }
    std::fprintf(stderr, "line %d: nothing was thrown\n", line);
    std::exit(1);
}
#define FAILS(call, status, text) fails([&] { static_cast<void>(call); }, status, text, __LINE__)

// As matrices of Eigen are, column by column in float or double.
template <class Number> struct Columns {
    Number numbers[16];
    Number operator()(int row, int column) const { return numbers[4 * column + row]; }
};

cbvh::Mesh cube(double size) {
    std::vector<cbvh::Point> vertices;
    for (int corner = 0; corner < 8; corner++) {
        vertices.push_back({size * ((corner & 1) - 0.5), size * ((corner >> 1 & 1) - 0.5), size * ((corner >> 2) - 0.5)});
    }
    return cbvh::Mesh::bake(vertices, {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                       {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}});
}

void poses() {
    // A turn about z by a quarter, and a translation, in each of the ways to give it.
    const cbvh::Pose expected({0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7});
    const std::array<double, 12> array{0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7};
    const Columns<double> columns{{0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}};
    const Columns<float> floats{{0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}};
    const double half = std::sqrt(0.5);
    const cbvh::Pose all[] = {
        cbvh::Pose(array),
        cbvh::Pose::from_matrix(columns),
        cbvh::Pose::from_matrix(floats),
        cbvh::Pose::from_rows({0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7, 0, 0, 0, 1}),
        cbvh::Pose::from_columns({0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}),
        cbvh::Pose::from_quaternion({0, 0, half, half}, {5, 6, 7}),
        expected.inverse().inverse(),
        cbvh::Pose(expected).nearest(),
        cbvh::Pose().then(expected),
        cbvh::Pose::relative({}, expected),
    };
    for (const cbvh::Pose &pose : all) {
        for (int k = 0; k < 12; k++) {
            CHECK(std::abs(pose.rows[k] - expected.rows[k]) < 1e-15);
        }
    }
    // First by (1, 0, 0), then turned: (0, 1, 0) and the translation.
    const cbvh::Pose part = cbvh::Pose::translation(1, 0, 0).then(expected);
    CHECK(part.rows[3] == 5 && part.rows[7] == 7 && part.rows[11] == 7);
    FAILS(cbvh::Pose::from_rows({0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}), CBVH_INVALID_ARGUMENT, "row 4: expected 0 0 0 1");
    expected.check_rigid();
    FAILS(cbvh::Pose({2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}).check_rigid(), CBVH_INVALID_ARGUMENT, "pose");
    FAILS(cbvh::Pose::from_quaternion({0, 0, 3, 4}, {0, 0, 0}), CBVH_INVALID_ARGUMENT, "length 1");
}

void handles() {
    cbvh::Mesh mesh = cube(1), copy = mesh, moved = std::move(mesh);
    CHECK(copy.raw().id != moved.raw().id && mesh.raw().id == 0); // NOLINT: what is moved from holds none.
    FAILS(mesh.triangle_count(), CBVH_INVALID_HANDLE, "found 0, no handle");
    mesh = copy;
    CHECK(mesh.triangle_count() == 12 && mesh.object_count() == 1 && mesh.object_name(0).empty());
    mesh = std::move(copy);
    CHECK(mesh.object(0).bytes() == moved.bytes() && mesh.find("") == std::size_t{0} && !mesh.find("x"));
    const auto bytes = mesh.bytes();
    const cbvh::Mesh again = cbvh::Mesh::from_bytes(bytes.data(), bytes.size());
    again.validate();
    FAILS(cbvh::Mesh::open("/no such folder/x.cbvh"), CBVH_SYSTEM, "x.cbvh");
    FAILS(mesh.object(1), CBVH_NOT_FOUND, "number: expected a number below 1");
    cbvh::BakeOptions options;
    options.profile = "dop7";
    FAILS(cbvh::Mesh::bake({}, {}, options), CBVH_INVALID_ARGUMENT, "options.profile");
    options.profile.clear();
    options.round = "f16";
    FAILS(cbvh::Mesh::bake({}, {}, options), CBVH_INVALID_ARGUMENT, "options.round");
    options.round.clear();
    // Text is not cut at a zero byte.
    const std::string cut("a\0b", 3);
    options.profile = cut;
    const char *const expected = "expected text without zero bytes, found one at byte 1";
    FAILS(cbvh::Mesh::bake({}, {}, options), CBVH_INVALID_ARGUMENT, expected);
    FAILS(cbvh::Mesh::open(cut), CBVH_INVALID_ARGUMENT, expected);
    FAILS(cbvh::Scene::open(cut), CBVH_INVALID_ARGUMENT, expected);
    FAILS(cbvh::Mesh::bake_files({cut}, "b"), CBVH_INVALID_ARGUMENT, expected);
    FAILS(cbvh::Mesh::bake_files({"a"}, cut), CBVH_INVALID_ARGUMENT, expected);
    FAILS(mesh.save(cut), CBVH_INVALID_ARGUMENT, expected);
    FAILS(mesh.find(cut), CBVH_INVALID_ARGUMENT, expected);
    cbvh::Scene scene;
    FAILS(scene.add(mesh, cbvh::Pose(), cut), CBVH_INVALID_ARGUMENT, expected);
    FAILS(scene.find(cut), CBVH_INVALID_ARGUMENT, expected);
    cbvh::Querier one, other = std::move(one);
    one = std::move(other);
    CHECK(one.collide(mesh, moved, cbvh::Pose()));
    FAILS(other.collide(mesh, moved, cbvh::Pose()), CBVH_INVALID_HANDLE, "querier"); // NOLINT
}

void answers(bool parallel) {
    const cbvh::Mesh one = cube(1), quarter = cube(0.25);
    cbvh::Querier querier;
    querier.set_parallel(parallel);
    const std::vector<cbvh::Pose> poses{cbvh::Pose(), cbvh::Pose::translation(1, 0, 0), cbvh::Pose::translation(1.5, 0, 0)};
    CHECK(querier.collide(one, one, poses) == std::vector<bool>({true, true, false}));
    CHECK(querier.within(one, one, poses, 0.5) == std::vector<bool>({true, true, true}) && !querier.within(one, one, poses[2], 0.4));
    CHECK(querier.relations(one, quarter, poses)[0] == CBVH_B_IN_A && querier.relation(quarter, one, poses[0]) == CBVH_A_IN_B);
    CHECK(querier.distance(one, one, poses)[2].distance == 0.5 && querier.distance(one, one, poses[2], {0.1, 0}).upper <= 0.55);
    const auto lists = querier.contacts(one, one, poses);
    CHECK(lists.size() == 3 && !lists[0].empty() && !lists[1].empty() && lists[2].empty());
    const auto single = querier.contacts(one, one, poses[1]);
    CHECK(single.size() == lists[1].size() && std::memcmp(single.data(), lists[1].data(), single.size() * sizeof single[0]) == 0);
    CHECK(querier.first_collision(one, one, poses) == std::size_t{0} && !querier.first_collision(one, one, {poses[2]}));
    CHECK(querier.collide(one, one, std::vector<cbvh::Pose>()).empty());
    const std::vector<cbvh::Point> points{{0, 0, 0.25}, {0, 0, 2}};
    const auto signs = querier.signed_point_distances(one, points);
    CHECK(cbvh::signed_point_distance(*signs[0]) == -0.25 && cbvh::signed_point_distance(*signs[1]) == 1.5);
    const auto placed = querier.signed_point_distances(one, points, cbvh::Pose::translation(0, 0, 2), 1.5);
    CHECK(cbvh::signed_point_distance(*placed[0]) == 1.25 && cbvh::signed_point_distance(*placed[1]) == -0.5);
    CHECK(!querier.signed_point_distances(one, points, {}, 1)[1] && querier.signed_point_distance(one, points[0])->side == CBVH_INSIDE);
    CHECK(querier.side(one, points[0]) == CBVH_INSIDE && querier.side(one, {0.5, 0, 0}) == CBVH_ON);
    const auto triangle = cbvh::Mesh::bake({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
    CHECK(std::isnan(cbvh::signed_point_distance(*querier.signed_point_distance(triangle, {0.2, 0.2, 0.1}))));
    CHECK(querier.sides(one, points) == std::vector<cbvh_side>({CBVH_INSIDE, CBVH_OUTSIDE}));
    const auto near = querier.closest_points(one, points, {}, 1);
    CHECK(near[0] && near[0]->distance == 0.25 && !near[1]);
    CHECK(querier.closest_point(one, points[1], cbvh::Pose::translation(0, 0, 1), 10)->distance == 0.5);
    // Braces are the pose that moves nothing, not a distance.
    CHECK(querier.closest_points(one, points, {})[1]->distance == 1.5 && querier.closest_point(one, points[1], {}));
    const std::vector<cbvh::Ray> rays{{{0.1, 0.2, 5}, {0, 0, -1}}, {{0.1, 0.2, 5}, {0, 0, -1}, 4}};
    CHECK(querier.first_hits(one, rays)[0]->t == 4.5 && !querier.first_hits(one, rays)[1]);
    CHECK(querier.first_hit(one, rays[0])->t == 4.5 && !querier.first_hit(one, rays[1]));
    CHECK(querier.any_hit(one, rays[0]) && !querier.any_hit(one, rays[0], cbvh::Pose::translation(3, 0, 0)));
    CHECK(querier.all_hits(one, rays)[0].size() == 2 && querier.any_hits(one, rays) == std::vector<bool>({true, false}));
    CHECK(querier.segment_hits(one, {{{0, 0, 0}, {0, 0, 1}}, {{0, 0, 0}, {0, 0, 0.1}}}) == std::vector<bool>({true, false}));
    CHECK(querier.visible(one, {{{0, 0, 0}, {0, 0, 1}}, {{0, 0, 0}, {0, 0, 0.1}}}) == std::vector<bool>({false, true}));
    cbvh::Tracker tracker;
    for (const cbvh::Pose &pose : poses) {
        CHECK(tracker.collide(querier, one, one, pose) == querier.collide(one, one, pose));
        CHECK(tracker.distance(querier, one, one, pose).distance == querier.distance(one, one, pose).distance);
        CHECK(tracker.within(querier, one, one, pose, 0.5));
    }
    CHECK(tracker.collide(querier, one, one, poses) == querier.collide(one, one, poses));
    CHECK(tracker.within(querier, one, one, poses, 0.4) == querier.within(one, one, poses, 0.4));
    CHECK(tracker.distance(querier, one, one, poses)[2].distance == 0.5);
    CHECK(tracker.signed_distance(querier, one, one, poses)[2].lower == querier.signed_distance(one, one, poses)[2].lower);
    CHECK(tracker.signed_distance(querier, one, one, poses[0]).upper == querier.signed_distance(one, one, poses[0]).upper);
    const std::vector<cbvh::Pose> fewer{poses[0]};
    FAILS(querier.edges_are_free(one, one, poses, fewer), CBVH_INVALID_ARGUMENT, "as many ends as starts");
    FAILS(querier.within(one, one, poses, -1), CBVH_INVALID_ARGUMENT, "d: ");
}

// Where and how deep cubes overlap.
void overlaps() {
    const cbvh::Mesh one = cube(1);
    cbvh::Querier querier;
    const cbvh::Pose corner = cbvh::Pose::translation(0.75, 0.125, 0.0625), away = cbvh::Pose::translation(3, 0, 0);
    const std::vector<cbvh::Pose> poses{corner, away};
    CHECK(std::abs(querier.separation(one, one, corner, {0, 0, 2}).upper - 0.9375) < 1e-6);
    const auto ways = querier.separation(one, one, poses, {{1, 0, 0}, {1, 0, 0}});
    CHECK(std::abs(ways[0].upper - 0.25) < 1e-6 && ways[1].upper == 0);
    FAILS(querier.separation(one, one, poses, {{1, 0, 0}}), CBVH_INVALID_ARGUMENT, "as many directions as poses");
    FAILS(querier.separation(one, one, corner, {0, 0, 0}), CBVH_INVALID_ARGUMENT, "directions[0]: ");
    const auto depth = querier.penetration(one, one, corner);
    CHECK(depth.lower <= 0.25 && depth.upper >= 0.25 && depth.upper < 0.2525 && !depth.is_spent);
    CHECK(querier.penetration(one, one, poses, {0, 0.1})[0].lower > 0.1 && querier.penetration(one, one, poses)[1].upper == 0);
    const auto number = querier.signed_distance(one, one, corner);
    CHECK(number.lower <= -0.25 && number.upper >= -0.25 && number.is_signed && number.normal[0] > 0.9);
    const auto numbers = querier.signed_distance(one, one, poses);
    CHECK(std::memcmp(&number, &numbers[0], sizeof number) == 0 && numbers[1].lower <= 2 && numbers[1].upper >= 2);
    CHECK(querier.signed_distance(one, one, poses, {0, 0.1})[0].upper < -0.1 && numbers[1].point_b[0] == 2.5);
    FAILS(querier.signed_distance(one, one, corner, {-1}), CBVH_INVALID_ARGUMENT, "relative_gap: ");
    const cbvh::ClashOptions near{2.5, 0.1, 0, 0};
    const auto clash = querier.clash(one, one, poses, near);
    CHECK(clash[0].kind == CBVH_CLASH_OVERLAPPING && clash[1].kind == CBVH_CLASH_NEAR && clash[1].distance == 2);
    CHECK(querier.clash(one, one, corner).depth.lower > 0.2 && querier.clash(one, one, away).kind == CBVH_CLASH_APART);
    FAILS(querier.clash(one, one, corner, {-1}), CBVH_INVALID_ARGUMENT, "clearance: ");
    const auto shared = querier.intersection(one, one, corner);
    CHECK(shared.volume > 0 && shared.bounds[1][0] == 0.5 && querier.intersection(one, one, poses)[1].volume == 0);
    const auto measured = querier.measured_clash(one, one, poses, near);
    CHECK(measured[0].clash.kind == CBVH_CLASH_PROTRUDING && measured[0].shared.volume == shared.volume);
    CHECK(measured[1].clash.kind == CBVH_CLASH_NEAR && std::isnan(measured[1].shared.volume));
    CHECK(querier.measured_clash(one, one, corner).shared.volume == shared.volume);
    FAILS(querier.measured_clash(one, one, corner, {-1}), CBVH_INVALID_ARGUMENT, "clearance: ");
    cbvh::Scene scene;
    scene.add(one, {});
    scene.add(one, corner);
    const auto deepest = scene.signed_distance();
    CHECK(deepest->nearest.lower <= -0.25 && deepest->nearest.upper >= -0.25 && deepest->nearest.is_signed);
    CHECK(scene.signed_distance({0, 0.1})->nearest.upper < -0.1 && !cbvh::Scene().signed_distance());
    FAILS(scene.signed_distance({-1}), CBVH_INVALID_ARGUMENT, "relative_gap: ");
    const auto close = scene.near_pairs(0);
    CHECK(!close.empty() && close[0].pair.a == deepest->pair.a && close[0].distance == deepest->nearest.lower);
    FAILS(scene.near_pairs(-1), CBVH_INVALID_ARGUMENT, "margin: ");
    const auto clashes = scene.clashes(near);
    CHECK(clashes.size() == 1 && clashes[0].clash.kind == CBVH_CLASH_OVERLAPPING && scene.clashes().size() == 1);
    FAILS(scene.clashes({0, -1}), CBVH_INVALID_ARGUMENT, "tolerance: ");
    CHECK(scene.measured_clashes().size() == 1 && scene.measured_clashes(near)[0].shared.volume == shared.volume);
    FAILS(scene.measured_clashes({0, -1}), CBVH_INVALID_ARGUMENT, "tolerance: ");
    const auto regions = querier.contact_regions(one, one, corner);
    CHECK(regions.size() == querier.contacts(one, one, corner).size() && regions[0].count > 0);
    const auto lists = querier.contact_regions(one, one, poses);
    CHECK(lists[0].size() == regions.size() && lists[1].empty());
    const auto found = querier.patches(one, one, corner);
    CHECK(found.patches.size() == 1 && found.regions.size() == regions.size() && found.total == regions.size());
    CHECK(std::abs(found.patches[0].length - 4.125) < 1e-9 && querier.patches(one, one, away).patches.empty());
    const auto few = querier.patches(one, one, corner, {0, 5});
    CHECK(few.regions.size() == 5 && few.total == regions.size());
    const auto sunk = querier.contact_points(one, one, cbvh::Pose::translation(0.125, 0.25, 0.9375));
    CHECK(sunk.patches.size() == 1 && sunk.points.size() == 4 && sunk.points[3].patch == 0 && sunk.points[0].depth > 0.06);
    CHECK(querier.contact_points(one, one, away).points.empty());
    CHECK(querier.self_contacts(one).empty());
    const cbvh::Mesh twice = cbvh::Mesh::bake({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {2, 1, 0}});
    CHECK(one.open_edges().empty() && one.open_edge_counts().boundary == 0 && one.open_edges_text() == "no edge is open");
    const cbvh::Mesh sheet = cbvh::Mesh::bake({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
    CHECK(sheet.open_edges().size() == 3 && sheet.open_edge_counts().boundary == 3);
    CHECK(sheet.open_edges_text().rfind("3 edges have one triangle; ", 0) == 0);
    const auto own = querier.self_contacts(twice);
    CHECK(own.size() == 1 && own[0].triangle_b == 1 && own[0].kind == CBVH_SELF_DUPLICATE);
}

// Lists that are longer than there is room for, and shorter again.
void lists() {
    std::vector<cbvh::Point> vertices;
    std::vector<std::array<std::uint32_t, 3>> faces;
    for (std::uint32_t k = 0; k < 100; k++) {
        vertices.insert(vertices.end(), {{0, 0, 0.01 * k}, {1, 0, 0.01 * k}, {0, 1, 0.01 * k}});
        faces.push_back({3 * k, 3 * k + 1, 3 * k + 2});
    }
    const cbvh::Mesh sheets = cbvh::Mesh::bake(vertices, faces);
    const cbvh::Mesh needle = cbvh::Mesh::bake({{0.2, 0.2, -1}, {0.3, 0.2, -1}, {0.2, 0.2, 2}}, {{0, 1, 2}});
    cbvh::Querier querier;
    const cbvh::Pose below = cbvh::Pose::translation(0, 0, -1.5);
    for (const unsigned most : {100U, 51U, 100U}) {
        CHECK(querier.contacts(sheets, needle, most == 100 ? cbvh::Pose() : below).size() == most);
        const auto contacts = querier.contacts(sheets, needle, {cbvh::Pose(), below, cbvh::Pose::translation(5, 0, 0)});
        CHECK(contacts[0].size() == 100 && contacts[1].size() == 51 && contacts[2].empty());
        CHECK(querier.contact_regions(sheets, needle, most == 100 ? cbvh::Pose() : below).size() == most);
        const auto patches = querier.patches(sheets, needle, most == 100 ? cbvh::Pose() : below);
        CHECK(patches.patches.size() == most && patches.regions.size() == most);
        const auto hits = querier.all_hits(sheets, {{{0.2, 0.2, 5}, {0, 0, -1}}, {{5, 5, 5}, {0, 0, -1}}});
        CHECK(hits[0].size() == 100 && hits[1].empty());
    }
    // A question that was asked twice is asked once the next time.
    cbvh::detail::Room room;
    int asked = 0;
    for (const std::size_t length : {100U, 100U, 3U, 100U}) {
        const auto list = cbvh::detail::list<int>(room, [&](int *, std::size_t capacity, std::size_t *count) {
            asked++;
            *count = length;
            return length > capacity ? CBVH_BUFFER_TOO_SMALL : CBVH_OK;
        });
        CHECK(list.size() == length);
    }
    CHECK(asked == 6);
    cbvh::Scene scene;
    const cbvh::Instance still = scene.add(sheets, cbvh::Pose());
    for (int k = 0; k < 3; k++) {
        scene.add(needle, cbvh::Pose());
    }
    CHECK(scene.contacts().size() >= 300 && scene.pairs_in_contact().size() == 6 && scene.contacts()[0].pair.a == still);
    CHECK(scene.all_hits({{{0.2, 0.2, 5}, {0, 0, -1}}})[0].size() >= 100);
}

struct Line {
    double height;
    bool throws;
    cbvh::Pose pose(double t) const {
        if (throws && t > 0.3) {
            throw std::runtime_error("no pose");
        }
        return cbvh::Pose::translation(-4 + 8 * t, height, 0);
    }
    double sagitta(double, double, double) const { return 1e-14; }
};

// Frees its own path in the middle of a question: what it is made of lives until the question has ended.
struct Leaving {
    std::shared_ptr<std::optional<cbvh::Path>> own;
    std::shared_ptr<int> kept;
    bool throws;
    cbvh::Pose pose(double t) const {
        own->reset();
        CHECK(*kept == 7);
        return cbvh::Pose::translation(-4 + 8 * t, 2, 0);
    }
    double sagitta(double, double, double) const {
        if (throws) {
            throw 7;
        }
        return 1e-14;
    }
};

void motions() {
    const cbvh::Mesh mesh = cube(1);
    cbvh::Querier querier;
    const cbvh::Path through = cbvh::Path::of(Line{0, false}), beside = cbvh::Path::of(Line{2, false});
    CHECK(querier.motion(mesh, mesh, through).outcome == CBVH_HIT && querier.is_free(mesh, mesh, beside));
    std::vector<cbvh::Path> both;
    both.push_back(cbvh::Path::of(Line{2, false}));
    both.push_back(cbvh::Path::between(cbvh::Pose::translation(-4, 0, 0), cbvh::Pose::translation(4, 0, 0)));
    CHECK(querier.are_free(mesh, mesh, both) == std::vector<bool>({true, false}));
    CHECK(querier.motions(mesh, mesh, both)[1].outcome == CBVH_HIT && querier.motions(mesh, mesh, {}).empty());
    // Exceptions do not cross the library.
    FAILS(querier.is_free(mesh, mesh, cbvh::Path::of(Line{2, true})), CBVH_CALLBACK_FAILED,
          "found the code 1 of its function: no pose");
    for (const bool throws : {false, true}) {
        const auto kept = std::make_shared<int>(7);
        const auto own = std::make_shared<std::optional<cbvh::Path>>();
        *own = cbvh::Path::of(Leaving{own, kept, throws});
        CHECK(kept.use_count() == 2);
        const auto ask = [&] { return querier.is_free(mesh, mesh, **own); };
        if (throws) {
            FAILS(ask(), CBVH_CALLBACK_FAILED, "found NaN: an exception that is no std::exception");
        } else {
            CHECK(ask());
        }
        CHECK(!own->has_value() && kept.use_count() == 1);
    }
    const cbvh::Pose start = cbvh::Pose::translation(-4, 0, 0), end = cbvh::Pose::translation(4, 0, 0);
    CHECK(!querier.is_free(mesh, mesh, start, end) && querier.motion(mesh, mesh, start, end).at < 0.3751);
    const cbvh::Path screw = cbvh::Path::screw(start, {0, 0, 0}, {0, 0, 1}, 6.5, 0);
    CHECK(querier.is_free(mesh, mesh, screw) && screw.reach(mesh, 0, 1) >= 4);
    CHECK(cbvh::Path::polyline({start, cbvh::Pose(), end}).pose(0.5).rows[3] == 0);
    CHECK(mesh.displacement(start, end) >= 8);
}

void scenes() {
    cbvh::Scene scene;
    const cbvh::Instance a = scene.add(cube(1), cbvh::Pose(), "a");
    const cbvh::Instance b = scene.add(cube(1), cbvh::Pose::translation(1.5, 0, 0));
    cbvh::Scene copy = scene;
    copy.set_pose(b, cbvh::Pose::translation(1, 0, 0));
    CHECK(copy.collide() && !scene.collide() && scene.within(0.5) && scene.distance()->nearest.distance == 0.5);
    CHECK(copy.pairs_in_contact().size() == 1 && copy.pairs_in_contact()[0].b == b && !copy.contacts().empty());
    CHECK(copy.relations()[0].relation == CBVH_TOUCHING && scene.pairs_within(1).size() == 1);
    CHECK(scene.instances() == std::vector<cbvh::Instance>({a, b}) && scene.name(a) == "a" && scene.find("a") == a);
    CHECK(scene.pose(b).rows[3] == 1.5 && scene.mesh(b).triangle_count() == 12);
    CHECK(scene.closest_point({0, 0, 2})->instance == a && scene.signed_point_distance({0, 0, 0})->side == CBVH_INSIDE);
    CHECK(scene.closest_points({{0, 0, 2}, {0, 0, 9}}, 3)[0]->instance == a && !scene.closest_points({{0, 0, 9}}, 3)[0]);
    CHECK(scene.signed_point_distances({{0, 0, 0}, {9, 9, 9}}, 3)[0]->side == CBVH_INSIDE && !scene.signed_point_distances({{9, 9, 9}}, 3)[0]);
    CHECK(scene.side({0, 0, 0}) == CBVH_INSIDE && scene.side({9, 9, 9}) == CBVH_OUTSIDE);
    const cbvh::Ray down({0, 0.1, 5}, {0, 0, -1}), up({0, 0.1, 5}, {0, 0, 1});
    CHECK(scene.first_hits({down, up})[0]->t == 4.5 && !scene.first_hits({down, up})[1] && scene.any_hit(down) && !scene.any_hit(up));
    CHECK(scene.all_hits({{{0, 0.1, 5}, {0, 0, -1}}})[0].size() == 2 && scene.any_hits({{{9, 9, 5}, {0, 0, -1}}})[0] == false);
    CHECK(scene.sides({{9, 9, 9}})[0] == CBVH_OUTSIDE && scene.segment_hits({{{0, 0, 0}, {0, 0, 3}}})[0]);
    CHECK(!scene.visible({{{0, 0, 0}, {0, 0, 3}}})[0] && scene.visible({{{0, 0, 0}, {0, 0, 3}}}, 1.5)[0]);
    // Ways are values. One whose path is gone is refused, and a path that has no name is no path for one.
    std::vector<cbvh::Scene::Way> ways;
    {
        const cbvh::Path away = cbvh::Path::between(cbvh::Pose::translation(1.5, 0, 0), cbvh::Pose::translation(9, 0, 0));
        ways.push_back({b, away});
        ways[0] = cbvh::Scene::Way(b, away);
        CHECK(scene.is_free(ways) && scene.motion(ways).outcome == CBVH_FREE && !scene.is_free(ways, {0.6, 0}));
    }
    FAILS(scene.is_free(ways), CBVH_INVALID_HANDLE, "paths[0]");
    static_assert(!std::is_constructible<cbvh::Scene::Way, cbvh::Instance, cbvh::Path>::value, "a path without a name");
    static_assert(!std::is_constructible<cbvh::Scene::Way, cbvh::Instance, const cbvh::Path>::value, "the same");
    const std::unordered_set<cbvh::Instance> both{a, b, a};
    CHECK(both.size() == 2 && both.count(b) == 1);
    scene.set_groups(b, 0, 0);
    CHECK(!scene.distance());
    scene.remove(b);
    FAILS(scene.pose(b), CBVH_NOT_FOUND, "instance");
    FAILS(scene.add(cube(1), cbvh::Pose(), "a"), CBVH_INVALID_ARGUMENT, "expected a name of its own");
}

// Radii, solids, simple shapes and margins.
void shapes() {
    cbvh::Querier querier;
    const cbvh::Mesh two = cbvh::Mesh::cloud({{0, 0, 0}}).rounded(2), three = two.rounded(3), point = two.rounded(0);
    const cbvh::Pose away = cbvh::Pose::translation(3, 4, 0);
    CHECK(querier.collide(two, three, away) && !querier.collide(two, three.rounded(3 - 0x1p-50), away));
    CHECK(querier.distance(two, three, cbvh::Pose::translation(6, 8, 0)).distance == 5);
    CHECK(two.radius() == 2 && !two.is_solid());
    const cbvh::Mesh capsule = cbvh::Mesh::segment({0, 0, -1}, {0, 0, 1}).rounded(0.5);
    CHECK(querier.within(capsule, point, cbvh::Pose::translation(3, 0, 5), 4.5));
    CHECK(!querier.within(capsule, point, cbvh::Pose::translation(3, 0, 5), 4.4999));
    const auto ends = querier.all_hits(two, {{{-5, 0, 0}, {1, 0, 0}}})[0];
    CHECK(ends.size() == 2 && std::abs(ends[0].t - 3) < 1e-9 && std::abs(ends[1].t - 7) < 1e-9);
    double around_cylinder = 0, around_cone = 0;
    const cbvh::Pose inside = cbvh::Pose::translation(0.125, 0.125, 0.25);
    const std::vector<cbvh::Mesh> cores{cbvh::Mesh::box({1, 1, 1}), cbvh::Mesh::cylinder(0.5, 1, 0.01, &around_cylinder),
                                        cbvh::Mesh::cone(0.5, 1, 0.01, &around_cone),
                                        cbvh::Mesh::voxels({{0, 0, 0}}, 0.5),
                                        cbvh::Mesh::octree({{0, 0, 0}, {-1, 0, 0}}, {2, 1}, 0.25),
                                        cbvh::Mesh::convex_hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}})};
    for (const cbvh::Mesh &core : cores) {
        const cbvh::Mesh solid = core.solid(), copy = solid;
        CHECK(copy.is_solid() && querier.collide(copy, point, inside) && !querier.collide(core, point, inside));
    }
    CHECK(around_cylinder > 0 && around_cylinder < 0.011 && around_cone > 0 && around_cone < 0.011);
    CHECK(querier.collide(cbvh::Mesh::ground({9, 9}, 1).solid(), point, cbvh::Pose::translation(0, 0, -0.5)));
    const cbvh::Mesh field = cbvh::Mesh::height_field({0, 0, 0, 1, 0, 0}, 3, {1, 2});
    CHECK(field.triangle_count() == 4 && querier.within(field, point, cbvh::Pose::translation(0, 2, 3), 2));
    FAILS(field.solid(), CBVH_INVALID_ARGUMENT, "expected closed objects, found object 0");
    FAILS(cbvh::Mesh::height_field({0, 0, 0, 1, 0}, 3, {1, 2}), CBVH_INVALID_ARGUMENT, "heights: expected whole rows");
    FAILS(cbvh::Mesh::height_field({0, 0}, 0, {1, 2}), CBVH_INVALID_ARGUMENT, "heights: expected whole rows");
    FAILS(cbvh::Mesh::height_field({}, 0, {1, 2}), CBVH_INVALID_ARGUMENT, "heights: expected two or more rows");
    FAILS(cbvh::Mesh::cloud({}), CBVH_BAKE_FAILED, "triangle");
    FAILS(cbvh::Mesh::voxels({}, 1), CBVH_BAKE_FAILED, "triangle");
    FAILS(cbvh::Mesh::octree({{0, 0, 0}}, {}, 1), CBVH_INVALID_ARGUMENT, "sizes: expected one for each cell");
    FAILS(cbvh::Mesh::convex_hull({}), CBVH_INVALID_ARGUMENT, "points: expected four or more");
    FAILS(two.rounded(-1), CBVH_INVALID_ARGUMENT, "radius: expected a length from 0 to 2^118, found -1");
    cbvh::Scene scene;
    const cbvh::Instance a = scene.add(point, cbvh::Pose()), b = scene.add(two, away);
    CHECK(scene.margin(a) == 0 && scene.pair_margin(a, b) == 0 && !scene.collide());
    scene.set_margin(a, 1);
    scene.set_pair_margin(a, b, 2);
    const cbvh::Scene copy = scene;
    CHECK(copy.margin(a) == 1 && copy.pair_margin(b, a) == 2 && copy.mesh(b).radius() == 2 && scene.collide());
    scene.set_pair_margin(b, a, 1.5);
    CHECK(!scene.collide());
    CHECK(!scene.parent(b).has_value());
    scene.attach(b, a);
    CHECK(scene.parent(b)->id == a.id);
    scene.set_pose(a, cbvh::Pose::translation(0, 0, 7));
    const cbvh::Pose there = scene.pose(b);
    CHECK(there.rows[11] == away.rows[11] + 7 && there.rows[3] == away.rows[3]);
    FAILS(scene.attach(a, b), CBVH_INVALID_ARGUMENT, "expected a parent that does not move with it");
    FAILS(scene.parent(cbvh::Instance{99}), CBVH_NOT_FOUND, "instance");
    scene.detach(b);
    scene.set_mesh(b, point);
    CHECK(scene.mesh(b).radius() == 0 && copy.mesh(b).radius() == 2);
    FAILS(scene.set_margin(b, std::numeric_limits<double>::quiet_NaN()), CBVH_INVALID_ARGUMENT, "margin: ");
}

void robots(const std::string &urdf) {
    cbvh::Robot robot = cbvh::Robot::from_urdf(urdf);
    using Joints = cbvh::Robot::Joints;
    CHECK(robot.name() == "small_arm" && robot.joints() == std::vector<std::string>({"waist", "shoulder", "elbow", "wrist"}));
    const std::vector<std::string> links{"base", "turret", "upper_arm", "forearm", "hand"};
    CHECK(robot.links() == links && robot.limits()[1].upper == 2 && robot.groups().empty() && robot.states().empty());
    CHECK(robot.pairs().size() == 10 && robot.shapes(*robot.find("turret"))[0].second.rows[11] == 0.07);
    for (std::size_t k = 1; k < links.size(); k++) {
        robot.set_allowed(links[k - 1], links[k], true);
    }
    const cbvh::Robot before = robot;
    const Joints up(4), forward{0, 1.2, 0, 0}, aside{0.5, 1.2, 0, 0};
    const std::vector<Joints> both{up, forward};
    const cbvh::Mesh block = cbvh::Mesh::box({0.2, 0.2, 0.2}).solid();
    const cbvh::Body box = robot.add_obstacle("box", block, cbvh::Pose::translation(0.5, 0, 0.46));
    const cbvh::Body rod = robot.attach("rod", cbvh::Mesh::box({0.02, 0.02, 0.2}).solid(), "hand",
                                         cbvh::Pose::translation(0, 0, 0.2), {"forearm"});
    CHECK(robot.name(box) == "box" && robot.find("rod") == rod && !robot.find("x") && std::hash<cbvh::Body>()(box) > 0);
    CHECK(!robot.collide(up) && robot.collide(forward) && !before.collide(forward));
    for (const bool parallel : {false, true}) {
        robot.set_parallel(parallel);
        CHECK(robot.collide(both) == std::vector<bool>({false, true}) && robot.collide(std::vector<Joints>()).empty());
        const auto distances = robot.distance(both);
        CHECK(distances[0]->nearest.distance > 0 && distances[1]->nearest.distance == 0);
        CHECK(robot.distance(up)->nearest.distance == distances[0]->nearest.distance);
        const auto numbers = robot.signed_distance(both);
        CHECK(numbers[0]->nearest.lower > 0 && numbers[1]->nearest.upper < 0 && robot.signed_distance(std::vector<Joints>()).empty());
        CHECK(std::abs(numbers[0]->nearest.upper - distances[0]->nearest.distance) < 1e-12);
        CHECK(robot.signed_distance(forward)->nearest.lower == numbers[1]->nearest.lower && numbers[1]->pair.b == box);
        FAILS(robot.signed_distance(up, {0, -1}), CBVH_INVALID_ARGUMENT, "tolerance: ");
        const auto near = robot.near_pairs(both, 0.3);
        CHECK(near.size() == 2 && near[1].size() >= 1 && near[1][0].gradient.size() == forward.size());
        const auto deepest = std::min_element(near[1].begin(), near[1].end(), [](const cbvh::Robot::NearPair &a, const cbvh::Robot::NearPair &b) {
            return a.nearest.lower < b.nearest.lower;
        });
        CHECK(deepest->pair.b == box && deepest->distance == numbers[1]->nearest.lower);
        const auto alone = robot.near_pairs(forward, 0.3);
        CHECK(alone.size() == near[1].size() && alone[0].gradient == near[1][0].gradient);
        CHECK(robot.near_pairs(std::vector<Joints>(), 1).empty());
        FAILS(robot.near_pairs(up, -1), CBVH_INVALID_ARGUMENT, "margin: ");
        const auto pairs = robot.pairs_in_contact(both);
        CHECK(pairs[0].empty() && !pairs[1].empty() && pairs[1].size() == robot.pairs_in_contact(forward).size());
        CHECK(robot.link_poses(both)[1][4].rows[3] == robot.link_poses(forward)[4].rows[3] && robot.link_poses(up).size() == 5);
        CHECK(robot.edges_are_free(both, {forward, up}) == std::vector<bool>({false, false}));
        const auto motions = robot.edge_motions(both, {forward, up});
        CHECK(motions[0].outcome == CBVH_HIT && motions[1].at == 0 && motions[0].at == robot.motion(up, forward).at);
    }
    CHECK(before.is_free(up, forward) && before.motion(up, forward).outcome == CBVH_FREE && !before.is_free(up, forward, {9, 0}));
    // The same motion as polynomials, and one that goes there and back before it reaches the box.
    const cbvh::Robot::Polynomials line{{{0}, {0, 1.2}, {0}, {}}}, back{{{}, {0, 1, -1}, {}, {}}};
    CHECK(robot.motion(line).at == robot.motion(up, forward).at && !robot.is_free(line) && robot.is_free(back));
    robot.set_pose("box", cbvh::Pose::translation(3, 0, 0));
    CHECK(!robot.collide(forward));
    // A room around the robot, as a surface and as a solid.
    const cbvh::Mesh wide = cbvh::Mesh::box({20, 20, 20});
    cbvh::Robot inside = robot;
    const cbvh::Body room = inside.add_obstacle("room", wide);
    const auto found = inside.pairs_inside(up);
    CHECK(!inside.collide(up) && found.size() == 6 && found[0].b == room && inside.name(found[0].a) == "base");
    CHECK(inside.pairs_inside(both)[1].size() == 6 && robot.pairs_inside(up).empty());
    inside.make_solid("room");
    CHECK(inside.collide(up) && inside.pairs_inside(up).empty() && !robot.find("room"));
    inside.remove("room");
    inside.add_obstacle("room", wide, {}, true);
    CHECK(inside.collide(up));
    inside.remove("room");
    inside.attach("shell", wide, "hand", {}, {}, true);
    CHECK(inside.collide(up));
    // A joint with limits goes straight.
    CHECK(robot.nearest_turns({3, 0, 0, 0}, {-3, 0, 0, 0}) == Joints({-3, 0, 0, 0}));
    CHECK(robot.nearest_turns(both, {forward, up}) == std::vector<Joints>({forward, up}));
    FAILS(robot.nearest_turns(both, {up}), CBVH_INVALID_ARGUMENT, "ends: expected as many ends as starts");
    cbvh::Scene scene;
    scene.add(wide, {}, "wide", true);
    scene.add(block, {});
    CHECK(scene.collide());
    robot.set_margin("box", 3);
    CHECK(robot.collide(forward) && robot.shapes(box)[0].first.radius() == 3);
    robot.remove("box");
    CHECK(!robot.collide(aside) && robot.allow_frequent(100, 2).empty());
    FAILS(robot.name(box), CBVH_NOT_FOUND, "expected a body of the robot");
    FAILS(robot.shapes(box), CBVH_NOT_FOUND, "expected a body of the robot");
    FAILS(robot.remove("box"), CBVH_NOT_FOUND, "found 'box'");
    FAILS(robot.collide(Joints(3)), CBVH_INVALID_ARGUMENT, "joint_count: expected 4");
    FAILS(robot.collide({up, Joints(3)}), CBVH_INVALID_ARGUMENT, "joints: expected as many numbers in each row");
    FAILS(robot.edges_are_free(both, {up}), CBVH_INVALID_ARGUMENT, "ends: expected as many ends as starts");
    FAILS(robot.is_free({{{}, {}}}), CBVH_INVALID_ARGUMENT, "joint_count: expected 4");
    FAILS(robot.collide({0, std::nan(""), 0, 0}), CBVH_INVALID_ARGUMENT, "joints[0]: joint shoulder: expected a finite value");
    FAILS(cbvh::Robot::from_urdf("/no such folder/x.urdf"), CBVH_SYSTEM, "x.urdf");
    FAILS(robot.add_obstacle(std::string("a\0b", 3), block), CBVH_INVALID_ARGUMENT, "expected text without zero bytes");
    FAILS(robot.attach("a", block, "hand", {}, {std::string("a\0b", 3)}), CBVH_INVALID_ARGUMENT, "may_touch: expected text");
    cbvh::RobotOptions options;
    options.base = CBVH_BASE_FLOATING;
    options.packages = {"/a", "/b"};
    CHECK(cbvh::Robot::from_urdf(urdf, options).joints()[6] == "base/qw");
    options.srdf = "/no such folder/x.srdf";
    FAILS(cbvh::Robot::from_urdf(urdf, options), CBVH_SYSTEM, "x.srdf");
    const cbvh::Robot moved = std::move(robot);
    FAILS(robot.name(), CBVH_INVALID_HANDLE, "found 0, no handle"); // NOLINT: what is moved from holds none.
}

} // namespace

/// A flag stops questions of all who have it, by hand and after a time, until it is cleared.
static void stops(const std::string &urdf) {
    const cbvh::Mesh mesh = cube(1);
    cbvh::Querier querier;
    cbvh::Scene scene;
    cbvh::Robot robot = cbvh::Robot::from_urdf(urdf);
    const std::vector<double> up(robot.joints().size());
    scene.add(mesh, {});
    scene.add(mesh, {});
    const cbvh::Stop stop;
    querier.set_stop(stop);
    scene.set_stop(stop);
    robot.set_stop(stop);
    CHECK(querier.collide(mesh, mesh, cbvh::Pose()) && scene.collide());
    const bool touches = robot.collide(up);
    std::thread([&] { stop.set(); }).join();
    FAILS(querier.collide(mesh, mesh, cbvh::Pose()), CBVH_STOPPED, "found the query stopped");
    FAILS(scene.collide(), CBVH_STOPPED, "");
    FAILS(cbvh::Scene(scene).collide(), CBVH_STOPPED, "");
    FAILS(robot.collide(up), CBVH_STOPPED, "");
    querier.set_stop(nullptr);
    CHECK(querier.collide(mesh, mesh, cbvh::Pose()));
    stop.clear();
    CHECK(scene.collide() && robot.collide(up) == touches);
    stop.set_after(std::chrono::hours(1));
    CHECK(scene.collide() && robot.collide(up) == touches);
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(5);
    stop.set_after(std::chrono::milliseconds(5));
    while (std::chrono::steady_clock::now() < end + std::chrono::milliseconds(1)) {
    }
    FAILS(scene.collide(), CBVH_STOPPED, "its time is over");
    FAILS(robot.collide(up), CBVH_STOPPED, "");
    FAILS(stop.set_after(std::chrono::seconds(-1)), CBVH_INVALID_ARGUMENT, "seconds: expected at least 0, found -1");
    FAILS(stop.set_after(std::chrono::duration<float>(std::nanf(""))), CBVH_INVALID_ARGUMENT, "found NaN");
    stop.set_after(std::chrono::hours::max());
    CHECK(scene.collide());
    stop.set_after(std::chrono::nanoseconds::zero());
    FAILS(scene.collide(), CBVH_STOPPED, "");
    stop.clear();
    CHECK(scene.collide());
    stop.set();
    cbvh::BakeOptions options;
    options.stop = stop.raw();
    FAILS(cbvh::Mesh::bake({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, options), CBVH_STOPPED, "found it stopped");
    scene.set_stop(nullptr);
    robot.set_stop(nullptr);
    CHECK(scene.collide() && robot.collide(up) == touches);
}

/// The warnings of bakes and of robots: all of them, and none.
static void warnings() {
    const std::filesystem::path folder = std::filesystem::temp_directory_path() / "cbvh-wrapper";
    std::filesystem::create_directories(folder);
    const std::string mesh = (folder / "line.obj").string(), urdf = (folder / "r.urdf").string();
    std::ofstream(mesh) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2\n";
    std::ofstream(urdf) << "<robot><link name='a'><collision><geometry><mesh filename='line.obj'/></geometry></collision></link>"
                           "<link name='b'/><joint name='j' type='continuous'><parent link='a'/><child link='b'/>"
                           "<mimic joint='gone'/></joint></robot>";
    cbvh::BakeOptions options;
    options.force = true;
    cbvh::Mesh::bake_files({mesh}, (folder / "line.cbvh").string(), options);
    const std::vector<std::string> of_bake = cbvh::Mesh::bake_warnings();
    CHECK(of_bake.size() == 1 && of_bake[0].find("line.obj: line 5: left out 1 face") != std::string::npos);
    FAILS(cbvh::Mesh::bake_files({"/no such folder/x.obj"}, mesh), CBVH_SYSTEM, "x.obj");
    CHECK(cbvh::Mesh::bake_warnings().empty());
    const std::vector<std::string> of_robot = cbvh::Robot::from_urdf(urdf).warnings();
    CHECK(of_robot.size() == 2 && of_robot[0].find("joint 'j' mimics 'gone'") != std::string::npos);
    CHECK(of_robot[1].find("r.urdf: link a: ") != std::string::npos && of_robot[1].find(of_bake[0]) != std::string::npos);
    std::filesystem::remove_all(folder);
}

int main(int count, char **arguments) {
    CHECK(count == 2);
    poses();
    handles();
    answers(false);
    answers(true);
    overlaps();
    lists();
    motions();
    scenes();
    shapes();
    robots(std::string(arguments[1]) + "/robot/robot.urdf");
    stops(std::string(arguments[1]) + "/robot/robot.urdf");
    warnings();
    // A thread of its own has messages of its own.
    std::thread([] { FAILS(cbvh::Mesh::open(""), CBVH_SYSTEM, ""); }).join();
    std::puts("wrapper: C++ as the header says");
    return 0;
}
