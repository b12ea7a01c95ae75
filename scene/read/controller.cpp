#include "scene/read/controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>

#include "mechanics/mechanical_model.h"
#include "scene/files/files.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/scene.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// A law that sees the mechanism's state without what parts of the scene add to it.
phs::LawPtr of_mechanism(phs::LawPtr law, size_t nx) {
  return phs::law(
      [law = std::move(law), nx](auto t, auto x, auto y, auto u) { (*law)(t, x.first(nx), y, u); });
}

/// A law with a memory, or laws of ports behind sensors.
void add_sampled(phs::Network& n, const Controller& c, ControllerDesign made,
                 const std::shared_ptr<const mechanics::MechanicalModel>& model,
                 std::uint64_t of_case) {
  auto law = std::move(made.sampled);
  const bool of_ports = !law;
  size_t numbers = made.ports.size();
  if (of_ports) {
    for (const auto& l : made.laws) {
      made.ports.push_back(l.port);
      const auto& ports = model->description().ports;
      numbers += size_t(find_named(ports, l.port, "there is no port").size);
    }
    for (const auto& k : model->mechanism().coordinates()) {
      const bool attitude = k.kind == phs::BlockKind::rotation;
      if (k.nv == 1 || attitude)
        made.joints.push_back({k.name, size_t(k.q), size_t(k.v), attitude});
    }
    law = sampled_port_laws(std::move(made.laws), model);
  }
  if (c.sensing.measures_attitude() &&
      std::ranges::none_of(made.joints, [](const auto& j) { return j.attitude; }))
    throw InvalidArgument("controller '" + c.name +
                          "' has noise of an attitude and measures none, expected a law that sees "
                          "the base or a ball joint");
  if (c.sensing.any())
    law = sensed(std::move(law), c.sensing, 1 / c.rate, numbers, std::move(made.joints),
                 {c.name, of_case}, model, of_ports);
  for (auto& port : made.ports) port = "mechanism." + port;
  n.control(c.name, made.ports, std::move(law), 1 / c.rate, c.tank_name());
}

/// The part of a law that a tank pays for.
void add_paid(phs::Network& n, const Controller& c, ControllerDesign::Paid paid, size_t nx) {
  for (auto& l : paid.laws) l.law = of_mechanism(std::move(l.law), nx);
  phs::Network::Control how{.tank = c.tank_name()};
  if (c.rate > 0) how.period = 1 / c.rate;
  energy_shaping::control(n, c.name + ".projection", "mechanism", paid.laws, how);
  for (auto& port : paid.damped) port = "mechanism." + port;
  n.fill(c.name + ".damping", paid.damped, paid.damping, paid.fill, c.tank_name());
}

LawFile read_law_file(const Table& t, const char* key, const std::string& folder) {
  LawFile f;
  f.name = t.text(key, "the name of a file");
  // "law.py:Law" names a class in the file.
  const size_t colon = f.name.rfind(".py:");
  const std::string file = colon == f.name.npos ? f.name : f.name.substr(0, colon + 3);
  f.path = std::filesystem::absolute(std::filesystem::path(folder) / file).string();
  f.loaded = !t.of_results();
  if (f.loaded) at_line(t.at(key), [&] { f.text = read_file(f.path); });
  return f;
}

/// A controller hands over to one other, at common sampling instants.
void check_takeover(const Controller& c, const std::vector<Controller>& all) {
  if (!c.then) return;
  const auto other =
      std::find_if(all.begin(), all.end(), [&](const auto& k) { return k.name == c.then->by; });
  if (other == all.end() || other->name == c.name)
    refuse(c.where, fmt::format("controller '{}' hands over to '{}', expected another controller "
                                "of this scene",
                                c.name, c.then->by));
  if (c.rate == 0 || c.rate != other->rate)
    refuse(c.where,
           fmt::format("controller '{}' hands over to '{}' and their rates are {:g} Hz and {:g} Hz "
                       "(0: continuous), expected one rate of both: the laws change at a sampling "
                       "instant",
                       c.name, other->name, c.rate, other->rate));
  if (other->then)
    refuse(c.where, fmt::format("controller '{}' hands over to '{}', which hands over itself, "
                                "expected two laws",
                                c.name, other->name));
  if (std::count_if(all.begin(), all.end(),
                    [&](const auto& k) { return k.then && k.then->by == other->name; }) > 1)
    refuse(c.where,
           fmt::format("controller '{}' takes over from several, expected one", other->name));
}

