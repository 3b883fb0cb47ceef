// The C++ header: handles that are freed once, copies, moves, exceptions, matrices of other libraries, and answers.
#include <cbvh.hpp>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>

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
    again.check_all();
    FAILS(cbvh::Mesh::open("/no such folder/x.cbvh"), CBVH_SYSTEM, "x.cbvh");
    FAILS(mesh.object(1), CBVH_NOT_FOUND, "number: expected a number below 1");
    cbvh::BakeOptions options;
    options.profile = "dop7";
    FAILS(cbvh::Mesh::bake({}, {}, options), CBVH_INVALID_ARGUMENT, "options.profile");
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
    CHECK(querier.relate(one, quarter, poses)[0] == CBVH_B_IN_A && querier.relate(quarter, one, poses[0]) == CBVH_A_IN_B);
    CHECK(querier.distance(one, one, poses)[2].distance == 0.5 && querier.distance(one, one, poses[2], {0.1, 0}).upper <= 0.55);
    const auto lists = querier.contacts(one, one, poses);
    CHECK(lists.size() == 3 && !lists[0].empty() && !lists[1].empty() && lists[2].empty());
    const auto single = querier.contacts(one, one, poses[1]);
    CHECK(single.size() == lists[1].size() && std::memcmp(single.data(), lists[1].data(), single.size() * sizeof single[0]) == 0);
    CHECK(querier.first_collision(one, one, poses) == std::size_t{0} && !querier.first_collision(one, one, {poses[2]}));
    CHECK(querier.collide(one, one, std::vector<cbvh::Pose>()).empty());
    const std::vector<cbvh::Point> points{{0, 0, 0.25}, {0, 0, 2}};
    CHECK(querier.signed_distances(one, points) == std::vector<double>({-0.25, 1.5}));
    CHECK(querier.sides(one, points) == std::vector<cbvh_side>({CBVH_INSIDE, CBVH_OUTSIDE}));
    const auto near = querier.closest_points(one, points, 1);
    CHECK(near[0] && near[0]->distance == 0.25 && !near[1]);
    CHECK(querier.closest_point(one, points[1], 10, cbvh::Pose::translation(0, 0, 1))->distance == 0.5);
    const std::vector<cbvh::Ray> rays{{{0.1, 0.2, 5}, {0, 0, -1}}, {{0.1, 0.2, 5}, {0, 0, -1}, 4}};
    CHECK(querier.first_hits(one, rays)[0]->t == 4.5 && !querier.first_hits(one, rays)[1]);
    CHECK(querier.all_hits(one, rays)[0].size() == 2 && querier.any_hits(one, rays) == std::vector<bool>({true, false}));
    CHECK(querier.meet_segments(one, {{{0, 0, 0}, {0, 0, 1}}, {{0, 0, 0}, {0, 0, 0.1}}}) == std::vector<bool>({true, false}));
    cbvh::Tracker tracker;
    for (const cbvh::Pose &pose : poses) {
        CHECK(tracker.collide(querier, one, one, pose) == querier.collide(one, one, pose));
        CHECK(tracker.distance(querier, one, one, pose).distance == querier.distance(one, one, pose).distance);
        CHECK(tracker.within(querier, one, one, pose, 0.5));
    }
    const std::vector<cbvh::Pose> fewer{poses[0]};
    FAILS(querier.edges_are_free(one, one, poses, fewer), CBVH_INVALID_ARGUMENT, "as many ends as starts");
    FAILS(querier.within(one, one, poses, -1), CBVH_INVALID_ARGUMENT, "d: ");
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

void motions() {
    const cbvh::Mesh mesh = cube(1);
    cbvh::Querier querier;
    const cbvh::Path through = cbvh::Path::of(Line{0, false}), beside = cbvh::Path::of(Line{2, false});
    CHECK(querier.motion(mesh, mesh, through).outcome == CBVH_HIT && querier.is_free(mesh, mesh, beside));
    // Exceptions do not cross the library.
    FAILS(querier.is_free(mesh, mesh, cbvh::Path::of(Line{2, true})), CBVH_CALLBACK_FAILED, "found the code 1");
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
    CHECK(copy.collide() && !scene.collide() && scene.within(0.5) && scene.distance()->distance.distance == 0.5);
    CHECK(copy.pairs_in_contact().size() == 1 && copy.pairs_in_contact()[0].b == b && !copy.contacts().empty());
    CHECK(copy.relations()[0].relation == CBVH_TOUCHING && scene.pairs_within(1).size() == 1);
    CHECK(scene.instances() == std::vector<cbvh::Instance>({a, b}) && scene.name(a) == "a" && scene.find("a") == a);
    CHECK(scene.pose(b).rows[3] == 1.5 && scene.mesh(b).triangle_count() == 12);
    CHECK(scene.closest_point({0, 0, 2})->instance == a && scene.signed_distance({0, 0, 0})->side == CBVH_INSIDE);
    CHECK(scene.all_hits({{{0, 0.1, 5}, {0, 0, -1}}})[0].size() == 2 && scene.any_hits({{{9, 9, 5}, {0, 0, -1}}})[0] == false);
    CHECK(scene.sides({{9, 9, 9}})[0] == CBVH_OUTSIDE && scene.meet_segments({{{0, 0, 0}, {0, 0, 3}}})[0]);
    scene.set_groups(b, 0, 0);
    CHECK(!scene.distance());
    scene.remove(b);
    FAILS(scene.pose(b), CBVH_NOT_FOUND, "instance");
    FAILS(scene.add(cube(1), cbvh::Pose(), "a"), CBVH_INVALID_ARGUMENT, "expected a name of its own");
}

} // namespace

int main() {
    poses();
    handles();
    answers(false);
    answers(true);
    motions();
    scenes();
    // A thread of its own has messages of its own.
    std::thread([] { FAILS(cbvh::Mesh::open(""), CBVH_SYSTEM, ""); }).join();
    std::puts("wrapper: C++ as the header says");
    return 0;
}
