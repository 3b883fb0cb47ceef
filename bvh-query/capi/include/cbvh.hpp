// cbvh for C++17: handles that free themselves, answers in vectors, failures as exceptions. This header wraps cbvh.h,
// which documents the queries: shapes, units, costs and threads.
//
// Meshes and paths may be shared by threads; make a Querier for each thread. Queries of a Scene or a Robot may run while others
// change them. Objects that were moved from hold no handle, and queries about them throw an Error of CBVH_INVALID_HANDLE.
#ifndef CBVH_HPP
#define CBVH_HPP

// MSVC keeps __cplusplus at 199711 unless told otherwise, and names its version in _MSVC_LANG.
#if (defined(_MSVC_LANG) ? _MSVC_LANG : __cplusplus) < 201703L
#error "cbvh.hpp requires C++17"
#endif

#include "cbvh.h"

#include <algorithm>
#include <atomic>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

// Beside the type, where C++ looks for them.
inline bool operator==(cbvh_instance a, cbvh_instance b) { return a.id == b.id; }
inline bool operator!=(cbvh_instance a, cbvh_instance b) { return a.id != b.id; }
inline bool operator<(cbvh_instance a, cbvh_instance b) { return a.id < b.id; }

inline bool operator==(cbvh_body a, cbvh_body b) { return a.id == b.id; }
inline bool operator!=(cbvh_body a, cbvh_body b) { return a.id != b.id; }
inline bool operator<(cbvh_body a, cbvh_body b) { return a.id < b.id; }

template <> struct std::hash<cbvh_body> {
    std::size_t operator()(cbvh_body body) const noexcept { return std::hash<std::uint64_t>()(body.id); }
};
template <> struct std::hash<cbvh_instance> {
    std::size_t operator()(cbvh_instance instance) const noexcept { return std::hash<std::uint64_t>()(instance.id); }
};

namespace cbvh {

/// A failure: its text is the message of the library, which names the argument, what was expected and what was found.
class Error : public std::runtime_error {
public:
    Error(cbvh_status status, const char *message) : std::runtime_error(message), status_(status) {}
    /// CBVH_INVALID_ARGUMENT and so on.
    cbvh_status status() const noexcept { return status_; }

private:
    cbvh_status status_;
};

/// Throws unless a function of cbvh.h succeeded.
inline void check(cbvh_status status) {
    if (status != CBVH_OK) {
        throw Error(status, cbvh_last_message());
    }
}

namespace detail {

/// Text for C, which ends at a zero byte: there must be none before.
inline const char *c_text(const char *name, const std::string &text) {
    const std::size_t zero = text.find('\0');
    if (zero != std::string::npos) {
        const std::string message = std::string(name) + ": expected text without zero bytes, found one at byte ";
        throw Error(CBVH_INVALID_ARGUMENT, (message + std::to_string(zero)).c_str());
    }
    return text.c_str();
}

} // namespace detail

using Point = std::array<double, 3>;
using Contact = cbvh_contact;
using ContactRegion = cbvh_contact_region;
using Patch = cbvh_patch;
using ContactPoint = cbvh_contact_point;
using SelfContact = cbvh_self_contact;
using OpenEdgeCounts = cbvh_open_edge_counts;
using OpenEdge = cbvh_open_edge;
using DistanceAnswer = cbvh_distance_answer;
using Separation = cbvh_separation;
using Penetration = cbvh_penetration;
using SignedDistance = cbvh_signed_distance;
using Clash = cbvh_clash;
using Intersection = cbvh_intersection;
using MeasuredClash = cbvh_measured_clash;
using ClosestPoint = cbvh_closest_point;
using RayHit = cbvh_ray_hit;
using Segment = cbvh_segment;
using MotionAnswer = cbvh_motion_answer;
using Instance = cbvh_instance;
using Body = cbvh_body;
using Stats = cbvh_stats;

/// A rigid placement, body to world: see cbvh_pose. Queries check that it is rigid.
struct Pose : cbvh_pose {
    /// The identity.
    Pose() : cbvh_pose CBVH_IDENTITY {}
    /// From the rows of the 3 by 4 matrix [R | t], also in braces: Pose({1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z}).
    Pose(const cbvh_pose &pose) : cbvh_pose(pose) {}
    /// The same from an array. It is a template so that braces mean the one above.
    template <class Array, class = std::enable_if_t<std::is_same<Array, std::array<double, 12>>::value>>
    explicit Pose(const Array &matrix) {
        for (std::size_t k = 0; k < 12; k++) {
            rows[k] = matrix[k];
        }
    }
    /// A translation.
    static Pose translation(double x, double y, double z) { return Pose({1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z}); }
    /// From a matrix whose entries are m(row, column): Eigen::Isometry3d, Eigen::Matrix4d, a 3 by 4 matrix. A fourth
    /// row is not read.
    template <class Matrix> static Pose from_matrix(const Matrix &m) {
        Pose pose;
        for (int row = 0; row < 3; row++) {
            for (int column = 0; column < 4; column++) {
                pose.rows[4 * row + column] = static_cast<double>(m(row, column));
            }
        }
        return pose;
    }
    /// From the 16 numbers of a 4 by 4 matrix, row by row. Throws unless the last row is 0 0 0 1.
    static Pose from_rows(const std::array<double, 16> &m) {
        return from_16([&](std::size_t row, std::size_t column) { return m[4 * row + column]; });
    }
    /// From the 16 numbers of a 4 by 4 matrix, column by column, as graphics libraries and Eigen keep them.
    static Pose from_columns(const std::array<double, 16> &m) {
        return from_16([&](std::size_t row, std::size_t column) { return m[4 * column + row]; });
    }
    /// From a quaternion x, y, z, w of length 1, the real part last, and a translation.
    static Pose from_quaternion(const std::array<double, 4> &quaternion, const Point &translation) {
        Pose pose;
        check(cbvh_pose_from_quaternion(quaternion.data(), translation.data(), &pose));
        return pose;
    }
    /// Throws unless it is rigid, as queries do: see cbvh_pose_check.
    void check_rigid() const { check(cbvh_pose_check(this)); }
    /// The rigid pose nearest to this one, which is off by at most 2^-6.
    Pose nearest() const { return made([&](cbvh_pose *pose) { return cbvh_pose_nearest(this, pose); }); }
    /// The inverse of this pose.
    Pose inverse() const { return made([&](cbvh_pose *pose) { return cbvh_pose_inverse(this, pose); }); }
    /// The pose that applies this one and then `next`.
    Pose then(const Pose &next) const {
        return made([&](cbvh_pose *pose) { return cbvh_pose_then(this, &next, pose); });
    }
    /// The pose of B in A's frame, from the poses of both in the world.
    static Pose relative(const Pose &world_a, const Pose &world_b) {
        return made([&](cbvh_pose *pose) { return cbvh_pose_relative(&world_a, &world_b, pose); });
    }

private:
    template <class Make> static Pose made(Make make) {
        Pose pose;
        check(make(&pose));
        return pose;
    }
    template <class Entry> static Pose from_16(Entry entry) {
        const auto is = [](double found, double expected) { return !(found < expected) && !(found > expected); };
        if (!is(entry(3, 0), 0) || !is(entry(3, 1), 0) || !is(entry(3, 2), 0) || !is(entry(3, 3), 1)) {
            throw Error(CBVH_INVALID_ARGUMENT, "row 4: expected 0 0 0 1, found another one; is the matrix transposed?");
        }
        Pose pose;
        for (std::size_t row = 0; row < 3; row++) {
            for (std::size_t column = 0; column < 4; column++) {
                pose.rows[4 * row + column] = entry(row, column);
            }
        }
        return pose;
    }
};

/// A ray from an origin, in units of its direction; without an end unless `until` is given. See cbvh_ray.
struct Ray : cbvh_ray {
    Ray(const Point &at_origin, const Point &in_direction, double until_t = std::numeric_limits<double>::infinity())
        : cbvh_ray{{at_origin[0], at_origin[1], at_origin[2]},
                   {in_direction[0], in_direction[1], in_direction[2]},
                   until_t} {}
};

// Arrays of these are given to functions that take arrays of what they derive from.
static_assert(sizeof(Pose) == sizeof(cbvh_pose) && std::is_standard_layout<Pose>::value, "a pose is its numbers");
static_assert(sizeof(Ray) == sizeof(cbvh_ray) && std::is_standard_layout<Ray>::value, "a ray is its numbers");
static_assert(sizeof(Point) == 3 * sizeof(double), "a point is three numbers");

/// Options, whose defaults are those of the library.
struct MotionOptions {
    double clearance = 0;
    double tolerance = 0;

    cbvh_motion_options raw() const { return {sizeof(cbvh_motion_options), clearance, tolerance}; }
};

struct DistanceOptions {
    double rel_err = 0;
    double abs_err = 0;

    cbvh_distance_options raw() const { return {sizeof(cbvh_distance_options), rel_err, abs_err}; }
};

struct PenetrationOptions {
    double relative_gap = 0;
    double tolerance = 0;

    cbvh_penetration_options raw() const { return {sizeof(cbvh_penetration_options), relative_gap, tolerance}; }
};

struct ClashOptions {
    double clearance = 0;
    double tolerance = 0;
    double relative_gap = 0;
    std::uint64_t visits = 0;

    cbvh_clash_options raw() const {
        return {sizeof(cbvh_clash_options), clearance, tolerance, relative_gap, visits};
    }
};

struct PatchOptions {
    double tolerance = 0;
    std::size_t max_contacts = 0;
    /// For contact points: the largest number for each patch.
    std::size_t max_points = 4;

    cbvh_patch_options raw() const { return {sizeof(cbvh_patch_options), tolerance, max_contacts, max_points}; }
};

/// Contacts, joined into patches.
struct Patches {
    std::vector<Patch> patches;
    /// The contacts of the first patch, of the second one, and so on.
    std::vector<ContactRegion> regions;
    /// The number of all contacts: more than there are here if `max_contacts` left some out.
    std::size_t total = 0;
};

/// Contact points, and the patches that they belong to.
struct ContactPoints {
    std::vector<ContactPoint> points;
    std::vector<Patch> patches;
};

/// See cbvh_bake_options. Empty text stands for the default.
struct BakeOptions {
    std::string profile;
    std::string triangles;
    std::string effort;
    std::string round;
    std::string scratch;
    double max_error = 0;
    std::uint64_t max_memory = 0;
    bool split_objects = false;
    bool scene = false;
    bool ids = true;
    bool topology = true;
    bool force = false;
    bool solid = false;
    bool allow_outside = false;
    bool drop_nan = false;
    double radius = 0;
    double weld = 0;
    /// What stops the bake: raw() of a Stop, which has to live until the bake begins.
    cbvh_stop stop{0};

