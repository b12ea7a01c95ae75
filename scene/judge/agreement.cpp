// Whether the positions of a trajectory move as its rates say.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "mechanics/rotation.h"
#include "scene/judge/detail/rows.h"

namespace porthos::scene {

using mechanics::Vec3d;
using phs::BlockKind;

namespace {

/// A unit of the last place of a column: of its largest number, with the most digits that one of
/// its numbers has. Files with fewer than five digits are not meant to be so coarse.
double unit_of(const Numbers& column) {
  double largest = 0;
  int digits = 5;
  for (const double x : column) {
    if (x == 0 || !std::isfinite(x)) continue;
    largest = std::max(largest, std::fabs(x));
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, x, std::chars_format::scientific).ptr;
    digits = std::max(digits, int(std::count_if(text, std::find(text, end, 'e'),
                                                [](char c) { return c >= '0' && c <= '9'; })));
  }
  return largest == 0 ? 0 : std::pow(10.0, std::floor(std::log10(largest)) + 1 - digits);
}
/// The mean size of the difference of two numbers that are rounded to such units.
double rounding(const Numbers& column) { return unit_of(column) / 3; }

/// The worst leap of a coordinate, unless more than a third of its rows leap: another cause then.
/// What it moves from row to row is at most that of its fastest rate, also with an impact there.
/// @param slack  of the rounding of its numbers
/// @param moves_to  how it moves to row i: by positions, by rates, and the difference
template <class Moves>
std::optional<Trajectory::Leap> leap_of(const Rows& rows, double fastest, double slack,
                                        Moves moves_to) {
  std::optional<Trajectory::Leap> worst;
  size_t count = 0, held = 0;  // the row from which it is held
  double told = 0;             // since that row
  for (size_t i = 1; i < rows.t.size(); ++i) {
    Trajectory::Leap one = moves_to(i);
    const bool hole = rows.is_hole(i), still = one.moved == 0 && !hole;
    if (!still) held = i;
    told = still ? told + one.told : 0;
    if (hole) continue;
    one.from = still ? held : i - 1;
    one.to = i;
    one.allowed = 2 * rows.interval(i) * fastest + slack;
    if (still) {
      one.told = told;
      one.off = std::fabs(told);
    }
    if (!(one.off > one.allowed)) continue;
    ++count;
    if (!worst || one.off / one.allowed > worst->off / worst->allowed) worst = one;
  }
  if (worst) worst->rare = 20 * count < rows.t.size();
  return 3 * count < rows.t.size() ? worst : std::nullopt;
}

/// Why no coordinate is checked.
std::string why_no_rates(const Rows& rows, const std::optional<Trajectory::Agreement>& coarse) {
  bool any = false;
  for (size_t i = 0; i < rows.t.size(); ++i) any |= rows.resolve(i);
  if (!any)
    return fmt::format("too few rows: {}, expected 4 or more{}", rows.t.size(),
                       rows.equal ? "" : " without a hole");
  if (!coarse) return "nothing moves that has rates of its own";
  return coarse->hidden > 0
             ? fmt::format(
                   "the rates of '{}' tell of {:.2g} turns between rows, and its angles do "
                   "not show them",
                   coarse->name, coarse->hidden)
             : fmt::format(
                   "the rows are too far apart to tell, as the rates of '{}' change too "
                   "much between them: too few rows to check rates",
                   coarse->name);
}

/// A pass must be meaningful.
void judge_no_few_rows(RunReport& r, const Rows& rows) {
  constexpr size_t fewest = 4, some = 10;
  if (rows.t.size() >= some) return;
  if (rows.t.size() >= fewest)
    return r.notes.push_back(
        fmt::format("{} rows tell little of a motion: expected {} or more", rows.t.size(), some));
  for (Check& c : r.checks) c.telling = false;
  r.notes.push_back(fmt::format("too few rows to judge a motion: {}, expected {} or more",
                                rows.t.size(), fewest));
}

}  // namespace

