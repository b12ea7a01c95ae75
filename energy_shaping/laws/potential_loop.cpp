#include "energy_shaping/laws/potential_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "energy_shaping/laws/detail/potential_help.h"
#include "energy_shaping/laws/detail/shaped_system.h"
#include "energy_shaping/loop/derivatives.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/system/random_state.h"

namespace porthos::energy_shaping {
namespace {

using mechanics::Mat3;
using Parts = PotentialLoop::Parts;

[[noreturn]] void refuse_shaping(const std::string& name, const std::string& why) {
  throw InvalidArgument("potential shaping '" + name + "': " + why);
}

const mechanics::JointCoordinates& single(const mechanics::Mechanism& m, int v,
                                          const std::string& name, const std::string& port) {
  for (const auto& c : m.coordinates())
    if (c.v == v && c.nq == 1) return c;
  refuse_shaping(name, "port '" + port + "' is no joint of one degree of freedom");
}

/// The joint of a number of v.
const std::string& joint_at(const mechanics::Mechanism& m, int v) {
  const auto& all = m.coordinates();
  return std::find_if(all.begin(), all.end(),
                      [&](const auto& c) { return c.v <= v && v < c.v + c.nv; })
      ->joint;
}

Parts look_up(const mechanics::MechanicalModel& model, const PotentialShaping& s) {
  const auto& m = model.mechanism();
  const auto& d = model.description();
  Parts p;
  p.damping.assign(size_t(m.nv()), 0.0);
  p.constant = p.damping;
  p.actuated.assign(size_t(m.nv()), s.actuators.empty());
  const auto joint_offsets = [&](const std::string& port) {
    const auto at = port_offsets(d, {port});
    if (at.front() >= m.nv())
      refuse_shaping(s.name, "port '" + port + "' is a body port; name a joint's");
    return at;
  };
  for (const auto& name : s.actuators)
    for (const int a : joint_offsets(name)) p.actuated[size_t(a)] = true;
  for (const auto& j : s.joints) {
    const int v = joint_offsets(j.port).front();
    const auto& c = single(m, v, s.name, j.port);
    if (!(j.stiffness >= 0) || !std::isfinite(j.rest))
      refuse_shaping(s.name, fmt::format("spring at '{}' has stiffness {} and rest {}", j.port,
                                         j.stiffness, j.rest));
    p.joints.push_back({size_t(c.q), size_t(v), j.stiffness, j.rest, j.periodic});
  }
  for (const auto& pose : s.poses) {
    const auto& body = m.body(pose.link);
    if (body.node < 0) refuse_shaping(s.name, "link '" + pose.link + "' is fixed to the world");
    const auto& a = pose.attitude_stiffness;
    if (!(pose.stiffness >= 0 && a.x >= 0 && a.y >= 0 && a.z >= 0))
      refuse_shaping(s.name, "a spring at '" + pose.link + "' has negative stiffness");
    p.poses.push_back(
        {{body.name, body.node, body.pose * mechanics::Pose{Mat3<double>::identity(), pose.point}},
         pose});
  }
  for (const auto& damp : s.damping) {
    const auto at = joint_offsets(damp.port);
    if (damp.damping.size() != 1 && damp.damping.size() != at.size())
      refuse_shaping(s.name, fmt::format("damping of '{}' has {} numbers, expected 1 or {}",
                                         damp.port, damp.damping.size(), at.size()));
    for (size_t k = 0; k < at.size(); ++k) {
      const double value = damp.damping[damp.damping.size() == 1 ? 0 : k];
      if (!(value >= 0))
        refuse_shaping(s.name, fmt::format("damping of '{}' is {}", damp.port, value));
      if (value > 0 && !p.actuated[size_t(at[k])])
        refuse_shaping(s.name, "damping at '" + damp.port + "', which has no actuator");
      p.damping[size_t(at[k])] += value;
    }
  }
  if (s.compensate && s.constant_compensation)
    refuse_shaping(s.name, "compensate and constant_compensation exclude each other");
  p.compensate = s.compensate && [&] {
    bool springs = m.has_gravity();
    for (const auto& j : m.joint_properties()) springs = springs || j.stiffness != 0;
    return springs;
  }();
  if (!s.zero_momentum) return p;
  p.zero_momentum = true;
  int roots = 0;
  for (const auto& n : m.nodes()) roots += n.parent < 0;
  const auto& root = m.nodes().front();
  int base = 0;
  for (const auto& c : m.coordinates()) {
    if (c.node == 0)
      base += c.nv;
    else if (c.nq != 1)
      refuse_shaping(s.name,
                     "zero_momentum needs joints of one degree of freedom, not '" + c.name + "'");
  }
  if (roots != 1 || base != 6 || m.has_gravity())
    refuse_shaping(s.name, "zero_momentum needs one free base and no gravity");
  p.base_q = size_t(root.q);
  p.base_v = size_t(root.v);
  for (size_t a = 0; a < 6; ++a) p.actuated[p.base_v + a] = false;
  return p;
}

phs::Description describe(const mechanics::MechanicalModel& model, const PotentialShaping& s,
                          const Parts& p) {
  phs::Description d = model.description();
  d.name = s.name + " of " + d.name;
  for (auto& b : d.blocks)
    if (b.kind == phs::BlockKind::angle) b.kind = phs::BlockKind::linear;  // springs count turns
  d.flows.clear();
  d.traits.lossless = d.traits.separable = false;
  if (p.zero_momentum) d.traits.canonical = false;
  d.storages = {"kinetic", "shaped potential"};
  d.powers = {{"damping", phs::PowerKind::dissipated}};
  // Momenta and quaternions' norms stay invariants; those the shaping breaks are removed.
  std::vector<phs::Invariant> kept;
  const bool external = [&] {
    for (size_t a = 0; a < p.actuated.size(); ++a)
      for (const auto& c : model.mechanism().coordinates())
        if (p.actuated[a] && c.node >= 0 && model.mechanism().nodes()[size_t(c.node)].parent < 0 &&
            int(a) >= c.v && int(a) < c.v + c.nv)
          return true;
    return !p.poses.empty() && !p.zero_momentum;
  }();
  bool momenta_first = true;
  for (const auto& i : d.invariants) {
    const bool momentum = i.size == 3;
    if (momentum && external)
      momenta_first = false;
    else
      kept.push_back(i);
  }
  // Offsets in `values` are the plant's: either all invariants stay, or, if momenta are removed,
  // none is declared.
  d.invariants = momenta_first && !p.zero_momentum ? kept : std::vector<phs::Invariant>{};
  return d;
}

std::vector<double> rest_state(const mechanics::MechanicalModel& m, const PotentialShaping& s) {
  require_size("rest", s.rest.size(), size_t(m.mechanism().nq()));
  auto x = s.rest;
  x.resize(2 * x.size(), 0.0);
  return x;
}

}  // namespace

PotentialLoop::PotentialLoop(std::shared_ptr<const mechanics::MechanicalModel> plant,
                             PotentialShaping shaping)
    : ClosedLoopFor(plant, rest_state(*plant, shaping)), mechanical_(std::move(plant)) {
  parts_ = look_up(*mechanical_, shaping);
  description_ = describe(*mechanical_, shaping, parts_);
  for (size_t j = 0; j < parts_.actuated.size(); ++j)
    if (parts_.actuated[j]) actuated_.push_back(int(j));
  if (shaping.constant_compensation) {
    mechanics::Workspace<double> w(mechanical_->mechanism());
    mechanics::rnea<double>(mechanical_->mechanism(), w, shaping.rest, {}, {}, {}, parts_.constant);
  }
  if (shaping.search_rest) search_rest();
  certificate_ = Certificate("potential shaping '" + description_.name + "'");
  certificate_.name_coordinates(coordinate_names(mechanical_->description()));
  check(shaping);
  refuse_failure(certificate_);
}

/// Newton's method on V_d, with a multiple of 1 added to the Hessian so that each step falls
/// (Levenberg 1944). A point that it does not reach is found by check().
void PotentialLoop::search_rest() {
  ShapedSystem<double> s(*this);
  const auto n = size_t(mechanical_->mechanism().nq());
  std::vector<double> e(2 * n), K(n * n), minus(n);
  double damping = 1e-6;
  for (int i = 0; i < 500; ++i) {
    s.gradient(rest_, e);
    const auto H = hessian(*this, rest_);
    double size = 1e-300;
    for (size_t a = 0; a < n; ++a) size = std::max(size, std::fabs(H[a * 2 * n + a]));
    for (size_t a = 0; a < n; ++a) {
      minus[a] = -e[a];
      for (size_t b = 0; b < n; ++b)
        K[a * n + b] = H[a * 2 * n + b] + (a == b ? damping * size : 0.0);
    }
    const auto least = phs::symmetric_eigenvalues(n, K).front();
    const auto step = phs::linear_solve(n, K, minus);
    auto next = rest_;
    double most = 0;
    for (size_t a = 0; a < n; ++a) most = std::max(most, std::fabs(step[a]));
    for (size_t a = 0; a < n; ++a) next[a] += step[a];
    const bool falls = least > 0 && most < 1 && s.hamiltonian(next) <= s.hamiltonian(rest_);
    damping = falls ? std::max(1e-15, damping / 10) : damping * 10;
    if (!falls && damping < 1e6) continue;
    rest_ = next;
    if (most <= 1e-14) return;
  }
}

void PotentialLoop::check(const PotentialShaping& shaping) {
  ShapedSystem<double> s(*this);
  const auto& m = mechanical_->mechanism();
  const size_t nq = size_t(m.nq());
  std::mt19937_64 generator(1);
  double scale = 1e-300;
  UnheldForce worst;
  std::vector<double> at;
  const bool hanging = hangs(*mechanical_, parts_, rest_, shaping.tolerance);
  for (int i = 0; i < 500; ++i) {
    auto x = phs::random_state(description_, 1.0, generator);
    std::fill(x.begin() + long(nq), x.end(), 0.0);
    const auto tau = s.wanted(x);
    for (size_t j = 0; j < tau.size(); ++j) {
      scale = std::max(scale, std::fabs(tau[j]));
      if (!parts_.actuated[j] && worst.take(tau[j], joint_at(m, int(j))))
        at.assign(x.begin(), x.begin() + long(nq));
    }
  }
  worst.certify(certificate_, scale, shaping.tolerance,
                "potential matching, relative, 500 random coordinates",
                help_of_unheld(shaping, parts_, m, worst.joint, hanging), at);
  std::vector<double> e(2 * nq);
  s.gradient(rest_, e);
  double slope = 0, stiffness = 1e-300;
  for (size_t i = 0; i < nq; ++i) slope = std::max(slope, std::fabs(e[i]));
  const auto H = hessian(*this, rest_);
  std::vector<double> K(nq * nq);
  for (size_t i = 0; i < nq; ++i)
    for (size_t j = 0; j < nq; ++j) K[i * nq + j] = H[i * 2 * nq + j];
  const auto curvature = phs::symmetric_eigenvalues(nq, K);
  stiffness = std::max(stiffness, std::fabs(curvature.back()));
  certificate_.at_most("rest point", slope / stiffness, shaping.tolerance,
                       "gradient of H_d over its greatest curvature");
  if (!shaping.compensate && !shaping.constant_compensation && m.has_gravity())
    certificate_.help(
        hanging
            ? "gravity pulls elsewhere: balance it at the rest by gravity = \"constant\", in "
              "programs constant_compensation = true, or move the springs' rests or the rest point"
            : "gravity pulls a joint without actuator there: choose a rest at which it hangs, with "
              "gravity = \"constant\" (in programs constant_compensation = true)");
  certificate_.at_least("Hessian of V_d >= 0", curvature.front() / stiffness, -shaping.tolerance,
                        "least eigenvalue at the rest point, relative");
  certificate_.help(help_of_saddle(m, parts_, K));
  int free = 0;
  for (const double k : curvature) free += std::fabs(k) <= 1e-9 * stiffness;
  std::string names, loose;
  for (const auto& c : m.coordinates()) {
    if (c.nq > 1) continue;
    double row = 0;
    for (size_t i = 0; i < nq; ++i) row = std::max(row, std::fabs(K[size_t(c.q) * nq + i]));
    if (row > 1e-9 * stiffness) continue;
    add_to_list(names, c.joint);
    if (parts_.actuated[size_t(c.v)]) continue;
    free_.push_back(c.joint);
    add_to_list(loose, c.joint);
  }
  certificate_.report("directions without stiffness", free,
                      names.empty()
                          ? "of the coordinates; a floating base and quaternions have some"
                          : "of the coordinates; among them joints: " + names +
                                (loose.empty() ? "" : "; nothing holds " + loose));
  if (!loose.empty()) certificate_.help("neither law nor model holds " + loose);
  certificate_.report("curvature of V_d", curvature.back(), "eigenvalues of the Hessian",
                      curvature);
}

template <class T>
std::unique_ptr<LoopSystem<T>> PotentialLoop::make_loop() const {
  return std::make_unique<ShapedSystem<T>>(*this);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<LoopSystem<T>> PotentialLoop::make_loop<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::energy_shaping
