#include "vsa/table.h"

#include <algorithm>
#include <array>
#include <map>

#include <fmt/format.h>

#include "phs/functions/smoothing.h"
#include "phs/functions/spline.h"
#include "vsa/detail/table_remark.h"
#include "vsa/elastic-inl.h"

namespace porthos::vsa {
namespace {

using phs::Spline;
constexpr const char* family = "tabulated";

[[noreturn]] void refuse_table(const std::string& why) {
  throw InvalidArgument(std::string(family) + ": " + why);
}

/// Torque as a spline in φ with coefficients that are splines in σ, and its integral.
struct TableEnergy {
  struct Cubic {
    double y, b, c, d;
  };
  enum { value, slope, square, cube, before, coefficients };
  std::vector<double> phi,
      sigma;  ///< starts of the pieces; the first and the last piece are outside
  std::vector<Cubic>
      cubics;  ///< [(piece of φ · coefficients + coefficient) · pieces of σ + piece of σ]

  static size_t piece(const std::vector<double>& starts, double x) {
    size_t low = 0, high = starts.size();
    while (high - low > 1) {
      const size_t mid = (low + high) / 2;
      (x < starts[mid] ? high : low) = mid;
    }
    return low;
  }
  template <class T>
  T energy(const T& phi_now, const T& sigma_now) const {
    constexpr int n = phs::lanes<typename Below<T>::type>;
    std::array<size_t, size_t(n)> i, j;
    for (int k = 0; k < n; ++k) {
      i[size_t(k)] = piece(phi, lane(phi_now, k));
      j[size_t(k)] = piece(sigma, lane(sigma_now, k));
    }
    const T f = phi_now - gather<T>([&](int k) { return phi[i[size_t(k)]]; });
    const T s = sigma_now - gather<T>([&](int k) { return sigma[j[size_t(k)]]; });
    const auto at = [&](size_t c) {
      const auto number = [&](double Cubic::*m) {
        return gather<T>([&](int k) {
          return cubics[(i[size_t(k)] * coefficients + c) * sigma.size() + j[size_t(k)]].*m;
        });
      };
      return number(&Cubic::y) +
             s * (number(&Cubic::b) + s * (number(&Cubic::c) + s * number(&Cubic::d)));
    };
    return at(before) + f * (at(value) + f * (T(0.5) * at(slope) + f * (at(square) / T(3.0) +
                                                                        f * (T(0.25) * at(cube)))));
  }
};

/// The columns of the table as splines.
struct Splines {
  const Measurements& m;
  size_t n = m.deflection.size(), count = m.sigma.size();
  double at(const std::vector<double>& v, size_t i, size_t j) const { return v[j * n + i]; }
  Spline row(const std::vector<double>& v, size_t j) const {
    return {m.deflection,
            {v.begin() + long(j * n), v.begin() + long(j * n + n)},
            Spline::Outside::linear,
            family};
  }
  Spline column(const std::vector<double>& v, size_t i) const {
    std::vector<double> c;
    for (size_t j = 0; j < count; ++j) c.push_back(at(v, i, j));
    return {m.sigma, c, Spline::Outside::linear, family};
  }
};

void check_grid(const Measurements& m) {
  const size_t n = m.deflection.size(), count = m.sigma.size();
  if (n < 3 || count < 1)
    refuse_table(fmt::format("has {} deflections and {} values of sigma, expected 3 and 1 or more",
                             n, count));
  for (const auto* axis : {&m.deflection, &m.sigma})
    for (size_t i = 0; i < axis->size(); ++i)
      if (!std::isfinite((*axis)[i]) || (i > 0 && !((*axis)[i] > (*axis)[i - 1])))
        refuse_table(fmt::format("{} number {} is {}, expected finite numbers that rise",
                                 axis == &m.sigma ? "sigma" : "deflection", i + 1, (*axis)[i]));
  if (m.deflection.front() > 0 || m.deflection.back() < 0)
    refuse_table(fmt::format(
        "deflections go from {} to {} rad, expected 0 among them: energies count from there",
        m.deflection.front(), m.deflection.back()));
  for (const auto& [name, column, needed] : {std::tuple{"torque", &m.torque, true},
                                             {"stiffness", &m.stiffness, false},
                                             {"sigma_effort", &m.sigma_effort, false}}) {
    if (column->empty() && !needed) continue;
    if (column->size() != n * count)
      refuse_table(fmt::format("{} has {} numbers, expected {}", name, column->size(), n * count));
    for (const double x : *column)
      if (!std::isfinite(x)) refuse_table(fmt::format("{} has a number that is not finite", name));
  }
}

/// Torques that fall from the first deflection to the last are those of the other sign.
void check_signs(const Measurements& m) {
  const size_t n = m.deflection.size();
  for (size_t j = 0; j < m.sigma.size(); ++j) {
    const double first = m.torque[j * n], last = m.torque[j * n + n - 1];
    if (last < first)
      refuse_table(fmt::format(
          "at sigma = {} torque falls from {} to {} N m between deflections {} and {} rad, "
          "expected the torque that holds the deflection, which rises: is it the other sign, that "
          "of the spring on the link, or is the deflection theta - q in place of q - theta?",
          m.sigma[j], first, last, m.deflection.front(), m.deflection.back()));
  }
}

/// The torques of each σ without their errors.
Measurements smooth(const Measurements& measured, const TorqueErrors& errors) {
  Measurements m = measured;
  const size_t n = m.deflection.size();
  for (size_t j = 0; j < m.sigma.size(); ++j) {
    const auto first = m.torque.begin() + long(j * n);
    const std::vector<double> row(first, first + long(n));
    std::ranges::copy(phs::smoothed(m.deflection, row, errors.of(row)), first);
  }
  return m;
}

/// A spring pulls back harder the further it is drawn, between the places of the table too.
void check_stiffness(const Measurements& m, const TorqueErrors& errors) {
  const std::string advice =
      !errors.any() ? "smoothing [N m] takes out noise, of a hysteresis loop half its width"
      : m.errors_to_state.any()
          ? "state " + errors_text(m.errors_to_state)
          : "state the errors of the torques (of a hysteresis loop half its width)";
  for (size_t j = 0; j < m.sigma.size(); ++j) {
    const Spline row = Splines{m}.row(m.torque, j);
    for (size_t i = 1; i < m.deflection.size(); ++i) {
      // the slope b + 2 c d + 3 e d² of each piece between places
      const auto& p = row.pieces()[i];
      const double h = m.deflection[i] - m.deflection[i - 1];
      const double turn = p.d > 0 ? std::clamp(-p.c / (3 * p.d), 0.0, h) : 0.0;
      for (const double d : {0.0, turn, h})
        if (const double k = p.b + d * (2 * p.c + 3 * d * p.d); !(k >= 0))
          refuse_table(fmt::format(
              "with {} the stiffness is {:.4g} N m/rad at sigma = {} and {:.4g} rad, expected 0 or "
              "more: {}",
              errors.absolute > 0   ? fmt::format("smoothing = {} N m", errors.absolute)
              : errors.relative > 0 ? fmt::format("relative_smoothing = {}", errors.relative)
                                    : "no smoothing",
              k, m.sigma[j], m.deflection[i - 1] + d, advice));
    }
  }
}

void check_torques(const Measurements& m, double tolerance) {
  const Splines s{m};
  const auto [low, high] = std::minmax_element(m.torque.begin(), m.torque.end());
  for (size_t j = 0; j < s.count; ++j)
    for (size_t i = 0; i + 1 < s.n; ++i) {
      const double from = s.at(m.torque, i, j), to = s.at(m.torque, i + 1, j);
      if (!(to > from))
        refuse_table(fmt::format(
            "at sigma = {} torque goes from {} to {} N m between deflections {} and {} "
            "rad, expected it to rise: the equilibrium would not be unique (smoothing [N m] "
            "takes out noise)",
            m.sigma[j], from, to, m.deflection[i], m.deflection[i + 1]));
      if (m.stiffness.empty()) continue;
      const Spline k = s.row(m.stiffness, j);
      const double by_stiffness = k.integral(m.deflection[i + 1]) - k.integral(m.deflection[i]);
      if (!(std::fabs(by_stiffness - (to - from)) <=
            tolerance * (to - from + 0.05 * (*high - *low))))
        refuse_table(fmt::format(
            "at sigma = {} torque rises by {:.6g} N m between deflections {} and {} rad, but the "
            "stiffness adds up to {:.6g} N m, expected the derivative of the torque (to {} of it)",
            m.sigma[j], to - from, m.deflection[i], m.deflection[i + 1], by_stiffness, tolerance));
    }
}

/// Checks ∮ τ dφ + s dσ around each cell.
void check_curl(const Measurements& m, double tolerance) {
  const Splines s{m};
  for (size_t j = 0; j + 1 < s.count; ++j) {
    const Spline lower = s.row(m.torque, j), upper = s.row(m.torque, j + 1);
    for (size_t i = 0; i + 1 < s.n; ++i) {
      const Spline left = s.column(m.sigma_effort, i), right = s.column(m.sigma_effort, i + 1);
      const auto along = [](const Spline& f, const std::vector<double>& x, size_t k) {
        return f.integral(x[k + 1]) - f.integral(x[k]);
      };
      const double sides[] = {along(lower, m.deflection, i), along(right, m.sigma, j),
                              -along(upper, m.deflection, i), -along(left, m.sigma, j)};
      double work = 0, size = 0;
      for (const double x : sides) {
        work += x;
        size += std::fabs(x);
      }
      if (!(std::fabs(work) <= tolerance * size))
        refuse_table(
            fmt::format("is of no energy: round the cell of deflections {} to {} rad and sigma {} "
                        "to {} the work is {:.6g} J "
                        "of {:.6g} J, expected 0 (to {} of it): a cycle there would make energy",
                        m.deflection[i], m.deflection[i + 1], m.sigma[j], m.sigma[j + 1], work,
                        size, tolerance));
    }
  }
}

TableEnergy surface(const Measurements& m) {
  const Splines s{m};
  TableEnergy e;
  std::vector<Spline> rows;
  std::vector<double> at_rest;  // E(0, σ)
  for (size_t j = 0; j < s.count; ++j) rows.push_back(s.row(m.torque, j));
  if (m.sigma_effort.empty() || s.count == 1) {
    at_rest.assign(s.count, 0.0);
  } else {
    std::vector<double> effort;
    for (size_t j = 0; j < s.count; ++j) effort.push_back(s.row(m.sigma_effort, j).value(0.0));
    const Spline preload(m.sigma, effort, Spline::Outside::linear, family);
    for (const double x : m.sigma) at_rest.push_back(preload.integral(x));
  }
  for (const auto& p : rows[0].pieces()) e.phi.push_back(p.x);
  const auto put = [&](const std::vector<double>& over_sigma) {
    if (s.count == 1) {
      e.sigma = {m.sigma[0]};
      e.cubics.push_back({over_sigma[0], 0, 0, 0});
      return;
    }
    const Spline f(m.sigma, over_sigma, Spline::Outside::linear, family);
    e.sigma.clear();
    for (const auto& p : f.pieces()) {
      e.sigma.push_back(p.x);
      e.cubics.push_back({p.y, p.b, p.c, p.d});
    }
  };
  using P = Spline::Piece;
  for (size_t i = 0; i < e.phi.size(); ++i)
    for (double P::*member : {&P::y, &P::b, &P::c, &P::d, &P::before}) {
      std::vector<double> over_sigma;
      for (size_t j = 0; j < s.count; ++j) {
        double x = rows[j].pieces()[i].*member;
        if (member == &P::before) x += at_rest[j] - rows[j].integral(0.0);
        over_sigma.push_back(x);
      }
      put(over_sigma);
    }
  return e;
}

/// With the rows of its file, for pictures.
struct Tabulated final : ElasticOf<TableEnergy> {
  Tabulated(TableEnergy energy, ElasticTraits traits, const Measurements& from)
      : ElasticOf(std::move(energy), std::move(traits)), rows(from.rows), settings(from.sigma) {}
  std::vector<MeasuredTorque> rows;
  std::vector<double> settings;
};

}  // namespace

std::vector<MeasuredTorque> measured_torques(const Elastic& energy) {
  const auto* table = dynamic_cast<const Tabulated*>(&energy);
  return table ? table->rows : std::vector<MeasuredTorque>{};
}

std::vector<double> measured_settings(const Elastic& energy) {
  const auto* table = dynamic_cast<const Tabulated*>(&energy);
  return table ? table->settings : std::vector<double>{};
}

double measured_loop(const Elastic& energy) {
  struct Way {
    double n = 0, sum = 0, squares = 0;
    double mean() const { return sum / n; }
    double variance() const { return (squares / n - mean() * mean()) / n; }  // of the mean
  };
  double widest = 0;
  const auto rows = measured_torques(energy);
  std::map<double, std::array<Way, 2>> ways;  // of each σ: falling, rising
  for (size_t i = 0; i + 1 < rows.size(); ++i) {
    const auto &row = rows[i], &after = rows[i + 1];
    if (after.sigma != row.sigma || after.deflection == row.deflection) continue;
    Way& way = ways[row.sigma][after.deflection > row.deflection];
    const double off = row.torque - energy.slopes(row.deflection, 0, row.sigma).q;
    way.n += 1;
    way.sum += off;
    way.squares += off * off;
  }
  for (const auto& [sigma, way] : ways) {
    if (std::min(way[0].n, way[1].n) < 8) continue;
    const double apart = way[1].mean() - way[0].mean();
    if (apart > 5 * std::sqrt(way[0].variance() + way[1].variance()))
      widest = std::max(widest, apart);
  }
  return widest;
}

constexpr const char* no_pretension =
    "the table has no column sigma_effort: its energy at zero deflection counts as 0 at every "
    "sigma, so the work and the effort of the sigma drive lack the pretension";

ElasticPtr tabulated(const Measurements& measured, const Limits& limits, double tolerance,
                     const TorqueErrors& errors) {
  check_grid(measured);
  check_signs(measured);
  Limits l = limits;
  if (l.sigma_lower == -HUGE_VAL) l.sigma_lower = measured.sigma.front();
  if (l.sigma_upper == HUGE_VAL) l.sigma_upper = measured.sigma.back();
  require(errors.absolute >= 0, family, "the smoothing", errors.absolute, "0 N m or more");
  require(errors.relative >= 0 && errors.relative < 1, family, "the relative smoothing",
          errors.relative, "0 or more, and less than 1");
  const Measurements m =
      errors.any() && !measured.without_errors ? smooth(measured, errors) : measured;
  require(tolerance > 0 && tolerance < 1, family, "the tolerance", tolerance,
          "a number between 0 and 1");
  if (errors.any()) check_stiffness(m, errors);
  check_torques(m, tolerance);
  if (!errors.any()) check_stiffness(m, errors);
  if (!m.sigma_effort.empty()) check_curl(m, tolerance);
  const bool without_pretension = m.sigma.size() > 1 && m.sigma_effort.empty();
  ElasticTraits traits{.family = family,
                       .title = "Measured torques, splines",
                       .sigma = m.sigma.size() > 1 ? "as in the table" : "",
                       .sigma_unit = "1",
                       .limits = l,
                       .measured_from = m.deflection.front(),
                       .measured_to = m.deflection.back(),
                       .remark = without_pretension ? no_pretension : ""};
  return std::make_shared<Tabulated>(surface(m), std::move(traits), measured);
}

}  // namespace porthos::vsa
