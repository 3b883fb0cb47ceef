/* cbvh: exact collision and distance queries between rigid triangle meshes. The C interface, C99.
 *
 * A mesh is baked once, from arrays or files, into the bytes of a .cbvh file; questions are asked about meshes in
 * poses:
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
 * Errors. Every function but cbvh_last_message returns a cbvh_status. Any status but CBVH_OK leaves a message with the
 * thread, which names the argument, what was expected and what was found. Arguments are checked before any question is
 * asked. After a failure, handles that a function should have made are 0, and answers hold no particular values;
 * nothing is ever written beyond them. Nothing unwinds out of a function, and no argument makes one crash as long as
 * pointers that are neither null nor misaligned lead to as many elements as is said, and text ends with a zero byte.
 * Where memory for arrays of the caller or for a list of contacts runs out, the status is CBVH_LIMIT; where it runs out
 * elsewhere, the process ends. Functions need 128 KiB of stack.
 *
 * Poses are "body to world". In questions about two meshes, the world is the frame of mesh A: a point x of mesh B is at
 * R x + t in A's frame. Points are columns; a pose is the rows of the 3 by 4 matrix [R | t]. R is a rotation to within
 * 2^-20. Lengths are in the unit of the meshes.
 *
 * Handles are numbers, not addresses: small structures that are passed by value. A handle of 0 is none, and freeing it
 * does nothing. A handle that was freed, is of another kind or was made up is refused with CBVH_INVALID_HANDLE; it is
 * never followed. A copy of the structure is the same handle, which is to be freed once. Handles that are not freed
 * live as long as the process. In a child after fork() without exec() use none.
 *
 * Threads. Functions may be called on any thread. Meshes and paths may be used by many threads at the same time; a
 * querier, a tracker and a scene by one at a time, and a second one gets CBVH_BUSY. Make one querier for each thread.
 * Many threads may look at a scene together, which is to say clone it or call cbvh_scene_find, _instances,
 * _instance_name, _instance_pose, _instance_mesh or _stats, while none uses or changes it.
 * Freeing a mesh or a path that other threads use is allowed: it lives on until their questions end.
 * cbvh_querier_set_parallel and cbvh_scene_set_parallel let one question use all cores; the number of threads is that
 * of the environment variable RAYON_NUM_THREADS or, without it, of the cores.
 *
 * Answers have the same bits on every CPU, on any number of threads and in any order of questions, and are those of the
 * command cbvh and of the Rust library. How the calling thread rounds (fesetround), whether it flushes subnormal
 * numbers (-ffast-math) and which exceptions trap (feenableexcept) does not matter: functions change it where they have
 * to, and change it back. Functions of the caller run as the caller of the question computes; on threads of the
 * library, long double on x86-64 is an exception.
 *
 * Lists. A function with a list of answers takes a buffer, the number of elements that it has room for, and a count.
 * The count always gets the number of all answers. If there are more than there is room for, those that fit are
 * written, and the status is CBVH_BUFFER_TOO_SMALL. The buffer may be NULL where there is room for none.
 *
 * Options start with their size in bytes, for example `cbvh_motion_options options = {.size = sizeof options};`, so
 * that later versions can add fields. Fields that are 0 have their defaults. NULL stands for all defaults.
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
#define CBVH_VERSION_MAJOR 0
#define CBVH_VERSION_MINOR 9
#define CBVH_VERSION_PATCH 0

/* The version of the binary interface: the number in the name of the shared library. A library with the same number
 * runs programs that were built with an older header of that number. Functions and numbers may be added within it; what
 * is there keeps its meaning. */
#define CBVH_ABI 0

/* ---------------------------------------------------------------------------------------------------------- status */

