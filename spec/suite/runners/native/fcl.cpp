// FCL: a BVHModel of the bounding volume that the argument names, with default requests.

#include "fields.hpp"

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/config.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

using namespace fcl;
using Vector = Vector3d;
using Result = CollisionResultd;

CollisionRequestd request(bool all) { return CollisionRequestd(all ? std::size_t(1) << 40 : 1, all); }

// Asks each near instance, and stops at the first contact unless all are to be counted.
struct Touched {
  bool is_all;
  long count = 0;
  static bool ask(CollisionObjectd* a, CollisionObjectd* b, void* data) {
    auto& self = *static_cast<Touched*>(data);
    static const CollisionRequestd one = request(false);
    Result result;
    self.count += fcl::collide(a, b, one, result) > 0;
    return self.count > 0 && !self.is_all;
  }
};

struct Nearest {
  double least = std::numeric_limits<double>::infinity();
  static bool ask(CollisionObjectd* a, CollisionObjectd* b, void* data, double& bound) {
    auto& self = *static_cast<Nearest*>(data);
    DistanceResultd result;
    result.min_distance = self.least;
    fcl::distance(a, b, DistanceRequestd(), result);
    bound = self.least = std::min(self.least, std::max(0.0, result.min_distance));
    return self.least == 0;
  }
};

template <class BV> struct Fcl {
  using Mesh = BVHModel<BV>;
  using Pose = Transform3d;
  using Object = CollisionObjectd;
  static constexpr bool has_fields = true;
  static constexpr bool has_probes = false;

  static std::shared_ptr<Mesh> mesh(const std::vector<Point>& corners, const std::vector<Face>& faces) {
    return model<Mesh, Vector, Triangle>(corners, faces);
  }
  static Pose pose(const Numbers& m) {
    Pose pose = Pose::Identity();
    pose.linear() << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
    pose.translation() << m[3], m[7], m[11];
    return pose;
  }
  static double collide(const Mesh& a, const Mesh& b, const Pose& pose) {
    static const CollisionRequestd one = request(false);
    Result result;
    return fcl::collide(&a, Pose::Identity(), &b, pose, one, result) > 0;
  }
  static Result contacts(const Mesh& a, const Mesh& b, const Pose& pose) {
    static const CollisionRequestd all = request(true);
    Result result;
    fcl::collide(&a, Pose::Identity(), &b, pose, all, result);
    return result;
  }
  static Pairs pairs(const Result& result) {
    Pairs found;
    for (std::size_t i = 0; i < result.numContacts(); i++) found.emplace(result.getContact(i).b1, result.getContact(i).b2);
    return found;
  }
  static double distance(const Mesh& a, const Mesh& b, const Pose& pose) {
    DistanceResultd result;
    return std::max(0.0, fcl::distance(&a, Pose::Identity(), &b, pose, DistanceRequestd(), result));
  }

  static std::unique_ptr<Object> object(const std::shared_ptr<Mesh>& mesh) { return std::make_unique<Object>(mesh); }
  struct Field : Instances<Object, DynamicAABBTreeCollisionManagerd> {
    using Field::Instances::manager;
    double touched(Object& body, const Pose& pose, bool all) {
      Field::place(body, pose);
      Touched data{all};
      manager.collide(&body, &data, Touched::ask);
      return double(data.count);
    }
    double distance(Object& body, const Pose& pose) {
      Field::place(body, pose);
      Nearest data;
      manager.distance(&body, &data, Nearest::ask);
      return data.least;
    }
  };
};

template <class BV> int run(const std::string& name) {
  std::vector<std::string> timed = {"collide", "distance", "contacts", "touched"};
  // For collisions of RSS volumes, FCL copies, moves and refits a mesh in each query.
  if (name == "RSS") timed = {"distance"};
  return Runner<Fcl<BV>>().run(greeting("FCL " + name, FCL_VERSION, "BVHModel of " + name + ", default requests", timed));
}

int main(int count, char** arguments) {
  std::string name = count > 1 ? arguments[1] : "OBBRSS";
  if (name == "OBBRSS") return run<OBBRSSd>(name);
  if (name == "RSS") return run<RSSd>(name);
  if (name == "kIOS") return run<kIOSd>(name);
  std::cerr << "expected OBBRSS, RSS or kIOS, found " << name << '\n';
  return 1;
}
