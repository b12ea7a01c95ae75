#include "phs/network/network.h"

#include <algorithm>
#include <cmath>

#include "phs/linear_algebra/linear_algebra.h"
#include "phs/network/detail/network_ports.h"

namespace porthos::phs {
namespace {

using Plan = Network::Plan;

void require_positive(const Plan& p, const Matrix& m, const std::string& what) {
  const auto e = symmetric_eigenvalues(size_t(m.rows), m.a);
  if (!e.empty() && e.front() < -1e-12 * std::max(-e.front(), e.back()))
    refuse(p, what + " has an eigenvalue " + number(e.front(), 6) +
                  " of its symmetric part, expected none below 0: it would make power");
}

/// Offsets of an encoder's coordinates in the network's state.
std::vector<int> encoder_of(const Plan& p, const std::string& name, const FoundPort& port,
                            const std::vector<std::string>& coordinates) {
  if (coordinates.empty()) return {};
  if (int(coordinates.size()) != port.port.size)
    refuse(p, "the encoder of '" + name + "' has " + std::to_string(coordinates.size()) +
                  " coordinates, expected " + std::to_string(port.port.size) +
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

int Network::offset(const std::string& member) const {
  for (const auto& m : plan_->members)
    if (m.name == member) return m.x;
  refuse(*plan_, "has no member '" + member + "'");
}

Network::PortSizes Network::sizes(const std::string& port) const {
  const FoundPort f = find_port(*plan_, port);
  return {f.port.size, f.member->nx};
}

Network& Network::main(const std::string& name) {
  for (auto& m : plan_->members)
    if (m.name == name) {
      m.main = true;
      return *this;
    }
  refuse(*plan_, "has no member '" + name + "'");
}

Network& Network::resist(const std::string& name, const std::string& port, FunctionPtr law,
                         int component) {
  require_new_name(*plan_, name);
  if (!law) refuse(*plan_, "the law of '" + name + "' is null");
  const FoundPort f = find_component(*plan_, port, component);
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
  std::vector<FoundPort> ports;
  for (const auto& n : names) ports.push_back(find_port(*plan_, n));
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

Network& Network::lugre(const std::string& name, const std::string& port, const LuGre& f,
                        int component) {
  check(f);
  const FoundPort at = find_component(*plan_, port, component);
  if (at.port.kind != PortKind::effort_in)
    refuse(*plan_, "'" + name + "' rubs at port '" + port +
                       "', which takes a flow, expected one "
                       "that takes a force");
  add(name, spring_element(spring(f.bristle_stiffness),
                           at.port.input_unit == "N" ? translation : rotation));
  const int own = plan_->members.back().u;
  plan_->joint.back() = "friction '" + name + "'";
  plan_->K.push_back({own, at.row, 1});
  plan_->K.push_back({at.row, own, -1});
  plan_->bristles.push_back({name, at.row, own, f});
  return *this;
}

Network& Network::source(const std::string& name, const std::string& port, FunctionPtr v,
                         int component) {
  require_new_name(*plan_, name);
  if (!v) refuse(*plan_, "the source '" + name + "' is null");
  plan_->sources.push_back({name, find_component(*plan_, port, component).row, std::move(v)});
  return *this;
}

Network& Network::control(const std::string& name, const std::string& port, LawPtr law,
                          const Control& how) {
  require_new_name(*plan_, name);
  if (!law) refuse(*plan_, "the law of the controller '" + name + "' is null");
  if (!(how.period >= 0) || !std::isfinite(how.period))
    refuse(*plan_, "the period of the controller '" + name + "' is " + number(how.period, 6) +
                       " s, expected a positive number, or 0 for a continuous one");
  if (how.period == 0 && !how.encoder.empty())
    refuse(*plan_, "the controller '" + name + "' has an encoder without a period, expected both");
  if (how.period == 0 && how.gate)
    refuse(*plan_, "the controller '" + name + "' has a gate without a period, expected both");
  const FoundPort f = find_port(*plan_, port);
  Plan::Control c{name, f.row, f.port.size, int(f.member - plan_->members.data()), std::move(law)};
  c.encoder = encoder_of(*plan_, name, f, how.encoder);
  std::vector<FoundPort> sensors;
  for (const auto& s : how.sensors) sensors.push_back(find_port(*plan_, s));
  c.sensors = rows_of(sensors);
  c.gate = how.gate;
  c.whole = how.whole;
  c.tank = find_tank(*plan_, name, how.tank);
  if (how.period > 0) c.hold = std::make_shared<Hold>(Hold{name, how.period, {}});
  plan_->controls.push_back(std::move(c));
  return *this;
}

Network& Network::control(const std::string& name, const std::vector<std::string>& ports,
                          SampledLawPtr law, double period, const std::string& tank) {
  require_new_name(*plan_, name);
  if (!law) refuse(*plan_, "the law of the controller '" + name + "' is null");
  if (ports.empty()) refuse(*plan_, "the controller '" + name + "' has no port");
  if (!(period > 0) || !std::isfinite(period))
    refuse(*plan_, "the period of the controller '" + name + "' is " + number(period, 6) +
                       " s, expected a positive number");
  std::vector<FoundPort> found;
  for (const auto& port : ports) {
    found.push_back(find_port(*plan_, port));
    if (found.back().member != found.front().member)
      refuse(*plan_, "the controller '" + name + "' acts on '" + ports.front() + "' and '" + port +
                         "', expected ports of one member");
  }
  plan_->sampled.push_back({name, int(found.front().member - plan_->members.data()), rows_of(found),
                            std::move(law), std::make_shared<Hold>(Hold{name, period, {}}),
                            find_tank(*plan_, name, tank)});
  return *this;
}

Network& Network::potential(const std::string& name, const std::string& coordinate, Potential U) {
  require_new_name(*plan_, name);
  if (!U.energy || !U.slope) refuse(*plan_, "the potential '" + name + "' is null");
  std::string known;
  for (const auto& m : plan_->members)
    for (const auto& b : m.model->description().blocks) {
      if (b.momentum < 0 || b.size != 1) continue;
      add_to_list(known, m.name + "." + b.name);
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

Network& Network::potential(const std::string& name, const std::string& coordinate,
                            BlockPotentialPtr U) {
  require_new_name(*plan_, name);
  if (!U) refuse(*plan_, "the potential '" + name + "' is null");
  std::string known;
  for (const auto& m : plan_->members)
    for (const auto& b : m.model->description().blocks) {
      if (b.momentum < 0 || b.size != U->size() || !m.model->description().traits.canonical)
        continue;
      add_to_list(known, m.name + "." + b.name);
      if (m.name + "." + b.name != coordinate) continue;
      const int q = m.x + b.at, p = m.x + b.momentum;
      plan_->block_springs.push_back({name, q, p, b.size, std::move(U)});
      return *this;
    }
  refuse(*plan_, "potential '" + name + "': unknown coordinate '" + coordinate +
                     "', expected one of " + std::to_string(U->size()) +
                     " numbers with momenta of its own: " + (known.empty() ? "none" : known));
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

}  // namespace porthos::phs