/* Why a function failed, or CBVH_OK. */
typedef int32_t cbvh_status;
enum {
    CBVH_OK = 0,
    /* An argument is not what it has to be: null, misaligned, not finite, not rigid, too large, an unknown number. */
    CBVH_INVALID_ARGUMENT = 1,
    /* A handle is 0, was freed, is of another kind, or is none of this library. */
    CBVH_INVALID_HANDLE = 2,
    /* Another thread, or a function that called this one, uses the querier, tracker or scene. */
    CBVH_BUSY = 3,
    /* There is no object or instance of that number or name. */
    CBVH_NOT_FOUND = 4,
    /* A list has more elements than its buffer has room for. */
    CBVH_BUFFER_TOO_SMALL = 5,
    /* The system refuses: a file that is not there or may not be read, a full disk. */
    CBVH_SYSTEM = 6,
    /* A file is not a .cbvh file, or is damaged. The message names the rule it breaks and where. */
    CBVH_DAMAGED = 7,
    /* A budget of visits or of memory or the memory there is does not suffice, a limit of the format is exceeded, or
     * 2^24 - 1 handles of a kind are open. */
    CBVH_LIMIT = 8,
    /* A mesh cannot be baked. */
    CBVH_BAKE_FAILED = 9,
    /* A function of the caller gave no pose or no sagitta. */
    CBVH_CALLBACK_FAILED = 10,
    /* A defect of this library. The handle that was in use can only be freed. Please report it. */
    CBVH_INTERNAL = 11
};

/* Returns the message of the last failure on this thread, in UTF-8, or an empty text. It is never NULL, and stays valid
 * until the next failure on this thread or the end of the thread. A success does not clear it. Call it after a function
 * has failed, not in the same list of arguments, which may be computed in any order. */
const char *cbvh_last_message(void);

/* Writes the CBVH_ABI of the library that runs. */
cbvh_status cbvh_abi(uint32_t *abi);

/* --------------------------------------------------------------------------------------------------------- handles */

/* A baked mesh: all objects of a file, or one of them. */
typedef struct cbvh_mesh { uint64_t id; } cbvh_mesh;
/* What answers questions, and the memory for it, which is used again from question to question. */
typedef struct cbvh_querier { uint64_t id; } cbvh_querier;
/* What is remembered from pose to pose of a mesh that moves little by little. */
typedef struct cbvh_tracker { uint64_t id; } cbvh_tracker;
/* A way of mesh B in the frame of mesh A, or of an instance in the world, over times from 0 to 1. */
typedef struct cbvh_path { uint64_t id; } cbvh_path;
/* Many placed meshes. */
typedef struct cbvh_scene { uint64_t id; } cbvh_scene;

/* ----------------------------------------------------------------------------------------------------------- poses */

/* A rigid placement: the rows of the 3 by 4 matrix [R | t], one after the other, body to world. */
typedef struct cbvh_pose { double rows[12]; } cbvh_pose;

/* The pose of what is not moved. */
#define CBVH_IDENTITY {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}

/* Checks a pose: finite, a translation of at most 2^120 along each axis, a rotation to within 2^-20. */
cbvh_status cbvh_pose_check(const cbvh_pose *pose);
/* Makes a pose from a quaternion x, y, z, w, the real part last, of length 1 to within 2^-21, and a translation x, y,
 * z. */
cbvh_status cbvh_pose_from_quaternion(const double *quaternion, const double *translation, cbvh_pose *result);
/* Makes the rigid pose nearest to one that is off by at most 2^-6: for rounded matrices. */
cbvh_status cbvh_pose_nearest(const cbvh_pose *pose, cbvh_pose *result);
/* Makes the pose that takes back what a pose does. */
cbvh_status cbvh_pose_inverse(const cbvh_pose *pose, cbvh_pose *result);
/* Makes the pose that does what `first` does and then what `next` does: a part's pose in a body, then the body's pose
 * in the world, is the part's pose in the world. */
cbvh_status cbvh_pose_then(const cbvh_pose *first, const cbvh_pose *next, cbvh_pose *result);
/* Makes the pose of B in A's frame, which questions about two meshes take, from the poses of both in the world. */
cbvh_status cbvh_pose_relative(const cbvh_pose *world_a, const cbvh_pose *world_b, cbvh_pose *result);

/* ---------------------------------------------------------------------------------------------------------- meshes */

/* How a file is opened. */
typedef int32_t cbvh_open_mode;
enum {
    /* Maps the file. It takes microseconds, whatever its size, and pages are read when a question needs them. The bytes
     * of the file must not change while it is open: replace a file by renaming another one over it. A file that is
     * truncated while it is mapped ends the process with SIGBUS. */
    CBVH_MAP = 0,
    /* Maps the file, and reads from the disk no more than questions need: for files larger than memory. */
    CBVH_MAP_SPARSE = 1,
    /* Maps the file, and reads all of it in the background. */
    CBVH_MAP_WHOLE = 2,
    /* Copies the file into memory. What becomes of the file afterwards does not matter. */
    CBVH_READ = 3
};

