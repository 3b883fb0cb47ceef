// CGAL 5.5 with exact predicates and exact constructions (EPECK): AABB_tree, Side_of_triangle_mesh and self_intersections.
//
// CGAL requires triangles with an area, and Side_of_triangle_mesh requires a mesh that does not overlap itself, so neither
// degenerate triangles nor overlapping parts are claimed. CGAL has no query for the distance of two meshes.
// These parts of CGAL are under the GPL, and so is a runner that is built with them.

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/version.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace PMP = CGAL::Polygon_mesh_processing;
using nlohmann::json;
using K = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = K::Point_3;
using Triangles = std::vector<K::Triangle_3>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<K, CGAL::AABB_triangle_primitive<K, Triangles::iterator>>>;
using Surface = CGAL::Surface_mesh<Point>;

struct Mesh {
  std::vector<Point> corners;
  std::vector<std::vector<std::size_t>> indices;
  Triangles triangles;
  Tree tree;
  Surface surface;
  std::unique_ptr<CGAL::Side_of_triangle_mesh<Surface, K>> side;  // of a closed mesh
};

std::vector<double> numbers(const json& list) {
  std::vector<double> found;
  for (const json& x : list) found.push_back(x.get<double>());  // throws at "nan"
  return found;
}

Point point(const json& list) {
  auto x = numbers(list);
  return Point(x.at(0), x.at(1), x.at(2));
}

std::unique_ptr<Mesh> mesh_of(const json& message) {
  auto mesh = std::make_unique<Mesh>();
  for (const json& p : message["vertices"]) mesh->corners.push_back(point(p));
  mesh->indices = message["triangles"].get<std::vector<std::vector<std::size_t>>>();
  for (const auto& t : mesh->indices)
    mesh->triangles.emplace_back(mesh->corners.at(t.at(0)), mesh->corners.at(t.at(1)), mesh->corners.at(t.at(2)));
  mesh->tree.rebuild(mesh->triangles.begin(), mesh->triangles.end());
  if (!PMP::is_polygon_soup_a_polygon_mesh(mesh->indices)) throw std::runtime_error("not a manifold surface");
  PMP::polygon_soup_to_polygon_mesh(mesh->corners, mesh->indices, mesh->surface);
  if (CGAL::is_closed(mesh->surface)) mesh->side = std::make_unique<CGAL::Side_of_triangle_mesh<Surface, K>>(mesh->surface);
  return mesh;
}

double rounded(const K::FT& exact) { return CGAL::to_double(exact.exact()); }

K::Aff_transformation_3 pose_of(const json& question) {
  auto m = numbers(question["pose"]);
  return {m.at(0), m.at(1), m.at(2), m.at(3), m.at(4), m.at(5), m.at(6), m.at(7), m.at(8), m.at(9), m.at(10), m.at(11)};
}

bool collide(const Mesh& a, const Mesh& b, const K::Aff_transformation_3& pose) {
  for (const auto& t : b.triangles)
    if (a.tree.do_intersect(t.transform(pose))) return true;
  return false;
}

json contacts(const Mesh& a, const Mesh& b, const K::Aff_transformation_3& pose) {
  json pairs = json::array();
  for (std::size_t j = 0; j < b.triangles.size(); j++) {
    std::vector<Tree::Primitive_id> found;
    a.tree.all_intersected_primitives(b.triangles[j].transform(pose), std::back_inserter(found));
    for (auto i : found) pairs.push_back({i - a.triangles.begin(), j});
  }
  return pairs;
}

// Tells whether all, some or none of the corners of a mesh, once moved, are inside another mesh that it does not touch.
std::string inside(const Mesh& moved, const K::Aff_transformation_3& pose, const Mesh& other) {
  std::size_t count = 0;
  for (const Point& p : moved.corners) count += (*other.side)(p.transform(pose)) == CGAL::ON_BOUNDED_SIDE;
  return count == 0 ? "none" : count == moved.corners.size() ? "all" : "some";
}