    /// The texts stay those of this object.
    cbvh_bake_options raw() const {
        const auto text = [](const char *name, const std::string &of) {
            return of.empty() ? nullptr : detail::c_text(name, of);
        };
        cbvh_bake_options options{};
        options.size = sizeof options;
        options.profile = text("options.profile", profile);
        options.triangles = text("options.triangles", triangles);
        options.effort = text("options.effort", effort);
        options.round = text("options.round", round);
        options.scratch = text("options.scratch", scratch);
        options.max_error = max_error;
        options.max_memory = max_memory;
        options.split_objects = split_objects;
        options.scene = scene;
        options.no_ids = !ids;
        options.no_topology = !topology;
        options.force = force;
        options.solid = solid;
        options.allow_outside = allow_outside;
        options.drop_nan = drop_nan;
        options.radius = radius;
        options.weld = weld;
        options.stop = stop;
        return options;
    }
};

namespace detail {

/// A handle that is freed with its object.
template <class Raw, cbvh_status (*Free)(Raw)> class Handle {
public:
    Handle() = default;
    explicit Handle(Raw raw) : raw_(raw) {}
    Handle(Handle &&other) noexcept : raw_(std::exchange(other.raw_, Raw{0})) {}
    Handle &operator=(Handle &&other) noexcept {
        if (this != &other) {
            static_cast<void>(Free(raw_));
            raw_ = std::exchange(other.raw_, Raw{0});
        }
        return *this;
    }
    Handle(const Handle &) = delete;
    Handle &operator=(const Handle &) = delete;
    ~Handle() { static_cast<void>(Free(raw_)); }
    /// The handle for functions of cbvh.h. It stays this object's.
    Raw raw() const noexcept { return raw_; }

private:
    Raw raw_{0};
};

/// Asks for `count` answers.
template <class Answer, class Ask> std::vector<Answer> answers(std::size_t count, Ask ask) {
    std::vector<Answer> found(count);
    check(ask(found.data()));
    return found;
}

/// The same, of answers of yes and no.
template <class Ask> std::vector<bool> choices(std::size_t count, Ask ask) {
    const std::unique_ptr<bool[]> found(new bool[count + 1]());
    check(ask(found.get()));
    return std::vector<bool>(found.get(), found.get() + count);
}

/// The number of entries to make room for before the length of a list is known.
inline constexpr std::size_t few = 64;

/// How long the last list was. Threads may share it.
class Room {
public:
    Room() = default;
    Room(const Room &other) noexcept : length_(other.length()) {}
    Room &operator=(const Room &other) noexcept {
        set(other.length());
        return *this;
    }
    std::size_t length() const noexcept { return length_.load(std::memory_order_relaxed); }
    void set(std::size_t length) noexcept { length_.store(length, std::memory_order_relaxed); }

private:
    std::atomic<std::size_t> length_{few};
};

/// Asks for a list, and again if the list is longer than there is room for, which a scene may come to have meanwhile. That
/// takes twice the time, so there is room for as many elements as the last list had.
template <class Element, class Ask> std::vector<Element> list(Room &room, Ask ask) {
    std::vector<Element> found(room.length());
    std::size_t count = 0;
    cbvh_status status = ask(found.data(), found.size(), &count);
    while (status == CBVH_BUFFER_TOO_SMALL) {
        found.resize(count);
        status = ask(found.data(), found.size(), &count);
    }
    check(status);
    found.resize(count);
    room.set(std::max(count, few));
    return found;
}

/// The same of a list that takes no time.
template <class Element, class Ask> std::vector<Element> list(Ask ask) {
    Room room;
    return list<Element>(room, ask);
}

/// Asks for text.
template <class Ask> std::string text(Ask ask) {
    std::string found(64, '\0');
    std::size_t length = 0;
    cbvh_status status = ask(&found[0], found.size(), &length);
    while (status == CBVH_BUFFER_TOO_SMALL) {
        found.resize(length + 1);
        status = ask(&found[0], found.size(), &length);
    }
    check(status);
    found.resize(length);
    return found;
}

/// Asks for texts by their numbers, up to the last one.
template <class Ask> std::vector<std::string> texts(Ask ask) {
    std::vector<std::string> found;
    for (;;) {
        try {
            found.push_back(text([&](char *buffer, std::size_t capacity, std::size_t *length) {
                return ask(found.size(), buffer, capacity, length);
            }));
        } catch (const Error &error) {
            if (error.status() == CBVH_NOT_FOUND) {
                return found;
            }
            throw;
        }
    }
}

/// Divides a list into one for each query.
template <class Element>
std::vector<std::vector<Element>> divided(const std::vector<Element> &all, const std::vector<std::size_t> &counts) {
    std::vector<std::vector<Element>> lists;
    lists.reserve(counts.size());
    auto start = all.begin();
    for (const std::size_t count : counts) {
        const auto end = start + static_cast<std::ptrdiff_t>(count);
        lists.emplace_back(start, end);
        start = end;
    }
    return lists;
}

/// Lists of many queries.
template <class Element, class Ask>
std::vector<std::vector<Element>> lists(Room &room, std::size_t questions, Ask ask) {
    std::vector<std::size_t> counts(questions);
    const auto all = list<Element>(room, [&](Element *elements, std::size_t capacity, std::size_t *count) {
        return ask(counts.data(), elements, capacity, count);
    });
    return divided(all, counts);
}

inline void same_length(std::size_t one, std::size_t other, const char *message) {
    if (one != other) {
        throw Error(CBVH_INVALID_ARGUMENT, message);
    }
}

inline const double *numbers(const std::vector<Point> &points) { return points.empty() ? nullptr : points[0].data(); }

/// The answer, if there is one.
template <class Answer> std::optional<Answer> found(const Answer &answer) {
    return answer.found ? std::optional<Answer>(answer) : std::nullopt;
}

/// Asks for `count` answers, not all of which there need to be.
template <class Answer, class Ask> std::vector<std::optional<Answer>> found(std::size_t count, Ask ask) {
    std::vector<std::optional<Answer>> all;
    all.reserve(count);
    for (const Answer &answer : answers<Answer>(count, ask)) {
        all.push_back(found(answer));
    }
    return all;
}

} // namespace detail

/// The distance of an answer of signed_point_distances: negative inside, NaN where the mesh has no inside.
inline double signed_point_distance(const ClosestPoint &closest) {
    return closest.side == CBVH_INSIDE           ? -closest.distance
           : closest.side == CBVH_SIDE_UNDEFINED ? std::numeric_limits<double>::quiet_NaN()
                                                 : closest.distance;
}

/// A baked mesh. Copies share it.
class Mesh {
public:
    /// Opens a .cbvh file.
    static Mesh open(const std::string &path, cbvh_open_mode mode = CBVH_MAP) {
        return made([&](cbvh_mesh *mesh) { return cbvh_mesh_open(detail::c_text("path", path), mode, mesh); });
    }
    /// Opens the bytes of a .cbvh file, which are copied.
    static Mesh from_bytes(const void *bytes, std::size_t size) {
        return made([&](cbvh_mesh *mesh) { return cbvh_mesh_from_bytes(bytes, size, mesh); });
    }
    /// Opens bytes where they are: see cbvh_mesh_borrow_bytes.
    static Mesh borrow_bytes(const void *bytes, std::size_t size, void (*release)(void *), void *user) {
        return made([&](cbvh_mesh *mesh) { return cbvh_mesh_borrow_bytes(bytes, size, release, user, mesh); });
    }
    /// Bakes triangles.
    static Mesh bake(const std::vector<Point> &vertices, const std::vector<std::array<std::uint32_t, 3>> &faces,
                     const BakeOptions &options = {}) {
        const cbvh_bake_options raw = options.raw();
        const std::uint32_t *corners = faces.empty() ? nullptr : faces[0].data();
        return made([&](cbvh_mesh *mesh) {
            return cbvh_bake(detail::numbers(vertices), vertices.size(), corners, faces.size(), &raw, mesh);
        });
    }
    /// Points, each a triangle without area: a ball if there is one and it is rounded.
    static Mesh cloud(const std::vector<Point> &points) {
        return made([&](cbvh_mesh *mesh) { return cbvh_bake_cloud(detail::numbers(points), points.size(), mesh); });
    }
    /// The segment between two points: a capsule if it is rounded.
    static Mesh segment(const Point &from, const Point &to) {
        return made([&](cbvh_mesh *mesh) { return cbvh_bake_segment(from.data(), to.data(), mesh); });
    }
    /// A box with its middle at the origin.
    static Mesh box(const std::array<double, 3> &sides) {
        return made([&](cbvh_mesh *mesh) { return cbvh_bake_box(sides.data(), mesh); });
    }
    /// The ground under z = 0, with these sides along x and y.
    static Mesh ground(const std::array<double, 2> &sides, double thickness) {
        return made([&](cbvh_mesh *mesh) { return cbvh_bake_ground(sides.data(), thickness, mesh); });
    }
    /// A prism around a cylinder along z: see cbvh_bake_cylinder. `error` gets how far it reaches beyond that.
    static Mesh cylinder(double radius, double length, double max_error, double *error = nullptr) {
        return made([&](cbvh_mesh *mesh) { return cbvh_bake_cylinder(radius, length, max_error, error, mesh); });
    }
    /// A pyramid around a cone along z: see cbvh_bake_cone.
    static Mesh cone(double radius, double height, double max_error, double *error = nullptr) {
        return made([&](cbvh_mesh *mesh) { return cbvh_bake_cone(radius, height, max_error, error, mesh); });
    }
    /// A surface over a grid: whole rows of heights along y, each of `columns` numbers along x.
    static Mesh height_field(const std::vector<double> &heights, std::size_t columns,
                             const std::array<double, 2> &cell) {
        const std::size_t rows = columns == 0 ? 0 : heights.size() / columns;
        detail::same_length(heights.size(), rows * columns, "heights: expected whole rows, found a part of one");
        return made([&](cbvh_mesh *mesh) {
            return cbvh_bake_height_field(heights.data(), columns, rows, cell.data(), mesh);
        });
    }
    /// The surface of full cells of a grid: see cbvh_bake_voxels.
    static Mesh voxels(const std::vector<std::array<std::int32_t, 3>> &cells, double side) {
        const std::int32_t *numbers = cells.empty() ? nullptr : cells[0].data();
        return made([&](cbvh_mesh *mesh) { return cbvh_bake_voxels(numbers, cells.size(), side, mesh); });
    }
    /// The surface of full cells of an octree: corners and sizes in sides of the finest cells, see cbvh_bake_octree.
    static Mesh octree(const std::vector<std::array<std::int32_t, 3>> &cells, const std::vector<std::uint32_t> &sizes,
                       double side) {
        detail::same_length(sizes.size(), cells.size(), "sizes: expected one for each cell, found another number");
        const std::int32_t *numbers = cells.empty() ? nullptr : cells[0].data();
        return made([&](cbvh_mesh *mesh) {
            return cbvh_bake_octree(numbers, sizes.data(), cells.size(), side, mesh);
        });
    }
    /// The convex hull of points: see cbvh_bake_convex_hull.
    static Mesh convex_hull(const std::vector<Point> &points) {
        return made([&](cbvh_mesh *mesh) {
            return cbvh_bake_convex_hull(detail::numbers(points), points.size(), mesh);
        });
    }
    /// Bakes mesh files into a .cbvh file, unless it is up to date, and opens it.
    static Mesh bake_files(const std::vector<std::string> &inputs, const std::string &output,
                           const BakeOptions &options = {}) {
        std::vector<const char *> paths;
        for (const std::string &input : inputs) {
            paths.push_back(detail::c_text("inputs", input));
        }
        const cbvh_bake_options raw = options.raw();
        const char *raw_output = detail::c_text("output", output);
        check(cbvh_bake_files(paths.data(), paths.size(), raw_output, &raw, nullptr));
        return open(output);
    }
    /// The warnings of the last bake_files on this thread: see cbvh_bake_warning.
    static std::vector<std::string> bake_warnings() { return detail::texts(cbvh_bake_warning); }

    Mesh(Mesh &&) noexcept = default;
    Mesh &operator=(Mesh &&) noexcept = default;
    Mesh(const Mesh &other) : Mesh(made([&](cbvh_mesh *mesh) { return cbvh_mesh_clone(other.raw(), mesh); })) {}
    Mesh &operator=(const Mesh &other) {
        *this = Mesh(other);
        return *this;
    }
    ~Mesh() = default;
    /// Takes a handle, which is freed with this object.
    explicit Mesh(cbvh_mesh raw) : handle_(raw) {}
    cbvh_mesh raw() const noexcept { return handle_.raw(); }

