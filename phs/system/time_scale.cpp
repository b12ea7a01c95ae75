#include "phs/system/time_scale.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace porthos::phs {
namespace {

template <class T>
class RateEvaluator : public TimeScale<T> {
  static constexpr bool has_gradient = std::is_same_v<T, double> || is_pack<T>;

 public:
  explicit RateEvaluator(const RateTimeScale& s)
      : rates_(s.rates()), per_rate2_(1 / (s.rate() * s.rate())) {
    if constexpr (has_gradient) {
      for (int lane = 0; lane < lanes<T>; ++lane)
        systems_.push_back(s.model().template instantiate<Dual>());
      x_.resize(size_t(s.model().description().nx));
      e_.resize(x_.size());
    }
    for (const auto& b : s.model().description().blocks) angles_ += b.kind == BlockKind::angle;
    turned_.resize(angles_);
  }

  T value(std::span<const T>, std::span<const T> e) override {
    T w2(0.0);
    for (const auto& r : rates_) w2 = w2 + T(r.weight) * (e[r.momentum] * e[r.momentum]);
    return T(1.0) / sqrt(T(1.0) + T(per_rate2_) * w2);
  }

  T with_gradient(std::span<const T> x, std::span<const T> e, std::span<T> g) override {
    const T sigma = value(x, e);
    if constexpr (has_gradient) {
      for (int lane = 0; lane < lanes<T>; ++lane) {
        for (size_t i = 0; i < x_.size(); ++i) x_[i] = Dual(lane_of(x[i], lane));
        for (const auto& r : rates_) x_[r.momentum].d = r.weight * lane_of(e[r.momentum], lane);
        systems_[size_t(lane)]->gradient(x_, e_);
        const double s = lane_of(sigma, lane), factor = -per_rate2_ * s * s * s;
        for (size_t i = 0; i < x_.size(); ++i) set_lane(g[i], lane, factor * e_[i].d);
      }
    } else {
      (void)g;
      throw InvalidArgument(
          "the gradient of a time scale from rates needs duals of its own: it exists in double and "
          "lanes only, give sigma and its gradient yourself for other scalars");
    }
    return sigma;
  }

  void set_turn_angles(std::span<const T> angles) override {
    for (size_t lane = 0; lane < systems_.size(); ++lane) {
      for (size_t i = 0; i < angles_; ++i)
        turned_[i] = Dual(double(to_double(lane_of(angles[i], int(lane)))));
      systems_[lane]->set_turn_angles(turned_);
    }
  }

 private:
  const std::vector<RateTimeScale::Rate>& rates_;
  double per_rate2_;
  size_t angles_ = 0;
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
}

template <class T>
std::unique_ptr<TimeScale<T>> RateTimeScale::make_scale() const {
  return std::make_unique<RateEvaluator<T>>(*this);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<TimeScale<T>> RateTimeScale::make_scale<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::phs
