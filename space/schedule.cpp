#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "space/parts.h"

namespace porthos::space {

Schedule::Schedule(std::vector<double> switches) : switches_(std::move(switches)), always_(false) {
  for (size_t i = 0; i < switches_.size(); ++i) {
    const double t = switches_[i];
    if (!(t >= 0) || !std::isfinite(t))
      throw InvalidArgument(
          fmt::format("a switching instant is {} s, expected a time of 0 s or later", t));
    if (i > 0 && !(t > switches_[i - 1]))
      throw InvalidArgument(
          fmt::format("the switching instant {} s follows {} s, expected rising times (on, off, "
                      "on, off ...)",
                      t, switches_[i - 1]));
  }
}

Schedule Schedule::pulses(double start, double period, double width, long count) {
  if (!(width > 0 && width < period))
    throw InvalidArgument(
        fmt::format("pulses of {} s come every {} s, expected a width above 0 and below the period",
                    width, period));
  if (count < 1 || count > 1000000)
    throw InvalidArgument(
        fmt::format("there are {} pulses, expected a count from 1 to 1000000", count));
  std::vector<double> list;
  for (long k = 0; k < count; ++k) {
    const double on = start + double(k) * period;
    list.push_back(on);
    list.push_back(on + width);
  }
  return Schedule(std::move(list));
}

double Schedule::at(double t) const {
  if (always_) return 1;
  const double near = 8 * 0x1p-52 * std::fabs(t);
  const auto next = std::upper_bound(switches_.begin(), switches_.end(), t - near);
  if (next != switches_.end() && *next <= t + near) return 0.5;
  return (next - switches_.begin()) % 2 ? 1 : 0;
}

double Schedule::on_time(double t) const {
  if (always_) return t;
  double sum = 0;
  for (size_t i = 0; i < switches_.size() && switches_[i] < t; i += 2)
    sum += (i + 1 < switches_.size() ? std::min(t, switches_[i + 1]) : t) - switches_[i];
  return sum;
}

double Schedule::off_grid(double h) const {
  for (const double t : switches_)
    if (std::fabs(t / h - std::round(t / h)) > 1e-9 * std::max(1.0, t / h)) return t;
  return -1;
}

}  // namespace porthos::space
