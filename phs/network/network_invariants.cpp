// The invariants of a composition: the members' invariants that no joined port changes, and the
// linear Casimirs.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "phs/network/detail/network_plan.h"
#include "phs/scalars/derivative.h"
#include "phs/system/random_state.h"

namespace porthos::phs {
namespace {

using Plan = Network::Plan;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int samples = 3;
constexpr double zero = 1e-9;     // tolerance for numbers of size 1
constexpr int most_states = 400;  // for Casimirs: their search is cubic

/// The member's inputs that something acts on.
std::vector<int> acted_on(const Plan& p, const Plan::Member& m) {
  std::vector<int> rows;
  const auto note = [&](int row) {
    if (row >= m.u && row < m.u + m.nu) rows.push_back(row - m.u);
  };
  for (const auto& t : p.B) note(t.row);
  for (const auto& l : p.laws) note(l.row);
  for (const int row : p.pushed()) note(row);
  return rows;
}

/// ∂I/∂p · ∂U/∂z of a spring on a block, relative to its force; x and gradient: of the member.
double push_along(const Plan::BlockSpring& s, const Plan::Member& m, std::span<const double> x,
                  std::span<const double> gradient) {
  const auto n = size_t(s.size);
  std::vector<double> slope(n);
  s.U->slope(x.subspan(size_t(s.q - m.x), n), slope);
  double sum = 0, force = 0;
  for (size_t k = 0; k < n; ++k) {
    sum += gradient[size_t(s.p - m.x) + k] * slope[k];
    force = std::max(force, std::fabs(slope[k]));
  }
  return force > 0 ? sum / force : 0;
}

/// Whether each of a member's invariants is conserved: no port and no potential may act along ∇I.
std::vector<bool> stays(const Plan& p, const Plan::Member& m) {
  const Description& d = m.model->description();
  std::vector<bool> ok(size_t(d.invariant_count()), true);
  const auto rows = acted_on(p, m);
  const auto f = m.model->instantiate<double>();
  const auto dual = m.model->instantiate<Dual>();
  std::mt19937_64 generator(1);
  const size_t n = size_t(d.nx);
  for (int sample = 0; sample < samples; ++sample) {
    const auto x = random_state(d, 1, generator);
    std::vector<Dual> xd(x.begin(), x.end()), values(ok.size());
    std::vector<std::vector<double>> gradient(ok.size(), std::vector<double>(n));
    along_each(xd, [&](size_t i) {
      dual->invariants(xd, values);
      for (size_t k = 0; k < ok.size(); ++k) gradient[k][i] = values[k].d;
    });
    std::vector<double> y(size_t(d.nu));
    for (size_t k = 0; k < ok.size(); ++k) {
      double size = 0;
      for (const double g : gradient[k]) size = std::max(size, std::fabs(g));
      f->output(x, gradient[k], y);
      for (const int r : rows) ok[k] = ok[k] && std::fabs(y[size_t(r)]) <= zero * size;
      for (const auto& s : p.springs)
        if (s.p >= m.x && s.p < m.x + m.nx)
          ok[k] = ok[k] && std::fabs(gradient[k][size_t(s.p - m.x)]) <= zero * size;
      for (const auto& s : p.block_springs)
        if (s.p >= m.x && s.p < m.x + m.nx)
          ok[k] = ok[k] && std::fabs(push_along(s, m, x, gradient[k])) <= zero * size;
    }
  }
  return ok;
}

/// Columns that a Casimir's gradient must be orthogonal to: (J - R)(x) at some states, and the
/// directions in which sources, controllers and their tanks act.
MatrixXd moving_directions(const NetworkModel& model, const Plan& p) {
  const auto f = model.instantiate<double>();
  const int n = p.nx();
  std::mt19937_64 generator(2);
  const auto pushed = p.pushed();
  MatrixXd all(n, samples * (n + int(pushed.size() + p.tanks.size())));
  int at = 0;
  std::vector<double> unit(size_t(n), 0.0), J(unit), R(unit);
  for (int sample = 0; sample < samples; ++sample) {
    const auto x = random_state(p.description, 1, generator);
    for (int j = 0; j < n; ++j) {
      unit[size_t(j)] = 1;
      f->apply_structure(x, unit, J);
      f->apply_dissipation(x, unit, R);
      unit[size_t(j)] = 0;
      for (int i = 0; i < n; ++i) all(i, at) = J[size_t(i)] - R[size_t(i)];
      ++at;
    }
    for (const int row : pushed) {
      all.col(at).setZero();
      for (const auto& m : p.members) {
        if (row < m.u || row >= m.u + m.nu) continue;
        std::vector<double> u(size_t(m.nu), 0.0), Gu(size_t(m.nx));
        u[size_t(row - m.u)] = 1;
        m.model->instantiate<double>()->apply_input(std::span(x).subspan(size_t(m.x), size_t(m.nx)),
                                                    u, Gu);
        for (int i = 0; i < m.nx; ++i) all(m.x + i, at) = Gu[size_t(i)];
      }
      ++at;
    }
    for (const auto& k : p.tanks) all.col(at++) = VectorXd::Unit(n, k.x);
  }
  return all;
}

std::string name_of(const Description& d, int k) {
  for (const auto& b : d.blocks) {
    if (k >= b.at && k < b.at + b.size)
      return b.size == 1 ? b.name : b.name + "[" + std::to_string(k - b.at) + "]";
    if (b.momentum >= 0 && k >= b.momentum && k < b.momentum + b.size)
      return "p(" + b.name + ")" + (b.size == 1 ? "" : "[" + std::to_string(k - b.momentum) + "]");
  }
  return "x[" + std::to_string(k) + "]";
}

/// Constraint forces change momenta.
bool touches_momenta(const Description& d, const Casimir& c) {
  for (const auto& b : d.blocks)
    for (const auto& [at, weight] : c.terms)
      if (b.momentum >= 0 && at >= b.momentum && at < b.momentum + b.size) return true;
  return false;
}

void find_casimirs(Plan& p) {
  const auto bare = std::make_shared<Plan>(p);
  const NetworkModel model(bare);
  MatrixXd moving = moving_directions(model, p);
  const double size = moving.cwiseAbs().maxCoeff();
  if (size > 0) moving /= size;
  Eigen::FullPivLU<MatrixXd> lu(moving.transpose());
  lu.setThreshold(1e-10);
  if (lu.dimensionOfKernel() == 0) return;
  const MatrixXd kernel = lu.kernel();
  for (int c = 0; c < kernel.cols(); ++c) {
    VectorXd v = kernel.col(c) / kernel.col(c).cwiseAbs().maxCoeff();
    for (int i = 0; i < v.size(); ++i) {  // round near-integers
      const double whole = std::round(v[i]);
      if (std::fabs(v[i] - whole) < 1e-12) v[i] = whole;
    }
    if ((v.transpose() * moving).cwiseAbs().maxCoeff() > 1e-10) continue;
    Casimir found;
    for (int i = 0; i < v.size(); ++i) {
      if (std::fabs(v[i]) < 1e-12) continue;
      char factor[32];
      std::snprintf(factor, sizeof factor, "%.6g ", std::fabs(v[i]));
      found.text += found.text.empty() ? (v[i] < 0 ? "-" : "") : (v[i] < 0 ? " - " : " + ");
      found.text += (std::fabs(v[i]) == 1 ? "" : factor) + name_of(p.description, i);
      found.terms.emplace_back(i, v[i]);
    }
    if (!p.description.constraints.empty() && touches_momenta(p.description, found)) continue;
    p.casimirs.push_back(std::move(found));
  }
}

}  // namespace

void find_invariants(Plan& p) {
  Description& d = p.description;
  const bool alone = p.members.size() == 1;
  int at = 0;
  for (size_t i = 0; i < p.members.size(); ++i) {
    const Plan::Member& m = p.members[i];
    const auto& of = m.model->description();
    if (of.invariants.empty()) continue;
    const auto ok = stays(p, m);
    for (const auto& inv : of.invariants) {
      const auto first = ok.begin() + inv.at;
      if (!std::all_of(first, first + inv.size, [](bool b) { return b; })) continue;
      d.invariants.push_back(
          {(alone || m.main ? "" : m.name + ".") + inv.name, inv.size, at, inv.degree, inv.unit});
      for (int k = 0; k < inv.size; ++k) p.kept.push_back({int(i), inv.at + k});
      at += inv.size;
    }
  }
  if (alone || p.nx() > most_states) return;
  find_casimirs(p);
  for (size_t k = 0; k < p.casimirs.size(); ++k)
    d.invariants.push_back({"casimir." + std::to_string(k + 1), 1, at++, 1, ""});
}

}  // namespace porthos::phs
