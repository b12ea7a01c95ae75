// Builds the model from what a Network has collected: the algebraic loop, the description.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "phs/network/detail/network_ports.h"

namespace porthos::phs {
namespace {

using Plan = Network::Plan;
using Eigen::MatrixXd;

MatrixXd dense(const std::vector<Plan::Term>& terms, int n) {
  MatrixXd d = MatrixXd::Zero(n, n);
  for (const auto& t : terms) d(t.row, t.col) += t.factor;
  return d;
}
std::vector<Plan::Term> terms(const MatrixXd& d, double least = 0) {
  std::vector<Plan::Term> list;
  for (int i = 0; i < d.rows(); ++i)
    for (int j = 0; j < d.cols(); ++j)
      if (std::fabs(d(i, j)) > least) list.push_back({i, j, d(i, j)});
  return list;
}

/// u = (K - D) y + v and y = y0 + F u, solved for u.
void solve_loop(Plan& p) {
  const int n = p.nu();
  MatrixXd A = dense(p.K, n);
  for (const auto& r : p.rayleighs) A -= dense(r.D, n);
  MatrixXd B = A;
  p.M.clear();
  if (!p.F.empty()) {
    const MatrixXd F = dense(p.F, n), loop = MatrixXd::Identity(n, n) - A * F;
    const Eigen::FullPivLU<MatrixXd> lu(loop);
    if (!lu.isInvertible() || lu.rcond() < 1e-13)
      refuse(p,
             "the algebraic loop through the feedthrough has no unique solution: I - (K - D) F is "
             "singular, expected an invertible matrix");
    const MatrixXd M = lu.inverse();
    const double least = 1e-15 * M.cwiseAbs().maxCoeff();
    B = M * A;
    p.M = terms(M, least);
  }
  const double least = p.F.empty() ? 0 : 1e-15 * B.cwiseAbs().maxCoeff();
  p.B = terms(B, least);
  p.skew = terms((B - B.transpose()) / 2, least);
  p.sym = terms((B + B.transpose()) / 2, least);
}

/// Ports that nothing is joined to become ports of the whole.
void leave_open(Plan& p, Description& d) {
  for (const auto& m : p.members)
    for (Port port : m.model->description().ports) {
      const int row = m.u + port.at;
      const auto own = std::span(p.joint).subspan(size_t(row), size_t(port.size));
      if (std::ranges::any_of(own, [](const std::string& by) { return !by.empty(); })) continue;
      if (port.required)
        refuse(p, "port '" + m.name + "." + port.name +
                      "' is not joined to anything, and means nothing alone: expected a junction");
      for (int k = 0; k < port.size; ++k)
        for (const auto& f : p.F)
          if (f.row == row + k || f.col == row + k)
            refuse(p, "port '" + m.name + "." + port.name +
                          "' has feedthrough and is left open, expected a junction or a source "
                          "behind an element with a state");
      port.name = (p.members.size() == 1 || m.main ? "" : m.name + ".") + port.name;
      port.at = d.nu;
      d.nu += port.size;
      for (int k = 0; k < port.size; ++k) p.open.push_back(row + k);
      d.ports.push_back(port);
    }
}

/// The ledger of what the network itself has, in the order of NetworkSystem::powers.
void list_powers(const Plan& p, Description& d) {
  for (const auto& l : p.laws) d.powers.push_back({l.name, PowerKind::dissipated});
  for (const auto& b : p.bristles) d.powers.push_back({b.name + ".loss", PowerKind::dissipated});
  for (const auto& r : p.rayleighs) d.powers.push_back({r.name, PowerKind::dissipated});
  for (const auto& m : p.members)
    if (std::any_of(p.F.begin(), p.F.end(),
                    [&](const auto& t) { return t.row >= m.u && t.row < m.u + m.nu; }))
      d.powers.push_back({m.name + ".feedthrough", PowerKind::dissipated});
  for (const auto& s : p.sources) d.powers.push_back({s.name, PowerKind::supplied});
  const auto supply = [](int tank) {
    return tank < 0 ? PowerKind::supplied : PowerKind::observed;  // a tank's loss is its gain
  };
  for (const auto& c : p.controls) {
    d.powers.push_back({c.name, supply(c.tank), true});
    if (c.hold && c.tank < 0) d.powers.push_back({c.name + ".hold", PowerKind::supplied, true});
  }
  for (const auto& c : p.sampled) d.powers.push_back({c.name, supply(c.tank), true});
  for (const auto& f : p.filling) d.powers.push_back({f.name, PowerKind::dissipated});
  for (const auto& k : p.tanks) d.powers.push_back({k.name + ".valve", PowerKind::dissipated});
}

void describe(Plan& p) {
  Description d;
  d.name = p.name;
  d.nx = p.nx();
  const bool alone = p.members.size() == 1;
  d.storages.clear();
  d.traits = {};
  // Coupling a member to itself adds the skew part of G (K - D) Gᵀ to its J.
  const bool same_structure = alone && p.skew.empty();
  d.traits.canonical = same_structure && p.members[0].model->description().traits.canonical;
  d.traits.separable = same_structure && p.members[0].model->description().traits.separable;
  const bool controlled = !p.controls.empty() || !p.sampled.empty() || !p.filling.empty();
  d.traits.lossless =
      p.laws.empty() && p.bristles.empty() && p.rayleighs.empty() && p.F.empty() && !controlled;
  d.traits.autonomous = p.sources.empty() && !controlled;
  d.traits.quadratic = true;
  p.turn_of.assign(size_t(d.nx), -1);
  int angles = 0, constraint_rows = 0;
  for (auto& m : p.members) {
    const Description& of = m.model->description();
    const std::string prefix = alone || m.main ? "" : m.name + ".";
    m.angle = angles;
    m.stored = int(d.storages.size());
    m.powers = int(d.powers.size());
    for (Block b : of.blocks) {
      b.name = prefix + b.name;
      b.at += m.x;
      if (b.momentum >= 0) b.momentum += m.x;
      if (b.kind == BlockKind::angle) p.turn_of[size_t(b.at)] = angles++;
      d.blocks.push_back(b);
    }
    m.angles = angles - m.angle;
    for (ConstraintBlock c : of.constraints) {
      c.name = prefix + c.name;
      for (auto& r : c.reactions) r.name = prefix + r.name;
      c.at += constraint_rows;
      if (c.power >= 0) c.power += m.powers;
      d.constraints.push_back(c);
    }
    constraint_rows += of.constraint_count();
    for (const auto& s : of.storages) d.storages.push_back(prefix + s);
    for (const auto& a : of.powers) d.powers.push_back({prefix + a.name, a.kind, a.control});
    d.traits.lossless = d.traits.lossless && of.traits.lossless;
    d.traits.autonomous = d.traits.autonomous && of.traits.autonomous;
    const bool moves = std::any_of(of.blocks.begin(), of.blocks.end(),
                                   [](const Block& b) { return b.momentum >= 0; });
    d.traits.quadratic = d.traits.quadratic && (of.traits.quadratic || !moves);
  }
  for (auto& s : p.springs) {
    d.storages.push_back(s.name);
    s.turn = p.turn_of[size_t(s.q)];
  }
  for (const auto& s : p.block_springs) d.storages.push_back(s.name);
  list_powers(p, d);
  leave_open(p, d);
  p.description = std::move(d);
}

void mark_active(Plan& p) {
  std::vector<bool> row(size_t(p.nu()), false);
  for (const auto* list : {&p.B, &p.F})
    for (const auto& t : *list) row[size_t(t.row)] = row[size_t(t.col)] = true;
  for (const auto& l : p.laws) row[size_t(l.row)] = true;
  for (const auto& s : p.sources) row[size_t(s.row)] = true;
  for (const auto& c : p.controls)
    for (int k = 0; k < c.size; ++k) row[size_t(c.row + k)] = true;
  for (const auto& c : p.controls)
    for (const int sensor : c.sensors) row[size_t(sensor)] = true;
  for (const auto& c : p.sampled)
    for (const int own : c.rows) row[size_t(own)] = true;
  for (const auto& f : p.filling)
    for (const int own : f.rows) row[size_t(own)] = true;
  for (auto& m : p.members)
    m.active = std::any_of(row.begin() + m.u, row.begin() + m.u + m.nu, [](bool b) { return b; });
  for (const auto& k : p.tanks) p.members[size_t(k.member)].active = true;
}

}  // namespace

std::shared_ptr<const NetworkModel> Network::build() const {
  if (plan_->members.empty()) refuse(*plan_, "has no members");
  auto p = std::make_shared<Plan>(*plan_);
  for (const auto& l : p->laws)
    for (const auto& f : p->F)
      if (f.row == l.row || f.col == l.row)
        refuse(*p, "the law of '" + l.name +
                       "' acts on a port with feedthrough, expected a damping "
                       "matrix there: the loop could not be solved in advance");
  for (const auto& b : p->bristles)
    for (const auto& f : p->F)
      if (f.row == b.rate || f.col == b.rate)
        refuse(*p, "'" + b.name +
                       "' acts on a port with feedthrough, expected an element with a "
                       "state between them");
  for (auto& c : p->controls) {
    for (const auto& f : p->F)
      if ((f.row >= c.row && f.row < c.row + c.size) ||
          std::find(c.sensors.begin(), c.sensors.end(), f.row) != c.sensors.end())
        refuse(*p, "the controller '" + c.name +
                       "' acts on a port with feedthrough, expected an element with a state "
                       "between them");
    if (!c.hold) continue;  // each network has its own hold
    std::vector<double> fresh(size_t(c.size), 0.0);
    fresh.resize(fresh.size() + c.encoder.size(), NAN);  // no encoder reading yet
    if (c.gate)
      for (const double number : c.gate->fresh()) fresh.push_back(number);
    c.hold = std::make_shared<Hold>(Hold{c.name, c.hold->period, fresh, {}, size_t(c.size)});
  }
  for (auto& c : p->sampled) {
    for (const auto& f : p->F)
      if (std::find(c.rows.begin(), c.rows.end(), f.row) != c.rows.end())
        refuse(*p, "the controller '" + c.name +
                       "' acts on a port with feedthrough, expected an element with a state "
                       "between them");
    std::vector<double> fresh(c.rows.size(), 0.0);
    const auto own = c.law->fresh();
    fresh.insert(fresh.end(), own.begin(), own.end());
    c.hold =
        std::make_shared<Hold>(Hold{c.name, c.hold->period, fresh, c.law->shown(), c.rows.size()});
    for (auto& number : c.hold->shown) number.at += c.rows.size();
  }
  for (const auto& d : p->filling)
    for (const auto& f : p->F)
      if (std::ranges::find(d.rows, f.row) != d.rows.end())
        refuse(*p, "'" + d.name +
                       "' acts on a port with feedthrough, expected an element with a "
                       "state between them");
  solve_loop(*p);
  describe(*p);
  mark_active(*p);
  find_invariants(*p);
  return std::make_shared<NetworkModel>(p);
}

}  // namespace porthos::phs
