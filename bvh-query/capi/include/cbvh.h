/* cbvh: exact collision and distance queries between rigid triangle meshes. The C interface, C99.
 *
 * A mesh is baked once, from arrays or files, into the bytes of a .cbvh file. Queries are about meshes in poses:
 *
 *     cbvh_mesh room, robot;
 *     cbvh_querier querier;
 *     cbvh_mesh_open("room.cbvh", CBVH_MAP, &room);
 *     cbvh_mesh_open("robot.cbvh", CBVH_MAP, &robot);
 *     cbvh_querier_new(CBVH_BACKEND_BEST, &querier);
 *     bool touching;
 *     if (cbvh_collide(querier, room, robot, &pose, 1, &touching) != CBVH_OK) puts(cbvh_last_message());
 *
 * What holds for all functions:
 *
 * Errors. Every function except cbvh_last_message returns a cbvh_status. Any status except CBVH_OK leaves a message for
 * the thread, which names the argument, what was expected and what was found. Arguments are checked before any query
 * runs. After a failure, handles that a function should have made are 0, and answers have no particular values;
 * nothing is ever written beyond them. Nothing unwinds out of a function. No argument makes a function crash if two
 * conditions hold: pointers that are neither null nor misaligned lead to as many elements as stated, and text ends with
 * a zero byte. If memory for arrays of the caller or for a list of contacts runs out, the status is CBVH_LIMIT. If it
 * runs out elsewhere, the process ends. Functions need 128 KiB of stack.
 *
 * Poses are "body to world". In queries about two meshes, the world is the frame of mesh A: a point x of mesh B is at
 * R x + t in A's frame. Points are columns; a pose is the rows of the 3 by 4 matrix [R | t]. R is a rotation to within
 * 2^-20. Lengths are in the unit of the meshes.
 *
 * Handles are numbers in small structures that are passed by value; they are not addresses. 0 is not a handle, and
 * freeing it does nothing. A handle that was freed, has another kind or was made up is refused with CBVH_INVALID_HANDLE
 * and never followed. A copy of the structure is the same handle, and must be freed only once. Handles that are not
 * freed live as long as the process. Use no handles in a child after fork() without exec().
 *
 * Threads. Functions may be called on any thread. Many threads may use a mesh, a path, a scene or a robot at the same
 * time. Only one thread at a time may use a querier or a tracker; a second one gets CBVH_BUSY. Make one querier for each
 * thread. A query is about a scene or a robot as it is when the query begins. Other threads may change it
 * meanwhile, and nobody waits for a query. A mesh, a path, a scene or a robot may be freed while other threads use
 * it: it lives until their queries end. A flag (cbvh_stop) may be set, cleared and freed on any thread at any time.
 * cbvh_querier_set_parallel, cbvh_scene_set_parallel and cbvh_robot_set_parallel let one query use all cores. The
 * number of threads is that of the environment variable RAYON_NUM_THREADS or, without it, of the cores.
 *
 * Answers have the same bits on every CPU, on any number of threads and in any order of queries, and are those of the
 * command cbvh and of the Rust library. They do not depend on how the calling thread rounds (fesetround), whether it
 * flushes subnormal numbers (-ffast-math) and which exceptions trap (feenableexcept): functions change this state if
 * they have to, and restore it. Functions of the caller run in the floating-point state of the thread that called the
 * query, except for long double on x86-64 on threads of the library.
 *
 * Lists. A function with a list of answers takes a buffer, the number of elements for which it has room, and a count.
 * The count always gets the number of all answers. If there are more answers than room, those that fit are written, and
 * the status is CBVH_BUFFER_TOO_SMALL. If there is room for none, the buffer may be NULL.
 *
 * Options start with their size in bytes, for example `cbvh_motion_options options = {.size = sizeof options};`, so
 * that later versions can add fields at their end. Fields that are 0 have their defaults, and so have fields that the
 * header of a program does not have yet. A program with a newer header may use an older library as long as fields that
 * the library does not have are 0; else the status is CBVH_INVALID_ARGUMENT. NULL stands for all defaults.
 *
 * Compatibility: see CBVH_ABI. */
#ifndef CBVH_H
#define CBVH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The version of the library that this header belongs to. */
#define CBVH_VERSION_MAJOR 1
#define CBVH_VERSION_MINOR 0
#define CBVH_VERSION_PATCH 0

/* The version of the binary interface, which is the number in the name of the shared library. A library runs programs
 * that were built with an older header of the same number. Within a number, functions and constants may be added, and
 * existing ones keep their meaning. */
#define CBVH_ABI 1

/* ---------------------------------------------------------------------------------------------------------- status */

/* Why a function failed, or CBVH_OK. */
typedef int32_t cbvh_status;
enum {
    CBVH_OK = 0,
    /* An argument is not valid: null, misaligned, not finite, not rigid, too large, an unknown number. */
    CBVH_INVALID_ARGUMENT = 1,
    /* A handle is 0, was freed, has another kind, or is not from this library. */
    CBVH_INVALID_HANDLE = 2,
    /* Another thread, or a function that called this one, uses the querier or tracker. */
    CBVH_BUSY = 3,
    /* There is no object, instance or body of that number or name. */
    CBVH_NOT_FOUND = 4,
    /* A list has more elements than its buffer has room for. */
    CBVH_BUFFER_TOO_SMALL = 5,
    /* The system refuses: a file that is not there or may not be read, a full disk. */
    CBVH_SYSTEM = 6,
    /* A file is not a .cbvh file, or is damaged. The message names the rule it breaks and where. */
    CBVH_DAMAGED = 7,
    /* A budget of visits or of memory, or the memory of the machine, does not suffice; or a limit of the format is
     * exceeded. */
    CBVH_LIMIT = 8,
    /* A mesh cannot be baked. */
    CBVH_BAKE_FAILED = 9,
    /* A function of the caller gave no pose or no sagitta. */
    CBVH_CALLBACK_FAILED = 10,
    /* A defect of this library. The handle that was in use can only be freed. Please report it. */
    CBVH_INTERNAL = 11,
    /* The flag of the querier, scene, robot or bake was set, or its time was over, before there was an answer: see cbvh_stop_new. */
    CBVH_STOPPED = 12
};

/* Returns the message of the last failure on this thread, in UTF-8, or an empty text. It is never NULL, and stays valid
 * until the next failure on this thread or the end of the thread. A success does not clear it. Call it after a function
 * has failed, not in the same list of arguments, which may be computed in any order. */
const char *cbvh_last_message(void);

/* Writes the CBVH_ABI of the library that runs. */
cbvh_status cbvh_abi(uint32_t *abi);

/* --------------------------------------------------------------------------------------------------------- handles */

/* A baked mesh: all objects of a file, or one of them. It may have a radius, and may be solid. */
typedef struct cbvh_mesh { uint64_t id; } cbvh_mesh;
/* A querier runs queries. It keeps its working memory from query to query. */
typedef struct cbvh_querier { uint64_t id; } cbvh_querier;
/* A tracker keeps results from pose to pose of a mesh that moves in small steps. */
typedef struct cbvh_tracker { uint64_t id; } cbvh_tracker;
/* A path of mesh B in the frame of mesh A, or of an instance in the world, over times from 0 to 1. */
typedef struct cbvh_path { uint64_t id; } cbvh_path;
/* Many placed meshes. */
typedef struct cbvh_scene { uint64_t id; } cbvh_scene;
/* A robot among obstacles. */
typedef struct cbvh_robot { uint64_t id; } cbvh_robot;
/* A flag that stops queries and bakes. */
typedef struct cbvh_stop { uint64_t id; } cbvh_stop;

/* ----------------------------------------------------------------------------------------------------------- poses */

/* A rigid placement: the rows of the 3 by 4 matrix [R | t], one after the other, body to world. */
typedef struct cbvh_pose { double rows[12]; } cbvh_pose;

/* The identity pose. */
#define CBVH_IDENTITY {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}

/* Checks a pose: finite, a translation of at most 2^120 along each axis, a rotation to within 2^-20. */
cbvh_status cbvh_pose_check(const cbvh_pose *pose);
/* Makes a pose from a quaternion x, y, z, w, the real part last, of length 1 to within 2^-21, and a translation x, y,
 * z. */
cbvh_status cbvh_pose_from_quaternion(const double *quaternion, const double *translation, cbvh_pose *result);
/* Makes the rigid pose nearest to one that is off by at most 2^-6: for rounded matrices. */
cbvh_status cbvh_pose_nearest(const cbvh_pose *pose, cbvh_pose *result);
/* Makes the inverse of a pose. */
cbvh_status cbvh_pose_inverse(const cbvh_pose *pose, cbvh_pose *result);
/* Makes the pose that applies `first` and then `next`. For example, a part's pose in a body and then the body's pose in
 * the world make the part's pose in the world. */
cbvh_status cbvh_pose_then(const cbvh_pose *first, const cbvh_pose *next, cbvh_pose *result);
/* Makes the pose of B in A's frame, which queries about two meshes take, from the poses of both in the world. */
cbvh_status cbvh_pose_relative(const cbvh_pose *world_a, const cbvh_pose *world_b, cbvh_pose *result);

/* ---------------------------------------------------------------------------------------------------------- meshes */

/* How a file is opened. */
typedef int32_t cbvh_open_mode;
enum {
    /* Maps the file. It takes microseconds, whatever its size, and pages are read when a query needs them. The bytes
     * of the file must not change while it is open: replace a file by renaming another one over it. A file that is
     * truncated while it is mapped ends the process with SIGBUS. */
    CBVH_MAP = 0,
    /* Maps the file, and reads from the disk no more than queries need: for files larger than memory. */
    CBVH_MAP_SPARSE = 1,
    /* Maps the file, and reads all of it in the background. */
    CBVH_MAP_WHOLE = 2,
    /* Copies the file into memory. Later changes of the file have no effect. */
    CBVH_READ = 3
};

/* Opens a .cbvh file. CBVH_SYSTEM if the system refuses it or it is not a regular file, CBVH_DAMAGED if it is not a
 * .cbvh file. Only the header and the table of objects are checked. If other parts are damaged, the query that needs
 * them fails. */
cbvh_status cbvh_mesh_open(const char *path, cbvh_open_mode mode, cbvh_mesh *mesh);
/* Opens the bytes of a .cbvh file, which are copied. */
cbvh_status cbvh_mesh_from_bytes(const void *bytes, size_t size, cbvh_mesh *mesh);
/* Opens the bytes of a .cbvh file in place, at any address. They must stay there unchanged until `release` is called
 * with `user`. This happens once, on any thread, when nothing uses the bytes any more: the handle, its clones and
 * objects and scenes with them are freed, and queriers that used them are freed or ran other queries. It
 * may happen during this call, because large files are copied to large memory pages. Without `release`, the bytes must
 * stay as long as the process. After a failure, `release` is not called. `release` must not throw an exception and must
 * not call this library. */
cbvh_status cbvh_mesh_borrow_bytes(const void *bytes, size_t size, void (*release)(void *user), void *user,
                                   cbvh_mesh *mesh);
/* Makes another handle of the same mesh, which must also be freed. Nothing is copied. */
cbvh_status cbvh_mesh_clone(cbvh_mesh mesh, cbvh_mesh *other);
/* Frees a handle. Scenes and clones keep the meshes that they use. A querier keeps the last eight meshes of its
 * queries until it is freed, or until the next query about any open mesh. */
cbvh_status cbvh_mesh_free(cbvh_mesh mesh);

/* Makes a mesh of one object in the file of a mesh, without a radius and not solid. CBVH_NOT_FOUND if the file has no
 * object of this number. */
cbvh_status cbvh_mesh_object(cbvh_mesh mesh, size_t number, cbvh_mesh *object);
/* Writes how many objects the file of a mesh has: at least one. */
cbvh_status cbvh_mesh_object_count(cbvh_mesh mesh, size_t *count);
/* Writes the name of an object, in UTF-8 with a zero byte at the end, and its length without that. A name that does not
 * fit is cut, and the status is CBVH_BUFFER_TOO_SMALL. */