/* Opens a .cbvh file. CBVH_SYSTEM if the system refuses it or it is no regular file, CBVH_DAMAGED if it is no .cbvh
 * file. Only the header and the table of objects are checked; damage elsewhere is found by the question that needs
 * it. */
cbvh_status cbvh_mesh_open(const char *path, cbvh_open_mode mode, cbvh_mesh *mesh);
/* Opens the bytes of a .cbvh file, which are copied. */
cbvh_status cbvh_mesh_from_bytes(const void *bytes, size_t size, cbvh_mesh *mesh);
/* Opens the bytes of a .cbvh file where they are, at any address. They must stay there unchanged until `release` is
 * called with `user`: once, on any thread, when the handle, its clones and objects are freed, scenes with them are
 * freed, and queriers asked about them are freed or have been asked about something else. That may be during this call,
 * as large files are copied to large memory pages. Without `release`, the bytes must stay as long as the process. After
 * a failure `release` is not called.
 * `release` must not let an exception out and must not call this library. */
cbvh_status cbvh_mesh_borrow_bytes(const void *bytes, size_t size, void (*release)(void *user), void *user,
                                   cbvh_mesh *mesh);
/* Makes another handle of the same mesh, to be freed by itself. Nothing is copied. */
cbvh_status cbvh_mesh_clone(cbvh_mesh mesh, cbvh_mesh *other);
/* Frees a handle. Scenes and clones keep what they use; a querier keeps a mesh that it was asked about, of the last
 * eight, until it is next asked about any mesh that is open, or freed. */
cbvh_status cbvh_mesh_free(cbvh_mesh mesh);

/* Makes a mesh of one object of the file that a mesh is in. CBVH_NOT_FOUND if it has no object of this number. */
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
/* Writes the bytes of the file that a mesh is in, and how many there are. */
cbvh_status cbvh_mesh_bytes(cbvh_mesh mesh, void *buffer, size_t capacity, size_t *size);
/* Writes a mesh to a file, completely or not at all: to another one, which then takes its place. What is there is
 * replaced, also if it is a symbolic link. */
cbvh_status cbvh_mesh_save(cbvh_mesh mesh, const char *path);
/* Checks the whole file that a mesh is in: CBVH_DAMAGED with the first rule that it breaks. It is read once. */
cbvh_status cbvh_mesh_validate(cbvh_mesh mesh);

/* How a mesh is baked. The names are those of the command `cbvh bake`, which explains them. */
typedef struct cbvh_bake_options {
    size_t size;
    /* The layout of the nodes by name; NULL lets the baker choose. */
    const char *profile;
    /* The encoding of triangles, "f32", "packed" or "quantized"; NULL lets the baker choose one without loss. */
    const char *triangles;
    /* The time spent on the tree: "fast" or "default"; NULL for the default. */
    const char *effort;
    /* The folder for scratch files; NULL for that of the output. Files only. */
    const char *scratch;
    /* How far "quantized" may move a vertex, in mesh units; 0 for 1e-5 of the diagonal of the object's box. */
    double max_error;
    /* The most memory that the process may use, in bytes; 0 for no limit. Files only. */
    uint64_t max_memory;
    /* These are 0 or 1. */
    /* Gives each object of the input a tree of its own. */
    int32_t split_objects;
    /* Reads files as scenes: nodes of glTF files become instances. Files only. */
    int32_t scene;
    /* Leaves out the numbers of the triangles in the input. */
    int32_t no_ids;
    /* Leaves out the slabs that turn with the surface. */
    int32_t no_turning_slabs;
    /* Leaves out which objects are closed, which questions about what is inside need. */
    int32_t no_topology;
    /* Bakes even if the output is up to date. Files only. */
    int32_t force;
} cbvh_bake_options;

/* Bakes triangles in memory: 3 numbers per vertex, 3 vertices per face. Triangles are numbered in their order. It takes
 * about 0.6 microseconds per triangle on two cores. CBVH_BAKE_FAILED for what is no mesh: a face that names no vertex,
 * a coordinate that is not finite or beyond 2^120, no faces at all. */
