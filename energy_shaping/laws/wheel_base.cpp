#include "energy_shaping/laws/wheel_base.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "mechanics/crba.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/system/random_state.h"

namespace porthos::energy_shaping {
namespace {

[[noreturn]] void refuse_wheels(const std::string& name, const std::string& why) {
  throw InvalidArgument("wheels of '" + name + "': " + why);
}

}  // namespace

template <class T>
auto WheelBase::Parts::evaluator() const {
  return [parts = *this, s = shaped->loop<T>()](T t, std::span<const T> x, std::span<T> u) mutable {
    s->law(t, x, u);
    for (size_t w = 0; w < parts.inputs.size(); ++w) {
      T tau(0.0);
      for (size_t k = 0; k < 3; ++k) tau = tau + T(parts.allocate[3 * w + k]) * u[parts.base + k];
      if (!parts.limits.empty())
        tau = phs::max(phs::min(tau, T(parts.limits[w])), T(-parts.limits[w]));
      if (!parts.capacities.empty()) {  // p_w' = τ_w: at most what is left, over the period
        const T p = x[parts.momenta[w]], full(parts.capacities[w]), rate(1 / parts.period);
        const T most = phs::max((full - p) * rate, T(0.0)),
                least = phs::min((-full - p) * rate, T(0.0));
        tau = phs::max(phs::min(tau, most), least);
      }
      u[parts.inputs[w]] = tau;
    }
    for (size_t k = 0; k < 3; ++k) u[parts.base + k] = T(0.0);
  };
}

WheelBase::WheelBase(std::shared_ptr<const PotentialLoop> shaped, WheelBaseOptions options)
    : shaped_(std::move(shaped)) {
  const auto& model = shaped_->mechanical();
  const auto& m = model.mechanism();
  const std::string& name = shaped_->description().name;
  const auto base = port_offsets(model.description(), {options.base_port});
  if (base.size() != 6)
    refuse_wheels(name, fmt::format("port '{}' has {} numbers, expected the 6 of a free base",
                                    options.base_port, base.size()));
  if (shaped_->parts().zero_momentum)
    refuse_wheels(name, "the shaping is one of zero momentum, expected the base actuated");
  parts_.shaped = shaped_;
  parts_.base = size_t(base[0]);
  for (const int b : base)
    if (std::find(shaped_->actuated().begin(), shaped_->actuated().end(), b) ==
        shaped_->actuated().end())
      refuse_wheels(name, "the shaping has no actuator at '" + options.base_port +
                              "', expected one to share out");
  for (const auto& port : options.wheels) {
    const auto at = port_offsets(model.description(), {port});
    const auto c = std::find_if(m.coordinates().begin(), m.coordinates().end(),
                                [&](const auto& j) { return j.v == at[0] && j.nq == 1; });
    if (at.size() != 1 || at[0] >= m.nv() || c == m.coordinates().end())
      refuse_wheels(name,
                    "port '" + port + "' is no joint of one degree of freedom, expected a wheel's");
    if (shaped_->parts().damping[size_t(at[0])] != 0)
      refuse_wheels(name, "the shaping has damping at the wheel '" + port + "', expected none");
    for (const auto& s : shaped_->parts().joints)
      if (s.v == size_t(at[0]))
        refuse_wheels(name, "the shaping has a spring at the wheel '" + port + "', expected none");
    parts_.inputs.push_back(size_t(at[0]));
    parts_.momenta.push_back(size_t(m.nq() + c->q));
  }
  if (!options.limits.empty()) require_size("limits", options.limits.size(), options.wheels.size());
  parts_.limits = options.limits;
  if (!options.capacities.empty()) {
    require_size("capacities", options.capacities.size(), options.wheels.size());
    if (!(options.period > 0))
      refuse_wheels(name, "capacities are for torques that are held, expected a period above 0");
  }
  parts_.capacities = options.capacities;
  parts_.period = options.period;

  // M's column of a wheel: I_w on the diagonal, I_w a in the base's rows.
  const size_t n = size_t(m.nv()), count = parts_.inputs.size();
  mechanics::Workspace<double> w(m);
  std::vector<double> M(n * n), A(3 * count), AA(9, 0.0);
  mechanics::crba<double>(m, w, std::span(shaped_->rest()).first(size_t(m.nq())), M);
  for (size_t i = 0; i < count; ++i) {
    parts_.inertia.push_back(M[parts_.inputs[i] * (n + 1)]);
    for (size_t k = 0; k < 3; ++k)
      A[k * count + i] = M[(parts_.base + k) + n * parts_.inputs[i]] / parts_.inertia[i];
  }
  for (size_t a = 0; a < 3; ++a)
    for (size_t b = 0; b < 3; ++b)
      for (size_t i = 0; i < count; ++i) AA[a * 3 + b] += A[a * count + i] * A[b * count + i];
  certificate_ = Certificate("wheels of '" + name + "'");
  const auto span = phs::symmetric_eigenvalues(3, AA);
  certificate_.at_least("axes span", count ? span.front() : 0, 1e-6,
                        "least eigenvalue of A Aᵀ, axes of length 1", {});
  refuse_failure(certificate_);
  parts_.allocate.resize(3 * count);
  for (size_t k = 0; k < 3; ++k) {  // -Aᵀ(A Aᵀ)⁻¹
    std::vector<double> unit(3, 0.0);
    unit[k] = 1;
    const auto s = phs::linear_solve(3, AA, unit);
    for (size_t i = 0; i < count; ++i)
      for (size_t a = 0; a < 3; ++a) parts_.allocate[3 * i + k] -= A[a * count + i] * s[a];
  }
  actuated_ = shaped_->actuated();
  for (const size_t u : parts_.inputs)
    if (std::find(actuated_.begin(), actuated_.end(), int(u)) == actuated_.end())
      actuated_.push_back(int(u));
  check(options);
  refuse_failure(certificate_);
}

/// Checks at random states, without limits: p_w' = τ_w, that nothing depends on a wheel's angle,
/// and H_d' against the damping.
void WheelBase::check(const WheelBaseOptions& options) {
  const auto& plant = shaped_->mechanical();
  const auto f = plant.instantiate<double>();
  const auto loop = shaped_->loop<double>();
  auto parts = parts_;
  parts.limits.clear();
  parts.capacities.clear();
  auto u_of = parts.evaluator<double>();
  const size_t nx = size_t(plant.description().nx);
  std::mt19937_64 generator(1);
  std::vector<double> u(size_t(plant.description().nu)), dx(nx), e(nx);
  double wheel = 0, balance = 0;
  std::vector<double> at_wheel, at_balance;
  for (int i = 0; i < options.samples; ++i) {
    const auto x = phs::random_state(plant.description(), 1.0, generator);
    u_of(0.0, x, u);
    f->field(0.0, x, u, dx);
    loop->gradient(x, e);
    double power = 0, size = dissipation(x), moment = 1e-300, off = 0;
    for (const size_t w : parts.inputs) moment = std::max(moment, std::fabs(u[w]));
    for (size_t w = 0; w < parts.inputs.size(); ++w) {
      off = std::max(off, std::fabs(dx[parts.momenta[w]] - u[parts.inputs[w]]) / moment);
      e[parts.momenta[w]] -= x[parts.momenta[w]] / parts.inertia[w];
    }
    for (size_t k = 0; k < nx; ++k) {
      power += e[k] * dx[k];
      size += std::fabs(e[k] * dx[k]);
    }
    if (off > wheel) {
      wheel = off;
      at_wheel = x;
    }
    const double defect = std::fabs(power + dissipation(x)) / size;
    if (defect > balance) {
      balance = defect;
      at_balance = x;
    }
  }
  const std::string over = fmt::format("relative, {} random states", options.samples);
  certificate_.at_most("wheels axisymmetric", wheel, options.tolerance, "|p_w' - τ_w|, " + over,
                       at_wheel);
  certificate_.at_most("balance of H_d", balance, options.tolerance,
                       "|H_d' + damping|, any spin and momentum, " + over, at_balance);
  certificate_.report("wheels", double(parts.inputs.size()), "inertias [kg m²]", parts.inertia);
}

void WheelBase::law(std::span<const double> x, std::span<double> u) const {
  parts_.evaluator<double>()(0.0, x, u);
}
double WheelBase::hamiltonian(std::span<const double> x) const {
  double H = shaped_->loop<double>()->hamiltonian(x);
  for (size_t w = 0; w < parts_.momenta.size(); ++w)
    H -= x[parts_.momenta[w]] * x[parts_.momenta[w]] / (2 * parts_.inertia[w]);
  return H;
}
double WheelBase::dissipation(std::span<const double> x) const {
  const auto loop = shaped_->loop<double>();
  std::vector<double> e(x.size()), Re(x.size());
  loop->gradient(x, e);
  loop->apply_dissipation(x, e, Re);
  double P = 0;
  for (size_t i = 0; i < e.size(); ++i) P += e[i] * Re[i];
  return P;
}
std::vector<PortLaw> WheelBase::port_laws() const {
  const auto& plant = shaped_->plant().description();
  auto laws = energy_shaping::port_laws(parts_, plant, actuated_);
  for (size_t w = 0; w < parts_.inputs.size(); ++w) {
    PortLaw* law = law_of(laws, plant, int(parts_.inputs[w]));
    if (!law) continue;
    if (!parts_.limits.empty()) law->limit = parts_.limits[w];
    if (!parts_.capacities.empty())
      law->hindrance = [at = parts_.momenta[w],
                        full = parts_.capacities[w]](std::span<const double> x) {
        return std::fabs(x[at]) >= full * (1 - 1e-12) ? "has a full wheel" : nullptr;
      };
  }
  return laws;
}

}  // namespace porthos::energy_shaping
