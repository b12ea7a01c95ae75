#include "scene/plot/time_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "scene/plot/svg.h"

namespace porthos::scene {

TimeAxis even_times(double first, double last, int parts) {
  TimeAxis axis;
  const double span = last - first;
  const double second = span <= 7200 ? 1 : span <= 2 * 86400 ? 3600 : 86400;
  axis.unit = second == 1 ? "s" : second == 3600 ? "h" : "d";
  if (!(last > 0) || !std::isfinite(last)) return axis;
  const double step = round_step(span / second, parts), end = (last + 1e-4 * span) / second;
  const int digits = 3 + int(std::log10(end / step));  // tell neighbours apart
  for (double i = std::ceil(first / second / step - 1e-4); i * step <= end; ++i)
    axis.ticks.push_back({i * step * second, number_text(i * step, in_powers(end), digits)});
  return axis;
}

TimeAxis everyday_times(double first, double last) {
  static const TimeTick all[] = {{1, "1 s"},      {10, "10 s"},     {60, "1 min"},
                                 {600, "10 min"}, {3600, "1 h"},    {36000, "10 h"},
                                 {86400, "1 d"},  {864000, "10 d"}, {8.64e6, "100 d"}};
  TimeAxis axis;
  for (int d = -12; d < 0; ++d) {
    static const char* units[] = {"ps", "ns", "µs", "ms"};
    axis.ticks.push_back({std::pow(10.0, d), fmt::format("{:g} {}", std::pow(10.0, (12 + d) % 3),
                                                         units[(12 + d) / 3])});
  }
  axis.ticks.insert(axis.ticks.end(), std::begin(all), std::end(all));
  constexpr double year = 365.25 * 86400;
  for (double years = 1; years < 1e12; years *= 10)
    axis.ticks.push_back({years * year, number_text(years) + " y"});
  std::erase_if(axis.ticks,
                [&](const TimeTick& k) { return k.t < first * 0.999 || k.t > last * 1.001; });
  return axis;
}

}  // namespace porthos::scene
