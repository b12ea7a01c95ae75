#include "energy_shaping/loop/modes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "energy_shaping/loop/derivatives.h"
#include "phs/linear_algebra/linear_algebra.h"

namespace porthos::energy_shaping {

std::vector<Mode> modes(std::span<const std::complex<double>> eigenvalues) {
  std::vector<Mode> all;
  for (const auto& s : eigenvalues)
    if (s.imag() >= 0 && std::abs(s) > 0)
      all.push_back({std::abs(s), 0.0 - s.real() / std::abs(s)});
  std::ranges::sort(all, {}, &Mode::frequency);
  return all;
}

void report_modes(Certificate& certificate, std::span<const std::complex<double>> eigenvalues) {
  const auto all = modes(eigenvalues);
  if (all.empty()) return;
  std::string text = "rad/s, the slowest;";
  std::vector<double> numbers;
  for (size_t i = 0; i < all.size(); ++i) {
    const auto& [frequency, ratio] = all[i];
    numbers.insert(numbers.end(), {frequency, ratio});
    if (i == 8) text += fmt::format(", {} more", all.size() - i);
    if (i >= 8) continue;
    text += fmt::format("{}{:.4g} rad/s", i == 0 ? " " : ", ", frequency);
    if (std::fabs(ratio) < 1)
      text += fmt::format(" (damping ratio {:.3g})", ratio);
    else if (ratio < 0)
      text += " (grows)";
  }
  certificate.report("modes", all[0].frequency, text, numbers);
  const auto& least = *std::ranges::min_element(all, {}, &Mode::damping_ratio);
  constexpr double rounding = 1e-7;  // of a double eigenvalue: √ε
  if (least.damping_ratio < -rounding) {
    const auto& fastest = *std::ranges::min_element(
        all, {}, [](const Mode& m) { return m.damping_ratio * m.frequency; });
    certificate.report(
        "unstable", fastest.damping_ratio,
        fmt::format("damping ratio of the mode at {:.4g} rad/s: it grows, and the loop leaves its "
                    "rest point by itself; choose other gains",
                    fastest.frequency));
  } else if (least.damping_ratio < 0.01) {
    certificate.report("hardly damped", least.damping_ratio,
                       fmt::format("damping ratio of the mode at {:.4g} rad/s: it swings on for "
                                   "long; raise the damping, or choose the gains by the modes",
                                   least.frequency));
  }
}

void report_modes(Certificate& certificate, const ClosedLoop& loop) {
  const auto& rest = loop.rest();
  report_modes(certificate, phs::spectrum(rest.size(), field_jacobian(loop, rest)).rest);
}

void certify_modes(Certificate& certificate, std::span<const std::complex<double>> eigenvalues,
                   double decay, const std::string& of) {
  double size = 0, rightmost = -HUGE_VAL;
  for (const auto& s : eigenvalues) {
    size = std::max(size, std::abs(s));
    rightmost = std::isnan(s.real()) ? NAN : std::max(rightmost, s.real());
  }
  certificate.at_most("rightmost eigenvalue", rightmost, -decay * size, of);
  if (!certificate.has("modes")) report_modes(certificate, eigenvalues);
}

}  // namespace porthos::energy_shaping