cbvh_status cbvh_mesh_object_name(cbvh_mesh mesh, size_t number, char *buffer, size_t capacity, size_t *length);
/* Writes the number of the first object with a name. CBVH_NOT_FOUND if there is none. */
cbvh_status cbvh_mesh_find(cbvh_mesh mesh, const char *name, size_t *number);
/* Writes how many triangles are stored for the objects of a mesh. */
cbvh_status cbvh_mesh_triangle_count(cbvh_mesh mesh, uint64_t *count);
/* Lists the triangles of the input that are exact duplicates of a triangle, in ascending order. Such
 * triangles are stored once. */
cbvh_status cbvh_mesh_duplicates(cbvh_mesh mesh, uint32_t triangle, uint32_t *triangles, size_t capacity,
                                 size_t *count);
/* Writes the bytes of the file that a mesh is in, and how many there are. They state the mesh's radius, and that it is solid
 * if all objects of the file are closed. */
cbvh_status cbvh_mesh_bytes(cbvh_mesh mesh, void *buffer, size_t capacity, size_t *size);
/* Writes these bytes to a file, completely or not at all: it writes another file, which then replaces the first. Anything
 * under this name is replaced, also a symbolic link. */
cbvh_status cbvh_mesh_save(cbvh_mesh mesh, const char *path);
/* Checks the whole file of a mesh, which is read once. CBVH_DAMAGED, with the first rule that the file breaks. */
cbvh_status cbvh_mesh_validate(cbvh_mesh mesh);

/* Makes another handle of the same mesh with a radius, in mesh units from 0 to 2^118, which replaces the one that it
 * has. Nothing is copied. The new mesh is all points at most that far from the triangles. Two meshes touch if their
 * triangles are no farther apart than the sum of both radii, which is rounded to nearest; the comparison is exact.
 * Their distance is that of the triangles less the sum. CBVH_INVALID_ARGUMENT for a radius that is negative, NaN or
 * above 2^118. */
cbvh_status cbvh_mesh_rounded(cbvh_mesh mesh, double radius, cbvh_mesh *rounded);
/* Makes another handle of the same mesh as a solid, with the same radius: what is inside it touches it, and is at
 * distance 0. CBVH_INVALID_ARGUMENT if an object of the mesh is not closed and consistently oriented, or if the file
 * was baked without topology. CBVH_DAMAGED if the topology is damaged. */
cbvh_status cbvh_mesh_solid(cbvh_mesh mesh, cbvh_mesh *solid);
/* Writes the radius of a mesh: 0 if it was given none. */
cbvh_status cbvh_mesh_radius(cbvh_mesh mesh, double *radius);
/* Writes how far a vertex may be from the one that was given to the baker, in mesh units: 0 unless vertices were quantised,
 * rounded or welded on purpose, or lay below 2^-180. Answers are about the mesh as it is stored. */
cbvh_status cbvh_mesh_max_move(cbvh_mesh mesh, double *max_move);
/* Writes whether a mesh is solid. */
cbvh_status cbvh_mesh_is_solid(cbvh_mesh mesh, bool *is_solid);

/* Why a mesh is not closed. NAN stands for a length that is not known. */
typedef struct cbvh_open_edge_counts {
    /* The number of edges of one triangle: the border of a hole, of a sheet, or of a crack. */
    uint64_t boundary;
    /* The number of edges of two triangles that face opposite ways. */
    uint64_t flipped;
    /* The number of edges of more than two triangles, which do not cancel. */
    uint64_t crowded;
    /* The number of edges of one triangle whose gap is less than a hundredth of their length. */
    uint64_t cracks;
    /* The least gap. The gap of an edge of one triangle is the distance within which a bake with `weld` may make it one with
     * another open edge, in mesh units. */
    double nearest_gap;
    /* The greatest gap of a crack. */
    double widest_crack;
    /* A distance for `weld` that should close all cracks. */
    double proposed_weld;
} cbvh_open_edge_counts;

/* How many triangles an open edge has. */
typedef int32_t cbvh_open_edge_kind;
enum { CBVH_OPEN_BOUNDARY = 0, CBVH_OPEN_FLIPPED = 1, CBVH_OPEN_CROWDED = 2 };

/* An edge that leaves an object open. */
typedef struct cbvh_open_edge {
    /* In the direction in which more triangles traverse the edge, in mesh units. */
    double ends[2][3];
    /* For an edge of one triangle, how near another open edge is. */
    double gap;
    /* The number of the object in the file. */
    uint32_t object;
    cbvh_open_edge_kind kind;
    /* The ids of its triangles, or their places in a file without ids: the smallest numbers, at most four. */
    uint32_t triangle_count;
    uint32_t triangles[4];
    /* 0. */
    uint32_t reserved;
} cbvh_open_edge;

/* Writes how many edges leave the mesh open, so that queries about what is inside have no answer; none if it is closed.
 * Duplicates count with their orientation. It takes about a third of a second per million triangles of an open mesh at the
 * first call. CBVH_INVALID_ARGUMENT for a file that was baked without topology. */
cbvh_status cbvh_mesh_open_edge_counts(cbvh_mesh mesh, cbvh_open_edge_counts *counts);
/* Lists these edges, the first eight of each kind. */
cbvh_status cbvh_mesh_open_edges(cbvh_mesh mesh, cbvh_open_edge *edges, size_t capacity, size_t *count);
/* Writes a sentence about them, with the remedy. */
cbvh_status cbvh_mesh_open_edges_text(cbvh_mesh mesh, char *buffer, size_t capacity, size_t *length);

/* How a mesh is baked. The names are those of the command `cbvh bake`, which explains them. */
typedef struct cbvh_bake_options {
    size_t size;
    /* The layout of the nodes by name; NULL lets the baker choose. */
    const char *profile;
    /* The encoding of triangles, "f32", "packed" or "quantized"; NULL lets the baker choose one without loss. */
    const char *triangles;
    /* The time spent on the tree: "quick", about half of the time for queries that take about 1.1 times as long, or "default"; NULL for the
     * default. */
    const char *effort;
    /* The folder for scratch files; NULL for that of the output. Files only. */
    const char *scratch;
    /* How far "quantized" may move a vertex, in mesh units; 0 for 1e-5 of the diagonal of the object's box. */
    double max_error;
    /* The radius of the mesh in mesh units, as of cbvh_mesh_rounded, also in its file. */
    double radius;
    /* The most memory that the process may use, in bytes; 0 for no limit. Files only. */
    uint64_t max_memory;
    /* The following fields are 0 or 1. */
    /* Gives each object of the input a tree of its own. */
    int32_t split_objects;
    /* Reads files as scenes: nodes of glTF and COLLADA files become instances. Files only. */
    int32_t scene;
    /* Leaves out the numbers of the triangles in the input. */
    int32_t no_ids;
    /* Leaves out the topology, which queries about what is inside a mesh need. */
    int32_t no_topology;
    /* Bakes even if the output is up to date. Files only. */
    int32_t force;
    /* Makes the mesh solid, as cbvh_mesh_solid does, also in its file. */
    int32_t solid;
    /* Lets glTF files name buffers outside their own folders, which is otherwise refused. Files only. */
    int32_t allow_outside;
    /* Leaves out points without a position, those with a coordinate that is NaN or infinite, which are otherwise refused. Files
     * only. */
    int32_t drop_nan;
    /* How coordinates are rounded: "f32" rounds each to the nearest float, ties to even, so that coordinates which are equal in
     * two meshes stay equal; "none" or NULL leaves them. */
    const char *round;
    /* Moves each vertex of an object to the first vertex within this distance of it, in mesh units, which closes seams that are
     * open by rounding errors; 0 leaves vertices where they are. At most the diagonal of the object's box. */
    double weld;
    /* What stops the bake: see cbvh_stop_new. It then ends with CBVH_STOPPED, most often within a tenth of a second, and leaves nothing
     * behind; an output that was there stays as it was. The handle may be freed when the bake has begun. 0 for nothing. */
    cbvh_stop stop;
} cbvh_bake_options;

/* Bakes triangles in memory: 3 numbers per vertex, 3 vertices per face. Triangles are numbered in their order. It takes
 * about 0.6 microseconds per triangle on two cores. CBVH_BAKE_FAILED if the arrays are not a mesh: a face names a
 * vertex that does not exist, a coordinate is not finite or beyond 2^120, or there are no faces. */
cbvh_status cbvh_bake(const double *vertices, size_t vertex_count, const uint32_t *faces, size_t face_count,
                      const cbvh_bake_options *options, cbvh_mesh *mesh);
/* Bakes mesh files (OBJ, STL, PLY, glTF, COLLADA) or points (XYZ, PCD, PLY) of any size into a .cbvh file, which is written completely or not at all. An
 * output that is up to date is not written again. `was_up_to_date` then gets 1, else 0; it may be NULL. */
cbvh_status cbvh_bake_files(const char *const *inputs, size_t input_count, const char *output,
                            const cbvh_bake_options *options, int32_t *was_up_to_date);
/* Writes a warning of the last cbvh_bake_files on this thread, as cbvh_mesh_object_name does: a line that names the file
 * and the place, about what was read otherwise than its author may have meant, such as bytes that were left out.
 * CBVH_NOT_FOUND after the last one. A bake that failed, or whose output was up to date, has none. */
cbvh_status cbvh_bake_warning(size_t number, char *buffer, size_t capacity, size_t *length);

/* --------------------------------------------------------------------------------------------------- simple shapes
 *
 * Each function bakes a mesh in memory, with the default options. With cbvh_mesh_rounded and cbvh_mesh_solid, it
 * becomes
 *
 *     a ball            a cloud of one point, with a radius
 *     a capsule         a segment, with a radius
 *     a rounded box     a box whose sides are shorter by two radii, solid, with a radius
 *     balls             a cloud, with the radius of each ball
 *     a solid           a box, ground, cylinder, cone, convex hull, voxels or an octree, solid
 *
 * Lengths are in mesh units. CBVH_INVALID_ARGUMENT for a length that is not finite and above 0. Points and sides are 3
 * numbers each, unless stated otherwise. CBVH_BAKE_FAILED if a coordinate is not finite or beyond 2^120, or if there
 * are no points or cells. Surfaces look outwards. */

/* Bakes points, as triangles without area. Triangle `i` of answers is point `i`. Equal points stay: in contacts, each
 * is a triangle of its own. */
cbvh_status cbvh_bake_cloud(const double *points, size_t count, cbvh_mesh *mesh);
/* Bakes the segment between two points, which may be equal. */
cbvh_status cbvh_bake_segment(const double *from, const double *to, cbvh_mesh *mesh);
/* Bakes a box with these sides along x, y and z. Its middle is at the origin. */
cbvh_status cbvh_bake_box(const double *sides, cbvh_mesh *mesh);
/* Bakes the ground under z = 0: a box with two sides along x and y, centred at the origin, and a thickness along z.
 * There is nothing beyond its sides. */
cbvh_status cbvh_bake_ground(const double *sides, double thickness, cbvh_mesh *mesh);
/* Bakes a prism around a cylinder, whose axis is z and whose middle is at the origin. No point of the prism is farther
 * from the cylinder than `error`, which is at most `max_error` but for roundings; `error` may be NULL.
 * CBVH_INVALID_ARGUMENT if the prism would need more than 4,096 sides: if `max_error` is less than about 3e-7 of the
 * radius. */
cbvh_status cbvh_bake_cylinder(double radius, double length, double max_error, double *error, cbvh_mesh *mesh);
/* Bakes a pyramid around a cone, whose base is centred at the origin in the plane z = 0 and whose apex is at z =
 * `height`. The errors are those of cbvh_bake_cylinder. */
cbvh_status cbvh_bake_cone(double radius, double height, double max_error, double *error, cbvh_mesh *mesh);
/* Bakes a surface over a grid, without a thickness: `heights` has the z of `columns` points along x, row by row along
 * y. `cell` is 2 numbers: how far columns and rows are apart. The first point is at x = y = 0. There are 2 triangles
 * per cell. CBVH_INVALID_ARGUMENT for fewer than 2 columns or 2 rows. */
cbvh_status cbvh_bake_height_field(const double *heights, size_t columns, size_t rows, const double *cell,
                                   cbvh_mesh *mesh);
