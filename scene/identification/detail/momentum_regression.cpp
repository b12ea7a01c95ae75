#include "scene/identification/detail/momentum_regression.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "scene/identification/detail/least_squares.h"
#include "scene/identification/detail/logged_motion.h"

namespace porthos::scene {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;
using mechanics::MassProperties;

constexpr size_t of_each = std::size(inertial_numbers);
/// Mass, first moment and inertia about the origin of the body: momenta are linear in them.
using Ten = std::array<double, of_each>;

/// About another point than the centre of mass, c away, of a point mass there.
std::array<double, 6> of_point(double mass, const mechanics::Vec3d& c) {
  return {mass * (c.y * c.y + c.z * c.z), -mass * c.x * c.y, -mass * c.x * c.z,
          mass * (c.x * c.x + c.z * c.z), -mass * c.y * c.z, mass * (c.x * c.x + c.y * c.y)};
}
Ten ten_of(const MassProperties& b) {
  const auto& I = b.inertia;
  const auto add = of_point(b.mass, b.com);
  return {b.mass,        b.mass * b.com.x, b.mass * b.com.y, b.mass * b.com.z, I.xx + add[0],
          I.xy + add[1], I.xz + add[2],    I.yy + add[3],    I.yz + add[4],    I.zz + add[5]};
}
MassProperties body_of(const Ten& n) {
  MassProperties b;
  b.mass = n[0];
  b.com = {n[1] / n[0], n[2] / n[0], n[3] / n[0]};
  const auto add = of_point(b.mass, b.com);
  b.inertia = {n[4] - add[0], n[5] - add[1], n[6] - add[2],
               n[7] - add[3], n[8] - add[4], n[9] - add[5]};
  return b;
}
/// A change of number k.
double part_of(const MassProperties& b, size_t k) {
  constexpr double part = 0x1p-8;
  const double inertia = (b.inertia.xx + b.inertia.yy + b.inertia.zz) / 3;
  return part * (k == 0 ? b.mass : k < 4 ? std::sqrt(inertia * b.mass) : inertia);
}

/// p - ∫ p' dt less its mean, in the standard deviations that the noise of the rates gives p.
class Balance {
 public:
  Balance(const Assembly& a, const Log& log, const LoggedMotion& motion)
      : times_(log.times), motion_(motion), n_(size_t(a.mechanism->nq())), per_noise_(n_, 0.0) {
    for (size_t i = 0; i + 1 < times_.size(); ++i) intervals_.push_back(integration(times_, i));
    weigh(*a.mechanical);
  }

  VectorXd of(const Assembly& a) const {
    const auto system = a.model->instantiate<double>();
    MatrixXd p(Index(n_), Index(times_.size())), slope = p;
    std::vector<double> f(2 * n_);
    for (size_t i = 0; i < times_.size(); ++i) {
      const auto x = a.mechanical->state(motion_.q[i], motion_.v[i]);
      system->field(times_[i], x, {}, f);
      p.col(Index(i)) = Eigen::Map<const VectorXd>(x.data() + n_, Index(n_));
      slope.col(Index(i)) = Eigen::Map<const VectorXd>(f.data() + n_, Index(n_));
    }
    VectorXd sum = VectorXd::Zero(Index(n_));
    for (size_t i = 0; i < intervals_.size(); ++i) {
      const Neighbours& at = intervals_[i];
      for (size_t k = 0; k < at.count; ++k) sum += at.weight[k] * slope.col(Index(at.first + k));
      p.col(Index(i + 1)) -= sum;
    }
    p.colwise() -= VectorXd(p.rowwise().mean());
    const Index every = 1 + (p.cols() - 1) / most, count = 1 + (p.cols() - 1) / every;
    VectorXd kept(Index(n_) * count);
    for (Index i = 0; i < count; ++i)
      kept.segment(i * Index(n_), Index(n_)) =
          Eigen::Map<const VectorXd>(per_noise_.data(), Index(n_)).cwiseProduct(p.col(i * every));
    return kept;
  }