    /// The same triangles with a radius, which replaces the one that the mesh has: see cbvh_mesh_rounded.
    Mesh rounded(double radius) const {
        return made([&](cbvh_mesh *mesh) { return cbvh_mesh_rounded(raw(), radius, mesh); });
    }
    /// The same mesh as a solid: what is inside it touches it. Throws unless it is closed.
    Mesh solid() const {
        return made([&](cbvh_mesh *mesh) { return cbvh_mesh_solid(raw(), mesh); });
    }
    double radius() const {
        double radius = 0;
        check(cbvh_mesh_radius(raw(), &radius));
        return radius;
    }
    /// How far a vertex may be from the one that was given to the baker: see cbvh_mesh_max_move.
    double max_move() const {
        double max_move = 0;
        check(cbvh_mesh_max_move(raw(), &max_move));
        return max_move;
    }
    bool is_solid() const {
        bool is_solid = false;
        check(cbvh_mesh_is_solid(raw(), &is_solid));
        return is_solid;
    }
    /// One object of the file, without a radius and not solid.
    Mesh object(std::size_t number) const {
        return made([&](cbvh_mesh *mesh) { return cbvh_mesh_object(raw(), number, mesh); });
    }
    /// The number of objects in the file.
    std::size_t object_count() const {
        std::size_t count = 0;
        check(cbvh_mesh_object_count(raw(), &count));
        return count;
    }
    std::string object_name(std::size_t number) const {
        return detail::text([&](char *buffer, std::size_t capacity, std::size_t *length) {
            return cbvh_mesh_object_name(raw(), number, buffer, capacity, length);
        });
    }
    /// The number of the first object with a name.
    std::optional<std::size_t> find(const std::string &name) const {
        std::size_t number = 0;
        const cbvh_status status = cbvh_mesh_find(raw(), detail::c_text("name", name), &number);
        if (status == CBVH_NOT_FOUND) {
            return std::nullopt;
        }
        check(status);
        return number;
    }
    std::uint64_t triangle_count() const {
        std::uint64_t count = 0;
        check(cbvh_mesh_triangle_count(raw(), &count));
        return count;
    }
    /// The triangles of the input that are exact duplicates of a triangle.
    std::vector<std::uint32_t> duplicates(std::uint32_t triangle) const {
        return detail::list<std::uint32_t>([&](std::uint32_t *triangles, std::size_t capacity, std::size_t *count) {
            return cbvh_mesh_duplicates(raw(), triangle, triangles, capacity, count);
        });
    }
    /// How many edges leave the mesh open? None if it is closed.
    OpenEdgeCounts open_edge_counts() const {
        OpenEdgeCounts counts{};
        check(cbvh_mesh_open_edge_counts(raw(), &counts));
        return counts;
    }
    /// The first eight of these edges of each kind.
    std::vector<OpenEdge> open_edges() const {
        return detail::list<OpenEdge>([&](OpenEdge *edges, std::size_t capacity, std::size_t *count) {
            return cbvh_mesh_open_edges(raw(), edges, capacity, count);
        });
    }
    /// A sentence about them, with the remedy.
    std::string open_edges_text() const {
        return detail::text([&](char *buffer, std::size_t capacity, std::size_t *length) {
            return cbvh_mesh_open_edges_text(raw(), buffer, capacity, length);
        });
    }
    std::vector<std::uint8_t> bytes() const {
        return detail::list<std::uint8_t>([&](std::uint8_t *buffer, std::size_t capacity, std::size_t *size) {
            return cbvh_mesh_bytes(raw(), buffer, capacity, size);
        });
    }
    void save(const std::string &path) const { check(cbvh_mesh_save(raw(), detail::c_text("path", path))); }
    /// Throws with the first rule that the file breaks.
    void validate() const { check(cbvh_mesh_validate(raw())); }
    /// A bound of how far any point of the triangles moves from one pose to another.
    double displacement(const Pose &from, const Pose &to) const {
        double bound = 0;
        check(cbvh_displacement(raw(), &from, &to, &bound));
        return bound;
    }

private:
    template <class Make> static Mesh made(Make make) {
        cbvh_mesh mesh{0};
        check(make(&mesh));
        return Mesh(mesh);
    }
    detail::Handle<cbvh_mesh, cbvh_mesh_free> handle_;
};

/// A path over times from 0 to 1.
class Path {
public:
    /// The origin moves on a line, and the rotation is the shorter one.
    static Path between(const Pose &start, const Pose &end) {
        return made([&](cbvh_path *path) { return cbvh_path_between(&start, &end, path); });
    }
    static Path screw(const Pose &start, const Point &point, const Point &direction, double angle, double shift) {
        return made([&](cbvh_path *path) {
            return cbvh_path_screw(&start, point.data(), direction.data(), angle, shift, path);
        });
    }
    static Path polyline(const std::vector<Pose> &poses) {
        return made([&](cbvh_path *path) { return cbvh_path_polyline(poses.data(), poses.size(), path); });
    }
    /// A path of your own: an object with `Pose pose(double t) const` and
    /// `double sagitta(double radius, double t0, double t1) const`, which cbvh_sagitta_function explains. The object is
    /// copied, and the copy lives until the last query about the path has ended. If either function throws, the
    /// query throws an Error of CBVH_CALLBACK_FAILED with the text of the exception.
    template <class Own> static Path of(Own own) {
        auto kept = std::make_unique<Own>(std::move(own));
        Path path = made([&](cbvh_path *raw) {
            return cbvh_path_from_functions(pose_of<Own>, sagitta_of<Own>, release<Own>, kept.get(), raw);
        });
        // It is the path's from here on.
        static_cast<void>(kept.release());
        return path;
    }
    cbvh_path raw() const noexcept { return handle_.raw(); }
    Pose pose(double t) const {
        Pose pose;
        check(cbvh_path_pose(raw(), t, &pose));
        return pose;
    }
    /// An upper bound of how far any point of a mesh is, from t0 to t1, from its place in the middle of that time.
    double reach(const Mesh &b, double t0, double t1) const {
        double bound = 0;
        check(cbvh_path_reach(b.raw(), raw(), t0, t1, &bound));
        return bound;
    }

private:
    explicit Path(cbvh_path raw) : handle_(raw) {}
    template <class Make> static Path made(Make make) {
        cbvh_path path{0};
        check(make(&path));
        return Path(path);
    }
    template <class Own> static std::int32_t pose_of(void *user, double t, cbvh_pose *pose) {
        try {
            *pose = static_cast<const Own *>(user)->pose(t);
            return 0;
        } catch (...) {
            tell();
            return 1;
        }
    }
    template <class Own> static double sagitta_of(void *user, double radius, double t0, double t1) {
        try {
            return static_cast<const Own *>(user)->sagitta(radius, t0, t1);
        } catch (...) {
            tell();
            return std::numeric_limits<double>::quiet_NaN();
        }
    }
    template <class Own> static void release(void *user) { delete static_cast<Own *>(user); }
    /// Gives the text of the exception that is being handled to the query.
    static void tell() noexcept {
        try {
            throw;
        } catch (const std::exception &thrown) {
            static_cast<void>(cbvh_callback_message(thrown.what()));
        } catch (...) {
            static_cast<void>(cbvh_callback_message("an exception that is no std::exception"));
        }
    }
    detail::Handle<cbvh_path, cbvh_path_free> handle_;
};

/// A flag that stops the queries of those that have it, and bakes (BakeOptions): see cbvh_stop_new. Any thread may set and clear it.
class Stop {
public:
    Stop() {
        cbvh_stop stop{0};
        check(cbvh_stop_new(&stop));
        handle_ = detail::Handle<cbvh_stop, cbvh_stop_free>(stop);
    }
    cbvh_stop raw() const noexcept { return handle_.raw(); }
    void set() const { check(cbvh_stop_set(raw())); }
    /// Sets the flag once so much time has passed from now, such as std::chrono::milliseconds(100): see cbvh_stop_set_after.
    template <typename Rep, typename Period>
    void set_after(const std::chrono::duration<Rep, Period> &time) const {
        check(cbvh_stop_set_after(raw(), std::chrono::duration<double>(time).count()));
    }
    void clear() const { check(cbvh_stop_clear(raw())); }

private:
    detail::Handle<cbvh_stop, cbvh_stop_free> handle_;
};

/// Answers queries about meshes. Make one for each thread. If a list of contacts or hits is longer than 64 and than
/// the last list, the library asks for it twice, because the first time only counts its elements.
class Querier {
public:
    explicit Querier(cbvh_backend backend = CBVH_BACKEND_BEST) {
        cbvh_querier querier{0};
        check(cbvh_querier_new(backend, &querier));
        handle_ = Owned(querier);
    }
    cbvh_querier raw() const noexcept { return handle_.raw(); }
    /// Lets queries about many poses, paths or probes use all cores.
    void set_parallel(bool parallel) { check(cbvh_querier_set_parallel(raw(), parallel)); }
    void set_budget(std::uint64_t visits) { check(cbvh_querier_set_budget(raw(), visits)); }
    /// While the flag is set, queries throw an Error of CBVH_STOPPED. The querier keeps the flag; nullptr removes it.
    void set_stop(const Stop &stop) { check(cbvh_querier_set_stop(raw(), stop.raw())); }
    void set_stop(std::nullptr_t) { check(cbvh_querier_set_stop(raw(), cbvh_stop{0})); }
    Stats stats() const {
        Stats stats{};
        check(cbvh_querier_stats(raw(), &stats));
        return stats;
    }

