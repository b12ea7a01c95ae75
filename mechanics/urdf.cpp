#include "mechanics/urdf.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <set>
#include <string_view>
#include <system_error>

#include "mechanics/joint_list.h"
#include "mechanics/kinematics.h"
#include "mechanics/urdf_file-inl.h"

namespace porthos::mechanics {
namespace {

using urdf::File;
using urdf::Joint;
using urdf::Link;
using urdf::Log;
using urdf::named;

/// File -> tree of bodies -> Mechanism.
class Assembler {
 public:
  Assembler(File file, Log& log, const UrdfOptions& options)
      : m_(std::move(file)), log_(log), options_(options) {}

  UrdfResult run() {
    lock();
    index_links();
    index_joints();
    const auto roots = find_roots();
    const auto order = depth_first(roots);
    settle_masses(order);
    const MechanismBuilder made = parts(order);
    return {build(made), log_.notes(), m_.links[roots.front()].name, made, std::move(m_.mimics)};
  }

 private:
  /// Fixes the locked joints at their start positions.
  void lock() {
    std::set<std::string> coordinates;
    for (const std::string& name : options_.locked) {
      const auto j = std::find_if(m_.joints.begin(), m_.joints.end(),
                                  [&](const Joint& k) { return k.spec.name == name; });
      if (j == m_.joints.end()) log_.fail("lock: " + named(name) + " is not a joint of this file");
      if (freedoms(j->spec.type) == 0)
        fail(*j, "is to be locked but cannot move, expected a joint that is not fixed");
      j->placement = held(*j, coordinates);
      j->spec = {};
      j->spec.name = name;
    }
    lock_mimics();
    for (const auto& [name, values] : options_.locked_at)
      if (!coordinates.count(name) && !is_joint(name))
        log_.fail("lock: " + named(name) + " is not a coordinate of a locked joint");
  }
  /// The value of a locked joint is a constant of its <mimic>: what is left holds the other joint.
  void lock_mimics() {
    for (Coupling& c : m_.mimics)
      std::erase_if(c.terms, [&](const Coupling::Term& t) {
        const auto& all = options_.locked;
        if (std::find(all.begin(), all.end(), t.coordinate) == all.end()) return false;
        if (const auto at = options_.locked_at.find(t.coordinate); at != options_.locked_at.end())
          c.offset -= t.factor * at->second.at(0);
        return true;
      });
    std::erase_if(m_.mimics, [](const Coupling& c) { return c.terms.empty(); });
  }
  bool is_joint(const std::string& name) const {
    return std::any_of(m_.joints.begin(), m_.joints.end(),
                       [&](const Joint& j) { return j.spec.name == name; });
  }
  /// The pose at which a locked joint holds its link, computed from a mechanism of that joint
  /// alone.
  Pose held(const Joint& j, std::set<std::string>& coordinates) const {
    BodySpec b;
    b.name = "body";
    b.parent = "world";
    b.placement = j.placement;
    b.joint.name = j.spec.name;
    b.joint.type = j.spec.type;
    b.joint.axis = j.spec.axis;
    b.joint.second_axis = j.spec.second_axis;
    b.joint.pitch = j.spec.pitch;
    b.mass.mass = 1;
    b.mass.inertia = {1, 0, 0, 1, 0, 1};
    b.where = log_.at(j.line);
    const Mechanism m = MechanismBuilder().add(b).build();
    std::vector<double> q = m.neutral();
    bool moved = false;
    for (const auto& c : m.coordinates()) {
      coordinates.insert(c.name);
      coordinates.insert(c.joint);
      auto given = options_.locked_at.find(c.name);
      if (given == options_.locked_at.end() && c.kind == phs::BlockKind::rotation)
        given = options_.locked_at.find(c.joint);
      if (given == options_.locked_at.end()) continue;
      require_size(c.name.c_str(), given->second.size(), std::size_t(c.nq));
      std::copy(given->second.begin(), given->second.end(), q.begin() + c.q);
      moved = true;
    }
    if (!moved) return j.placement;
    Workspace<double> w(m);
    std::vector<Pose> pose(m.nodes().size());
    forward_kinematics<double>(m, w, q, pose);
    return body_pose<double>(m, m.body("body"), pose);
  }

