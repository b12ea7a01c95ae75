#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "energy_shaping/laws/detail/potential_help.h"
#include "energy_shaping/loop/derivatives.h"

namespace porthos::energy_shaping {

std::string help_of_saddle(const mechanics::Mechanism& m, const PotentialLoop::Parts& p,
                           const std::vector<double>& K) {
  const auto nq = size_t(m.nq());
  const mechanics::JointCoordinates* softest = nullptr;
  double least = HUGE_VAL;
  for (const auto& c : m.coordinates()) {
    if (c.nq != 1) continue;
    const double own = K[size_t(c.q) * (nq + 1)];
    if (own < 0 && !p.actuated[size_t(c.v)])  // whatever the others' stiffness
      return fmt::format(
          "'{}' stands up there and nothing drives it: choose a rest where it hangs, or a law that "
          "balances it, as an lqr",
          c.joint);
    if (own >= least) continue;
    least = own;
    softest = &c;
  }
  if (!softest) return "raise the stiffness of the springs";
  if (p.actuated[size_t(softest->v)])
    return fmt::format("raise the stiffness at '{}'", softest->joint);
  return fmt::format(
      "'{}' is the softest there and nothing drives it: choose a rest where it hangs, or raise the "
      "stiffness",
      softest->joint);
}

bool hangs(const mechanics::MechanicalModel& model, const PotentialLoop::Parts& p,
           const std::vector<double>& x, double tolerance) {
  std::vector<double> slope(x.size());
  model.instantiate<double>()->gradient(x, slope);
  const auto H = hessian(model, x);
  double scale = 0;
  for (size_t i = 0; i < x.size() / 2; ++i)
    for (size_t j = 0; j < x.size() / 2; ++j)
      scale = std::max(scale, std::fabs(H[i * x.size() + j]));
  return std::ranges::none_of(model.mechanism().coordinates(), [&](const auto& c) {
    const auto here = [&](const auto& spring) { return spring.v == size_t(c.v); };
    return c.nq == 1 && !p.actuated[size_t(c.v)] && std::ranges::none_of(p.joints, here) &&
           (std::fabs(slope[size_t(c.q)]) > tolerance * scale ||
            H[size_t(c.q) * (x.size() + 1)] < -tolerance * scale);
  });
}

std::string help_of_unheld(const PotentialShaping& s, const PotentialLoop::Parts& p,
                           const mechanics::Mechanism& m, const std::string& joint, bool hanging) {
  double k = 0;  // of the joint's own spring
  for (const auto& j : m.joint_properties()) k = j.joint == joint ? j.stiffness : k;
  if (!(p.compensate || s.constant_compensation) || !(m.has_gravity() || k != 0))
    return "drive it, or hold only what the actuators reach";
  const std::string rest =
      m.has_gravity() ? "choose a rest at which it hangs"
                      : fmt::format("choose a rest at which its spring, {:g}, has no force", k);
  if (s.constant_compensation)
    return rest +
           " (that of a scene's joint is its start unless it is named, with a target and "
           "actuated = false), or drive it";
  const std::string keep = "gravity = \"keep\"", in_programs = "in programs compensate = false";
  if (!m.has_gravity())
    return hanging
               ? fmt::format("drive it, or keep its spring, {:g} ({}, {})", k, keep, in_programs)
               : fmt::format("{}, with {} ({}), or drive it", rest, keep, in_programs);
  return hanging ? fmt::format(
                       "drive it, or keep the model's gravity and springs ({} or "
                       "\"constant\", {}, constant_compensation = true)",
                       keep, in_programs)
                 : fmt::format(
                       "{}, with gravity = \"constant\" ({}, constant_compensation = "
                       "true), or drive it",
                       rest, in_programs);
}

}  // namespace porthos::energy_shaping
