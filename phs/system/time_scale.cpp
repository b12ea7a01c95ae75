#include "phs/system/time_scale.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "phs/system/check.h"

namespace porthos::phs {
namespace {

/// sigma alone. Its gradient is -sigma³/rate² ∂²H·d with d = (0, W q'), which the classes below
/// compute.
template <class T>
class RateEvaluator : public TimeScale<T> {
 public:
  explicit RateEvaluator(const RateTimeScale& s)
      : rates_(s.rates()), per_rate2_(1 / (s.rate() * s.rate())) {}

  T value(std::span<const T>, std::span<const T> e) override {
    T w2(0.0);
    for (const auto& r : rates_) w2 = w2 + T(r.weight) * (e[r.momentum] * e[r.momentum]);
    return T(1.0) / sqrt(T(1.0) + T(per_rate2_) * w2);
  }
  T with_gradient(std::span<const T>, std::span<const T>, std::span<T>) override {
    throw InvalidArgument(
        "the gradient of a time scale from rates needs duals of its own: for a system that is not "
        "declared quadratic in its momenta it exists in double and lanes only; give sigma and its "
        "gradient yourself for other scalars");
  }

 protected:
  const std::vector<RateTimeScale::Rate>& rates_;
  double per_rate2_;
};

/// Where H has degree two in its momenta, the second derivative along them is a difference, exact
/// for a direction of any length l:
///
///   ∂²H(x)·d = (∂H(x + l d) - ∂H(x - l d)) / 2l
///
/// With l = |pᵀq'| / q'ᵀW q' over the coordinates that count, l d is p where there is one of them,
/// and of its size where there are several, in any units: little cancels. Two gradients in the
/// scalar itself, so lanes stay lanes.
template <class T>
class QuadraticRates final : public RateEvaluator<T> {
  using Base = RateEvaluator<T>;
  using Base::rates_, Base::per_rate2_;

 public:
  explicit QuadraticRates(const RateTimeScale& s)
      : Base(s),
        system_(s.model().template instantiate<T>()),
        y_(size_t(s.model().description().nx)),
        ahead_(y_),
        behind_(y_) {}

  T with_gradient(std::span<const T> x, std::span<const T> e, std::span<T> g) override {
    const T sigma = Base::value(x, e), l = length(x, e);
    gradient_at(x, e, l, ahead_);
    gradient_at(x, e, -l, behind_);
    const T factor = T(-0.5 * per_rate2_) * (sigma * sigma * sigma) / l;
    for (size_t i = 0; i < g.size(); ++i) g[i] = factor * (ahead_[i] - behind_[i]);
    return sigma;
  }
  void set_turn_angles(std::span<const T> angles) override { system_->set_turn_angles(angles); }

 private:
  T length(std::span<const T> x, std::span<const T> e) const {
    T power(0.0), w2(0.0);
    for (const auto& r : rates_) {
      power = power + x[r.momentum] * e[r.momentum];
      w2 = w2 + T(r.weight) * (e[r.momentum] * e[r.momentum]);
    }
    const T zero(0.0), one(1.0);
    const T l = abs(power) / select(w2 > zero, w2, one);
    return select(l > zero, l, one);
  }
  void gradient_at(std::span<const T> x, std::span<const T> e, const T& l, std::span<T> out) {
    std::copy(x.begin(), x.end(), y_.begin());
    for (const auto& r : rates_)
      y_[r.momentum] = y_[r.momentum] + l * (T(r.weight) * e[r.momentum]);
    system_->gradient(y_, out);
  }

  std::unique_ptr<System<T>> system_;
  std::vector<T> y_, ahead_, behind_;
};

/// By duals, state by state.
template <class T>
class RatesByDuals final : public RateEvaluator<T> {
  using Base = RateEvaluator<T>;
  using Base::rates_, Base::per_rate2_;

 public:
  explicit RatesByDuals(const RateTimeScale& s) : Base(s) {
    const Description& d = s.model().description();
    for (int lane = 0; lane < lanes<T>; ++lane)
      systems_.push_back(s.model().template instantiate<Dual>());
    x_.resize(size_t(d.nx));
    e_.resize(x_.size());
    turned_.resize(size_t(d.angle_count()));
  }

  T with_gradient(std::span<const T> x, std::span<const T> e, std::span<T> g) override {
    const T sigma = Base::value(x, e);
    for (int lane = 0; lane < lanes<T>; ++lane) {
      for (size_t i = 0; i < x_.size(); ++i) x_[i] = Dual(lane_of(x[i], lane));
      for (const auto& r : rates_) x_[r.momentum].d = r.weight * lane_of(e[r.momentum], lane);
      systems_[size_t(lane)]->gradient(x_, e_);
      const double s = lane_of(sigma, lane), factor = -per_rate2_ * s * s * s;
      for (size_t i = 0; i < x_.size(); ++i) set_lane(g[i], lane, factor * e_[i].d);
    }
    return sigma;
  }
  void set_turn_angles(std::span<const T> angles) override {
    for (size_t lane = 0; lane < systems_.size(); ++lane) {
      for (size_t i = 0; i < turned_.size(); ++i)
        turned_[i] = Dual(double(to_double(lane_of(angles[i], int(lane)))));
      systems_[lane]->set_turn_angles(turned_);
    }
  }

 private:
  std::vector<std::unique_ptr<System<Dual>>>
      systems_;  ///< one per lane: each may have its own turn angles
  std::vector<Dual> x_, e_, turned_;
};

}  // namespace

RateTimeScale::RateTimeScale(const Model& model, double rate, double length)
    : model_(model), rate_(rate) {
  const Description& d = model.description();
  if (!std::isfinite(rate) || rate <= 0)
    throw InvalidArgument("rate of a time scale is " + std::to_string(rate) +
                          " rad/s, expected a finite number above 0");
  if (!std::isfinite(length) || length < 0)
    throw InvalidArgument("length of a time scale is " + std::to_string(length) +
                          " m, expected a finite number, 0 or more");
  for (const auto& b : d.blocks) {
    const double weight = b.kind == BlockKind::angle      ? 1
                          : b.kind == BlockKind::rotation ? 4  // |ω|² = 4 |ξ'|² where |ξ| = 1
                          : length > 0                    ? 1 / (length * length)
                                                          : 0;
    for (int k = 0; k < b.size && b.momentum >= 0 && weight > 0; ++k)
      rates_.push_back({size_t(b.momentum + k), weight});
  }
  if (rates_.empty())
    throw InvalidArgument("'" + d.name +
                          "' has no angle and no rotation: a time scale from rates needs a length "
                          "[m] for its linear coordinates");
  if (const auto why = falsely_quadratic(model)) throw InvalidArgument(*why);
}

template <class T>
std::unique_ptr<TimeScale<T>> RateTimeScale::make_scale() const {
  if (model_.description().traits.quadratic) return std::make_unique<QuadraticRates<T>>(*this);
  if constexpr (std::is_same_v<T, double> || is_pack<T>)
    return std::make_unique<RatesByDuals<T>>(*this);
  else
    return std::make_unique<RateEvaluator<T>>(*this);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<TimeScale<T>> RateTimeScale::make_scale<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::phs