Trajectory::Agreement Trajectory::agreement_of_attitude(const Columns& k, const Rows& rows) const {
  const auto attitude = [&](size_t i) {  // its length takes no part in the angle and the axis
    return mechanics::Quaternion<double>{k.q[0][i], {k.q[1][i], k.q[2][i], k.q[3][i]}};
  };
  const auto rate = [&](size_t i) { return Vec3d{k.v[0][i], k.v[1][i], k.v[2][i]}; };
  const bool along_world = axes_.angular_in_world && by_rates_;
  Agreement one{k.c.name};
  double rounded = 0;  // a rotation is twice the change of a quaternion
  for (const Numbers& column : k.q) rounded += 2 * rounding(column);
  double fastest = 0, angle = 0;
  const auto moves_to = [&](size_t i) {
    const auto before = attitude(i - 1), after = attitude(i);
    const auto turn = along_world ? after * before.conj() : before.conj() * after;
    const bool held = std::ranges::all_of(k.q, [&](auto& x) { return x[i] == x[i - 1]; });
    const double sine = held ? 0 : norm(turn.v);
    angle = 2 * std::atan2(sine, turn.w);
    const Vec3d expected = (0.5 * rows.interval(i)) * (rate(i - 1) + rate(i));
    Vec3d step{0, 0, 0};
    if (sine > 0) {
      const double hidden = dot(expected, turn.v) / sine - angle;  // turns that no quaternion shows
      step = ((angle + phs::two_pi_hi * std::round(hidden / phs::two_pi_hi)) / sine) * turn.v;
    }
    return Leap{0, 0, norm(step), norm(expected), norm(step - expected)};
  };
  for (size_t i = 0; i < rows.t.size(); ++i) fastest = std::max(fastest, norm(rate(i)));
  one.leap = leap_of(rows, fastest, 6 * rounded, moves_to);
  for (size_t i = 2; i + 1 < rows.t.size(); ++i) {
    if (!rows.resolve(i)) continue;
    const double h = rows.interval(i);
    one.rates += norm(rate(i));
    one.changes += norm(rate(i) - rate(i - 1));
    const Leap step = moves_to(i);
    one.hide(step.moved, angle);
    one.way += step.moved;
    one.off += step.off;
    // Of the rule, as below, and of the axis that turns meanwhile (Magnus 1954, second term).
    one.uncertain += h / 24 * norm(rate(i + 1) - rate(i) - rate(i - 1) + rate(i - 2)) +
                     h * h / 12 * norm(cross(rate(i - 1), rate(i))) + rounded;
  }
  return one;
}

/// The velocity of a base's origin along the world's axes, by row.
std::vector<Numbers> Trajectory::velocity_in_world(const Columns& place) const {
  if (!axes_.linear_in_body) return place.v;
  const auto of_same_base = [&](const Columns& k) {
    return k.c.kind == BlockKind::rotation && k.c.node == place.c.node;
  };
  const auto k = std::find_if(columns_.begin(), columns_.end(), of_same_base);
  std::vector<Numbers> v = place.v;
  for (size_t i = 0; k != columns_.end() && i < v[0].size(); ++i) {
    const auto R = mechanics::rotation_matrix(
        mechanics::Quaternion<double>{k->q[0][i], {k->q[1][i], k->q[2][i], k->q[3][i]}});
    const Vec3d world = R * Vec3d{v[0][i], v[1][i], v[2][i]};
    v[0][i] = world.x;
    v[1][i] = world.y;
    v[2][i] = world.z;
  }
  return v;
}

std::vector<Trajectory::Agreement> Trajectory::agreements(const Rows& rows) const {
  std::vector<Agreement> all;
  for (const Columns& k : columns_) {
    if (k.c.kind == BlockKind::rotation) {
      all.push_back(agreement_of_attitude(k, rows));
      continue;
    }
    const bool place = k.c.kind == BlockKind::linear && k.q.size() == 3;
    if (k.v.size() != k.q.size() || (place ? by_momenta_ : k.q.size() != 1)) continue;
    const auto rates = place ? velocity_in_world(k) : k.v;
    for (size_t a = 0; a < k.q.size(); ++a) {
      const Numbers& v = rates[a];
      const double of_places = rounding(k.q[a]), of_rates = rounding(k.v[a]);
      Agreement one{k.c.name};
      const auto moves_to = [&](size_t i) {
        const double h = rows.interval(i), told = 0.5 * h * (v[i - 1] + v[i]),
                     moved = place ? k.q[a][i] - k.q[a][i - 1] : distance(k, i, h);
        return Leap{0, 0, moved, told, std::fabs(moved - told)};
      };
      double fastest = 0;
      for (const double x : v) fastest = std::max(fastest, std::fabs(x));
      one.leap = leap_of(rows, fastest, 6 * of_places, moves_to);
      for (size_t i = 2; i + 1 < rows.t.size(); ++i) {
        if (!rows.resolve(i)) continue;
        const double h = rows.interval(i);
        one.rates += std::fabs(v[i]);
        one.changes += std::fabs(v[i] - v[i - 1]);
        const Leap step = moves_to(i);
        one.way += std::fabs(step.moved);
        one.hide(step.moved, k.wrapped ? k.q[a][i] - k.q[a][i - 1] : step.moved);
        one.off += step.off;
        one.uncertain +=
            h / 24 * std::fabs(v[i + 1] - v[i] - v[i - 1] + v[i - 2]) + of_places + h * of_rates;
      }
      all.push_back(one);
    }
  }
  return all;
}