cbvh_status cbvh_bake(const double *vertices, size_t vertex_count, const uint32_t *faces, size_t face_count,
                      const cbvh_bake_options *options, cbvh_mesh *mesh);
/* Bakes mesh files (OBJ, STL, PLY, glTF) of any size into a .cbvh file, which is written completely or not at all. An
 * output that is up to date is left alone; `was_up_to_date` gets 1 then, else 0, and may be NULL. */
cbvh_status cbvh_bake_files(const char *const *inputs, size_t input_count, const char *output,
                            const cbvh_bake_options *options, int32_t *was_up_to_date);

/* -------------------------------------------------------------------------------------------------------- queriers */

/* Which instructions questions use. Answers do not depend on it. */
typedef int32_t cbvh_backend;
enum {
    /* The fastest of this CPU, or that which the environment variable CBVH_ISA names. */
    CBVH_BACKEND_BEST = 0,
    CBVH_BACKEND_SCALAR = 1,
    CBVH_BACKEND_AVX2 = 2,
    CBVH_BACKEND_AVX512 = 3
};

/* Makes a querier. CBVH_INVALID_ARGUMENT for a backend that the CPU lacks. It keeps the memory of the largest question
 * it was asked, of 100 bytes for each pose and each probe, until it is freed. */
cbvh_status cbvh_querier_new(cbvh_backend backend, cbvh_querier *querier);
/* Frees a querier. CBVH_BUSY while it is in use. */
cbvh_status cbvh_querier_free(cbvh_querier querier);
/* Lets questions about many poses, paths or probes use all cores (1), or the calling thread alone (0, the default).
 * Answers are the same. Give poses that follow a path in the order of the path: neighbours share what was found. */
cbvh_status cbvh_querier_set_parallel(cbvh_querier querier, int32_t parallel);
/* Lets the question about each pose, path or probe make at most so many visits, of some 100 ns each; more ends with
 * CBVH_LIMIT. A visit is a pair of objects or of nodes, or a node for a probe, a contact with each of its duplicates, a
 * component and an object of a relation, or an interval of a motion. Without it, only the sizes of the files bound a
 * question. */
cbvh_status cbvh_querier_set_budget(cbvh_querier querier, uint64_t visits);

/* How much work the last question was. */
typedef struct cbvh_stats {
    /* Tests of up to 16 pairs of nodes each. */
    uint64_t node_tests;
    /* Pairs of leaf packets tested, of up to 16 pairs of triangles each. */
    uint64_t packet_tests;
    /* Pairs of triangles that went to exact arithmetic. */
    uint64_t exact_tests;
    /* Pairs of instances asked about; 1 for a querier. */
    uint64_t pairs;
} cbvh_stats;

/* Writes how much work the last pose, path or probe of the last question was. Work on other cores is not counted. */
cbvh_status cbvh_querier_stats(cbvh_querier querier, cbvh_stats *stats);

/* --------------------------------------------------------------------------------------- questions about two meshes
 *
 * Each takes `count` poses of B in A's frame, and writes as many answers. Meshes are surfaces; touching is contact,
 * exactly. They fail with CBVH_DAMAGED if a page that a question touches is damaged, and with CBVH_LIMIT if the budget
 * of the querier does not suffice. A question about small or separated meshes takes about a microsecond, a call adds
 * some 0.1. */

/* Answers whether the meshes touch. */
cbvh_status cbvh_collide(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                         bool *answers);
/* Answers whether the meshes are at most `d` apart, exactly. `d` is finite and at least 0. */
cbvh_status cbvh_within(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count, double d,
                        bool *answers);

/* How two meshes lie. */
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
    /* A mesh that is not closed would have to contain something. */
    CBVH_RELATION_UNDEFINED = 5
};

/* Answers how the meshes lie. CBVH_INVALID_ARGUMENT for a file that was baked without topology. */
cbvh_status cbvh_relations(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                        cbvh_relation *answers);

