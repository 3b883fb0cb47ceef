// PQP: triangles in RSS and OBB volumes, with relative and absolute error 0.
//
// PQP's licence allows no commercial use, and nobody but its authors passes it on. Who may use it builds it by PQP's own instructions and names the
// folder by PQP=FOLDER; this runner is linked with the library there.

#include "native.hpp"

#include <PQP.h>

struct Pqp {
  struct Pose {
    PQP_REAL r[3][3], t[3];
  };
  using Mesh = PQP_Model;
  struct Object {};
  struct Field {};
  static constexpr bool has_fields = false;
  static constexpr bool has_probes = false;

  static std::shared_ptr<Mesh> mesh(const std::vector<Point>& corners, const std::vector<Face>& faces) {
    auto made = std::make_shared<Mesh>();
    made->BeginModel();
    for (std::size_t i = 0; i < faces.size(); i++) made->AddTri(corners[faces[i][0]].data(), corners[faces[i][1]].data(), corners[faces[i][2]].data(), int(i));
    made->EndModel();
    return made;
  }
  static Pose pose(const Numbers& m) { return {{{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}}, {m[3], m[7], m[11]}}; }

  static std::unique_ptr<PQP_CollideResult> ask(const Mesh& a, const Mesh& b, const Pose& pose, int which) {
    static PQP_REAL still[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, zero[3] = {0, 0, 0};
    auto result = std::make_unique<PQP_CollideResult>();
    auto& moved = const_cast<Pose&>(pose);  // PQP writes to nothing of this.
    PQP_Collide(result.get(), still, zero, const_cast<Mesh*>(&a), moved.r, moved.t, const_cast<Mesh*>(&b), which);
    return result;
  }
  static double collide(const Mesh& a, const Mesh& b, const Pose& pose) { return ask(a, b, pose, PQP_FIRST_CONTACT)->NumPairs() > 0; }
  static std::unique_ptr<PQP_CollideResult> contacts(const Mesh& a, const Mesh& b, const Pose& pose) { return ask(a, b, pose, PQP_ALL_CONTACTS); }
  static Pairs pairs(const std::unique_ptr<PQP_CollideResult>& result) {
    Pairs found;
    for (int i = 0; i < result->NumPairs(); i++) found.emplace(result->Id1(i), result->Id2(i));
    return found;
  }
  static double distance(const Mesh& a, const Mesh& b, const Pose& pose) {
    static PQP_REAL still[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, zero[3] = {0, 0, 0};
    PQP_DistanceResult result;
    auto& moved = const_cast<Pose&>(pose);
    PQP_Distance(&result, still, zero, const_cast<Mesh*>(&a), moved.r, moved.t, const_cast<Mesh*>(&b), 0.0, 0.0, QUEUE_SIZE);
    return result.Distance();
  }
  static constexpr int QUEUE_SIZE = 1000;  // The nearest pairs of volumes first: faster than the default of 2.
};

int main() { return Runner<Pqp>().run(greeting("PQP", "1.3", "relative and absolute error 0, queue of 1,000", {"collide", "distance", "contacts"})); }
