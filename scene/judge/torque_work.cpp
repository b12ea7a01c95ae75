// Works of recorded torques between rows, and what rows so far apart leave unknown of them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/judge/detail/trajectory.h"
#include "scene/judge/detail/turns.h"
#include "scene/judge/detail/work_error.h"

namespace porthos::scene {
namespace {

/// The slope at row i, of the parabola through it and the nearest rows of that stride. Fewer than
/// three rows: that of their line.
double slope_of_column(const Numbers& t, const Numbers& y, size_t i, size_t stride) {
  const size_t n = t.size();
  const bool first = i < stride, last = i + stride >= n;
  const auto chord = [&](size_t k) { return (y[k] - y[i]) / (t[k] - t[i]); };
  if (first ? i + 2 * stride >= n : last && i < 2 * stride)
    return chord(first ? i + stride : i - stride);
  const size_t a = first ? i + stride : i - stride, b = first  ? i + 2 * stride
                                                        : last ? i - 2 * stride
                                                               : i + stride;
  return chord(a) + (chord(b) - chord(a)) * (t[i] - t[a]) / (t[b] - t[a]);
}

/// The largest difference of the sums of works at the ends of pairs of rows, less pairs with holes.
/// @param stride  of the fine ones
double farthest(const Numbers& fine, const Numbers& coarse, const Rows& rows, size_t stride) {
  double sum = 0, most = 0;
  for (size_t k = 0; k < coarse.size(); ++k) {
    bool broken = false;
    for (size_t i = 2 * k * stride; i < 2 * (k + 1) * stride; ++i) broken |= rows.is_hole(i + 1);
    if (broken) continue;
    sum += fine[2 * k] + fine[2 * k + 1] - coarse[k];
    most = std::max(most, std::fabs(sum));
  }
  return most;
}

/// Of powers by the trapezoidal rule over rows of that stride.
Numbers trapezoids(const Numbers& t, const Numbers& power, size_t stride) {
  Numbers all;
  for (size_t i = stride; i < t.size(); i += stride)
    all.push_back(0.5 * (t[i] - t[i - stride]) * (power[i - stride] + power[i]));
  return all;
}

}  // namespace

/// ∫ τ q' with the cubic q through both ends and their rates, and the line τ; smooth: the cubic τ
/// through both ends and their slopes.
double Trajectory::work(const Columns& k, const Numbers& t, size_t from, size_t to,
                        Between between) const {
  const double a = k.torque[from], b = k.torque[to], v = k.v[0][from], w = k.v[0][to],
               h = t[to] - t[from];
  double moved = 0;
  for (size_t i = from + 1; i <= to; ++i) moved += distance(k, i, t[i] - t[i - 1]);
  if (between == Between::held) return a * moved;
  const double line = 0.5 * (a + b) * moved + (b - a) * h / 12 * (w - v);
  if (between == Between::linear) return line;
  const double chord = (b - a) / h, bend = 0.1 * (moved / h - 0.5 * (v + w)),
               start = slope_of_column(t, k.torque, from, to - from) - chord,
               end = slope_of_column(t, k.torque, to, to - from) - chord;
  return line + h * h * (start * (v / 20 + w / 30 + bend) - end * (v / 30 + w / 20 + bend));
}

void Trajectory::works(const Numbers& t, size_t i, std::span<double> to) const {
  size_t at = 0;
  for (const Columns& k : columns_)
    if (!k.torque.empty()) to[at++] = work(k, t, i - 1, i, map_.torque_between);
}

Numbers Trajectory::works_over(const Numbers& t, Between between, size_t stride) const {
  Numbers all;
  for (size_t i = stride; i < t.size(); i += stride) {
    double sum = 0;
    for (const Columns& k : columns_)
      if (!k.torque.empty()) sum += work(k, t, i - stride, i, between);
    all.push_back(sum);
  }
  return all;
}

namespace {

using Between = TrajectoryMap::TorqueBetween;

const char* between_name(Between between) {
  return between == Between::held ? "held" : between == Between::linear ? "linear" : "smooth";
}

/// The error of sums of works over all rows, from those over every second and every fourth: the
/// difference of the first two by Richardson, with the order that the second two show. A rule
/// reaches its own only where the rows resolve the powers.
/// @param fall  by which differences fall at most: 4 of a rule of order 2, 16 of order 4
template <class Works>
double extrapolated_error(Works works_over, const Rows& rows, double fall) {
  const Numbers two = works_over(2);
  const double fine = farthest(works_over(1), two, rows, 1),
               coarse = farthest(two, works_over(4), rows, 2);
  return fine == 0 ? 0 : fine / (std::clamp(coarse / fine, 2.0, fall) - 1);
}

/// The error of the works between rows, the largest over the trajectory [J].
double error_of_works(const Trajectory& trajectory, Between between, const JudgedRows& rows) {
  const Numbers& t = rows.at.t;
  const double of_own = extrapolated_error(
      [&](size_t stride) { return trapezoids(t, rows.own, stride); }, rows.at, 4);
  if (between == Between::held) return of_own;
  return of_own + extrapolated_error(
                      [&](size_t stride) { return trajectory.works_over(t, between, stride); },
                      rows.at, between == Between::linear ? 4 : 16);
}

/// The energy error if the torques went so between rows, the largest [J].
double error_if(const Trajectory& trajectory, Between now, Between other, const JudgedRows& rows) {
  const Numbers is = trajectory.works_over(rows.at.t, now, 1),
                would = trajectory.works_over(rows.at.t, other, 1);
  double sum = 0, most = 0;
  for (size_t i = 1; i < rows.errors.size(); ++i) {
    if (!rows.at.is_hole(i)) sum += is[i - 1] - would[i - 1];
    most = std::max(most, std::fabs(rows.errors[i] + sum));
  }
  return most;
}

}  // namespace

void judge_works(RunReport& r, const Trajectory& trajectory, Between between,
                 const JudgedRows& rows) {
  constexpr double few = 3, clearly = 0.1;
  EnergyReport& e = r.energy;
  const bool is_bad = !r.passed() || e.drift_is_significant;
  const double unknown = error_of_works(trajectory, between, rows);
  if (unknown > 0) {
    std::string note = fmt::format(
        "the rows tell the works between them to {:.2g} J, {:.2g} relative (by every second and "
        "fourth row)",
        unknown, unknown / e.scale_J);
    if (is_bad && e.max_abs_error_J <= few * unknown) {
      note += fmt::format(": the energy's error is within {:g} times that and tells no drift", few);
      e.drift_is_significant = false;
      set_aside(r, {"energy", "balance"},
                fmt::format("the rows tell the works between them to {:.2g} relative only: "
                            "expected more rows{}",
                            unknown / e.scale_J,
                            between == Between::linear
                                ? ", or torque_between = \"smooth\" if the torque is smooth"
                                : ""));
    }
    r.notes.push_back(note);
  }
  if (!is_bad || trajectory.torques().empty()) return;
  for (const Between other : {Between::smooth, Between::linear, Between::held})
    if (const double error =
            other == between ? INFINITY : error_if(trajectory, between, other, rows);
        error < clearly * e.max_abs_error_J) {
      r.notes.push_back(fmt::format(
          "with torque_between = \"{}\" the error of the energy is {:.2g} relative, as "
          "\"{}\" it is "
          "{:.2g}: how does the torque go between rows?",
          between_name(other), error / e.scale_J, between_name(between), e.max_rel_error));
      return;
    }
}

}  // namespace porthos::scene