/* How far apart two meshes are. */
typedef struct cbvh_distance_answer {
    /* The distance; 0 if and only if the meshes touch. */
    double distance;
    /* The two triangles named here are certainly at least this far apart and, if an error was allowed, no two are
     * nearer. */
    double lower;
    /* The meshes are certainly at most this far apart. */
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

/* Lists all pairs of triangles in contact in ascending order, those of one pose after those of the one before. `counts`
 * gets the number of pairs of each pose, and may be NULL. On one core it takes at most four times the memory of the
 * buffer, however many pairs there are; about many poses on all cores, that of all pairs. */
cbvh_status cbvh_contacts(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t pose_count,
                          size_t *counts, cbvh_contact *contacts, size_t capacity, size_t *count);
/* Writes the number of the first pose in which the meshes touch, or `count` if they touch in none. */
cbvh_status cbvh_first_collision(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *poses, size_t count,
                                 size_t *number);
/* Writes a bound of how far any point of B moves from one pose to another. */
cbvh_status cbvh_displacement(cbvh_mesh b, const cbvh_pose *from, const cbvh_pose *to, double *bound);

/* Makes a tracker. */
cbvh_status cbvh_tracker_new(cbvh_tracker *tracker);
/* Frees a tracker. */
cbvh_status cbvh_tracker_free(cbvh_tracker tracker);
/* Answer as the functions of querier do, by means of it, on one core and in less time where each pose is near the one
 * before, in this call or the last one. A tracker is about one pair of meshes; another pair makes it forget. */
cbvh_status cbvh_tracker_collide(cbvh_tracker tracker, cbvh_querier querier, cbvh_mesh a, cbvh_mesh b,
                                 const cbvh_pose *poses, size_t count, bool *answers);
cbvh_status cbvh_tracker_within(cbvh_tracker tracker, cbvh_querier querier, cbvh_mesh a, cbvh_mesh b,
                                const cbvh_pose *poses, size_t count, double d, bool *answers);
cbvh_status cbvh_tracker_distance(cbvh_tracker tracker, cbvh_querier querier, cbvh_mesh a, cbvh_mesh b,
                                  const cbvh_pose *poses, size_t count, cbvh_distance_answer *answers);

/* --------------------------------------------------------------------------------------------------------- motions
 *
 * Is the way free, at every moment from 0 to 1, and where does it end? Answers are certain between samples, too. */

/* Makes the path between two poses: the origin of B moves on a line, B turns about one axis the shorter way, both at a
 * constant rate. CBVH_INVALID_ARGUMENT if the poses are half a turn apart. */
cbvh_status cbvh_path_between(const cbvh_pose *start, const cbvh_pose *end, cbvh_path *path);
/* Makes a screw motion from `start`: a turn by `angle` radians, any number of turns, about the axis through `point`
 * with `direction`, and a shift along it. Points and directions are 3 numbers. */
cbvh_status cbvh_path_screw(const cbvh_pose *start, const double *point, const double *direction, double angle,
                            double shift, cbvh_path *path);
/* Makes the path through at least two poses, each part of which takes the same time. */
cbvh_status cbvh_path_polyline(const cbvh_pose *poses, size_t count, cbvh_path *path);

/* Writes where B is at a time from 0 to 1, and returns 0; any other number is a failure, which the question passes on.
 * The same time gives the same pose, to the bit. */
typedef int32_t (*cbvh_pose_function)(void *user, double t, cbvh_pose *pose);
/* Returns a bound of the sagitta: how far any point that moves with B, and is at most `radius` from B's origin, is
 * during [t0, t1] from where it would be if it went straight, at a constant rate, from where it is at t0 to where it is
 * at t1. At most an eighth of the greatest acceleration times the square of the time. It must hold with all rounding;
 * answers are only as certain as it is. It may be infinite; NaN and negative numbers end the question with
 * CBVH_CALLBACK_FAILED. */
typedef double (*cbvh_sagitta_function)(void *user, double radius, double t0, double t1);
/* Makes a path of two functions, which are called with `user` while questions run: on the calling thread alone, or on
 * several threads at the same time if the querier or scene is parallel. They must not let an exception or longjmp out.
 * They may call this library, but with the querier or scene in use they get CBVH_BUSY; what they ask on a thread of the
 * library takes that thread alone. `release` is called with `user` when the path is no longer used: once, on any
 * thread, when the handle is freed and questions about it have ended. It may be NULL, must not let an exception out and
 * must not call this library. After a failure it is not called. */
cbvh_status cbvh_path_from_functions(cbvh_pose_function pose, cbvh_sagitta_function sagitta,
                                     void (*release)(void *user), void *user, cbvh_path *path);
/* Says in a function of a path, before it fails, why it does: the message of the question then ends with this text. */
cbvh_status cbvh_callback_message(const char *message);
/* Frees a path. */
cbvh_status cbvh_path_free(cbvh_path path);
/* Writes where B is at a time from 0 to 1. */
cbvh_status cbvh_path_pose(cbvh_path path, double t, cbvh_pose *result);
/* Writes a bound of how far any point of B is, from t0 to t1, from where it is in the middle of that time. */
cbvh_status cbvh_path_reach(cbvh_mesh b, cbvh_path path, double t0, double t1, double *bound);

/* What counts as a hit, and how exactly time is searched. */
typedef struct cbvh_motion_options {
    size_t size;
    /* Meshes that come as near as this hit; 0 for contact. Finite, at least 0. */
    double clearance;
    /* How near B may come to a hit, beyond the clearance, without an answer that says free or hit; 0 for a millionth of
     * the diagonal of the larger object's box. A smaller one costs more. */
    double tolerance;
} cbvh_motion_options;

typedef int32_t cbvh_outcome;
enum {
    /* At no time from 0 to 1 are the meshes within the clearance. */
    CBVH_FREE = 0,
    /* At the time `at` they are. */
    CBVH_HIT = 1,
    /* They come within clearance and tolerance at the time `at`, and neither free nor hit can be told. */
    CBVH_NEAR = 2
};

/* An instance of a scene. 0 is none. */
typedef struct cbvh_instance { uint64_t id; } cbvh_instance;

/* Whether a way is free, and where it ends. */
typedef struct cbvh_motion_answer {
    cbvh_outcome outcome;
    int32_t reserved;
    /* Before this time the meshes certainly are not within the clearance; 1 where the way is free. */
    double free_until;
    /* The earliest time found at which they are, or may be; NaN where the way is free. */
    double at;
    /* In a scene, the pair: A stands still or, if both move, is the lower one. Else 0. */
    cbvh_instance instance_a;
    cbvh_instance instance_b;
    /* The distance at that time. NaN where the way is free. */
    cbvh_distance_answer nearest;
} cbvh_motion_answer;

/* Answers where the way along each path ends. */
cbvh_status cbvh_motions(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_path *paths, size_t count,
                         const cbvh_motion_options *options, cbvh_motion_answer *answers);
/* Answers whether each path is certainly free. Planners ask this: it needs less time than cbvh_motions to say no. */
cbvh_status cbvh_are_free(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_path *paths, size_t count,
                          const cbvh_motion_options *options, bool *answers);
/* Answer the same about the paths of cbvh_path_between from each start to its end: the edges of a planner. */
cbvh_status cbvh_edge_motions(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *starts,
                              const cbvh_pose *ends, size_t count, const cbvh_motion_options *options,
                              cbvh_motion_answer *answers);
cbvh_status cbvh_edges_are_free(cbvh_querier querier, cbvh_mesh a, cbvh_mesh b, const cbvh_pose *starts,
                                const cbvh_pose *ends, size_t count, const cbvh_motion_options *options,
                                bool *answers);

/* ---------------------------------------------------------------------------------------------------------- probes
 *
 * Questions about one mesh and many points, rays or segments. `pose` is where the mesh stands in the frame of the
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
    /* The distance; 0 if and only if the given point is on the mesh. It is not negative inside: see `side`. */
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
    /* 1, or 0 if the mesh is farther than `within`; then numbers are NaN or 0. */
    int32_t found;
    /* The side of the given point, in answers of signed distances. */
    cbvh_side side;
} cbvh_closest_point;

