#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "energy_shaping/laws/wheel_base.h"
#include "mechanics/crba.h"
#include "mechanics/rotation.h"
#include "mechanics/urdf.h"
#include "phs/scalars/pack.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/controllers/half_turn.h"
#include "scene/read/scene.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

using Attitude = std::array<double, 4>;  // wxyz, base to world

struct WheelAttitude {
  std::string link;
  std::vector<std::string> wheels;
  mechanics::Vec3d stiffness, damping;
  std::vector<double> times;        ///< from each on [s], the attitude of that place
  std::vector<Attitude> attitudes;  ///< the first at the start, whatever its time
  double limit, momentum_limit;
};

/// The law of the last attitude whose time has come.
energy_shaping::PortLaw commanded(const std::vector<energy_shaping::PortLaw>& laws,
                                  const std::vector<double>& times) {
  if (laws.size() == 1) return laws[0];
  auto law = [laws, times](const auto& t, auto x, auto y, auto u) {
    double now;
    if constexpr (phs::is_pack<std::decay_t<decltype(t)>>)
      now = t[0];  // lanes step together
    else
      now = phs::to_double(t);
    size_t k = 0;
    while (k + 1 < times.size() && times[k + 1] <= now * (1 + 1e-12)) ++k;
    (*laws[k].law)(t, x, y, u);
  };
  energy_shaping::PortLaw all = laws[0];
  all.law = phs::law(std::move(law));
  return all;
}

/// The base's attitude by a shaping that asks for a moment at the base, which the wheels make.
ControllerDesign design_one(const Controller& c, const ControllerPlant& plant,
                            const WheelAttitude& w, const Attitude& wxyz) {
  if (plant.scene.urdf.base != mechanics::UrdfOptions::Base::free)
    throw InvalidArgument("controller '" + c.name +
                          "' holds an attitude and the base is fixed, expected a free base");
  const auto& m = plant.model->mechanism();
  const auto& base = m.coordinate(std::string(mechanics::base_joint_name) + ".attitude");
  energy_shaping::WheelBaseOptions o;
  energy_shaping::PotentialShaping s;
  s.name = c.name;
  s.actuators = {o.base_port};
  s.rest = m.neutral();
  std::copy(wxyz.begin(), wxyz.end(), s.rest.begin() + base.q);
  energy_shaping::PoseSpring hold;
  hold.link = w.link;
  hold.attitude_stiffness = w.stiffness;
  hold.attitude = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(wxyz.data()));
  s.poses = {hold};
  s.damping = {{o.base_port, {w.damping.x, w.damping.y, w.damping.z, 0, 0, 0}}};
  for (const auto& wheel : w.wheels)
    o.wheels.push_back(controlled_joint(*plant.model, c, wheel).port);
  if (w.limit < HUGE_VAL) o.limits.assign(w.wheels.size(), w.limit);
  if (w.momentum_limit < HUGE_VAL) {
    o.capacities.assign(w.wheels.size(), w.momentum_limit);
    o.period = 1 / c.rate;
  }
  const energy_shaping::WheelBase held(
      std::make_shared<const energy_shaping::PotentialLoop>(plant.model, s), o);
  auto laws = held.port_laws();
  std::erase_if(laws, [&](const auto& l) { return l.port == o.base_port; });  // no thrusters
  energy_shaping::Certificate all = held.shaped().certificate();
  for (auto& item : all.items()) item.help.clear();  // nothing holds the wheels: they are to turn
  for (const auto& item : held.certificate().items()) all.add(item);
  return {std::move(laws), std::move(all)};
}

/// Held for a period T, the moment -k θ - d ω about an axis with the inertia J is stable up to
/// d T = 2 J and k T = 2 d. J is that of the whole craft, locked, about its centre: joints that
/// give way make it smaller.
void certify_sampled(energy_shaping::Certificate& all, const Controller& c,
                     const ControllerPlant& plant, const WheelAttitude& w) {
  const auto& m = plant.model->mechanism();
  const std::string base = mechanics::base_joint_name;
  const auto turn = size_t(m.coordinate(base + ".attitude").v),
             move = size_t(m.coordinate(base + ".position").v), nv = size_t(m.nv());
  mechanics::Workspace<double> workspace(m);
  std::vector<double> M(nv * nv);
  mechanics::crba<double>(m, workspace, stated_start(plant), M);
  const double mass = M[move * (nv + 1)], T = 1 / c.rate;
  double worst = 0;
  std::string text;
  for (size_t i = 0; i < 3; ++i) {
    double J = M[(turn + i) * (nv + 1)];
    for (size_t k = 0; k < 3; ++k) J -= std::pow(M[turn + i + nv * (move + k)], 2) / mass;
    const double d = w.damping[int(i)], k = w.stiffness[int(i)];
    const double part = std::max(d * T / (2 * J), d > 0 ? k * T / (2 * d) : 0);
    if (part <= worst) continue;
    worst = part;
    text = fmt::format(
        "of the rate that it needs: at rate = {:.6g} Hz the damping {:.4g} N m s/rad "
        "about {} acts on {:.4g} kg m^2 of the whole craft",
        c.rate, d, std::string(1, "xyz"[i]), J);
    if (part > 1) text += fmt::format(", expected {:.3g} Hz or more", 1.05 * part * c.rate);
  }
  all.at_most("sampled", worst, 1, text);
}