    /// Do the meshes touch? Poses are of B in A's frame.
    bool collide(const Mesh &a, const Mesh &b, const Pose &pose) {
        bool answer = false;
        check(cbvh_collide(raw(), a.raw(), b.raw(), &pose, 1, &answer));
        return answer;
    }
    std::vector<bool> collide(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses) {
        return detail::choices(poses.size(), [&](bool *answers) {
            return cbvh_collide(raw(), a.raw(), b.raw(), poses.data(), poses.size(), answers);
        });
    }
    /// Are they at most d apart?
    bool within(const Mesh &a, const Mesh &b, const Pose &pose, double d) {
        bool answer = false;
        check(cbvh_within(raw(), a.raw(), b.raw(), &pose, 1, d, &answer));
        return answer;
    }
    std::vector<bool> within(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses, double d) {
        return detail::choices(poses.size(), [&](bool *answers) {
            return cbvh_within(raw(), a.raw(), b.raw(), poses.data(), poses.size(), d, answers);
        });
    }
    /// Do they touch, or is one inside the other?
    cbvh_relation relation(const Mesh &a, const Mesh &b, const Pose &pose) {
        cbvh_relation answer = CBVH_RELATION_UNDEFINED;
        check(cbvh_relations(raw(), a.raw(), b.raw(), &pose, 1, &answer));
        return answer;
    }
    std::vector<cbvh_relation> relations(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses) {
        return detail::answers<cbvh_relation>(poses.size(), [&](cbvh_relation *answers) {
            return cbvh_relations(raw(), a.raw(), b.raw(), poses.data(), poses.size(), answers);
        });
    }
    /// How far apart are they, and where?
    DistanceAnswer distance(const Mesh &a, const Mesh &b, const Pose &pose, const DistanceOptions &options = {}) {
        const cbvh_distance_options raw_options = options.raw();
        DistanceAnswer answer{};
        check(cbvh_distances(raw(), a.raw(), b.raw(), &pose, 1, &raw_options, &answer));
        return answer;
    }
    std::vector<DistanceAnswer> distance(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses,
                                         const DistanceOptions &options = {}) {
        const cbvh_distance_options raw_options = options.raw();
        return detail::answers<DistanceAnswer>(poses.size(), [&](DistanceAnswer *answers) {
            return cbvh_distances(raw(), a.raw(), b.raw(), poses.data(), poses.size(), &raw_options, answers);
        });
    }
    /// Which triangles touch?
    std::vector<Contact> contacts(const Mesh &a, const Mesh &b, const Pose &pose) {
        return detail::list<Contact>(room_, [&](Contact *contacts, std::size_t capacity, std::size_t *count) {
            return cbvh_contacts(raw(), a.raw(), b.raw(), &pose, 1, nullptr, contacts, capacity, count);
        });
    }
    std::vector<std::vector<Contact>> contacts(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses) {
        return detail::lists<Contact>(
            room_, poses.size(), [&](std::size_t *counts, Contact *contacts, std::size_t capacity, std::size_t *count) {
                return cbvh_contacts(raw(), a.raw(), b.raw(), poses.data(), poses.size(), counts, contacts, capacity,
                                     count);
            });
    }
    /// Where do they touch: in which points, curves and polygons?
    std::vector<ContactRegion> contact_regions(const Mesh &a, const Mesh &b, const Pose &pose) {
        return detail::list<ContactRegion>(
            region_room_, [&](ContactRegion *regions, std::size_t capacity, std::size_t *count) {
                return cbvh_contact_regions(raw(), a.raw(), b.raw(), &pose, 1, nullptr, regions, capacity, count);
            });
    }
    std::vector<std::vector<ContactRegion>> contact_regions(const Mesh &a, const Mesh &b,
                                                            const std::vector<Pose> &poses) {
        return detail::lists<ContactRegion>(
            region_room_, poses.size(),
            [&](std::size_t *counts, ContactRegion *regions, std::size_t capacity, std::size_t *count) {
                return cbvh_contact_regions(raw(), a.raw(), b.raw(), poses.data(), poses.size(), counts, regions,
                                            capacity, count);
            });
    }
    /// The same contacts, joined into patches.
    Patches patches(const Mesh &a, const Mesh &b, const Pose &pose, const PatchOptions &options = {}) {
        const cbvh_patch_options raw_options = options.raw();
        Patches found;
        // There are no more patches than contacts.
        std::size_t patch_count = region_room_.length(), region_count = patch_count;
        cbvh_patch_counts counts{};
        cbvh_status status = CBVH_BUFFER_TOO_SMALL;
        while (status == CBVH_BUFFER_TOO_SMALL) {
            found.patches.resize(patch_count);
            found.regions.resize(region_count);
            status = cbvh_patches(raw(), a.raw(), b.raw(), &pose, 1, &raw_options, &counts, found.patches.data(),
                                  found.patches.size(), &patch_count, found.regions.data(), found.regions.size(),
                                  &region_count);
        }
        check(status);
        found.patches.resize(patch_count);
        found.regions.resize(region_count);
        found.total = counts.total;
        region_room_.set(std::max(region_count, detail::few));
        return found;
    }
    /// At which points do they push each other? Those of the patches, as simulators use them.
    ContactPoints contact_points(const Mesh &a, const Mesh &b, const Pose &pose, const PatchOptions &options = {}) {
        const cbvh_patch_options raw_options = options.raw();
        ContactPoints found;
        std::size_t patch_count = detail::few, point_count = detail::few;
        cbvh_status status = CBVH_BUFFER_TOO_SMALL;
        while (status == CBVH_BUFFER_TOO_SMALL) {
            found.patches.resize(patch_count);
            found.points.resize(point_count);
            status = cbvh_contact_points(raw(), a.raw(), b.raw(), &pose, 1, &raw_options, nullptr, found.points.data(),
                                         found.points.size(), &point_count, found.patches.data(), found.patches.size(),
                                         &patch_count);
        }
        check(status);
        found.patches.resize(patch_count);
        found.points.resize(point_count);
        return found;
    }
    /// How far does b move along a direction until their interiors are disjoint?
    Separation separation(const Mesh &a, const Mesh &b, const Pose &pose, const Point &direction) {
        Separation answer{};
        check(cbvh_separations(raw(), a.raw(), b.raw(), &pose, direction.data(), 1, &answer));
        return answer;
    }
    std::vector<Separation> separation(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses,
                                       const std::vector<Point> &directions) {
        detail::same_length(poses.size(), directions.size(), "expected as many directions as poses");
        return detail::answers<Separation>(poses.size(), [&](Separation *answers) {
            return cbvh_separations(raw(), a.raw(), b.raw(), poses.data(), detail::numbers(directions), poses.size(),
                                    answers);
        });
    }
    /// How deep do they overlap?
    Penetration penetration(const Mesh &a, const Mesh &b, const Pose &pose, const PenetrationOptions &options = {}) {
        const cbvh_penetration_options raw_options = options.raw();
        Penetration answer{};
        check(cbvh_penetrations(raw(), a.raw(), b.raw(), &pose, 1, &raw_options, &answer));
        return answer;
    }
    std::vector<Penetration> penetration(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses,
                                         const PenetrationOptions &options = {}) {
        const cbvh_penetration_options raw_options = options.raw();
        return detail::answers<Penetration>(poses.size(), [&](Penetration *answers) {
            return cbvh_penetrations(raw(), a.raw(), b.raw(), poses.data(), poses.size(), &raw_options, answers);
        });
    }
    /// How far apart are they or, below zero, how deep do they overlap?
    SignedDistance signed_distance(const Mesh &a, const Mesh &b, const Pose &pose,
                                   const PenetrationOptions &options = {}) {
        const cbvh_penetration_options raw_options = options.raw();
        SignedDistance answer{};
        check(cbvh_signed_distances(raw(), a.raw(), b.raw(), &pose, 1, &raw_options, &answer));
        return answer;
    }
    std::vector<SignedDistance> signed_distance(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses,
                                                const PenetrationOptions &options = {}) {
        const cbvh_penetration_options raw_options = options.raw();
        return detail::answers<SignedDistance>(poses.size(), [&](SignedDistance *answers) {
            return cbvh_signed_distances(raw(), a.raw(), b.raw(), poses.data(), poses.size(), &raw_options, answers);
        });
    }
    /// How do two parts lie: apart, near, touching, overlapping, one in the other, or twice in one place?
    Clash clash(const Mesh &a, const Mesh &b, const Pose &pose, const ClashOptions &options = {}) {
        const cbvh_clash_options raw_options = options.raw();
        Clash answer{};
        check(cbvh_clashes(raw(), a.raw(), b.raw(), &pose, 1, &raw_options, &answer));
        return answer;
    }
    std::vector<Clash> clash(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses,
                             const ClashOptions &options = {}) {
        const cbvh_clash_options raw_options = options.raw();
        return detail::answers<Clash>(poses.size(), [&](Clash *answers) {
            return cbvh_clashes(raw(), a.raw(), b.raw(), poses.data(), poses.size(), &raw_options, answers);
        });
    }
    /// The same, and what do they have in common?
    MeasuredClash measured_clash(const Mesh &a, const Mesh &b, const Pose &pose, const ClashOptions &options = {}) {
        const cbvh_clash_options raw_options = options.raw();
        MeasuredClash answer{};
        check(cbvh_measured_clashes(raw(), a.raw(), b.raw(), &pose, 1, &raw_options, &answer));
        return answer;
    }
    std::vector<MeasuredClash> measured_clash(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses,
                                              const ClashOptions &options = {}) {
        const cbvh_clash_options raw_options = options.raw();
        return detail::answers<MeasuredClash>(poses.size(), [&](MeasuredClash *answers) {
            return cbvh_measured_clashes(raw(), a.raw(), b.raw(), poses.data(), poses.size(), &raw_options, answers);
        });
    }
    /// How much do they have in common: volume, box, and how thick they are where they pierce each other?
    Intersection intersection(const Mesh &a, const Mesh &b, const Pose &pose) {
        Intersection answer{};
        check(cbvh_intersections(raw(), a.raw(), b.raw(), &pose, 1, &answer));
        return answer;
    }
    std::vector<Intersection> intersection(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses) {
        return detail::answers<Intersection>(poses.size(), [&](Intersection *answers) {
            return cbvh_intersections(raw(), a.raw(), b.raw(), poses.data(), poses.size(), answers);
        });
    }
    /// Which triangles of a mesh meet where they should not?
    std::vector<SelfContact> self_contacts(const Mesh &mesh) {
        return detail::list<SelfContact>(room_, [&](SelfContact *contacts, std::size_t capacity, std::size_t *count) {
            return cbvh_self_contacts(raw(), mesh.raw(), contacts, capacity, count);
        });
    }
    /// The first pose in which they touch.
    std::optional<std::size_t> first_collision(const Mesh &a, const Mesh &b, const std::vector<Pose> &poses) {
        std::size_t number = 0;
        check(cbvh_first_collision(raw(), a.raw(), b.raw(), poses.data(), poses.size(), &number));
        return number < poses.size() ? std::optional<std::size_t>(number) : std::nullopt;
    }

    /// Is the path free, and where does it end?
    MotionAnswer motion(const Mesh &a, const Mesh &b, const Path &path, const MotionOptions &options = {}) {
        const cbvh_motion_options raw_options = options.raw();
        const cbvh_path raw_path = path.raw();
        MotionAnswer answer{};
        check(cbvh_motions(raw(), a.raw(), b.raw(), &raw_path, 1, &raw_options, &answer));
        return answer;
    }
    /// Is the path certainly free?
    bool is_free(const Mesh &a, const Mesh &b, const Path &path, const MotionOptions &options = {}) {
        const cbvh_motion_options raw_options = options.raw();
        const cbvh_path raw_path = path.raw();
        bool answer = false;
        check(cbvh_are_free(raw(), a.raw(), b.raw(), &raw_path, 1, &raw_options, &answer));
        return answer;
    }
    /// The same about many paths.
    std::vector<MotionAnswer> motions(const Mesh &a, const Mesh &b, const std::vector<Path> &paths,
                                      const MotionOptions &options = {}) {
        const cbvh_motion_options raw_options = options.raw();
        const std::vector<cbvh_path> raw_paths = handles(paths);
        return detail::answers<MotionAnswer>(paths.size(), [&](MotionAnswer *answers) {
            return cbvh_motions(raw(), a.raw(), b.raw(), raw_paths.data(), raw_paths.size(), &raw_options, answers);
        });
    }
    std::vector<bool> are_free(const Mesh &a, const Mesh &b, const std::vector<Path> &paths,
                               const MotionOptions &options = {}) {
        const cbvh_motion_options raw_options = options.raw();
        const std::vector<cbvh_path> raw_paths = handles(paths);
        return detail::choices(paths.size(), [&](bool *answers) {
            return cbvh_are_free(raw(), a.raw(), b.raw(), raw_paths.data(), raw_paths.size(), &raw_options, answers);
        });
    }
    /// The same about the paths between poses.
    MotionAnswer motion(const Mesh &a, const Mesh &b, const Pose &start, const Pose &end,
                        const MotionOptions &options = {}) {
        const cbvh_motion_options raw_options = options.raw();
        MotionAnswer answer{};
        check(cbvh_edge_motions(raw(), a.raw(), b.raw(), &start, &end, 1, &raw_options, &answer));
        return answer;
    }
    bool is_free(const Mesh &a, const Mesh &b, const Pose &start, const Pose &end, const MotionOptions &options = {}) {
        const cbvh_motion_options raw_options = options.raw();
        bool answer = false;
        check(cbvh_edges_are_free(raw(), a.raw(), b.raw(), &start, &end, 1, &raw_options, &answer));
        return answer;
    }
    std::vector<MotionAnswer> edge_motions(const Mesh &a, const Mesh &b, const std::vector<Pose> &starts,
                                           const std::vector<Pose> &ends, const MotionOptions &options = {}) {
        detail::same_length(starts.size(), ends.size(), "expected as many ends as starts");
        const cbvh_motion_options raw_options = options.raw();
        return detail::answers<MotionAnswer>(starts.size(), [&](MotionAnswer *answers) {
            return cbvh_edge_motions(raw(), a.raw(), b.raw(), starts.data(), ends.data(), starts.size(), &raw_options,
                                     answers);
        });
    }
    std::vector<bool> edges_are_free(const Mesh &a, const Mesh &b, const std::vector<Pose> &starts,
                                     const std::vector<Pose> &ends, const MotionOptions &options = {}) {
        detail::same_length(starts.size(), ends.size(), "expected as many ends as starts");
        const cbvh_motion_options raw_options = options.raw();
        return detail::choices(starts.size(), [&](bool *answers) {
            return cbvh_edges_are_free(raw(), a.raw(), b.raw(), starts.data(), ends.data(), starts.size(), &raw_options,
                                       answers);
        });
    }