/* Answers where the closest surface to each point is, if it is at most `within` away, which may be infinite. */
cbvh_status cbvh_closest_points(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const double *points,
                                size_t count, double within, cbvh_closest_point *answers);
/* Answers on which side each point is, exactly. */
cbvh_status cbvh_sides(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const double *points, size_t count,
                       cbvh_side *answers);
/* Answers both. */
cbvh_status cbvh_signed_distances(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const double *points,
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
    /* 1, or 0 if the ray hits nothing; then numbers are NaN or 0. */
    int32_t found;
    int32_t reserved;
} cbvh_ray_hit;

/* Answers where each ray first hits. Which triangle is hit is decided exactly; edges and corners belong to
 * triangles. */
cbvh_status cbvh_first_hits(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const cbvh_ray *rays,
                            size_t count, cbvh_ray_hit *answers);
/* Answers whether each ray hits at all. */
cbvh_status cbvh_any_hits(cbvh_querier querier, cbvh_mesh mesh, const cbvh_pose *pose, const cbvh_ray *rays,
                          size_t count, bool *answers);
/* Lists all hits in their order along each ray, those of one ray after those of the one before. Hits at exactly the
 * same parameter are one. `counts` gets the number of hits of each ray, and may be NULL. */
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

/* ---------------------------------------------------------------------------------------------------------- scenes
 *
 * Many placed meshes, and questions over all pairs that matter. Of a pair, A is the instance that was added in the
 * lower place, and answers are in A's frame. A scene is used by one thread at a time; clone it for others. */