/* Bakes the surface of full cells of a grid, without the faces between two full cells. A cell is 3 numbers i, j, k, and
 * stands for the cube from (i, j, k) times `side` to (i + 1, j + 1, k + 1) times `side`. A cell that is given twice
 * counts once. */
cbvh_status cbvh_bake_voxels(const int32_t *cells, size_t count, double side, cbvh_mesh *mesh);
/* Bakes the surface of full cells of an octree, such as the leaves of an OctoMap, without what two of them have in common.
 * `side` is that of the finest cells. A cell is a corner in `cells`, 3 numbers i, j, k, and a size, and stands for the cube
 * from (i, j, k) times `side` to (i + size, j + size, k + size) times `side`. A cell that is given twice, or that is part of
 * another one, counts once. CBVH_INVALID_ARGUMENT for a size that is not a power of two, or a corner that is not at
 * multiples of it. */
cbvh_status cbvh_bake_octree(const int32_t *cells, const uint32_t *sizes, size_t count, double side, cbvh_mesh *mesh);
/* Bakes the convex hull of points, decided exactly. Its vertices are some of the points. Each point is inside it or on
 * it. CBVH_INVALID_ARGUMENT if all points are in one plane, as fewer than 4 always are, and for a coordinate that is
 * not finite or beyond 2^120. */
cbvh_status cbvh_bake_convex_hull(const double *points, size_t count, cbvh_mesh *mesh);

/* -------------------------------------------------------------------------------------------------------- queriers */

/* Which instructions queries use. Answers do not depend on it. */
typedef int32_t cbvh_backend;
enum {
    /* The fastest one of this CPU, or the one that the environment variable CBVH_ISA names. */
    CBVH_BACKEND_BEST = 0,
    CBVH_BACKEND_SCALAR = 1,
    CBVH_BACKEND_AVX2 = 2,
    CBVH_BACKEND_AVX512 = 3,
    CBVH_BACKEND_NEON = 4
};

/* Makes a querier. CBVH_INVALID_ARGUMENT for a backend that the CPU lacks. Until it is freed, it keeps the memory of
 * its largest query: 100 bytes for each pose and each probe. */
cbvh_status cbvh_querier_new(cbvh_backend backend, cbvh_querier *querier);
/* Frees a querier. CBVH_BUSY while it is in use. */
cbvh_status cbvh_querier_free(cbvh_querier querier);
/* Lets queries about many poses, paths or probes use all cores (1), or only the calling thread (0, the default).
 * Answers are the same. Give the poses of a path in the order of the path, because neighbours share results. */
cbvh_status cbvh_querier_set_parallel(cbvh_querier querier, int32_t parallel);
/* Limits the query about each pose, path or probe to this many visits, of some 100 ns each. A query that needs
 * more ends with CBVH_LIMIT. A visit is a pair of objects or of nodes; a node, for a probe; a contact, and each of its
 * duplicates; a component and an object, for a relation; or an interval of a motion. Without a budget, only the sizes
 * of the files limit a query. */
cbvh_status cbvh_querier_set_budget(cbvh_querier querier, uint64_t visits);

/* Makes a flag that is not set. Any number of queriers, scenes and robots may have it. While it is set, each of their
 * queries ends with CBVH_STOPPED: one that is under way within a millisecond or so, and a new one at once. Bakes may have it, too
 * (cbvh_bake_options). A flag that is not set affects no answer and no file. */
cbvh_status cbvh_stop_new(cbvh_stop *stop);
/* Sets a flag, on any thread, but not in a signal handler. */
cbvh_status cbvh_stop_set(cbvh_stop stop);
/* Limits queries and bakes in time: the flag counts as set from so many seconds after this call on. At least 0, which sets
 * it at once; infinity is no limit. A later call replaces the time, and a flag that cbvh_stop_set has set stays set. Each
 * query then reads the clock, which takes some 40 nanoseconds. */
cbvh_status cbvh_stop_set_after(cbvh_stop stop, double seconds);
/* Clears a flag, and takes its time away. Queries that begin afterwards are answered. */
cbvh_status cbvh_stop_clear(cbvh_stop stop);
/* Frees the handle of a flag. Queriers, scenes and robots keep the flag that they were given, set or not. */
cbvh_status cbvh_stop_free(cbvh_stop stop);
/* Gives a flag to a querier, in place of the one that it has; a handle of 0 removes it. The first check of a list of
 * duplicates or of the topology of a file, and the boxes that an open file gets for its rays, are not stopped. */
cbvh_status cbvh_querier_set_stop(cbvh_querier querier, cbvh_stop stop);

/* The work of the last query. */
typedef struct cbvh_stats {
    /* Tests of up to 16 pairs of nodes each. */
    uint64_t node_tests;
    /* Pairs of leaf packets tested, of up to 16 pairs of triangles each. */
    uint64_t packet_tests;
    /* Pairs of triangles that went to exact arithmetic. */
    uint64_t exact_tests;
    /* Pairs of instances that were tested; 1 for a querier. */
    uint64_t pairs;
} cbvh_stats;

/* Writes how much work the last pose, path or probe of the last query took. Work on other cores is not counted. */
cbvh_status cbvh_querier_stats(cbvh_querier querier, cbvh_stats *stats);

/* --------------------------------------------------------------------------------------- queries about two meshes
 *
 * Each function takes `count` poses of B in A's frame, and writes as many answers. Meshes are surfaces unless they are
 * solid. Touching is contact, exactly. The functions fail with CBVH_DAMAGED if a page that a query touches is
 * damaged, and with CBVH_LIMIT if the budget of the querier does not suffice. A query about small or separated
 * meshes takes about a microsecond; a call adds some 0.1. */

/* Answers whether the meshes touch. */
cbvh_status cbvh_collide(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                         bool *answers);
/* Answers whether the meshes are at most `d` apart, exactly. `d` is finite and at least 0. */
cbvh_status cbvh_within(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count, double d,
                        bool *answers);

/* The relation of two meshes. */
typedef int32_t cbvh_relation;
enum {
    /* Their surfaces have a point in common. */
    CBVH_TOUCHING = 0,
    /* They have nothing in common, insides included. */
    CBVH_APART = 1,
    /* All of A is inside B. */
    CBVH_A_IN_B = 2,
    /* All of B is inside A. */
    CBVH_B_IN_A = 3,
    /* Some connected components are inside the other mesh and some are not, or some of each mesh are. */
    CBVH_MIXED = 4,
    /* The answer depends on the inside of a mesh that is not closed. */
    CBVH_RELATION_UNDEFINED = 5
};

/* Answers with the relation of the meshes. CBVH_INVALID_ARGUMENT for a file that was baked without topology. */
cbvh_status cbvh_relations(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                        cbvh_relation *answers);

/* How far apart two meshes are. */
typedef struct cbvh_distance_answer {
    /* The distance; 0 if and only if the meshes touch. */
    double distance;
    /* A certified lower bound: the two triangles named here are at least this far apart, less the radii of the meshes.
     * If an error was allowed, no two triangles are nearer. */
    double lower;
    /* A certified upper bound: the meshes are at most this far apart. */
    double upper;
    /* The closest points on A and on B, in A's frame. */
    double point_a[3];
    double point_b[3];
    /* Numbers of objects in their files, and of triangles in the input. */
    uint32_t object_a;
    uint32_t triangle_a;
    uint32_t object_b;
    uint32_t triangle_b;
} cbvh_distance_answer;

/* How exact a distance has to be: exact by default. */
typedef struct cbvh_distance_options {
    size_t size;
    /* The answer may exceed the least distance by this fraction of it: finite, at least 0. */
    double rel_err;
    /* The answer may exceed it by this length as well: finite, at least 0. */
    double abs_err;
} cbvh_distance_options;

/* Answers how far apart the meshes are, and where. With an allowed error, one core is used. */
cbvh_status cbvh_distances(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                          const cbvh_distance_options *options, cbvh_distance_answer *answers);

/* Two triangles in contact: numbers of objects in their files, and of triangles in the input. */
typedef struct cbvh_contact {
    uint32_t object_a;
    uint32_t triangle_a;
    uint32_t object_b;
    uint32_t triangle_b;
} cbvh_contact;

/* Lists all pairs of triangles in contact in ascending order, pose after pose: those no farther apart than the sum of
 * the radii. What is wholly inside a solid mesh has none. `counts` gets the number of pairs of each pose, and may be
 * NULL. On one core, this takes at most four times the memory of the buffer, however many pairs there are. For many
 * poses on all cores, it takes the memory of all pairs. */
cbvh_status cbvh_contacts(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t pose_count,
                          size_t *counts, cbvh_contact *contacts, size_t capacity, size_t *count);
/* What two triangles have in common. */
typedef int32_t cbvh_region_kind;
enum {
    /* They touch in one point. */
    CBVH_REGION_POINT = 0,
    /* They meet in a segment: they cross, or an edge touches. */
    CBVH_REGION_SEGMENT = 1,
    /* They overlap in one plane, in a convex polygon. */
    CBVH_REGION_POLYGON = 2
};

/* Where two triangles in contact meet, in A's frame and in mesh units. */
typedef struct cbvh_contact_region {
    cbvh_contact contact;
    /* Decided exactly. */
    cbvh_region_kind kind;
    /* How many of `points` there are, from 1 to 6; the rest are 0. */
    uint32_t count;
    /* One point, the two ends of a segment, or the corners of a polygon. Where two planes cross, the ends follow the
     * cross product of `normal_a` and `normal_b`, so that the segments of closed meshes form directed loops. Corners go
     * counterclockwise around the polygon, seen from where `normal_a` points to. A polygon so thin that rounding aligns
     * its corners has fewer of them. */
    double points[6][3];
    /* The unit normals of both triangles in the orientation of their corners, 0 without area. Between two rounded meshes
     * whose triangles are apart, the direction from A to B, and its opposite. */
    double normal_a[3];
    double normal_b[3];
    /* A certified bound: each point is at most this far from the exact one. */
    double error;
    /* The sum of the radii less the distance of the triangles; 0 for meshes without radii. */
    double overlap;
} cbvh_contact_region;

/* Lists where the triangles in contact meet, for the pairs of cbvh_contacts in the same order. `counts` gets the number
 * of pairs of each pose, and may be NULL. One core is used. It takes some 0.3 us more for each region than
 * cbvh_contacts, and 40 bytes for each contact of a pose. */
cbvh_status cbvh_contact_regions(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses,
                                 size_t pose_count, size_t *counts, cbvh_contact_region *regions, size_t capacity,
                                 size_t *count);

/* Contacts that belong together, in A's frame and in mesh units. Their numbers are rounded, and not certified. */
typedef struct cbvh_patch {
    /* The place of its first contact in `regions`, and the number of its contacts. */
    size_t first;
    size_t count;
    /* The mean of its polygons by area, if triangles face each other in one plane; else of its curves by length; else of
     * its points, which for rounded meshes count by how far they overlap. */
    double center[3];
    /* The direction in which A pushes B, at length 1: that in which B moves to reduce the volume of the overlap fastest.
     * 0 if the normals of the contacts cancel. */
    double normal[3];
    /* The length of the curves in which the surfaces meet. */
    double length;
    /* The area of what triangles in one plane have in common. */
    double area;
    /* An estimate of how far B has to move along the normal to leave A here. */
    double depth;
} cbvh_patch;

/* How contacts are joined into patches. */
typedef struct cbvh_patch_options {
    size_t size;
    /* How far apart points of two contacts may be that belong together, beyond their errors: finite, at least 0. Rounded
     * meshes, whose contacts are points, need more than 0. */
    double tolerance;
    /* The number of contacts of each pose that are considered, the first ones in ascending order; 0 for all. */
    size_t max_contacts;
    /* The largest number of points of each patch, for cbvh_contact_points; 0 for four. */
    size_t max_points;
} cbvh_patch_options;

/* How many there are in a pose. */
typedef struct cbvh_patch_counts {
    size_t patches;
    /* The contacts of all its patches. */
    size_t contacts;
    /* All contacts: more than `contacts` if `max_contacts` left some out. */
    size_t total;
} cbvh_patch_counts;

