#include "energy_shaping/matching/numerical_matching.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "energy_shaping/matching/detail/matching_rest.h"

namespace porthos::energy_shaping {
namespace {

/// A polynomial on [-w, w] by its Chebyshev coefficients.
struct Chebyshev {
  double w = 1;
  std::vector<double> c;

  /// Clenshaw's recurrence.
  template <class S>
  S operator()(const S& x) const {
    const S y = x * S(1 / w), two_y = y + y;
    S a(0.0), b(0.0);
    for (size_t k = c.size(); k-- > 1;) {
      const S next = two_y * a - b + S(c[k]);
      b = a;
      a = next;
    }
    return y * a - b + S(c[0]);
  }
  /// Interpolates f at n + 1 Chebyshev points.
  static Chebyshev of(double w, int n, const std::function<double(double)>& f) {
    const double pi = std::acos(-1.0);
    const int N = n + 1;
    std::vector<double> values(static_cast<size_t>(N));
    for (int j = 0; j < N; ++j) values[size_t(j)] = f(w * std::cos(pi * (j + 0.5) / N));
    Chebyshev p{w, std::vector<double>(size_t(N), 0.0)};
    for (int k = 0; k < N; ++k) {
      for (int j = 0; j < N; ++j)
        p.c[size_t(k)] += 2.0 / N * values[size_t(j)] * std::cos(pi * k * (j + 0.5) / N);
      if (k == 0) p.c[0] /= 2;
    }
    return p;
  }
  /// Its integral from 0.
  Chebyshev integral() const {
    const size_t n = c.size();
    const auto at = [&](size_t k) { return k < n ? c[k] * (k == 0 ? 2 : 1) : 0.0; };
    Chebyshev p{w, std::vector<double>(n + 1, 0.0)};
    for (size_t k = 1; k <= n; ++k) p.c[k] = w * (at(k - 1) - at(k + 1)) / (2.0 * double(k));
    p.c[0] = -p(0.0);
    return p;
  }
  /// The last coefficients relative to the largest: a measure of the resolution.
  double tail() const {
    double largest = 1e-300, last = 0;
    for (const double x : c) largest = std::max(largest, std::fabs(x));
    for (size_t k = c.size() - 4; k < c.size(); ++k) last = std::max(last, std::fabs(c[k]));
    return last / largest;
  }
};

struct FourierDesign {
  static constexpr int n = 2;
  static constexpr bool solve_skew = true;
  std::string name;
  size_t r, s;
  double rho, ku, kv, rest_r, rest_s;
  Chebyshev rr, rs, ss, constant, cosine, sine;
  std::string coordinate;  ///< r's name

  /// The polynomials grow without bound outside their interval; its ends are rounded.
  std::string hindrance(std::span<const double> q) const {
    if (std::fabs(q[r] - rest_r) <= (1 + 1e-9) * rr.w) return {};
    return fmt::format(
        "'{}' is {:.4g}, outside {:.4g} to {:.4g}, where numerical_matching made "
        "'{}': take a larger half_width than {:g}, or a start nearer to rest",
        coordinate, q[r], rest_r - rr.w, rest_r + rr.w, name, rr.w);
  }
  std::vector<Gain> gains() const { return {{"ku", ku}, {"kv", kv}}; }
  template <class S, class T>
  void mass(std::span<const S> q, std::span<const T>, std::span<S> Md) const {
    const S x = q[r] - S(rest_r);
    Md[3 * r] = rr(x);
    Md[1] = Md[2] = rs(x);
    Md[3 * s] = ss(x);
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T> k) const {
    const S x = q[r] - S(rest_r), y = q[s] - S(rest_s), z = y - S(rho) * x;
    return constant(x) + cosine(x) * phs::cos(y) + sine(x) * phs::sin(y) + S(0.5) * S(k[0]) * z * z;
  }
};

[[noreturn]] void refuse(const NumericalMatching& o, const std::string& why) {
  throw InvalidArgument("numerical matching '" + o.name + "': " + why);
}

/// The quantities of the plant that the quadratures need, r and s from the rest point.
class Probe {
 public:
  Probe(const phs::Model& plant, const NumericalMatching& o)
      : system_(plant.instantiate<phs::Dual>()),
        r_(size_t(o.unactuated)),
        s_(1 - r_),
        rest_(o.rest) {}