/// Where it is told to turn by half a turn: at the start or by a command.
std::string half_turns(const ControllerPlant& plant, const WheelAttitude& w) {
  std::string found;
  Attitude before = start_attitude(plant, w.link);
  for (size_t k = 0; k < w.times.size() && w.times[k] <= plant.scene.duration; ++k) {
    if (k + 1 < w.times.size() && w.times[k + 1] == w.times[k]) continue;  // never acts
    if (near_half_turn(before, w.attitudes[k], w.stiffness))
      add_to_list(found, w.times[k] == 0 ? "at the start" : fmt::format("at {:g} s", w.times[k]));
    before = w.attitudes[k];
  }
  return found;
}

/// All attitudes of the run, each by a law of its own.
ControllerDesign design_attitude(const Controller& c, const ControllerPlant& plant,
                                 const WheelAttitude& w) {
  ControllerDesign all = design_one(c, plant, w, w.attitudes[0]);
  if (c.rate > 0) {
    certify_sampled(all.certificate, c, plant, w);
    energy_shaping::refuse_failure(all.certificate);
  }
  std::vector<std::vector<energy_shaping::PortLaw>> of_port;
  for (const auto& law : all.laws) of_port.push_back({law});
  for (size_t k = 1; k < w.attitudes.size(); ++k) {  // the conditions are those of the first
    const auto more = design_one(c, plant, w, w.attitudes[k]);
    for (size_t i = 0; i < of_port.size(); ++i) of_port[i].push_back(more.laws[i]);
  }
  for (size_t i = 0; i < of_port.size(); ++i) all.laws[i] = commanded(of_port[i], w.times);
  if (w.times.back() > plant.scene.duration)
    all.remark = fmt::format(
        "the command of '{}' at {:g} s comes after the end, {:g} s: times count from the start of "
        "this run",
        c.name, w.times.back(), plant.scene.duration);
  if (const auto found = half_turns(plant, w); !found.empty())
    add_sentence(all.remark,
                 fmt::format("'{}' is to make a half turn {}, where its torque is zero: it begins "
                             "late or never; state a waypoint (commands) on the way",
                             c.name, found));
  return all;
}

void read_commands(const Table& t, const Controller& c, WheelAttitude& w) {
  if (c.rate == 0)
    t.fail("commands",
           "jump from one attitude to the next and the law is continuous, expected the "
           "rate of a sampled one");
  for (const auto& [at, a, b, d, e] : t.rows<5>("commands")) {
    if (!(at > w.times.back()) && w.times.size() > 1)
      t.fail("commands",
             fmt::format("has {} s after {} s, expected times that rise", at, w.times.back()));
    if (at < 0) t.fail("commands", fmt::format("has the time {} s, expected 0 or more", at));
    const double size = std::hypot(std::hypot(a, b), std::hypot(d, e));
    if (!(size > 0)) t.fail("commands", fmt::format("has a quaternion of length 0 at {} s", at));
    w.times.push_back(at);
    w.attitudes.push_back({a / size, b / size, d / size, e / size});
  }
}

void read_wheel_attitude(const Table& t, Controller& c) {
  WheelAttitude w;
  w.link = t.text("link", "the name of the root link");
  t.require("wheels", "an array of names of joints");
  w.wheels = c.wheels = t.texts("wheels", "names of joints");
  w.stiffness = t.vector("stiffness");
  w.damping = t.vector("damping");
  for (const auto& [key, v] : {std::pair{"stiffness", w.stiffness}, {"damping", w.damping}})
    if (!(v.x >= 0 && v.y >= 0 && v.z >= 0)) t.fail(key, "has a number below 0");
  w.times = {0};
  w.attitudes = {read_attitude(t, "attitude_wxyz")};
  if (t.has("commands")) read_commands(t, c, w);
  w.limit = t.has("limit") ? t.positive("limit") : HUGE_VAL;
  w.momentum_limit = t.has("momentum_limit") ? t.positive("momentum_limit") : HUGE_VAL;
  if (w.momentum_limit < HUGE_VAL && c.rate == 0)
    t.fail("momentum_limit",
           "ends a torque and the law is continuous, expected the rate of a sampled one");
  c.design = made_of(design_attitude, w);
}

}  // namespace

ControllerType wheel_attitude_controller() {
  using namespace keys;
  return {"wheel_attitude",
          "Holds a free base's attitude by reaction wheels, for any momentum they can take up.",
          {text("link", required, "the root link"),
           {"wheels", KeyKind::texts, "", required, "joints of three axes or more"},
           numbers("stiffness", 3, "N m", required, "of the trace potential, about its axes"),
           numbers("damping", 3, "N m s/rad", required, "of its body rates"),
           numbers("attitude_wxyz", 4, "1", "[1, 0, 0, 0]", "wanted, to the world; normalised"),
           rows("commands", 5, "s, 1", "none",
                "[time, w, x, y, z]: other attitudes, each from its time on; of a sampled law"),
           number("limit", "N m", "none", "largest torque of each wheel"),
           number("momentum_limit", "N m s", "none",
                  "largest momentum of each wheel, its inertia times its inertial speed about the "
                  "axis, the base's turning included; of a sampled law")},
          {},
          read_wheel_attitude};
}

}  // namespace porthos::scene
