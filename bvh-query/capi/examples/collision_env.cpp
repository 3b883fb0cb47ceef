// The collision detector of a motion planning framework: what a plug-in of MoveIt does with cbvh (MOVEIT.md lists its
// functions one by one). The types stand for those of MoveIt, whose names they have. Then it is used, and its answers are
// checked.
//
//     collision_env ROBOT.urdf
//
// Questions are constant and may be asked by many threads. The parts are a robot among obstacles (`world_`) and one without
// them (`self_`), because the framework asks about both apart. What differs from question to question, which is attached
// bodies, allowed pairs and the links of interest, goes into copies of them. A copy takes microseconds, and is kept for the
// next question, which is usually about the same.
#include <cbvh.hpp>

#include <cstdio>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace {

using Names = std::pair<std::string, std::string>;
using ShapeConstPtr = std::shared_ptr<const cbvh::Mesh>;

// Shapes that do not move against each other, each with its pose in the frame of the object.
struct Shapes {
    std::vector<ShapeConstPtr> shapes;
    std::vector<cbvh::Pose> poses;
};

// moveit::core::AttachedBody. The poses are in the frame of the link.
struct AttachedBody {
    std::string id, link;
    Shapes shapes;
    std::vector<std::string> touch_links;
};

// moveit::core::RobotState: the values of the joints in the order of cbvh::Robot::joints, and what is attached.
struct RobotState {
    std::vector<double> joints;
    std::vector<AttachedBody> attached;
};

// collision_detection::AllowedCollisionMatrix. An entry about two names counts before the defaults of both, which both have to
// allow contact if both have one.
struct AllowedCollisionMatrix {
    std::map<Names, bool> entries;
    std::map<std::string, bool> defaults;

    void set(const std::string &a, const std::string &b, bool allowed) { entries[std::minmax(a, b)] = allowed; }
    bool allows(const std::string &a, const std::string &b) const {
        const auto entry = entries.find(std::minmax(a, b));
        if (entry != entries.end()) {
            return entry->second;
        }
        const auto of_a = defaults.find(a), of_b = defaults.find(b);
        if (of_a == defaults.end()) {
            return of_b != defaults.end() && of_b->second;
        }
        return of_a->second && (of_b == defaults.end() || of_b->second);
    }
};

struct CollisionRequest {
    bool contacts = false, distance = false;
    std::size_t max_contacts = 1, max_contacts_per_pair = 1;
    // The links that a group moves; only pairs with one of them, or with what is attached to one, count. None stand for all.
    std::set<std::string> active;
};

struct Contact {
    // In the world. The normal points from the first body to the second one; it is 0 where that is unknown.
    cbvh::Point pos, normal;
    double depth;
    std::string body_name_1, body_name_2;
    // When it happens on a motion, from 0 to 1.
    double percent_interpolation;
};

struct CollisionResult {
    bool collision = false;
    double distance = std::numeric_limits<double>::infinity();
    // By the names of both, the lower one first.
    std::map<Names, std::vector<Contact>> contacts;
    std::size_t contact_count = 0;
};

struct DistanceResult {
    double distance = std::numeric_limits<double>::infinity();
    Names link_names;
    cbvh::Point nearest_points[2];
};

cbvh::Point point(const double *of) { return {of[0], of[1], of[2]}; }

cbvh::Point turned(const cbvh::Pose &by, const cbvh::Point &v) {
    const double *const m = by.rows;
    return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[4] * v[0] + m[5] * v[1] + m[6] * v[2],
            m[8] * v[0] + m[9] * v[1] + m[10] * v[2]};
}

cbvh::Point placed(const cbvh::Pose &by, const cbvh::Point &v) {
    const cbvh::Point at = turned(by, v);
    return {at[0] + by.rows[3], at[1] + by.rows[7], at[2] + by.rows[11]};
}

class CollisionEnv {
public:
    explicit CollisionEnv(const cbvh::Robot &robot) : self_(robot), world_(robot), links_(robot.links()) {
        // The allowed pairs come with each question, so that all of them are asked about here. The robot of the world is not
        // asked about its own pairs. Pairs that never move against each other are none.
        for (const std::string &a : links_) {
            for (const std::string &b : links_) {
                if (a < b) {
                    self_.set_allowed(a, b, false);
                    world_.set_allowed(a, b, true);
                }
            }
        }
    }
    CollisionEnv(const CollisionEnv &other) : self_(other.self_), world_(other.world_), links_(other.links_),
        objects_(other.objects_), margins_(other.margins_) {}
    CollisionEnv &operator=(const CollisionEnv &) = delete;