/* Makes an empty scene. */
cbvh_status cbvh_scene_new(cbvh_backend backend, cbvh_scene *scene);
/* Opens a scene file, which `cbvh bake --scene` makes: maps it as CBVH_MAP does, with one instance for each of
 * its own. CBVH_INVALID_ARGUMENT for a .cbvh file without instances. */
cbvh_status cbvh_scene_open(const char *path, cbvh_scene *scene);
/* Makes a scene of the instances in the file of a mesh. */
cbvh_status cbvh_scene_of_mesh(cbvh_mesh mesh, cbvh_scene *scene);
/* Makes a copy of a scene with the same instances, which shares their meshes. */
cbvh_status cbvh_scene_clone(cbvh_scene scene, cbvh_scene *other);
/* Frees a scene. */
cbvh_status cbvh_scene_free(cbvh_scene scene);
/* Lets questions use all cores (1) or one (0, the default). */
cbvh_status cbvh_scene_set_parallel(cbvh_scene scene, int32_t parallel);
/* Lets the scene remember (1) what it found about each pair: faster where instances move little between questions. */
cbvh_status cbvh_scene_set_tracking(cbvh_scene scene, int32_t tracking);
/* Lets each question make at most so many visits over all its pairs, and each probe over all instances: those of
 * cbvh_querier_set_budget, and each pair of boxes that the search for near pairs looks at. On several threads, each may
 * make so many before they find out. */
cbvh_status cbvh_scene_set_budget(cbvh_scene scene, uint64_t visits);

/* Adds a mesh at a pose in the world. Its rotation is rigid to within 2^-23 and its translation at most 2^118 along
 * each axis. `name` may be NULL; else no other instance has it. `instance` may be NULL. The handle of the mesh may be
 * freed afterwards. */
cbvh_status cbvh_scene_add(cbvh_scene scene, cbvh_mesh mesh, const cbvh_pose *world, const char *name,
                           cbvh_instance *instance);
/* Removes an instance. Its number is never given again by this scene. CBVH_NOT_FOUND if the scene has no such instance;
 * an instance of another scene is not recognised as such. */
cbvh_status cbvh_scene_remove(cbvh_scene scene, cbvh_instance instance);
/* Moves many instances, or none after a failure. Of an instance that is given twice, the last pose counts. */
cbvh_status cbvh_scene_set_poses(cbvh_scene scene, const cbvh_instance *instances, const cbvh_pose *worlds,
                                 size_t count);
/* Sets the groups that an instance is in and those it meets, a bit each. Two instances are asked about if each is in a
 * group that the other meets. By default all bits are set. */
cbvh_status cbvh_scene_set_groups(cbvh_scene scene, cbvh_instance instance, uint32_t member, uint32_t meets);
/* Allows two instances to touch (1), or forbids it again (0). A pair that may touch takes part in no question. */
cbvh_status cbvh_scene_set_allowed(cbvh_scene scene, cbvh_instance a, cbvh_instance b, int32_t allowed);
/* Writes the instance with a name. CBVH_NOT_FOUND if there is none. */
cbvh_status cbvh_scene_find(cbvh_scene scene, const char *name, cbvh_instance *instance);
/* Lists all instances in ascending order. */
cbvh_status cbvh_scene_instances(cbvh_scene scene, cbvh_instance *instances, size_t capacity, size_t *count);
/* Writes the name of an instance as cbvh_mesh_object_name does; it is empty if there is none. */
cbvh_status cbvh_scene_instance_name(cbvh_scene scene, cbvh_instance instance, char *buffer, size_t capacity,
                                     size_t *length);
