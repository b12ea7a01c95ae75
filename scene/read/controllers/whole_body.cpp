#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "mechanics/urdf.h"
#include "phs/functions/tank.h"
#include "planning/whole_body_law.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/controllers/gait.h"
#include "scene/read/controllers/held_law.h"
#include "scene/read/controllers/support.h"
#include "scene/read/scene.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

using planning::SteeredTask;
using TaskKind = SteeredTask::Kind;

/// A task, before the mechanism is known.
struct WantedTask {
  SteeredTask task;
  std::string where;
  std::optional<Vec3d> target = {};
  std::vector<std::array<double, 5>> moves = {};  ///< at, duration, x, y, z
  std::optional<std::array<double, 4>> attitude = {};
  std::map<std::string, double> joints = {};
};
struct WantedLimit {
  std::optional<double> torque = {}, rate = {}, lower = {}, upper = {};
};
struct WholeBodyScene {
  std::vector<std::string> contacts;
  std::map<std::string, std::vector<std::array<double, 2>>> lifted;
  std::optional<double> friction, holding;
  int edges = 4;
  double lifted_every = 0;
  std::optional<planning::GaitDesign> gait;
  std::string gait_where;
  std::map<std::string, WantedLimit> limits;
  std::vector<WantedTask> tasks;
};

/// Coordinates as [initial] states them, with the base's.
std::vector<double> start_with_base(const ControllerPlant& plant) {
  auto q = stated_start(plant);
  if (plant.scene.urdf.base != mechanics::UrdfOptions::Base::free) return q;
  const auto& m = plant.model->mechanism();
  const std::string base = mechanics::base_joint_name;
  const BaseStart& b = plant.scene.base;
  std::copy_n(b.attitude_wxyz, 4, q.begin() + m.coordinate(base + ".attitude").q);
  for (int k = 0; k < 3; ++k) q[size_t(m.coordinate(base + ".position").q + k)] = b.position[k];
  return q;
}

/// A limit of every joint with a motor: that of the scene, or that of the model file.
std::vector<planning::JointLimit> limits_of(const Controller& c, const ControllerPlant& plant,
                                            const WholeBodyScene& w) {
  const auto& m = plant.model->mechanism();
  std::vector<planning::JointLimit> all;
  for (const auto& j : m.joint_properties()) {
    planning::JointLimit l;
    l.joint = j.joint;
    if (j.effort.value_or(0) > 0) l.torque = *j.effort;  // files that do not know it have 0
    if (j.rate.value_or(0) > 0) l.rate = *j.rate;
    l.lower = j.lower.value_or(l.lower);
    l.upper = j.upper.value_or(l.upper);
    all.push_back(l);
  }
  for (const auto& [joint, wanted] : w.limits) {
    (void)controlled_joint(*plant.model, c, joint);
    auto l = std::ranges::find(all, joint, &planning::JointLimit::joint);
    if (l == all.end()) l = all.insert(all.end(), {.joint = joint});
    l->torque = wanted.torque.value_or(l->torque);
    l->rate = wanted.rate.value_or(l->rate);
    l->lower = wanted.lower.value_or(l->lower);
    l->upper = wanted.upper.value_or(l->upper);
  }
  return all;
}

