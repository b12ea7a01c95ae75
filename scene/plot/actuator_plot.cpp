#include "scene/plot/actuator_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "scene/plot/svg.h"
#include "scene/read/actuator.h"
#include "vsa/catalogue.h"
#include "vsa/table.h"

namespace porthos::scene {
namespace {

constexpr double width = 860, next = 430, height = 360, top = 74, bottom = 300, panel = 320;
constexpr int points = 401;

struct Curve {
  std::vector<double> x, y;  ///< within the limits
  std::string colour;
};

void panel_of(Svg& svg, double left, const std::string& title, const std::vector<double>& x,
              const std::vector<Curve>& curves, double mark, const std::vector<Curve>& dots = {}) {
  double low = 0, high = 0;
  for (const auto* list : {&curves, &dots})
    for (const auto& c : *list)
      for (const double y : c.y) {
        low = std::min(low, y);
        high = std::max(high, y);
      }
  if (high == low) high = low + 1;
  const double room = 0.04 * (high - low);
  low -= room;
  high += room;
  const auto px = [&](double v) { return left + panel * (v - x.front()) / (x.back() - x.front()); };
  const auto py = [&](double v) { return bottom - (bottom - top) * (v - low) / (high - low); };
  svg.text(left, top - 12, "start", 12.5, colour::ink, title);
  const double dy = round_step(high - low, 5), dx = round_step(x.back() - x.front(), 5);
  for (double v = std::ceil(low / dy) * dy; v <= high; v += dy) {
    svg.rule(left, py(v), left + panel, py(v), colour::grid, 1);
    svg.text(left - 8, py(v) + 4, "end", 11, colour::soft,
             number_text(std::fabs(v) < 1e-9 * dy ? 0 : std::round(v / dy) * dy));
  }
  for (double v = std::ceil(x.front() / dx) * dx; v <= x.back() + 1e-9; v += dx) {
    svg.rule(px(v), bottom, px(v), bottom + 4, colour::guide, 1);
    svg.text(px(v), bottom + 18, "middle", 11, colour::soft,
             number_text(std::fabs(v) < 1e-9 * dx ? 0 : std::round(v / dx) * dx));
  }
  svg.rule(left, bottom, left + panel, bottom, colour::guide, 1);
  for (const double side : {-mark, mark})
    if (mark < x.back())
      svg.rule(px(side), top, px(side), bottom, colour::alarm, 1, " stroke-dasharray=\"3 3\"");
  size_t rows = 0;
  for (const auto& c : dots) rows += c.x.size();
  // Many are small and pale: a loop of loading and unloading and the curve can be told apart.
  svg.raw(fmt::format(R"(<g opacity="{}">)", rows > 200 ? 0.45 : 1.0));
  for (const auto& c : dots)
    for (size_t i = 0; i < c.x.size(); ++i)
      if (std::fabs(c.x[i]) <= x.back())
        svg.marker(0, px(c.x[i]), py(c.y[i]), rows > 200 ? 0.7 : 2.0, c.colour, c.colour);
  svg.raw("</g>");
  for (const auto& c : curves) {
    std::string line;
    for (size_t i = 0; i < c.x.size(); ++i)
      line += fmt::format("{:.1f},{:.1f} ", px(c.x[i]), py(c.y[i]));
    svg.polyline(line, c.colour, 1.8);
  }
  svg.text(left + panel / 2, bottom + 38, "middle", 11.5, colour::soft, "deflection [rad]");
}

/// The rows of a table as they were measured, in the colours of their settings; those of settings
/// without a curve are grey.
/// @param left_over  less the torque of the energy at the setting
std::vector<Curve> measured_dots(const vsa::Elastic& e, const std::vector<double>& sigmas,
                                 const std::vector<Curve>& curves, bool left_over = false) {
  std::vector<Curve> dots(sigmas.size() + 1);
  for (size_t k = 0; k < sigmas.size(); ++k) dots[k].colour = curves[k].colour;
  dots.back().colour = colour::soft;
  const auto settings = vsa::measured_settings(e);
  for (const auto& r : vsa::measured_torques(e)) {
    const auto off = [&](double sigma) { return std::fabs(sigma - r.sigma); };
    const double setting = *std::ranges::min_element(settings, {}, off);
    auto& to = dots[size_t(std::ranges::find(sigmas, setting) - sigmas.begin())];
    to.x.push_back(r.deflection);
    to.y.push_back(left_over ? r.torque - e.slopes(r.deflection, 0, setting).q : r.torque);
  }
  return dots;
}

/// What is left over of measured torques, and how wide a loop of loading and unloading is.
std::string title_of_residuals(const vsa::Elastic& e) {
  const double loop = vsa::measured_loop(e);
  return "measured torque - curve [N m]" +
         (loop > 0 ? fmt::format(": a loop {:.2g} N m wide", loop) : "");
}

/// Of deflections up to that one to both sides; the energy's angle θ counts where it is not
/// translation invariant.
/// @param more  panels on the right: the energy, and what is left over of measured torques
std::string curves_of(const std::string& title, const vsa::Elastic& e,
                      const std::vector<double>& sigmas, double deflection, double theta,
                      int more) {
  std::vector<double> x;
  for (int i = 0; i < points; ++i) x.push_back(deflection * (2.0 * i / (points - 1) - 1));
  std::vector<Curve> torque, stiffness, energy;
  const auto& traits = e.traits();
  const double limit = traits.limits.deflection;
  for (size_t k = 0; k < sigmas.size(); ++k) {
    Curve t, c, E;
    t.colour = c.colour = E.colour = colour::lines[k % std::size(colour::lines)];
    for (const double q : x) {
      const auto strains = e.strains(q, theta, sigmas[k]);
      if (std::any_of(strains.begin(), strains.end(),
                      [&](double v) { return std::fabs(v) > limit; }))
        continue;
      t.x.push_back(q);
      t.y.push_back(e.slopes(q, theta, sigmas[k]).q);
      c.x.push_back(q);
      c.y.push_back(e.stiffness(q, theta, sigmas[k]));
      E.x.push_back(q);
      E.y.push_back(e.energy(q, theta, sigmas[k]));
    }
    torque.push_back(t);
    stiffness.push_back(c);
    energy.push_back(E);
  }
  Svg svg(width + more * next, height);
  svg.text(64, 26, "start", 16, colour::ink, title, " font-weight=\"600\"");
  double at = 64;
  for (size_t k = 0; k < sigmas.size() && !traits.sigma.empty(); ++k) {
    const std::string label =
        fmt::format("σ = {} {}", number_text(std::stod(fmt::format("{:.4g}", sigmas[k]))),
                    traits.sigma_unit == "1" ? "" : traits.sigma_unit);
    svg.rule(at, 42, at + 18, 42, torque[k].colour, 3);
    svg.text(at + 24, 46, "start", 11.5, colour::ink, label);
    at += 44 + text_width(label, 11.5);
  }
  const bool each = traits.family == "cosh";  // the limit is of each spring
  const double mark = each ? HUGE_VAL : limit;
  panel_of(svg, 64, "holding torque [N m]", x, torque, mark, measured_dots(e, sigmas, torque));
  panel_of(svg, 64 + next, "stiffness [N m/rad]", x, stiffness, mark);
  if (more > 0) panel_of(svg, 64 + 2 * next, "energy [J]", x, energy, mark);
  if (more > 1)
    panel_of(svg, 64 + 3 * next, title_of_residuals(e), x, {}, mark,
             measured_dots(e, sigmas, torque, true));
  return svg.finish();
}

/// Whether the spring at the end of the range of σ can be drawn beside that before it: it may have
/// no room there, or go to infinity.
bool shows_end(const vsa::Elastic& e, double theta, double before, double end) {
  const double limit = e.traits().limits.deflection;
  for (const double strain : e.strains(limit < HUGE_VAL ? 0.1 * limit : 0.0, theta, end))
    if (std::fabs(strain) > limit) return false;
  return std::fabs(e.stiffness(0, theta, end)) <= 4 * std::fabs(e.stiffness(0, theta, before));
}

}  // namespace

std::string datasheet_plot(const vsa::Device& d) {
  const auto e = vsa::elastic_of(d);
  const bool found = e->traits().family == "tabulated";  // of a table the energy is found
  return curves_of(d.title, *e, d.sigma, d.deflection, d.theta, found);
}

std::string spring_plot(const JointActuator& a) {
  const auto& traits = a.actuator.elastic->traits();
  const vsa::Limits& limits = traits.limits;
  const double theta = traits.translation_invariant ? 0 : a.theta.value_or(0);
  std::vector<double> sigmas{a.sigma};
  // ±σ are often the same spring.
  const double least = limits.sigma_lower == -limits.sigma_upper ? 0 : limits.sigma_lower;
  const auto settings = vsa::measured_settings(*a.actuator.elastic);
  if (!settings.empty()) {
    const size_t n = std::min(settings.size(), std::size(colour::lines));
    sigmas.clear();
    for (size_t k = 0; k < n; ++k)
      sigmas.push_back(settings[n < 2 ? 0 : k * (settings.size() - 1) / (n - 1)]);
  } else if (const double range = limits.sigma_upper - least; range < HUGE_VAL) {
    const bool to_end = shows_end(*a.actuator.elastic, theta, least + 0.75 * range, least + range);
    sigmas.clear();
    for (int k = 0; k < 4; ++k) sigmas.push_back(least + range * k / (to_end ? 3 : 4));
  }
  const double measured = std::max(-traits.measured_from, traits.measured_to);
  double deflection = 1;
  if (limits.deflection < HUGE_VAL)
    deflection = 1.05 * limits.deflection;
  else if (measured < HUGE_VAL)
    deflection = measured;
  return curves_of(fmt::format("{} ({})", a.name, traits.family), *a.actuator.elastic, sigmas,
                   deflection, theta, settings.empty() ? 1 : 2);
}

}  // namespace porthos::scene