    /// The closest surface to each point, if it is at most `within` away; `pose` places the mesh among the points.
    std::vector<std::optional<ClosestPoint>>
    closest_points(const Mesh &mesh, const std::vector<Point> &points, const Pose &pose = {},
                   double within = std::numeric_limits<double>::infinity()) {
        return detail::found<ClosestPoint>(points.size(), [&](ClosestPoint *answers) {
            return cbvh_closest_points(raw(), mesh.raw(), &pose, detail::numbers(points), points.size(), within,
                                       answers);
        });
    }
    std::optional<ClosestPoint> closest_point(const Mesh &mesh, const Point &point, const Pose &pose = {},
                                              double within = std::numeric_limits<double>::infinity()) {
        ClosestPoint answer{};
        check(cbvh_closest_points(raw(), mesh.raw(), &pose, point.data(), 1, within, &answer));
        return detail::found(answer);
    }
    /// The side that each point is on.
    std::vector<cbvh_side> sides(const Mesh &mesh, const std::vector<Point> &points, const Pose &pose = {}) {
        return detail::answers<cbvh_side>(points.size(), [&](cbvh_side *answers) {
            return cbvh_sides(raw(), mesh.raw(), &pose, detail::numbers(points), points.size(), answers);
        });
    }
    cbvh_side side(const Mesh &mesh, const Point &point, const Pose &pose = {}) {
        cbvh_side answer = CBVH_SIDE_NOT_ASKED;
        check(cbvh_sides(raw(), mesh.raw(), &pose, point.data(), 1, &answer));
        return answer;
    }
    /// Both: cbvh::signed_point_distance turns an answer into one number.
    std::vector<std::optional<ClosestPoint>>
    signed_point_distances(const Mesh &mesh, const std::vector<Point> &points, const Pose &pose = {},
                     double within = std::numeric_limits<double>::infinity()) {
        return detail::found<ClosestPoint>(points.size(), [&](ClosestPoint *answers) {
            return cbvh_signed_point_distances(raw(), mesh.raw(), &pose, detail::numbers(points), points.size(), within,
                                         answers);
        });
    }
    std::optional<ClosestPoint> signed_point_distance(const Mesh &mesh, const Point &point, const Pose &pose = {},
                                                double within = std::numeric_limits<double>::infinity()) {
        ClosestPoint answer{};
        check(cbvh_signed_point_distances(raw(), mesh.raw(), &pose, point.data(), 1, within, &answer));
        return detail::found(answer);
    }
    /// Where rays first hit, whether they hit, and all hits.
    std::vector<std::optional<RayHit>> first_hits(const Mesh &mesh, const std::vector<Ray> &rays,
                                                  const Pose &pose = {}) {
        return detail::found<RayHit>(rays.size(), [&](RayHit *answers) {
            return cbvh_first_hits(raw(), mesh.raw(), &pose, rays.data(), rays.size(), answers);
        });
    }
    std::optional<RayHit> first_hit(const Mesh &mesh, const Ray &ray, const Pose &pose = {}) {
        RayHit answer{};
        check(cbvh_first_hits(raw(), mesh.raw(), &pose, &ray, 1, &answer));
        return detail::found(answer);
    }
    bool any_hit(const Mesh &mesh, const Ray &ray, const Pose &pose = {}) {
        bool answer = false;
        check(cbvh_any_hits(raw(), mesh.raw(), &pose, &ray, 1, &answer));
        return answer;
    }
    std::vector<bool> any_hits(const Mesh &mesh, const std::vector<Ray> &rays, const Pose &pose = {}) {
        return detail::choices(rays.size(), [&](bool *answers) {
            return cbvh_any_hits(raw(), mesh.raw(), &pose, rays.data(), rays.size(), answers);
        });
    }
    std::vector<std::vector<RayHit>> all_hits(const Mesh &mesh, const std::vector<Ray> &rays, const Pose &pose = {}) {
        return detail::lists<RayHit>(
            room_, rays.size(), [&](std::size_t *counts, RayHit *hits, std::size_t capacity, std::size_t *count) {
                return cbvh_all_hits(raw(), mesh.raw(), &pose, rays.data(), rays.size(), counts, hits, capacity, count);
            });
    }
    std::vector<bool> segment_hits(const Mesh &mesh, const std::vector<Segment> &segments, const Pose &pose = {}) {
        return detail::choices(segments.size(), [&](bool *answers) {
            return cbvh_segment_hits(raw(), mesh.raw(), &pose, segments.data(), segments.size(), answers);
        });
    }
    /// Whether the ends of each segment see each other past a mesh: see cbvh_visible.
    std::vector<bool> visible(const Mesh &mesh, const std::vector<Segment> &segments, double margin = 0,
                              const Pose &pose = {}) {
        return detail::choices(segments.size(), [&](bool *answers) {
            return cbvh_visible(raw(), mesh.raw(), &pose, segments.data(), segments.size(), margin, answers);
        });
    }

private:
    using Owned = detail::Handle<cbvh_querier, cbvh_querier_free>;

    static std::vector<cbvh_path> handles(const std::vector<Path> &paths) {
        std::vector<cbvh_path> handles;
        handles.reserve(paths.size());
        for (const Path &path : paths) {
            handles.push_back(path.raw());
        }
        return handles;
    }
    detail::Room room_, region_room_;
    Owned handle_;
};

/// Reuses results from pose to pose of one pair, which is faster if a mesh moves in small steps. Make one for each
/// thread.
class Tracker {
public:
    Tracker() {
        cbvh_tracker tracker{0};
        check(cbvh_tracker_new(&tracker));
        handle_ = Owned(tracker);
    }
    cbvh_tracker raw() const noexcept { return handle_.raw(); }
    bool collide(Querier &querier, const Mesh &a, const Mesh &b, const Pose &pose) {
        bool answer = false;
        check(cbvh_tracker_collide(raw(), querier.raw(), a.raw(), b.raw(), &pose, 1, &answer));
        return answer;
    }
    std::vector<bool> collide(Querier &querier, const Mesh &a, const Mesh &b, const std::vector<Pose> &poses) {
        return detail::choices(poses.size(), [&](bool *answers) {
            return cbvh_tracker_collide(raw(), querier.raw(), a.raw(), b.raw(), poses.data(), poses.size(), answers);
        });
    }
    bool within(Querier &querier, const Mesh &a, const Mesh &b, const Pose &pose, double d) {
        bool answer = false;
        check(cbvh_tracker_within(raw(), querier.raw(), a.raw(), b.raw(), &pose, 1, d, &answer));
        return answer;
    }
    std::vector<bool> within(Querier &querier, const Mesh &a, const Mesh &b, const std::vector<Pose> &poses, double d) {
        return detail::choices(poses.size(), [&](bool *answers) {
            return cbvh_tracker_within(raw(), querier.raw(), a.raw(), b.raw(), poses.data(), poses.size(), d, answers);
        });
    }
    DistanceAnswer distance(Querier &querier, const Mesh &a, const Mesh &b, const Pose &pose) {
        DistanceAnswer answer{};
        check(cbvh_tracker_distance(raw(), querier.raw(), a.raw(), b.raw(), &pose, 1, &answer));
        return answer;
    }
    std::vector<DistanceAnswer> distance(Querier &querier, const Mesh &a, const Mesh &b,
                                         const std::vector<Pose> &poses) {
        return detail::answers<DistanceAnswer>(poses.size(), [&](DistanceAnswer *answers) {
            return cbvh_tracker_distance(raw(), querier.raw(), a.raw(), b.raw(), poses.data(), poses.size(), answers);
        });
    }
    SignedDistance signed_distance(Querier &querier, const Mesh &a, const Mesh &b, const Pose &pose,
                                   const PenetrationOptions &options = {}) {
        const cbvh_penetration_options raw_options = options.raw();
        SignedDistance answer{};
        check(cbvh_tracker_signed_distance(raw(), querier.raw(), a.raw(), b.raw(), &pose, 1, &raw_options, &answer));
        return answer;
    }
    std::vector<SignedDistance> signed_distance(Querier &querier, const Mesh &a, const Mesh &b,
                                                const std::vector<Pose> &poses,
                                                const PenetrationOptions &options = {}) {
        const cbvh_penetration_options raw_options = options.raw();
        return detail::answers<SignedDistance>(poses.size(), [&](SignedDistance *answers) {
            return cbvh_tracker_signed_distance(raw(), querier.raw(), a.raw(), b.raw(), poses.data(), poses.size(),
                                                &raw_options, answers);
        });
    }

private:
    using Owned = detail::Handle<cbvh_tracker, cbvh_tracker_free>;
    Owned handle_;
};

/// Many placed meshes. Queries may run while other threads change it: each query is about the scene as it is when the
/// query begins. Copies share the meshes. If a list of pairs, contacts or hits is longer than 64 and than the last
/// list, the library asks for it twice, because the first time only counts its elements.
class Scene {
public:
    explicit Scene(cbvh_backend backend = CBVH_BACKEND_BEST)
        : Scene(made([&](cbvh_scene *scene) { return cbvh_scene_new(backend, scene); })) {}
    /// Opens a scene file.
    static Scene open(const std::string &path) {
        return made([&](cbvh_scene *scene) { return cbvh_scene_open(detail::c_text("path", path), scene); });
    }
    /// Makes a scene of the instances in the file of a mesh.
    static Scene of_mesh(const Mesh &mesh) {
        return made([&](cbvh_scene *scene) { return cbvh_scene_of_mesh(mesh.raw(), scene); });
    }
    Scene(Scene &&) noexcept = default;
    Scene &operator=(Scene &&) noexcept = default;
    Scene(const Scene &other) : Scene(made([&](cbvh_scene *scene) { return cbvh_scene_clone(other.raw(), scene); })) {}
    Scene &operator=(const Scene &other) {
        *this = Scene(other);
        return *this;
    }
    ~Scene() = default;
    cbvh_scene raw() const noexcept { return handle_.raw(); }

