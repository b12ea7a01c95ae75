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
  explicit ByDuals(const Model& model)
      : system_(model.instantiate<Dual>()),
        n_(size_t(model.description().nx)),
        jacobian_(n_ * n_),
        x_(n_),
        f_(n_),
        angles_(size_t(model.description().angle_count())),
        turns_(angles_.size(), T(0.0)) {}

  void at(const T& t, In x, Out dx) override {
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
    std::fill(out.begin(), out.end(), T(0.0));
    for (size_t i = 0; i < n_; ++i)
      for (size_t j = 0; j < n_; ++j) out[j] = fma(jacobian_[i * n_ + j], lambda[i], out[j]);
  }
  void set_turn_angles(In angles) override {
    std::copy(angles.begin(), angles.end(), turns_.begin());
  }

 private:
  std::unique_ptr<System<Dual>> system_;
  size_t n_;
  std::vector<T> jacobian_;  ///< row-major
  std::vector<Dual> x_, f_, angles_;
  std::vector<T> turns_;
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
  return std::make_unique<ByDuals<T>>(model);
}

template <class T>
std::unique_ptr<Linearised<T>> linearise(const Model& model) {
  require_smooth(model);
  const auto system = model.instantiate<T>();
  if (auto* own = dynamic_cast<Differentiable<T>*>(system.get()))
    if (auto made = own->linearised()) return made;
  return std::make_unique<ByDuals<T>>(model);
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

#define PORTHOS_INSTANTIATE(T)                                        \
  template std::unique_ptr<Linearised<T>> linearise<T>(const Model&); \
  template std::unique_ptr<Linearised<T>> linearise_by_duals<T>(const Model&);
PORTHOS_INSTANTIATE(double)
PORTHOS_INSTANTIATE(Pack4)
PORTHOS_INSTANTIATE(Pack8)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::phs
