// The first program of the book: bakes a room and a robot, and computes how near the robot comes to the room. Runs
// from the root of the repository.
#include <cbvh.hpp>

#include <cstdio>

int main() {
    try {
        const auto room = cbvh::Mesh::bake_files({"testdata/fclenv.obj"}, "room.cbvh"); // does nothing if that is up to date
        const auto robot = cbvh::Mesh::bake_files({"testdata/fclrob.obj"}, "robot.cbvh");
        cbvh::Querier querier; // working memory: one per thread

        for (const double z : {-500.0, -440.0, -439.5}) {
            // The rows of the 3 by 4 matrix that places the robot in the frame of the room.
            const cbvh::Pose pose({0.6, -0.8, 0, 300, 0.8, 0.6, 0, -1600, 0, 0, 1, z});
            if (querier.collide(room, robot, pose)) {
                std::printf("z = %g: in contact, %zu pairs of triangles\n", z, querier.contacts(room, robot, pose).size());
            } else {
                const auto nearest = querier.distance(room, robot, pose);
                std::printf("z = %g: %g apart, triangles %u and %u\n", z, nearest.distance, nearest.triangle_a, nearest.triangle_b);
            }
        }
        return 0;
    } catch (const cbvh::Error &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
