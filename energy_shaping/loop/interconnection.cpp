#include "energy_shaping/loop/interconnection.h"

#include <fmt/format.h>

#include <cmath>

#include "energy_shaping/loop/closed_loop.h"
#include "energy_shaping/loop/derivatives.h"
#include "phs/linear_algebra/linear_algebra.h"

namespace porthos::energy_shaping {
namespace {

using phs::Matrix;

const phs::Port& port_of(const phs::Model& model, const std::string& name) {
  return find_named(model.description().ports, name,
                    "'" + model.description().name + "' has no port");
}

std::string name_of(const phs::Description& d, int k) {
  for (const auto& b : d.blocks) {
    if (k >= b.at && k < b.at + b.size) return b.name;
    if (b.momentum >= 0 && k >= b.momentum && k < b.momentum + b.size) return "p(" + b.name + ")";
  }
  return "x[" + std::to_string(k) + "]";
}

double largest(std::span<const double> v) {
  double most = 0;
  for (const double x : v) most = std::max(most, std::fabs(x));
  return most;
}

}  // namespace

Interconnection::Interconnection(std::shared_ptr<const phs::Model> plant,
                                 std::shared_ptr<const phs::Model> controller,
                                 InterconnectionOptions options)
    : plant_(std::move(plant)), controller_(std::move(controller)) {
  const auto& d = plant_->description();
  require_size("rest", options.rest.size(), size_t(d.nx));
  phs::Network n(d.name + " with " + controller_->description().name);
  n.add("plant", plant_).add("controller", controller_);
  for (const auto& j : options.joins) {
    const std::string a = "plant." + j.plant, b = "controller." + j.controller;
    const auto& p = port_of(*plant_, j.plant);
    (void)port_of(*controller_, j.controller);
    if (p.kind == phs::PortKind::effort_in)
      n.feedback(a, b);
    else
      n.feedback(b, a);
    if (!(j.damping >= 0))
      throw InvalidArgument(
          fmt::format("damping injected at '{}' is {}, expected >= 0", j.plant, j.damping));
    if (j.damping == 0) continue;
    auto D = phs::Matrix::identity(p.size);
    for (double& y : D.a) y *= j.damping;
    n.resist("damping of " + j.plant, std::vector{a}, D);
  }
  loop_ = n.build();
  certificate_ = Certificate("control by interconnection, " + loop_->description().name);
  check_obstacle(options);
  const RestEnergy rest = find_rest(options);
  if (tie() == controller_->description().nx) check_leaf(rest, options.tolerance);
  if (options.refuse) refuse_failure(certificate_);
}

/// Checks the power that the plant loses at x*, and the directions that it damps.
void Interconnection::check_obstacle(const InterconnectionOptions& o) {
  const size_t n = o.rest.size();
  const auto plant = plant_->instantiate<double>();
  std::vector<double> e(n), Re(n), unit(n, 0.0), damped;
  plant->gradient(o.rest, e);
  plant->apply_dissipation(o.rest, e, Re);
  const double stiffest = largest(hessian(*plant_, o.rest));  // ∂H one unit of state away
  double lost = 0, size = stiffest * stiffest, resistance = 1e-300;
  for (size_t i = 0; i < n; ++i) {
    lost += e[i] * Re[i];
    size = std::max(size, e[i] * e[i]);
  }
  std::string names;
  for (size_t i = 0; i < n; ++i) {
    unit[i] = 1;
    plant->apply_dissipation(o.rest, unit, Re);
    unit[i] = 0;
    if (largest(Re) == 0) continue;
    resistance = std::max(resistance, largest(Re));
    damped.push_back(double(i));
    add_to_list(names, name_of(plant_->description(), int(i)));
  }
  certificate_.at_most("power lost at rest", lost / (resistance * std::max(size, 1e-300)),
                       o.tolerance,
                       fmt::format("dissipation obstacle: {:.3g} W for ever, of no passive "
                                   "controller; relative",
                                   lost),
                       o.rest);
  certificate_.report("damped directions", double(damped.size()),
                      "of the plant, no tie along them: " + (names.empty() ? "none" : names),
                      damped);
}

/// Finds the ξ* that holds x*, by Gauss-Newton iteration.
Interconnection::RestEnergy Interconnection::find_rest(const InterconnectionOptions& o) {
  const size_t n = o.rest.size(), nc = size_t(controller_->description().nx), N = n + nc;
  const auto loop = loop_->instantiate<double>();
  rest_ = o.rest;
  rest_.resize(N, 0.0);
  std::vector<double> f(N), g(N);
  for (int round = 0; round < 50; ++round) {
    loop->field(0.0, rest_, {}, f);
    const auto J = field_jacobian(*loop_, rest_);
    Matrix B{int(N), int(nc)}, residual{int(N), 1};
    for (size_t i = 0; i < N; ++i)
      for (size_t k = 0; k < nc; ++k) B(int(i), int(k)) = J[i * N + n + k];
    residual.a = f;
    const Matrix step = phs::pseudo_inverse(B).inverse * residual;
    for (size_t k = 0; k < nc; ++k) rest_[n + k] -= step.a[k];
    if (largest(step.a) < 1e-15) break;
  }
  loop->field(0.0, rest_, {}, f);
  loop->gradient(rest_, g);
  auto H = hessian(*loop_, rest_);
  const double scale = std::max({largest(g), largest(H), 1e-300});
  certificate_.at_most(
      "rest point", largest(f) / scale, o.tolerance,
      "field of the loop at (x*, ξ*) over the gradient of H + H_c, a unit of state away at least",
      rest_);
  return {std::move(g), std::move(H), scale};
}

/// Casimirs are linear, so their gradients follow from their values at unit states.
int Interconnection::tie() {
  const size_t n = size_t(plant_->description().nx), nc = size_t(controller_->description().nx),
               N = n + nc;
  const auto loop = loop_->instantiate<double>();
  const auto& d = loop_->description();
  std::vector<double> zero(N, 0.0), at0(size_t(d.invariant_count())), at1(at0);
  loop->invariants(zero, at0);
  const int casimirs = int(loop_->casimirs().size());
  // Of the plant's state, and of the controller's, transposed.
  Matrix Cx{casimirs, int(n)}, CcT{int(nc), casimirs};
  for (size_t i = 0; i < N; ++i) {
    zero[i] = 1;
    loop->invariants(zero, at1);
    zero[i] = 0;
    int row = 0;
    for (const auto& inv : d.invariants)
      if (inv.name.starts_with("casimir."))
        (i < n ? Cx(row++, int(i)) : CcT(int(i - n), row++)) =
            at1[size_t(inv.at)] - at0[size_t(inv.at)];
  }
  std::string texts;
  for (const auto& c : loop_->casimirs()) texts += (texts.empty() ? "" : "; ") + c.text;
  certificate_.report("Casimirs", double(casimirs), texts.empty() ? "none" : texts);
  F_ = Matrix(int(nc), int(n));
  const auto solution = phs::pseudo_inverse(CcT);
  const int tied = solution.rank;
  if (casimirs > 0) {
    F_ = transpose(solution.inverse) * Cx;
    for (double& x : F_.a) x = -x;
  }
  certificate_.at_least("controller states tied", double(tied), double(nc),
                        "by Casimirs to the plant's state", {});
  return tied;
}

/// H_d on the leaf: gradient and Hessian of H + H_c along (dx, F dx).
void Interconnection::check_leaf(const RestEnergy& rest, double tolerance) {
  const size_t N = rest_.size(), n = size_t(plant_->description().nx);
  Matrix leaf{int(N), int(n)}, slope{int(N), 1}, curvature{int(N), int(N)};
  std::copy(F_.a.begin(), F_.a.end(), leaf.a.begin() + long(n * n));
  for (int i = 0; i < int(n); ++i) leaf(i, i) = 1;
  slope.a = rest.gradient;
  curvature.a = rest.hessian;
  slope = transpose(leaf) * slope;
  curvature = transpose(leaf) * curvature * leaf;
  certificate_.at_most("gradient of H_d", largest(slope.a) / rest.scale, tolerance,
                       "at the rest point, on its leaf, relative", rest_);
  const auto values = phs::symmetric_eigenvalues(n, curvature.a);
  certificate_.at_least("Hessian of H_d >= 0", values.front() / std::max(largest(values), 1e-300),
                        -tolerance, "least eigenvalue on the leaf, relative", {});
  certificate_.report("curvature of H_d", values.front(), "eigenvalues of the Hessian", values);
}

std::vector<double> Interconnection::start(std::span<const double> x) const {
  const size_t n = size_t(plant_->description().nx);
  require_size("state of the plant", x.size(), n);
  std::vector<double> all(x.begin(), x.end());
  for (int k = 0; k < F_.rows; ++k) {
    double xi = rest_[n + size_t(k)];
    for (size_t i = 0; i < n; ++i) xi += F_(k, int(i)) * (x[i] - rest_[i]);
    all.push_back(xi);
  }
  return all;
}
double Interconnection::energy(std::span<const double> x) const {
  return loop_->instantiate<double>()->hamiltonian(start(x));
}

}  // namespace porthos::energy_shaping