  struct Mass {
    double rr, rs, ss, d_rr, d_rs, d_ss;  ///< and ∂/∂r
  };
  Mass mass(double at) {
    phs::Dual I[4];  // M⁻¹
    for (size_t j = 0; j < 2; ++j) {
      std::array<phs::Dual, 4> x{phs::Dual(0.0), phs::Dual(0.0), phs::Dual(0.0), phs::Dual(0.0)}, e;
      x[s_] = rest_[s_];
      x[r_] = {rest_[r_] + at, 1};
      x[2 + j] = 1.0;
      system_->gradient(x, e);
      for (size_t i = 0; i < 2; ++i) I[2 * i + j] = e[2 + i];
    }
    const phs::Dual det = I[0] * I[3] - I[1] * I[2];
    const phs::Dual rr = I[3 * s_] / det, ss = I[3 * r_] / det, rs = -I[1] / det;
    return {rr.v, rs.v, ss.v, rr.d, rs.d, ss.d};
  }
  /// ∂V/∂r
  double slope(double r, double s) {
    std::array<phs::Dual, 4> x{phs::Dual(0.0), phs::Dual(0.0), phs::Dual(0.0), phs::Dual(0.0)}, e;
    x[r_] = rest_[r_] + r;
    x[s_] = rest_[s_] + s;
    system_->gradient(x, e);
    return e[r_].v;
  }

 private:
  std::unique_ptr<phs::System<phs::Dual>> system_;
  size_t r_, s_;
  std::array<double, 2> rest_;
};

/// The steps of a design for one plant and its options.
class FourierMatching {
 public:
  FourierMatching(const phs::Description& plant, const NumericalMatching& o, Probe& probe)
      : plant_(plant), o_(o), probe_(probe), F0_(F(0)) {
    column_keeps_its_sign();
    potential_is_harmonic();
    log_lambda_ = quadrature([&](double x) {
      const auto M = probe_.mass(x);
      return (rho_ * rho_ * M.d_ss + rho_ * M.d_rs) / (rho_ * M.rs + M.rr);
    });
  }

  FourierDesign design() {
    FourierDesign d{.name = o_.name,
                    .r = size_t(o_.unactuated),
                    .s = size_t(1 - o_.unactuated),
                    .rho = rho_,
                    .ku = o_.ku,
                    .kv = o_.kv,
                    .rest_r = o_.rest[size_t(o_.unactuated)],
                    .rest_s = o_.rest[size_t(1 - o_.unactuated)],
                    .rr = {},
                    .rs = {},
                    .ss = {},
                    .constant = {},
                    .cosine = {},
                    .sine = {},
                    .coordinate = coordinate_names(plant_)[size_t(o_.unactuated)]};
    target_mass(d);
    target_potential(d);
    return d;
  }

 private:
  using Of = std::function<double(double)>;
  Chebyshev fit(const Of& f) const { return Chebyshev::of(w_, o_.degree, f); }
  Chebyshev quadrature(const Of& f) const { return fit(f).integral(); }

