#pragma once
#include <memory>
#include <vector>

#include "phs/functions/spline.h"
#include "vsa/jet.h"

namespace porthos::vsa {

/// A natural cubic spline (C²) that accepts Jets. Linear outside its table.
class Curve {
 public:
  /// @throws InvalidArgument as phs::Spline
  Curve(const std::vector<double>& x, const std::vector<double>& y, const char* what)
      : spline_(std::make_shared<phs::Spline>(x, y, phs::Spline::Outside::linear, what)) {}

  template <class T>
  T operator()(const T& x) const {
    using B = typename Below<T>::type;
    const auto& pieces = spline_->pieces();
    std::array<const phs::Spline::Piece*, size_t(phs::lanes<B>)> p;
    for (int i = 0; i < phs::lanes<B>; ++i) p[size_t(i)] = &pieces[spline_->piece_at(lane(x, i))];
    const auto number = [&](double phs::Spline::Piece::*member) {
      return gather<T>([&](int i) { return p[size_t(i)]->*member; });
    };
    using P = phs::Spline::Piece;
    const T d = x - number(&P::x);
    return number(&P::y) + d * (number(&P::b) + d * (number(&P::c) + d * number(&P::d)));
  }

 private:
  std::shared_ptr<const phs::Spline> spline_;
};

}  // namespace porthos::vsa