    void set_parallel(bool parallel) { check(cbvh_scene_set_parallel(raw(), parallel)); }
    void set_tracking(bool tracking) { check(cbvh_scene_set_tracking(raw(), tracking)); }
    void set_budget(std::uint64_t visits) { check(cbvh_scene_set_budget(raw(), visits)); }
    /// See Querier::set_stop. Copies share the flag.
    void set_stop(const Stop &stop) { check(cbvh_scene_set_stop(raw(), stop.raw())); }
    void set_stop(std::nullptr_t) { check(cbvh_scene_set_stop(raw(), cbvh_stop{0})); }
    Stats stats() const {
        Stats stats{};
        check(cbvh_scene_stats(raw(), &stats));
        return stats;
    }

    /// Places a mesh in the world; a name that is empty is none. If it is solid, what is inside touches it: see Mesh::solid.
    Instance add(const Mesh &mesh, const Pose &world, const std::string &name = {}, bool solid = false) {
        if (solid) {
            return add(mesh.solid(), world, name);
        }
        Instance instance{0};
        const char *raw_name = name.empty() ? nullptr : detail::c_text("name", name);
        check(cbvh_scene_add(raw(), mesh.raw(), &world, raw_name, &instance));
        return instance;
    }
    void remove(Instance instance) { check(cbvh_scene_remove(raw(), instance)); }
    /// Replaces the mesh of an instance. Everything else stays.
    void set_mesh(Instance instance, const Mesh &mesh) { check(cbvh_scene_set_mesh(raw(), instance, mesh.raw())); }
    /// Lets an instance move with a parent, as a part with its gripper: see cbvh_scene_attach.
    void attach(Instance child, Instance parent) { check(cbvh_scene_attach(raw(), child, parent)); }
    void detach(Instance child) { check(cbvh_scene_detach(raw(), child)); }
    /// What an instance is attached to, if it is.
    std::optional<Instance> parent(Instance child) const {
        Instance parent{0};
        const cbvh_status status = cbvh_scene_parent(raw(), child, &parent);
        // The scene may lack the instance itself.
        if (status == CBVH_NOT_FOUND && std::string(cbvh_last_message()).rfind("child: ", 0) == 0) {
            return std::nullopt;
        }
        check(status);
        return parent;
    }
    void set_pose(Instance instance, const Pose &world) { check(cbvh_scene_set_poses(raw(), &instance, &world, 1)); }
    /// Moves many instances, or none if it throws.
    void set_poses(const std::vector<std::pair<Instance, Pose>> &poses) {
        std::vector<Instance> instances;
        std::vector<Pose> worlds;
        for (const auto &[instance, world] : poses) {
            instances.push_back(instance);
            worlds.push_back(world);
        }
        check(cbvh_scene_set_poses(raw(), instances.data(), worlds.data(), instances.size()));
    }
    void set_groups(Instance instance, std::uint32_t member, std::uint32_t meets) {
        check(cbvh_scene_set_groups(raw(), instance, member, meets));
    }
    void set_allowed(Instance a, Instance b, bool allowed) { check(cbvh_scene_set_allowed(raw(), a, b, allowed)); }
    /// Adds a margin to the radius of an instance's mesh in every query.
    void set_margin(Instance instance, double margin) { check(cbvh_scene_set_margin(raw(), instance, margin)); }
    /// Gives a pair a margin besides those of both.
    void set_pair_margin(Instance a, Instance b, double margin) {
        check(cbvh_scene_set_pair_margin(raw(), a, b, margin));
    }
    std::optional<Instance> find(const std::string &name) const {
        Instance instance{0};
        const cbvh_status status = cbvh_scene_find(raw(), detail::c_text("name", name), &instance);
        if (status == CBVH_NOT_FOUND) {
            return std::nullopt;
        }
        check(status);
        return instance;
    }
    std::vector<Instance> instances() const {
        return detail::list<Instance>([&](Instance *instances, std::size_t capacity, std::size_t *count) {
            return cbvh_scene_instances(raw(), instances, capacity, count);
        });
    }
    std::string name(Instance instance) const {
        return detail::text([&](char *buffer, std::size_t capacity, std::size_t *length) {
            return cbvh_scene_instance_name(raw(), instance, buffer, capacity, length);
        });
    }
    Pose pose(Instance instance) const {
        Pose world;
        check(cbvh_scene_instance_pose(raw(), instance, &world));
        return world;
    }
    Mesh mesh(Instance instance) const {
        cbvh_mesh mesh{0};
        check(cbvh_scene_instance_mesh(raw(), instance, &mesh));
        return Mesh(mesh);
    }
    double margin(Instance instance) const {
        double margin = 0;
        check(cbvh_scene_instance_margin(raw(), instance, &margin));
        return margin;
    }
    double pair_margin(Instance a, Instance b) const {
        double margin = 0;
        check(cbvh_scene_pair_margin(raw(), a, b, &margin));
        return margin;
    }

    bool collide() {
        bool answer = false;
        check(cbvh_scene_collide(raw(), &answer));
        return answer;
    }
    bool within(double d) {
        bool answer = false;
        check(cbvh_scene_within(raw(), d, &answer));
        return answer;
    }
    /// The nearest pair, if there is any pair.
    std::optional<cbvh_scene_distance_answer> distance() {
        cbvh_scene_distance_answer answer{};
        check(cbvh_scene_distance(raw(), &answer));
        return detail::found(answer);
    }
    /// The pair that overlaps most, or else the nearest one, if there is any pair.
    std::optional<cbvh_scene_signed_distance_answer> signed_distance(const PenetrationOptions &options = {}) {
        const cbvh_penetration_options raw_options = options.raw();
        cbvh_scene_signed_distance_answer answer{};
        check(cbvh_scene_signed_distance(raw(), &raw_options, &answer));
        return detail::found(answer);
    }
    std::vector<cbvh_scene_pair> pairs_in_contact() {
        return detail::list<cbvh_scene_pair>(
            room_, [&](cbvh_scene_pair *pairs, std::size_t capacity, std::size_t *count) {
                return cbvh_scene_pairs_in_contact(raw(), pairs, capacity, count);
            });
    }
    std::vector<cbvh_scene_pair> pairs_within(double d) {
        return detail::list<cbvh_scene_pair>(
            room_, [&](cbvh_scene_pair *pairs, std::size_t capacity, std::size_t *count) {
                return cbvh_scene_pairs_within(raw(), d, pairs, capacity, count);
            });
    }
    /// The pairs that overlap or are at most `margin` apart, with their signed distances: see cbvh_scene_near_pairs.
    std::vector<cbvh_scene_near_pair> near_pairs(double margin, const PenetrationOptions &options = {}) {
        const cbvh_penetration_options raw_options = options.raw();
        return detail::list<cbvh_scene_near_pair>(
            room_, [&](cbvh_scene_near_pair *pairs, std::size_t capacity, std::size_t *count) {
                return cbvh_scene_near_pairs(raw(), margin, &raw_options, pairs, capacity, count);
            });
    }
    std::vector<cbvh_scene_relation> relations() {
        return detail::list<cbvh_scene_relation>(
            room_, [&](cbvh_scene_relation *found, std::size_t capacity, std::size_t *count) {
                return cbvh_scene_relations(raw(), found, capacity, count);
            });
    }
    std::vector<cbvh_scene_contact> contacts() {
        return detail::list<cbvh_scene_contact>(
            room_, [&](cbvh_scene_contact *found, std::size_t capacity, std::size_t *count) {
                return cbvh_scene_contacts(raw(), found, capacity, count);
            });
    }

    /// The pairs that are not apart, with how they lie.
    std::vector<cbvh_scene_clash> clashes(const ClashOptions &options = {}) {
        const cbvh_clash_options raw_options = options.raw();
        return detail::list<cbvh_scene_clash>(
            room_, [&](cbvh_scene_clash *found, std::size_t capacity, std::size_t *count) {
                return cbvh_scene_clashes(raw(), &raw_options, found, capacity, count);
            });
    }
    /// The same, with what they have in common.
    std::vector<cbvh_scene_measured_clash> measured_clashes(const ClashOptions &options = {}) {
        const cbvh_clash_options raw_options = options.raw();
        return detail::list<cbvh_scene_measured_clash>(
            room_, [&](cbvh_scene_measured_clash *found, std::size_t capacity, std::size_t *count) {
                return cbvh_scene_measured_clashes(raw(), &raw_options, found, capacity, count);
            });
    }

    /// An instance, and the path in the world that it moves along, which must be there when the query runs.
    struct Way {
        Way(Instance moved, const Path &along) : instance(moved), path(along.raw()) {}
        /// This path would be gone by then: give it a name.
        Way(Instance, const Path &&) = delete;
        Instance instance;
        cbvh_path path;
    };
    MotionAnswer motion(const std::vector<Way> &ways, const MotionOptions &options = {}) {
        MotionAnswer answer{};
        ask(ways, options,
            [&](const Instance *instances, const cbvh_path *paths, const cbvh_motion_options *raw_options) {
                return cbvh_scene_motion(raw(), instances, paths, ways.size(), raw_options, &answer);
            });
        return answer;
    }
    bool is_free(const std::vector<Way> &ways, const MotionOptions &options = {}) {
        bool answer = false;
        ask(ways, options,
            [&](const Instance *instances, const cbvh_path *paths, const cbvh_motion_options *raw_options) {
                return cbvh_scene_is_free(raw(), instances, paths, ways.size(), raw_options, &answer);
            });
        return answer;
    }

    /// These functions answer as those of Querier do, over all instances, for probes in the world.
    std::vector<std::optional<ClosestPoint>>
    closest_points(const std::vector<Point> &points, double within = std::numeric_limits<double>::infinity()) {
        return detail::found<ClosestPoint>(points.size(), [&](ClosestPoint *answers) {
            return cbvh_scene_closest_points(raw(), detail::numbers(points), points.size(), within, answers);
        });
    }
    std::optional<ClosestPoint> closest_point(const Point &point,
                                              double within = std::numeric_limits<double>::infinity()) {
        ClosestPoint answer{};
        check(cbvh_scene_closest_points(raw(), point.data(), 1, within, &answer));
        return detail::found(answer);
    }
    std::vector<cbvh_side> sides(const std::vector<Point> &points) {
        return detail::answers<cbvh_side>(points.size(), [&](cbvh_side *answers) {
            return cbvh_scene_sides(raw(), detail::numbers(points), points.size(), answers);
        });
    }
    cbvh_side side(const Point &point) {
        cbvh_side answer = CBVH_SIDE_NOT_ASKED;
        check(cbvh_scene_sides(raw(), point.data(), 1, &answer));
        return answer;
    }
    std::vector<std::optional<ClosestPoint>>
    signed_point_distances(const std::vector<Point> &points, double within = std::numeric_limits<double>::infinity()) {
        return detail::found<ClosestPoint>(points.size(), [&](ClosestPoint *answers) {
            return cbvh_scene_signed_point_distances(raw(), detail::numbers(points), points.size(), within, answers);
        });
    }
    std::optional<ClosestPoint> signed_point_distance(const Point &point,
                                                double within = std::numeric_limits<double>::infinity()) {
        ClosestPoint answer{};
        check(cbvh_scene_signed_point_distances(raw(), point.data(), 1, within, &answer));
        return detail::found(answer);
    }
    std::vector<std::optional<RayHit>> first_hits(const std::vector<Ray> &rays) {
        return detail::found<RayHit>(rays.size(), [&](RayHit *answers) {
            return cbvh_scene_first_hits(raw(), rays.data(), rays.size(), answers);
        });
    }
    std::optional<RayHit> first_hit(const Ray &ray) {
        RayHit answer{};
        check(cbvh_scene_first_hits(raw(), &ray, 1, &answer));
        return detail::found(answer);
    }
    bool any_hit(const Ray &ray) {
        bool answer = false;
        check(cbvh_scene_any_hits(raw(), &ray, 1, &answer));
        return answer;
    }
    std::vector<bool> any_hits(const std::vector<Ray> &rays) {
        return detail::choices(rays.size(), [&](bool *answers) {
            return cbvh_scene_any_hits(raw(), rays.data(), rays.size(), answers);
        });
    }
    std::vector<std::vector<RayHit>> all_hits(const std::vector<Ray> &rays) {
        return detail::lists<RayHit>(
            room_, rays.size(), [&](std::size_t *counts, RayHit *hits, std::size_t capacity, std::size_t *count) {
                return cbvh_scene_all_hits(raw(), rays.data(), rays.size(), counts, hits, capacity, count);
            });
    }
    std::vector<bool> segment_hits(const std::vector<Segment> &segments) {
        return detail::choices(segments.size(), [&](bool *answers) {
            return cbvh_scene_segment_hits(raw(), segments.data(), segments.size(), answers);
        });
    }
    std::vector<bool> visible(const std::vector<Segment> &segments, double margin = 0) {
        return detail::choices(segments.size(), [&](bool *answers) {
            return cbvh_scene_visible(raw(), segments.data(), segments.size(), margin, answers);
        });
    }

private:
    using Owned = detail::Handle<cbvh_scene, cbvh_scene_free>;

