#include "phs/functions/motion.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "phs/error.h"
#include "phs/scalars/lane.h"
#include "phs/scalars/trig.h"

namespace porthos::phs {
namespace {

void require_finite(const char* what, const char* which, double x) {
  if (!std::isfinite(x))
    throw InvalidArgument(std::string(what) + ": " + which + " is " + number(x) +
                          ", expected a finite number");
}
void require_positive(const char* what, const char* which, double x, const char* unit) {
  if (!(x > 0) || !std::isfinite(x))
    throw InvalidArgument(std::string(what) + ": " + which + " is " + number(x) + " " + unit +
                          ", expected a number > 0");
}

/// The moves as pieces: from `from` by `by`.
struct Piece {
  double at, duration, from, by;
};

/// The last piece that has begun at t; the first before all.
const Piece& piece_at(const std::vector<Piece>& pieces, double t) {
  const auto next = std::upper_bound(pieces.begin(), pieces.end(), t,
                                     [](double x, const Piece& p) { return x < p.at; });
  return next == pieces.begin() ? *next : *(next - 1);
}

/// value(p, s) at the fraction s of the piece at t, within 0 … 1.
template <class T, class Value>
T at_fraction(const std::vector<Piece>& pieces, const T& t, const Value& value) {
  if constexpr (is_pack<T>) {
    return map_lanes([&](double x) { return at_fraction(pieces, x, value); }, t);
  } else {
    const Piece& p = piece_at(pieces, to_double(t));
    const T s = (t - T(p.at)) / T(p.duration);
    if (to_double(s) <= 0) return value(p, T(0.0));
    if (to_double(s) >= 1) return value(p, T(1.0));
    return value(p, s);
  }
}

/// value(2π, sin, cos) of 2π frequency t + phase. Whole turns are dropped before the rounding of
/// their product, so that the last digits do not depend on how many there were.
template <class T, class Value>
T at_phase(double frequency, double phase, const T& t, const Value& value) {
  if constexpr (is_pack<T>) {
    return map_lanes([&](double x) { return at_phase(frequency, phase, x, value); }, t);
  } else {
    const T f(frequency),
        turn = T(6.283185307179586) + T(2.4492935982947064e-16);  // 2π in two words
    const T turns = f * t, rest = fma(f, t, -turns), whole(std::round(to_double(turns)));
    T s, c;
    sincos(turn * ((turns - whole) + rest) + T(phase), s, c);
    return value(turn, s, c);
  }
}

}  // namespace

Motion steady_motion(double start, double rate, const char* what) {
  require_finite(what, "the start", start);
  require_finite(what, "the rate", rate);
  return {function([=](auto t) { return decltype(t)(start) + decltype(t)(rate) * t; }),
          function([=](auto t) { return decltype(t)(rate); }),
          {}};
}

Motion swinging_motion(double middle, double amplitude, double frequency, double phase,
                       const char* what) {
  require_finite(what, "the middle", middle);
  require_finite(what, "the amplitude", amplitude);
  require_finite(what, "the phase", phase);
  require_positive(what, "the frequency", frequency, "Hz");
  return {function([=](auto t) {
            return at_phase(frequency, phase, t, [&](const auto&, const auto& s, const auto&) {
              using T = std::decay_t<decltype(s)>;
              return T(middle) + T(amplitude) * s;
            });
          }),
          function([=](auto t) {
            return at_phase(frequency, phase, t, [&](const auto& turn, const auto&, const auto& c) {
              using T = std::decay_t<decltype(c)>;
              return T(amplitude) * (T(frequency) * turn) * c;
            });
          }),
          {}};
}

Motion moves_from(double start, const std::vector<Move>& moves, const char* what) {
  require_finite(what, "the start", start);
  if (moves.empty())
    throw InvalidArgument(std::string(what) + ": it has no moves, expected one or more");
  std::vector<Piece> pieces;
  Motion m;
  double from = start;
  for (const Move& move : moves) {
    require_finite(what, "the begin of a move", move.at);
    require_finite(what, "the end position of a move", move.to);
    require_positive(what, "the duration of a move", move.duration, "s");
    if (!m.instants.empty() && move.at < m.instants.back())
      throw InvalidArgument(std::string(what) + ": a move begins at " + number(move.at) +
                            " s, expected " + number(m.instants.back()) +
                            " s, the end of the one before, or later");
    pieces.push_back({move.at, move.duration, from, move.to - from});
    if (m.instants.empty() || move.at > m.instants.back()) m.instants.push_back(move.at);
    m.instants.push_back(move.at + move.duration);
    from = move.to;
  }
  m.position = function([pieces](auto t) {
    return at_fraction(pieces, t, [](const Piece& p, auto s) {
      using T = decltype(s);
      return T(p.from) + T(p.by) * (s * s * s * (T(10.0) + s * (s * T(6.0) - T(15.0))));
    });
  });
  m.rate = function([pieces](auto t) {
    return at_fraction(pieces, t, [](const Piece& p, auto s) {
      using T = decltype(s);
      const T rest = T(1.0) - s;
      return (T(30.0) * T(p.by) / T(p.duration)) * (s * s) * (rest * rest);
    });
  });
  return m;
}

}  // namespace porthos::phs
