// A scene: a floor, and boxes that stand on it, fall on it, or touch each other.
#include <cbvh.hpp>

#include <cstdio>

int main() {
    try {
        std::vector<std::array<double, 3>> vertices;
        for (int corner = 0; corner < 8; corner++) {
            vertices.push_back({corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5});
        }
        const std::vector<std::array<std::uint32_t, 3>> faces{{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                                              {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                                              {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
        cbvh::Scene scene;
        cbvh::Instance floor, first, second;
        {
            // The scene keeps the mesh: the handle may go.
            const cbvh::Mesh box = cbvh::Mesh::bake(vertices, faces);
            floor = scene.add(box, cbvh::Pose::translation(0, 0, -0.5), "floor");
            first = scene.add(box, cbvh::Pose::translation(0, 0, 0.75), "first");
            second = scene.add(box, cbvh::Pose::translation(3, 0, 0.75), "second");
        }
        const auto nearest = scene.distance();
        std::printf("%s and %s are nearest, %g apart\n", scene.name(nearest->pair.a).c_str(),
                    scene.name(nearest->pair.b).c_str(), nearest->nearest.distance);

        // Both fall: only the first one has the floor below it.
        using cbvh::Pose;
        const cbvh::Path fall = cbvh::Path::between(Pose::translation(0, 0, 0.75), Pose::translation(0, 0, 0));
        const cbvh::Path aside = cbvh::Path::between(Pose::translation(3, 0, 0.75), Pose::translation(3, 0, 0));
        const cbvh::MotionAnswer end = scene.motion({{first, fall}, {second, aside}});
        std::printf("%s hits %s at %.6f\n", scene.name(end.instance_b).c_str(), scene.name(end.instance_a).c_str(),
                    end.at);
        const bool is_aside_free = scene.is_free({{second, aside}});

        scene.set_poses({{first, cbvh::Pose::translation(0, 0, 0.5)}, {second, cbvh::Pose::translation(1, 0, 0.5)}});
        const auto pairs = scene.pairs_in_contact();
        std::printf("%zu pairs touch\n", pairs.size());
        scene.set_allowed(floor, first, true);
        const auto rest = scene.pairs_in_contact();

        // A ray from above.
        const auto hit = scene.first_hit({{1, 0, 5}, {0, 0, -1}});
        std::printf("the ray hits %s at height %g\n", scene.name(hit->instance).c_str(), hit->point[2]);

        const bool is_right = nearest->nearest.distance == 0.25 && end.outcome == CBVH_HIT && end.at >= 1.0 / 3 &&
                              end.at < 0.34 && end.free_until <= end.at && is_aside_free && pairs.size() == 3 &&
                              rest.size() == 2 && hit->t == 4 && hit->instance.id == second.id &&
                              scene.find("second") == second && !scene.find("third");
        return is_right ? 0 : 1;
    } catch (const cbvh::Error &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