/* Lists the connected patches of contacts, pose after pose, each with a centre, a normal and a depth. `counts` gets the
 * numbers of each pose, and may be NULL. `regions` gets the contacts, patch after patch, in a list of its own. If
 * `region_count` is NULL, it gets none. One core is used. It takes up to ten rays for each patch more than
 * cbvh_contact_regions, some 10 us, and some 1 KiB for each contact of a pose. */
cbvh_status cbvh_patches(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t pose_count,
                         const cbvh_patch_options *options, cbvh_patch_counts *counts, cbvh_patch *patches,
                         size_t capacity, size_t *count, cbvh_contact_region *regions, size_t region_capacity,
                         size_t *region_count);

/* One of the points at which a patch pushes, as simulators use them, in A's frame and in mesh units. Its numbers are
 * rounded, and not certified. */
typedef struct cbvh_contact_point {
    /* The place of its patch among those of all poses. */
    size_t patch;
    /* The middle between both surfaces on a line along the patch's normal, or a point of the curve in which they meet. */
    double point[3];
    /* The direction in which A pushes B here, at length 1. It is that of the surfaces where the line meets them, so
     * points of a curved patch have different ones. */
    double normal[3];
    /* How deep the meshes overlap here along `normal`, at least 0. For rounded meshes, it is about their cores: minus
     * the gap where these are apart. So a radius serves as the margin of a simulator. If the radii are a part of the
     * bodies, add their sum. */
    double depth;
} cbvh_contact_point;

/* Lists contact points of the patches of cbvh_patches, patch after patch and pose after pose. The deepest point of a patch
 * comes first, then those that most enlarge the outline of the chosen ones, as long as they do by more than a 256th:
 * four for a box on a floor, and about 16 at most for a round outline. Points change little where a pose does, unless
 * another point becomes the better one. `counts` gets the number of points of each pose, and may be NULL. `patches` gets
 * the patches in a list of their own. If `patch_count` is NULL, it gets none. One core is used. It takes up to 60 rays
 * for each patch more than cbvh_patches, or 108 if more than eight points are wanted, some 8 to 40 us. */
cbvh_status cbvh_contact_points(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses,
                                size_t pose_count, const cbvh_patch_options *options, size_t *counts,
                                cbvh_contact_point *points, size_t capacity, size_t *count, cbvh_patch *patches,
                                size_t patch_capacity, size_t *patch_count);

/* How far B moves along a direction until interiors are disjoint, in mesh units. */
typedef struct cbvh_separation {
    /* Interiors meet at all shorter moves along the direction. */
    double lower;
    /* The length of `translation`. */
    double upper;
    /* A move of B along the direction, in A's frame, after which interiors are disjoint. */
    double translation[3];
} cbvh_separation;

/* Answers how far B moves until interiors are disjoint: along a direction for each pose, 3 numbers in A's frame, of any
 * length from 2^-500 to 2^500. A mesh inside the other one moves until it is out. All numbers are 0 where the meshes are
 * apart. Both bounds are certain, and agree to some roundings, unless surfaces only slide along each other on a part of
 * the way: `lower` ends there. One core is used. It takes some walks, each like one of cbvh_collide, and as many as
 * triangles follow each other on the way. CBVH_INVALID_ARGUMENT for a mesh that is not closed, and for a file that was
 * baked without topology. */
cbvh_status cbvh_separations(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses,
                             const double *directions, size_t count, cbvh_separation *answers);

/* How deep two meshes overlap, in mesh units. */
typedef struct cbvh_penetration {
    /* No shorter translation makes interiors disjoint. */
    double lower;
    /* The length of `translation`. */
    double upper;
    /* A translation of B, in A's frame, after which interiors are disjoint. */
    double translation[3];
    /* A point in both meshes, in A's frame, where `lower` is above 0. */
    double point[3];
    /* The radii of two balls about the point, one inside A and one inside B, which prove `lower`: it is their sum, but for
     * roundings. Both are 0 where the meshes or parts of them are known to be convex, which proves more. */
    double radii[2];
    /* 1 if the budget of the querier ended the search, else 0. */
    int32_t is_spent;
    int32_t reserved;
} cbvh_penetration;

/* When the search for a depth ends. */
typedef struct cbvh_penetration_options {
    size_t size;
    /* When the upper bound exceeds the lower one by no more than this part of it: finite, above 0; 0 for 0.01. */
    double relative_gap;
    /* When it is known whether the depth exceeds this length: finite, above 0; 0 for no such length. */
    double tolerance;
} cbvh_penetration_options;

/* Answers how deep the meshes overlap: bounds of the length of the shortest translation of B after which interiors are
 * disjoint. All numbers are 0 where the meshes are apart. Where they only touch, `lower` is 0 and `upper` some
 * roundings. Both bounds are certain. For convex meshes of one object and at most 4096 triangles, they are as near each
 * other as the options ask for, down to some roundings. For others, the search ends when it has tried all it knows:
 * `lower` is mostly more than two thirds of the depth, and far less for meshes that are thin where they cross. One core is
 * used. It takes some microseconds for such convex meshes, and once up to 0.2 s to find out that a mesh is one. For
 * others, it takes up to a millisecond for meshes of a hundred triangles, and some for large ones. If the budget of the
 * querier ends the search, the bounds so far are the answer; CBVH_LIMIT if it does not even suffice to find out whether
 * the meshes are apart. CBVH_INVALID_ARGUMENT for a mesh that is not closed, and for a file that was baked without
 * topology. */
cbvh_status cbvh_penetrations(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                              const cbvh_penetration_options *options, cbvh_penetration *answers);

/* How far apart two meshes are or, below zero, how deep they overlap, in mesh units. */
typedef struct cbvh_signed_distance {
    /* The signed distance is at least this. */
    double lower;
    /* The signed distance is at most this. */
    double upper;
    /* The direction in which B moves away from A, at length 1, in A's frame: from the closest point on A to that on B or,
     * where they overlap, along `translation`. 0 where none is known, as for meshes that touch and have no depth. */
    double normal[3];
    /* The closest point on A in A's frame or, where they overlap, the one that B touches after the translation. */
    double point_a[3];
    /* The closest point on B in A's frame or, where they overlap, the one that touches `point_a` after the translation. */
    double point_b[3];
    /* Where they overlap, a translation of B in A's frame, after which interiors are disjoint. Its length is -`lower`, but
     * for roundings. Else 0. */
    double translation[3];
    /* 1 if both meshes have an inside: they are closed, and have a radius or triangles with area. If it is 0, they have no
     * depth, and the number is their distance, 0 where they touch. */
    int32_t is_signed;
    /* 1 if the budget of the querier ended the search for a depth, else 0. */
    int32_t is_spent;
} cbvh_signed_distance;

/* Answers the signed distance of two meshes between two certain bounds: their distance where they are apart, and minus
 * the depth of cbvh_penetrations where they overlap or one is inside the other. Where they touch, 0 is between the
 * bounds, which are some roundings apart. The options are those of the depth. Meshes need not be closed: see
 * `is_signed`. When B is translated, the true number changes by no more than the length of the translation, but points
 * and normals may jump: where several are equally near, one of them is the answer. One core is used. It takes the time
 * of cbvh_distances and of cbvh_sides for a few points or, where the meshes overlap, that of cbvh_penetrations. If the
 * budget of the querier ends the search for a depth, the bounds so far are the answer; CBVH_LIMIT if it does not even
 * suffice to find out whether the meshes are apart. CBVH_INVALID_ARGUMENT for a file that was baked without topology. */
cbvh_status cbvh_signed_distances(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                                  const cbvh_penetration_options *options, cbvh_signed_distance *answers);

/* How two parts of an assembly lie. */
typedef int32_t cbvh_clash_class;
enum {
    /* Their surfaces are farther apart than the clearance and the tolerance, and neither is inside the other. */
    CBVH_CLASH_APART = 0,
    /* Their surfaces are farther apart than the tolerance, but at most the clearance. */
    CBVH_CLASH_NEAR = 1,
    /* Their surfaces are at most the tolerance apart, or they have points in common and their depth is at most the
     * tolerance. */
    CBVH_CLASH_TOUCHING = 2,
    /* Their depth exceeds the tolerance. */
    CBVH_CLASH_OVERLAPPING = 3,
    /* One is wholly inside the other. */
    CBVH_CLASH_CONTAINED = 4,
    /* Both are the same part in the same place, to within the tolerance. */
    CBVH_CLASH_DUPLICATED = 5,
    /* They have points in common, and the tolerance lies between the bounds that were found for their depth. */
    CBVH_CLASH_UNDECIDED = 6,
    /* They have points in common, and one is not closed, so that they have no depth. */
    CBVH_CLASH_INTERSECTING = 7,
    /* Their depth exceeds the tolerance, and one passes through the other. Where clashes are measured, parts that overlap are
     * this or CBVH_CLASH_PROTRUDING. */
    CBVH_CLASH_PIERCING = 8,
    /* Their depth exceeds the tolerance, and neither passes through the other. */
    CBVH_CLASH_PROTRUDING = 9
};

/* How two parts lie, and by how much, in mesh units. */
typedef struct cbvh_clash {
    cbvh_clash_class kind;
    cbvh_relation relation;
    /* For near parts, and for touching ones without a common point: how far apart their surfaces are. Infinite for parts
     * that are apart, and 0 for all others. */
    double distance;
    /* A point of the clash in A's frame: between the closest points, in both parts, or in contact. 0 for parts that are
     * apart. */
    double point[3];
    /* For parts that touch, overlap or are undecided: the bounds of their depth, both 0 without a common point. NaN for all
     * others, and for parts that are not closed. `is_spent` is 1 if the visits of the options or the budget of the querier
     * ended the search. */
    cbvh_penetration depth;
} cbvh_clash;

/* What counts as a clash. */
typedef struct cbvh_clash_options {
    size_t size;
    /* Parts at most this far apart are near: finite, at least 0; 0 looks for no near parts. */
    double clearance;
    /* Parts at most this far apart, or at most this deep in each other, are touching: finite, above 0; 0 for a millionth of
     * the largest side of both parts. */
    double tolerance;
    /* The search for a depth ends when the upper bound exceeds the lower one by no more than this part of it: finite,
     * above 0; 0 for 0.1. */
    double relative_gap;
    /* The most visits of the search for the depth of a pair, which count towards the budget; 0 for 2^20. */
    uint64_t visits;
} cbvh_clash_options;

/* Answers how two parts lie: apart, near, touching, overlapping, one in the other, or twice in one place. Flush faces overlap
 * or come apart by roundings in nearly all poses, so that a tolerance is part of the query: parts that are no farther
 * apart and no deeper in each other (cbvh_penetrations) are touching. Where a part fits another one without a gap, like a peg in its
 * hole, the depth is mostly undecided. One core is used. CBVH_INVALID_ARGUMENT for a file that was baked without
 * topology, where the query is about the inside; CBVH_LIMIT if the budget does not suffice for the rest of the
 * query. */
cbvh_status cbvh_clashes(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                         const cbvh_clash_options *options, cbvh_clash *answers);

/* What two meshes have in common, in mesh units. Only the error of the volume is certain; all other numbers are rounded. */
typedef struct cbvh_intersection {
    /* The volume of the intersection. */
    double volume;
    /* The volume is off by at most this. */
    double volume_error;
    /* The area of A's surface inside B. */
    double area_a;
    /* The area of B's surface inside A. */
    double area_b;
    /* The least and the largest coordinates of the intersection, in A's frame; NaN if it is empty. */
    double bounds[2][3];
    /* How thick A is where B passes through it; NaN if it does so nowhere. */
    double pierced_a;
    /* How thick B is where A passes through it. */
    double pierced_b;
} cbvh_intersection;

/* Answers how much two meshes have in common. A mesh is pierced where the other one passes all the way through it: the other one goes
 * in through one part of its surface and out through another one, and the thickness is the least distance between two such
 * parts. It is not pierced where the other one only reaches into it, or takes a corner of it along. A common face of flush meshes
 * encloses nothing. Each place counts as often as the surfaces wind around it: where parts of one mesh overlap, unite them
 * before baking. Radii are left out. One core is used. It takes the time of cbvh_contacts, some 0.5 us for each of them, and
 * some 0.1 us for each triangle in the box of the other mesh. CBVH_INVALID_ARGUMENT for a mesh that is not closed, and for a
 * file that was baked without topology; CBVH_LIMIT if the budget of the querier does not suffice. */
