// A Coal user's code, ported: the comments have the calls of Coal that each function replaces. It asks about the meshes
// of FCL's own tests.
//
//     from_coal FOLDER_OF_MESHES FOLDER_FOR_BAKED_FILES
//
// What differs: a mesh is baked once, into a file or into memory, and needs no class of bounding volume. A question
// takes one pose, of B in A's frame. Distances are 0 where meshes touch; Querier::penetration bounds the depth. Answers are
// exact, so that there are no tolerances to choose. A Tracker does what Coal's guesses do from question to question.
#include <cbvh.hpp>

#include <cstdio>
#include <string>

namespace {

// coal::BVHModel<coal::OBBRSS> model;
// model.beginModel(faces.size(), vertices.size());
// model.addSubModel(vertices, faces);
// model.endModel();
cbvh::Mesh load(const std::string &obj, const std::string &baked) { return cbvh::Mesh::bake_files({obj}, baked); }

// coal::Transform3s(rotation, translation); both meshes have one, and only how they lie to each other matters.
cbvh::Pose place(const cbvh::Pose &world_a, const cbvh::Pose &world_b) {
    return cbvh::Pose::relative(world_a, world_b);
}

struct Robot {
    cbvh::Mesh walls, robot;
    cbvh::Querier querier;

    // coal::CollisionRequest request;
    // coal::CollisionResult result;
    // return coal::collide(&walls, at_walls, &robot, at_robot, request, result) > 0;
    bool collides(const cbvh::Pose &pose) { return querier.collide(walls, robot, pose); }

    // request.security_margin = margin;
    // return coal::collide(&walls, at_walls, &robot, at_robot, request, result) > 0;
    bool collides(const cbvh::Pose &pose, double margin) { return querier.within(walls, robot, pose, margin); }

    // request.num_max_contacts = 1000000;
    // coal::collide(&walls, at_walls, &robot, at_robot, request, result);
    // result.getContact(k).b1, result.getContact(k).b2
    std::vector<cbvh::Contact> contacts(const cbvh::Pose &pose) { return querier.contacts(walls, robot, pose); }

    // coal::DistanceRequest request;
    // coal::DistanceResult result;
    // coal::distance(&walls, at_walls, &robot, at_robot, request, result);
    // result.min_distance, result.nearest_points, result.b1, result.b2
    cbvh::DistanceAnswer distance(const cbvh::Pose &pose) { return querier.distance(walls, robot, pose); }

    // fcl::continuousCollide, but certain at every moment, for meshes of any shape.
    bool may_go(const cbvh::Pose &from, const cbvh::Pose &to, double margin) {
        cbvh::MotionOptions options;
        options.clearance = margin;
        return querier.is_free(walls, robot, from, to, options);
    }
};

} // namespace

int main(int count, char **arguments) {
    try {
        if (count != 3) {
            std::fprintf(stderr, "expected a folder of meshes and one for baked files\n");
            return 1;
        }
        const std::string meshes = arguments[1], baked = arguments[2];
        Robot cell{load(meshes + "/fclenv.obj", baked + "/fclenv.cbvh"),
                   load(meshes + "/fclrob.obj", baked + "/fclrob.cbvh"), cbvh::Querier()};
        const cbvh::Pose walls;
        const double margin = 50;
        bool is_right = true;
        std::size_t touching = 0;
        for (const double z : {-500., -480., -440., -439.5, -430.}) {
            const cbvh::Pose pose = place(walls, cbvh::Pose({0.6, -0.8, 0, 300, 0.8, 0.6, 0, -1600, 0, 0, 1, z}));
            const bool touches = cell.collides(pose), is_near = cell.collides(pose, margin);
            const cbvh::DistanceAnswer found = cell.distance(pose);
            const std::vector<cbvh::Contact> contacts = cell.contacts(pose);
            std::printf("z = %g: %s, %s the margin, distance %g, %zu contacts\n", z, touches ? "touching" : "apart",
                        is_near ? "within" : "beyond", found.distance, contacts.size());
            // Answers agree with each other, to the last bit.
            is_right = is_right && touches == !(found.distance > 0) && touches == !contacts.empty() &&
                       is_near == (found.distance <= margin);
            touching += touches;
        }
        const auto from = cbvh::Pose::translation(0, 0, 5000), to = cbvh::Pose::translation(2000, 0, 5000);
        const bool is_free = cell.may_go(from, to, margin);
        std::printf("above the walls: %s\n", is_free ? "free" : "not free");
        return is_right && touching == 2 && is_free ? 0 : 1;
    } catch (const cbvh::Error &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
