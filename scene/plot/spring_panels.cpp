#include "scene/plot/spring_panels.h"

#include <fmt/format.h>

#include <algorithm>

#include "scene/read/scene.h"
#include "scene/run/columns.h"

namespace porthos::scene {
namespace {

class SpringPanels {
 public:
  explicit SpringPanels(const MotionRecords& r) : r_(r) {}
  std::vector<TracePanel> panels() {
    std::vector<TraceLine> deflection, stiffness, torque, motors, powers;
    using Groups = std::vector<std::pair<std::string, std::vector<TraceLine>>>;
    Groups settings, driving;  // by their units
    const auto put = [](Groups& groups, const std::string& what, TraceLine l) {
      const auto same = [&](const auto& known) { return known.first == what; };
      auto group = std::find_if(groups.begin(), groups.end(), same);
      if (group == groups.end()) group = groups.insert(group, {what, {}});
      group->second.push_back(std::move(l));
    };
    for (const Spring& s : r_.springs) {
      const auto of = [&](const char* what) {
        return r_.rows("state/" + link_name(s.name + what));
      };
      const auto q = of(".link"), theta = of(".theta");
      auto sigma = of(".sigma");
      if (q.size() != r_.t.size() || theta.size() != q.size()) continue;
      if (sigma.size() == q.size()) {
        put(settings, "stiffness settings [" + s.energy->traits().sigma_unit + "]",
            line(s.name, [&](size_t i) { return sigma[i]; }));
      }
      sigma.resize(q.size());
      deflection.push_back(line(s.name, [&](size_t i) { return q[i] - theta[i]; }));
      stiffness.push_back(
          line(s.name, [&](size_t i) { return s.energy->stiffness(q[i], theta[i], sigma[i]); }));
      torque.push_back(
          line(s.name, [&](size_t i) { return -s.energy->slopes(q[i], theta[i], sigma[i]).q; }));
      const auto slopes = [&](size_t i) { return s.energy->slopes(q[i], theta[i], sigma[i]); };
      const auto& traits = s.energy->traits();
      const auto drive = [&](const vsa::Drive& d, bool alone, const char* which,
                             const std::vector<double>& angle, const std::string& what,
                             const std::string& name, const auto& holds) {
        const Driven driven = driven_by(d, alone, s.name + which, angle, holds);
        if (driven.effort.empty()) return;
        put(driving, what, line(name, [&](size_t i) { return driven.effort[i]; }));
        if (!driven.rate.empty())
          powers.push_back(line(name, [&](size_t i) { return driven.effort[i] * driven.rate[i]; }));
      };
      if (!traits.sigma.empty())
        drive(s.winder, s.winder_alone, ".sigma", sigma,
              fmt::format("{} [{}]",
                          traits.sigma_unit == "rad" ? "torques of motors" : "efforts of motors",
                          traits.sigma_effort_unit()),
              s.name + ", sigma", [&](size_t i) { return slopes(i).sigma; });
      if (s.motor.kind == vsa::Drive::Kind::fixed) continue;
      motors.push_back(line(s.name, [&](size_t i) { return theta[i]; }));
      drive(s.motor, s.alone, ".theta", theta, "torques of motors [N m]", s.name,
            [&](size_t i) { return slopes(i).theta; });
    }
    add("deflections of springs [rad]", std::move(deflection));
    for (auto& [what, lines] : settings) add(what, std::move(lines));
    add("stiffness of springs [N m/rad]", std::move(stiffness));
    add("torques of springs [N m]", std::move(torque));
    add("motors [rad]", std::move(motors));
    for (auto& [what, lines] : driving) add(what, std::move(lines));
    add("powers of motors [W]", std::move(powers));
    return std::move(panels_);
  }

 private:
  /// What a drive exerts at each record, of one without a rotor what it holds, and the rate of its
  /// coordinate. Empty: not known.
  struct Driven {
    std::vector<double> effort, rate;
  };
  template <class Held>
  Driven driven_by(const vsa::Drive& d, bool alone, const std::string& of,
                   const std::vector<double>& angle, Held holds) {
    const auto p = r_.rows("momentum/" + link_name(of));
    const bool rotor = d.inertia > 0;
    if (d.kind == vsa::Drive::Kind::fixed || !alone || (rotor && p.size() != angle.size()))
      return {};
    const bool known = rotor || (d.kind == vsa::Drive::Kind::rate && d.command);
    Driven all;
    for (size_t i = 0; i < angle.size(); ++i) {
      const double rate =
          rotor ? p[i] / (d.gear * d.gear * d.inertia) : vsa::drive_rate(d, r_.t[i]);
      all.effort.push_back(rotor ? vsa::drive_torque(d, r_.t[i], angle[i], rate) : holds(i));
      if (known) all.rate.push_back(rate);
    }
    return all;
  }
  template <class F>
  TraceLine line(const std::string& name, F value) const {
    return line_of(name, r_.t, value);
  }
  void add(const std::string& what, std::vector<TraceLine> lines) {
    if (!lines.empty()) panels_.push_back({what, std::move(lines)});
  }

  const MotionRecords& r_;
  std::vector<TracePanel> panels_;
};

}  // namespace

std::vector<Spring> springs_of(const Scene& scene) {
  std::vector<Spring> all;
  for (const JointActuator& j : scene.actuators) {
    const vsa::Drive &motor = j.actuator.theta, &winder = j.actuator.sigma;
    const auto alone = [&](const vsa::Drive& d) {
      return d.kind != vsa::Drive::Kind::torque || scene.controllers.empty();
    };
    all.push_back({j.name, j.actuator.elastic, motor, winder, alone(motor), alone(winder)});
  }
  return all;
}

std::vector<TracePanel> spring_panels(const MotionRecords& records) {
  return SpringPanels(records).panels();
}

}  // namespace porthos::scene
