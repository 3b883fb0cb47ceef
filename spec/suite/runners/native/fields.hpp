// What Coal shares with FCL, from which it comes: meshes as BVHModel, and fields of instances in a dynamic tree of boxes.

#include "native.hpp"

template <class Mesh, class Vector, class Triangle> std::shared_ptr<Mesh> model(const std::vector<Point>& corners, const std::vector<Face>& faces) {
  auto made = std::make_shared<Mesh>();
  std::vector<Vector> points;
  std::vector<Triangle> triangles;
  for (auto& p : corners) points.emplace_back(p[0], p[1], p[2]);
  for (auto& t : faces) triangles.emplace_back(t[0], t[1], t[2]);
  made->beginModel(int(faces.size()), int(corners.size()));
  made->addSubModel(points, triangles);
  made->endModel();
  made->computeLocalAABB();
  return made;
}

// The instances of a field. A library adds the questions.
template <class Object, class Manager> struct Instances {
  std::vector<std::unique_ptr<Object>> objects;
  Manager manager;
  template <class Mesh, class Pose> void add(const std::shared_ptr<Mesh>& mesh, const Pose& pose) {
    objects.push_back(std::make_unique<Object>(mesh, pose));
    manager.registerObject(objects.back().get());
  }
  void finish() { manager.setup(); }
  template <class Pose> static void place(Object& body, const Pose& pose) {
    body.setTransform(pose);
    body.computeAABB();
  }
};
