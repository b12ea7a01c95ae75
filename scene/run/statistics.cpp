#include "scene/run/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "phs/error.h"

namespace porthos::scene {
namespace {

constexpr double enough = 8;  // increments needed to use a level
constexpr size_t fewest_parts = 9;
constexpr size_t fewest_levels = 3;
constexpr double fewest_records = 4;  // of a part whose scatter counts
constexpr double steep = 0.75;        // a slope as of a drift
constexpr double not_known = std::numeric_limits<double>::quiet_NaN();
/// As GrowthUnknown.
constexpr const char* reasons[] = {"", "few records", "few swings", "scatter", "unequal rows"};

}  // namespace

const char* to_string(GrowthUnknown why) { return reasons[size_t(why)]; }

GrowthUnknown growth_unknown(std::string_view text) {
  for (size_t k = 0; k < std::size(reasons); ++k)
    if (text == reasons[k]) return GrowthUnknown(k);
  throw InvalidArgument("'" + std::string(text) +
                        "' is no reason why a growth is unknown, expected one as \"few records\"");
}

void ErrorStatistics::Parts::add(double error) {
  sum += error;
  squares += error * error;
  if (++records < length) return;
  means.push_back(sum / length);
  mean_squares.push_back(squares / length);
  records = sum = squares = 0;
  if (means.size() < 2 * fewest_parts) return;
  for (auto* of : {&means, &mean_squares}) {
    for (size_t i = 0; i < fewest_parts; ++i) (*of)[i] = ((*of)[2 * i] + (*of)[2 * i + 1]) / 2;
    of->resize(fewest_parts);
  }
  length *= 2;
}

void ErrorStatistics::add(double error, bool regular) {
  if (count_ == 0) start_ = error;
  const double increment = error - end_;
  end_ = error;
  max_abs_ = std::max(max_abs_, std::fabs(error));
  sum_of_squares_ += error * error;
  ++count_;
  if (!regular) return;

  parts_.add(error);
  const auto n = static_cast<std::uint64_t>(regular_++);
  if (n == 0) return;
  if (std::fabs(increment) > std::fabs(largest_)) {
    largest_ = increment;
    largest_at_ = double(n);
  }
  if ((n & (n - 1)) == 0) levels_.push_back({start_});  // n = 2^j: level j begins
  for (size_t j = 0; j < levels_.size() && n % (std::uint64_t(1) << j) == 0; ++j) {
    Level& level = levels_[j];
    const double over = error - level.last;
    level.sum_of_squares += over * over;
    level.last = error;
    ++level.count;
  }
}

double ErrorStatistics::rms() const { return count_ > 0 ? std::sqrt(sum_of_squares_ / count_) : 0; }

/// Of the parts [from, to).
double ErrorStatistics::Parts::variance(size_t from, size_t to) const {
  double mean = 0, square = 0;
  for (size_t i = from; i < to; ++i) {
    mean += means[i] / double(to - from);
    square += mean_squares[i] / double(to - from);
  }
  return std::max(0.0, square - mean * mean);
}

ErrorStatistics::Course ErrorStatistics::course() const {
  constexpr double next_to_none = 0.02, nearly_all = 0.8, clearly = 0.04;  // of a variance
  const size_t n = parts_.means.size();
  if (n < fewest_parts || parts_.length < fewest_records) return {};
  const double whole = parts_.variance(0, n);
  if (!(whole > 0)) return {};
  if (parts_.variance(n / 2, n) < next_to_none * whole) return {Course::settles};
  double least = whole, sum = 0;
  for (size_t k = 0; k < 4; ++k) {
    const double quarter = parts_.variance(k * n / 4, (k + 1) * n / 4);
    least = std::min(least, quarter);
    sum += quarter / 4;
  }
  const auto exponent = [&](double part, double length) {
    return std::max(0.0, 0.5 * std::log(whole / part) / std::log(length));
  };
  if (least > nearly_all * whole) return {Course::recurs, exponent(sum, 4)};
  const double first = parts_.variance(0, n / 2), last = parts_.means.back() - start_;
  if (first < next_to_none * whole && last * last > clearly * parts_.scatter(n - 1) && monotone())
    return {Course::explodes, 0.5 * std::log2(whole / std::max(first, 1e-30 * whole))};
  double in_part = 0;
  for (size_t i = 0; i < n; ++i) in_part += parts_.scatter(i) / double(n);
  return {Course::unknown, std::max(exponent(sum, 4), exponent(in_part, double(n)))};
}

bool ErrorStatistics::monotone() const {
  const auto& means = parts_.means;
  for (size_t i = 1; i < means.size(); ++i)
    if (!((means[i] - means[i - 1]) * (means.back() - means.front()) > 0)) return false;
  return means.size() >= fewest_parts;
}

ErrorStatistics::Jump ErrorStatistics::jump() const {
  constexpr double about = 0.25, little = 0.1;  // of the increment
  constexpr double many = 32, share = 0.3;
  const size_t n = parts_.means.size();
  if (n < fewest_parts || largest_ == 0) return {};
  // Parts wholly before and behind it; at the ends of the series its first and last record.
  const auto before = size_t(largest_at_ / parts_.length),
             behind = size_t(std::ceil(largest_at_ / parts_.length)) +
                      (largest_at_ == parts_.length * double(before));
  const auto mean = [&](size_t from, size_t to) {
    double sum = 0;
    for (size_t i = from; i < to; ++i) sum += parts_.means[i] / double(to - from);
    return sum;
  };
  const double size = std::fabs(largest_), change = (behind < n ? mean(behind, n) : end_) -
                                                    (before > 0 ? mean(0, before) : start_);
  const auto is_still = [&](size_t from, size_t to) {
    return from >= to || std::sqrt(parts_.variance(from, to)) <= little * size;
  };
  Jump j{Jump::none, largest_at_, largest_};
  if (is_still(0, before) && is_still(behind, n)) {
    if (std::fabs(change) <= little * size) j.kind = Jump::returns;
    if (std::fabs(change - largest_) <= about * size) j.kind = Jump::stays;
  }
  const Level& single = levels_[0];
  if (j.kind == Jump::none && single.count >= many && size * size > share * single.sum_of_squares &&
      !monotone() && course().kind == Course::unknown)
    j.kind = Jump::of_few;
  return j;
}

double ErrorStatistics::power_of_means() const {
  const size_t last = parts_.means.size() - 1, half = last / 2;
  const auto centre = [&](size_t i) { return (double(i) + 0.5) * parts_.length - 0.5; };
  return std::log((parts_.means[last] - start_) / (parts_.means[half] - start_)) /
         std::log(centre(last) / centre(half));
}

bool ErrorStatistics::slows() const {
  constexpr double little = 0.05;  // of a variance
  if (!monotone() || jump().kind != Jump::none || course().kind != Course::unknown || !drifts())
    return false;
  const size_t n = parts_.means.size();
  double in_part = 0;  // but for the first, in which it may rise steeply
  for (size_t i = 1; i < n; ++i) in_part += parts_.scatter(i) / double(n - 1);
  return in_part < little * parts_.variance(0, n) && power_of_means() < steep;
}

ErrorStatistics::Growth ErrorStatistics::growth() const {
  if (jump().kind != Jump::none) return {not_known};
  if (slows()) return {power_of_means()};
  const Course c = course();
  if (c.kind != Course::unknown) return {c.exponent};
  if (!levels_.empty() && levels_[0].count > 0 && !(levels_[0].sum_of_squares > 0)) return {0};
  const Growth slope = slope_of_increments();
  // Noise of single records, or a long swing under short ones: the scatter says more.
  constexpr double bounded = 0.25, hardly_any = 0.15;
  if (slope.exponent < bounded && c.exponent > hardly_any)
    return {not_known, GrowthUnknown::scatter};
  return slope;
}

size_t ErrorStatistics::first_level() const {
  constexpr double many = 32;  // increments whose sum scatters little
  for (size_t j = 0; j + 1 < levels_.size() && levels_[j + 1].count >= many; ++j) {
    const double now = levels_[j].sum_of_squares / levels_[j].count,
                 next = levels_[j + 1].sum_of_squares / levels_[j + 1].count;
    if (!(next > std::pow(2.0, 2 * steep) * now)) return j;
  }
  return 0;
}

ErrorStatistics::Growth ErrorStatistics::slope_of_increments() const {
  // Slope of y = ½ log S_j over x = j log 2.
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, net = 0, gross = 0;
  for (size_t j = first_level(); j < levels_.size(); ++j) {
    const Level& level = levels_[j];
    if (level.count < enough || !(level.sum_of_squares > 0)) continue;
    const double x = double(j) * std::log(2.0),
                 y = 0.5 * std::log(level.sum_of_squares / level.count);
    n += 1;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
    net = std::fabs(level.last - start_);
    gross = std::sqrt(level.count * level.sum_of_squares);
  }
  const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  // A few swings of a bounded error look like a drift while they rise, but come back.
  if (n < double(fewest_levels)) return {not_known, GrowthUnknown::few_records};
  if (slope > steep && net < 0.5 * gross) return {not_known, GrowthUnknown::few_swings};
  return {slope};
}

bool ErrorStatistics::drift_is_significant() const { return jump().kind == Jump::none && drifts(); }

bool ErrorStatistics::drifts() const {
  const auto kind = course().kind;
  if (kind == Course::settles || kind == Course::explodes) return kind == Course::explodes;
  return drift_of_records() || drift_of_means();
}

double ErrorStatistics::drift() const {
  if (drift_of_records() || !drift_of_means()) return change();
  const auto& means = parts_.means;
  const double middle = 0.5 * double(means.size() - 1);
  double products = 0, squares = 0;
  for (size_t i = 0; i < means.size(); ++i) {
    const double at = double(i) - middle;
    products += at * means[i];
    squares += at * at;
  }
  return products / squares / parts_.length * (count_ - 1);
}

bool ErrorStatistics::drift_of_records() const {
  bool judged = false;
  for (const Level& level : levels_) {
    if (level.count < enough) continue;
    const double mean = (level.last - start_) / level.count;  // increments telescope
    const double variance = std::max(0.0, level.sum_of_squares / level.count - mean * mean);
    if (!(std::fabs(change()) > 3 * std::sqrt(variance * level.count))) return false;
    judged = true;
  }
  return judged;
}

bool ErrorStatistics::drift_of_means() const {
  const auto& means = parts_.means;
  if (means.size() < fewest_parts) return false;
  const double n = double(means.size()) - 1, change = means.back() - means.front(),
               mean = change / n;
  double variance = 0, bends = 0, scatter = parts_.scatter(0) / (n + 1);
  for (size_t i = 1; i < means.size(); ++i) {
    const double increment = means[i] - means[i - 1] - mean;
    variance += increment * increment / n;
    scatter += parts_.scatter(i) / (n + 1);
    if (i < 2) continue;
    const double bend = means[i] - 2 * means[i - 1] + means[i - 2];
    bends += bend * bend / (2 * n - 2);
  }
  const bool walks = parts_.length > 1;
  if (walks) bends /= 0.75;
  const double of_walk = n * (walks ? 1.5 : 1), found = change * change;
  return found > scatter &&
         (found > 25 * of_walk * variance || (monotone() && found > 12 * of_walk * bends));
}

double ErrorStatistics::swing_growth() const {
  const size_t n = parts_.means.size();
  if (n < fewest_parts || parts_.length < fewest_records) return 1;
  int falls = 0;
  for (size_t i = 1; i < n; ++i) falls += parts_.scatter(i) <= parts_.scatter(i - 1);
  double first = parts_.scatter(0), last = parts_.scatter(n - 1);
  if (falls > 1) {  // of swings about as long as a part: in sixths of the series
    constexpr size_t sixths = 6;
    double sixth[sixths];
    for (size_t k = 0; k < sixths; ++k)
      sixth[k] = parts_.variance(k * n / sixths, (k + 1) * n / sixths);
    first = sixth[0];
    last = sixth[sixths - 1];
    if (!std::ranges::is_sorted(sixth) || !(last > 25 * first)) return 1;
  }
  return !(last > first && first > 0) ? 1 : std::sqrt(last / first);
}

std::vector<double> ErrorStatistics::memory() const {
  std::vector<double> m{count_, regular_, max_abs_, sum_of_squares_,
                        start_, end_,     largest_, largest_at_};
  const Parts& p = parts_;
  m.insert(m.end(), {p.length, p.records, p.sum, p.squares, double(p.means.size())});
  m.insert(m.end(), p.means.begin(), p.means.end());
  m.insert(m.end(), p.mean_squares.begin(), p.mean_squares.end());
  for (const Level& level : levels_)
    m.insert(m.end(), {level.last, level.sum_of_squares, level.count});
  return m;
}

void ErrorStatistics::restore(std::span<const double> m) {
  constexpr size_t fixed = 13;
  if (m.size() < fixed) require_size("memory of the statistics", m.size(), fixed);
  for (const double count : {m[0], m[1]}) (void)whole<std::int64_t>(count, 0, 0x1p53);
  const auto parts = size_t(whole<std::int64_t>(m[12], 0, 2 * fewest_parts - 1));
  if (m.size() < fixed + 2 * parts || (m.size() - fixed - 2 * parts) % 3 != 0)
    require_size("memory of the statistics", m.size(), fixed + 2 * parts);
  count_ = m[0];
  regular_ = m[1];
  max_abs_ = m[2];
  sum_of_squares_ = m[3];
  start_ = m[4];
  end_ = m[5];
  largest_ = m[6];
  largest_at_ = m[7];
  const auto means = m.subspan(fixed, parts), squares = m.subspan(fixed + parts, parts),
             levels = m.subspan(fixed + 2 * parts);
  parts_ = {
      m[8], m[9], m[10], m[11], {means.begin(), means.end()}, {squares.begin(), squares.end()}};
  levels_.clear();
  for (size_t i = 0; i < levels.size(); i += 3)
    levels_.push_back({levels[i], levels[i + 1], levels[i + 2]});
}

}  // namespace porthos::scene
