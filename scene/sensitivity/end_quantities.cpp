#include "scene/sensitivity/end_quantities.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanics/derivatives/linearised_mechanism.h"
#include "mechanics/momentum.h"
#include "mechanics/rotation.h"
#include "phs/scalars/derivative.h"
#include "scene/assemble/outputs.h"
#include "scene/read/toml_file-inl.h"
#include "scene/sensitivity/ridders.h"

namespace porthos::scene {
namespace {

using mechanics::Mechanism;
using phs::Dual;

constexpr const char* energy_name = "energy";

/// Whether an output depends on the state by places and rates alone, so that its slopes by
/// parameters follow from those of the momenta.
bool is_of_motion(const Output& o, const std::vector<Output>& all) {
  using Q = OutputQuantity;
  if (o.quantity != Q::formula) return o.quantity <= Q::joint_rate;
  return std::ranges::all_of(needed_for(o.name, all), [&](const Output& needed) {
    return needed.name == o.name || is_of_motion(needed, all);
  });
}

/// The rotation vector of a quaternion, its turn up to π: u 2 atan(|u|/w)/|u|.
mechanics::Vec3<Dual> rotation_vector(mechanics::Quaternion<Dual> xi) {
  if (xi.w.v < 0) xi = {-xi.w, -xi.v};
  const Dual r = dot(xi.v, xi.v) / (xi.w * xi.w);
  if (r.v < 1e-10) return (Dual(2.0) / xi.w * (Dual(1.0) - r / Dual(3.0))) * xi.v;  // its series
  const Dual n = sqrt(dot(xi.v, xi.v)), &w = xi.w;
  const Dual half{std::atan2(n.v, w.v), (w.v * n.d - n.v * w.d) / (w.v * w.v + n.v * n.v)};
  return (Dual(2.0) * half / n) * xi.v;
}

/// Places and rates of a coordinate block.
struct MotionName {
  std::string name, unit;
  bool single, place;
};

/// Calls f(name, at) for the places and the rates of each coordinate block of a mechanism; `at`
/// gives their numbers, one or three, from coordinates and rates.
template <class F>
void each_of_motion(const Mechanism& m, F f) {
  using Numbers = std::vector<Dual>;
  const auto three = [](const mechanics::Vec3<Dual>& a) { return Numbers{a.x, a.y, a.z}; };
  const auto vector = [](const Numbers& x, int at) {
    return mechanics::Vec3<Dual>{x[size_t(at)], x[size_t(at) + 1], x[size_t(at) + 2]};
  };
  const auto quaternion = [](const Numbers& q, int at) {
    return mechanics::Quaternion<Dual>::load(&q[size_t(at)]);
  };
  for (const auto& c : m.coordinates()) {
    if (c.nv == 1) {
      f(MotionName{c.name + ".position", c.unit, true, true},
        [&](const Numbers& q, const Numbers&) { return Numbers{q[size_t(c.q)]}; });
      f(MotionName{c.name + ".velocity", c.rate_unit, true, false},
        [&](const Numbers&, const Numbers& v) { return Numbers{v[size_t(c.v)]}; });
    } else if (c.kind == phs::BlockKind::rotation) {
      f(MotionName{c.joint + ".attitude", "rad", false, true},
        [&](const Numbers& q, const Numbers&) {
          return three(rotation_vector(quaternion(q, c.q)));
        });
      f(MotionName{c.joint + ".angular_velocity", "rad/s", false, false},
        [&](const Numbers&, const Numbers& v) { return three(vector(v, c.v)); });
    } else {
      f(MotionName{c.joint + ".position", "m", false, true},
        [&](const Numbers& q, const Numbers&) { return three(vector(q, c.q)); });
      f(MotionName{c.joint + ".linear_velocity", "m/s", false, false},
        [&](const Numbers& q, const Numbers& v) {
          const auto xi = quaternion(q, m.coordinate(c.joint + ".attitude").q);
          return three(mechanics::rotation_matrix(xi) * vector(v, c.v));
        });
    }
  }
}

/// "elbow.position"; "base.attitude.x", ".y", ".z"
std::vector<std::string> numbers_of(const MotionName& of) {
  if (of.single) return {of.name};
  auto names = component_suffixes(3);
  for (auto& name : names) name = of.name + "." + name;
  return names;
}

}  // namespace

std::vector<double> moves_of(const Mechanism& m, const std::vector<double>& x) {
  const auto nq = size_t(m.nq());
  double largest = 0;
  for (size_t k = nq; k < 2 * nq; ++k) largest = std::max(largest, std::fabs(x[k]));
  std::vector<double> moves(2 * nq, largest > 0 ? largest / 4 : 0.25);
  for (const auto& c : m.coordinates())
    for (auto k = size_t(c.q); k < size_t(c.q + c.nq); ++k)
      moves[k] = c.kind == phs::BlockKind::linear ? std::max(1.0, std::fabs(x[k])) / 4 : 0.25;
  return moves;
}

EndQuantities::EndQuantities(const Scene& scene, const Assembly& a) : scene_(scene), assembly_(a) {
  for (const Output& o : scene.outputs)
    if (is_of_motion(o, scene.outputs))
      outputs_.push_back(o);
    else
      left_out_.push_back(fmt::format(
          "output '{}' has no slopes: it depends on the parameters by more than places and rates",
          o.name));
  known_ = usual_ = number_names(outputs_);
  each_of_motion(*a.mechanism, [&](const MotionName& of, const auto&) {
    for (auto& name : numbers_of(of)) {
      if (outputs_.empty() && of.place) usual_.push_back(name);
      if (std::ranges::find(known_, name) == known_.end()) known_.push_back(std::move(name));
    }
  });
  if (std::ranges::find(known_, energy_name) == known_.end()) known_.push_back(energy_name);
}

void EndQuantities::require(const std::string& name) const {
  if (std::ranges::find(known_, name) != known_.end()) return;
  for (const Output& o : scene_.outputs)
    for (const auto& number : component_names(o))
      if (number == name)
        throw InvalidArgument(fmt::format(
            "{}: output '{}' has no slopes: it depends on the parameters by more than places and "
            "rates",
            o.where, o.name));
  throw InvalidArgument(
      fmt::format("{}there is no '{}' at the end of a run, the nearest is '{}': expected an output "
                  "of places or "
                  "rates, a place or rate of a joint or the base, or energy",
                  in_file(scene_.path), name, nearest(name, {known_.begin(), known_.end()})));
}

std::vector<EndQuantity> EndQuantities::of_outputs(double t, const phs::State& s) const {
  std::vector<EndQuantity> all;
  if (outputs_.empty()) return all;
  Outputs outputs(scene_, assembly_, outputs_);
  const auto columns = output_columns(scene_, assembly_);
  const auto values = outputs.at(t, s, {});
  for (const Output& o : outputs_)
    for (const auto& name : component_names(o)) {
      const auto column = std::ranges::find(columns, o.name, &OutputColumn::name);
      all.push_back(
          {name, column->unit, values[all.size()], std::vector<double>(s.x.size(), 0.0), {}});
    }
  const auto moves = moves_of(*assembly_.mechanism, s.x);
  phs::State moved = s;
  std::vector<double> wrong(all.size()), length(all.size());
  for (size_t k = 0; k < moves.size(); ++k) {
    const auto at = [&](double d) {
      moved.x[k] = s.x[k] + d;
      return outputs.at(t, moved, {});
    };
    const auto found = ridders(at, all.size(), moves[k]);
    moved.x[k] = s.x[k];
    for (size_t i = 0; i < all.size(); ++i) {
      all[i].by_state[k] = found.slope[i];
      // in units of the moves, so that places and momenta add up
      wrong[i] = std::hypot(wrong[i], found.error[i] * moves[k]);
      length[i] = std::hypot(length[i], found.slope[i] * moves[k]);
    }
  }
  for (size_t i = 0; i < all.size(); ++i) all[i].error = length[i] > 0 ? wrong[i] / length[i] : 0;
  return all;
}

std::vector<EndQuantity> EndQuantities::of_joints(const phs::State& s) const {
  const Mechanism& m = *assembly_.mechanism;
  const auto nq = size_t(m.nq());
  const auto turned = phs::with_turns(assembly_.model->description(), s);
  std::vector<Dual> x(turned.begin(), turned.begin() + std::ptrdiff_t(2 * nq));
  mechanics::Workspace<Dual> w(m);
  std::vector<EndQuantity> all;
  const auto each_number = [&](auto visit) {
    const std::vector<Dual> q(x.begin(), x.begin() + std::ptrdiff_t(nq));
    mechanics::rates_from_momenta<Dual>(m, w, q, std::span<const Dual>(x).subspan(nq));
    size_t i = 0;
    each_of_motion(m, [&](const MotionName& of, const auto& at) {
      const auto names = numbers_of(of);
      const auto numbers = at(q, w.rate);
      for (size_t k = 0; k < names.size(); ++k) visit(i++, names[k], of.unit, numbers[k]);
    });
  };
  each_number([&](size_t, const std::string& name, const std::string& unit, const Dual& value) {
    all.push_back({name, unit, value.v, std::vector<double>(s.x.size(), 0.0), {}});
  });
  phs::along_each(x, [&](size_t k) {
    each_number([&](size_t i, const auto&, const auto&, const Dual& value) {
      all[i].by_state[k] = value.d;
    });
  });
  return all;
}

EndQuantity EndQuantities::energy(const phs::State& s,
                                  const std::vector<std::string>& parameters) const {
  const auto& d = assembly_.model->description();
  const auto system = assembly_.model->instantiate<double>();
  std::vector<double> angles, stored(d.storages.size());
  for (const auto turn : s.turns) angles.push_back(double(turn) * phs::two_pi_hi);
  system->set_turn_angles(angles);
  EndQuantity e{energy_name, "J", system->hamiltonian(s.x), std::vector<double>(s.x.size()), {}};
  system->gradient(s.x, e.by_state);
  system->stored(s.x, stored);
  e.by_parameters.assign(parameters.size(), 0.0);
  if (parameters.empty()) return e;
  const auto own = mechanics::energy_by_parameters(
      *assembly_.mechanism,
      std::span<const double>(s.x).first(2 * size_t(assembly_.mechanism->nq())), s.turns);
  std::ranges::copy(own, e.by_parameters.begin());
  for (size_t i = own.size(); i < parameters.size(); ++i)
    for (size_t k = 0; k < stored.size(); ++k)  // a spring's energy has its factor
      if (parameters[i] == d.storages[k] + ".factor") e.by_parameters[i] = stored[k];
  return e;
}

std::vector<EndQuantity> EndQuantities::at(double t, const phs::State& s,
                                           const std::vector<std::string>& names,
                                           const std::vector<std::string>& parameters) const {
  const Mechanism& m = *assembly_.mechanism;
  auto all = of_outputs(t, s);
  for (auto& q : of_joints(s)) all.push_back(std::move(q));
  // By places and rates the parameters have no part in these: ∂O/∂θ at fixed momenta is what the
  // momenta at fixed rates add, with the other sign.
  const auto turned = phs::with_turns(assembly_.model->description(), s);
  const auto q = std::span(turned).first(size_t(m.nq()));
  const auto v = assembly_.mechanical->rates(std::span(s.x).first(2 * q.size()), s.turns);
  for (auto& quantity : all) {
    quantity.by_parameters.assign(parameters.size(), 0.0);
    if (parameters.empty()) continue;
    const auto added = mechanics::start_in_rates(
        m, q, v, std::span<const double>(quantity.by_state).first(2 * q.size()));
    for (size_t i = 0; i < added.parameters.size(); ++i)
      quantity.by_parameters[i] = -added.parameters[i];
  }
  all.push_back(energy(s, parameters));
  std::vector<EndQuantity> wanted;
  for (const auto& name : names) {
    require(name);
    wanted.push_back(*std::ranges::find(all, name, &EndQuantity::name));
  }
  return wanted;
}

}  // namespace porthos::scene
