#include "space/ledgers.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "phs/system/state.h"

namespace porthos::space {
namespace {

constexpr size_t gradient = size_t(OrbitSource::gradient), zonal = size_t(OrbitSource::zonal);

LongSum split(OrbitReal x) { return {double(x), double(x - OrbitReal(double(x)))}; }

}  // namespace

void append(LedgerReport& to, const LedgerReport& next) {
  // Only this bound is known for the defect since the start.
  to.largest_defect = std::max(to.largest_defect, std::fabs(to.defect) + next.largest_defect);
  to.change += next.change;
  to.defect += next.defect;
  to.scale = std::max(to.scale, next.scale);
  to.turned_over += next.turned_over;
  for (const auto& [name, joule] : next.works) {
    const auto known = std::find_if(to.works.begin(), to.works.end(),
                                    [&n = name](const auto& w) { return w.first == n; });
    if (known == to.works.end())
      to.works.emplace_back(name, joule);
    else
      known->second += joule;
  }
}

void append(SpaceReport& to, const SpaceReport& next) {
  append(to.orbital, next.orbital);
  append(to.coupling, next.coupling);
  append(to.harmonics, next.harmonics);
  to.gradient_work += next.gradient_work;
  to.plates_work += next.plates_work;
  to.angular_momentum = std::max(to.angular_momentum, next.angular_momentum);
  to.angular_impulse += next.angular_impulse;
  to.angular_defect = std::max(to.angular_defect, next.angular_defect);
  to.reach = std::max(to.reach, next.reach);
  to.next_order = std::max(to.next_order, next.next_order);
}

void LongSum::add(double x) { phs::compensated_add(value, low, x); }

void SpaceLedgers::Balance::look(OrbitReal value, OrbitReal off) {
  last = double(value);
  defect = double(off);
  worst = std::max(worst, std::fabs(defect));
  scale = std::max(scale, std::fabs(last));
}

LedgerReport SpaceLedgers::Balance::report(const char* name) const {
  return {name, first, last - first, defect, worst, scale, 0, {}};
}

void SpaceLedgers::start(const Reading& r) {
  data_ = {};
  Data& d = data_;
  d.started = 1;
  d.orbital_0 = split(r.orbital);
  d.orbital.first = double(r.orbital);
  d.gradient.first = r.gradient;
  d.zonal.first = r.zonal;
  for (int k = 0; k < 3; ++k) d.L_0[k] = split(r.L[k]);
  look(r);
}

void SpaceLedgers::kick(const OrbitWorks& on_orbit, double on_internal, const Vec3<double>& impulse,
                        double by_plates) {
  for (size_t s = 0; s < orbit_sources; ++s) data_.orbit[s].add(double(on_orbit[s]));
  data_.internal.add(on_internal);
  data_.turned_over += std::fabs(on_internal) + std::fabs(double(on_orbit[gradient]));
  data_.plates += by_plates;
  for (int k = 0; k < 3; ++k) data_.impulse[k].add(impulse[k]);
}

void SpaceLedgers::look(const Reading& r) {
  Data& d = data_;
  OrbitReal defect = r.orbital - d.orbital_0.total();
  for (const LongSum& w : d.orbit) defect -= w.total();
  d.orbital.look(r.orbital, defect);
  d.gradient.look(r.gradient, OrbitReal(r.gradient) - d.gradient.first + d.internal.total() +
                                  d.orbit[gradient].total());
  d.zonal.look(r.zonal, OrbitReal(r.zonal) - d.zonal.first + d.orbit[zonal].total());

  OrbitReal off = 0;
  for (int k = 0; k < 3; ++k) {
    const OrbitReal c = r.L[k] - d.L_0[k].total() - d.impulse[k].total();
    off += c * c;
  }
  d.L_largest = std::max(d.L_largest, double(mechanics::norm(r.L)));
  d.L_last = double(sqrtl(off));
  d.L_worst = std::max(d.L_worst, d.L_last);
  reach_ = std::max(reach_, r.reach);
  next_order_ = std::max(next_order_, 1.5 * r.reach / r.distance);
}

SpaceReport SpaceLedgers::report() const {
  const Data& d = data_;
  SpaceReport r;
  r.orbital = d.orbital.report("orbital");
  for (size_t s = 0; s < orbit_sources; ++s)
    if (d.orbit[s].value != 0)
      r.orbital.works.emplace_back(to_string(OrbitSource(s)), d.orbit[s].value);
  r.coupling = d.gradient.report("coupling");
  r.coupling.works = {{"to_orbit", d.orbit[gradient].value}, {"to_internal", d.internal.value}};
  r.harmonics = d.zonal.report("harmonics");
  r.harmonics.works = {{"to_orbit", d.orbit[zonal].value}};
  r.coupling.turned_over = d.turned_over;
  r.gradient_work = d.internal.value;
  r.plates_work = d.plates;
  r.angular_momentum = d.L_largest;
  r.angular_impulse = std::hypot(d.impulse[0].value, d.impulse[1].value, d.impulse[2].value);
  r.angular_defect = d.L_largest > 0 ? d.L_worst / d.L_largest : d.L_worst;
  r.reach = reach_;
  r.next_order = next_order_;
  return r;
}

std::array<double, SpaceLedgers::reading_size> SpaceLedgers::now() const {
  const Data& d = data_;
  return {d.orbital.last, d.orbital.defect, d.gradient.last, d.gradient.defect,
          d.zonal.last,   d.zonal.defect,   d.L_last};
}

void SpaceLedgers::carry(Archive& a) {
  auto numbers = std::bit_cast<std::array<double, sizeof(Data) / sizeof(double)>>(data_);
  a(std::span<double>(numbers));
  data_ = std::bit_cast<Data>(numbers);
  a(reach_);
  a(next_order_);
}

}  // namespace porthos::space
