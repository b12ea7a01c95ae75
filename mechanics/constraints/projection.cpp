#include "mechanics/constraints/projection.h"

#include <algorithm>
#include <cmath>

#include "mechanics/hamiltonian_field.h"
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "phs/linear_algebra/linear_algebra.h"

namespace porthos::mechanics {
namespace {

using Vec = std::vector<double>;

double largest(const Vec& x) {
  double most = 0;
  for (const double c : x) most = std::isnan(c) ? HUGE_VAL : std::max(most, std::fabs(c));
  return most;
}

/// The constraints at a moving start (q, v), in double.
class Start {
 public:
  Start(const Mechanism& m, const ConstraintSet& set)
      : m_(m),
        w_(m),
        rows_(make_constraints<double>(m, set)),
        x_(2 * size_t(m.nq())),
        force_(x_.size()),
        q_dot_(size_t(m.nq())),
        g_(size_t(set.count())) {}

  const Vec& residual(std::span<const double> q) {
    std::copy(q.begin(), q.end(), x_.begin());
    rows_->place(x_, g_);
    return g_;
  }
  /// G v for joint rates v at the q of residual(): p = M v makes e_p = q'.
  const Vec& rates(std::span<const double> v) {
    const std::span<double> e(force_);
    std::fill(force_.begin(), force_.end(), 0.0);
    coordinate_rates<double>(m_, q(), v, e.subspan(q_dot_.size()));
    rows_->rates(e, g_);
    return g_;
  }
  /// g' = G v + ∂g/∂t, likewise.
  const Vec& slip(std::span<const double> v) {
    rates(v);
    rows_->add_drift(g_);
    return g_;
  }
  int factor() {
    std::fill(x_.begin() + std::ptrdiff_t(q_dot_.size()), x_.end(), 0.0);
    return rows_->factor(x_);
  }
  /// -M⁻¹ Gᵀ D⁻¹ r, as joint rates.
  const Vec& correction(Vec r) {
    rows_->solve(r);
    rows_->forces(r, force_);
    for (size_t i = q_dot_.size(); i < x_.size(); ++i) x_[i] = -force_[i];
    rates_from_momenta<double>(m_, w_, q(), std::span<const double>(x_).subspan(q_dot_.size()));
    return w_.rate;
  }
  /// -G⁺ r in the given joint rates, zero in the others: the shortest one that makes up for r.
  Vec correction(const Vec& r, std::span<const int> free) {
    phs::Matrix G(int(r.size()), int(free.size()));
    for (int j = 0; j < G.cols; ++j) {
      Vec unit(size_t(m_.nv()), 0.0);
      unit[size_t(free[size_t(j)])] = 1;
      const Vec& column = rates(unit);
      for (int i = 0; i < G.rows; ++i) G(i, j) = column[size_t(i)];
    }
    const phs::Matrix inverse = phs::pseudo_inverse(G).inverse;
    Vec by(size_t(m_.nv()), 0.0);
    for (int j = 0; j < G.cols; ++j)
      for (int i = 0; i < G.rows; ++i) by[size_t(free[size_t(j)])] -= inverse(j, i) * r[size_t(i)];
    return by;
  }
  /// Moves q by joint displacements.
  void move(std::span<double> to, const Vec& by) {
    coordinate_rates<double>(m_, to, by, q_dot_);
    for (size_t i = 0; i < q_dot_.size(); ++i) to[i] += q_dot_[i];
    for (const auto& c : m_.coordinates()) {
      if (c.kind != phs::BlockKind::rotation) continue;
      double norm = 0;
      for (int k = 0; k < 4; ++k) norm = std::hypot(norm, to[size_t(c.q + k)]);
      for (int k = 0; k < 4; ++k) to[size_t(c.q + k)] /= norm;
    }
  }
  double smallest_pivot() const { return rows_->smallest_pivot(); }

 private:
  std::span<const double> q() const { return std::span<const double>(x_).first(q_dot_.size()); }