    explicit Scene(cbvh_scene raw) : handle_(raw) {}
    template <class Make> static Scene made(Make make) {
        cbvh_scene scene{0};
        check(make(&scene));
        return Scene(scene);
    }
    template <class Ask> static void ask(const std::vector<Way> &ways, const MotionOptions &options, Ask ask) {
        const cbvh_motion_options raw_options = options.raw();
        std::vector<Instance> instances;
        std::vector<cbvh_path> paths;
        for (const Way &way : ways) {
            instances.push_back(way.instance);
            paths.push_back(way.path);
        }
        check(ask(instances.data(), paths.data(), &raw_options));
    }
    detail::Room room_;
    Owned handle_;
};

/// How a robot is read: see cbvh_robot_options. Empty text stands for none.
struct RobotOptions {
    std::vector<std::string> packages;
    std::string srdf;
    std::string cache;
    double cylinder_error = 0;
    bool visual = false;
    cbvh_robot_base base = CBVH_BASE_FIXED;
    bool allow_outside = false;
    bool apply_up_axis = false;
};

/// A robot among obstacles, in queries by the values of its joints, in the order of joints(). Queries may run
/// while others change it: each query is about the robot as it is when the query begins. Copies share the meshes.
class Robot {
public:
    using Joints = std::vector<double>;
    /// A group of joints, by their places.
    struct Group {
        std::string name;
        std::vector<std::size_t> joints;
    };
    /// Two bodies that overlap or are near each other, and the derivative of `distance` by each joint value.
    struct NearPair : cbvh_robot_near_pair {
        std::vector<double> gradient;
    };
    /// A named configuration of a group.
    struct State {
        std::string name;
        std::string group;
        std::vector<cbvh_joint_value> values;
    };
    /// A motion on which each joint value follows a polynomial of time from 0 to 1: its coefficients, the constant first.
    struct Polynomials {
        std::vector<std::vector<double>> coefficients;
    };

    static Robot from_urdf(const std::string &path, const RobotOptions &options = {}) {
        const auto packages = texts("options.packages", options.packages);
        const auto text = [](const char *name, const std::string &of) {
            return of.empty() ? nullptr : detail::c_text(name, of);
        };
        cbvh_robot_options raw_options{};
        raw_options.size = sizeof raw_options;
        raw_options.packages = packages.data();
        raw_options.package_count = packages.size();
        raw_options.srdf = text("options.srdf", options.srdf);
        raw_options.cache = text("options.cache", options.cache);
        raw_options.cylinder_error = options.cylinder_error;
        raw_options.visual = options.visual;
        raw_options.base = options.base;
        raw_options.allow_outside = options.allow_outside;
        raw_options.apply_up_axis = options.apply_up_axis;
        return made([&](cbvh_robot *robot) {
            return cbvh_robot_from_urdf(detail::c_text("path", path), &raw_options, robot);
        });
    }
    Robot(Robot &&) noexcept = default;
    Robot &operator=(Robot &&) noexcept = default;
    Robot(const Robot &other) : Robot(made([&](cbvh_robot *robot) { return cbvh_robot_clone(other.raw(), robot); })) {}
    Robot &operator=(const Robot &other) {
        *this = Robot(other);
        return *this;
    }
    ~Robot() = default;
    cbvh_robot raw() const noexcept { return handle_.raw(); }

    void set_parallel(bool parallel) { check(cbvh_robot_set_parallel(raw(), parallel)); }
    /// See Querier::set_stop. Copies share the flag.
    void set_stop(const Stop &stop) { check(cbvh_robot_set_stop(raw(), stop.raw())); }
    void set_stop(std::nullptr_t) { check(cbvh_robot_set_stop(raw(), cbvh_stop{0})); }

    std::string name() const {
        return detail::text([&](char *buffer, std::size_t capacity, std::size_t *length) {
            return cbvh_robot_name(raw(), buffer, capacity, length);
        });
    }
    /// The names of the joint values.
    std::vector<std::string> joints() const {
        std::vector<std::string> names;
        for (std::size_t number = 0; number < counts().joints; number++) {
            names.push_back(text(cbvh_robot_joint_name, number));
        }
        return names;
    }
    std::vector<cbvh_joint_limits> limits() const {
        return detail::list<cbvh_joint_limits>([&](cbvh_joint_limits *limits, std::size_t capacity, std::size_t *count) {
            return cbvh_robot_limits(raw(), limits, capacity, count);
        });
    }
    /// The names of the links, in the order of link_poses.
    std::vector<std::string> links() const {
        std::vector<std::string> names;
        for (const Body link : detail::list<Body>([&](Body *links, std::size_t capacity, std::size_t *count) {
                 return cbvh_robot_links(raw(), links, capacity, count);
             })) {
            names.push_back(name(link));
        }
        return names;
    }
    /// What was read otherwise than its author may have meant: see cbvh_robot_warning.
    std::vector<std::string> warnings() const {
        return detail::texts([&](std::size_t number, char *buffer, std::size_t capacity, std::size_t *length) {
            return cbvh_robot_warning(raw(), number, buffer, capacity, length);
        });
    }
    std::vector<Group> groups() const {
        std::vector<Group> groups;
        for (std::size_t number = 0; number < counts().groups; number++) {
            groups.push_back({text(cbvh_robot_group_name, number),
                              detail::list<std::size_t>(
                                  [&](std::size_t *joints, std::size_t capacity, std::size_t *count) {
                                      return cbvh_robot_group_joints(raw(), number, joints, capacity, count);
                                  })});
        }
        return groups;
    }
    std::vector<State> states() const {
        std::vector<State> states;
        for (std::size_t number = 0; number < counts().states; number++) {
            states.push_back({text(cbvh_robot_state_name, number), text(cbvh_robot_state_group, number),
                              detail::list<cbvh_joint_value>(
                                  [&](cbvh_joint_value *values, std::size_t capacity, std::size_t *count) {
                                      return cbvh_robot_state_values(raw(), number, values, capacity, count);
                                  })});
        }
        return states;
    }
    /// The body with a name, if there is one.
    std::optional<Body> find(const std::string &name) const {
        Body body{0};
        const cbvh_status status = cbvh_robot_find(raw(), detail::c_text("name", name), &body);
        if (status == CBVH_NOT_FOUND) {
            return std::nullopt;
        }
        check(status);
        return body;
    }
    std::string name(Body body) const {
        return detail::text([&](char *buffer, std::size_t capacity, std::size_t *length) {
            return cbvh_robot_body_name(raw(), body, buffer, capacity, length);
        });
    }
    /// The shapes of a body with their poses in the frame of its link or, for an obstacle, in the world: see
    /// cbvh_robot_shape.
    std::vector<std::pair<Mesh, Pose>> shapes(Body body) const {
        check_body(body);
        std::vector<std::pair<Mesh, Pose>> shapes;
        for (;;) {
            cbvh_mesh mesh{0};
            Pose pose;
            const cbvh_status status = cbvh_robot_shape(raw(), body, shapes.size(), &mesh, &pose);
            if (status == CBVH_NOT_FOUND) {
                return shapes;
            }
            check(status);
            shapes.emplace_back(Mesh(mesh), pose);
        }
    }
    /// The pairs that are checked.
    std::vector<cbvh_body_pair> pairs() const {
        return detail::list<cbvh_body_pair>([&](cbvh_body_pair *pairs, std::size_t capacity, std::size_t *count) {
            return cbvh_robot_pairs(raw(), pairs, capacity, count);
        });
    }

    /// Adds an obstacle at a pose in the world. A mesh is its surface, and what is wholly inside does not touch it, unless it is
    /// solid: see Mesh::solid and pairs_inside.
    Body add_obstacle(const std::string &name, const Mesh &mesh, const Pose &pose = {}, bool solid = false) {
        if (solid) {
            return add_obstacle(name, mesh.solid(), pose);
        }
        Body body{0};
        check(cbvh_robot_add_obstacle(raw(), detail::c_text("name", name), mesh.raw(), &pose, &body));
        return body;
    }
    /// Attaches an object to a link, at a pose in the link's frame. It may touch that link and the given ones. The link's
    /// margin does not apply to it: see set_margin.
    Body attach(const std::string &name, const Mesh &mesh, const std::string &link, const Pose &pose = {},
                const std::vector<std::string> &may_touch = {}, bool solid = false) {
        if (solid) {
            return attach(name, mesh.solid(), link, pose, may_touch);
        }
        Body body{0};
        const auto touched = texts("may_touch", may_touch);
        check(cbvh_robot_attach(raw(), detail::c_text("name", name), mesh.raw(), detail::c_text("link", link), &pose,
                                touched.data(), touched.size(), &body));
        return body;
    }
    void remove(const std::string &name) { check(cbvh_robot_remove(raw(), detail::c_text("name", name))); }
    void set_pose(const std::string &name, const Pose &pose) {
        check(cbvh_robot_set_pose(raw(), detail::c_text("name", name), &pose));
    }
    /// Sets the margin of one body. What is attached to a link does not get the link's.
    void set_margin(const std::string &name, double margin) {
        check(cbvh_robot_set_margin(raw(), detail::c_text("name", name), margin));
    }
    /// Makes a body a solid: what is inside touches it from now on. Throws unless its meshes are closed.
    void make_solid(const std::string &name) { check(cbvh_robot_make_solid(raw(), detail::c_text("name", name))); }
    void set_allowed(const std::string &a, const std::string &b, bool allowed) {
        check(cbvh_robot_set_allowed(raw(), detail::c_text("a", a), detail::c_text("b", b), allowed));
    }
    /// Allows the pairs that touch in this share of random configurations, and returns them.
    std::vector<cbvh_frequent_pair> allow_frequent(std::size_t samples, double share) {
        return detail::list<cbvh_frequent_pair>(
            [&](cbvh_frequent_pair *pairs, std::size_t capacity, std::size_t *count) {
                return cbvh_robot_allow_frequent(raw(), samples, share, pairs, capacity, count);
            });
    }