/* Writes where an instance is in the world. */
cbvh_status cbvh_scene_instance_pose(cbvh_scene scene, cbvh_instance instance, cbvh_pose *world);
/* Makes a handle of the mesh of an instance, to be freed. */
cbvh_status cbvh_scene_instance_mesh(cbvh_scene scene, cbvh_instance instance, cbvh_mesh *mesh);
/* Writes how much work the last question was, over all its pairs. */
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

/* How a pair lies. */
typedef struct cbvh_scene_relation {
    cbvh_scene_pair pair;
    cbvh_relation relation;
    int32_t reserved;
} cbvh_scene_relation;

/* Two triangles in contact, and the instances that they are of. */
typedef struct cbvh_scene_contact {
    cbvh_scene_pair pair;
    cbvh_contact contact;
} cbvh_scene_contact;

/* Answers whether any pair touches. */
cbvh_status cbvh_scene_collide(cbvh_scene scene, bool *answer);
/* Answers whether any pair is at most `d` apart. */
cbvh_status cbvh_scene_within(cbvh_scene scene, double d, bool *answer);
/* Answers which pair is nearest, and how far apart it is. */
cbvh_status cbvh_scene_distance(cbvh_scene scene, cbvh_scene_distance_answer *answer);
/* Lists all pairs that touch, in ascending order. */
cbvh_status cbvh_scene_pairs_in_contact(cbvh_scene scene, cbvh_scene_pair *pairs, size_t capacity, size_t *count);
/* Lists all pairs at most `d` apart, in ascending order. */
cbvh_status cbvh_scene_pairs_within(cbvh_scene scene, double d, cbvh_scene_pair *pairs, size_t capacity, size_t *count);
/* Lists all pairs that touch, or of which one is inside the other, wholly or in part, and how they lie. */
cbvh_status cbvh_scene_relations(cbvh_scene scene, cbvh_scene_relation *relations, size_t capacity, size_t *count);
/* Lists all pairs of triangles in contact. */
cbvh_status cbvh_scene_contacts(cbvh_scene scene, cbvh_scene_contact *contacts, size_t capacity, size_t *count);

/* Answers where the ways of some instances end that move at the same time along paths in the world, while the rest
 * stands still: the earliest hit of all pairs of which one moves. Where those instances stand now does not matter, and
 * they stay there. CBVH_INVALID_ARGUMENT if an instance is given twice. */
cbvh_status cbvh_scene_motion(cbvh_scene scene, const cbvh_instance *instances, const cbvh_path *paths, size_t count,
                              const cbvh_motion_options *options, cbvh_motion_answer *answer);
/* Answers whether all of them are certainly free, which takes less time. */
cbvh_status cbvh_scene_is_free(cbvh_scene scene, const cbvh_instance *instances, const cbvh_path *paths, size_t count,
                               const cbvh_motion_options *options, bool *answer);

/* Answer as the functions of queriers do, over all instances, for probes in the world. */
cbvh_status cbvh_scene_closest_points(cbvh_scene scene, const double *points, size_t count, double within,
                                      cbvh_closest_point *answers);
cbvh_status cbvh_scene_sides(cbvh_scene scene, const double *points, size_t count, cbvh_side *answers);
cbvh_status cbvh_scene_signed_distances(cbvh_scene scene, const double *points, size_t count, double within,
                                        cbvh_closest_point *answers);
cbvh_status cbvh_scene_first_hits(cbvh_scene scene, const cbvh_ray *rays, size_t count, cbvh_ray_hit *answers);
cbvh_status cbvh_scene_any_hits(cbvh_scene scene, const cbvh_ray *rays, size_t count, bool *answers);
cbvh_status cbvh_scene_all_hits(cbvh_scene scene, const cbvh_ray *rays, size_t ray_count, size_t *counts,
                                cbvh_ray_hit *hits, size_t capacity, size_t *count);
cbvh_status cbvh_scene_segment_hits(cbvh_scene scene, const cbvh_segment *segments, size_t count, bool *answers);

#ifdef __cplusplus
}
#endif

#endif
