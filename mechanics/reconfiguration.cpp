#include "mechanics/reconfiguration.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "mechanics/detail/turning.h"
#include "mechanics/urdf.h"

namespace porthos::mechanics {
namespace {

std::string text(double x) {
  char t[32];
  std::snprintf(t, sizeof t, "%.4g", x);
  return t;
}

bool is_free(const BodySpec& b) { return b.parent == "world" && b.joint.type == "free"; }

/// root: of the tree of the body.
void require_free(const BodySpec& root, const std::string& body) {
  if (!is_free(root))
    throw InvalidArgument("capture: the body '" + body +
                          "' is not free in the world, expected one that is, or a link of a robot "
                          "that floats");
}

/// Whether two bodies belong to one tree.
bool of_one_tree(const MechanismBuilder& parts, const std::string& root, const std::string& body) {
  const auto way = way_to(parts, body);
  return !way.empty() && way.front().name == root;
}

/// A quantity that a latch limits, as it is now: of the body less of the link, in the world.
struct Closing {
  const char *what, *unit;
  Vec3<phs::Quad> of;
  double limit;
  double value = length(of);
};
std::array<Closing, 3> closing(const Latch& l, const Instant& now) {
  const auto X_WB = now.pose(l.body), X_WL = now.pose(l.link);  // body, link
  const auto V_B = now.twist(l.body), V_L = now.twist(l.link);  // each in its own axes
  const auto p_B = Instant::lifted(l.on_body), p_L = Instant::lifted(l.on_link);
  const auto p_LB_W = (X_WB.r + X_WB.R * p_B) - (X_WL.r + X_WL.R * p_L);
  const auto v_LB_W = X_WB.R * (V_B.v + cross(V_B.w, p_B)) - X_WL.R * (V_L.v + cross(V_L.w, p_L));
  const auto w_LB_W = X_WB.R * V_B.w - X_WL.R * V_L.w;
  return {{{"distance", "m", p_LB_W, l.reach},
           {"relative speed", "m/s", v_LB_W, l.speed},
           {"relative rate", "rad/s", w_LB_W, l.rate}}};
}

/// All limits that are exceeded, and the direction of the first.
std::string beyond(const Latch& l, const Instant& now) {
  const auto all = closing(l, now);
  std::string told, direction;
  for (const Closing& c : all) {
    if (c.value <= c.limit) continue;
    if (told.empty())
      direction = text(double(c.of[0])) + ", " + text(double(c.of[1])) + ", " +
                  text(double(c.of[2])) + ") " + c.unit + " in the world's axes";
    told += std::string(told.empty() ? "the " : "; the ") + c.what + " is " + text(c.value) + " " +
            c.unit + ", expected at most " + text(c.limit) + " " + c.unit;
  }
  if (told.empty()) return "";
  return told + ", by the latch; from link to body (" + direction;
}

void check(const Latch& l, const Instant& now, const std::string& event) {
  if (const auto why = beyond(l, now); !why.empty()) throw InvalidArgument(event + ": " + why);
}

}  // namespace

MovingMechanism::MovingMechanism(MechanismBuilder given) : parts(std::move(given)) {
  model = std::make_shared<const MechanicalModel>(std::make_shared<const Mechanism>(parts.build()));
  const std::vector<double> rest(size_t(model->mechanism().nv()), 0.0);
  set(model->mechanism().neutral(), rest);
}

void MovingMechanism::set(std::span<const double> q, std::span<const double> v) {
  phs::State s(model->description(), model->state(q, v));
  s.take_clock(state);
  phs::wrap_angles(model->description(), s);
  state = std::move(s);
}

bool Captured::has(const std::string& body) const {
  return std::any_of(way.begin(), way.end(), [&](const BodySpec& b) { return b.name == body; });
}

Impact capture(MovingMechanism& moving, const Latch& latch) {
  MechanismBuilder next = moving.parts;
  body_of(next, latch.body, "capture");
  body_of(next, latch.link, "capture");
  const auto way = way_to(next, latch.body);
  const BodySpec& root = way.front();
  require_free(root, latch.body);
  if (of_one_tree(next, root.name, latch.link))
    throw InvalidArgument("capture: the link '" + latch.link + "' and '" + latch.body +
                          "' belong to one mechanism, expected another mechanism's link");
  if (way.size() > 1 && root.joint.name == base_joint_name)
    throw InvalidArgument("capture: '" + latch.body +
                          "' is a link of the mechanism with the base, "
                          "expected it as the link, and as the body '" +
                          latch.link + "'");
  const Instant now(*moving.model, moving.state);
  check(latch, now, "capture of '" + latch.body + "' by '" + latch.link + "'");
  turn_round(next, way);
  BodySpec& body = body_of(next, latch.body, "capture");
  body.parent = latch.link;
  body.placement = lowered(inverse(now.pose(latch.link)) * now.pose(latch.body));
  body.joint = {};
  body.joint.name = latch.body + ".latch";
  const Impact impact = change(moving, std::move(next), moving.constraints);
  moving.captured.push_back({way});
  return impact;
}

double margin(const MovingMechanism& moving, const phs::State& state, const Latch& latch) {
  double least = std::numeric_limits<double>::infinity();
  for (const Closing& c : closing(latch, Instant(*moving.model, state)))
    least = std::min(least, c.limit - c.value);
  return least;
}

std::string beyond_limits(const MovingMechanism& moving, const Latch& latch) {
  return beyond(latch, Instant(*moving.model, moving.state));
}

void require_within_limits(const MovingMechanism& moving, const Latch& latch,
                           const std::string& event) {
  check(latch, Instant(*moving.model, moving.state), event);
}

void move_with(MovingMechanism& moving, const std::string& link, const std::string& body,
               const Pose& pose) {
  const BodySpec root = way_to(moving.parts, body).front();
  require_free(root, body);
  const Instant now(*moving.model, moving.state);
  const auto X_LB = Instant::lifted(pose);
  const auto X_RB = inverse(now.pose(root.name)) * now.pose(body);
  const auto X_WR = now.pose(link) * X_LB * inverse(X_RB);
  // What the joints between the root and the body add to the body's twist stays.
  const auto V_RB = now.twist(body) - X_RB.to_child(now.twist(root.name));
  const auto V_R = inverse(X_RB).to_child(X_LB.to_child(now.twist(link)) - V_RB);
  std::vector<double> q(now.q.begin(), now.q.end()), v(now.v.begin(), now.v.end());
  const auto put = [](const auto& a, std::vector<double>& to, int at) {
    for (int k = 0; k < 3; ++k) to[size_t(at + k)] = double(a[k]);
  };
  const auto& attitude = moving.model->mechanism().coordinate(joint_of(root) + ".attitude");
  const auto& position = moving.model->mechanism().coordinate(joint_of(root) + ".position");
  const auto turn = quaternion(X_WR.R);
  q[size_t(attitude.q)] = double(turn.w);
  put(turn.v, q, attitude.q + 1);
  put(X_WR.r, q, position.q);
  put(V_R.w, v, attitude.v);
  put(V_R.v, v, position.v);
  moving.set(q, v);
}

Pose relative_pose(const MovingMechanism& moving, const std::string& link,
                   const std::string& body) {
  const Instant now(*moving.model, moving.state);
  return lowered(inverse(now.pose(link)) * now.pose(body));
}

namespace {
/// The last capture of a body, or the end; refuses one that another link of its mechanism holds.
auto capture_of(MovingMechanism& moving, const std::string& body) {
  auto& all = moving.captured;
  for (auto c = all.end(); c != all.begin();) {
    --c;
    if (!c->has(body)) continue;
    if (c->link() != body)
      throw InvalidArgument("release: '" + body + "' is held by '" + c->link() +
                            "', by which it was captured, expected the release of that link");
    return c;
  }
  return all.end();
}
}  // namespace

Impact release(MovingMechanism& moving, const std::string& name) {
  MechanismBuilder next = moving.parts;
  BodySpec& body = body_of(next, name, "release");
  if (is_free(body)) throw InvalidArgument("release: the body '" + name + "' is free already");
  LockedJoints locked = moving.locked;
  const auto captured = capture_of(moving, name);
  if (captured != moving.captured.end()) {
    turn_back(next, captured->way, Instant(*moving.model, moving.state), locked);
  } else {
    body.parent = "world";
    body.placement = {Mat3<double>::identity(), {0, 0, 0}};
    body.joint = {};
    body.joint.name = name;
    body.joint.type = "free";
    // The joint that held the body no longer exists, so its lock cannot be undone.
    std::erase_if(locked, [&](const auto& lock) { return lock.second.free.name == name; });
  }
  const Impact impact = change(moving, std::move(next), moving.constraints, std::move(locked));
  if (captured != moving.captured.end()) moving.captured.erase(captured);
  return impact;
}

Impact lock(MovingMechanism& moving, const std::string& joint) {
  if (moving.locked.count(joint))
    throw InvalidArgument("lock: the joint '" + joint + "' is locked already");
  MechanismBuilder next = moving.parts;
  BodySpec* body = nullptr;
  std::string known;
  for (auto& b : next.bodies()) {
    if (b.joint.type == "fixed") continue;
    if (joint_of(b) == joint) body = &b;
    add_to_list(known, joint_of(b));
  }
  if (!body)
    throw InvalidArgument("lock: there is no joint '" + joint + "' that moves, expected one of " +
                          known);
  for (const Driven& d : moving.constraints.driven)
    if (moving.model->mechanism().coordinate(d.coordinate).joint == joint)
      throw InvalidArgument("lock: the motion '" + d.name + "' drives joint '" + joint +
                            "', expected a joint without one");
  const Instant now(*moving.model, moving.state);
  LockedJoint kept{*body, {}, {}, {}};
  size_t turn = 0;
  const auto& blocks = moving.model->description().blocks;
  const auto& coordinates = moving.model->mechanism().coordinates();
  for (size_t i = 0; i < coordinates.size(); ++i) {
    const bool angle = blocks[i].kind == phs::BlockKind::angle;
    if (coordinates[i].joint == joint) {
      for (int k = 0; k < blocks[i].size; ++k) {
        kept.q.push_back(moving.state.x[size_t(blocks[i].at + k)]);
        kept.lo.push_back(moving.state.lo[size_t(blocks[i].at + k)]);
      }
      if (angle) kept.turns.push_back(moving.state.turns[turn]);
      if (blocks[i].size == 1) kept.values[coordinates[i].name] = now.q[size_t(coordinates[i].q)];
    }
    if (angle) ++turn;
  }
  const auto parent = body->parent == "world"
                          ? Instant::lifted({Mat3<double>::identity(), {0, 0, 0}})
                          : now.pose(body->parent);
  body->placement = lowered(inverse(parent) * now.pose(body->name));
  const std::string name = joint_of(*body);
  body->joint = {};
  body->joint.name = name;
  LockedJoints locked = moving.locked;
  locked.emplace(joint, std::move(kept));
  return change(moving, std::move(next), moving.constraints, std::move(locked));
}

Impact unlock(MovingMechanism& moving, const std::string& joint) {
  const auto kept = moving.locked.find(joint);
  if (kept == moving.locked.end()) {
    std::string known;
    for (const auto& [name, l] : moving.locked) add_to_list(known, name);
    throw InvalidArgument("unlock: the joint '" + joint +
                          "' is not locked (the release of a body ends the lock of its joint), "
                          "expected one of " +
                          (known.empty() ? "(none)" : known));
  }
  const std::string& owner = kept->second.free.name;
  for (const Captured& c : moving.captured)
    if (std::any_of(c.way.begin(), c.way.end(), [&](const BodySpec& b) {
          return b.name == owner && b.joint.type == "fixed" && joint_of(b) == joint;
        }))
      throw InvalidArgument("unlock: the joint '" + joint + "' was locked before the capture of '" +
                            c.link() +
                            "' turned it round, expected its unlocking before the "
                            "capture or after the release");
  MechanismBuilder next = moving.parts;
  BodySpec& body = body_of(next, owner, "unlock");
  body.joint = kept->second.free.joint;
  body.placement = kept->second.free.placement;
  LockedJoints locked = moving.locked;
  locked.erase(joint);
  return change(moving, std::move(next), moving.constraints, std::move(locked));
}

}  // namespace porthos::mechanics
