// CGAL: Rigid_triangle_mesh_collision_detection with exact predicates, on an AABB tree per mesh. It answers whether two surfaces touch.
//
// These parts of CGAL are under the GPL, and so is a runner that is built with them. A mesh must be a manifold.

#include "native.hpp"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Rigid_triangle_mesh_collision_detection.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/version.h>

struct Cgal {
  using K = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Surface = CGAL::Surface_mesh<K::Point_3>;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<K, CGAL::AABB_face_graph_triangle_primitive<Surface>>>;
  using Detection = CGAL::Rigid_triangle_mesh_collision_detection<Surface, CGAL::Default, CGAL::Default, Tree>;
  using Pose = K::Aff_transformation_3;
  struct Mesh {
    Surface surface;
    Tree tree;
  };
  struct Object {};
  struct Field {};
  static constexpr bool has_fields = false;

  static std::shared_ptr<Mesh> mesh(const std::vector<Point>& corners, const std::vector<Face>& faces) {
    auto made = std::make_shared<Mesh>();
    for (auto& p : corners) made->surface.add_vertex({p[0], p[1], p[2]});
    using Vertex = Surface::Vertex_index;
    for (auto& t : faces)
      if (made->surface.add_face(Vertex(t[0]), Vertex(t[1]), Vertex(t[2])) == Surface::null_face()) throw std::runtime_error("not a manifold");
    made->tree.insert(CGAL::faces(made->surface).first, CGAL::faces(made->surface).second, made->surface);
    made->tree.build();
    return made;
  }
  static Pose pose(const Numbers& m) { return {m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9], m[10], m[11]}; }
  static double collide(const Mesh& a, const Mesh& b, const Pose& pose) {
    static std::map<std::pair<const Mesh*, const Mesh*>, Detection> known;
    auto& detection = known[{&a, &b}];
    if (!detection.is_valid_index(0))
      for (const Mesh* mesh : {&a, &b}) detection.add_mesh(mesh->tree, mesh->surface, CGAL::parameters::apply_per_connected_component(false));
    detection.set_transformation(1, pose);
    return !detection.get_all_intersections(1).empty();
  }
  static double distance(const Mesh&, const Mesh&, const Pose&) { throw std::runtime_error("CGAL has no distance of two meshes"); }
  static Pairs contacts(const Mesh&, const Mesh&, const Pose&) { throw std::runtime_error("CGAL lists no pairs here"); }
  static Pairs pairs(const Pairs& found) { return found; }
};

int main() { return Runner<Cgal>().run(greeting("CGAL", CGAL_VERSION_STR, "Rigid_triangle_mesh_collision_detection, EPICK", {"collide"})); }