    // setLinkPadding and setLinkScale. A scaled link is taken as one with a margin that reaches as far, which is at least as
    // much: `reach` is how far the link's shapes go from its origin. A scale below 1 does not shrink a link.
    void setPaddingAndScale(const std::string &link, double padding, double scale = 1, double reach = 0) {
        const double margin = padding + std::max(0.0, scale - 1) * reach;
        self_.set_margin(link, margin);
        world_.set_margin(link, margin);
        margins_[link] = margin;
        forget();
    }

    // World::CREATE, ADD_SHAPE and REMOVE_SHAPE: what has the id is replaced.
    void setObject(const std::string &id, const Shapes &shapes, const cbvh::Pose &pose = {}) {
        removeObject(id);
        for (std::size_t k = 0; k < shapes.shapes.size(); k++) {
            world_.add_obstacle(part(id, k), *shapes.shapes[k], shapes.poses[k].then(pose));
        }
        objects_[id] = shapes;
        forget();
    }
    // World::MOVE_SHAPE.
    void moveObject(const std::string &id, const cbvh::Pose &pose) {
        const Shapes &shapes = objects_.at(id);
        for (std::size_t k = 0; k < shapes.shapes.size(); k++) {
            world_.set_pose(part(id, k), shapes.poses[k].then(pose));
        }
        forget();
    }
    // World::DESTROY.
    void removeObject(const std::string &id) {
        const auto found = objects_.find(id);
        if (found == objects_.end()) {
            return;
        }
        for (std::size_t k = 0; k < found->second.shapes.size(); k++) {
            world_.remove(part(id, k));
        }
        objects_.erase(found);
        forget();
    }

    void checkSelfCollision(const CollisionRequest &request, CollisionResult &result, const RobotState &state,
                            const AllowedCollisionMatrix &acm) const {
        const auto prepared = prepare(state, acm, request.active);
        check(prepared->self, *prepared, request, result, state);
    }
    void checkRobotCollision(const CollisionRequest &request, CollisionResult &result, const RobotState &state,
                             const AllowedCollisionMatrix &acm) const {
        const auto prepared = prepare(state, acm, request.active);
        check(prepared->world, *prepared, request, result, state);
    }
    // From one state to another, at every moment. What is attached is that of the first one.
    void checkSelfCollision(const CollisionRequest &request, CollisionResult &result, const RobotState &from,
                            const RobotState &to, const AllowedCollisionMatrix &acm) const {
        const auto prepared = prepare(from, acm, request.active);
        check(prepared->self, *prepared, result, from, to);
    }
    void checkRobotCollision(const CollisionRequest &request, CollisionResult &result, const RobotState &from,
                             const RobotState &to, const AllowedCollisionMatrix &acm) const {
        const auto prepared = prepare(from, acm, request.active);
        check(prepared->world, *prepared, result, from, to);
    }
    DistanceResult distanceSelf(const RobotState &state, const AllowedCollisionMatrix &acm) const {
        const auto prepared = prepare(state, acm, {});
        return distance(prepared->self, *prepared, state);
    }
    DistanceResult distanceRobot(const RobotState &state, const AllowedCollisionMatrix &acm) const {
        const auto prepared = prepare(state, acm, {});
        return distance(prepared->world, *prepared, state);
    }

private:
    // Both robots with what is attached and what is allowed, and what they were made for.
    struct Prepared {
        cbvh::Robot self, world;
        std::vector<AttachedBody> attached;
        AllowedCollisionMatrix acm;
        std::set<std::string> active;
        // The ids of bodies that are no links, and the links that attached ones are on.
        std::map<std::string, std::string> ids, links;

        std::string id(const std::string &body) const {
            const auto found = ids.find(body);
            return found == ids.end() ? body : found->second;
        }
    };

    // The name of the body of a shape of an object.
    static std::string part(const std::string &id, std::size_t shape) { return id + "#" + std::to_string(shape); }

