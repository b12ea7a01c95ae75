#include "phs/functions/pieces.h"

#include <cmath>

#include "phs/error.h"
#include "phs/functions/of_time.h"
#include "phs/scalars/lane.h"

namespace porthos::phs {
namespace {

/// Newton's form: c_0 + (θ - n_0) (c_1 + (θ - n_1) (c_2 + ...)), exact at the first node.
class Pieces {
 public:
  Pieces(double period, std::vector<double> nodes, std::vector<double> values)
      : period_(period), nodes_(std::move(nodes)), c_(std::move(values)) {
    const size_t s = nodes_.size();
    for (size_t at = 0; at < c_.size(); at += s)
      for (size_t order = 1; order < s; ++order)
        for (size_t i = s - 1; i >= order; --i)
          c_[at + i] = (c_[at + i] - c_[at + i - 1]) / (nodes_[i] - nodes_[i - order]);
  }
  template <class T>
  T operator()(const T& t) const {
    if constexpr (is_pack<T>) {
      return map_lanes([this](double each) { return (*this)(each); }, t);
    } else {
      const double at = std::floor(to_double(t) / period_);
      const size_t count = c_.size() / nodes_.size();
      if (!(at >= 0 && at < double(count))) return T(0.0);
      const double* c = c_.data() + size_t(at) * nodes_.size();
      const T theta = t / T(period_) - T(at);
      T value(c[nodes_.size() - 1]);
      for (size_t i = nodes_.size() - 1; i-- > 0;) value = T(c[i]) + (theta - T(nodes_[i])) * value;
      return value;
    }
  }

 private:
  double period_;
  std::vector<double> nodes_, c_;
};

}  // namespace

FunctionPtr pieces(double period, const std::vector<double>& nodes, std::vector<double> values) {
  if (!(period > 0 && std::isfinite(period)))
    throw InvalidArgument("pieces: period is " + number(period) + " s, expected more than 0");
  if (nodes.empty()) throw InvalidArgument("pieces: there are no nodes, expected one or more");
  for (size_t i = 1; i < nodes.size(); ++i)
    if (!(nodes[i] > nodes[i - 1]))
      throw InvalidArgument("pieces: nodes do not rise, expected ascending fractions");
  if (values.empty() || values.size() % nodes.size() != 0)
    throw InvalidArgument("pieces: there are " + std::to_string(values.size()) +
                          " values, expected a multiple of " + std::to_string(nodes.size()));
  for (const double v : values)
    if (!std::isfinite(v))
      throw InvalidArgument("pieces: a value is " + number(v) + ", expected a finite number");
  const auto made = std::make_shared<const Pieces>(period, nodes, std::move(values));
  return of_time_alone(function([made](const auto& t) { return (*made)(t); }));
}

}  // namespace porthos::phs
