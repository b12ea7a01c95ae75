#include "energy_shaping/matching/matched_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "energy_shaping/loop/modes.h"
#include "energy_shaping/matching/matched_system-inl.h"

namespace porthos::energy_shaping {
namespace {

[[noreturn]] void refuse_design(const std::string& design, const std::string& why) {
  throw InvalidArgument("energy shaping '" + design + "': " + why);
}

void check_gains(const Shaping& s) {
  for (const Gain& g : s.gains())
    if (!std::isfinite(g.value))
      refuse_design(s.name(), fmt::format("gain '{}' is {:g}, expected a finite number", g.name,
                                          unsigned_nan(g.value)));
}

/// Checks a plant as far as its description allows.
void check_description(const phs::Description& d, const Shaping& s, size_t actuators) {
  if (!d.traits.canonical || !d.traits.autonomous)
    refuse_design(s.name(), "plant '" + d.name + "' must be canonical, x = (q, p), and autonomous");
  for (const auto& b : d.blocks)
    if (b.kind == phs::BlockKind::rotation)
      refuse_design(s.name(), "coordinate '" + b.name + "' of plant '" + d.name +
                                  "' is a quaternion; matching works on plain coordinates");
  if (d.nx != 2 * s.size())
    refuse_design(s.name(), fmt::format("the design is for {} coordinates, plant '{}' has {}",
                                        s.size(), d.name, d.nx / 2));
  if (actuators == 0 || int(actuators) > s.size())
    refuse_design(s.name(), fmt::format("{} actuators for {} coordinates", actuators, s.size()));
  for (const auto& p : d.powers)
    if (p.kind == phs::PowerKind::supplied)
      refuse_design(s.name(), "plant '" + d.name + "' has a source of its own, '" + p.name + "'");
  if (s.skew_kind() == Skew::solved &&
      ((s.size() != 2 && s.size() != 3) || int(actuators) != s.size() - 1))
    refuse_design(s.name(),
                  "J2 can be solved for with 2 or 3 coordinates and one less actuator only");
}

void check_region(const Region& r, const Shaping& s, const std::vector<double>& rest) {
  const size_t n = size_t(s.size());
  require_size("region.lower", r.lower.size(), n);
  require_size("region.upper", r.upper.size(), n);
  require_size("rest coordinates", rest.size(), n);
  for (size_t i = 0; i < n; ++i) {
    if (!(r.lower[i] < r.upper[i]) || !std::isfinite(r.lower[i]) || !std::isfinite(r.upper[i]))
      refuse_design(s.name(), fmt::format("region of coordinate {}: {} to {} is no interval", i,
                                          r.lower[i], r.upper[i]));
    if (!(rest[i] >= r.lower[i] && rest[i] <= r.upper[i]))
      refuse_design(
          s.name(),
          fmt::format("the rest point's coordinate {} = {} is outside the region", i, rest[i]));
  }
  if (!(r.rate > 0) || r.samples < 1)
    refuse_design(s.name(), "a region needs a rate > 0 and samples");
}

phs::Description describe(const phs::Description& plant, const Shaping& s,
                          const std::vector<int>& actuated) {
  phs::Description d = plant;
  d.name = s.name() + " of " + plant.name;
  d.traits.canonical = d.traits.separable = d.traits.lossless = false;
  d.traits.quadratic = true;
  for (auto& b : d.blocks) b.kind = phs::BlockKind::linear;  // V_d need not be periodic
  d.invariants.clear();
  d.flows.clear();
  d.ports.clear();
  d.nu = int(actuated.size());
  for (const auto& p : plant.ports) {
    const auto at = std::find(actuated.begin(), actuated.end(), p.at);
    if (at == actuated.end()) continue;
    d.ports.push_back(p);
    d.ports.back().at = int(at - actuated.begin());
    d.ports.back().required = false;
  }
  d.storages = {"shaped kinetic", "shaped potential"};
  d.powers = {{"damping", phs::PowerKind::dissipated}};
  return d;
}

std::vector<double> with_zeros(std::vector<double> q) {
  q.resize(2 * q.size(), 0.0);
  return q;
}

}  // namespace

MatchedLoop::MatchedLoop(std::shared_ptr<const phs::Model> plant,
                         std::shared_ptr<const Shaping> shaping,
                         const std::vector<std::string>& actuated_ports,
                         std::vector<double> rest_coordinates, MatchingOptions options)
    : ClosedLoopFor(std::move(plant), with_zeros(rest_coordinates)),
      shaping_(std::move(shaping)),
      options_(std::move(options)) {
  actuated_ = port_offsets(plant_->description(), actuated_ports);
  check_gains(*shaping_);
  check_description(plant_->description(), *shaping_, actuated_.size());
  check_region(options_.region, *shaping_, rest_coordinates);
  description_ = describe(plant_->description(), *shaping_, actuated_);
  certificate_ = Certificate("energy shaping '" + description_.name + "'");
  certificate_.name_coordinates(coordinate_names(plant_->description()));
  check();
  report_modes(certificate_, *this);
  if (options_.refuse) refuse_failure(certificate_);
}

std::vector<std::string> MatchedLoop::gain_names() const {
  std::vector<std::string> names;
  for (const auto& g : shaping_->gains()) names.push_back(g.name);
  return names;
}

template <class T>
std::unique_ptr<LoopSystem<T>> MatchedLoop::make_loop() const {
  return std::make_unique<MatchedSystem<T>>(*this);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<LoopSystem<T>> MatchedLoop::make_loop<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::energy_shaping