/// Targets that are not stated are those of the start.
SteeredTask task_of(const Controller& c, const ControllerPlant& plant, const WantedTask& w,
                    std::span<const double> start) {
  SteeredTask task = w.task;
  const auto& m = plant.model->mechanism();
  mechanics::Workspace<double> work(m);
  if (task.kind == TaskKind::swing) return task;
  if (task.kind == TaskKind::posture) {
    for (const auto& [joint, target] : w.joints) (void)controlled_joint(*plant.model, c, joint);
    for (const auto& k : m.coordinates()) {
      if (k.nq != 1) continue;
      const auto own = w.joints.find(k.name);
      task.joints.push_back({k.q, k.v, own == w.joints.end() ? start[size_t(k.q)] : own->second});
    }
    return task;
  }
  Vec3d from = mechanics::centre_of_mass<double>(m, work, start);
  if (!task.link.empty()) {
    std::vector<mechanics::Transform<double>> poses(m.nodes().size());
    mechanics::forward_kinematics<double>(m, work, start, poses);
    const auto X = mechanics::body_pose<double>(m, m.body(task.link), poses);
    from = X.R * task.at + X.r;
    const auto xi = w.attitude ? *w.attitude : mechanics::quaternion_of(X.R);
    task.attitude = mechanics::Quaternion<double>::load(xi.data());
  }
  from = w.target.value_or(from);
  for (int k = 0; k < 3; ++k) {
    std::vector<phs::Move> moves;
    for (const auto& r : w.moves) moves.push_back({r[0], r[1], r[size_t(2 + k)]});
    const std::string what = "task '" + task.name + "'";
    task.target[size_t(k)] = moves.empty() ? phs::steady_motion(from[k], 0, what.c_str())
                                           : phs::moves_from(from[k], moves, what.c_str());
  }
  return task;
}

ControllerDesign design_whole_body(const Controller& c, const ControllerPlant& plant,
                                   const WholeBodyScene& w) {
  const auto& m = plant.model->mechanism();
  const auto start = start_with_base(plant);
  planning::WholeBodyDesign d;
  d.name = fmt::format("controller '{}'", c.name);
  d.period = 1 / c.rate;
  d.lifted_every = w.lifted_every;
  if (c.tank) d.reserve = phs::tank_reserve(c.tank->bounds.least, c.tank->bounds.most);
  d.holding = w.holding.value_or(0.1 * c.rate);
  for (const std::string& name : w.contacts) {
    auto s = support_of(plant.scene, m, start, c.where, name);
    for (auto& p : s.points) {
      p.friction = w.friction.value_or(p.friction);
      p.edges = w.edges;
    }
    if (const auto lifted = w.lifted.find(name); lifted != w.lifted.end())
      s.lifted = lifted->second;
    d.supports.push_back(std::move(s));
  }
  if (w.gait) at_line(w.gait_where, [&] { d.gait = gait_of(m, *w.gait, d.supports, start); });
  d.limits = limits_of(c, plant, w);
  for (const WantedTask& task : w.tasks)
    at_line(task.where, [&] { d.tasks.push_back(task_of(c, plant, task, start)); });
  const auto law = std::make_shared<const planning::WholeBodyLaw>(plant.model, std::move(d));
  ControllerDesign made{{}, energy_shaping::Certificate(fmt::format("whole body '{}'", c.name))};
  made.ports = law->motors();
  if (made.ports.empty())
    throw InvalidArgument(fmt::format(
        "controller '{}' has no joint with a motor, expected one of one degree of freedom",
        c.name));
  made.sampled = law;
  hold_not_checked(made.certificate, c,
                   "torques of a program with limits have no slopes where one begins to act");
  return made;
}

WantedTask read_task(const std::string& quantity, const Table& t) {
  WantedTask w;
  w.where = t.where();
  SteeredTask& task = w.task;
  static const std::map<std::string, TaskKind> kinds{
      {"centre_of_mass", TaskKind::centre_of_mass},
      {"position", TaskKind::position},
      {"attitude", TaskKind::attitude},
      {"posture", TaskKind::posture},
      {"angular_momentum", TaskKind::angular_momentum},
      {"swing", TaskKind::swing}};
  task.kind = kinds.at(quantity);
  task.name = t.has("name") ? t.text("name", "a name") : quantity;
  t.require("bandwidth", "how fast an error goes, in rad/s");
  task.bandwidth = t.positive("bandwidth");
  if (task.kind == TaskKind::position || task.kind == TaskKind::attitude)
    task.link = t.text("link", "the name of a link");
  if (task.kind == TaskKind::posture) {
    t.each("joints", [&](const std::string& joint, const std::string&, const Table& own) {
      own.require("target", "a number");
      w.joints[joint] = own.number("target");
    });
  } else if (task.kind != TaskKind::swing) {
    const std::string axes = t.choice("axes");
    for (size_t k = 0; k < 3; ++k) task.axes[k] = axes.find("xyz"[k]) != axes.npos;
  }
  if (task.kind != TaskKind::angular_momentum) task.damping_ratio = t.positive("damping_ratio");
  if (task.kind == TaskKind::attitude && t.has("attitude_wxyz"))
    w.attitude = read_attitude(t, "attitude_wxyz");
  if (task.kind == TaskKind::centre_of_mass || task.kind == TaskKind::position) {
    if (t.has("target")) w.target = t.vector("target");
    if (t.has("moves")) w.moves = t.rows<5>("moves");
  }
  if (task.kind == TaskKind::position) task.at = t.vector("at");
  return w;
}