  void index_links() {
    for (std::size_t i = 0; i < m_.links.size(); ++i) {
      const Link& l = m_.links[i];
      const auto [first, fresh] = by_name_.emplace(l.name, i);
      if (!fresh) twice("link " + named(l.name), l.line, m_.links[first->second].line);
    }
    for (const auto& [name, mass] : options_.link_inertia) check_given(name);
  }
  void index_joints() {
    for (const Joint& j : m_.joints) {
      const auto [first, fresh] = joint_lines_.emplace(j.spec.name, j.line);
      if (!fresh) twice("joint " + named(j.spec.name), j.line, first->second);
      if (free_base_ && j.spec.name == base_joint_name)
        fail(j, "the joint of the free base has this name, expected another");
      const std::size_t parent = end(j, "parent", j.parent), child = end(j, "child", j.child);
      if (const Joint* other = carrier_[child])
        fail(j, "its child " + named(j.child) + " already hangs on joint " +
                    named(other->spec.name) + " (line " + std::to_string(other->line) +
                    "), expected one parent per link");
      carrier_[child] = &j;
      children_[parent].push_back(child);
    }
    for (const auto& [name, inertia] : options_.rotor_inertia)
      if (!joint_lines_.count(name))
        log_.fail("rotor inertia: " + named(name) + " is not a joint of this file");
  }
  std::size_t end(const Joint& j, const char* what, const std::string& name) const {
    const auto l = by_name_.find(name);
    if (l == by_name_.end())
      fail(j, "its " + std::string(what) + " " + named(name) + " is not a link of this file");
    return l->second;
  }
  void check_given(const std::string& name) const {
    const std::string key = "[model.inertia." + name + "]";
    const auto l = by_name_.find(name);
    if (l == by_name_.end()) log_.fail(key + ": " + named(name) + " is not a link of this file");
    const Link& given = m_.links[l->second];
    if (given.mass && given.mass->mass > 0 && !options_.replaced_inertia.count(name))
      fail(given, "has an <inertial>, expected no " + key + " besides");
  }

  /// Refuses a duplicate name: `what` at `line`, first used at the line `first`.
  [[noreturn]] void twice(const std::string& what, int line, int first) const {
    log_.fail(line, what + " stands in line " + std::to_string(first) +
                        " already, expected another name");
  }
  [[noreturn]] void fail(const Link& l, const std::string& text) const {
    log_.fail(l.line, "link " + named(l.name) + " " + text);
  }
  [[noreturn]] void fail(const Joint& j, const std::string& text) const {
    log_.fail(j.line, "joint " + named(j.spec.name) + ": " + text);
  }
  std::size_t parent(std::size_t i) const { return by_name_.at(carrier_[i]->parent); }

  /// The root, and behind it the inertial frame if other trees hang on that (robots beside it).
  std::vector<std::size_t> find_roots() {
    std::vector<std::size_t> roots;
    for (std::size_t i = 0; i < m_.links.size(); ++i)
      if (!carrier_[i]) roots.push_back(i);
    if (roots.empty()) refuse_cycle(0);
    std::stable_partition(roots.begin(), roots.end(),
                          [&](std::size_t i) { return m_.links[i].name != "world"; });
    beside_world_ = roots.size() == 2 && m_.links[roots[1]].name == "world";
    if (roots.size() > 1 && !beside_world_)
      fail(m_.links[roots[1]], "and link " + named(m_.links[roots[0]].name) +
                                   " are no joint's child, expected one root link");
    return roots;
  }
  /// Whether a root floats on a free base.
  bool floats(std::size_t root) const {
    return free_base_ && !(beside_world_ && m_.links[root].name == "world");
  }
  /// Refuses link `i`, which has no path to a root.
  [[noreturn]] std::size_t refuse_cycle(std::size_t i) const {
    std::set<std::size_t> seen;
    while (seen.insert(i).second) i = parent(i);  // ends on the cycle itself
    const Joint& j = *carrier_[i];
    std::string path = named(m_.links[i].name);
    for (std::size_t k = parent(i);; k = parent(k)) {
      path += " on " + named(m_.links[k].name);
      if (k == i) fail(j, "is part of a cycle (" + path + "), expected a tree with one root link");
    }
  }

  /// Children in the file order of their joints.
  std::vector<std::size_t> depth_first(const std::vector<std::size_t>& roots) const {
    std::vector<std::size_t> order, stack(roots.rbegin(), roots.rend());
    std::vector<bool> reached(m_.links.size());
    while (!stack.empty()) {
      const std::size_t i = stack.back();
      stack.pop_back();
      order.push_back(i);
      reached[i] = true;
      stack.insert(stack.end(), children_[i].rbegin(), children_[i].rend());
    }
    for (std::size_t i = 0; i < reached.size(); ++i)
      if (!reached[i]) refuse_cycle(i);
    return order;
  }

