#include "phs/network/detail/network_ports.h"

#include <algorithm>
#include <cmath>

namespace porthos::phs {

void refuse(const Network::Plan& p, const std::string& why) {
  throw InvalidArgument("network '" + p.name + "': " + why);
}

namespace {

/// The unit of component k: "N m; N" is the first for the first half, the second for the others.
std::string unit_of(const std::string& units, int k, int size) {
  const auto split = units.find("; ");
  if (split == units.npos) return units;
  return 2 * k < size ? units.substr(0, split) : units.substr(split + 2);
}

/// Component k of a port as a port of its own.
FoundPort component_of(FoundPort f, int k) {
  f.port.input_unit = unit_of(f.port.input_unit, k, f.port.size);
  f.port.output_unit = unit_of(f.port.output_unit, k, f.port.size);
  f.port.size = 1;
  f.row += k;
  return f;
}

}  // namespace

FoundPort find_port(const Network::Plan& p, const std::string& name) {
  std::string members;
  for (const auto& m : p.members) {
    add_to_list(members, m.name);
    if (name.compare(0, m.name.size() + 1, m.name + ".") != 0) continue;
    std::string ports;
    for (const auto& port : m.model->description().ports) {
      add_to_list(ports, m.name + "." + port.name);
      const std::string full = m.name + "." + port.name;
      const FoundPort whole{name, &m, port, m.u + port.at};
      if (full == name) return whole;
      if (name.compare(0, full.size() + 1, full + "[") != 0) continue;
      for (int k = 0; k < port.size; ++k)
        if (name == full + "[" + std::to_string(k) + "]") return component_of(whole, k);
    }
    refuse(p, "unknown port '" + name + "', expected one of " + (ports.empty() ? "none" : ports));
  }
  refuse(p, "unknown port '" + name + "', expected '<member>.<port>' with a member of " +
                (members.empty() ? "none" : members));
}

FoundPort find_component(const Network::Plan& p, const std::string& name, int component) {
  const FoundPort f = find_port(p, name);
  if (component < 0 || component >= f.port.size)
    refuse(p, "port '" + name + "' has no component " + std::to_string(component) + ", it has " +
                  std::to_string(f.port.size));
  return component_of(f, component);
}

void require_new_name(const Network::Plan& p, const std::string& name) {
  const auto taken = [&](const auto& list) {
    return std::any_of(list.begin(), list.end(), [&](const auto& e) { return e.name == name; });
  };
  if (name.empty()) refuse(p, "an element has an empty name");
  if (taken(p.members) || taken(p.laws) || taken(p.rayleighs) || taken(p.sources) ||
      taken(p.springs) || taken(p.block_springs) || taken(p.controls) || taken(p.sampled) ||
      taken(p.filling))
    refuse(p, "two elements are named '" + name + "', expected another name for one of them");
}

std::vector<int> rows_of(const std::vector<FoundPort>& ports) {
  std::vector<int> rows;
  for (const auto& f : ports)
    for (int i = 0; i < f.port.size; ++i) rows.push_back(f.row + i);
  return rows;
}

void require_square(const Network::Plan& p, const Matrix& m, size_t n, const std::string& what) {
  if (size_t(m.rows) != n || size_t(m.cols) != n || m.a.size() != n * n)
    refuse(p, what + " is " + std::to_string(m.rows) + " x " + std::to_string(m.cols) +
                  ", expected " + std::to_string(n) + " x " + std::to_string(n));
  for (const double x : m.a)
    if (!std::isfinite(x)) refuse(p, what + " has an entry that is not finite");
}

std::vector<int> coupled_rows(const Network::Plan& p) {
  std::vector<bool> row(size_t(p.nu()), false);
  for (const auto& b : p.B) row[size_t(b.row)] = row[size_t(b.col)] = true;
  for (const auto& l : p.laws) row[size_t(l.row)] = true;
  for (const auto& c : p.controls) {
    if (c.hold) continue;
    for (int k = 0; k < c.size; ++k) row[size_t(c.row + k)] = true;
    for (const int sensor : c.sensors) row[size_t(sensor)] = true;
  }
  for (const auto& f : p.filling)
    for (const int own : f.rows) row[size_t(own)] = true;
  for (const auto& m : p.M)  // M is the identity unless there are loops
    if (row[size_t(m.col)]) row[size_t(m.row)] = true;
  std::vector<int> list;
  for (size_t k = 0; k < row.size(); ++k)
    if (row[k]) list.push_back(int(k));
  return list;
}

size_t spring_numbers(const Network::Plan& p) {
  size_t n = p.springs.size();
  for (const auto& s : p.block_springs) n += size_t(s.size);
  return n;
}

}  // namespace porthos::phs
