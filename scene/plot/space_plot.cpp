#include "scene/plot/space_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/plot/svg.h"

namespace porthos::scene {
namespace {

constexpr double width = 860, left = 120, right = 30, top = 74, row_height = 52, bottom = 96;
constexpr const char *held = colour::lines[0], *moved = colour::lines[2];

struct Row {
  std::string name;
  double stands, went, defect;
};

std::vector<Row> rows_of(const RunReport& r) {
  const auto& s = *r.space;
  const auto went = [](const space::LedgerReport& l) {
    double most = std::fabs(l.change);
    for (const auto& [name, joule] : l.works) most = std::max(most, std::fabs(joule));
    return most;
  };
  std::vector<Row> rows{
      {"orbital", s.orbital.scale, went(s.orbital), s.orbital.largest_defect},
      {"internal", std::max(std::fabs(r.energy.initial_J), std::fabs(r.stored_J)), r.turned_over_J,
       r.energy.max_abs_error_J},
      {"coupling", s.coupling.scale, went(s.coupling), s.coupling.largest_defect}};
  if (s.harmonics.scale > 0)
    rows.push_back({"harmonics", s.harmonics.scale, went(s.harmonics), s.harmonics.largest_defect});
  return rows;
}

}  // namespace

std::string space_plot(const RunReport& r) {
  const auto rows = rows_of(r);
  double low = HUGE_VAL, high = 0;
  for (const Row& row : rows)
    for (const double x : {row.stands, row.went, row.defect})
      if (x > 0) {
        low = std::min(low, x);
        high = std::max(high, x);
      }
  if (!(high > 0)) low = high = 1;
  const double first = std::floor(std::log10(low)) - 1, last = std::ceil(std::log10(high)) + 1;
  const auto x_of = [&](double joule) {
    return left + (std::log10(joule) - first) / (last - first) * (width - left - right);
  };
  const double foot = top + row_height * double(rows.size()), height = foot + bottom;

  Svg svg(width, height);
  svg.text(left, 26, "start", 16, colour::ink, fit_text(r.title, 16, width - left - right),
           " font-weight=\"bold\"");
  svg.text(left, 46, "start", 12, colour::soft,
           fmt::format("{} s, {} steps of {} s: each ledger by itself, no total",
                       number_text(r.simulated_s), r.steps, number_text(r.step_s)));
  const int every = last - first > 16 ? 4 : 2;
  for (int e = int(first); e <= int(last); ++e) {
    if (e % every) continue;
    const double x = x_of(std::pow(10.0, e));
    svg.rule(x, top - 8, x, foot, colour::grid, 1);
    svg.text(x, foot + 18, "middle", 12, colour::soft, power_of_ten(e));
  }
  svg.text((left + width - right) / 2, foot + 38, "middle", 12, colour::soft, "energy in J");

  // One unit in the last place of a number of the size of the orbital energy.
  const double unit = std::ldexp(1.0, std::ilogb(std::max(rows[0].stands, 1e-300)) - 52);
  if (std::log10(unit) > first) {
    const double x = x_of(unit);
    svg.rule(x, top - 8, x, foot, colour::alarm, 1.5, " stroke-dasharray=\"5 4\"");
    svg.text(x, top - 12, "middle", 12, colour::alarm,
             "one rounding of a total, " + scientific(unit) + " J");
  }
  for (size_t i = 0; i < rows.size(); ++i) {
    const double y = top + row_height * (double(i) + 0.5);
    svg.text(left - 14, y + 4, "end", 14, colour::ink, rows[i].name);
    svg.rule(left, y, width - right, y, colour::grid, 1);
    if (rows[i].defect > 0) svg.marker(2, x_of(rows[i].defect), y, 7, colour::ink, "white");
    if (rows[i].went > 0) svg.marker(1, x_of(rows[i].went), y, 6, moved, "white");
    if (rows[i].stands > 0) svg.marker(0, x_of(rows[i].stands), y, 6, held, "white");
  }
  double x = left;
  const double y = foot + 68;
  const auto legend = [&](size_t shape, const char* fill, const std::string& text) {
    svg.marker(shape, x + 8, y - 4, 6, fill, "white");
    svg.text(x + 20, y, "start", 12, colour::ink, text);
    x += 36 + text_width(text, 12);
  };
  legend(0, held, "energy in it");
  legend(1, moved, "went through it (internal: exchanged)");
  legend(2, colour::ink, "largest residual");
  return svg.finish();
}

}  // namespace porthos::scene
