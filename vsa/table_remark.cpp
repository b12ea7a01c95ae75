#include "vsa/detail/table_remark.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "phs/functions/smoothing.h"

namespace porthos::vsa {
namespace {

/// Noise that the splines meet exactly.
std::string rough_remark(const MeasuredCurves& curves, const std::string& path) {
  double worst = 0, noise = 0;
  for (const auto& [sigma, c] : curves)
    if (const double off = phs::slope_error(c.x, c.y); off > worst) {
      worst = off;
      noise = phs::scatter(c.x, c.y);
    }
  if (!(worst > phs::much_slope_error)) return "";
  return fmt::format(
      "{}: neighbouring torques scatter by {:.2g} N m and are met exactly, so the stiffness is off "
      "by about {:.0f} %: state their errors as smoothing [N m] or relative_smoothing",
      path, noise, 100 * worst);
}

/// How many neighbours lie on one side of the smoothed curve, where those of errors change sides
/// every other time (Wald, Wolfowitz 1940): a curve that is flatter than the spring.
bool misses_the_shape(const MeasuredCurve& c, const TorqueErrors& errors) {
  const auto smooth = phs::smoothed(c.x, c.y, errors.of(c.y, c.of_rows));
  size_t changes = 0;
  for (size_t i = 1; i < c.x.size(); ++i)
    changes += (c.y[i] < smooth[i]) != (c.y[i - 1] < smooth[i - 1]);
  const double pairs = double(c.x.size() - 1);
  return double(changes) < 0.5 * pairs - 1.5 * std::sqrt(pairs);  // three standard deviations
}

/// What neighbours scatter by in units of the errors s: the noise, and a loop as far as it is no
/// mean of both ways, since the smoothed curve runs between them.
double scatter_of(const MeasuredCurve& c, const std::vector<double>& s, double half) {
  if (half == 0) return phs::scatter(c.x, c.y, s);
  auto without = c.y;
  double loop = 0;
  for (size_t i = 0; i < c.x.size(); ++i) {
    without[i] -= half * c.way[i];
    if (s[i] > 0) loop += std::pow(half * c.way[i] / s[i], 2) / double(c.x.size());
  }
  return std::hypot(phs::scatter(c.x, without, s), std::sqrt(loop));
}

/// Whether the stiffness of the smoothed curve swings as errors do: it is below 0 somewhere, or
/// goes to and fro by a tenth more than three times.
bool swings(const MeasuredCurve& c, const TorqueErrors& errors, double factor) {
  auto s = errors.of(c.y, c.of_rows);
  for (double& each : s) each *= factor;
  const auto y = phs::smoothed(c.x, c.y, s);
  double low = HUGE_VAL, high = 0, last = 0;  // since the last turn, and the way before it
  int turns = 0;
  for (size_t i = 1; i < y.size(); ++i) {
    const double k = (y[i] - y[i - 1]) / (c.x[i] - c.x[i - 1]);
    if (!(k > 0)) return true;
    low = std::min(low, k);
    high = std::max(high, k);
    const bool fell = k<high / 1.1, rose = k> 1.1 * low;
    if (!(last >= 0 && fell) && !(last <= 0 && rose)) continue;
    turns += last != 0;
    last = fell && last >= 0 ? -1 : 1;
    low = high = k;
  }
  return turns > 3;
}

/// Whether errors are stated so much larger than the torques of this setting scatter that its curve
/// goes past them by a twentieth of their size.
bool flattens(const MeasuredCurve& c, const TorqueErrors& errors) {
  constexpr double much = 1.5, part = 0.05;
  const auto s = errors.of(c.y, c.of_rows);
  double of_errors = 0, of_torques = 0;
  for (size_t i = 0; i < s.size(); ++i) {
    of_errors += s[i] * s[i];
    of_torques += c.y[i] * c.y[i];
  }
  const double own = scatter_of(c, s, half_loop(c));
  return own * much < 1 && (1 - own * own) * of_errors > part * part * of_torques;
}

/// A tenth more than the least multiple of the errors, from `from` on, with which the stiffness of
/// no setting swings. None: there is none, or a curve then misses its shape.
TorqueErrors least_calm(const MeasuredCurves& curves, const TorqueErrors& errors, double from) {
  const auto any = [&](auto which) {
    return std::ranges::any_of(curves, [&](const auto& c) { return which(c.second); });
  };
  for (double f = from; f < 8 * from; f *= 1.06) {
    if (any([&](const MeasuredCurve& c) { return swings(c, errors, f); })) continue;
    const TorqueErrors more{1.1 * f * errors.absolute, 1.1 * f * errors.relative};
    const bool bent = any([&](const MeasuredCurve& c) {
      return misses_the_shape(c, more) || (curves.size() > 1 && flattens(c, more));
    });
    return bent ? TorqueErrors{} : more;
  }
  return {};
}

/// The same; where errors of one size miss a shape, errors relative to the torques.
TorqueErrors calming(const MeasuredCurves& curves, const TorqueErrors& errors, double from) {
  const TorqueErrors found = least_calm(curves, errors, from);
  if (found.any() || curves.size() < 2 || errors.relative > 0) return found;
  const TorqueErrors hardly{0, 0.005}, more{0, 0.04};
  const TorqueErrors small = least_calm(curves, hardly, 1);
  return small.any() ? small : least_calm(curves, more, 1);
}

}  // namespace

double half_loop(const MeasuredCurve& c) {
  std::vector<size_t> down;  // places of unloading
  for (size_t i = 0; i < c.x.size(); ++i)
    if (c.way[i] < -0.5) down.push_back(i);
  double n = 0, sum = 0, squares = 0;
  for (size_t i = 0, next = 0; i < c.x.size() && !down.empty(); ++i) {
    while (next < down.size() && down[next] < i) ++next;
    if (c.way[i] <= 0.5 || next == 0 || next == down.size()) continue;
    const size_t a = down[next - 1], b = down[next];
    if (!(c.x[b] > c.x[a])) continue;
    const double part = (c.x[i] - c.x[a]) / (c.x[b] - c.x[a]);
    const double off = (c.y[i] - c.y[a] - part * (c.y[b] - c.y[a])) / 2;
    n += 1;
    sum += off;
    squares += off * off;
  }
  if (n < 8 || down.size() < 8) return 0;
  const double mean = sum / n, variance = squares / n - mean * mean;
  return mean > 5 * std::sqrt(variance / n) ? mean : 0;
}

TorqueErrors errors_to_state(const MeasuredCurves& curves, const TorqueErrors& errors) {
  if (!errors.any()) return {};
  const bool calm =
      std::ranges::none_of(curves, [&](const auto& c) { return swings(c.second, errors, 1); });
  return calm ? TorqueErrors{} : calming(curves, errors, 1);
}

std::string errors_text(const TorqueErrors& to_state) {
  const double x = std::max(to_state.absolute, to_state.relative);
  const double digit = std::pow(10, std::floor(std::log10(x)) - 1);
  return fmt::format("{:g} {}", std::ceil(x / digit - 1e-9) * digit,
                     to_state.absolute > 0 ? "N m" : "as relative_smoothing");
}

std::vector<double> TorqueErrors::of(const std::vector<double>& torques,
                                     const std::vector<double>& of_rows) const {
  std::vector<double> s;
  for (const double y : torques) s.push_back(std::hypot(absolute, relative * y));
  for (size_t i = 0; i < of_rows.size(); ++i) s[i] /= std::sqrt(of_rows[i]);
  return s;
}

std::string remark_on(const Measurements& m, const MeasuredCurves& curves,
                      const TorqueErrors& errors, const std::string& path) {
  const double widest = std::max(-m.deflection.front(), m.deflection.back());
  if (widest > 2 * M_PI)
    return fmt::format("{} has deflections up to {:.4g} rad, more than a turn: are they degrees?",
                       path, widest);
  if (!errors.any()) return rough_remark(curves, path);
  double least = HUGE_VAL, most = 0, roughest = 0, where_least = 0, where_most = 0, half = 0;
  // A hundredth on each side, of all settings together about.
  const double sigmas = std::sqrt(5.4 + 2 * std::log(double(curves.size())));
  for (const auto& [sigma, c] : curves) {
    const double own = half_loop(c), scatter = scatter_of(c, errors.of(c.y, c.of_rows), own);
    roughest = std::max(roughest, scatter);
    const auto usual = phs::usual_scatter(c.x.size(), sigmas);
    if (scatter < least && scatter < std::clamp(usual.first, 1 / 3.0, 0.6)) {
      least = scatter;
      where_least = sigma;
    }
    // A twentieth: the curve of errors stated too small follows them at once.
    if (scatter > most && scatter > std::max(usual.second, 1 / 0.95)) {
      most = scatter;
      where_most = sigma;
      half = own;
    }
  }
  const auto at = [&](double sigma) {
    return curves.size() > 1 ? fmt::format(" at sigma = {:.4g}", sigma) : "";
  };
  const auto stating = [](const TorqueErrors& to_state) {
    return to_state.any() ? "; state " + errors_text(to_state) : "";
  };
  if (least < 1) {  // exact ones, or another setting scatters by more: no number
    const bool known = roughest > 1e-3 && roughest <= 1;
    const TorqueErrors less = known ? calming(curves, errors, roughest) : TorqueErrors{};
    // else the smaller ones would be followed
    if (less.absolute < 0.9 * errors.absolute || less.relative < 0.9 * errors.relative)
      return fmt::format(
          "{}: the errors that smoothing states are {} times what neighbours scatter by{}: the "
          "curve may be flattened{}",
          path, least < 1e-3 ? "over 1000" : fmt::format("{:.2g}", 1 / least), at(where_least),
          stating(less));
  }
  if (most > 0 && half > 0)
    return fmt::format(
        "{}: loading and unloading differ by {:.2g} N m{}: half of it counts as an error, which "
        "with the noise is {:.3g} times what smoothing states: the curve may follow the loop, and "
        "its stiffness more so{}",
        path, 2 * half, at(where_most), most, stating(calming(curves, errors, most)));
  if (most > 0)
    return fmt::format(
        "{}: neighbours scatter by {:.3g} times the errors that smoothing states{}: the curve may "
        "follow the errors, and its stiffness more so{}",
        path, most, at(where_most), stating(calming(curves, errors, most)));
  if (m.errors_to_state.any())
    return fmt::format(
        "{}: the stiffness goes to and fro by a tenth and more, as the errors do: the curve "
        "follows them{}",
        path, stating(m.errors_to_state));
  for (const auto& [sigma, c] : curves)
    if (misses_the_shape(c, errors))
      return fmt::format(
          "{}: the smoothed curve{} runs past long rows of neighbours on one side: the errors are "
          "stated too large for the shape of the spring, at least where torques are small (errors "
          "of a few per cent: relative_smoothing)",
          path, at(sigma));
  if (m.one_setting > 0)
    return fmt::format("{}: settings of sigma nearer than {:.2g} count as one: {} are left", path,
                       m.one_setting, m.sigma.size());
  return "";
}

}  // namespace porthos::vsa