cbvh_status cbvh_intersections(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                               cbvh_intersection *answers);

/* How two parts lie, and what they have in common. */
typedef struct cbvh_measured_clash {
    cbvh_clash clash;
    /* For closed parts that overlap, are undecided, contain each other or are duplicated. NaN for all others. */
    cbvh_intersection shared;
} cbvh_measured_clash;

/* Answers how two parts lie, as cbvh_clashes does, and what they have in common, as cbvh_intersections does. Parts that overlap
 * are piercing or protruding. */
cbvh_status cbvh_measured_clashes(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                                  const cbvh_clash_options *options, cbvh_measured_clash *answers);

/* How two triangles of one mesh meet, by the corners that they have in common. */
typedef int32_t cbvh_self_contact_kind;
enum {
    /* They have no corner in common, and touch or cross. */
    CBVH_SELF_CROSSING = 0,
    /* They have one corner in common, and another point. */
    CBVH_SELF_AT_CORNER = 1,
    /* They have two corners in common, lie in one plane, and overlap beyond that edge. */
    CBVH_SELF_FOLDED = 2,
    /* They have the same corners, in any order. */
    CBVH_SELF_DUPLICATE = 3
};

/* Two triangles of one mesh that meet where they should not; the first one is before the second. */
typedef struct cbvh_self_contact {
    uint32_t object_a;
    uint32_t triangle_a;
    uint32_t object_b;
    uint32_t triangle_b;
    cbvh_self_contact_kind kind;
} cbvh_self_contact;

/* Lists all pairs of triangles of a mesh that have more in common than their common corners and what is between these,
 * exactly and in ascending order. A radius does not matter. If the file has ids, a duplicate that was left out counts as
 * a triangle. One core is used. It takes 0.1 to 0.3 us for each triangle, up to 25 bytes for each, and at most four
 * times the memory of the buffer. */
cbvh_status cbvh_self_contacts(cbvh_querier querier, cbvh_mesh mesh, cbvh_self_contact *contacts, size_t capacity,
                               size_t *count);

/* Writes the number of the first pose in which the meshes touch, or `count` if they touch in none. */
cbvh_status cbvh_first_collision(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                                 size_t *number);
/* Writes an upper bound of how far any point of B's triangles moves from one pose to another. No distance from B
 * changes by more, whatever its radius. */
cbvh_status cbvh_displacement(cbvh_mesh b, const cbvh_pose *from, const cbvh_pose *to, double *bound);

/* Makes a tracker. */
cbvh_status cbvh_tracker_new(cbvh_tracker *tracker);
/* Frees a tracker. */
cbvh_status cbvh_tracker_free(cbvh_tracker tracker);
/* These functions give the answers of the querier that they use. They use one core, and take less time if each pose is
 * near the previous one, in this call or the last one. A tracker is for one pair of meshes; another pair makes it
 * forget. */
cbvh_status cbvh_tracker_collide(cbvh_tracker tracker, cbvh_querier querier, cbvh_mesh a, cbvh_mesh b,
                                 const cbvh_pose *poses, size_t count, bool *answers);
cbvh_status cbvh_tracker_within(cbvh_tracker tracker, cbvh_querier querier, cbvh_mesh a, cbvh_mesh b,
                                const cbvh_pose *poses, size_t count, double d, bool *answers);
cbvh_status cbvh_tracker_distance(cbvh_tracker tracker, cbvh_querier querier, cbvh_mesh a, cbvh_mesh b,
                                  const cbvh_pose *poses, size_t count, cbvh_distance_answer *answers);
/* As cbvh_signed_distances answers. What is kept from pose to pose serves meshes that are apart. */
cbvh_status cbvh_tracker_signed_distance(cbvh_tracker tracker, cbvh_querier querier, cbvh_mesh a, cbvh_mesh b,
                                         const cbvh_pose *poses, size_t count,
                                         const cbvh_penetration_options *options, cbvh_signed_distance *answers);

/* --------------------------------------------------------------------------------------------------------- motions
 *
 * Is a path free, at every moment from 0 to 1, and where does it end? Answers are certain, also between samples. */

/* Makes the path between two poses: the origin of B moves on a line, and B turns about one axis by the shorter angle,
 * both at a constant rate. CBVH_INVALID_ARGUMENT if the poses are half a turn apart. */
cbvh_status cbvh_path_between(const cbvh_pose *start, const cbvh_pose *end, cbvh_path *path);
/* Makes a screw motion from `start`: a rotation by `angle` radians, any number of turns, about the axis through `point`
 * with `direction`, and a shift along it. Points and directions are 3 numbers. */
cbvh_status cbvh_path_screw(const cbvh_pose *start, const double *point, const double *direction, double angle,
                            double shift, cbvh_path *path);
/* Makes the path through at least two poses. The motion from each pose to the next takes the same share of the time. */
cbvh_status cbvh_path_polyline(const cbvh_pose *poses, size_t count, cbvh_path *path);

/* Writes where B is at a time from 0 to 1, and returns 0. Any other number is a failure, which the query reports.
 * The same time must always give the same pose, to the bit. */
typedef int32_t (*cbvh_pose_function)(void *user, double t, cbvh_pose *pose);
/* Returns an upper bound of the sagitta. Take any point that moves with B and is at most `radius` from B's origin.
 * Compare it with a point that moves on a straight line, at a constant speed, from its place at t0 to its place at t1.
 * The sagitta is the greatest distance between the two during [t0, t1], which is at most an eighth of the greatest
 * acceleration times the square of the time. The bound must hold with all rounding; answers are only as certain as it
 * is. It may be infinite; NaN and negative numbers end the query with CBVH_CALLBACK_FAILED. */
typedef double (*cbvh_sagitta_function)(void *user, double radius, double t0, double t1);
/* Makes a path of two functions, which are called with `user` while queries run: on the calling thread alone, or on
 * several threads at the same time if the querier or scene is parallel. They must not leave by an exception or longjmp.
 * They may call this library, but with the querier in use they get CBVH_BUSY. A query that they run on a
 * thread of the library uses that thread only. `release` is called with `user` when the path is no longer used: once,
 * on any thread, when the handle is freed and queries about it have ended. It may be NULL. It must not throw an
 * exception and must not call this library. After a failure it is not called. */
cbvh_status cbvh_path_from_functions(cbvh_pose_function pose, cbvh_sagitta_function sagitta,
                                     void (*release)(void *user), void *user, cbvh_path *path);
/* States why a function of a path is about to fail. Call it in that function; the message of the query then ends
 * with this text. */
cbvh_status cbvh_callback_message(const char *message);
/* Frees a path. */
cbvh_status cbvh_path_free(cbvh_path path);
/* Writes where B is at a time from 0 to 1. */
cbvh_status cbvh_path_pose(cbvh_path path, double t, cbvh_pose *result);
/* Writes an upper bound of how far any point of B's triangles is, from t0 to t1, from its place in the middle of that
 * time. */
cbvh_status cbvh_path_reach(cbvh_mesh b, cbvh_path path, double t0, double t1, double *bound);

/* What counts as a hit, and how exactly time is searched. */
typedef struct cbvh_motion_options {
    size_t size;
    /* Meshes that are at most this far apart count as a hit; 0 for contact. Finite, at least 0. */
    double clearance;
    /* The width of the undecided range beyond the clearance: if B comes that near and is no hit, the answer may be
     * near. 0 for a millionth of the diagonal of the smaller object's box, radius included; between a point and a
     * mesh, of the mesh's. A smaller tolerance costs more. */
    double tolerance;
} cbvh_motion_options;

typedef int32_t cbvh_outcome;
enum {
    /* At no time from 0 to 1 are the meshes within the clearance. */
    CBVH_FREE = 0,
    /* At the time `at` they are within the clearance. */
    CBVH_HIT = 1,
    /* At the time `at` their distance is at most the clearance plus the tolerance, and neither free nor hit is certain.
     * */
    CBVH_NEAR = 2
};

/* An instance of a scene. 0 is none. */
typedef struct cbvh_instance { uint64_t id; } cbvh_instance;

/* Whether a path is free, and where it ends. */
typedef struct cbvh_motion_answer {
    cbvh_outcome outcome;
    int32_t reserved;
    /* Before this time the meshes certainly are not within the clearance; 1 if the path is free. */
    double free_until;
    /* The earliest time found at which they are, or may be, within the clearance; NaN if the path is free. */
    double at;
    /* In a scene, the pair: A is the instance that stands still or, if both move, the lower one. Else 0. */
    cbvh_instance instance_a;
    cbvh_instance instance_b;
    /* The distance at that time. NaN if the path is free. */
    cbvh_distance_answer nearest;
} cbvh_motion_answer;

/* Answers whether each path is free, and where it ends. */
cbvh_status cbvh_motions(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_path *paths, size_t count,
                         const cbvh_motion_options *options, cbvh_motion_answer *answers);
/* Answers whether each path is certainly free. Use it in planners: it needs less time than cbvh_motions to say no. */
cbvh_status cbvh_are_free(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_path *paths, size_t count,
                          const cbvh_motion_options *options, bool *answers);
/* These functions give the same answers about the paths of cbvh_path_between from each start to its end, which are the
 * edges of a planner. */
cbvh_status cbvh_edge_motions(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *starts,
                              const cbvh_pose *ends, size_t count, const cbvh_motion_options *options,
                              cbvh_motion_answer *answers);
cbvh_status cbvh_edges_are_free(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *starts,
                                const cbvh_pose *ends, size_t count, const cbvh_motion_options *options,
                                bool *answers);

/* ---------------------------------------------------------------------------------------------------------- probes
 *
 * Queries about one mesh and many points, rays or segments. `pose` is the pose of the mesh in the frame of the
 * probes; NULL for the mesh's own frame. Points are 3 numbers each. */

/* On which side of a mesh a point is. The command prints the same numbers. */
typedef int32_t cbvh_side;
enum {
    CBVH_OUTSIDE = -1,
    /* On the surface. */
    CBVH_ON = 0,
    CBVH_INSIDE = 1,
    /* The mesh is not closed, and has no inside. */
    CBVH_SIDE_UNDEFINED = 2,
    /* In answers of cbvh_closest_points, which does not ask for sides. */
    CBVH_SIDE_NOT_ASKED = 3
};

/* The closest point of a mesh. */
typedef struct cbvh_closest_point {
    /* The distance; 0 if and only if the given point is on the mesh or within its radius. It is not negative inside;
     * `side` tells the side. The signed distance inside a mesh with a radius is the radius less the distance from the
     * triangles or, inside these, the sum of both. */
    double distance;
    /* The distance certainly lies between these. */
    double lower;
    double upper;
    /* The closest point, in the frame of the given point. */
    double point[3];
    /* In a scene, the instance; else 0. */
    cbvh_instance instance;
    /* The number of the object in its file, and of the triangle in the input. */
    uint32_t object;
    uint32_t triangle;
    /* 1, or 0 if the mesh is farther away than `within`; the numbers are then NaN or 0. */
    int32_t found;
    /* The side of the given point, in answers of signed distances. */
    cbvh_side side;
} cbvh_closest_point;

/* Answers where the closest surface to each point is, if it is at most `within` away, which may be infinite. */
cbvh_status cbvh_closest_points(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const double *points,
                                size_t count, double within, cbvh_closest_point *answers);
/* Answers on which side each point is, exactly. A point is inside a mesh with a radius if it is nearer to the triangles
 * than the radius, or inside them. */
cbvh_status cbvh_sides(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const double *points, size_t count,
                       cbvh_side *answers);
/* Both of the above. The surface is all triangles of the mesh: where closed parts of it overlap, or one lies within
 * another, the closest triangle may be inside the mesh, and the distance is less than that to the outside. */
cbvh_status cbvh_signed_point_distances(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const double *points,
                                  size_t count, double within, cbvh_closest_point *answers);

