// Speaks the timed part of the protocol for libraries in C++: reads a line, calls the library, writes a line.
//
// A library is a type with a Mesh, a Pose, a Result, and the functions that `Runner` calls, about pairs of meshes, or about rays and
// points if it `has_probes`. The clock runs from the call of the library to its result. Poses, rays and points are made before, and
// contacts are counted after. Bytes are the growth of resident memory during a build.

#include <array>
#include <chrono>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>
#ifdef __GLIBC__
#include <malloc.h>
#include <unistd.h>
#endif

using nlohmann::json;
using Point = std::array<double, 3>;
using Face = std::array<std::uint32_t, 3>;
using Numbers = std::array<double, 12>;
using Pairs = std::set<std::pair<long, long>>;
// A ray's origin and its direction, or a point and nothing.
using Probe = std::array<Point, 2>;

using Clock = std::chrono::steady_clock;
inline double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// Returns the bytes of resident memory, or -1 where that is unknown.
inline long resident() {
#ifdef __GLIBC__
  malloc_trim(0);
  long all = 0, pages = 0;
  std::ifstream("/proc/self/statm") >> all >> pages;
  return pages * sysconf(_SC_PAGESIZE);
#else
  return -1;
#endif
}

template <class Number, class Row> std::vector<Row> rows(std::istream& file, std::size_t count) {
  std::vector<std::array<Number, 3>> raw(count);
  if (!file.read(reinterpret_cast<char*>(raw.data()), std::streamsize(sizeof(raw[0]) * count))) throw std::runtime_error("a mesh file that ends early");
  std::vector<Row> found;
  for (const auto& r : raw) found.push_back({r[0], r[1], r[2]});
  return found;
}

