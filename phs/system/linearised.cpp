#include "phs/system/linearised.h"

#include <algorithm>

#include "phs/scalars/derivative.h"

namespace porthos::phs {
namespace {

/// The whole Jacobian, one evaluation in duals per column and lane.
template <class T>
class ByDuals final : public Linearised<T> {
  using typename Linearised<T>::In;
  using typename Linearised<T>::Out;

 public:
  ByDuals(const Model& model, std::vector<HeldPtr> held)
      : system_(model.instantiate<Dual>()),
        n_(size_t(model.description().nx)),
        jacobian_(n_ * n_),
        x_(n_),
        f_(n_),
        angles_(size_t(model.description().angle_count())),
        turns_(angles_.size(), T(0.0)),
        of_run_(std::move(held)) {
    std::vector<HeldPtr> own;
    for (const auto& hold : model.holds()) {
      memories_.push_back(std::make_shared<std::vector<double>>(hold->fresh));
      own.push_back(memories_.back());
      for (size_t k = 0; k < hold->values; ++k) {
        values_.push_back({memories_.size() - 1, k});
        names_.push_back(hold->name + ".held[" + std::to_string(k) + "]");
      }
    }
    if (!own.empty()) system_->use_held(own);
    by_held_.resize(n_ * values_.size());
    lambda_.resize(n_);
  }

  void at(const T& t, In x, Out dx) override {
    for (size_t i = 0; i < memories_.size(); ++i) *memories_[i] = *of_run_[i];
    for (int lane = 0; lane < lanes<T>; ++lane) {
      for (size_t k = 0; k < angles_.size(); ++k) angles_[k] = Dual(lane_of(turns_[k], lane));
      system_->set_turn_angles(angles_);
      for (size_t k = 0; k < n_; ++k) x_[k] = Dual(lane_of(x[k], lane));
      along_each(x_, [&](size_t j) {
        system_->field(Dual(lane_of(t, lane)), x_, {}, f_);
        for (size_t i = 0; i < n_; ++i) {
          set_lane(jacobian_[i * n_ + j], lane, f_[i].d);
          set_lane(dx[i], lane, f_[i].v);
        }
      });
      differentiate_by_held(t, lane, dx);
    }
  }
  void times(In v, Out out) override {
    for (size_t i = 0; i < n_; ++i) {
      T sum(0.0);
      for (size_t j = 0; j < n_; ++j) sum = fma(jacobian_[i * n_ + j], v[j], sum);
      out[i] = sum;
    }
  }
  void transpose_times(In lambda, Out out) override {
    std::copy(lambda.begin(), lambda.end(), lambda_.begin());
    std::fill(out.begin(), out.end(), T(0.0));
    for (size_t i = 0; i < n_; ++i)
      for (size_t j = 0; j < n_; ++j) out[j] = fma(jacobian_[i * n_ + j], lambda[i], out[j]);
  }
  void set_turn_angles(In angles) override {
    std::copy(angles.begin(), angles.end(), turns_.begin());
  }

  const std::vector<std::string>& parameters() const override { return names_; }
  size_t held() const override { return values_.size(); }
  void add_gradient(const T& weight, Out gradient) override {
    for (size_t k = 0; k < values_.size(); ++k)
      for (size_t i = 0; i < n_; ++i)
        gradient[k] = fma(weight * lambda_[i], by_held_[i * values_.size() + k], gradient[k]);
  }
  void add_held(std::span<const double> change, Out out) override {
    for (size_t i = 0; i < n_; ++i)
      for (size_t k = 0; k < values_.size(); ++k)
        out[i] = fma(by_held_[i * values_.size() + k], T(change[k]), out[i]);
  }

 private:
  /// A held value of a controller: its memory, and its place there.
  struct Value {
    size_t memory, at;
  };
  /// Inputs enter the field in proportion, so a large change has their slope to rounding.
  void differentiate_by_held(const T& t, int lane, In dx) {
    constexpr double by = 0x1p40;
    for (size_t k = 0; k < values_.size(); ++k) {
      double& w = (*memories_[values_[k].memory])[values_[k].at];
      const double own = w;
      w = own + by;
      system_->field(Dual(lane_of(t, lane)), x_, {}, f_);
      for (size_t i = 0; i < n_; ++i)
        set_lane(by_held_[i * values_.size() + k], lane,
                 (f_[i].v - lane_of(dx[i], lane)) / (w - own));
      w = own;
    }
  }

  std::unique_ptr<System<Dual>> system_;
  size_t n_;
  std::vector<T> jacobian_;  ///< row-major
  std::vector<Dual> x_, f_, angles_;
  std::vector<T> turns_;
  std::vector<HeldPtr> of_run_;
  std::vector<std::shared_ptr<std::vector<double>>> memories_;
  std::vector<Value> values_;
  std::vector<T> by_held_, lambda_;  ///< by_held_: row-major
  std::vector<std::string> names_;
};

void require_smooth(const Model& model) {
  refuse_constraints(model.description(), "a derivative");
  if (!model.holds().empty())
    throw InvalidArgument("a derivative takes no sampled controllers, and '" +
                          model.description().name + "' has '" + model.holds().front()->name +
                          "', expected a continuous one");
}

}  // namespace

template <class T>
std::unique_ptr<Linearised<T>> linearise_by_duals(const Model& model) {
  require_smooth(model);
  return std::make_unique<ByDuals<T>>(model, std::vector<HeldPtr>());
}

template <class T>
std::unique_ptr<Linearised<T>> linearise(const Model& model) {
  require_smooth(model);
  return linearise<T>(model, {});
}

template <class T>
std::unique_ptr<Linearised<T>> linearise(const Model& model, std::vector<HeldPtr> held) {
  refuse_constraints(model.description(), "a derivative");
  require_size("memories of sampled controllers", held.size(), model.holds().size());
  const auto system = model.instantiate<T>();
  if (auto* own = dynamic_cast<Differentiable<T>*>(system.get()))
    if (auto made = own->linearised()) return made;
  return std::make_unique<ByDuals<T>>(model, std::move(held));
}

std::unique_ptr<Linearised<WideDual>> linearise_in_duals(const Model& model) {
  using T = decltype(WideDual::v);
  require_smooth(model);
  const auto system = model.instantiate<T>();
  if (auto* own = dynamic_cast<Differentiable<T>*>(system.get()))
    if (auto made = own->linearised_in_duals()) return made;
  throw InvalidArgument("'" + model.description().name +
                        "' has no second derivatives, expected a mechanism, or one with springs, "
                        "dampers and torques at joints");
}

#define PORTHOS_INSTANTIATE(T)                                                              \
  template std::unique_ptr<Linearised<T>> linearise<T>(const Model&);                       \
  template std::unique_ptr<Linearised<T>> linearise<T>(const Model&, std::vector<HeldPtr>); \
  template std::unique_ptr<Linearised<T>> linearise_by_duals<T>(const Model&);
PORTHOS_INSTANTIATE(double)
PORTHOS_INSTANTIATE(Pack4)
PORTHOS_INSTANTIATE(Pack8)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::phs