  /// ρ M_rs + M_rr, which keeps its sign: M_d_rr = λ_r F.
  double F(double x) {
    const auto M = probe_.mass(x);
    return rho_ * M.rs + M.rr;
  }
  double lambda(double x) const {
    return (F0_ > 0 ? o_.scale : -o_.scale) * std::exp(log_lambda_(x));
  }
  void column_keeps_its_sign() {
    for (int i = 0; i <= 400; ++i) {
      double there = (i % 2 ? -w_ : w_) * ((i + 1) / 2) / 200, here = 0;  // outward on both sides
      if (F(there) * F0_ > 0) continue;
      for (int k = 0; k < 40; ++k) {
        const double middle = 0.5 * (here + there);
        (F(middle) * F0_ > 0 ? here : there) = middle;
      }
      refuse(o_,
             fmt::format("with the ratio {} the column of M_d degenerates at r = {:.4g}, where "
                         "rho M_rs + M_rr is 0: take another ratio or a half_width below {:.3g}",
                         rho_, there, std::fabs(here)));
    }
  }

  /// ∂V/∂r = V0 + Vc cos s + Vs sin s, determined from three values of s and checked against a
  /// fourth.
  struct Harmonics {
    double constant, cosine, sine;
  };
  Harmonics harmonics(double x) {
    const double half_turn = std::acos(-1.0);
    const double at[] = {probe_.slope(x, 0), probe_.slope(x, half_turn / 2),
                         probe_.slope(x, half_turn)};
    const double V0 = 0.5 * (at[0] + at[2]);
    return {V0, at[0] - V0, at[1] - V0};
  }
  void potential_is_harmonic() {
    for (int i = -5; i <= 5; ++i) {
      const double x = w_ * i / 5, s = 0.7;
      const Harmonics V = harmonics(x);
      const double expected = V.constant + V.cosine * std::cos(s) + V.sine * std::sin(s);
      const double size = std::fabs(V.constant) + std::fabs(V.cosine) + std::fabs(V.sine) + 1e-300;
      if (!(std::fabs(probe_.slope(x, s) - expected) <= 1e-10 * size))
        refuse(o_, fmt::format("V of '{}' is not a0(r) + a1(r) cos s + a2(r) sin s: at r = {:.4g}, "
                               "s = {} its slope is {:.6g}, expected {:.6g}",
                               plant_.name, x, s, probe_.slope(x, s), expected));
    }
  }

  void target_mass(FourierDesign& d) {
    const auto rs = [&](double x) {
      const auto M = probe_.mass(x);
      return lambda(x) * (rho_ * M.ss + M.rs);
    };
    d.rr = fit([&](double x) { return lambda(x) * F(x); });
    d.rs = fit(rs);
    d.ss = fit([&](double x) {
      const double z = rs(x);
      return z * z / (lambda(x) * F(x)) + o_.determinant;
    });
    for (const Chebyshev* p : {&d.rr, &d.rs, &d.ss})
      if (p->tail() > 0.1 * o_.matching)
        refuse(o_, fmt::format("polynomials of degree {} do not resolve M_d: last coefficients "
                               "{:.1e} of the largest; raise the degree or narrow half_width",
                               o_.degree, p->tail()));
  }

  /// V_d = C + A cos s + B sin s with A' = -ρB + Vc/λ, B' = ρA + Vs/λ: e^{-iρr}(A + iB) is a
  /// quadrature.
  void target_potential(FourierDesign& d) {
    const auto turned = [&](double x, bool imaginary) {
      const Harmonics V = harmonics(x);
      const double c = V.cosine / lambda(x), s = V.sine / lambda(x);
      return imaginary ? s * std::cos(rho_ * x) - c * std::sin(rho_ * x)
                       : c * std::cos(rho_ * x) + s * std::sin(rho_ * x);
    };
    const Chebyshev re = quadrature([&](double x) { return turned(x, false); }),
                    im = quadrature([&](double x) { return turned(x, true); });
    d.constant = quadrature([&](double x) { return harmonics(x).constant / lambda(x); });
    d.cosine =
        fit([&](double x) { return re(x) * std::cos(rho_ * x) - im(x) * std::sin(rho_ * x); });
    d.sine = fit([&](double x) { return re(x) * std::sin(rho_ * x) + im(x) * std::cos(rho_ * x); });
  }

