// Coal: a BVHModel of the bounding volume that the argument names, without security margin and break distance.

#include "fields.hpp"

#include <coal/BVH/BVH_model.h>
#include <coal/broadphase/broadphase_dynamic_AABB_tree.h>
#include <coal/collision.h>
#include <coal/config.hh>
#include <coal/distance.h>

using namespace coal;

// Returns a request for all contacts or for one, about the surfaces as they are.
CollisionRequest request(bool all) {
  CollisionRequest request(all ? CONTACT : NO_REQUEST, all ? std::size_t(1) << 40 : 1);
  request.security_margin = request.break_distance = 0;
  return request;
}

// Asks each near instance, and stops at the first contact unless all are to be counted.
struct Touched : CollisionCallBackBase {
  bool is_all = false;
  long count = 0;
  bool collide(CollisionObject* a, CollisionObject* b) override {
    CollisionResult result;
    static const CollisionRequest one = request(false);
    count += coal::collide(a, b, one, result) > 0;
    return count > 0 && !is_all;
  }
};

struct Nearest : DistanceCallBackBase {
  double least = std::numeric_limits<double>::infinity();
  bool distance(CollisionObject* a, CollisionObject* b, CoalScalar& bound) override {
    DistanceResult result;
    result.min_distance = least;
    coal::distance(a, b, DistanceRequest(false, false), result);
    least = std::min(least, std::max(0.0, double(result.min_distance)));
    bound = least;
    return least == 0;
  }
};

template <class BV> struct Coal {
  using Mesh = BVHModel<BV>;
  using Pose = Transform3s;
  using Object = CollisionObject;
  static constexpr bool has_fields = true;
  static constexpr bool has_probes = false;

  static std::shared_ptr<Mesh> mesh(const std::vector<Point>& corners, const std::vector<Face>& faces) {
    return model<Mesh, Vec3s, Triangle>(corners, faces);
  }
  static Pose pose(const Numbers& m) {
    Matrix3s r;
    r << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
    return Pose(r, Vec3s(m[3], m[7], m[11]));
  }
  static double collide(const Mesh& a, const Mesh& b, const Pose& pose) {
    static const CollisionRequest one = request(false);
    CollisionResult result;
    return coal::collide(&a, Pose::Identity(), &b, pose, one, result) > 0;
  }
  static CollisionResult contacts(const Mesh& a, const Mesh& b, const Pose& pose) {
    static const CollisionRequest all = request(true);
    CollisionResult result;
    coal::collide(&a, Pose::Identity(), &b, pose, all, result);
    return result;
  }
  static Pairs pairs(const CollisionResult& result) {
    Pairs found;
    for (const auto& contact : result.getContacts()) found.emplace(contact.b1, contact.b2);
    return found;
  }
  static double distance(const Mesh& a, const Mesh& b, const Pose& pose) {
    DistanceResult result;
    return std::max(0.0, double(coal::distance(&a, Pose::Identity(), &b, pose, DistanceRequest(false, false), result)));
  }

  static std::unique_ptr<Object> object(const std::shared_ptr<Mesh>& mesh) { return std::make_unique<Object>(mesh, false); }
  struct Field : Instances<Object, DynamicAABBTreeCollisionManager> {
    using Field::Instances::manager;
    double touched(Object& body, const Pose& pose, bool all) {
      Field::place(body, pose);
      Touched callback;
      callback.is_all = all;
      manager.collide(&body, &callback);
      return double(callback.count);
    }
    double distance(Object& body, const Pose& pose) {
      Field::place(body, pose);
      Nearest callback;
      manager.distance(&body, &callback);
      return callback.least;
    }
  };
};

template <class BV> int run(const std::string& name) {
  auto hello = greeting("Coal " + name, COAL_VERSION, "BVHModel of " + name + ", security_margin 0, break_distance 0", {"collide", "distance", "contacts", "touched"});
  // OBB volumes have no distances. For collisions of RSS volumes, Coal copies, moves and refits a mesh in each query.
  if (name == "OBB") hello["timed"] = {"collide", "contacts", "touched"};
  if (name == "RSS") hello["timed"] = json::array({"distance"});
  return Runner<Coal<BV>>().run(hello);
}

int main(int count, char** arguments) {
  std::string name = count > 1 ? arguments[1] : "OBBRSS";
  if (name == "OBBRSS") return run<OBBRSS>(name);
  if (name == "OBB") return run<OBB>(name);
  if (name == "RSS") return run<RSS>(name);
  if (name == "kIOS") return run<kIOS>(name);
  std::cerr << "expected OBBRSS, OBB, RSS or kIOS, found " << name << '\n';
  return 1;
}
