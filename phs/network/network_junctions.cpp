// The junctions of a Network: they set inputs from outputs and conserve power.
#include <algorithm>
#include <cmath>
#include <span>

#include "phs/network/detail/network_ports.h"

namespace porthos::phs {
namespace {

using Plan = Network::Plan;

const char* name_of(PortKind k) { return k == PortKind::effort_in ? "effort in" : "flow in"; }

void claim(Plan& p, const FoundPort& f, const std::string& junction) {
  const auto own = std::span(p.joint).subspan(size_t(f.row), size_t(f.port.size));
  for (std::string& by : own) {
    if (!by.empty())
      refuse(p, "port '" + f.name + "' is joined by " + by + " already, and by " + junction +
                    " again: expected each port in one junction (one_junction and zero_junction "
                    "take many)");
    by = junction;
  }
}

/// Refuses two ports that would both set the same quantity.
[[noreturn]] void refuse_constraint(const Plan& p, const std::string& where, const FoundPort& a,
                                    const FoundPort& b) {
  const bool flow = a.port.kind == PortKind::effort_in;
  refuse(p, where + " makes '" + a.name + "' and '" + b.name + "' of one " +
                (flow ? "flow" : "effort") + ", but the storages of '" + a.member->name +
                "' and '" + b.member->name +
                "' both set theirs: that is a constraint, expected one of the two to take its " +
                (flow ? "flow" : "effort") + " from the other (put " +
                (flow ? "a spring between them, or add one inertia to the other)"
                      : "an inertia between them, or add one compliance to the other)"));
}

void require_kind(const Plan& p, const FoundPort& f, PortKind kind, const std::string& where) {
  if (f.port.kind != kind)
    refuse(p, where + ": port '" + f.name + "' is " + name_of(f.port.kind) + ", expected " +
                  name_of(kind));
}

void require_match(const Plan& p, const FoundPort& a, const FoundPort& b, const std::string& where,
                   bool units) {
  if (a.port.size != b.port.size)
    refuse(p, where + ": port '" + a.name + "' has size " + std::to_string(a.port.size) + " and '" +
                  b.name + "' has size " + std::to_string(b.port.size) + ", expected one size");
  const auto differ = [](const std::string& x, const std::string& y) {
    return !x.empty() && !y.empty() && x != y;
  };
  if (units && (differ(a.port.output_unit, b.port.input_unit) ||
                differ(b.port.output_unit, a.port.input_unit)))
    refuse(p, where + ": port '" + a.name + "' takes " + a.port.input_unit + " and gives " +
                  a.port.output_unit + ", port '" + b.name + "' takes " + b.port.input_unit +
                  " and gives " + b.port.output_unit +
                  ", expected that each gives what the other takes");
}

void junction(Plan& p, const std::string& name, const std::vector<Network::End>& ends,
              PortKind carrier, const char* type) {
  const std::string where = std::string(type) + " '" + name + "'";
  std::vector<FoundPort> ports;
  for (const auto& e : ends) {
    if (e.sign != 1 && e.sign != -1)
      refuse(p, where + ": the sign of '" + e.port + "' is " + std::to_string(e.sign) +
                    ", expected 1 or -1");
    ports.push_back(find_port(p, e.port));
  }
  int sets = -1;
  for (size_t i = 0; i < ports.size(); ++i) {
    if (ports[i].port.kind != carrier) continue;
    if (sets >= 0) refuse_constraint(p, where, ports[size_t(sets)], ports[i]);
    sets = int(i);
  }
  if (sets < 0 || ports.size() < 2)
    refuse(p, where + " has " + std::to_string(ports.size()) + " ports and " +
                  (sets < 0 ? "none that is " : "one that is ") + name_of(carrier) +
                  ", expected one such port and at least another");
  const FoundPort& c = ports[size_t(sets)];
  for (const auto& f : ports) claim(p, f, where);
  for (size_t i = 0; i < ports.size(); ++i) {
    if (int(i) == sets) continue;
    require_match(p, c, ports[i], where, true);
    // As in feedback(): flows drive, efforts act back.
    const double sign =
        (carrier == PortKind::effort_in ? 1 : -1) * ends[i].sign * ends[size_t(sets)].sign;
    for (int k = 0; k < c.port.size; ++k) {
      p.K.push_back({ports[i].row + k, c.row + k, sign});
      p.K.push_back({c.row + k, ports[i].row + k, -sign});
    }
  }
}

void two_port(Plan& p, const std::string& where, const FoundPort& a, const FoundPort& b,
              double ratio, bool units) {
  if (!std::isfinite(ratio)) refuse(p, where + ": the ratio is not finite");
  require_match(p, a, b, where, units);
  claim(p, a, where);
  claim(p, b, where);
  for (int k = 0; k < a.port.size; ++k) {
    p.K.push_back({b.row + k, a.row + k, ratio});
    p.K.push_back({a.row + k, b.row + k, -ratio});
  }
}

}  // namespace

Network& Network::feedback(const std::string& effort_in, const std::string& flow_in) {
  const FoundPort a = find_port(*plan_, effort_in), b = find_port(*plan_, flow_in);
  const std::string where = "the feedback of '" + effort_in + "' and '" + flow_in + "'";
  if (a.port.kind == b.port.kind) refuse_constraint(*plan_, where, a, b);
  require_kind(*plan_, a, PortKind::effort_in, where);
  two_port(*plan_, where, a, b, 1, true);
  return *this;
}

Network& Network::transformer(const std::string& effort_in, const std::string& flow_in,
                              double ratio) {
  const FoundPort a = find_port(*plan_, effort_in), b = find_port(*plan_, flow_in);
  const std::string where = "the transformer of '" + effort_in + "' and '" + flow_in + "'";
  if (a.port.kind == b.port.kind) refuse_constraint(*plan_, where, a, b);
  require_kind(*plan_, a, PortKind::effort_in, where);
  two_port(*plan_, where, a, b, ratio, false);
  return *this;
}

Network& Network::gyrator(const std::string& a, const std::string& b, double r) {
  const FoundPort fa = find_port(*plan_, a), fb = find_port(*plan_, b);
  const std::string where = "the gyrator of '" + a + "' and '" + b + "'";
  require_kind(*plan_, fb, fa.port.kind, where);
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
  std::vector<FoundPort> ports;
  for (const auto& n : names) {
    ports.push_back(find_port(*plan_, n));
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

}  // namespace porthos::phs