  const phs::Description& plant_;
  const NumericalMatching& o_;
  Probe& probe_;
  double w_ = o_.half_width, rho_ = o_.ratio, F0_;
  Chebyshev log_lambda_;
};

/// Its certificate tells the interval.
class LoopOfInterval final : public MatchedLoop {
 public:
  LoopOfInterval(PlantPtr plant, FourierDesign design, const NumericalMatching& o,
                 const MatchingOptions& options)
      : MatchedLoop(std::move(plant), energy_shaping::shaping(design), {o.actuator},
                    {o.rest[0], o.rest[1]}, options) {
    certificate_.report(
        "half_width", o.half_width,
        fmt::format("the law is made for '{}' from {:.4g} to {:.4g} and is not "
                    "defined beyond",
                    design.coordinate, design.rest_r - o.half_width, design.rest_r + o.half_width));
  }
};

/// The port that acts on r alone is not that of s.
void refuse_actuator_of_r(const phs::Model& plant, const NumericalMatching& o) {
  const auto& d = plant.description();
  const auto r = size_t(o.unactuated), s = 1 - r;
  const std::vector<double> x{o.rest[0], o.rest[1], 0, 0};
  std::vector<double> u(size_t(d.nu), 0.0), force(4);
  u[size_t(port_offsets(d, {o.actuator}).front())] = 1;
  plant.instantiate<double>()->apply_input(x, u, force);
  if (force[2 + s] != 0 || force[2 + r] == 0) return;
  const auto names = coordinate_names(d);
  refuse(o, fmt::format("actuator '{}' acts on '{}', which unactuated = {} states to have none, "
                        "expected the port of '{}', or unactuated = {}",
                        o.actuator, names[r], r, names[s], s));
}

}  // namespace

LoopPtr numerical_matching(PlantPtr plant, const NumericalMatching& o) {
  const auto& d = plant->description();
  if (d.nx != 4 || (o.unactuated != 0 && o.unactuated != 1))
    refuse(o, "the plant needs two coordinates, and the unactuated one is 0 or 1");
  if (!(o.half_width > 0) || !(o.scale > 0) || !(o.determinant > 0) || o.degree < 8)
    refuse(o, "half_width, scale, determinant > 0 and a degree >= 8 are needed");
  refuse_actuator_of_r(*plant, o);
  require_matching_rest(*plant, o, "numerical matching '" + o.name + "'");
  const auto r = size_t(o.unactuated);
  Probe probe(*plant, o);
  auto design = FourierMatching(d, o, probe).design();

  MatchingOptions options;
  options.matching = o.matching;
  options.region.lower.assign(2, -o.other);
  options.region.upper.assign(2, o.other);
  options.region.lower[r] = -o.half_width;
  options.region.upper[r] = o.half_width;
  for (size_t i = 0; i < 2; ++i) {
    options.region.lower[i] += o.rest[i];
    options.region.upper[i] += o.rest[i];
  }
  options.region.rate = o.rate;
  options.refuse = false;
  const auto loop =
      std::make_shared<LoopOfInterval>(std::move(plant), std::move(design), o, options);
  const CertificateItem* fails = loop->certificate().failure();
  if (fails && fails->name == "matching, potential energy")
    refuse(o, fmt::format("V_d of degree {} misses the matching within half_width = {:g} by "
                          "{:.2g}, expected at most {:.2g}: take a smaller half_width or a higher "
                          "degree",
                          o.degree, o.half_width, fails->value, fails->bound));
  if (fails && fails->name == "matching, kinetic energy")
    refuse(o, fmt::format("M_d of determinant {:g} misses the matching by {:.2g}, expected at most "
                          "{:.2g}: it is nearly singular, take gains of a larger bandwidth",
                          o.determinant, fails->value, fails->bound));
  refuse_failure(loop->certificate());
  return loop;
}

}  // namespace porthos::energy_shaping