/// The gate of each controller that hands over or takes over, by name.
std::map<std::string, phs::GatePtr> gates_of(const std::vector<Controller>& all,
                                             std::vector<ControllerDesign>& designs) {
  std::map<std::string, phs::GatePtr> gates;
  for (const Controller& c : all) {
    if (!c.then) continue;
    const auto [by, level, leave] = *c.then;
    const auto other = std::find_if(all.begin(), all.end(),
                                    [&, &name = by](const auto& k) { return k.name == name; });
    auto holds = designs[size_t(other - all.begin())].holds;
    if (!holds)
      refuse(c.where,
             fmt::format("controller '{}' hands over to '{}', and no level set is known in which "
                         "that one of type \"{}\" holds, expected one of type \"lqr\" whose "
                         "weights see every joint",
                         c.name, by, other->type));
    if (level && *level > holds->level) {
      const int lost = holds->lost(*level);
      if (lost > energy_shaping::LevelSet::most_lost)
        refuse(c.where,
               fmt::format("level of controller '{}' is {:g}, expected less: up to {:.6g} '{}' is "
                           "known to hold, and of 100 runs from {:g} it loses {}",
                           c.name, *level, holds->level, by, *level, lost));
      designs[size_t(other - all.begin())].certificate.report(
          "takes over up to", *level,
          fmt::format("of 100 runs from this level of V, by the sampled law, {} do not come back "
                      "below {:.6g}: what is "
                      "lost is swung up again",
                      lost, holds->level));
    }
    if (level) holds->level = *level;
    at_line(c.where, [&, &name = by, &factor = leave] {
      const energy_shaping::Handover handover(c.name, name, *holds, factor,
                                              designs[size_t(&c - all.data())].progress);
      gates[c.name] = handover.from();
      gates[name] = handover.to();
    });
  }
  return gates;
}

/// A target that is some quarter turns but for digits that were left out, as of the upright of a
/// pendulum, where a design asks for rest; or that may be in degrees.
std::string cut_target(const Table& t) {
  std::string found;
  if (t.is_array("joints")) return found;  // names alone
  t.each("joints", [&](const std::string& joint, const std::string&, const Table& at) {
    if (!at.is_number("target")) return;
    const double target = at.number("target"), quarter = std::numbers::pi / 2;
    const double whole = std::round(target / quarter) * quarter, off = std::fabs(target - whole);
    if (std::fabs(target) > 4 * std::numbers::pi)
      found = fmt::format("; the target of '{}' is {:g} rad (m): are they degrees?", joint, target);
    else if (off > 1e-12 && off < 5e-3 && whole != 0)
      found = fmt::format(
          "; the target of '{}' is {:g}, expected all digits of {:.16g} if that is "
          "meant",
          joint, target, whole);
  });
  return found;
}

}  // namespace

std::vector<Controller> read_controllers(const Table& scene, const std::string& folder) {
  std::vector<Controller> list;
  scene.each_of("controller", "type", [&](const std::string& word, const Table& t) {
    Controller c;
    c.type = word;
    c.where = t.where();
    c.name = t.text("name", "the name of its row in the ledger");
    if (t.has("rate")) c.rate = t.positive("rate");
    for (const auto& other : list)
      if (other.name == c.name)
        t.fail("name", fmt::format("\"{}\" is that of another controller, expected one of its own",
                                   c.name));
    const auto& types = controller_types();
    const auto type = std::find_if(types.begin(), types.end(),
                                   [&](const ControllerType& k) { return k.name == word; });
    if (type->always_sampled) t.require("rate", "the sampling instants per second in Hz");
    if (!type->file_key.empty()) c.file = read_law_file(t, type->file_key.c_str(), folder);
    c.sensing = read_sensing(t);
    c.tank = read_tank(t);
    type->read(t, c);
    c.cut_target = cut_target(t);
    list.push_back(std::move(c));
  });
  for (const auto& c : list) check_takeover(c, list);
  return list;
}

namespace {

/// Controllers that act at a port together, of which one has a limit that the sum does not keep;
/// and those that hand over to one of other ports.
std::vector<std::string> sharing(const std::vector<Controller>& all,
                                 const std::vector<ControllerDesign>& designs) {
  std::vector<std::string> notes;
  for (size_t i = 0; i < all.size(); ++i)
    for (size_t j = 0; j < i; ++j) {
      const bool joined =
          all[i].then || all[j].then || std::ranges::any_of(all, [&](const Controller& c) {
            return c.then && (c.then->by == all[i].name || c.then->by == all[j].name);
          });
      if (joined) continue;
      for (const auto& one : designs[j].laws)
        for (const auto& other : designs[i].laws)
          if (one.port == other.port && std::min(one.limit, other.limit) < HUGE_VAL)
            notes.push_back(fmt::format(
                "{}: '{}' and '{}' both act at {}: their torques add up and pass the limit of "
                "{:g}; one that takes over from the other is its then = \"{}\"",
                all[i].where, all[j].name, all[i].name, one.port, std::min(one.limit, other.limit),
                all[i].name));
    }
  for (size_t i = 0; i < all.size(); ++i)
    for (size_t j = 0; all[i].then && j < all.size(); ++j)
      if (all[j].name == all[i].then->by &&
          std::ranges::none_of(designs[i].laws, [&](const auto& one) {
            return std::ranges::any_of(designs[j].laws,
                                       [&](const auto& other) { return other.port == one.port; });
          }))
        notes.push_back(fmt::format(
            "{}: '{}' hands over to '{}', which acts at other joints: is each of them driven?",
            all[i].where, all[i].name, all[j].name));
  return notes;
}

}  // namespace

