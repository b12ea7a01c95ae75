// The turns of angles: counted by the file, or told by the rates where it gives angles modulo 2π.
#include "scene/judge/detail/turns.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "phs/error.h"

namespace porthos::scene {
namespace {

using phs::BlockKind;

/// Between two rows; more is no motion, and their sum would not fit an integer.
constexpr double most_turns = 1e9;

/// Whether a column leaps by a whole turn and moves little else: wrapped, but at another place than
/// ±π, or 0 and 2π (as by fmod).
bool leaps_by_turns(const Numbers& q) {
  double other = 0, beside = 0;
  bool leaps = false;
  for (size_t i = 1; i < q.size(); ++i) {
    const double step = std::fabs(q[i] - q[i - 1]);
    const bool leap = step > 1.5 * M_PI;
    leaps |= leap;
    double& largest = leap ? beside : other;
    largest = std::max(largest, leap ? std::fabs(step - 2 * M_PI) : step);
  }
  return leaps && other < 0.5 * M_PI && beside <= 2 * other;
}

/// Whether angles may be given modulo a turn. Others count their turns themselves.
bool may_be_wrapped(const Numbers& q) {
  constexpr double rounded = 1e-2;  // files of few digits
  const double low = *std::ranges::min_element(q), high = *std::ranges::max_element(q);
  const auto within = [&](double from, double to) {
    return low >= from - rounded && high <= to + rounded;
  };
  if (within(-M_PI, M_PI) || within(0, 2 * M_PI)) return true;
  return (within(low, low + 2 * M_PI) || within(-2 * M_PI, 2 * M_PI)) && leaps_by_turns(q);
}

/// What another turn of an angle changes.
struct Felt {
  bool energy = false, gaps = false, momenta = false;
};

Felt felt_of(const phs::Model& model, const phs::State& s, size_t angle) {
  constexpr double rounding = 1e-9;
  const phs::Description& d = model.description();
  const auto system = model.instantiate<double>();
  const auto rows = system->constraints();
  const auto values = [&](double more) {
    Numbers turns;
    for (const auto n : s.turns) turns.push_back(phs::two_pi_hi * double(n));
    turns[angle] += phs::two_pi_hi * more;
    system->set_turn_angles(turns);
    std::array<Numbers, 3> all{Numbers(d.storages.size()), Numbers(rows ? rows->count() : 0),
                               Numbers(size_t(d.invariant_count()))};
    system->stored(s.x, all[0]);
    if (rows) {
      rows->set_turn_angles(turns);
      rows->place(s.x, all[1]);
    }
    if (!all[2].empty()) system->invariants(s.x, all[2]);
    return all;
  };
  const auto is = values(0);
  std::array<bool, 3> felt{};
  for (const double more : {-1, 1}) {
    const auto would = values(more);
    for (size_t k = 0; k < is.size(); ++k)
      for (size_t n = 0; n < is[k].size(); ++n)
        felt[k] |= std::fabs(would[k][n] - is[k][n]) > rounding * std::fabs(is[k][n]);
  }
  return {felt[0], felt[1], felt[2]};
}

}  // namespace

void Trajectory::find_turns(Columns& k, size_t angle) const {
  const std::string of_porthos = fmt::format("turns[{}]", angle);
  k.wrapped = may_be_wrapped(k.q[0]);
  k.turns.clear();
  if (!k.wrapped || map_.q.contains(k.c.name) || table_.has(k.c.name) ||
      !table_.has("state/" + k.c.name) || !table_.has(of_porthos))
    return;
  k.turns = table_.column(of_porthos);
  k.wrapped = false;
}

void Trajectory::follow(size_t i, double h) {
  size_t turn = 0;
  for (const Columns& k : columns_) {
    if (k.c.kind != BlockKind::angle) continue;
    const double before = i > 0 ? k.q[0][i - 1] : k.q[0][i],
                 turns = !k.turns.empty() ? k.turns[i] - double(lost_[turn])
                         : i > 0 ? (distance(k, i, h) - (k.q[0][i] - before)) / phs::two_pi_hi
                                 : 0;
    if (!(std::fabs(turns) + std::fabs(k.q[0][i]) < most_turns))
      throw InvalidArgument(fmt::format(
          "{}: the angle of '{}' is {:g} rad and turns {:g} times since the row before it, "
          "expected less than {:g}",
          table_.at(i), k.c.name, k.q[0][i], turns, most_turns));
    lost_[turn++] += std::llround(turns);
  }
}

double Trajectory::distance(const Columns& k, size_t i, double h) const {
  const double step = k.q[0][i] - k.q[0][i - 1];
  if (!k.turns.empty()) return step + phs::two_pi_hi * (k.turns[i] - k.turns[i - 1]);
  if (!k.wrapped) return step;
  const double expected = 0.5 * h * (k.v[0][i - 1] + k.v[0][i]);
  return step + phs::two_pi_hi * std::round((expected - step) / phs::two_pi_hi);
}

std::vector<Trajectory::UnknownTurns> Trajectory::unknown_turns(const Rows& rows) const {
  std::vector<UnknownTurns> all;
  size_t angle = 0;
  for (const Columns& k : columns_) {
    if (k.c.kind != BlockKind::angle) continue;
    UnknownTurns one{angle++, 0, k.c.name};
    for (size_t i = 1; k.wrapped && one.row == 0 && i < rows.t.size(); ++i) {
      // What a joint does in a hole, its rates beside it do not tell.
      const size_t from = rows.is_hole(i) || i < 2 ? 0 : i - 2,
                   to = rows.is_hole(i) ? rows.t.size() : std::min(i + 2, rows.t.size());
      double fastest = 0;
      for (size_t n = from; n < to; ++n) fastest = std::max(fastest, std::fabs(k.v[0][n]));
      one.turns = rows.interval(i) * fastest / (2 * M_PI);
      if (one.turns > 0.5) one.row = i;
    }
    if (one.row > 0) all.push_back(one);
  }
  return all;
}

void judge_turns(RunReport& r, const Trajectory& trajectory, const Rows& rows,
                 const phs::Model& model, const phs::State& last) {
  for (const auto& one : trajectory.unknown_turns(rows)) {
    const std::string why = fmt::format(
        "the turns of '{}' behind row {} are not known: its angles may be given modulo a turn, and "
        "its rates reach {:.2g} turns in the {:.3g} s to the next row",
        one.name, one.row, one.turns, rows.interval(one.row));
    const Felt felt = felt_of(model, last, one.angle);
    if (felt.energy && set_aside(r, {"energy", "balance"}, why))
      r.energy.drift_is_significant = false;
    if (felt.gaps) set_aside(r, {"constraints", "constraint_rates"}, why);
    if (felt.momenta) set_aside(r, {"linear_momentum", "angular_momentum", "centre_of_mass"}, why);
    r.notes.push_back(why);
  }
}

bool set_aside(RunReport& r, const std::vector<std::string>& names, const std::string& why) {
  return std::erase_if(r.checks, [&](const Check& c) {
           const bool set = !c.pass && std::ranges::count(names, c.name) > 0;
           if (set)
             r.not_applicable.push_back(
                 {c.name, fmt::format("{:.2g} exceeds {:.2g}, but {}", c.value, c.limit, why),
                  true});
           return set;
         }) > 0;
}

}  // namespace porthos::scene