    static bool is_same(const std::vector<AttachedBody> &one, const std::vector<AttachedBody> &other) {
        return std::equal(one.begin(), one.end(), other.begin(), other.end(),
                          [](const AttachedBody &a, const AttachedBody &b) {
                              const auto is_at = [](const cbvh::Pose &p, const cbvh::Pose &q) {
                                  return std::equal(p.rows, p.rows + 12, q.rows);
                              };
                              return a.id == b.id && a.link == b.link && a.touch_links == b.touch_links &&
                                     a.shapes.shapes == b.shapes.shapes &&
                                     std::equal(a.shapes.poses.begin(), a.shapes.poses.end(), b.shapes.poses.begin(),
                                                b.shapes.poses.end(), is_at);
                          });
    }

    void forget() {
        const std::lock_guard<std::mutex> guard(lock_);
        last_.reset();
    }

    std::shared_ptr<const Prepared> prepare(const RobotState &state, const AllowedCollisionMatrix &acm,
                                            const std::set<std::string> &active) const {
        const std::lock_guard<std::mutex> guard(lock_);
        if (last_ && last_->active == active && last_->acm.entries == acm.entries &&
            last_->acm.defaults == acm.defaults && is_same(last_->attached, state.attached)) {
            return last_;
        }
        const auto made = std::make_shared<Prepared>(Prepared{self_, world_, state.attached, acm, active, {}, {}});
        for (const auto &[id, shapes] : objects_) {
            for (std::size_t k = 0; k < shapes.shapes.size(); k++) {
                made->ids[part(id, k)] = id;
            }
        }
        for (const AttachedBody &body : state.attached) {
            for (std::size_t k = 0; k < body.shapes.shapes.size(); k++) {
                const std::string name = part(body.id, k);
                made->self.attach(name, *body.shapes.shapes[k], body.link, body.shapes.poses[k], body.touch_links);
                made->world.attach(name, *body.shapes.shapes[k], body.link, body.shapes.poses[k], links_);
                made->ids[name] = body.id;
                made->links[name] = body.link;
                // It has the padding of its link.
                const auto margin = margins_.find(body.link);
                if (margin != margins_.end()) {
                    made->self.set_margin(name, margin->second);
                    made->world.set_margin(name, margin->second);
                }
            }
        }
        const auto is_active = [&](const std::string &body) {
            const auto on = made->links.find(body);
            return active.empty() || active.count(on == made->links.end() ? body : on->second) > 0;
        };
        for (cbvh::Robot *robot : {&made->self, &made->world}) {
            for (const cbvh_body_pair pair : robot->pairs()) {
                const std::string a = robot->name(pair.a), b = robot->name(pair.b);
                // Attached bodies are pairs of the robot itself.
                const bool is_own = robot == &made->world && made->links.count(a) > 0 && made->links.count(b) > 0;
                const bool is_one = made->links.count(a) > 0 && made->id(a) == made->id(b);
                if (is_own || is_one || acm.allows(made->id(a), made->id(b)) || !(is_active(a) || is_active(b))) {
                    robot->set_allowed(a, b, true);
                }
            }
        }
        last_ = made;
        return made;
    }

    static void check(const cbvh::Robot &robot, const Prepared &prepared, const CollisionRequest &request,
                      CollisionResult &result, const RobotState &state) {
        if (request.distance) {
            const DistanceResult nearest = distance(robot, prepared, state);
            result.distance = std::min(result.distance, nearest.distance);
        }
        if (!request.contacts) {
            result.collision = result.collision || robot.collide(state.joints);
            return;
        }
        const std::vector<cbvh_body_pair> pairs = robot.pairs_in_contact(state.joints);
        result.collision = result.collision || !pairs.empty();
        const Places places(robot, prepared, state);
        for (const cbvh_body_pair pair : pairs) {
            add_contacts(robot, prepared, places, pair, request, result);
        }
    }

    static void check(const cbvh::Robot &robot, const Prepared &prepared, CollisionResult &result,
                      const RobotState &from, const RobotState &to) {
        const cbvh_robot_motion_answer answer = robot.motion(from.joints, robot.nearest_turns(from.joints, to.joints));
        if (answer.outcome == CBVH_FREE) {
            return;
        }
        // What comes within a millionth of the smaller size counts as contact: free means certainly free.
        result.collision = true;
        const std::string a = prepared.id(robot.name(answer.pair.a)), b = prepared.id(robot.name(answer.pair.b));
        result.contacts[std::minmax(a, b)].push_back({point(answer.nearest.point_a), {0, 0, 0}, 0, a, b, answer.at});
        result.contact_count++;
    }