AddedControllers add_controllers(
    phs::Network& n, const std::shared_ptr<const mechanics::MechanicalModel>& model,
    const Scene& scene,
    const std::function<energy_shaping::LawInputs(const std::vector<std::string>&)>& inputs) {
  std::vector<ControllerDesign> designs;
  for (const Controller& c : scene.controllers)
    at_line(c.where, [&] {
      if (c.file.name.empty())  // the conditions of the library's laws are those of trees
        phs::refuse_constraints(model->description(), "controller '" + c.name + "'");
      const auto offset = [&](const std::string& member) { return size_t(n.offset(member)); };
      try {
        designs.push_back(c.design(c, {model, scene, inputs, offset}));
      } catch (const InvalidArgument& e) {
        throw InvalidArgument(e.what() + c.cut_target);
      }
    });
  const auto gates = gates_of(scene.controllers, designs);
  const auto nx = size_t(model->description().nx);
  AddedControllers added;
  added.remarks = sharing(scene.controllers, designs);
  for (size_t i = 0; i < designs.size(); ++i) {
    const Controller& c = scene.controllers[i];
    added.certificates.push_back(std::move(designs[i].certificate));
    if (!designs[i].remark.empty())
      added.remarks.push_back(fmt::format("{}: {}", c.where, designs[i].remark));
    const auto gate = gates.find(c.name);
    for (const auto& l : designs[i].laws)
      if (gate == gates.end() && (l.limit < HUGE_VAL || l.hindrance))
        added.hindered.push_back({c.name, l});
    at_line(c.where, [&] {
      const auto& elsewhere = designs[i].elsewhere;
      if (c.tank) n.tank(c.tank_name(), c.tank->bounds);
      if (designs[i].sampled || c.sensing.any()) {
        if (gate != gates.end() || !elsewhere.empty())
          throw InvalidArgument(fmt::format(
              "controller '{}' {} and has a delay, a resolution or noise, expected one of both",
              c.name, elsewhere.empty() ? "hands over or takes over" : "acts on motors"));
        return add_sampled(n, c, std::move(designs[i]), model, scene.of_case);
      }
      for (auto& l : designs[i].laws) l.law = of_mechanism(std::move(l.law), nx);
      phs::Network::Control how;
      if (c.rate > 0) how.period = 1 / c.rate;
      if (gate != gates.end()) how.gate = gate->second;
      if (designs[i].paid)
        add_paid(n, c, std::move(*designs[i].paid), nx);
      else
        how.tank = c.tank_name();
      how.whole = designs[i].whole;
      for (const auto& [member, law] : elsewhere)
        n.control(elsewhere.size() == 1 ? c.name : c.name + "." + member, member + "." + law.port,
                  law.law, how);
      if (elsewhere.empty()) energy_shaping::control(n, c.name, "mechanism", designs[i].laws, how);
    });
  }
  return added;
}

ControlledJoint controlled_joint(const mechanics::MechanicalModel& model, const Controller& c,
                                 const std::string& joint) {
  const std::string member = "mechanism.";
  const JointPlace at = joint_place(model, c.where, "controller '" + c.name + "'", joint);
  if (at.port_size > 1)
    refuse(
        c.where,
        fmt::format("controller '{}': '{}' is one of {} degrees of freedom of its joint, expected "
                    "a joint of one degree of freedom",
                    c.name, joint, at.port_size));
  return {size_t(at.q), at.port.substr(member.size())};
}

std::array<double, 4> read_attitude(const Table& t, const char* key) {
  if (!t.has(key)) return {1, 0, 0, 0};
  auto a = t.numbers<4>(key);
  const double size = std::hypot(std::hypot(a[0], a[1]), std::hypot(a[2], a[3]));
  if (!(size > 0)) t.fail(key, "has length 0, expected a quaternion");
  for (double& x : a) x /= size;
  return a;
}

std::vector<double> stated_start(const ControllerPlant& plant) {
  const auto& m = plant.model->mechanism();
  auto q = m.neutral();
  for (const auto& c : m.coordinates()) {
    if (c.nq != 1) continue;
    if (const auto s = plant.scene.joints.find(c.name); s != plant.scene.joints.end())
      q[size_t(c.q)] = s->second.position;
    if (const auto& from = plant.scene.start_from)
      q[size_t(c.q)] = from->position(c.name).value_or(q[size_t(c.q)]);
  }
  return q;
}

}  // namespace porthos::scene
