// CGAL: Rigid_triangle_mesh_collision_detection with exact predicates, on an AABB tree per mesh, which answers whether two surfaces touch.
// The same tree answers about rays and points, and Side_of_triangle_mesh about sides.
//
// These parts of CGAL are under the GPL, and so is a runner that is built with them. A mesh must be a manifold.

#include "native.hpp"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Rigid_triangle_mesh_collision_detection.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/version.h>

#include <cmath>

struct Cgal {
  using K = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Surface = CGAL::Surface_mesh<K::Point_3>;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<K, CGAL::AABB_face_graph_triangle_primitive<Surface>>>;
  using Detection = CGAL::Rigid_triangle_mesh_collision_detection<Surface, CGAL::Default, CGAL::Default, Tree>;
  using Pose = K::Aff_transformation_3;
  struct Mesh {
    Surface surface;
    Tree tree;
    mutable std::unique_ptr<CGAL::Side_of_triangle_mesh<Surface, K, CGAL::Default, Tree>> side;  // made by the first question
  };
  struct Object {};
  struct Field {};
  static constexpr bool has_fields = false;
  static constexpr bool has_probes = true;
  static constexpr bool has_batches = false;

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

  struct Ray {
    K::Ray_3 ray;
    Point origin, direction;
  };
  static Ray line(const Probe& p) { return {{at(p[0]), K::Vector_3(p[1][0], p[1][1], p[1][2])}, p[0], p[1]}; }
  static K::Point_3 at(const Point& p) { return {p[0], p[1], p[2]}; }
  static K::Point_3 point(const Probe& p) { return at(p[0]); }
  // Returns the parameter of the first hit, in the unit of the direction, or -1. In the plane of a triangle, the hit is a segment.
  static double ray(const Mesh& a, const Ray& ray) {
    auto hit = a.tree.first_intersection(ray.ray);
    if (!hit) return -1;
    const auto& d = ray.direction;
    int axis = std::abs(d[0]) > std::abs(d[1]) ? 0 : 1;
    if (std::abs(d[2]) > std::abs(d[axis])) axis = 2;
    auto along = [&](const K::Point_3& p) { return (p[axis] - ray.origin[axis]) / d[axis]; };
    if (auto* segment = boost::get<K::Segment_3>(&hit->first)) return std::min(along(segment->source()), along(segment->target()));
    return along(boost::get<K::Point_3>(hit->first));
  }
  static double parameter(double t) { return t; }
  static double hit(const Mesh& a, const Ray& ray) { return a.tree.do_intersect(ray.ray); }
  static double closest(const Mesh& a, const K::Point_3& point) { return std::sqrt(a.tree.squared_distance(point)); }
  static double side(const Mesh& a, const K::Point_3& point) {
    if (!a.side) {
      if (!CGAL::is_closed(a.surface)) throw std::runtime_error("not a closed mesh");
      a.side = std::make_unique<CGAL::Side_of_triangle_mesh<Surface, K, CGAL::Default, Tree>>(a.tree);
    }
    switch ((*a.side)(point)) {
      case CGAL::ON_BOUNDED_SIDE: return 1;
      case CGAL::ON_BOUNDARY: return 0;
      default: return -1;
    }
  }
};

int main() {
  return Runner<Cgal>().run(greeting("CGAL", CGAL_VERSION_STR, "Rigid_triangle_mesh_collision_detection, AABB_tree, Side_of_triangle_mesh, EPICK", {"collide", "ray", "hit", "closest", "side"}));
}