template <class Library> class Runner {
  using Mesh = typename Library::Mesh;
  struct Body {
    std::unique_ptr<typename Library::Object> object;
    std::string name;
  };
  std::map<std::string, std::shared_ptr<Mesh>> meshes;
  std::map<std::string, std::unique_ptr<typename Library::Field>> fields;
  std::map<std::string, std::vector<Probe>> sets;
  Body body;

  std::shared_ptr<Mesh> mesh(const std::string& name) const { return meshes.at(name); }

  json add(const json& message) {
    std::ifstream file(message["file"].get<std::string>(), std::ios::binary);
    auto corners = rows<float, Point>(file, message["corners"]);
    auto faces = rows<std::uint32_t, Face>(file, message["triangles"]);
    long before = resident();
    auto start = Clock::now();
    meshes[message["mesh"]] = Library::mesh(corners, faces);
    double seconds = seconds_since(start);
    json answer = {{"seconds", seconds}};
    if (before >= 0) answer["bytes"] = resident() - before;
    return answer;
  }

  json add_field(const json& message) {
    if constexpr (Library::has_fields) {
      auto start = Clock::now();
      auto field = std::make_unique<typename Library::Field>();
      for (const auto& instance : message["instances"])
        field->add(mesh(message["meshes"].at(instance.at(0).get<std::size_t>())), Library::pose(instance.at(1).get<Numbers>()));
      field->finish();
      fields[message["field"]] = std::move(field);
      return {{"seconds", seconds_since(start)}};
    }
    throw std::runtime_error("no fields");
  }

  json add_probes(const json& message) {
    std::ifstream file(message["file"].get<std::string>(), std::ios::binary);
    std::size_t count = message["count"], columns = message["numbers"].get<std::size_t>() / 3;
    auto points = rows<float, Point>(file, count * columns);
    auto& set = sets[message["probes"]];
    set.clear();
    for (std::size_t i = 0; i < count; i++) set.push_back({points[i * columns], points[i * columns + columns - 1]});
    return {{"count", count}};
  }

  template <class Items, class Ask, class Count> json one_by_one(const json& question, const Items& items, Ask ask, Count count) {
    double budget = question["budget"];
    json answers = json::array(), nanoseconds = json::array();
    auto began = Clock::now();
    for (const auto& item : items) {
      auto start = Clock::now();
      auto result = ask(item);
      auto end = Clock::now();
      nanoseconds.push_back(std::chrono::duration_cast<std::chrono::nanoseconds>(end - start).count());
      answers.push_back(double(count(result)));
      if (seconds_since(began) > budget) break;
    }
    return {{"answers", answers}, {"nanoseconds", nanoseconds}};
  }

  // Asks about rays or points of a set, which a library turns into its own type first.
  template <class Make, class Ask, class Count> json single(const json& question, Make make, Ask ask, Count count) {
    std::vector<decltype(make(Probe()))> items;
    for (const Probe& probe : sets.at(question["probes"])) items.push_back(make(probe));
    return one_by_one(question, items, ask, count);
  }

  json probed(const json& question) {
    using L = Library;
    std::string ask = question["ask"];
    auto a = mesh(question["a"]);
    if (question.value("batch", false)) {
      if constexpr (Library::has_batches) {
        const auto& probes = sets.at(question["probes"]);
        std::vector<double> answers(probes.size());
        double seconds = L::batch(*a, ask, probes, answers);
        return {{"answers", answers}, {"seconds", seconds}, {"threads", 1}};
      }
      throw std::runtime_error("no batches");
    }
    auto number = [](double x) { return x; };
    if (ask == "ray") return single(question, L::line, [&](const auto& ray) { return L::ray(*a, ray); }, [](const auto& hit) { return L::parameter(hit); });
    if (ask == "hit") return single(question, L::line, [&](const auto& ray) { return L::hit(*a, ray); }, number);
    if (ask == "closest") return single(question, L::point, [&](const auto& point) { return L::closest(*a, point); }, number);
    if (ask == "side") return single(question, L::point, [&](const auto& point) { return L::side(*a, point); }, number);
    throw std::runtime_error("not a question of this runner");
  }

  json answer(const json& question) {
    if constexpr (Library::has_probes)
      if (question.contains("probes")) return probed(question);
    std::string ask = question["ask"], a = question["a"];
    auto b = mesh(question["b"]);
    std::vector<typename Library::Pose> poses;
    for (const auto& pose : question["poses"]) poses.push_back(Library::pose(pose.get<Numbers>()));
    auto number = [](double x) { return x; };
    if constexpr (Library::has_fields) {
      if (auto found = fields.find(a); found != fields.end()) {
        auto& field = *found->second;
        if (body.name != question["b"]) body = {Library::object(b), question["b"]};
        auto& object = *body.object;
        if (ask == "collide") return one_by_one(question, poses, [&](const auto& pose) { return field.touched(object, pose, false); }, number);
        if (ask == "touched") return one_by_one(question, poses, [&](const auto& pose) { return field.touched(object, pose, true); }, number);
        if (ask == "distance") return one_by_one(question, poses, [&](const auto& pose) { return field.distance(object, pose); }, number);
      }
    }
    auto m = mesh(a);
    if (ask == "collide") return one_by_one(question, poses, [&](const auto& pose) { return Library::collide(*m, *b, pose); }, number);
    if (ask == "distance") return one_by_one(question, poses, [&](const auto& pose) { return Library::distance(*m, *b, pose); }, number);
    if (ask == "contacts") return one_by_one(question, poses, [&](const auto& pose) { return Library::contacts(*m, *b, pose); }, [](const auto& result) { return Library::pairs(result).size(); });
    throw std::runtime_error("not a question of this runner");
  }

 public:
  int run(json hello) {
    for (std::string line; std::getline(std::cin, line);) {
      json message = json::parse(line), about;
      if (message.contains("hello")) about = hello;
      try {
        if (message.contains("mesh")) about["mesh"] = message["mesh"], about.update(add(message));
        else if (message.contains("field")) about["field"] = message["field"], about.update(add_field(message));
        else if (message.contains("file")) about["probes"] = message["probes"], about.update(add_probes(message));
        else if (message.contains("ask")) about["id"] = message["id"], about.update(answer(message));
      } catch (const std::exception& reason) {
        about["refused"] = true, about["reason"] = reason.what();
      }
      std::cout << about << std::endl;
    }
    return 0;
  }
};

// Returns a greeting of a library that is right to within a millionth of the size, and answers timed questions only.
inline json greeting(const std::string& name, const std::string& version, const std::string& settings, const std::vector<std::string>& timed, const std::vector<std::string>& batch = {}) {
  return {{"hello", 1}, {"name", name}, {"version", version}, {"settings", settings}, {"questions", json::array()}, {"timed", timed}, {"batch", batch},
          {"coordinates", "f64"}, {"placement", "f64"}, {"features", json::array()}, {"distance_error", 1e-6}, {"error_unit", "size"}};
}
