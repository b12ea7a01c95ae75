#include "scene/run/wheel_momentum.h"

#include <algorithm>
#include <cmath>

#include "scene/run/run_report.h"

namespace porthos::scene {
namespace {

constexpr double standard_gravity = 9.80665;  // [m/s²], of a specific impulse

void see_momentum(MomentumRow& row, bool first, double value, double least, double largest) {
  if (first) row.start = value;
  row.end = value;
  row.largest = std::max({row.largest, std::fabs(value), std::fabs(least), std::fabs(largest)});
}

}  // namespace

MomentumLedger::MomentumLedger(const Scene& scene, const Assembly& assembly,
                               const RecordLayout& layout)
    : scene_(scene), assembly_(assembly), layout_(layout), turns_(layout.turns) {
  if (!assembly.mechanism) return;
  const auto& m = *assembly.mechanism;
  const auto add_wheel = [&](const std::string& joint) {
    for (const MomentumRow& known : wheels_)
      if (known.name == joint) return;
    wheel_at_.push_back(layout.x() + size_t(m.nq()) + size_t(m.coordinate(joint).q));
    wheels_.push_back({joint, 0, 0, 0, layout.largest(wheel_at_.back()) != wheel_at_.back()});
  };
  for (const Element& e : scene.elements) {
    if (!e.turning_wheel.empty()) add_wheel(e.turning_wheel);
    if (e.thruster) given_.rows.push_back({.name = e.name, .type = "thruster"});
  }
  for (const Controller& c : scene.controllers)
    for (const auto& joint : c.wheels) add_wheel(joint);
  if (!wheels_.empty()) wheels_.push_back({"total"});
  for (const Element& e : scene.elements)
    if (e.wrench) given_.rows.push_back({.name = e.name, .type = "wrench"});
  for (const Element& e : scene.elements)
    if (e.torquer) given_.rows.push_back({.name = e.name, .type = "torquer"});
  if (any()) workspace_.emplace(m);
  const auto& powers = assembly.model->description().powers;
  const auto find = [&](const std::string& name) {
    const auto known = [&](const auto& power) { return power.name == name; };
    return size_t(std::find_if(powers.begin(), powers.end(), known) - powers.begin());
  };
  for (const ImpulseRow& row : given_.rows)
    given_at_.push_back({find(row.name + ".impulse.x"), find(row.name + ".angular_impulse.x")});
}

void MomentumLedger::see(std::span<const double> record) {
  if (!any()) return;
  const auto& m = *assembly_.mechanism;
  const size_t nq = size_t(m.nq());
  const auto x = record.subspan(layout_.x(), layout_.nx);
  turns_of(layout_, record, turns_);
  workspace_->set_turns(turns_);
  const auto now = mechanics::momentum<double>(m, *workspace_, x.first(nq), x.subspan(nq, nq));
  for (size_t k = 0; k < wheel_at_.size(); ++k) {
    const size_t at = wheel_at_[k];
    see_momentum(wheels_[k], first_, record[at], record[layout_.least(at)],
                 record[layout_.largest(at)]);
  }
  const double total = std::hypot(now.angular.x, now.angular.y, now.angular.z);
  if (!wheels_.empty()) see_momentum(wheels_.back(), first_, total, total, total);
  if (!given_.rows.empty()) see_impulses(record, now);
  first_ = false;
}

void MomentumLedger::see_impulses(std::span<const double> record,
                                  const mechanics::Momentum<double>& now) {
  const double* works = &record[layout_.work()];
  to_ = record[layout_.time()];
  mechanics::Momentum<double> sum{{0, 0, 0}, {0, 0, 0}};
  for (size_t k = 0; k < given_at_.size(); ++k)
    for (int c = 0; c < 3; ++c) {
      auto& row = given_.rows[k];
      row.angular[size_t(c)] = works[given_at_[k].angular + size_t(c)];
      if (given_at_[k].impulse < layout_.powers)
        row.impulse[size_t(c)] = works[given_at_[k].impulse + size_t(c)];
      sum.linear[c] += row.impulse[size_t(c)];
      sum.angular[c] += row.angular[size_t(c)];
    }
  if (first_) {
    start_ = now;
    from_ = to_;
  }
  if (scene_.orbit) return;  // the space ledgers keep this balance
  const auto left = [](const auto& a, const auto& b, const auto& given) {
    return mechanics::norm((a - b) - given);
  };
  given_.linear_left = std::max(given_.linear_left, left(now.linear, start_.linear, sum.linear));
  given_.angular_left =
      std::max(given_.angular_left, left(now.angular, start_.angular, sum.angular));
  largest_P_ = std::max(largest_P_, mechanics::norm(now.linear));
  largest_L_ = std::max(largest_L_, mechanics::norm(now.angular));
}

void MomentumLedger::fill(RunReport& report) const {
  report.momentum = wheels_;
  Impulses& r = report.impulses;
  const bool integrated = r.integrated;  // known from the method
  r = given_;
  r.integrated = integrated;
  if (largest_P_ > 0) r.linear_left /= largest_P_;
  if (largest_L_ > 0) r.angular_left /= largest_L_;
  size_t k = 0;
  for (const Element& e : scene_.elements) {
    if (!e.thruster) continue;
    ImpulseRow& row = r.rows[k++];
    row.on_s = e.thruster->schedule.on_time(to_) - e.thruster->schedule.on_time(from_);
    if (e.thruster->specific_impulse > 0)
      row.propellant_kg =
          row.on_s * e.thruster->thrust / (e.thruster->specific_impulse * standard_gravity);
  }
}

}  // namespace porthos::scene