  /// Gives every link its mass properties. A link that never moves needs none. A link that fixed
  /// joints tie to a link with mass is a frame.
  void settle_masses(const std::vector<std::size_t>& order) {
    std::vector<bool> moves(m_.links.size()), has_mass(m_.links.size());
    std::vector<std::size_t> lacking,
        whole(m_.links.size());  // whole: the first link of its rigid body
    for (const std::size_t i : order) {
      const Joint* j = carrier_[i];
      const bool jointed = j && freedoms(j->spec.type) > 0;
      moves[i] = j ? moves[parent(i)] || jointed : floats(i);
      whole[i] = j && !jointed ? whole[parent(i)] : i;
      const auto given = options_.link_inertia.find(m_.links[i].name);
      if (given != options_.link_inertia.end())
        masses_[i] = given->second;
      else if (m_.links[i].mass)
        masses_[i] = *m_.links[i].mass;
      else if (moves[i])
        lacking.push_back(i);
      if (masses_[i].mass > 0) has_mass[whole[i]] = true;
    }
    std::vector<std::size_t> frames, missing;
    for (const std::size_t i : lacking) (has_mass[whole[i]] ? frames : missing).push_back(i);
    if (!frames.empty())
      log_.note(m_.links[frames[0]].line,
                "links without <inertial> on fixed joints, taken as frames: " + listed(frames));
    if (!missing.empty()) settle_missing(missing, whole[missing[0]]);
  }
  std::string listed(const std::vector<std::size_t>& links) const {
    std::string names;
    for (const std::size_t i : links) add_to_list(names, named(m_.links[i].name));
    return names;
  }
  void settle_missing(const std::vector<std::size_t>& missing, std::size_t whole) {
    const Link& first = m_.links[missing[0]];
    if (options_.links_without_inertia == UrdfOptions::NoInertia::massless)
      return log_.note(first.line,
                       "links without <inertial>, taken as massless: " + listed(missing));
    const std::string joint = carrier_[whole] ? carrier_[whole]->spec.name : "";
    std::vector<std::string> links;
    for (const std::size_t i : missing) links.push_back(m_.links[i].name);
    throw MasslessPart(
        log_.at(first.line) + ": link " + named(first.name) + " has no <inertial> and " +
            (joint.empty() ? "floats, expected mass properties"
                           : "moves on joint " + named(joint) +
                                 ", expected mass properties or the joint locked") +
            (missing.size() > 1 ? " (the same holds for all of " + listed(missing) + ")" : ""),
        joint, std::move(links));
  }

  MechanismBuilder parts(const std::vector<std::size_t>& order) const {
    MechanismBuilder builder(m_.name);
    builder.gravity(options_.gravity);
    builder.accept_unphysical_inertia(options_.accept_unphysical_inertia);
    for (const std::size_t i : order)
      if (carrier_[i] || !is_world(m_.links[i])) builder.add(body(i));
    return builder;
  }
  Mechanism build(const MechanismBuilder& builder) const {
    try {
      return builder.build();
    } catch (const MasslessPart& e) {
      throw MasslessPart(log_.file() + ": " + e.what(), e.joint, e.links);
    } catch (const InvalidArgument& e) {  // faults of the whole have no line, but a file
      if (std::string_view(e.what()).starts_with(log_.file() + ":")) throw;
      log_.fail(e.what());
    }
  }
  BodySpec body(std::size_t i) const {
    BodySpec b;
    b.name = m_.links[i].name;
    b.mass = masses_[i];
    b.where = log_.at(m_.links[i].line);
    if (const Joint* j = carrier_[i]) {
      b.parent = j->parent;
      b.joint = j->spec;
      b.placement = j->placement;
    } else {
      b.parent = "world";
      b.joint.type = free_base_ ? "free" : "fixed";
      b.joint.name = free_base_ ? base_joint_name : "root";
      while (joint_lines_.count(b.joint.name)) b.joint.name += "_";
    }
    return b;
  }
  /// On a fixed base, a root link named "world" is the inertial frame itself, as in many files.
  bool is_world(const Link& root) const {
    if (root.name != "world") return false;
    if (free_base_ && !beside_world_)
      fail(root, "is the inertial frame, expected another name for the root of a free base");
    return true;
  }

  File m_;
  Log& log_;
  const UrdfOptions& options_;
  const bool free_base_ = options_.base == UrdfOptions::Base::free;
  bool beside_world_ = false;  ///< the root is not the inertial frame, on which other trees hang
  const std::size_t n_ = m_.links.size();
  std::map<std::string, std::size_t> by_name_;
  std::map<std::string, int> joint_lines_;
  // per link:
  std::vector<const Joint*> carrier_ = std::vector<const Joint*>(n_);  ///< the joint it hangs on
  std::vector<std::vector<std::size_t>> children_ = std::vector<std::vector<std::size_t>>(n_);
  std::vector<MassProperties> masses_ = std::vector<MassProperties>(n_);
};
}  // namespace

UrdfResult parse_urdf(const std::string& text, const std::string& name,
                      const UrdfOptions& options) {
  Log log(name);
  return Assembler(urdf::read_file(log, text, options), log, options).run();
}

UrdfResult read_urdf(const std::string& path, const UrdfOptions& options) {
  const auto refuse = [&](const std::string& why) {
    throw_unreadable("URDF file " + named(path) + " cannot be opened: " + why, errno);
  };
  std::error_code ignored;
  errno = 0;
  if (std::filesystem::is_directory(path, ignored)) refuse("it is a directory");
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse(std::generic_category().message(errno));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) refuse("it cannot be read");
  return parse_urdf(text, path, options);
}

}  // namespace porthos::mechanics
