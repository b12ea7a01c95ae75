#include "energy_shaping/matching/design_on_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <random>

#include "energy_shaping/loop/closed_loop.h"
#include "mechanics/aba.h"
#include "mechanics/rnea.h"
#include "phs/linear_algebra/dense.h"
#include "phs/scalars/derivative.h"

namespace porthos::energy_shaping {
namespace {

using DesignData = std::shared_ptr<const DesignOnModel::Data>;

/// A mechanism of two joints seen as the plant of a design.
template <class T>
class DesignView {
 public:
  explicit DesignView(const DesignData& data)
      : data_(data),
        m_(data->model->mechanism()),
        w_(m_),
        plant_(data->loop->plant().instantiate<T>()),
        loop_(data->loop->template loop<T>()),
        inputs_(size_t(data->loop->plant().description().nu)) {}

  /// The state of the design's plant at that of the mechanism, (q, p).
  std::span<const T> state(std::span<const T> x) {
    mechanics::rates_from_momenta<T>(m_, w_, x.first(2), x.subspan(2, 2));
    const auto& A = data_->map.A;
    std::array<T, 2> v{};
    for (size_t i = 0; i < 2; ++i) {
      x_[i] = v[i] = T(0.0);
      for (size_t j = 0; j < 2; ++j) {
        x_[i] = x_[i] + T(A[i][j]) * (x[j] - T(data_->rest[j]));
        v[i] = v[i] + T(A[i][j]) * w_.rate[j];
      }
    }
    std::array<T, 4> inverse{}, L{}, e{};  // M⁻¹ of the design's plant, by columns
    for (size_t j = 0; j < 2; ++j) {
      x_[2] = T(j == 0 ? 1.0 : 0.0);
      x_[3] = T(j == 1 ? 1.0 : 0.0);
      plant_->gradient(x_, e);
      inverse[j] = e[2];
      inverse[2 + j] = e[3];
    }
    phs::dense::cholesky(2, inverse.data(), L.data());
    phs::dense::solve(2, L.data(), v.data(), x_.data() + 2);
    return x_;
  }
  /// The force of the driven joint at the mechanism's state x.
  T force(T t, std::span<const T> x) {
    state(x);
    loop_->law(t, x_, inputs_);
    if (!data_->map.accelerated) return T(data_->map.scale) * inputs_[0];
    // M = I in the design: q'' = p'. In the mechanism's coordinates A⁻¹ q'', A diagonal.
    std::array<T, 4> rate{};
    plant_->field(t, x_, inputs_, rate);
    const auto& A = data_->map.A;
    const bool crossed = A[0][0] == 0;  // the pole is the mechanism's second joint
    std::array<T, 2> acceleration{}, tau{};
    for (size_t i = 0; i < 2; ++i) {
      const size_t j = crossed ? 1 - i : i;
      acceleration[j] = rate[2 + i] / T(A[i][j]);
    }
    const std::array<T, 2> v{w_.rate[0], w_.rate[1]};
    mechanics::rnea<T>(m_, w_, x.first(2), v, acceleration, {}, tau);
    return tau[data_->driven];
  }

 private:
  DesignData data_;
  const mechanics::Mechanism& m_;
  mechanics::Workspace<T> w_;
  std::unique_ptr<phs::System<T>> plant_;
  std::unique_ptr<LoopSystem<T>> loop_;
  std::array<T, 4> x_{};
  std::vector<T> inputs_;
};

struct DesignLaw {
  DesignData data;