  const Mechanism& m_;
  Workspace<double> w_;
  std::unique_ptr<phs::Constraints<double>> rows_;
  Vec x_, force_, q_dot_, g_;
};

/// The constraint with the largest |g|.
const phs::ConstraintBlock& worst(const ConstraintSet& set, const Vec& g) {
  const phs::ConstraintBlock* found = &set.blocks().front();
  double most = -1;
  for (const auto& b : set.blocks())
    for (int r = 0; r < b.size; ++r)
      if (const double x = std::fabs(g[size_t(b.at + r)]); !(x <= most)) {
        most = x;
        found = &b;
      }
  return *found;
}

std::string ends_of(const ConstraintSpec& spec, const std::string& name) {
  const auto text = [](const LinkFrame& a, const LinkFrame& b) {
    const auto link = [](const LinkFrame& f) { return f.link.empty() ? "the world" : f.link; };
    return "between '" + link(a) + "' and '" + link(b) + "' ";
  };
  for (const auto& l : spec.loops)
    if (l.name == name) return text(l.a, l.b);
  for (const auto& r : spec.rods)
    if (r.name == name) return text(r.a, r.b);
  for (const auto& r : spec.rollings)
    if (r.name == name) return text(r.ground, r.wheel);
  return "";
}

/// Of a loop joint about or along an axis: which, as a wrong one leaves a gap. Empty of others.
std::string axes_of(const ConstraintSpec& spec, const std::string& name) {
  for (const auto& l : spec.loops) {
    const bool about_z = l.type == "revolute" || l.type == "continuous" || l.type == "prismatic" ||
                         l.type == "cylindrical" || l.type == "helical";
    if (l.name != name || !about_z) continue;
    const auto axis = [](const LinkFrame& f) {
      const Vec3d z = f.pose.R * Vec3d{0, 0, 1};
      return "(" + number(z.x, 3) + ", " + number(z.y, 3) + ", " + number(z.z, 3) + ") of " +
             (f.link.empty() ? "the world" : "'" + f.link + "'");
    };
    return ". Its axis is " + axis(l.a) + " and " + axis(l.b) +
           ", expected axes that the other joints can bring together";
  }
  return "";
}

[[noreturn]] void cannot_close(const ConstraintSet& set, const Vec& g) {
  const auto& b = worst(set, g);
  const bool undefined =
      std::any_of(g.begin(), g.end(), [](double x) { return !std::isfinite(x); });
  if (undefined && b.kind == "disk")
    throw InvalidArgument("constraint '" + b.name + "' (disk) " + ends_of(set.spec(), b.name) +
                          "lies flat: its axle, z of the wheel's frame, is normal to the ground, "
                          "expected a disk that leans or stands");
  if (undefined && b.kind == "on_curve")
    throw InvalidArgument("constraint '" + b.name + "' (on_curve) " + ends_of(set.spec(), b.name) +
                          "has its point beyond an end of the curve, expected a start nearer to "
                          "the curve, or points farther on");
  if (undefined)
    throw InvalidArgument("constraint '" + b.name + "' (" + b.kind + ") " +
                          ends_of(set.spec(), b.name) +
                          "has frames that are half a turn apart, expected a start nearer to the "
                          "closed loop");
  double gap = 0;
  for (int r = 0; r < b.size; ++r) gap = std::max(gap, std::fabs(g[size_t(b.at + r)]));
  throw InvalidArgument("constraint '" + b.name + "' (" + b.kind + ") " +
                        ends_of(set.spec(), b.name) +
                        "cannot be closed from the given start: a gap of " + number(gap, 3) +
                        " remains" + axes_of(set.spec(), b.name));
}

/// Newton until the residual is rounding, where it stops getting smaller. correct(g): joint
/// displacements that make up for g. @return the largest |g| that remains
template <class Correct>
double newton(Start& start, std::span<double> q, const Correct& correct) {
  double last = HUGE_VAL;
  Vec best(q.begin(), q.end()), g = start.residual(q);
  for (int i = 0; i < 60; ++i) {
    const double now = largest(g);
    if (now == HUGE_VAL) return now;  // half a turn apart: no row says which way
    if (now < last) best.assign(q.begin(), q.end());
    if (now == 0 || (now < 1e-13 && now >= last)) break;
    last = std::min(now, last);
    Vec by = correct(g);
    const double far = largest(by), shortened = far > 0.3 ? 0.3 / far : 1;  // [rad | m]
    for (double& x : by) x *= shortened;
    start.move(q, by);
    g = start.residual(q);
  }
  std::copy(best.begin(), best.end(), q.begin());
  return largest(start.residual(q));
}

/// Closes the loops by the joints `free` alone, if that is possible; else changes nothing.
void move_some(Start& start, std::span<const int> free, std::span<double> q) {
  Vec at(q.begin(), q.end());
  if (newton(start, at, [&](const Vec& g) { return start.correction(g, free); }) < 1e-12)
    std::copy(at.begin(), at.end(), q.begin());
  (void)start.residual(q);
}

/// The same of the rates.
void speed_up_some(Start& start, std::span<const int> free, std::span<double> v) {
  const Vec slip = start.slip(v), by = start.correction(slip, free);
  Vec rates(v.begin(), v.end());
  for (size_t i = 0; i < v.size(); ++i) rates[i] += by[i];
  if (largest(start.slip(rates)) < 1e-12 * (1 + largest(slip)))
    std::copy(rates.begin(), rates.end(), v.begin());
}

/// The entries of v that are not held; none if they are too many for dense algebra.
std::vector<int> free_rates(int nv, int rows, std::span<const int> held) {
  std::vector<int> free;
  for (int k = 0; k < nv; ++k)
    if (std::find(held.begin(), held.end(), k) == held.end()) free.push_back(k);
  if (held.empty() || double(free.size()) * rows > 1e5) free.clear();
  return free;
}

}  // namespace

ClosedStart close_loops(const Mechanism& m, const ConstraintSet& set, std::span<double> q,
                        std::span<double> v, std::span<const int> held,
                        std::span<const int> held_rates) {
  require_size("q", q.size(), size_t(m.nq()));
  require_size("v", v.size(), size_t(m.nv()));
  ClosedStart c;
  if (set.count() == 0) return c;
  Start start(m, set);
  const Vec q0(q.begin(), q.end()), v0(v.begin(), v.end()), g0 = start.residual(q);
  c.gap = largest(g0);
  if (c.gap > 0) c.largest = worst(set, g0).name;
  if (const auto free = free_rates(m.nv(), set.count(), held); !free.empty())
    move_some(start, free, q);
  const double gap = newton(start, q, [&](const Vec& g) {
    start.factor();
    return start.correction(g);
  });
  if (!(gap < 1e-10)) cannot_close(set, start.residual(q));
  c.rank = start.factor();
  c.smallest_pivot = start.smallest_pivot();

  c.slip = largest(start.slip(v0));
  if (const auto free = free_rates(m.nv(), set.count(), held_rates); !free.empty())
    speed_up_some(start, free, v);
  for (int twice = 0; twice < 2; ++twice) {
    const Vec by = start.correction(start.slip(v));
    for (size_t i = 0; i < v.size(); ++i) v[i] += by[i];
  }
  for (size_t i = 0; i < q.size(); ++i) c.moved = std::max(c.moved, std::fabs(q[i] - q0[i]));
  for (size_t i = 0; i < v.size(); ++i) c.sped_up = std::max(c.sped_up, std::fabs(v[i] - v0[i]));
  return c;
}

}  // namespace porthos::mechanics
