// Two tetrahedra, as users of FCL and PQP know such programs: arrays of vertices and triangles, and poses.
#include <cbvh.hpp>

#include <cstdio>

int main() {
    const auto mesh = cbvh::Mesh::bake({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
    cbvh::Querier querier;
    for (const double x : {0.5, 1.0, 1.5}) {
        const auto pose = cbvh::Pose::translation(x, 0, 0); // of B in the frame of A
        const auto contacts = querier.contacts(mesh, mesh, pose);
        const auto nearest = querier.distance(mesh, mesh, pose);
        std::printf("x = %g: %zu pairs of triangles, distance %g\n", x, contacts.size(), nearest.distance);
    }
}
