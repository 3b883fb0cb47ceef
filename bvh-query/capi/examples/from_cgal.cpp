// A CGAL user's queries: which of two placed meshes touch, how far a point is from a mesh, and whether it is inside.
#include <cbvh.hpp>

#include <cstdio>

int main() {
    const auto mesh = cbvh::Mesh::bake({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
    cbvh::Scene scene;
    scene.add(mesh, cbvh::Pose());
    const auto b = scene.add(mesh, cbvh::Pose());
    for (const double x : {0.5, 1.0, 1.5}) {
        scene.set_pose(b, cbvh::Pose::translation(x, 0, 0));
        std::printf("x = %g: %s\n", x, scene.collide() ? "contact" : "apart");
    }

    cbvh::Querier querier;
    const cbvh::Point point = {0.1, 0.1, 0.1};
    std::printf("distance %g\n", querier.closest_point(mesh, point)->distance);
    std::printf("%s\n", querier.side(mesh, point) == CBVH_INSIDE ? "inside" : "not inside");
}
