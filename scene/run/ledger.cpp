#include "scene/run/ledger.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>

#include "phs/error.h"
#include "scene/run/growth_words.h"

namespace porthos::scene {
namespace {

double norm(const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); }

/// Adds the row of an observed power that counts, see contact::ContactModel.
void add_count(RunReport& r, const std::string& row, double sum) {
  for (const auto& [counted, list] : {std::pair{".impacts", &r.impacts}, {".slips", &r.slips}})
    if (row.ends_with(counted))
      list->push_back(
          {row.substr(0, row.size() - std::string_view(counted).size()), std::int64_t(sum)});
}

/// The relative error; without a scale it stays absolute.
double relative(double error, double scale) { return scale > 0 ? error / scale : error; }

}  // namespace

Ledger::Ledger(const phs::Description& d)
    : description_(&d),
      scale_(d),
      sum_(d.powers.size(), 0.0),
      low_(d.powers.size(), 0.0),
      peak_(d.powers.size(), 0.0),
      stored_first_(d.storages.size(), 0.0),
      stored_(d.storages.size(), 0.0) {}

double Ledger::look(const Measured& m) {
  Totals& s = totals_;
  scale_.see(m.stored_J);
  s.max_linear = std::max(s.max_linear, norm(m.linear));
  s.max_angular = std::max(s.max_angular, norm(m.angular));
  s.max_quaternion_norm = std::max(s.max_quaternion_norm, m.quaternion_norm);
  s.max_gap = std::max(s.max_gap, m.gap);
  s.max_slip = std::max(s.max_slip, m.slip);
  s.max_linear_scale = std::max(s.max_linear_scale, m.scale.linear);
  s.max_angular_scale = std::max(s.max_angular_scale, m.scale.angular);
  const double off = error(m);
  s.max_error_J = std::max(s.max_error_J, std::fabs(off));
  ++s.looks;
  return off;
}

double Ledger::add(double t, const Measured& m, bool regular) {
  if (energy_.count() == 0) stored_first_ = m.stored_J;
  stored_ = m.stored_J;
  const double off = look(m);
  --totals_.looks;
  totals_.t = t;
  totals_.stored_J = m.energy_change_J;
  energy_.add(off, regular);
  return off;
}

double Ledger::error(const Measured& m) const {
  long double error = m.energy_change_J;
  for (size_t a = 0; a < sum_.size(); ++a) {
    const long double work = static_cast<long double>(sum_[a]) + low_[a];
    const auto kind = description_->powers[a].kind;
    if (kind != phs::PowerKind::observed) error += kind == phs::PowerKind::supplied ? -work : work;
  }
  return double(error);
}

void Ledger::fill(RunReport& r, const Meter& meter) const {
  const Totals& s = totals_;
  EnergyReport& e = r.energy;
  e.initial_J = meter.initial_J();
  e.about_centre = meter.linear_is_structure();
  if (scale_.has_kinetic()) e.scale_parts.emplace_back("kinetic", scale_.kinetic_J());
  for (size_t k = 0; k < stored_.size(); ++k)
    if (!phs::is_kinetic(description_->storages[k]))
      e.scale_parts.emplace_back(description_->storages[k], scale_.part(k));
  e.scale_J = std::max(scale_.value(), turned_over_);
  // Where next to nothing moves beside what is stored, roundings are those of the whole.
  if (e.scale_J < e.next_to_nothing * std::fabs(e.initial_J)) e.scale_J = std::fabs(e.initial_J);
  if (!(e.scale_J > 0)) e.scale_J = 1;
  e.max_abs_error_J = s.max_error_J;
  e.max_rel_error = s.max_error_J / e.scale_J;
  e.rms_rel_error = energy_.rms() / e.scale_J;
  set_growth(e, energy_, s.t / std::max(1.0, double(energy_.count()) - 1), e.scale_J);
  e.drift_per_s = s.t > 0 ? energy_.drift() / e.scale_J / s.t : 0;

  const auto size = meter.momentum_at_start();
  r.linear_momentum_error = relative(s.max_linear, std::max(size.linear, s.max_linear_scale));
  r.angular_momentum_error = relative(s.max_angular, std::max(size.angular, s.max_angular_scale));
  r.quaternion_norm_error = s.max_quaternion_norm;
  r.constraint_rows = meter.constraint_rows();
  r.constraint_gap = s.max_gap;
  r.constraint_slip = s.max_slip;

  r.records = energy_.count();
  r.looks = std::int64_t(s.looks);
  r.stored_J = s.stored_J;
  r.turned_over_J = turned_over_;
  for (size_t a = 0; a < sum_.size(); ++a) {
    const auto& power = description_->powers[a];
    if (power.kind == phs::PowerKind::observed) {
      add_count(r, power.name, sum_[a]);
      continue;
    }
    const bool in = power.kind == phs::PowerKind::supplied;
    if (power.control) r.delivered.emplace_back(power.name, peak_[a]);
    (in ? r.supplied_J : r.dissipated_J) += sum_[a];
    (in ? r.ports : r.losses).emplace_back(power.name, sum_[a]);
  }
  for (size_t k = 0; k < stored_.size(); ++k)
    r.storages.emplace_back(description_->storages[k], stored_[k] - stored_first_[k]);
  r.defect_J = energy_.change();
}

/// Carries the members of fixed size.
void Ledger::carry(Archive& a) {
  auto totals = std::bit_cast<Numbers>(totals_);
  a(std::span<double>(totals));
  totals_ = std::bit_cast<Totals>(totals);
  for (auto* part : {&sum_, &low_, &peak_, &stored_first_, &stored_}) a(*part);
  a(turned_over_);
  scale_.carry(a);
}

std::vector<double> Ledger::memory() const {
  std::vector<double> m;
  save_carried(*this, m);
  const auto rest = energy_.memory();
  m.insert(m.end(), rest.begin(), rest.end());
  return m;
}

void Ledger::restore(std::span<const double> m) {
  Archive count;
  carry(count);
  const size_t own = count.size();
  if (m.size() < own) require_size("memory of the ledger", m.size(), own);
  load_carried(*this, m.first(own), "memory of the ledger");
  energy_.restore(m.subspan(own));
  (void)whole<std::int64_t>(totals_.looks, 0, 0x1p53);
}

}  // namespace porthos::scene