RatesAgreement Trajectory::agreement(const Rows& rows) const {
  constexpr double least = 0.01;  // rows of few digits, steps of a library's own interpolation
  constexpr double coarse = 0.1, most = 0.3;
  RatesAgreement worst;
  worst.limit = least;
  for (const auto& a : agreements(rows)) {
    const double size = std::max(a.way, a.off);
    if (size == 0) continue;
    worst.hidden = std::max(worst.hidden, a.hidden);
    const double value = a.off / size, limit = least + 5 * a.uncertain / size;
    // What disagrees altogether leaves about all of its way.
    const bool near_limit = limit > coarse && value < 3 * limit;
    if (limit > most || (value > limit && (a.changes > a.rates || near_limit))) {
      worst.coarse = a;
      continue;
    }
    const auto size_of = [](const Leap& leap) { return leap.off / leap.allowed; };
    if (a.leap && (!worst.leap || size_of(*a.leap) > size_of(*worst.leap))) {
      worst.leap = a.leap;
      worst.leaps = a.name;
    }
    if (value / limit < worst.value / worst.limit) continue;
    worst.value = value;
    worst.limit = limit;
    worst.name = a.name;
  }
  return worst;
}

void check_rates(RunReport& r, const RatesAgreement& rates, const Rows& rows) {
  if (rates.name.empty()) r.not_applicable.push_back({"rates", why_no_rates(rows, rates.coarse)});
  judge_no_few_rows(r, rows);
  if (rates.name.empty()) return;
  Check check{"rates", rates.value, rates.limit, rates.holds(), false};
  if (rates.fits() && rates.leap) {
    const double way = std::max(std::fabs(rates.leap->moved), std::fabs(rates.leap->told));
    check.value = rates.leap->off / way;
    check.limit = rates.leap->allowed / way;
  }
  r.checks.push_back(check);
}

void note_rates(RunReport& r, const RatesAgreement& rates, const Rows& rows, bool explained) {
  if (rates.hidden > 0 && rates.name.empty())  // with times in another unit all else may pass
    for (auto& n : r.not_applicable) n.undecided |= n.name == "rates";
  if (rates.hidden > 0 && !explained)
    r.notes.push_back(fmt::format(
        "rates tell of up to {:.2g} turns between two rows, which angles do not show: if nothing "
        "turns that fast, are times in another unit, as milliseconds? expected seconds",
        rates.hidden));
  if (rates.leap && !explained && (rates.leap->rare || rates.fits()))
    r.notes.push_back(
        fmt::format("'{}' moves by {:.3g} from row {} to {}, t = {:.6g} s, and its rates tell of "
                    "{:.3g} there{}",
                    rates.leaps, rates.leap->moved, rates.leap->from + 1, rates.leap->to + 1,
                    rows.t[rates.leap->to], rates.leap->told,
                    rates.leap->rare ? ": are rows missing, times not theirs, or values held?"
                                     : ", and it leaps so in more than one row of 20"));
  if (!rates.name.empty() && !rates.fits())
    r.notes.push_back(fmt::format(
        "'{}' does not move as its rates say: {:.2g} of its way is left, expected at most {:.2g}: "
        "another unit, rates along other axes (linear_velocity_axes and angular_velocity_axes of "
        "the map), columns in another order, or a swing that fits between two rows",
        rates.name, rates.value, rates.limit));
  if (r.verdict() == Verdict::fail && rates.holds() && !explained)
    r.notes.push_back(
        "if it is not the solver's error, usual causes that were not tried: columns of another "
        "order or sign, other zeros of angles, gravity or offsets of encoders, other masses, "
        "friction or torques that the model lacks (docs/judge.md)");
}

}  // namespace porthos::scene