json relation(const Mesh& a, const Mesh& b, const K::Aff_transformation_3& pose) {
  if (collide(a, b, pose)) return "touching";
  if (!a.side || !b.side) return "undefined";
  auto of_a = inside(a, pose.inverse(), b), of_b = inside(b, pose, a);
  if (of_a == "none" && of_b == "none") return "apart";
  if (of_a == "all" && of_b == "none") return "a in b";
  return of_b == "all" && of_a == "none" ? "b in a" : "mixed";
}

json side(const Mesh& a, const Point& p) {
  if (!a.side) return a.tree.do_intersect(p) ? "on" : "undefined";
  switch ((*a.side)(p)) {
    case CGAL::ON_BOUNDED_SIDE: return "inside";
    case CGAL::ON_BOUNDARY: return "on";
    default: return "outside";
  }
}

json ray(const Mesh& a, const json& question) {
  Point o = point(question["origin"]), d = point(question["direction"]);
  auto hit = a.tree.first_intersection(K::Ray_3(o, d - CGAL::ORIGIN));
  if (!hit) return {{"answer", false}};
  int axis = d.x() != 0 ? 0 : d.y() != 0 ? 1 : 2;
  auto at = [&](const Point& p) { return K::FT((p[axis] - o[axis]) / d[axis]); };
  // In the plane of a triangle, the hit is a segment.
  const auto* s = boost::get<K::Segment_3>(&hit->first);
  K::FT t = s ? std::min(at(s->source()), at(s->target())) : at(boost::get<Point>(hit->first));
  return {{"answer", true}, {"t", rounded(t)}};
}

json self_contacts(const Mesh& a) {
  std::vector<std::pair<Surface::Face_index, Surface::Face_index>> found;
  PMP::self_intersections(a.surface, std::back_inserter(found));
  json pairs = json::array();
  for (auto [f, g] : found) pairs.push_back({std::size_t(f), std::size_t(g)});
  return pairs;
}

std::map<std::string, std::unique_ptr<Mesh>> meshes;

const Mesh& mesh(const json& name) {
  auto found = meshes.find(name.get<std::string>());
  if (found == meshes.end()) throw std::runtime_error("a mesh was refused");
  return *found->second;
}

json answer(const json& question) {
  std::string ask = question["ask"];
  const Mesh& a = mesh(question["a"]);
  if (ask == "closest") return {{"answer", std::sqrt(rounded(a.tree.squared_distance(point(question["point"]))))}};
  if (ask == "side") return {{"answer", side(a, point(question["point"]))}};
  if (ask == "ray") return ray(a, question);
  if (ask == "segment") return {{"answer", a.tree.do_intersect(K::Segment_3(point(question["from"]), point(question["to"])))}};
  if (ask == "self_contacts") return {{"answer", self_contacts(a)}};
  const Mesh& b = mesh(question["b"]);
  auto pose = pose_of(question);
  if (ask == "collide") return {{"answer", collide(a, b, pose)}};
  if (ask == "contacts") return {{"answer", contacts(a, b, pose)}};
  return {{"answer", relation(a, b, pose)}};
}

json reply(const json& message) {
  if (message.contains("hello"))
    return {{"hello", 1}, {"name", "CGAL"}, {"version", CGAL_VERSION_STR},
            {"settings", "EPECK, AABB_tree, Side_of_triangle_mesh, self_intersections"},
            {"questions", {"collide", "contacts", "relation", "closest", "side", "ray", "segment", "self_contacts"}},
            {"coordinates", "f64"}, {"placement", "f64"}, {"features", {"open", "concave", "nested", "range"}},
            {"distance_error", 1e-15}, {"error_unit", "distance"}};
  json about = message.contains("mesh") ? json{{"mesh", message["mesh"]}} : json{{"id", message["id"]}};
  try {
    if (message.contains("mesh")) meshes[message["mesh"]] = mesh_of(message);
    else about.update(answer(message));
  } catch (const std::exception& reason) {
    about["refused"] = true, about["reason"] = reason.what();
  }
  return about;
}

int main() {
  for (std::string line; std::getline(std::cin, line);) std::cout << reply(json::parse(line)) << std::endl;
}