/* All points origin + t * direction with t from 0 to `until`, both ends included. */
typedef struct cbvh_ray {
    double origin[3];
    /* Of any length from 2^-500 to 2^500: the unit of t. */
    double direction[3];
    /* The greatest t, which may be infinite (INFINITY of math.h). */
    double until;
} cbvh_ray;

/* Where a ray hits. */
typedef struct cbvh_ray_hit {
    /* The parameter in units of the direction, and bounds of the exact one. */
    double t;
    double lower;
    double upper;
    /* The point, in the frame of the ray. */
    double point[3];
    /* In a scene, the instance; else 0. */
    cbvh_instance instance;
    /* The number of the object in its file, and of the triangle in the input. */
    uint32_t object;
    uint32_t triangle;
    /* 1, or 0 if the ray hits nothing; the numbers are then NaN or 0. */
    int32_t found;
    int32_t reserved;
} cbvh_ray_hit;

/* Answers where each ray first hits. It is decided exactly which triangle is hit. Edges and corners belong to
 * triangles. A ray hits a mesh with a radius where it first comes within the radius, and at 0 if it starts there.
 * Whether it does is exact. */
cbvh_status cbvh_first_hits(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const cbvh_ray *rays,
                            size_t count, cbvh_ray_hit *answers);
/* Answers whether each ray hits at all. */
cbvh_status cbvh_any_hits(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const cbvh_ray *rays,
                          size_t count, bool *answers);
/* Lists all hits, ray after ray, in the order along each ray. Hits at exactly the same parameter count as one. `counts`
 * gets the number of hits of each ray, and may be NULL. A mesh with a radius is one body, and its hits are where the ray
 * enters and leaves it, in turns: at 0 if it starts inside, and without an exit if it ends there. A closed core is hollow
 * also if it is solid. Bounds of a gap that do not prove it close it. */
cbvh_status cbvh_all_hits(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const cbvh_ray *rays,
                          size_t ray_count, size_t *counts, cbvh_ray_hit *hits, size_t capacity, size_t *count);

/* A segment, both ends included. */
typedef struct cbvh_segment {
    double from[3];
    double to[3];
} cbvh_segment;

/* Answers whether each segment meets the mesh, exactly. */
cbvh_status cbvh_segment_hits(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose,
                               const cbvh_segment *segments, size_t count, bool *answers);
/* Answers whether the ends of each segment see each other: whether no part of it, but for what is within `margin` mesh
 * units of either end, meets the mesh. With a margin of 0 a point on the mesh sees nothing, as the segment touches the
 * mesh there. For points on a surface, take a margin that is longer than their coordinates are off, such as a millionth
 * of the size of the mesh. Points at most two margins apart see each other. */
cbvh_status cbvh_visible(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const cbvh_segment *segments,
                         size_t count, double margin, bool *answers);

/* ---------------------------------------------------------------------------------------------------------- scenes
 *
 * Many placed meshes, and queries over all pairs that may meet. In a pair, A is the instance in the lower place, and
 * answers are in A's frame. Threads may query a scene while others change it: each query is about the scene as it
 * is when the query begins. The first change during a query copies the tables of the scene (2 us for 60 instances,
 * 0.3 ms for 10,000), and no mesh. A query may see one of two calls that change the scene and not the other: clone
 * the scene, which takes a microsecond, to change or to query a copy that nobody else has. */

/* Makes an empty scene. */
cbvh_status cbvh_scene_new(cbvh_backend backend, cbvh_scene *scene);
/* Makes a scene with the instances of a file of `cbvh bake --scene`, which is mapped as by CBVH_MAP.
 * CBVH_INVALID_ARGUMENT for a .cbvh file without instances. */
cbvh_status cbvh_scene_open(const char *path, cbvh_scene *scene);
/* Makes a scene with the instances in the file of a mesh. They have no radius. */
cbvh_status cbvh_scene_of_mesh(cbvh_mesh mesh, cbvh_scene *scene);
/* Makes a copy of a scene with the same instances, which shares their meshes. */
cbvh_status cbvh_scene_clone(cbvh_scene scene, cbvh_scene *other);
/* Frees a scene. */
cbvh_status cbvh_scene_free(cbvh_scene scene);
/* Lets queries use all cores (1) or one (0, the default). */
cbvh_status cbvh_scene_set_parallel(cbvh_scene scene, int32_t parallel);
/* Lets the scene reuse earlier results about each pair (1) or not (0, the default). This is faster if instances move
 * little between queries. */
cbvh_status cbvh_scene_set_tracking(cbvh_scene scene, int32_t tracking);
/* Limits each query to this many visits over all its pairs, and each probe over all instances. Visits are those of
 * cbvh_querier_set_budget, each comparison of a box with up to sixteen others in the search for near pairs, and each pair
 * of boxes that these leave. If there are several threads, each may make this many before they stop. */
cbvh_status cbvh_scene_set_budget(cbvh_scene scene, uint64_t visits);
/* Gives a flag to a scene, as cbvh_querier_set_stop does. Clones share it. Queries that are under way keep the flag that
 * they began with. */
cbvh_status cbvh_scene_set_stop(cbvh_scene scene, cbvh_stop stop);

/* Adds a mesh at a pose in the world. The rotation must be rigid to within 2^-23, and the translation at most 2^118
 * along each axis. `name` may be NULL; else no other instance may have it. `instance` may be NULL. The handle of the
 * mesh may be freed afterwards. */
cbvh_status cbvh_scene_add(cbvh_scene scene, cbvh_mesh mesh, const cbvh_pose *world, const char *name,
                           cbvh_instance *instance);
/* Removes an instance. What is attached to it stays where it is. This scene never gives its number again. CBVH_NOT_FOUND if the scene has no such instance. An
 * instance of another scene is not recognised as such. */
cbvh_status cbvh_scene_remove(cbvh_scene scene, cbvh_instance instance);
/* Replaces the mesh of an instance, such as a cloud of points that a camera sees again and again. Everything else stays:
 * its number, name, pose, groups, margins, permissions and attachments. The handle of the mesh may be freed afterwards. */
cbvh_status cbvh_scene_set_mesh(cbvh_scene scene, cbvh_instance instance, cbvh_mesh mesh);
/* Attaches an instance to a parent, with which it moves from then on: a part to the gripper that holds it. If it was
 * attached to another parent, it no longer is. The scene keeps the pose of the child in the parent's frame. The pose in
 * the world is always that of the parent times the one that is kept, so that nothing adds up over many moves. To set the
 * pose of the child changes what is kept. On a motion, the child follows the path of its parent, unless it has a path of
 * its own. Permissions to touch do not change: a gripper usually touches what it holds, so allow this pair, and forbid
 * it again when it is detached. Margins do not change either: the child has its own. CBVH_INVALID_ARGUMENT if the parent
 * is the child itself or moves with it. */
cbvh_status cbvh_scene_attach(cbvh_scene scene, cbvh_instance child, cbvh_instance parent);
/* Detaches an instance from its parent, if it has one. It stays where it is. */
cbvh_status cbvh_scene_detach(cbvh_scene scene, cbvh_instance child);
/* Writes what an instance is attached to. CBVH_NOT_FOUND if it is not attached. */
cbvh_status cbvh_scene_parent(cbvh_scene scene, cbvh_instance child, cbvh_instance *parent);
/* Moves many instances, and those that are attached to them, or none if it fails. If an instance is given twice, the
 * last pose counts; otherwise the order does not matter. */
cbvh_status cbvh_scene_set_poses(cbvh_scene scene, const cbvh_instance *instances, const cbvh_pose *worlds,
                                 size_t count);
/* Sets the groups that an instance is in and those that it meets, one bit per group. Queries are about two instances
 * if each is in a group that the other meets. By default all bits are set. */
cbvh_status cbvh_scene_set_groups(cbvh_scene scene, cbvh_instance instance, uint32_t member, uint32_t meets);
/* Allows two instances to touch (1), or forbids it again (0). A pair that may touch takes part in no query. */
cbvh_status cbvh_scene_set_allowed(cbvh_scene scene, cbvh_instance a, cbvh_instance b, int32_t allowed);
/* Gives an instance a margin in mesh units from 0 to 2^118, which is added to the radius of its mesh in every query.
 * It is 0 at first. CBVH_INVALID_ARGUMENT for a margin that is negative, NaN or above 2^118. */
cbvh_status cbvh_scene_set_margin(cbvh_scene scene, cbvh_instance instance, double margin);
/* Gives a pair of instances a margin besides those of both. Queries about the pair add it to the margin of A. It is 0
 * at first, and goes when an instance of the pair is removed. */
cbvh_status cbvh_scene_set_pair_margin(cbvh_scene scene, cbvh_instance a, cbvh_instance b, double margin);
/* Writes the instance with a name. CBVH_NOT_FOUND if there is none. */
cbvh_status cbvh_scene_find(cbvh_scene scene, const char *name, cbvh_instance *instance);
/* Lists all instances in ascending order. */
cbvh_status cbvh_scene_instances(cbvh_scene scene, cbvh_instance *instances, size_t capacity, size_t *count);
/* Writes the name of an instance as cbvh_mesh_object_name does; it is empty if there is none. */
cbvh_status cbvh_scene_instance_name(cbvh_scene scene, cbvh_instance instance, char *buffer, size_t capacity,
                                     size_t *length);
/* Writes where an instance is in the world. */
cbvh_status cbvh_scene_instance_pose(cbvh_scene scene, cbvh_instance instance, cbvh_pose *world);
/* Makes a handle of the mesh of an instance, to be freed. Its radius is without the margin. */
cbvh_status cbvh_scene_instance_mesh(cbvh_scene scene, cbvh_instance instance, cbvh_mesh *mesh);
/* Writes the margin of an instance. */
cbvh_status cbvh_scene_instance_margin(cbvh_scene scene, cbvh_instance instance, double *margin);
/* Writes the margin that a pair of instances has besides those of both, in either order. */
cbvh_status cbvh_scene_pair_margin(cbvh_scene scene, cbvh_instance a, cbvh_instance b, double *margin);
/* Writes how much work the query took that ended last, over all its pairs. */
cbvh_status cbvh_scene_stats(cbvh_scene scene, cbvh_stats *stats);

/* A pair of instances. */
typedef struct cbvh_scene_pair {
    cbvh_instance a;
    cbvh_instance b;
} cbvh_scene_pair;

/* The nearest pair. */
typedef struct cbvh_scene_distance_answer {
    cbvh_scene_pair pair;
    cbvh_distance_answer nearest;
    /* 1, or 0 if there are no pairs. */
    int32_t found;
    int32_t reserved;
} cbvh_scene_distance_answer;

/* The pair with the least signed distance. */
typedef struct cbvh_scene_signed_distance_answer {
    cbvh_scene_pair pair;
    /* As cbvh_signed_distances answers, in A's frame. */
    cbvh_signed_distance nearest;
    /* 1, or 0 if there are no pairs; the numbers are then NaN or 0. */
    int32_t found;
    int32_t reserved;
} cbvh_scene_signed_distance_answer;

/* A pair that overlaps or is near, and its signed distance. */
typedef struct cbvh_scene_near_pair {
    cbvh_scene_pair pair;
    /* The signed distance as one number, between both bounds: the distance or, where the pair overlaps, `nearest.lower`. */
    double distance;
    /* As cbvh_signed_distances answers, in A's frame. */
    cbvh_signed_distance nearest;
} cbvh_scene_near_pair;

/* The relation of a pair. */
typedef struct cbvh_scene_relation {
    cbvh_scene_pair pair;
    cbvh_relation relation;
    int32_t reserved;
} cbvh_scene_relation;

/* Two triangles in contact, and their instances. */
typedef struct cbvh_scene_contact {
    cbvh_scene_pair pair;
    cbvh_contact contact;
} cbvh_scene_contact;

/* A pair that clashes, and how. */
typedef struct cbvh_scene_clash {
    cbvh_scene_pair pair;
    /* As cbvh_clashes answers, in A's frame. */
    cbvh_clash clash;
} cbvh_scene_clash;

/* A pair that clashes, how, and what both have in common. */
typedef struct cbvh_scene_measured_clash {
    cbvh_scene_pair pair;
    /* As cbvh_measured_clashes answers, in A's frame. */
    cbvh_clash clash;
    /* The same, but with a box in the world, along its axes. */
    cbvh_intersection shared;
} cbvh_scene_measured_clash;

