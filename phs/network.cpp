#include "phs/network.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "phs/detail/network_plan.h"
#include "phs/linear_algebra.h"

namespace porthos::phs {
namespace {

using Plan = Network::Plan;
using Eigen::MatrixXd;

[[noreturn]] void refuse(const Plan& p, const std::string& why) {
  throw InvalidArgument("network '" + p.name + "': " + why);
}

/// A port of a member, found by "<member>.<port>".
struct Found {
  std::string name;
  const Plan::Member* member;
  const Port* port;
  int row;  ///< of its first input
};

Found find(const Plan& p, const std::string& name) {
  std::string members;
  for (const auto& m : p.members) {
    members += (members.empty() ? "" : ", ") + m.name;
    if (name.compare(0, m.name.size() + 1, m.name + ".") != 0) continue;
    std::string ports;
    for (const auto& port : m.model->description().ports) {
      ports += (ports.empty() ? "" : ", ") + m.name + "." + port.name;
      if (m.name + "." + port.name == name) return {name, &m, &port, m.u + port.at};
    }
    refuse(p, "unknown port '" + name + "', expected one of " + (ports.empty() ? "none" : ports));
  }
  refuse(p, "unknown port '" + name + "', expected '<member>.<port>' with a member of " +
                (members.empty() ? "none" : members));
}

Found find_component(const Plan& p, const std::string& name, int component) {
  Found f = find(p, name);
  if (component < 0 || component >= f.port->size)
    refuse(p, "port '" + name + "' has no component " + std::to_string(component) + ", it has " +
                  std::to_string(f.port->size));
  f.row += component;
  return f;
}

const char* name_of(PortKind k) { return k == PortKind::effort_in ? "effort in" : "flow in"; }

void claim(Plan& p, const Found& f, const std::string& junction) {
  std::string& by = p.joint[size_t(f.row)];
  if (!by.empty())
    refuse(p, "port '" + f.name + "' is joined by " + by + " already, and by " + junction +
                  " again: expected each port in one junction (one_junction and zero_junction take "
                  "many)");
  for (int i = 0; i < f.port->size; ++i) p.joint[size_t(f.row + i)] = junction;
}

/// The storages at two ports that both want to set the same thing.
[[noreturn]] void refuse_constraint(const Plan& p, const std::string& where, const Found& a,
                                    const Found& b) {
  const bool flow = a.port->kind == PortKind::effort_in;
  refuse(p, where + " makes '" + a.name + "' and '" + b.name + "' of one " +
                (flow ? "flow" : "effort") + ", but the storages of '" + a.member->name +
                "' and '" + b.member->name +
                "' both set theirs: that is a constraint, expected one of the two to take its " +
                (flow ? "flow" : "effort") + " from the other (put " +
                (flow ? "a spring between them, or add one inertia to the other)"
                      : "an inertia between them, or add one compliance to the other)"));
}

void require_kind(const Plan& p, const Found& f, PortKind kind, const std::string& where) {
  if (f.port->kind != kind)
    refuse(p, where + ": port '" + f.name + "' is " + name_of(f.port->kind) + ", expected " +
                  name_of(kind));
}

void require_match(const Plan& p, const Found& a, const Found& b, const std::string& where,
                   bool units) {
  if (a.port->size != b.port->size)
    refuse(p, where + ": port '" + a.name + "' has size " + std::to_string(a.port->size) +
                  " and '" + b.name + "' has size " + std::to_string(b.port->size) +
                  ", expected one size");
  const auto differ = [](const std::string& x, const std::string& y) {
    return !x.empty() && !y.empty() && x != y;
  };
  if (units && (differ(a.port->output_unit, b.port->input_unit) ||
                differ(b.port->output_unit, a.port->input_unit)))
    refuse(p, where + ": port '" + a.name + "' takes " + a.port->input_unit + " and gives " +
                  a.port->output_unit + ", port '" + b.name + "' takes " + b.port->input_unit +
                  " and gives " + b.port->output_unit +
                  ", expected that each gives what the other takes");
}

/// Inputs of ports, one after another.
std::vector<int> rows_of(const std::vector<Found>& ports) {
  std::vector<int> rows;
  for (const auto& f : ports)
    for (int i = 0; i < f.port->size; ++i) rows.push_back(f.row + i);
  return rows;
}

void require_square(const Plan& p, const Matrix& m, size_t n, const std::string& what) {
  if (size_t(m.rows) != n || size_t(m.cols) != n || m.a.size() != n * n)
    refuse(p, what + " is " + std::to_string(m.rows) + " x " + std::to_string(m.cols) +
                  ", expected " + std::to_string(n) + " x " + std::to_string(n));
  for (const double x : m.a)
    if (!std::isfinite(x)) refuse(p, what + " has an entry that is not finite");
}

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

void require_positive(const Plan& p, const Matrix& m, const std::string& what) {
  const auto e = symmetric_eigenvalues(size_t(m.rows), m.a);
  if (!e.empty() && e.front() < -1e-12 * std::max(-e.front(), e.back()))
    refuse(p, what + " has an eigenvalue " + number(e.front(), 6) +
                  " of its symmetric part, expected none below 0: it would make power");
}

void junction(Plan& p, const std::string& name, const std::vector<Network::End>& ends,
              PortKind carrier, const char* type) {
  const std::string where = std::string(type) + " '" + name + "'";
  std::vector<Found> ports;
  for (const auto& e : ends) {
    if (e.sign != 1 && e.sign != -1)
      refuse(p, where + ": the sign of '" + e.port + "' is " + std::to_string(e.sign) +
                    ", expected 1 or -1");
    ports.push_back(find(p, e.port));
  }
  int sets = -1;
  for (size_t i = 0; i < ports.size(); ++i) {
    if (ports[i].port->kind != carrier) continue;
    if (sets >= 0) refuse_constraint(p, where, ports[size_t(sets)], ports[i]);
    sets = int(i);
  }
  if (sets < 0 || ports.size() < 2)
    refuse(p, where + " has " + std::to_string(ports.size()) + " ports and " +
                  (sets < 0 ? "none that is " : "one that is ") + name_of(carrier) +
                  ", expected one such port and at least another");
  const Found& c = ports[size_t(sets)];
  for (const auto& f : ports) claim(p, f, where);
  for (size_t i = 0; i < ports.size(); ++i) {
    if (int(i) == sets) continue;
    require_match(p, c, ports[i], where, true);
    // As in a feedback: flows drive, efforts act back.
    const double sign =
        (carrier == PortKind::effort_in ? 1 : -1) * ends[i].sign * ends[size_t(sets)].sign;
    for (int k = 0; k < c.port->size; ++k) {
      p.K.push_back({ports[i].row + k, c.row + k, sign});
      p.K.push_back({c.row + k, ports[i].row + k, -sign});
    }
  }
}

void two_port(Plan& p, const std::string& where, const Found& a, const Found& b, double ratio,
              bool units) {
  if (!std::isfinite(ratio)) refuse(p, where + ": the ratio is not finite");
  require_match(p, a, b, where, units);
  claim(p, a, where);
  claim(p, b, where);
  for (int k = 0; k < a.port->size; ++k) {
    p.K.push_back({b.row + k, a.row + k, ratio});
    p.K.push_back({a.row + k, b.row + k, -ratio});
  }
}

void require_new_name(const Plan& p, const std::string& name) {
  const auto taken = [&](const auto& list) {
    return std::any_of(list.begin(), list.end(), [&](const auto& e) { return e.name == name; });
  };
  if (name.empty()) refuse(p, "an element has an empty name");
  if (taken(p.members) || taken(p.laws) || taken(p.rayleighs) || taken(p.sources) ||
      taken(p.springs) || taken(p.controls))
    refuse(p, "two elements are named '" + name + "', expected names that differ");
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

void describe(Plan& p) {
  Description d;
  d.name = p.name;
  d.nx = p.nx();
  const bool alone = p.members.size() == 1;
  d.storages.clear();
  d.traits = {};
  // What couples a member to itself adds G (K - D) Gᵀ to its J, by its skew part.
  const bool same_structure = alone && p.skew.empty();
  d.traits.canonical = same_structure && p.members[0].model->description().traits.canonical;
  d.traits.separable = same_structure && p.members[0].model->description().traits.separable;
  d.traits.lossless = p.laws.empty() && p.rayleighs.empty() && p.F.empty() && p.controls.empty();
  d.traits.autonomous = p.sources.empty() && p.controls.empty();
  p.turn_of.assign(size_t(d.nx), -1);
  int angles = 0;
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
    for (const auto& s : of.storages) d.storages.push_back(prefix + s);
    for (const auto& a : of.powers) d.powers.push_back({prefix + a.name, a.kind, a.control});
    d.traits.lossless = d.traits.lossless && of.traits.lossless;
    d.traits.autonomous = d.traits.autonomous && of.traits.autonomous;
  }
  for (auto& s : p.springs) {
    d.storages.push_back(s.name);
    s.turn = p.turn_of[size_t(s.q)];
  }
  for (const auto& l : p.laws) d.powers.push_back({l.name, PowerKind::dissipated});
  for (const auto& r : p.rayleighs) d.powers.push_back({r.name, PowerKind::dissipated});
  for (const auto& m : p.members)
    if (std::any_of(p.F.begin(), p.F.end(),
                    [&](const auto& t) { return t.row >= m.u && t.row < m.u + m.nu; }))
      d.powers.push_back({m.name + ".feedthrough", PowerKind::dissipated});
  for (const auto& s : p.sources) d.powers.push_back({s.name, PowerKind::supplied});
  for (const auto& c : p.controls) {
    d.powers.push_back({c.name, PowerKind::supplied, true});
    if (c.hold) d.powers.push_back({c.name + ".hold", PowerKind::supplied, true});
  }
  // Ports left open.
  for (const auto& m : p.members)
    for (Port port : m.model->description().ports) {
      const int row = m.u + port.at;
      const bool joined = !p.joint[size_t(row)].empty();
      if (joined) continue;
      if (port.required)
        refuse(p, "port '" + m.name + "." + port.name +
                      "' is not joined to anything, and means nothing alone: expected a junction");
      for (int k = 0; k < port.size; ++k)
        for (const auto& f : p.F)
          if (f.row == row + k || f.col == row + k)
            refuse(p, "port '" + m.name + "." + port.name +
                          "' has feedthrough and is left open, expected a junction or a source "
                          "behind an element with a state");
      port.name = (alone || m.main ? "" : m.name + ".") + port.name;
      port.at = d.nu;
      d.nu += port.size;
      for (int k = 0; k < port.size; ++k) p.open.push_back(row + k);
      d.ports.push_back(port);
    }
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
  for (auto& m : p.members)
    m.active = std::any_of(row.begin() + m.u, row.begin() + m.u + m.nu, [](bool b) { return b; });
}

}  // namespace

Network::Network(std::string name) : plan_(std::make_shared<Plan>()) {
  plan_->name = std::move(name);
}
Network::~Network() = default;
Network::Network(Network&&) noexcept = default;
Network& Network::operator=(Network&&) noexcept = default;

Network& Network::add(const std::string& name, std::shared_ptr<const Model> member) {
  require_new_name(*plan_, name);
  if (!member) refuse(*plan_, "member '" + name + "' is null");
  if (!member->holds().empty())
    refuse(*plan_, "member '" + name +
                       "' has sampled controllers inside, expected them in the outermost network");
  const Description& d = member->description();
  plan_->members.push_back({.name = name,
                            .model = std::move(member),
                            .x = plan_->nx(),
                            .nx = d.nx,
                            .u = plan_->nu(),
                            .nu = d.nu});
  plan_->joint.resize(size_t(plan_->nu()));
  return *this;
}

Network& Network::main(const std::string& name) {
  for (auto& m : plan_->members)
    if (m.name == name) {
      m.main = true;
      return *this;
    }
  refuse(*plan_, "has no member '" + name + "'");
}

Network& Network::feedback(const std::string& effort_in, const std::string& flow_in) {
  const Found a = find(*plan_, effort_in), b = find(*plan_, flow_in);
  const std::string where = "the feedback of '" + effort_in + "' and '" + flow_in + "'";
  if (a.port->kind == b.port->kind) refuse_constraint(*plan_, where, a, b);
  require_kind(*plan_, a, PortKind::effort_in, where);
  two_port(*plan_, where, a, b, 1, true);
  return *this;
}

Network& Network::transformer(const std::string& effort_in, const std::string& flow_in,
                              double ratio) {
  const Found a = find(*plan_, effort_in), b = find(*plan_, flow_in);
  const std::string where = "the transformer of '" + effort_in + "' and '" + flow_in + "'";
  if (a.port->kind == b.port->kind) refuse_constraint(*plan_, where, a, b);
  require_kind(*plan_, a, PortKind::effort_in, where);
  two_port(*plan_, where, a, b, ratio, false);
  return *this;
}

Network& Network::gyrator(const std::string& a, const std::string& b, double r) {
  const Found fa = find(*plan_, a), fb = find(*plan_, b);
  const std::string where = "the gyrator of '" + a + "' and '" + b + "'";
  require_kind(*plan_, fb, fa.port->kind, where);
  two_port(*plan_, where, fa, fb, r, false);
  return *this;
}

Network& Network::one_junction(const std::string& name, const std::vector<End>& ends) {
  junction(*plan_, name, ends, PortKind::effort_in, "1-junction");
  return *this;
}
Network& Network::zero_junction(const std::string& name, const std::vector<End>& ends) {
  junction(*plan_, name, ends, PortKind::flow_in, "0-junction");
  return *this;
}

Network& Network::couple(const std::vector<std::string>& names, const Matrix& K) {
  std::string where = "the coupling of";
  std::vector<Found> ports;
  for (const auto& n : names) {
    ports.push_back(find(*plan_, n));
    where += " '" + n + "'";
  }
  const auto rows = rows_of(ports);
  require_square(*plan_, K, rows.size(), where + ": K");
  double size = 0;
  for (const double k : K.a) size = std::max(size, std::fabs(k));
  for (int i = 0; i < K.rows; ++i)
    for (int j = 0; j <= i; ++j)
      if (std::fabs(K(i, j) + K(j, i)) > 1e-14 * size)
        refuse(*plan_, where + ": K(" + std::to_string(i) + ", " + std::to_string(j) +
                           ") = " + number(K(i, j), 6) + " and K(" + std::to_string(j) + ", " +
                           std::to_string(i) + ") = " + number(K(j, i), 6) +
                           ", expected a skew matrix: any other makes or loses power");
  for (const auto& f : ports) claim(*plan_, f, where);
  for (int i = 0; i < K.rows; ++i)
    for (int j = 0; j < i; ++j)
      if (K(i, j) != 0) {
        plan_->K.push_back({rows[size_t(i)], rows[size_t(j)], K(i, j)});
        plan_->K.push_back({rows[size_t(j)], rows[size_t(i)], -K(i, j)});
      }
  return *this;
}

Network& Network::resist(const std::string& name, const std::string& port, FunctionPtr law,
                         int component) {
  require_new_name(*plan_, name);
  if (!law) refuse(*plan_, "the law of '" + name + "' is null");
  const Found f = find_component(*plan_, port, component);
  for (const double v : {1e-6, 1e-3, 1.0, 1e3})
    for (const double rate : {v, -v}) {
      const double force = (*law)(rate);
      if (!(force * rate >= 0))
        refuse(*plan_, "the law of '" + name + "' gives " + number(force, 6) + " at " +
                           number(rate, 6) + ", expected the same sign: it would make power");
    }
  plan_->laws.push_back({name, f.row, std::move(law)});
  return *this;
}

Network& Network::resist(const std::string& name, const std::vector<std::string>& names,
                         const Matrix& D) {
  require_new_name(*plan_, name);
  std::vector<Found> ports;
  for (const auto& n : names) ports.push_back(find(*plan_, n));
  const auto rows = rows_of(ports);
  const std::string where = "the damping matrix of '" + name + "'";
  require_square(*plan_, D, rows.size(), where);
  require_positive(*plan_, D, where);
  Plan::Rayleigh r{name, {}};
  for (int i = 0; i < D.rows; ++i)
    for (int j = 0; j < D.cols; ++j)
      if (D(i, j) != 0) r.D.push_back({rows[size_t(i)], rows[size_t(j)], D(i, j)});
  plan_->rayleighs.push_back(std::move(r));
  return *this;
}

Network& Network::source(const std::string& name, const std::string& port, FunctionPtr v,
                         int component) {
  require_new_name(*plan_, name);
  if (!v) refuse(*plan_, "the source '" + name + "' is null");
  plan_->sources.push_back({name, find_component(*plan_, port, component).row, std::move(v)});
  return *this;
}

namespace {

/// The coordinates of an encoder, in the network's state.
std::vector<int> encoder_of(const Plan& p, const std::string& name, const Found& port,
                            const std::vector<std::string>& coordinates) {
  if (coordinates.empty()) return {};
  if (int(coordinates.size()) != port.port->size)
    refuse(p, "the encoder of '" + name + "' has " + std::to_string(coordinates.size()) +
                  " coordinates, expected " + std::to_string(port.port->size) +
                  ", one per component of port '" + port.name + "'");
  std::vector<int> at;
  for (const auto& c : coordinates) {
    const size_t before = at.size();
    for (const auto& b : port.member->model->description().blocks)
      if (b.size == 1 && port.member->name + "." + b.name == c) at.push_back(port.member->x + b.at);
    if (at.size() == before)
      refuse(p, "the encoder of '" + name + "': unknown coordinate '" + c +
                    "', expected one of the member '" + port.member->name + "'");
  }
  return at;
}

}  // namespace

Network& Network::control(const std::string& name, const std::string& port, LawPtr law,
                          const Control& how) {
  require_new_name(*plan_, name);
  if (!law) refuse(*plan_, "the law of the controller '" + name + "' is null");
  if (!(how.period >= 0) || !std::isfinite(how.period))
    refuse(*plan_, "the period of the controller '" + name + "' is " + number(how.period, 6) +
                       " s, expected a positive number, or 0 for a continuous one");
  if (how.period == 0 && !how.encoder.empty())
    refuse(*plan_, "the controller '" + name + "' has an encoder without a period, expected both");
  const Found f = find(*plan_, port);
  Plan::Control c{name, f.row, f.port->size, int(f.member - plan_->members.data()), std::move(law)};
  c.encoder = encoder_of(*plan_, name, f, how.encoder);
  std::vector<Found> sensors;
  for (const auto& s : how.sensors) sensors.push_back(find(*plan_, s));
  c.sensors = rows_of(sensors);
  if (how.period > 0) c.hold = std::make_shared<Hold>(Hold{name, how.period, {}, {}});
  plan_->controls.push_back(std::move(c));
  return *this;
}

Network& Network::potential(const std::string& name, const std::string& coordinate, Potential U) {
  require_new_name(*plan_, name);
  if (!U.energy || !U.slope) refuse(*plan_, "the potential '" + name + "' is null");
  std::string known;
  for (const auto& m : plan_->members)
    for (const auto& b : m.model->description().blocks) {
      if (b.momentum < 0 || b.size != 1) continue;
      known += (known.empty() ? "" : ", ") + m.name + "." + b.name;
      if (m.name + "." + b.name != coordinate) continue;
      if (!m.model->description().traits.canonical)
        refuse(*plan_,
               "potential '" + name + "': member '" + m.name +
                   "' is not canonical, expected one that is (or a spring_element at a port)");
      plan_->springs.push_back({name, m.x + b.at, m.x + b.momentum, -1, std::move(U)});
      return *this;
    }
  refuse(*plan_,
         "potential '" + name + "': unknown coordinate '" + coordinate +
             "', expected one with a momentum of its own: " + (known.empty() ? "none" : known));
}

Network& Network::feedthrough(const std::string& member, const Matrix& F) {
  for (const auto& m : plan_->members) {
    if (m.name != member) continue;
    const std::string where = "the feedthrough of '" + member + "'";
    require_square(*plan_, F, size_t(m.nu), where);
    require_positive(*plan_, F, where);
    for (int i = 0; i < F.rows; ++i)
      for (int j = 0; j < F.cols; ++j)
        if (F(i, j) != 0) plan_->F.push_back({m.u + i, m.u + j, F(i, j)});
    return *this;
  }
  refuse(*plan_, "feedthrough: unknown member '" + member + "'");
}

std::shared_ptr<const NetworkModel> Network::build() const {
  if (plan_->members.empty()) refuse(*plan_, "has no members");
  auto p = std::make_shared<Plan>(*plan_);
  for (const auto& l : p->laws)
    for (const auto& f : p->F)
      if (f.row == l.row || f.col == l.row)
        refuse(*p, "the law of '" + l.name +
                       "' acts on a port with feedthrough, expected a damping "
                       "matrix there: the loop could not be solved in advance");
  for (auto& c : p->controls) {
    for (const auto& f : p->F)
      if ((f.row >= c.row && f.row < c.row + c.size) ||
          std::find(c.sensors.begin(), c.sensors.end(), f.row) != c.sensors.end())
        refuse(*p, "the controller '" + c.name +
                       "' acts on a port with feedthrough, expected an element with a state "
                       "between them");
    if (!c.hold) continue;  // each network its own
    std::vector<double> fresh(size_t(c.size), 0.0);
    fresh.resize(fresh.size() + c.encoder.size(), NAN);  // no reading before the first
    c.hold = std::make_shared<Hold>(Hold{c.name, c.hold->period, fresh, fresh});
  }
  solve_loop(*p);
  describe(*p);
  mark_active(*p);
  find_invariants(*p);
  return std::make_shared<NetworkModel>(p);
}

}  // namespace porthos::phs