 private:
  static constexpr Index most = 4000;  ///< times whose balance counts, of a long log
  /// δp = M δv, at the first, middle and last of the times.
  void weigh(const mechanics::MechanicalModel& model) {
    std::vector<double> v(motion_.sigma.size(), 0.0);
    for (const size_t row : {size_t(0), times_.size() / 2, times_.size() - 1})
      for (size_t k = 0; k < v.size(); ++k) {
        v[k] = motion_.sigma[k];
        const auto x = model.state(motion_.q[row], v);
        v[k] = 0;
        for (size_t j = 0; j < n_; ++j) per_noise_[j] += x[n_ + j] * x[n_ + j] / 3;
      }
    for (double& w : per_noise_) w = w > 0 ? 1 / std::sqrt(w) : 0;
  }

  const std::vector<double>& times_;
  const LoggedMotion& motion_;
  size_t n_;
  std::vector<double> per_noise_;
  std::vector<Neighbours> intervals_;
};

/// The balance of the scene's bodies with other numbers, b + A (n(z) - n(start)).
class Regression {
 public:
  Regression(const Scene& scene, const Assembly& a, const Unknowns& unknowns,
             const Balance& balance)
      : unknowns_(unknowns), start_(numbers(unknowns.start())), b_(balance.of(a)) {
    Scene base = scene;
    base.urdf.accept_unphysical_inertia = true;  // of what is a difference alone
    A_.resize(b_.size(), start_.size());
    for (size_t body = 0; body < unknowns.bodies(); ++body) {
      const auto mass = unknowns.mass(body, unknowns.start());
      for (size_t k = 0; k < of_each; ++k) {
        Ten changed = ten_of(mass);
        const double by = part_of(mass, k);
        changed[k] += by;
        const Assembly other = assemble(unknowns.with_mass(base, body, body_of(changed)));
        A_.col(Index(body * of_each + k)) = (balance.of(other) - b_) / by;
      }
    }
  }
  bool at(const std::vector<double>& z, VectorXd& r, MatrixXd* slopes) const {
    constexpr double apart = 6e-6;
    r = b_ + A_ * (numbers(z) - start_);
    if (!slopes) return r.allFinite();
    slopes->resize(r.size(), Index(z.size()));
    for (size_t k = 0; k < z.size(); ++k) {
      auto up = z, down = z;
      up[k] += apart;
      down[k] -= apart;
      slopes->col(Index(k)) = A_ * ((numbers(up) - numbers(down)) / (2 * apart));
    }
    return r.allFinite() && slopes->allFinite();
  }

 private:
  VectorXd numbers(std::span<const double> z) const {
    VectorXd all(Index(of_each * unknowns_.bodies()));
    for (size_t body = 0; body < unknowns_.bodies(); ++body) {
      const Ten own = ten_of(unknowns_.mass(body, z));
      std::ranges::copy(own, all.data() + body * of_each);
    }
    return all;
  }

  const Unknowns& unknowns_;
  VectorXd start_, b_;
  MatrixXd A_;
};

}  // namespace

std::vector<double> bodies_by_momenta(const Scene& scene, const Assembly& a,
                                      const Unknowns& unknowns, const Log& log) {
  constexpr int most = 200;
  const bool start_known =
      std::ranges::none_of(unknowns.list(), [](const Unknown& u) { return u.of_start; });
  if (unknowns.bodies() == 0 || a.model->description().nx != 2 * a.mechanism->nq()) return {};
  const auto motion = motion_of(a, log, start_known);
  if (!motion) return {};
  try {
    const Regression regression(scene, a, unknowns, Balance(a, log, *motion));
    const Fit fit = least_squares(
        [&](const auto& z, auto& r, auto* slopes) { return regression.at(z, r, slopes); },
        unknowns.start(),
        {.noise_known = false, .most = most, .go_on = [](const Fit&) { return true; }});
    return fit.iterates.empty() ? std::vector<double>() : fit.z;
  } catch (const InvalidArgument&) {  // a body of the differences cannot be
    return {};
  }
}

}  // namespace porthos::scene