/* Answers whether any pair touches. */
cbvh_status cbvh_scene_collide(cbvh_scene scene, bool *answer);
/* Answers whether any pair is at most `d` apart. */
cbvh_status cbvh_scene_within(cbvh_scene scene, double d, bool *answer);
/* Answers which pair is nearest, and how far apart it is. */
cbvh_status cbvh_scene_distance(cbvh_scene scene, cbvh_scene_distance_answer *answer);
/* Answers which pair overlaps most, by its lower bound, or else which one is nearest, and its signed distance: the
 * distance, or minus the depth. A pair of which one is inside the other overlaps, if both are closed. The signed distance
 * of any other pair is at least that lower bound, but for roundings of distances. It takes the time of
 * cbvh_scene_relations and of a depth for each pair that overlaps or, where none does, that of cbvh_scene_distance.
 * CBVH_INVALID_ARGUMENT if a file in question was baked without topology. */
cbvh_status cbvh_scene_signed_distance(cbvh_scene scene, const cbvh_penetration_options *options,
                                       cbvh_scene_signed_distance_answer *answer);
/* Lists all pairs that touch, in ascending order. */
cbvh_status cbvh_scene_pairs_in_contact(cbvh_scene scene, cbvh_scene_pair *pairs, size_t capacity, size_t *count);
/* Lists all pairs at most `d` apart, in ascending order. */
cbvh_status cbvh_scene_pairs_within(cbvh_scene scene, double d, cbvh_scene_pair *pairs, size_t capacity, size_t *count);
/* Lists all pairs that overlap or are at most `margin` apart, in ascending order, with their signed distances. It is decided
 * exactly which are at most that far apart, and a pair of which one is inside the other overlaps, if both are closed. It
 * takes the time of cbvh_scene_pairs_within, and of a distance or a depth for each pair that is near.
 * CBVH_INVALID_ARGUMENT if the margin is negative or not finite, or if a file in question was baked without topology. */
cbvh_status cbvh_scene_near_pairs(cbvh_scene scene, double margin, const cbvh_penetration_options *options,
                                  cbvh_scene_near_pair *pairs, size_t capacity, size_t *count);
/* Lists all pairs that touch, or of which one is inside the other, wholly or in part, with their relations. */
cbvh_status cbvh_scene_relations(cbvh_scene scene, cbvh_scene_relation *relations, size_t capacity, size_t *count);
/* Lists all pairs of triangles in contact. */
cbvh_status cbvh_scene_contacts(cbvh_scene scene, cbvh_scene_contact *contacts, size_t capacity, size_t *count);
/* Lists all pairs that are near each other, touch, overlap, contain each other or are duplicates, with how they lie. Pairs
 * that are apart are left out. */
cbvh_status cbvh_scene_clashes(cbvh_scene scene, const cbvh_clash_options *options, cbvh_scene_clash *clashes,
                               size_t capacity, size_t *count);
/* Lists the same pairs, and measures what they have in common: see cbvh_measured_clashes. */
cbvh_status cbvh_scene_measured_clashes(cbvh_scene scene, const cbvh_clash_options *options,
                                        cbvh_scene_measured_clash *clashes, size_t capacity, size_t *count);

/* Answers whether some instances can move freely at the same time along paths in the world, while the others stand
 * still. The answer is the earliest hit of all pairs with at least one moving instance. The present poses of moving
 * instances do not matter, and do not change. What is attached to a moving instance moves with it, unless it has a path
 * of its own. CBVH_INVALID_ARGUMENT if an instance is given twice. */
cbvh_status cbvh_scene_motion(cbvh_scene scene, const cbvh_instance *instances, const cbvh_path *paths, size_t count,
                              const cbvh_motion_options *options, cbvh_motion_answer *answer);
/* Answers whether all these paths are certainly free, which takes less time. */
cbvh_status cbvh_scene_is_free(cbvh_scene scene, const cbvh_instance *instances, const cbvh_path *paths, size_t count,
                               const cbvh_motion_options *options, bool *answer);

/* These functions answer as those of queriers do, over all instances, for probes in the world. */
cbvh_status cbvh_scene_closest_points(cbvh_scene scene, const double *points, size_t count, double within,
                                      cbvh_closest_point *answers);
cbvh_status cbvh_scene_sides(cbvh_scene scene, const double *points, size_t count, cbvh_side *answers);
cbvh_status cbvh_scene_signed_point_distances(cbvh_scene scene, const double *points, size_t count, double within,
                                        cbvh_closest_point *answers);
cbvh_status cbvh_scene_first_hits(cbvh_scene scene, const cbvh_ray *rays, size_t count, cbvh_ray_hit *answers);
cbvh_status cbvh_scene_any_hits(cbvh_scene scene, const cbvh_ray *rays, size_t count, bool *answers);
cbvh_status cbvh_scene_all_hits(cbvh_scene scene, const cbvh_ray *rays, size_t ray_count, size_t *counts,
                                cbvh_ray_hit *hits, size_t capacity, size_t *count);
cbvh_status cbvh_scene_segment_hits(cbvh_scene scene, const cbvh_segment *segments, size_t count, bool *answers);
cbvh_status cbvh_scene_visible(cbvh_scene scene, const cbvh_segment *segments, size_t count, double margin,
                               bool *answers);

/* ---------------------------------------------------------------------------------------------------------- robots
 *
 * A robot from a URDF file, obstacles and attached objects, in queries by joint values. A body is a link, an
 * obstacle or an attached object. Queries are about all pairs of bodies that can move against each other, except those
 * whose contact is allowed, by cbvh_robot_set_allowed or by the SRDF file. Links that only fixed joints connect are never
 * checked with each other, and neither are obstacles. The frame of the root link is the world, unless the base moves.
 * Lengths are in metres, the unit of URDF files, and angles in radians.
 *
 * Functions that change a robot name bodies, and answers number them. Threads may query a robot while others change
 * it, as for scenes.
 *
 * A configuration has `joint_count` numbers, in the order of cbvh_robot_joint_name. Arrays have `count` configurations,
 * one after the other. CBVH_INVALID_ARGUMENT unless `joint_count` is that of the robot, and if a number is not finite or
 * the quaternion of a floating joint is far from length 1. Limits of joints are not checked. */

/* How the root of a robot is connected with the world. */
typedef int32_t cbvh_robot_base;
enum {
    /* It stands at the origin. */
    CBVH_BASE_FIXED = 0,
    /* It moves in the plane z = 0: three more joint values come first, base/x, base/y and base/theta. */
    CBVH_BASE_PLANAR = 1,
    /* It moves freely: seven more joint values come first, base/x to base/z and a quaternion, base/qx to base/qw. */
    CBVH_BASE_FLOATING = 2
};

/* How a robot is read. */
typedef struct cbvh_robot_options {
    size_t size;
    /* Folders in which packages (package://) are looked for, before those of the environment variable ROS_PACKAGE_PATH
     * and those above the URDF file. */
    const char *const *packages;
    size_t package_count;
    /* An SRDF file with pairs whose contact is allowed, groups and states; NULL for none. */
    const char *srdf;
    /* A folder for baked meshes, so that each is baked once; NULL for none. It is made if it is not there. */
    const char *cache;
    /* A cylinder becomes a prism that reaches beyond it by at most this part of its radius; 0 for 1/1000. */
    double cylinder_error;
    /* Takes the visual shapes of links (1) or their collision shapes (0). */
    int32_t visual;
    cbvh_robot_base base;
    /* Lets the URDF name meshes anywhere (1), or only in the folder above its own and below, in its package, in packages
     * that it names, and in the folders of packages (0). Likewise for the buffers of glTF meshes outside their folders. */
    int32_t allow_outside;
    /* Turns COLLADA meshes so that the axis that they declare to point up becomes z (1), or leaves their coordinates as
     * they are (0), as rviz, MoveIt, Gazebo and Pinocchio do. Their unit of lengths is always applied. */
    int32_t apply_up_axis;
} cbvh_robot_options;

/* A body of a robot. 0 is none. A robot and its clones never give the number of a removed body again. */
typedef struct cbvh_body { uint64_t id; } cbvh_body;

/* Two bodies, in the order of cbvh_robot_pairs. */
typedef struct cbvh_body_pair {
    cbvh_body a;
    cbvh_body b;
} cbvh_body_pair;

/* Reads a URDF file, and bakes the shapes of its links: meshes (OBJ, STL, PLY, glTF, COLLADA), boxes, spheres, cylinders
 * and capsules. CBVH_SYSTEM if a file is not there or may not be read, CBVH_INVALID_ARGUMENT if a description is not
 * valid or names a mesh where it may not, CBVH_LIMIT if it is too long, CBVH_BAKE_FAILED if a mesh cannot be baked, CBVH_DAMAGED if a file in the cache is. The message names the file
 * and the element. */
cbvh_status cbvh_robot_from_urdf(const char *path, const cbvh_robot_options *options, cbvh_robot *robot);
/* Makes a copy of a robot with the same bodies, which shares their meshes. It takes about a microsecond. */
cbvh_status cbvh_robot_clone(cbvh_robot robot, cbvh_robot *other);
/* Frees a robot. */
cbvh_status cbvh_robot_free(cbvh_robot robot);
/* Lets queries about many configurations or motions use all cores (1) or one (0, the default). */
cbvh_status cbvh_robot_set_parallel(cbvh_robot robot, int32_t parallel);
/* Gives a flag to a robot, as cbvh_scene_set_stop does. */
cbvh_status cbvh_robot_set_stop(cbvh_robot robot, cbvh_stop stop);

/* How much a robot has. */
typedef struct cbvh_robot_counts {
    /* The values of a configuration. */
    size_t joints;
    size_t links;
    /* Groups and states are those of the SRDF file. */
    size_t groups;
    size_t states;
} cbvh_robot_counts;

/* Writes how many joint values, links, groups and states a robot has. */
cbvh_status cbvh_robot_count(cbvh_robot robot, cbvh_robot_counts *counts);
/* Writes names as cbvh_mesh_object_name does. CBVH_NOT_FOUND if there is nothing of the number. */
cbvh_status cbvh_robot_name(cbvh_robot robot, char *buffer, size_t capacity, size_t *length);
/* Of a joint value: the name of a joint that turns or slides, NAME/x, NAME/y and NAME/theta of a planar joint, and NAME/x
 * to NAME/z and NAME/qx to NAME/qw of a floating one. Fixed joints and those that mimic others have no values. */
cbvh_status cbvh_robot_joint_name(cbvh_robot robot, size_t number, char *buffer, size_t capacity, size_t *length);
/* Of what was read otherwise than its author may have meant: a line that begins with the file and the line there or the
 * link. Among them are a robot without shapes, mimic joints without a joint to follow, limits that are the wrong way
 * round, names in the SRDF file that the robot does not have, and what the readers of meshes left out. CBVH_NOT_FOUND
 * after the last one. */
cbvh_status cbvh_robot_warning(cbvh_robot robot, size_t number, char *buffer, size_t capacity, size_t *length);
cbvh_status cbvh_robot_group_name(cbvh_robot robot, size_t number, char *buffer, size_t capacity, size_t *length);
cbvh_status cbvh_robot_state_name(cbvh_robot robot, size_t number, char *buffer, size_t capacity, size_t *length);
/* Of the group that a state is of. */
cbvh_status cbvh_robot_state_group(cbvh_robot robot, size_t number, char *buffer, size_t capacity, size_t *length);

/* The limits of a joint value, infinite where there are none. A lower limit above the upper one is none, with a warning. */
typedef struct cbvh_joint_limits {
    double lower;
    double upper;
} cbvh_joint_limits;

/* A joint value by its place in a configuration. */
typedef struct cbvh_joint_value {
    size_t joint;
    double value;
} cbvh_joint_value;

