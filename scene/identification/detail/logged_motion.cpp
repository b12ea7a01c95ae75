#include "scene/identification/detail/logged_motion.h"

#include <algorithm>
#include <cmath>

#include "mechanics/kinematics.h"
#include "mechanics/rotation.h"
#include "scene/read/output.h"

namespace porthos::scene {
namespace {

using mechanics::Quaternion;
using Numbers = std::vector<double>;

/// The columns of a log by the coordinates and rates of a mechanism.
class Columns {
 public:
  Columns(const Assembly& a, const Log& log)
      : mechanism_(*a.mechanism),
        log_(log),
        rates_(size_t(mechanism_.nv())),
        places_(size_t(mechanism_.nq())) {
    const auto three = component_suffixes(3);
    for (const auto& c : mechanism_.coordinates()) {
      if (c.nv == 1) {
        rates_[size_t(c.v)] = column(c.name + ".velocity");
        places_[size_t(c.q)] = column(c.name + ".position");
        continue;
      }
      const bool turns = c.kind == phs::BlockKind::rotation;
      for (size_t k = 0; k < 3; ++k) {
        const std::string end = "." + three[k];
        rates_[size_t(c.v) + k] =
            column(c.joint + (turns ? ".angular_velocity" : ".linear_velocity") + end);
        if (!turns) places_[size_t(c.q) + k] = column(c.joint + ".position" + end);
      }
      if (turns)
        attitudes_.push_back(size_t(c.q));
      else
        moves_.push_back({size_t(c.v), size_t(mechanism_.coordinate(c.joint + ".attitude").q)});
    }
  }
  static bool all(const std::vector<const LogColumn*>& columns) {
    return std::ranges::all_of(columns, [](const LogColumn* c) { return c != nullptr; });
  }
  bool rates() const { return all(rates_); }
  bool places() const { return all(places_); }

  LoggedMotion from(Numbers q) const {
    LoggedMotion m;
    for (const LogColumn* c : rates_) m.sigma.push_back(c->sigma > 0 ? c->sigma : 1);
    for (size_t row = 0; row < log_.times.size(); ++row) {
      if (row > 0) advance(q, row - 1);
      for (size_t k = 0; k < q.size(); ++k)
        if (const LogColumn* c = places_[k])
          q[k] =
              c->of.wraps ? q[k] + std::remainder(c->values[row] - q[k], 2 * M_PI) : c->values[row];
      m.q.push_back(q);
      m.v.push_back(rates_at(q, {.first = row, .count = 1, .weight = {1}}));
    }
    return m;
  }

 private:
  struct Move {
    size_t v, attitude;  ///< offsets of a linear velocity, logged in the axes of the parent
  };
  const LogColumn* column(const std::string& name) const {
    const auto at =
        std::ranges::find_if(log_.columns, [&](const LogColumn& c) { return c.of.name == name; });
    return at == log_.columns.end() ? nullptr : &*at;
  }
  /// Joint rates between rows, at coordinates there.
  Numbers rates_at(const Numbers& q, const Neighbours& n) const {
    Numbers v(rates_.size(), 0.0);
    for (size_t i = 0; i < v.size(); ++i)
      for (size_t k = 0; k < n.count; ++k) v[i] += n.weight[k] * rates_[i]->values[n.first + k];
    for (const Move& move : moves_) {
      double* const u = &v[move.v];
      const auto own = rotation_matrix(Quaternion<double>::load(&q[move.attitude])).transposed() *
                       mechanics::Vec3d{u[0], u[1], u[2]};
      for (int k = 0; k < 3; ++k) u[k] = own[k];
    }
    return v;
  }
  /// From a row to the next, by the classical Runge-Kutta method.
  void advance(Numbers& q, size_t row) const {
    constexpr int parts = 4;
    const double h = (log_.times[row + 1] - log_.times[row]) / parts;
    const size_t n = q.size();
    Numbers slope(n), at(n), sum(n);
    for (int part = 0; part < parts; ++part) {
      const double t = log_.times[row] + part * h;
      std::ranges::fill(sum, 0.0);
      for (const auto& [c, weight] : {std::pair{0.0, 1.0}, {0.5, 2.0}, {0.5, 2.0}, {1.0, 1.0}}) {
        for (size_t k = 0; k < n; ++k) at[k] = q[k] + c * h * slope[k];
        const Numbers v = rates_at(at, interpolation(log_.times, row, t + c * h));
        mechanics::coordinate_rates<double>(mechanism_, at, v, slope);
        for (size_t k = 0; k < n; ++k) sum[k] += weight / 6 * slope[k];
      }
      for (size_t k = 0; k < n; ++k) q[k] += h * sum[k];
      for (const size_t a : attitudes_) normalise(&q[a]);
    }
  }
  static void normalise(double* xi) {
    const double size = std::hypot(std::hypot(xi[0], xi[1]), std::hypot(xi[2], xi[3]));
    for (int k = 0; k < 4; ++k) xi[k] /= size;
  }

  const mechanics::Mechanism& mechanism_;
  const Log& log_;
  std::vector<const LogColumn*> rates_, places_;  ///< null: the log has none
  std::vector<Move> moves_;
  std::vector<size_t> attitudes_;
};

}  // namespace

Neighbours interpolation(const std::vector<double>& times, size_t i, double t) {
  Neighbours n;
  n.count = std::min<size_t>(n.weight.size(), times.size());
  n.first = std::min(i > 0 ? i - 1 : 0, times.size() - n.count);
  for (size_t k = 0; k < n.count; ++k) {
    n.weight[k] = 1;
    for (size_t j = 0; j < n.count; ++j)
      if (j != k)
        n.weight[k] *= (t - times[n.first + j]) / (times[n.first + k] - times[n.first + j]);
  }
  return n;
}

Neighbours integration(const std::vector<double>& times, size_t i) {
  const double half = (times[i + 1] - times[i]) / 2, middle = times[i] + half;
  Neighbours sum = interpolation(times, i, middle - half / std::sqrt(3.0));  // Gauss's two nodes
  const Neighbours other = interpolation(times, i, middle + half / std::sqrt(3.0));
  for (size_t k = 0; k < sum.count; ++k) sum.weight[k] = half * (sum.weight[k] + other.weight[k]);
  return sum;
}

std::optional<LoggedMotion> motion_of(const Assembly& a, const Log& log, bool start_known) {
  constexpr double rounding = 1e-12;
  const Columns columns(a, log);
  const bool from_start = start_known && std::fabs(log.times.front()) <= rounding;
  if (!columns.rates() || (!from_start && !columns.places())) return {};
  auto q = phs::with_turns(a.model->description(), a.initial);
  q.resize(size_t(a.mechanism->nq()));
  return columns.from(std::move(q));
}

}  // namespace porthos::scene
