#include "scene/run/spring_ranges.h"

#include <fmt/format.h>

#include <cmath>

#include "scene/assemble/assembly.h"
#include "scene/read/scene.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

SpringRanges::SpringRanges(const Scene& scene, const Assembly& assembly, const RecordLayout& layout)
    : layout_(layout), most_(scene.verify.energy.value_or(HUGE_VAL)) {
  const auto table = [&](const char* of, const std::string& name) {
    kinks_.push_back(fmt::format(
        "the spring of {} '{}' is a table: its third derivative jumps at every place", of, name));
  };
  for (const Element& e : scene.elements)
    if (e.table) table("element", e.name);
  for (const JointActuator& a : scene.actuators) {
    if (a.actuator.elastic->traits().family == "tabulated") table("actuator", a.name);
    if (const double kink = a.actuator.elastic->traits().kink; !std::isnan(kink))
      kinks_.push_back(
          fmt::format("a derivative of third to sixth order of the energy of actuator '{}' jumps "
                      "at phi = {:.4g} rad",
                      a.name, std::fabs(kink) < 1e-12 ? 0 : kink));
    if (!a.remark.empty()) remarks_.push_back(a.remark);
    const ActuatorPlace at = place_of(a, assembly.model->description());
    const vsa::ElasticTraits& t = a.actuator.elastic->traits();
    if (at.link >= 0) springs_.push_back({a.name, a.actuator.elastic.get(), at});
    const auto add = [&](const char* what, const std::string& unit, int of, int less, double lower,
                         double upper, const char* reason) {
      if (of < 0 || !(lower > -HUGE_VAL || upper < HUGE_VAL)) return;
      ranges_.push_back({fmt::format("{} of actuator '{}' [{}]", what, a.name, unit), of, less,
                         lower, upper, reason});
    };
    add("deflection", "rad", at.link, at.theta, t.measured_from, t.measured_to,
        "that was measured");
    if (t.limits.sigma_stop_stiffness == 0)
      add("sigma", t.sigma_unit, at.sigma, -1, t.limits.sigma_lower, t.limits.sigma_upper,
          "of its limits, which sigma_stop_stiffness would enforce");
  }
}

void SpringRanges::Range::see(double value, double time) {
  const double beyond = std::fmax(lower - value, value - upper);
  if (!(beyond > 0)) return;
  const bool begins = first < 0;
  if (begins) first = time;
  if (begins || beyond > std::fmax(lower - farthest, farthest - upper)) farthest = value;
}

void SpringRanges::see(std::span<const double> record) {
  for (Range& r : ranges_) {
    const size_t of = layout_.x() + size_t(r.of);
    if (r.less >= 0) {
      r.see(record[of] - record[layout_.x() + size_t(r.less)], record[layout_.time()]);
      continue;
    }
    r.see(record[layout_.least(of)], record[layout_.time()]);
    r.see(record[layout_.largest(of)], record[layout_.time()]);
  }
  const auto x = [&](int at) { return at < 0 ? 0 : record[layout_.x() + size_t(at)]; };
  for (Spring& s : springs_) {
    const double k = s.elastic->stiffness(x(s.at.link), x(s.at.theta), x(s.at.sigma));
    if (!(k < 0)) continue;
    if (s.first < 0) s.first = record[layout_.time()];
    s.least = std::fmin(s.least, k);
  }
}

void SpringRanges::fill(RunReport& report) const {
  report.notes.insert(report.notes.end(), remarks_.begin(), remarks_.end());
  report.energy.kinks = !kinks_.empty() && report.energy.max_rel_error > most_;
  if (report.energy.kinks)
    report.notes.push_back(
        fmt::format("{}, so a method needs smaller steps than for a formula without kinks, or is "
                    "gonzalez or auto; the spring itself makes no energy",
                    kinks_.front()));
  for (const Range& r : ranges_)
    if (r.first >= 0)
      report.notes.push_back(fmt::format(
          "{} left the range {:.4g} to {:.4g} {}: first at {:.6g} s, farthest at {:.4g}", r.what,
          r.lower, r.upper, r.reason, r.first, r.farthest));
  for (const Spring& s : springs_)
    if (s.first >= 0)
      report.notes.push_back(fmt::format(
          "the stiffness of actuator '{}' is negative: first at {:.6g} s, least {:.4g} N m/rad: "
          "there its spring pushes away from where its torque is 0",
          s.name, s.first, s.least));
}

}  // namespace porthos::scene