    static DistanceResult distance(const cbvh::Robot &robot, const Prepared &prepared, const RobotState &state) {
        DistanceResult result;
        if (const auto found = robot.distance(state.joints)) {
            result.distance = found->nearest.distance;
            result.link_names = {prepared.id(robot.name(found->pair.a)), prepared.id(robot.name(found->pair.b))};
            result.nearest_points[0] = point(found->nearest.point_a);
            result.nearest_points[1] = point(found->nearest.point_b);
        }
        return result;
    }

    // Where links and what is attached to them are.
    class Places {
    public:
        Places(const cbvh::Robot &robot, const Prepared &prepared, const RobotState &state) : prepared_(prepared) {
            const std::vector<cbvh::Pose> poses = robot.link_poses(state.joints);
            std::size_t number = 0;
            for (const std::string &link : robot.links()) {
                links_[link] = poses[number++];
            }
        }
        // The frame in which the shapes of a body are; the world of an obstacle.
        cbvh::Pose of(const std::string &body) const {
            const auto on = prepared_.links.find(body);
            const auto link = links_.find(on == prepared_.links.end() ? body : on->second);
            return link == links_.end() ? cbvh::Pose() : link->second;
        }

    private:
        const Prepared &prepared_;
        std::map<std::string, cbvh::Pose> links_;
    };

    // Asks how two bodies meet that touch: a contact is a patch of triangles in contact, with an estimated depth.
    static void add_contacts(const cbvh::Robot &robot, const Prepared &prepared, const Places &places,
                             cbvh_body_pair pair, const CollisionRequest &request, CollisionResult &result) {
        cbvh::Querier querier;
        cbvh::PatchOptions options;
        options.tolerance = 0.001;
        const std::string body_a = robot.name(pair.a), body_b = robot.name(pair.b);
        const std::string a = prepared.id(body_a), b = prepared.id(body_b);
        for (const auto &[mesh_a, own_a] : robot.shapes(pair.a)) {
            const cbvh::Pose world_a = own_a.then(places.of(body_a));
            for (const auto &[mesh_b, own_b] : robot.shapes(pair.b)) {
                const cbvh::Pose world_b = own_b.then(places.of(body_b));
                const cbvh::Pose pose = cbvh::Pose::relative(world_a, world_b);
                if (!querier.collide(mesh_a, mesh_b, pose)) {
                    continue;
                }
                std::vector<Contact> contacts;
                for (const cbvh::Patch &patch : querier.patches(mesh_a, mesh_b, pose, options).patches) {
                    contacts.push_back({placed(world_a, point(patch.center)), turned(world_a, point(patch.normal)),
                                        patch.depth, a, b, 0});
                }
                // What is wholly inside a solid touches it, and their surfaces do not meet.
                if (contacts.empty()) {
                    contacts.push_back({placed(world_b, {0, 0, 0}), {0, 0, 0}, 0, a, b, 0});
                }
                std::vector<Contact> &all = result.contacts[std::minmax(a, b)];
                for (const Contact &contact : contacts) {
                    if (all.size() < request.max_contacts_per_pair && result.contact_count < request.max_contacts) {
                        all.push_back(contact);
                        result.contact_count++;
                    }
                }
            }
        }
    }

    cbvh::Robot self_, world_;
    std::vector<std::string> links_;
    std::map<std::string, Shapes> objects_;
    std::map<std::string, double> margins_;
    mutable std::mutex lock_;
    mutable std::shared_ptr<const Prepared> last_;
};

// ------------------------------------------------------------------------------------------------ the framework's part

int failures = 0;

void expect(bool is_true, const char *what) {
    if (!is_true) {
        std::fprintf(stderr, "expected %s\n", what);
        failures++;
    }
}

Shapes block(const std::array<double, 3> &sides, const cbvh::Pose &pose = {}) {
    return {{std::make_shared<const cbvh::Mesh>(cbvh::Mesh::box(sides).solid())}, {pose}};
}

bool is_between(double x, double low, double high) { return low <= x && x <= high; }