  template <class T>
  auto evaluator() const {
    return
        [d = data, view = DesignView<T>(data)](T t, std::span<const T> x, std::span<T> u) mutable {
          for (T& all : u) all = T(0.0);
          T value = view.force(t, x);
          using phs::select;
          value = select(phs::abs(value) < T(HUGE_VAL), value, T(0.0));  // M_d > 0 fails: NaN
          if (d->limit < HUGE_VAL) value = phs::max(phs::min(value, T(d->limit)), T(-d->limit));
          u[d->driven] = value;
        };
  }
};

}  // namespace

DesignOnModel::DesignOnModel(std::shared_ptr<const mechanics::MechanicalModel> model, LoopPtr loop,
                             const DesignMap& map, const DesignJoints& joints)
    : certificate_(loop->certificate()) {
  const auto driven = size_t(port_offsets(model->description(), {joints.driven})[0]);
  data_ = std::make_shared<const Data>(
      Data{std::move(model), std::move(loop), map, driven, joints.rest, joints.limit});
  for (const auto& [name, value, meaning] : map.numbers) certificate_.report(name, value, meaning);
  check_motion();
  refuse_failure(certificate_);
}

/// q_d'' of the mechanism under the law, without its limit, against that of the design's plant, at
/// random states of the design's region.
void DesignOnModel::check_motion() {
  const auto& d = *data_;
  auto unlimited = std::make_shared<Data>(d);
  unlimited->limit = HUGE_VAL;
  auto law = DesignLaw{unlimited}.evaluator<double>();
  DesignView<double> view(data_);
  const auto field = d.model->instantiate<double>();
  const auto dual = d.model->instantiate<phs::Dual>(),
             dual_plant = d.loop->plant().instantiate<phs::Dual>();
  const auto plant = d.loop->plant().instantiate<double>();
  const auto loop = d.loop->loop<double>();
  const auto& region = d.loop->options().region;
  const auto& A = d.map.A;
  const double det = A[0][0] * A[1][1] - A[0][1] * A[1][0];
  std::vector<double> x(4), dx(4), y1(4), u(size_t(d.model->description().nu)),
      ud(size_t(d.loop->plant().description().nu));
  std::vector<phs::Dual> s(4), e(4);
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  // the accelerations along a field: the derivative of M⁻¹p
  const auto accelerations = [&](auto& system, std::span<const double> at,
                                 std::span<const double> along) {
    for (size_t k = 0; k < 4; ++k) s[k] = phs::Dual(at[k], along[k]);
    system.gradient(s, e);
    return std::array{e[2].d, e[3].d};
  };
  double worst = 0, scale = 1e-300;
  std::vector<double> where;
  for (int i = 0; i < 300; ++i) {
    std::array<double, 2> q{}, v{};
    for (size_t k = 0; k < 2; ++k)
      q[k] = region.lower[k] + (region.upper[k] - region.lower[k]) * uniform(generator);
    for (double& rate : v) rate = region.rate * (2 * uniform(generator) - 1);
    const auto back = [&](const std::array<double, 2>& b) {  // A⁻¹ b
      return std::array{(A[1][1] * b[0] - A[0][1] * b[1]) / det,
                        (A[0][0] * b[1] - A[1][0] * b[0]) / det};
    };
    auto q_m = back(q);
    for (size_t k = 0; k < 2; ++k) q_m[k] += d.rest[k];
    x = d.model->state(q_m, back(v));
    law(0.0, std::span<const double>(x), std::span<double>(u));
    field->field(0.0, x, u, dx);
    const auto a = accelerations(*dual, x, dx);
    const auto y = view.state(x);
    loop->law(0.0, y, ud);
    plant->field(0.0, y, ud, y1);
    const auto wanted = accelerations(*dual_plant, y, y1);
    for (size_t k = 0; k < 2; ++k) {
      const double is = A[k][0] * a[0] + A[k][1] * a[1];
      scale = std::max(scale, std::fabs(wanted[k]));
      if (!(std::fabs(is - wanted[k]) <= worst)) {
        worst = std::fabs(is - wanted[k]);
        where = {q_m[0], q_m[1]};
      }
    }
  }
  std::string unknown;  // what a design has no place for
  for (const auto& j : d.model->mechanism().joint_properties())
    for (const auto& [what, value] : {std::pair{"damping", j.damping}, {"stiffness", j.stiffness}})
      if (value != 0)
        unknown += fmt::format("; joint '{}' has a {} of {:g}, expected 0: the design knows none",
                               j.joint, what, value);
  certificate_.at_most(
      "moves as the design's plant", worst / scale, 1e-9,
      "accelerations of the model under the law, over the largest, at 300 states" + unknown, where);
  if (!unknown.empty())
    certificate_.help("design on the model without it and add it as an [[element]]");
}

PortLaw DesignOnModel::port_law() const {
  PortLaw law = port_laws(DesignLaw{data_}, data_->model->description(), {int(data_->driven)})[0];
  law.limit = data_->limit;
  law.hindrance = [d = data_](std::span<const double> x) {
    return std::isfinite(DesignView<double>(d).force(0, x)) ? nullptr
                                                            : "is not defined (M_d > 0 fails)";
  };
  return law;
}

}  // namespace porthos::energy_shaping
