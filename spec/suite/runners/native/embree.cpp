// Embree 4: triangle geometry with the scene flag that the argument names, robust or fast. It answers about rays and points in single precision.
//
// Single rays are asked by rtcIntersect1 and rtcOccluded1. So are batches of rays without order, for which packets take longer. Batches of rays from one
// origin are asked by coherent packets of eight, rtcIntersect8 and rtcOccluded8, which are as wide as AVX2. Embree leaves the distance from a triangle to the callback of a point query, which is here in double precision.

#include "native.hpp"

#include <algorithm>
#include <cmath>
#include <embree4/rtcore.h>
#include <pmmintrin.h>
#include <xmmintrin.h>

static RTCSceneFlags scene_flags = RTC_SCENE_FLAG_ROBUST;

static Point sub(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
static double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static Point plus(const Point& a, double s, const Point& b, double t, const Point& c) {
  return {a[0] + s * b[0] + t * c[0], a[1] + s * b[1] + t * c[1], a[2] + s * b[2] + t * c[2]};
}

// Returns the square of the distance of a point from a triangle, by the region of the plane that the point is above (C. Ericson,
// "Real-Time Collision Detection", 2005, 5.1.5).
static double squared_distance(const Point& p, const Point& a, const Point& b, const Point& c) {
  Point u = sub(b, a), v = sub(c, a), w = sub(p, a), x = sub(p, b), y = sub(p, c);
  double d1 = dot(u, w), d2 = dot(v, w), d3 = dot(u, x), d4 = dot(v, x), d5 = dot(u, y), d6 = dot(v, y);
  double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  double s = 0, t = 0;
  if (d1 <= 0 && d2 <= 0) s = t = 0;
  else if (d3 >= 0 && d4 <= d3) s = 1;
  else if (d6 >= 0 && d5 <= d6) t = 1;
  else if (vc <= 0 && d1 >= 0 && d3 <= 0) s = d1 / (d1 - d3);
  else if (vb <= 0 && d2 >= 0 && d6 <= 0) t = d2 / (d2 - d6);
  else if (va <= 0 && d4 >= d3 && d5 >= d6) t = (d4 - d3) / ((d4 - d3) + (d5 - d6)), s = 1 - t;
  else s = vb / (va + vb + vc), t = vc / (va + vb + vc);
  Point gap = sub(p, plus(a, s, u, t, v));
  return dot(gap, gap);
}

struct Embree {
  struct Mesh {
    RTCScene scene = nullptr;
    std::vector<Point> corners;
    std::vector<Face> faces;
    ~Mesh() { rtcReleaseScene(scene); }
  };
  struct Pose {};
  struct Object {};
  struct Field {};
  static constexpr bool has_fields = false;
  static constexpr bool has_probes = true;
  static constexpr bool has_batches = true;

  static std::shared_ptr<Mesh> mesh(const std::vector<Point>& corners, const std::vector<Face>& faces) {
    static RTCDevice device = rtcNewDevice(nullptr);
    auto made = std::make_shared<Mesh>();
    made->corners = corners;
    made->faces = faces;
    made->scene = rtcNewScene(device);
    rtcSetSceneFlags(made->scene, scene_flags);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryPointQueryFunction(geometry, nearer);
    auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), corners.size()));
    auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), faces.size()));
    for (auto& p : corners) points = std::copy(p.begin(), p.end(), points);
    for (auto& t : faces) indices = std::copy(t.begin(), t.end(), indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(made->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(made->scene);
    return made;
  }

  static RTCRay line(const Probe& p) {
    RTCRay ray{};
    ray.org_x = float(p[0][0]), ray.org_y = float(p[0][1]), ray.org_z = float(p[0][2]);
    ray.dir_x = float(p[1][0]), ray.dir_y = float(p[1][1]), ray.dir_z = float(p[1][2]);
    ray.tfar = std::numeric_limits<float>::infinity();
    ray.mask = ~0u;
    return ray;
  }
  static RTCRayHit ray(const Mesh& a, const RTCRay& ray) {
    RTCRayHit found{ray, {}};
    found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(a.scene, &found);
    return found;
  }
  static double parameter(const RTCRayHit& found) { return found.hit.geomID == RTC_INVALID_GEOMETRY_ID ? -1.0 : found.ray.tfar; }
  static double hit(const Mesh& a, RTCRay ray) {
    rtcOccluded1(a.scene, &ray);
    return ray.tfar < 0;
  }

  struct Nearest {
    const Mesh* mesh;
    Point point;
    double square;
  };
  static bool nearer(RTCPointQueryFunctionArguments* arguments) {
    auto* nearest = static_cast<Nearest*>(arguments->userPtr);
    const Mesh& mesh = *nearest->mesh;
    const Face& t = mesh.faces[arguments->primID];
    double square = squared_distance(nearest->point, mesh.corners[t[0]], mesh.corners[t[1]], mesh.corners[t[2]]);
    if (!(square < nearest->square)) return false;
    nearest->square = square;
    arguments->query->radius = std::nextafter(float(std::sqrt(square)), std::numeric_limits<float>::infinity());
    return true;
  }
  static Point point(const Probe& p) { return p[0]; }
  static double closest(const Mesh& a, const Point& p) {
    Nearest nearest{&a, p, std::numeric_limits<double>::infinity()};
    RTCPointQuery query{float(p[0]), float(p[1]), float(p[2]), 0, std::numeric_limits<float>::infinity()};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(a.scene, &query, &context, nullptr, &nearest);
    return std::sqrt(nearest.square);
  }
  static double side(const Mesh&, const Point&) { throw std::runtime_error("Embree has no sides"); }

  // Answers all rays, and returns the seconds without those of making rays and reading answers.
  static double batch(const Mesh& a, const std::string& ask, const std::vector<Probe>& probes, std::vector<double>& answers) {
    if (ask != "ray" && ask != "hit") throw std::runtime_error("no batches of points");
    return probes.front()[0] == probes.back()[0] ? in_packets(a, ask == "ray", probes, answers) : in_turn(a, ask == "ray", probes, answers);
  }
  static double in_turn(const Mesh& a, bool is_first, const std::vector<Probe>& probes, std::vector<double>& answers) {
    std::vector<RTCRayHit> rays;
    for (const Probe& probe : probes) rays.push_back({line(probe), {}}), rays.back().hit.geomID = RTC_INVALID_GEOMETRY_ID;
    auto start = Clock::now();
    for (auto& ray : rays) {
      if (is_first) rtcIntersect1(a.scene, &ray);
      else rtcOccluded1(a.scene, &ray.ray);
    }
    double seconds = seconds_since(start);
    for (std::size_t i = 0; i < probes.size(); i++) answers[i] = is_first ? parameter(rays[i]) : double(rays[i].ray.tfar < 0);
    return seconds;
  }
  static double in_packets(const Mesh& a, bool is_first, const std::vector<Probe>& probes, std::vector<double>& answers) {
    std::size_t count = (probes.size() + 7) / 8;
    std::vector<RTCRayHit8> packets(count);
    for (std::size_t i = 0; i < 8 * count; i++) {
      RTCRay ray = line(probes[std::min(i, probes.size() - 1)]);
      RTCRay8& of = packets[i / 8].ray;
      std::size_t k = i % 8;
      of.org_x[k] = ray.org_x, of.org_y[k] = ray.org_y, of.org_z[k] = ray.org_z;
      of.dir_x[k] = ray.dir_x, of.dir_y[k] = ray.dir_y, of.dir_z[k] = ray.dir_z;
      of.tnear[k] = of.time[k] = 0, of.tfar[k] = ray.tfar, of.mask[k] = ray.mask, of.id[k] = of.flags[k] = 0;
      packets[i / 8].hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    }
    alignas(32) int valid[8];
    std::fill(valid, valid + 8, -1);
    RTCIntersectArguments first;
    rtcInitIntersectArguments(&first);
    RTCOccludedArguments any;
    rtcInitOccludedArguments(&any);
    first.flags = any.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    auto start = Clock::now();
    for (auto& packet : packets) {
      if (is_first) rtcIntersect8(valid, a.scene, &packet, &first);
      else rtcOccluded8(valid, a.scene, &packet.ray, &any);
    }
    double seconds = seconds_since(start);
    for (std::size_t i = 0; i < probes.size(); i++) {
      const auto& packet = packets[i / 8];
      float t = packet.ray.tfar[i % 8];
      answers[i] = !is_first ? double(t < 0) : packet.hit.geomID[i % 8] == RTC_INVALID_GEOMETRY_ID ? -1.0 : t;
    }
    return seconds;
  }

  static Pose pose(const Numbers&) { return {}; }
  static double collide(const Mesh&, const Mesh&, const Pose&) { throw std::runtime_error("no pairs"); }
  static double distance(const Mesh&, const Mesh&, const Pose&) { throw std::runtime_error("no pairs"); }
  static Pairs contacts(const Mesh&, const Mesh&, const Pose&) { throw std::runtime_error("no pairs"); }
  static Pairs pairs(const Pairs& found) { return found; }
};

int main(int count, char** arguments) {
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  std::string name = count > 1 ? arguments[1] : "robust";
  if (name != "robust" && name != "fast") {
    std::cerr << "expected robust or fast, found " << name << '\n';
    return 1;
  }
  scene_flags = name == "robust" ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE;
  std::string flag = name == "robust" ? "RTC_SCENE_FLAG_ROBUST" : "no scene flags";
  json hello = greeting("Embree " + name, RTC_VERSION_STRING, flag + "; rays from one origin in packets of 8", {"ray", "hit", "closest"}, {"ray", "hit"});
  hello["coordinates"] = hello["placement"] = "f32";
  hello["distance_error"] = 1e-5;
  return Runner<Embree>().run(hello);
}