void read_whole_body(const Table& t, Controller& c) {
  WholeBodyScene w;
  if (t.has("contacts")) w.contacts = t.texts("contacts", "names of [[contact]]s");
  for (size_t i = 0; i < w.contacts.size(); ++i)
    if (std::count(w.contacts.begin(), w.contacts.end(), w.contacts[i]) > 1)
      t.fail("contacts", fmt::format("names \"{}\" twice, expected each once", w.contacts[i]));
  if (t.has("friction")) w.friction = t.positive("friction");
  if (t.has("holding")) w.holding = t.not_negative("holding");
  const auto edges = t.whole("edges");
  if (edges < 3 || edges > 64) t.fail("edges", fmt::format("is {}, expected 3 to 64", edges));
  w.edges = int(edges);
  if (t.has("lifted_every")) w.lifted_every = t.positive("lifted_every");
  if (t.has("gait")) {
    const Table own = t.table("gait");
    w.gait = read_gait(own, w.contacts.size());
    w.gait_where = own.where();
  }
  t.each("lifted", [&](const std::string& name, const std::string& where, const Table& own) {
    if (std::ranges::find(w.contacts, name) == w.contacts.end())
      refuse(where, fmt::format("'{}' is lifted, expected one of contacts", name));
    own.require("when", "rows of two times");
    w.lifted[name] = own.rows<2>("when");
    for (const auto& [from, until] : w.lifted[name])
      if (!(from < until)) own.fail("when", "has a row that ends before it begins");
  });
  t.each("limits", [&](const std::string& joint, const std::string& where, const Table& own) {
    WantedLimit l;
    if (own.has("torque")) l.torque = own.not_negative("torque");
    if (own.has("rate")) l.rate = own.positive("rate");
    if (own.has("lower")) l.lower = own.number("lower");
    if (own.has("upper")) l.upper = own.number("upper");
    if (l.lower && l.upper && *l.lower > *l.upper)
      refuse(where, fmt::format("the lower limit of '{}' is above the upper one", joint));
    w.limits[joint] = l;
  });
  t.require("task", "tables [[controller.task]], the most important first");
  t.each_of("task", "quantity", [&](const std::string& quantity, const Table& own) {
    auto task = read_task(quantity, own);
    if (quantity == "swing" && !w.gait)
      own.fail("quantity", "is \"swing\" without a gait, expected a table [controller.gait]");
    if (w.gait && task.task.kind == TaskKind::centre_of_mass &&
        (task.target || !task.moves.empty()))
      for (const size_t k : {0, 1})
        if (task.task.axes[k])
          own.fail(task.target ? "target" : "moves",
                   "is along x or y, where a gait moves the centre of mass, expected axes = \"z\"");
    for (const auto& other : w.tasks)
      if (other.task.name == task.task.name)
        own.fail("name", fmt::format("\"{}\" is that of another task, expected one of its own",
                                     task.task.name));
    w.tasks.push_back(std::move(task));
  });
  if (w.gait && std::ranges::none_of(w.tasks, [](const WantedTask& own) {
        return own.task.kind == TaskKind::swing;
      }))
    t.fail("task", "has none of quantity \"swing\", which moves the feet of a gait, expected one");
  c.design = made_of(design_whole_body, w);
}

const char* task_id = "controller.whole_body.task";