    /// The poses of all links in the world.
    std::vector<Pose> link_poses(const Joints &joints) const {
        std::vector<Pose> poses(counts().links);
        std::size_t count = 0;
        check(cbvh_robot_link_poses(raw(), joints.data(), joints.size(), 1, poses.data(), poses.size(), &count));
        return poses;
    }
    std::vector<std::vector<Pose>> link_poses(const std::vector<Joints> &joints) const {
        const Rows rows("joints", joints);
        const std::size_t links = counts().links;
        std::vector<Pose> poses(links * rows.count);
        std::size_t count = 0;
        check(cbvh_robot_link_poses(raw(), rows.data(), width(rows), rows.count, poses.data(), poses.size(), &count));
        return detail::divided(poses, std::vector<std::size_t>(rows.count, links));
    }
    bool collide(const Joints &joints) const {
        bool answer = false;
        check(cbvh_robot_collide(raw(), joints.data(), joints.size(), 1, &answer));
        return answer;
    }
    std::vector<bool> collide(const std::vector<Joints> &joints) const {
        const Rows rows("joints", joints);
        return detail::choices(rows.count, [&](bool *answers) {
            return cbvh_robot_collide(raw(), rows.data(), width(rows), rows.count, answers);
        });
    }
    /// The nearest pair, if there is any pair.
    std::optional<cbvh_robot_distance_answer> distance(const Joints &joints) const {
        cbvh_robot_distance_answer answer{};
        check(cbvh_robot_distances(raw(), joints.data(), joints.size(), 1, &answer));
        return detail::found(answer);
    }
    std::vector<std::optional<cbvh_robot_distance_answer>> distance(const std::vector<Joints> &joints) const {
        const Rows rows("joints", joints);
        return detail::found<cbvh_robot_distance_answer>(
            rows.count, [&](cbvh_robot_distance_answer *answers) {
                return cbvh_robot_distances(raw(), rows.data(), width(rows), rows.count, answers);
            });
    }
    /// The pair that overlaps most or, where none does, the nearest one, if there is any pair.
    std::optional<cbvh_robot_signed_distance_answer> signed_distance(const Joints &joints,
                                                                     const PenetrationOptions &options = {}) const {
        const cbvh_penetration_options raw_options = options.raw();
        cbvh_robot_signed_distance_answer answer{};
        check(cbvh_robot_signed_distances(raw(), joints.data(), joints.size(), 1, &raw_options, &answer));
        return detail::found(answer);
    }
    std::vector<std::optional<cbvh_robot_signed_distance_answer>>
    signed_distance(const std::vector<Joints> &joints, const PenetrationOptions &options = {}) const {
        const Rows rows("joints", joints);
        const cbvh_penetration_options raw_options = options.raw();
        return detail::found<cbvh_robot_signed_distance_answer>(
            rows.count, [&](cbvh_robot_signed_distance_answer *answers) {
                return cbvh_robot_signed_distances(raw(), rows.data(), width(rows), rows.count, &raw_options, answers);
            });
    }
    /// The pairs that overlap or are at most `margin` apart, with derivatives: see cbvh_robot_near_pairs.
    std::vector<NearPair> near_pairs(const Joints &joints, double margin, const PenetrationOptions &options = {}) const {
        detail::Room room;
        return near(room, joints.data(), joints.size(), 1, margin, options)[0];
    }
    std::vector<std::vector<NearPair>> near_pairs(const std::vector<Joints> &joints, double margin,
                                                  const PenetrationOptions &options = {}) {
        const Rows rows("joints", joints);
        return near(room_, rows.data(), width(rows), rows.count, margin, options);
    }
    std::vector<cbvh_body_pair> pairs_in_contact(const Joints &joints) const {
        return pairs_of(cbvh_robot_pairs_in_contact, joints);
    }
    std::vector<std::vector<cbvh_body_pair>> pairs_in_contact(const std::vector<Joints> &joints) {
        return pairs_of(cbvh_robot_pairs_in_contact, joints);
    }

    /// The bodies that are inside others without touching them, each as `a` with the body around it as `b`: see
    /// cbvh_robot_pairs_inside.
    std::vector<cbvh_body_pair> pairs_inside(const Joints &joints) const {
        return pairs_of(cbvh_robot_pairs_inside, joints);
    }
    std::vector<std::vector<cbvh_body_pair>> pairs_inside(const std::vector<Joints> &joints) {
        return pairs_of(cbvh_robot_pairs_inside, joints);
    }

    /// The end to which joints that turn without limits go the short way: see cbvh_robot_nearest_turns.
    Joints nearest_turns(const Joints &start, const Joints &end) const {
        return nearest_turns(std::vector<Joints>{start}, std::vector<Joints>{end})[0];
    }
    std::vector<Joints> nearest_turns(const std::vector<Joints> &starts, const std::vector<Joints> &ends) const {
        const Rows from("starts", starts), to("ends", ends, starts);
        std::vector<double> nearest(to.numbers.size());
        check(cbvh_robot_nearest_turns(raw(), from.data(), to.data(), width(from), from.count, nearest.data()));
        std::vector<Joints> rows = ends;
        auto next = nearest.begin();
        for (Joints &row : rows) {
            const auto end = next + static_cast<std::ptrdiff_t>(row.size());
            row.assign(next, end);
            next = end;
        }
        return rows;
    }

    /// Whether the straight motion from a start to an end is certainly free, at every moment. Joints turn by the difference of
    /// their values, the long way round if that is long: see nearest_turns.
    bool is_free(const Joints &start, const Joints &end, const MotionOptions &options = {}) const {
        return edges_are_free({start}, {end}, options)[0];
    }
    std::vector<bool> edges_are_free(const std::vector<Joints> &starts, const std::vector<Joints> &ends,
                                     const MotionOptions &options = {}) const {
        const Rows from("starts", starts), to("ends", ends, starts);
        const cbvh_motion_options raw_options = options.raw();
        return detail::choices(from.count, [&](bool *answers) {
            return cbvh_robot_edges_are_free(raw(), from.data(), to.data(), width(from), from.count, &raw_options,
                                             answers);
        });
    }
    /// The same of a motion on polynomials.
    bool is_free(const Polynomials &motion, const MotionOptions &options = {}) const {
        const Rows rows(motion);
        const cbvh_motion_options raw_options = options.raw();
        bool answer = false;
        check(cbvh_robot_are_free(raw(), rows.data(), rows.width, rows.count, 1, &raw_options, &answer));
        return answer;
    }
    /// Whether a straight motion is free, and otherwise what touches first, and when.
    cbvh_robot_motion_answer motion(const Joints &start, const Joints &end, const MotionOptions &options = {}) const {
        return edge_motions({start}, {end}, options)[0];
    }
    std::vector<cbvh_robot_motion_answer> edge_motions(const std::vector<Joints> &starts,
                                                       const std::vector<Joints> &ends,
                                                       const MotionOptions &options = {}) const {
        const Rows from("starts", starts), to("ends", ends, starts);
        const cbvh_motion_options raw_options = options.raw();
        return detail::answers<cbvh_robot_motion_answer>(from.count, [&](cbvh_robot_motion_answer *answers) {
            return cbvh_robot_edge_motions(raw(), from.data(), to.data(), width(from), from.count, &raw_options,
                                           answers);
        });
    }
    cbvh_robot_motion_answer motion(const Polynomials &motion, const MotionOptions &options = {}) const {
        const Rows rows(motion);
        const cbvh_motion_options raw_options = options.raw();
        cbvh_robot_motion_answer answer{};
        check(cbvh_robot_motions(raw(), rows.data(), rows.width, rows.count, 1, &raw_options, &answer));
        return answer;
    }

private:
    using Owned = detail::Handle<cbvh_robot, cbvh_robot_free>;

    /// Rows of numbers, one after the other.
    struct Rows {
        Rows(const char *name, const std::vector<Joints> &rows) : Rows(name, rows, rows) {}
        /// As many as there are of others, and of the same length.
        Rows(const char *name, const std::vector<Joints> &rows, const std::vector<Joints> &others)
            : width(others.empty() ? 0 : others[0].size()), count(rows.size()) {
            const std::string start = std::string(name) + ": expected ";
            detail::same_length(count, others.size(), (start + "as many ends as starts").c_str());
            for (const Joints &row : rows) {
                detail::same_length(row.size(), width, (start + "as many numbers in each row").c_str());
                numbers.insert(numbers.end(), row.begin(), row.end());
            }
        }
        /// The coefficients of each joint value, and zeros where others have more.
        explicit Rows(const Polynomials &motion) : width(1), count(motion.coefficients.size()) {
            for (const auto &of : motion.coefficients) {
                width = std::max(width, of.size());
            }
            for (const auto &of : motion.coefficients) {
                numbers.insert(numbers.end(), of.begin(), of.end());
                numbers.insert(numbers.end(), width - of.size(), 0);
            }
        }
        const double *data() const { return numbers.data(); }
        std::vector<double> numbers;
        std::size_t width, count;
    };

    explicit Robot(cbvh_robot raw) : handle_(raw) {}
    template <class Make> static Robot made(Make make) {
        cbvh_robot robot{0};
        check(make(&robot));
        return Robot(robot);
    }
    static std::vector<const char *> texts(const char *name, const std::vector<std::string> &of) {
        std::vector<const char *> all;
        for (const std::string &text : of) {
            all.push_back(detail::c_text(name, text));
        }
        return all;
    }
    cbvh_robot_counts counts() const {
        cbvh_robot_counts counts{};
        check(cbvh_robot_count(raw(), &counts));
        return counts;
    }
    /// The number of joint values in a row. No rows are of the robot's.
    std::size_t width(const Rows &rows) const { return rows.count == 0 ? counts().joints : rows.width; }
    template <class Name> std::string text(Name of, std::size_t number) const {
        return detail::text([&](char *buffer, std::size_t capacity, std::size_t *length) {
            return of(raw(), number, buffer, capacity, length);
        });
    }
    void check_body(Body body) const { static_cast<void>(name(body)); }
    /// Runs a query whose answer is pairs, about one configuration or many.
    using PairsQuestion = decltype(cbvh_robot_pairs_in_contact);
    std::vector<cbvh_body_pair> pairs_of(PairsQuestion *ask, const Joints &joints) const {
        return detail::list<cbvh_body_pair>([&](cbvh_body_pair *pairs, std::size_t capacity, std::size_t *count) {
            return ask(raw(), joints.data(), joints.size(), 1, nullptr, pairs, capacity, count);
        });
    }
    std::vector<std::vector<cbvh_body_pair>> pairs_of(PairsQuestion *ask, const std::vector<Joints> &joints) {
        const Rows rows("joints", joints);
        return detail::lists<cbvh_body_pair>(
            room_, rows.count,
            [&](std::size_t *each, cbvh_body_pair *pairs, std::size_t capacity, std::size_t *count) {
                return ask(raw(), rows.data(), width(rows), rows.count, each, pairs, capacity, count);
            });
    }
    std::vector<std::vector<NearPair>> near(detail::Room &room, const double *joints, std::size_t width, std::size_t rows,
                                            double margin, const PenetrationOptions &options) const {
        const cbvh_penetration_options raw_options = options.raw();
        std::vector<std::size_t> counts(rows);
        std::vector<double> slopes;
        const auto pairs = detail::list<cbvh_robot_near_pair>(
            room, [&](cbvh_robot_near_pair *found, std::size_t capacity, std::size_t *count) {
                slopes.resize(capacity * width);
                return cbvh_robot_near_pairs(raw(), joints, width, rows, margin, &raw_options, counts.data(), found,
                                             slopes.data(), capacity, count);
            });
        std::vector<NearPair> all;
        all.reserve(pairs.size());
        for (std::size_t k = 0; k < pairs.size(); k++) {
            const auto first = slopes.begin() + static_cast<std::ptrdiff_t>(k * width);
            all.push_back({pairs[k], {first, first + static_cast<std::ptrdiff_t>(width)}});
        }
        return detail::divided(all, counts);
    }
    detail::Room room_;
    Owned handle_;
};

} // namespace cbvh

#endif
