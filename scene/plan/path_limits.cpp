#include "scene/plan/path_limits.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "mechanics/kinematics.h"
#include "scene/assemble/outputs.h"
#include "scene/read/toml_file-inl.h"

namespace porthos::scene {
namespace {

using mechanics::Transform;

/// A distance, or a component of a position, by the kinematics of T.
template <class T>
class PlaceOf {
 public:
  explicit PlaceOf(const mechanics::Mechanism& m) : m_(m), w_(m), poses_(m.nodes().size()) {}

  /// @param centre  what the world's points are seen from
  /// @param component  of the position; -1: the distance
  T operator()(std::span<const T> q, const PlaceOnLink& of, const PlaceOnLink& seen_from,
               const mechanics::Vec3d& centre, int component) {
    mechanics::forward_kinematics<T>(m_, w_, q, poses_);
    const auto pose = [&](const PlaceOnLink& p) {
      const auto own = mechanics::converted<T>(p.pose);
      if (p.node >= 0) return poses_[size_t(p.node)] * own;
      return Transform<T>{own.R, own.r - mechanics::Vec3<T>(centre)};
    };
    const auto a = pose(of), b = pose(seen_from);
    const auto r = b.R.tmul(a.r - b.r);
    return component < 0 ? mechanics::norm(r) : r[component];
  }

 private:
  const mechanics::Mechanism& m_;
  mechanics::Workspace<T> w_;
  std::vector<Transform<T>> poses_;
};

class PlannedPlace final : public planning::PathNumber {
 public:
  PlannedPlace(const Assembly& a, const Output& o, int component)
      : mechanism_(a.mechanism),
        centre_(a.centre),
        of_(place_on_link(*a.mechanism, o.of, o.where)),
        seen_from_(place_on_link(*a.mechanism, o.seen_from, o.where)),
        component_(component),
        radii_(component < 0 ? o.of.radius + o.seen_from.radius : 0),
        number_(*mechanism_),
        slope_(*mechanism_),
        q_(size_t(mechanism_->nq())) {}

  double value(double t, In x) override {
    return number_(x.first(q_.size()), of_, seen_from_, centre_at(t), component_) - radii_;
  }
  void gradient(double t, In x, Out g) override {
    std::fill(g.begin(), g.end(), 0.0);
    for (size_t k = 0; k < q_.size(); ++k) q_[k] = x[k];
    phs::along_each(q_, [&](size_t k) {
      g[k] = slope_(std::span<const phs::Dual>(q_), of_, seen_from_, centre_at(t), component_).d;
    });
  }

 private:
  mechanics::Vec3d centre_at(double t) const {
    return centre_ ? mechanics::Vec3d(centre_->position(t)) : mechanics::Vec3d{0, 0, 0};
  }

  std::shared_ptr<const mechanics::Mechanism> mechanism_;
  std::optional<CentreOfMass> centre_;
  PlaceOnLink of_, seen_from_;
  int component_;
  double radii_;
  PlaceOf<double> number_;
  PlaceOf<phs::Dual> slope_;
  std::vector<phs::Dual> q_;
};

/// The output that has a number, and the number's place in it.
std::pair<const Output*, int> output_of(const Scene& s, const PlannedOutput& planned) {
  for (const Output& o : s.outputs) {
    const auto names = component_names(o);
    const auto at = std::find(names.begin(), names.end(), planned.name);
    if (at != names.end()) return {&o, int(at - names.begin())};
  }
  const auto known = number_names(s.outputs);
  refuse(
      planned.where,
      fmt::format("[plan.outputs] names '{}', expected a number of an [[output]]: {}", planned.name,
                  known.empty() ? "there is none" : fmt::format("{}", fmt::join(known, ", "))));
}

}  // namespace

void add_outputs(const Scene& s, const Assembly& a, const std::vector<PlannedOutput>& planned,
                 planning::Problem& problem, std::vector<std::string>& goal_names) {
  for (const PlannedOutput& p : planned) {
    const auto [output, component] = output_of(s, p);
    const bool distance = output->quantity == OutputQuantity::distance;
    if (!distance && output->quantity != OutputQuantity::position)
      refuse(p.where, fmt::format("[plan.outputs] has '{}', expected an output with quantity = "
                                  "\"distance\" or \"position\"",
                                  p.name));
    const auto number = std::make_shared<PlannedPlace>(a, *output, distance ? -1 : component);
    const auto add_goal = [&](std::shared_ptr<planning::PathNumber> of, double value,
                              const char* what) {
      problem.goals.push_back({{}, -1, value, std::move(of)});
      goal_names.push_back(p.name + what);
    };
    if (p.value) add_goal(number, *p.value, ".value");
    if (p.rate) add_goal(planning::rate_of(number, problem.dynamics), *p.rate, ".rate");
    if (!p.lower && !p.upper) continue;
    planning::PathLimit limit{.number = number};
    if (p.lower) limit.lower = *p.lower;
    if (p.upper) limit.upper = *p.upper;
    if (const double c = limit.number->value(0, problem.start);
        !(c >= limit.lower && c <= limit.upper))
      refuse(p.where, fmt::format("'{}' starts at {:.6g} m, which is beyond its limits in "
                                  "[plan.outputs]",
                                  p.name, c));
    problem.limits.path.push_back(std::move(limit));
  }
}

planning::PathLimit attitude_limit(int at, std::span<const double> start, double angle) {
  const std::array<double, 4> from{start[size_t(at)], start[size_t(at) + 1], start[size_t(at) + 2],
                                   start[size_t(at) + 3]};
  const auto number = [at, from](double, auto x) {
    auto c = from[0] * x[size_t(at)];
    for (size_t i = 1; i < 4; ++i) c += from[i] * x[size_t(at) + i];
    return c * c;
  };
  return {.number = planning::path_number(int(start.size()), number),
          .lower = 0.5 * (1 + std::cos(angle))};
}

}  // namespace porthos::scene