/// The table of one kind of task.
SchemaTable task_table(const char* quantity, const char* what, const keys::Keys& own,
                       const char* bandwidth, bool has_axes = true, bool damped = true) {
  using namespace keys;
  Keys all{word("quantity", {quantity}, required, "what is steered"),
           text("name", "the quantity", "in outputs and notes"),
           number("bandwidth", "rad/s", required, bandwidth)};
  if (damped) all.push_back(number("damping_ratio", "1", "1", "ζ"));
  if (has_axes)
    all.push_back(word("axes", {"xyz", "x", "y", "z", "xy", "xz", "yz"}, "\"xyz\"",
                       "of the world, that are steered"));
  return {fmt::format("{}.{}", task_id, quantity),
          fmt::format("[[controller.task]] quantity = \"{}\"", quantity), what, joined(all, own)};
}

std::vector<SchemaTable> whole_body_tables() {
  using namespace keys;
  const char* omega = "ω of x'' = ω² (wanted - x) - 2 ζ ω x'";
  const Keys target{
      numbers("target", 3, "m", "the start", "in the world"),
      rows("moves", 5, "", "none", "[at, duration, x, y, z] in s and m: moves from rest to rest")};
  const auto link = text("link", required, "of the model, or a [[body]]");
  return {
      {"controller.whole_body.limit",
       "[controller.limits]",
       "Limits of a joint; those not stated are the model file's, if it states them.",
       {number("torque", "N m (N)", "the file's effort", "0: no motor"),
        number("rate", "rad/s (m/s)", "the file's velocity", "at the next instant"),
        number("lower", "rad (m)", "the file's", "at the next instant"),
        number("upper", "rad (m)", "the file's", "at the next instant")}},
      {"controller.whole_body.lift",
       "[controller.lifted]",
       "When a contact is not used.",
       {rows("when", 2, "s", required, "[from, until], of each lifted_every")}},
      gait_table(),
      {"controller.whole_body.joint",
       "[controller.task.joints]",
       "Where a posture has a joint.",
       {number("target", "rad (m)", required, "")}},
      task_table("centre_of_mass", "Of all moving bodies.", target, omega),
      task_table(
          "position", "Of a point of a link.",
          joined({link, numbers("at", 3, "m", "[0, 0, 0]", "the point, in its frame")}, target),
          omega),
      task_table("attitude", "Of a link.",
                 {link, numbers("attitude_wxyz", 4, "1", "the start", "link to world; normalised")},
                 omega),
      task_table("swing",
                 "Of the feet of a gait that do not stand, on their way; soles stay level.", {},
                 omega, false),
      task_table("angular_momentum", "About the centre of mass, towards 0.", {}, "ω of k' = -ω k",
                 true, false),
      task_table("posture", "Of every joint of one degree of freedom.",
                 {table("joints", "controller.whole_body.joint", "the start",
                        "by joint: other targets", KeyKind::named)},
                 omega, false)};
}

}  // namespace

ControllerType whole_body_controller() {
  using namespace keys;
  return {
      "whole_body",
      "The torques of all joints do several tasks in order of importance, within friction cones "
      "and limits.",
      {{"contacts", KeyKind::texts, "", "none", "names of rigid [[contact]]s with flat ground"},
       number("friction", "1", "that of each contact", "which the forces may use"),
       number("holding", "rad/s", "0.1 rate",
              "ω of contacts that slip or tilt: they accelerate by -2 ω v - ω² gap"),
       whole("edges", "4", "of the pyramid in the friction cone, 3 to 64"),
       table("lifted", "controller.whole_body.lift", "never", "by contact: when it is not used",
             KeyKind::named),
       number("lifted_every", "s", "none", "the period of lifted"),
       table("gait", "controller.whole_body.gait", "none",
             "steps: the centre of mass then moves horizontally as they need"),
       table("limits", "controller.whole_body.limit", "the model file's",
             "by joint: torque, rate, position", KeyKind::named),
       table("task", task_id, required, "the most important first", KeyKind::tables)},
      whole_body_tables(),
      read_whole_body,
      true};
}

}  // namespace porthos::scene
