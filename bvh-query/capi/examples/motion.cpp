// What a planner asks: is the motion between two poses free, at every moment? A wall with a door, and a box that goes
// through.
#include <cbvh.hpp>

#include <cmath>
#include <cstdio>

namespace {

// A box between two corners, closed and oriented.
void add_box(std::vector<std::array<double, 3>> &vertices, std::vector<std::array<std::uint32_t, 3>> &faces,
             std::array<double, 3> low, std::array<double, 3> high) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (int corner = 0; corner < 8; corner++) {
        const auto pick = [&](std::size_t axis) { return corner >> axis & 1 ? high[axis] : low[axis]; };
        vertices.push_back({pick(0), pick(1), pick(2)});
    }
    const std::uint32_t corners[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                          {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    for (const auto &face : corners) {
        faces.push_back({first + face[0], first + face[1], first + face[2]});
    }
}

cbvh::Mesh bake(std::initializer_list<std::array<std::array<double, 3>, 2>> boxes) {
    std::vector<std::array<double, 3>> vertices;
    std::vector<std::array<std::uint32_t, 3>> faces;
    for (const auto &box : boxes) {
        add_box(vertices, faces, box[0], box[1]);
    }
    return cbvh::Mesh::bake(vertices, faces);
}

} // namespace

int main() {
    try {
        // A thin wall at x = 0 with a door of width 2, and a box of width 1.8.
        const cbvh::Mesh wall = bake({{{{-0.05, 1, -5}, {0.05, 9, 5}}}, {{{-0.05, -9, -5}, {0.05, -1, 5}}}});
        const cbvh::Mesh box = bake({{{{-0.9, -0.9, -0.9}, {0.9, 0.9, 0.9}}}});
        cbvh::Querier querier;

        const auto from = cbvh::Pose::translation(-10, 0, 0);
        const auto through = cbvh::Pose::translation(10, 0, 0);
        const auto beside = cbvh::Pose::translation(10, 4, 0);
        const std::vector<cbvh::Pose> starts{from, from}, ends{through, beside};
        cbvh::MotionOptions options;
        const std::vector<bool> free = querier.edges_are_free(wall, box, starts, ends, options);
        const std::vector<cbvh::MotionAnswer> answers = querier.edge_motions(wall, box, starts, ends, options);
        std::printf("through the door: %s\n", free[0] ? "free" : "not free");
        std::printf("beside it: surely free until %.6f, a hit at %.6f\n", answers[1].free_until, answers[1].at);

        // Wider than the door by a hair: a clearance of 0.2 is more than there is.
        options.clearance = 0.2;
        const bool with_clearance = querier.edges_are_free(wall, box, {from}, {through}, options)[0];

        // The box turns as it goes, by a path of our own: its corners would scrape along the door.
        struct Turning {
            cbvh::Pose pose(double t) const {
                const double angle = t * std::acos(-1.0) / 2, c = std::cos(angle), s = std::sin(angle);
                return cbvh::Pose({c, -s, 0, -10 + 20 * t, s, c, 0, 0, 0, 0, 1, 0});
            }
            // Points turn in circles: an eighth of the greatest acceleration times the square of the time, and
            // rounding.
            double sagitta(double radius, double t0, double t1) const {
                const double turned = (t1 - t0) * std::acos(-1.0) / 2;
                return radius * turned * turned / 8 * (1 + 1e-12) + 1e-12 * (radius + 20);
            }
        } turning;
        const cbvh::Path path = cbvh::Path::of(turning);
        const cbvh::MotionAnswer turned = querier.motion(wall, box, path);
        std::printf("turning: a hit at %.6f\n", turned.at);

        const bool is_right = free[0] && !free[1] && !with_clearance && answers[0].outcome == CBVH_FREE &&
                              answers[1].outcome == CBVH_HIT && answers[1].free_until <= answers[1].at &&
                              answers[1].at > 0.45 && answers[1].at < 0.5 && turned.outcome == CBVH_HIT &&
                              turned.at > 0.4 && turned.at < 0.5;
        return is_right ? 0 : 1;
    } catch (const cbvh::Error &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