void use(const std::string &urdf) {
    CollisionEnv env(cbvh::Robot::from_urdf(urdf));
    AllowedCollisionMatrix acm;
    acm.set("base", "turret", true);
    acm.set("turret", "upper_arm", true);
    acm.set("upper_arm", "forearm", true);
    acm.set("forearm", "hand", true);
    const RobotState up{{0, 0, 0, 0}, {}}, folded{{0, 2, 2.8, 0}, {}}, forward{{0, 1.2, 0, 0}, {}};
    CollisionRequest request, with_contacts;
    with_contacts.contacts = with_contacts.distance = true;
    with_contacts.max_contacts = 10;
    with_contacts.max_contacts_per_pair = 3;
    const auto self = [&](const RobotState &state) {
        CollisionResult result;
        env.checkSelfCollision(request, result, state, acm);
        return result.collision;
    };
    const auto robot = [&](const RobotState &state) {
        CollisionResult result;
        env.checkRobotCollision(request, result, state, acm);
        return result.collision;
    };

    // The robot itself.
    expect(!self(up) && self(folded), "a collision of the folded arm only");
    CollisionResult result;
    env.checkSelfCollision(with_contacts, result, folded, acm);
    expect(result.contacts.count({"base", "hand"}) == 1, "the hand at the base");
    const DistanceResult gap = env.distanceSelf(up, acm);
    expect(gap.distance > 0, "a distance of links");
    acm.set("base", "hand", true);
    acm.set("base", "forearm", true);
    expect(!self(folded), "no collision of pairs that are allowed");
    acm.entries.erase({"base", "hand"});
    expect(self(folded), "a collision again");
    acm.defaults["hand"] = true;
    expect(!self(folded), "no collision of the hand, which may touch anything");
    acm.defaults.clear();
    acm.entries.erase({"base", "forearm"});
    CollisionRequest of_base = request;
    of_base.active = {"turret", "upper_arm"};
    CollisionResult of_group;
    env.checkSelfCollision(of_base, of_group, folded, acm);
    expect(!of_group.collision, "no collision of links that the group does not move");

    // Diffs of the world. The forearm leans over the box.
    expect(!robot(forward), "no collision in an empty world");
    env.setObject("box", block({0.2, 0.2, 0.2}), cbvh::Pose::translation(0.5, 0, 0.46));
    expect(robot(forward) && !robot(up) && !self(forward), "a collision with the box, which is none of the robot itself");
    CollisionResult hit;
    env.checkRobotCollision(with_contacts, hit, forward, acm);
    expect(hit.collision && hit.contact_count >= 1 && hit.contact_count <= 10, "contacts");
    for (const auto &[names, contacts] : hit.contacts) {
        expect(names.first == "box" && contacts.size() <= 3, "contacts with the box");
        for (const Contact &contact : contacts) {
            expect(is_between(contact.pos[0], 0.4 - 1e-6, 0.6 + 1e-6) &&
                       is_between(contact.pos[1], -0.1 - 1e-6, 0.1 + 1e-6) &&
                       is_between(contact.pos[2], 0.36 - 1e-6, 0.56 + 1e-6),
                   "a contact at the box");
            const double length = std::hypot(contact.normal[0], contact.normal[1], contact.normal[2]);
            expect(is_between(length, 1 - 1e-9, 1 + 1e-9) && contact.depth > 0, "a normal and a depth");
            expect(contact.normal[2] <= 0, "a box that is not pushed up");
        }
    }
    expect(hit.distance <= 0, "no distance in contact");
    acm.set("box", "forearm", true);
    acm.set("box", "hand", true);
    acm.set("box", "upper_arm", true);
    expect(!robot(forward), "a box that may be touched");
    acm.entries.erase({"box", "forearm"});
    acm.entries.erase({"box", "hand"});
    acm.entries.erase({"box", "upper_arm"});

    env.moveObject("box", cbvh::Pose::translation(0.5, 0, 0.2));
    expect(!robot(forward), "no collision with the box farther down");
    const DistanceResult nearest = env.distanceRobot(forward, acm);
    expect(is_between(nearest.distance, 0.02, 0.3) && nearest.link_names.second == "box" &&
               nearest.nearest_points[1][2] <= 0.3 + 1e-6,
           "the distance to the box");
    // Padding and scale.
    const CollisionEnv as_it_was = env;
    for (const char *link : {"upper_arm", "forearm", "hand"}) {
        env.setPaddingAndScale(link, 0.01);
    }
    expect(is_between(nearest.distance - env.distanceRobot(forward, acm).distance, 0.01 - 1e-9, 0.01 + 1e-9),
           "a distance that is shorter by the padding");
    env.setPaddingAndScale("hand", 0.01, 1.5, 0.4);
    env.setPaddingAndScale("forearm", 0.01, 1.5, 0.4);
    env.setPaddingAndScale("upper_arm", 0.01, 1.5, 0.4);
    expect(robot(forward), "a collision of larger links");
    expect(!(as_it_was.distanceRobot(forward, acm).distance < nearest.distance), "a copy that has not changed");
    for (const char *link : {"upper_arm", "forearm", "hand"}) {
        env.setPaddingAndScale(link, 0);
    }

    // A body that is attached to the hand reaches the box, and the robot itself when it folds its arm.
    RobotState holding = forward;
    holding.attached = {{"rod", "hand", block({0.02, 0.02, 0.6}, cbvh::Pose::translation(0, 0, 0.3)), {"forearm"}}};
    CollisionResult of_rod;
    env.moveObject("box", cbvh::Pose::translation(0.95, 0, 0.66));
    expect(!robot(forward), "an arm that does not reach the box");
    env.checkRobotCollision(with_contacts, of_rod, holding, acm);
    expect(of_rod.contacts.size() == 1 && of_rod.contacts.begin()->first == Names("box", "rod"), "the rod at the box");
    expect(!self(holding), "a rod that touches no link");
    env.moveObject("box", cbvh::Pose::translation(1.5, 0, 0.66));
    const double bare = env.distanceRobot(holding, acm).distance;
    env.setPaddingAndScale("hand", 0.01);
    expect(is_between(bare - env.distanceRobot(holding, acm).distance, 0.01 - 1e-9, 0.01 + 1e-9),
           "a rod that is padded as the hand");
    env.setPaddingAndScale("hand", 0);
    holding.joints = folded.joints;
    expect(self(holding), "a rod that touches links");

    // Motions, at every moment: a sheet that no state of a planner's samples touches.
    env.removeObject("box");
    env.setObject("sheet", block({0.6, 1e-6, 0.6}), cbvh::Pose::translation(0.3, 0.00213, 0.8));
    RobotState from = forward, to = forward;
    from.joints[0] = -0.5;
    to.joints[0] = 0.5;
    RobotState touching = from;
    CollisionResult swept, back;
    env.checkRobotCollision(request, swept, from, to, acm);
    expect(swept.collision && swept.contacts.begin()->second[0].body_name_2 == "sheet", "a motion through the sheet");
    const double at = swept.contacts.begin()->second[0].percent_interpolation;
    touching.joints[0] = from.joints[0] + at * (to.joints[0] - from.joints[0]);
    expect(at > 0 && at < 1 && robot(touching) && !robot(from) && !robot(to), "the time of the contact");
    touching.joints[0] = -0.1 - 0.4;
    env.checkRobotCollision(request, back, from, touching, acm);
    env.checkSelfCollision(request, back, from, to, acm);
    expect(!back.collision, "a motion that is free");

    // Objects of several shapes, and threads.
    Shapes two = block({0.1, 0.1, 0.1}, cbvh::Pose::translation(0, 0, 1));
    two.shapes.push_back(two.shapes[0]);
    two.poses.push_back(cbvh::Pose::translation(2, 0, 0));
    env.setObject("sheet", two);
    expect(robot(up) && env.distanceRobot(forward, acm).link_names.second == "sheet", "an object of two shapes");
    std::vector<std::thread> threads;
    bool answers[4][2];
    for (auto &answer : answers) {
        threads.emplace_back([&] {
            for (int round = 0; round < 20; round++) {
                answer[0] = robot(up);
                answer[1] = robot(forward) || self(holding);
            }
        });
    }
    for (std::thread &thread : threads) {
        thread.join();
    }
    for (const auto &answer : answers) {
        expect(answer[0] && answer[1], "the same answers on all threads");
    }
}

} // namespace

int main(int count, char **arguments) {
    try {
        if (count != 2) {
            std::fprintf(stderr, "expected a URDF file\n");
            return 1;
        }
        use(arguments[1]);
        std::printf("the collision detector: %s\n", failures == 0 ? "as expected" : "not as expected");
        return failures == 0 ? 0 : 1;
    } catch (const cbvh::Error &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