/* Lists the limits of all joint values. */
cbvh_status cbvh_robot_limits(cbvh_robot robot, cbvh_joint_limits *limits, size_t capacity, size_t *count);
/* Lists the places of the joint values that a group moves, ascending. */
cbvh_status cbvh_robot_group_joints(cbvh_robot robot, size_t number, size_t *joints, size_t capacity, size_t *count);
/* Lists the joint values of a state. */
cbvh_status cbvh_robot_state_values(cbvh_robot robot, size_t number, cbvh_joint_value *values, size_t capacity,
                                    size_t *count);
/* Lists the links, each after the link that it hangs from: this is the order of cbvh_robot_link_poses. */
cbvh_status cbvh_robot_links(cbvh_robot robot, cbvh_body *links, size_t capacity, size_t *count);
/* Writes the body with a name. CBVH_NOT_FOUND if there is none. */
cbvh_status cbvh_robot_find(cbvh_robot robot, const char *name, cbvh_body *body);
/* Writes the name of a body. CBVH_NOT_FOUND if there is none of the number, or if it was removed. */
cbvh_status cbvh_robot_body_name(cbvh_robot robot, cbvh_body body, char *buffer, size_t capacity, size_t *length);
/* Makes a handle of a shape of a body, to be freed, and writes its pose in the frame of its link or, for an obstacle, in
 * the world. The margin of the body is a part of its radius. This is for queries that robots do not answer, such as
 * cbvh_patches. CBVH_NOT_FOUND if there are no more shapes than `number`. */
cbvh_status cbvh_robot_shape(cbvh_robot robot, cbvh_body body, size_t number, cbvh_mesh *mesh, cbvh_pose *pose);
/* Lists the pairs that are checked. */
cbvh_status cbvh_robot_pairs(cbvh_robot robot, cbvh_body_pair *pairs, size_t capacity, size_t *count);

/* Adds an obstacle, which stands in the world. No other body may have its name. `body` may be NULL. The handle of the
 * mesh may be freed afterwards. A mesh is its surface, and what is wholly inside does not touch it, so that a room may
 * stand around the robot. If what is inside counts, pass a solid mesh (cbvh_mesh_solid), or call cbvh_robot_make_solid.
 * cbvh_robot_pairs_inside tells which bodies are inside others. */
cbvh_status cbvh_robot_add_obstacle(cbvh_robot robot, const char *name, cbvh_mesh mesh, const cbvh_pose *pose,
                                    cbvh_body *body);
/* Attaches an object to a link, at a pose in the link's frame. It may touch that link and those of `may_touch`. The
 * link's margin does not apply to it: it has a margin of its own, 0 at first (cbvh_robot_set_margin). */
cbvh_status cbvh_robot_attach(cbvh_robot robot, const char *name, cbvh_mesh mesh, const char *link,
                              const cbvh_pose *pose, const char *const *may_touch, size_t may_touch_count,
                              cbvh_body *body);
/* Removes an obstacle or an attached object, and what was set about it. CBVH_NOT_FOUND for a link. */
cbvh_status cbvh_robot_remove(cbvh_robot robot, const char *name);
/* Moves an obstacle, or an attached object in the frame of its link. CBVH_NOT_FOUND for a link. */
cbvh_status cbvh_robot_set_pose(cbvh_robot robot, const char *name, const cbvh_pose *pose);
/* Gives a body, a link, an obstacle or an attached object, a margin of at least 0, which is added to the radii of its
 * shapes in every query. It is 0 at first, and that of this body alone: what is attached to a link does not get the
 * link's. */
cbvh_status cbvh_robot_set_margin(cbvh_robot robot, const char *name, double margin);
/* Makes a body a solid, also a link: what is inside touches it from now on. CBVH_INVALID_ARGUMENT if a mesh of the body is
 * not closed: see cbvh_mesh_solid. */
cbvh_status cbvh_robot_make_solid(cbvh_robot robot, const char *name);
/* Allows two bodies to touch (1), or forbids it again (0). A pair that may touch takes part in no query. */
cbvh_status cbvh_robot_set_allowed(cbvh_robot robot, const char *a, const char *b, int32_t allowed);

/* A pair that touches often. */
typedef struct cbvh_frequent_pair {
    cbvh_body_pair pair;
    /* The part of the configurations in which it touches. */
    double share;
} cbvh_frequent_pair;

/* Allows the pairs that touch in at least this share of some random configurations within the limits, and lists them. The
 * configurations are the same each time. If there is too little room for the list, nothing is allowed. */
cbvh_status cbvh_robot_allow_frequent(cbvh_robot robot, size_t samples, double share, cbvh_frequent_pair *pairs,
                                      size_t capacity, size_t *count);

/* The nearest pair. */
typedef struct cbvh_robot_distance_answer {
    cbvh_body_pair pair;
    /* Its points are in the world. */
    cbvh_distance_answer nearest;
    /* 1, or 0 if there are no pairs; the numbers are then NaN or 0. */
    int32_t found;
    int32_t reserved;
} cbvh_robot_distance_answer;

/* The pair with the least signed distance. */
typedef struct cbvh_robot_signed_distance_answer {
    cbvh_body_pair pair;
    /* Its points, normal and translation are in the world. */
    cbvh_signed_distance nearest;
    /* 1, or 0 if there are no pairs; the numbers are then NaN or 0. */
    int32_t found;
    int32_t reserved;
} cbvh_robot_signed_distance_answer;

/* A pair of bodies that overlap or are near each other, and their signed distance. */
typedef struct cbvh_robot_near_pair {
    cbvh_body_pair pair;
    /* The signed distance as one number, between both bounds: the distance or, where the pair overlaps, `nearest.lower`. */
    double distance;
    /* Its points, normal and translation are in the world. */
    cbvh_signed_distance nearest;
} cbvh_robot_near_pair;

/* Lists the poses of all links in the world, in the order of cbvh_robot_links, configuration after configuration. */
cbvh_status cbvh_robot_link_poses(cbvh_robot robot, const double *joints, size_t joint_count, size_t count,
                                  cbvh_pose *poses, size_t capacity, size_t *pose_count);
/* Answers for each configuration whether any pair touches. */
cbvh_status cbvh_robot_collide(cbvh_robot robot, const double *joints, size_t joint_count, size_t count, bool *answers);
/* Answers which pair is nearest, and how far apart it is. */
cbvh_status cbvh_robot_distances(cbvh_robot robot, const double *joints, size_t joint_count, size_t count,
                                 cbvh_robot_distance_answer *answers);
/* Answers which pair overlaps most or, where none does, which one is nearest, and its signed distance: the distance, or
 * minus the depth. No other pair has a lower one, but for roundings and for how far the bounds of depths are apart. A body
 * inside another one overlaps it, unless one of them is not closed. It takes the time of cbvh_robot_distances, and of a
 * depth for each pair that overlaps. CBVH_INVALID_ARGUMENT if a file in question was baked without topology. */
cbvh_status cbvh_robot_signed_distances(cbvh_robot robot, const double *joints, size_t joint_count, size_t count,
                                        const cbvh_penetration_options *options,
                                        cbvh_robot_signed_distance_answer *answers);
/* Lists the pairs that touch, configuration after configuration. `counts` gets the number of each, and may be NULL. */
cbvh_status cbvh_robot_pairs_in_contact(cbvh_robot robot, const double *joints, size_t joint_count, size_t count,
                                        size_t *counts, cbvh_body_pair *pairs, size_t capacity, size_t *pair_count);
/* Lists the pairs that overlap or are at most `margin` apart, in the order of cbvh_robot_pairs, configuration after
 * configuration, with the derivative of each `distance` by each joint value, as planners that optimise a path need it. It
 * is decided exactly which pairs are at most that far apart. `counts` gets the number of each configuration, and may be
 * NULL. `gradients` has room for `capacity` times `joint_count` numbers, those of each pair one after the other, and may be
 * NULL.
 *
 * A derivative is that of the points in the answer. Where others are equally near, as on parallel faces, the signed
 * distance has a bend, and the derivative is that of one of them: a subgradient. Where bodies overlap, it is along the way
 * out that was found, which a lower `relative_gap` brings nearer to the shortest one. It is 0 where the normal is. A
 * floating joint has a derivative by each number of its quaternion, which is divided by its length first.
 *
 * It takes the time of cbvh_robot_pairs_in_contact, and of a distance or a depth for each pair that is near.
 * CBVH_INVALID_ARGUMENT if the margin is negative or not finite, or if a file in question was baked without topology. */
cbvh_status cbvh_robot_near_pairs(cbvh_robot robot, const double *joints, size_t joint_count, size_t count, double margin,
                                  const cbvh_penetration_options *options, size_t *counts, cbvh_robot_near_pair *pairs,
                                  double *gradients, size_t capacity, size_t *pair_count);
/* Lists the bodies that are inside others without touching them, each as `a` with the body around it as `b`, configuration
 * after configuration. Other queries do not find them, because a mesh is its surface. A body counts if a connected part
 * of it is inside a mesh of the other one. A mesh that is not closed has nothing inside. CBVH_INVALID_ARGUMENT if a file in
 * query was baked without topology. */
cbvh_status cbvh_robot_pairs_inside(cbvh_robot robot, const double *joints, size_t joint_count, size_t count,
                                    size_t *counts, cbvh_body_pair *pairs, size_t capacity, size_t *pair_count);

/* Whether a motion of a robot is free, and where it ends. */
typedef struct cbvh_robot_motion_answer {
    cbvh_outcome outcome;
    int32_t reserved;
    /* Before this time certainly no pair is within the clearance; 1 if the motion is free. */
    double free_until;
    /* The earliest time found at which a pair is, or may be, within the clearance; NaN if the motion is free. */
    double at;
    /* The pair; 0 if the motion is free. */
    cbvh_body_pair pair;
    /* Its distance at that time, with points in the world. NaN if the motion is free. */
    cbvh_distance_answer nearest;
} cbvh_robot_motion_answer;

/* Writes each end with whole turns added or taken away, so that each joint that turns without limits goes the short way
 * from the start: by at most half a turn. The robot is in the same place, but for the rounding of the angle. MoveIt and
 * OMPL interpolate so. The values of continuous joints, of revolute ones without limits and NAME/theta turn so. Other
 * values stay as they are, and so do those of joints that another one mimics by sliding or by another multiple than a whole
 * number. `nearest` gets count * joint_count numbers, and may be `ends`. */
cbvh_status cbvh_robot_nearest_turns(cbvh_robot robot, const double *starts, const double *ends, size_t joint_count,
                                     size_t count, double *nearest);
/* Answers whether each motion from a start to an end is certainly free, at every moment. Each joint moves at a constant
 * rate, and a floating one turns about one axis, the shorter way. Other joints turn by the difference of their values: a
 * continuous joint from 3.0 to -3.0 goes the long way round, unless cbvh_robot_nearest_turns made the end. A body that is
 * inside a surface all the way without touching it is free: see cbvh_robot_pairs_inside. A path through `n` configurations is `n - 1` motions:
 * pass it for the starts, and its second configuration for the ends. Turns by more than 16,384 radians are refused. */
cbvh_status cbvh_robot_edges_are_free(cbvh_robot robot, const double *starts, const double *ends, size_t joint_count,
                                      size_t count, const cbvh_motion_options *options, bool *answers);
/* Answers whether each of these motions is free, and otherwise what touches first, and when. */
cbvh_status cbvh_robot_edge_motions(cbvh_robot robot, const double *starts, const double *ends, size_t joint_count,
                                    size_t count, const cbvh_motion_options *options,
                                    cbvh_robot_motion_answer *answers);
/* These functions answer the same about motions on which each joint value follows a polynomial of time from 0 to 1.
 * Motion after motion, and joint value after joint value, there are `coefficient_count` coefficients, the constant first.
 * The numbers of a quaternion must follow straight lines: their coefficients after the second are 0, and there are at
 * most two. */
cbvh_status cbvh_robot_are_free(cbvh_robot robot, const double *coefficients, size_t coefficient_count,
                                size_t joint_count, size_t count, const cbvh_motion_options *options, bool *answers);
cbvh_status cbvh_robot_motions(cbvh_robot robot, const double *coefficients, size_t coefficient_count,
                               size_t joint_count, size_t count, const cbvh_motion_options *options,
                               cbvh_robot_motion_answer *answers);

#ifdef __cplusplus
}
#endif

#endif
