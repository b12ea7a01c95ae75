// At which intervals the rows of a trajectory follow each other, and what that leaves to judge.
#include "scene/judge/detail/rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/run/growth_words.h"
#include "scene/run/statistics.h"

namespace porthos::scene {
namespace {

/// The longest piece [from, to] of the rows without a hole of more than these intervals.
std::pair<size_t, size_t> longest_piece(const Rows& rows, double most) {
  std::pair<size_t, size_t> best{0, 0};
  for (size_t i = 1, from = 0; i < rows.t.size(); ++i) {
    if (rows.interval(i) > most * rows.step) from = i;
    if (i - from > best.second - best.first) best = {from, i};
  }
  return best;
}

/// The errors of a piece at equal intervals. Empty where too many would have to be made up.
Numbers at_equal_intervals(const Rows& rows, const Numbers& errors, size_t from, size_t to) {
  constexpr double most_made_up = 0.2;
  Numbers all{errors[from]};
  for (size_t i = from + 1; i <= to; ++i) {
    const double n = std::max(1.0, std::round(rows.interval(i) / rows.step));
    for (double k = 1; k <= n; ++k)
      all.push_back(errors[i - 1] + k / n * (errors[i] - errors[i - 1]));
  }
  const double made_up = double(all.size()) - double(to - from + 1);
  return made_up > most_made_up * double(all.size()) ? Numbers{} : all;
}

void note_holes(RunReport& r, const Rows& rows) {
  constexpr size_t named = 3;
  auto holes = rows.holes();
  if (holes.empty()) return;
  std::ranges::stable_sort(holes,
                           [&](size_t a, size_t b) { return rows.interval(a) > rows.interval(b); });
  std::string note;
  for (size_t k = 0; k < std::min(named, holes.size()); ++k)
    note += fmt::format("{}rows {}-{}: {:.6g} s apart", k > 0 ? ", " : "", holes[k], holes[k] + 1,
                        rows.interval(holes[k]));
  if (holes.size() > named) note += fmt::format(", and {} holes more", holes.size() - named);
  r.notes.push_back(fmt::format("{}, the others {:.6g} s: rates and works are not checked there",
                                note, rows.step));
}

}  // namespace

void tell_of_rows(RunReport& r, const Rows& rows, const Numbers& errors) {
  if (rows.equal) return;
  note_holes(r, rows);
  EnergyReport& e = r.energy;
  ErrorStatistics s;
  constexpr double most_missing = 10, fewest = 1.0 / 3;
  const auto [from, to] = longest_piece(rows, most_missing);
  const double whole = rows.t.back() - rows.t[0], piece = rows.t[to] - rows.t[from];
  if (rows.mostly_equal && piece > fewest * whole)
    for (const double error : at_equal_intervals(rows, errors, from, to)) s.add(error);
  set_growth(e, s, rows.step, e.scale_J);
  e.jump_s += rows.t[from] - rows.t[0];
  if (s.count() == 0) e.unknown = GrowthUnknown::unequal_rows;
  double shortest = rows.interval(1), longest = shortest;
  for (size_t i = 2; i < rows.t.size(); ++i) {
    shortest = std::min(shortest, rows.interval(i));
    longest = std::max(longest, rows.interval(i));
  }
  if (s.count() > 0) {
    if (piece < whole)
      r.notes.push_back(fmt::format("how the error grows is told of rows {}-{}", from + 1, to + 1));
    if (rows.others > 1)
      r.notes.push_back(
          fmt::format("{} of {} rows follow at other intervals ({:.3g} to {:.3g} s): how the error "
                      "grows is told "
                      "as if rows were {:.3g} s apart, on lines where they are missing",
                      rows.others, rows.t.size(), shortest, longest, rows.step));
    return;
  }
  r.notes.push_back(
      fmt::format("the rows are at unequal intervals ({:.3g} to {:.3g} s), which do not tell how "
                  "the error grows: expected rows that are written at equal intervals",
                  shortest, longest));
}

void note_one_row(RunReport& r, const Rows& rows, const Numbers& errors) {
  constexpr double beside = 0.1;
  const auto energy = std::ranges::find(r.checks, "energy", &Check::name);
  if (energy == r.checks.end() || energy->pass || errors.size() < 8) return;
  Numbers sorted = errors;  // the first row, which errors count from, may be the wrong one
  const auto middle = sorted.begin() + long(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  size_t worst = 0;
  double most = 0, next = 0;
  for (size_t i = 0; i < errors.size(); ++i) {
    const double off = std::fabs(errors[i] - *middle);
    next = std::max(next, std::min(off, most));
    if (off > most) worst = i;
    most = std::max(most, off);
  }
  if (next < beside * most)
    r.notes.push_back(
        fmt::format("row {} at {:.6g} s alone is far off: its energy by {:.2g} J, that of all "
                    "others by at most {:.2g} J",
                    worst + 1, rows.t[worst], most, next));
}

void tell_of_momentum(RunReport& r, const Rows& rows, const std::string& check,
                      const Numbers& errors) {
  const auto failed =
      std::ranges::find_if(r.checks, [&](const Check& c) { return c.name == check && !c.pass; });
  const double most = *std::ranges::max_element(errors);
  if (failed == r.checks.end() || !rows.equal || !(most > 0)) return;
  ErrorStatistics s;
  for (const double error : errors) s.add(failed->value / most * error);
  r.notes.push_back(fmt::format("the error of {} {}", check, growth_words(s)));
}

}  // namespace porthos::scene
