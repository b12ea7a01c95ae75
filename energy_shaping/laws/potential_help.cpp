#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "energy_shaping/laws/detail/potential_help.h"
#include "energy_shaping/loop/derivatives.h"
#include "phs/linear_algebra/linear_algebra.h"

namespace porthos::energy_shaping {

namespace {
/// Whether the quadratic form K is not negative where the coordinates `held` cannot move.
bool stands(const std::vector<double>& K, size_t nq, const std::vector<int>& held) {
  std::vector<size_t> rest;
  for (size_t i = 0; i < nq; ++i)
    if (std::ranges::find(held, int(i)) == held.end()) rest.push_back(i);
  std::vector<double> part;
  double scale = 0;
  for (const size_t i : rest)
    for (const size_t j : rest) {
      part.push_back(K[i * nq + j]);
      scale = std::max(scale, std::fabs(part.back()));
    }
  return rest.empty() || phs::symmetric_eigenvalues(rest.size(), part).front() >= -1e-9 * scale;
}
}  // namespace

std::string help_of_saddle(const mechanics::Mechanism& m, const PotentialLoop::Parts& p,
                           const std::vector<double>& K) {
  const auto nq = size_t(m.nq());
  const auto own = [&](const auto* c) { return K[size_t(c->q) * (nq + 1)]; };
  std::vector<const mechanics::JointCoordinates*> driven;
  for (const auto& c : m.coordinates()) {
    if (c.nq != 1) continue;
    if (p.actuated[size_t(c.v)])
      driven.push_back(&c);
    else if (own(&c) < 0)  // whatever the others' stiffness
      return fmt::format(
          "'{}' stands up there and nothing drives it: choose a rest where it hangs, or a law that "
          "balances it, as an lqr",
          c.joint);
  }
  std::ranges::sort(driven, {}, own);
  for (const auto* c : driven)
    if (stands(K, nq, {c->q})) return fmt::format("raise the stiffness at '{}'", c->joint);
  std::vector<int> held;
  std::vector<std::string> joints;
  for (const auto* c : driven) {
    held.push_back(c->q);
    joints.push_back(fmt::format("'{}'", c->joint));
    if (stands(K, nq, held))
      return fmt::format("raise the stiffness at all of {}", fmt::join(joints, ", "));
  }
  return "stiffness where the actuators are does not help: choose a rest where what nothing drives "
         "hangs, or a law that balances it, as an lqr";
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
