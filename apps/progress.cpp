#include "apps/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace porthos::apps {
namespace {

std::string time_text(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0) return "?";
  const auto s = static_cast<long long>(std::ceil(seconds));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} h {:02} min", s / 3600, s / 60 % 60);
}

}  // namespace

Progress::Progress()
    : terminal_(isatty(STDERR_FILENO) == 1),
      begun_(std::chrono::steady_clock::now()),
      last_(begun_) {}

void Progress::update(double fraction) {
  const double spent =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
  update(fraction, spent, spent * (1 - fraction) / fraction);
}

void Progress::update(double fraction, double spent, double left) {
  const auto now = std::chrono::steady_clock::now();
  if (!terminal_ && now - last_ < std::chrono::seconds(5)) return;
  last_ = now;
  const double f = std::clamp(fraction, 0.0, 1.0);
  const std::string text =
      fmt::format("{:5.1f} %  {} spent, {} left", 100 * f, time_text(spent), time_text(left));
  if (!terminal_) {
    fmt::print(stderr, "porthos: {}\n", text);
    return;
  }
  constexpr int width = 30;
  const int full = static_cast<int>(f * width);
  fmt::print(stderr, "\r[{}{}] {}\033[K", std::string(size_t(full), '#'),
             std::string(size_t(width - full), '.'), text);
  std::fflush(stderr);
  drawn_ = true;
}

void Progress::finish() {
  if (drawn_) fmt::print(stderr, "\r\033[K");
  drawn_ = false;
}

}  // namespace porthos::apps
