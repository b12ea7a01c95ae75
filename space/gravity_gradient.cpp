#include "space/gravity_gradient.h"

#include <cmath>

namespace porthos::space {

using namespace mechanics;

namespace {

template <class T>
T trace(const Sym3<T>& I) {
  return I.xx + I.yy + I.zz;
}

}  // namespace

template <class T>
void GravityGradient<T>::evaluate(double mu, std::span<const T> q, const Vec3<T>& R) {
  on_.place(q);
  const T inverse = T(1.0) / norm(R);
  const T k = T(mu) * inverse * inverse * inverse;
  const Vec3<T> u = on_.base().tmul(inverse * R);  // in the base's axes
  T trace_I(0.0);
  Vec3<T> I_u{T(0.0), T(0.0), T(0.0)};
  const auto& links = on_.links();
  for (size_t i = 0; i < links.size(); ++i) {
    const auto& link = links[i];
    const Mat3<T>& A = on_.axes(i);
    const Vec3<T> u_i = A.tmul(u), c(link.c);
    const Sym3<T> I(link.I);
    const Vec3<T> I_ui = I * u_i;
    trace_I = trace_I + trace(I);
    Vec3<T> f{T(0.0), T(0.0), T(0.0)};
    I_u += A * I_ui;
    if (link.m > 0) {
      const T m(link.m);
      const Vec3<T> r = on_.centre(i);
      const T s = dot(r, u_i), r2 = dot(r, r);
      trace_I = trace_I + T(2.0) * m * r2;
      I_u += A * (m * (r2 * u_i - s * r));
      f = (m * k) * (T(3.0) * s * u_i - r);
    }
    on_.wrench(i) = {(T(3.0) * k) * cross(u_i, I_ui) + cross(c, f), f};
  }
  on_.project();
  const T uIu = dot(u, I_u);
  energy_ = T(-0.5) * k * (trace_I - T(3.0) * uIu);
  const T scale = T(-1.5) * k * inverse;
  reaction_ = on_.base() * (scale * ((trace_I - T(5.0) * uIu) * u + T(2.0) * I_u));
}

template <class T>
T GravityGradient<T>::reach() const {
  T most(0.0);
  for (size_t i = 0; i < on_.links().size(); ++i) {
    const auto& link = on_.links()[i];
    if (link.m > 0)
      most = phs::max(most, norm(on_.centre(i)) + T(std::sqrt(0.5 * trace(link.I) / link.m)));
  }
  return most;
}

template <class T>
T GravityGradient<T>::next_order(double mu, std::span<const T> q, const Vec3<T>& R) {
  on_.place(q);
  const T d2 = dot(R, R), d = norm(R);
  const Vec3<T> u = on_.base().tmul(R);
  T sum(0.0);
  const auto& links = on_.links();
  for (size_t i = 0; i < links.size(); ++i) {
    const auto& link = links[i];
    const Vec3<T> n = (T(1.0) / d) * on_.axes(i).tmul(u), r = on_.centre(i);
    const Sym3<T> I(link.I);
    const T half = T(0.5) * trace(I), s = dot(r, n), m(link.m);  // J = half 1 - I: second moments
    const T nJn = half - dot(n, I * n), nJr = half * s - dot(n, I * r);
    sum = sum + T(5.0) * (m * s * s * s + T(3.0) * s * nJn) -
          T(3.0) * (m * s * dot(r, r) + s * half + T(2.0) * nJr);
  }
  return T(0.5 * mu) / (d2 * d2) * sum;  // of 1/|R + r|: its odd orders are negative
}

#define PORTHOS_INSTANTIATE(T) template class GravityGradient<T>;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::space
