#include "contact/impact.h"

#include <algorithm>
#include <limits>

namespace porthos::contact {
namespace {

template <class T>
T size_of_rate(const T& x) {
  return x < T(0.0) ? -x : x;
}
/// Some hundred roundings, relative.
template <class T>
T rounding() {
  return std::is_same_v<T, double> ? T(1e-13) : T(1e-30);
}
/// More reflections than a sequence of impacts that ends has.
constexpr int most_reflections = 500, most_repetitions = 100;

}  // namespace

const char* to_string(Simultaneous rule) {
  return rule == Simultaneous::moreau ? "moreau" : "reflections";
}

template <class T>
RigidImpact<T>::RigidImpact(size_t most)
    : least_(0.0),
      iota_(most, T(0.0)),
      loss_(iota_),
      before_(iota_),
      elastic_(iota_),
      plastic_(iota_),
      sum_(iota_),
      lambda_(iota_),
      candidate_(iota_),
      factor_(most * most, T(0.0)),
      among_(most) {
  free_.reserve(most);
}

/// v += W λ.
template <class T>
void RigidImpact<T>::push(std::span<const T> W, std::span<const T> lambda, std::span<T> v) const {
  for (size_t i = 0; i < m_; ++i)
    for (size_t j = 0; j < m_; ++j)
      if (lambda[j] != T(0.0)) v[i] = v[i] + W[i * m_ + j] * lambda[j];
}

/// Those that approach, but for what is rounding of a double beside the fastest: a contact at rest
/// would change the order of the reflections.
template <class T>
bool RigidImpact<T>::approaches(std::span<const T> v) {
  T fastest(0.0);
  for (const T& each : v) fastest = std::max(fastest, T(-each));
  if (!(fastest > least_)) return false;
  for (size_t i = 0; i < m_; ++i) among_[i] = -v[i] > T(1e-12) * fastest;
  return true;
}

/// Those in free_ at rest: W λ = -v in their rows, by Cholesky's factors, into candidate_. False
/// if a row depends on those before it.
template <class T>
bool RigidImpact<T>::solve_free(std::span<const T> W, std::span<const T> v) {
  using phs::sqrt;
  const size_t n = free_.size();
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j <= i; ++j) {
      T sum = W[free_[i] * m_ + free_[j]];
      for (size_t k = 0; k < j; ++k) sum = sum - factor_[i * n + k] * factor_[j * n + k];
      if (i == j && !(sum > rounding<T>() * W[free_[i] * (m_ + 1)])) return false;
      factor_[i * n + j] = i == j ? T(sqrt(sum)) : T(sum / factor_[j * n + j]);
    }
    T y = -v[free_[i]];
    for (size_t k = 0; k < i; ++k) y = y - factor_[i * n + k] * candidate_[k];
    candidate_[i] = y / factor_[i * n + i];
  }
  for (size_t i = n; i-- > 0;) {
    T y = candidate_[i];
    for (size_t k = i + 1; k < n; ++k) y = y - factor_[k * n + i] * candidate_[k];
    candidate_[i] = y / factor_[i * n + i];
  }
  return true;
}

/// The active set of Lawson and Hanson (1974). A contact whose gradient depends on those that push
/// never joins them: its rate is then 0, since the rates of all gaps belong to one motion.
template <class T>
void RigidImpact<T>::plastic(std::span<const T> W, std::span<const T> v, std::span<T> lambda) {
  ++solved_;
  free_.clear();
  std::fill(lambda.begin(), lambda.end(), T(0.0));
  std::copy(v.begin(), v.end(), sum_.begin());
  const auto is_free = [&](size_t i) {
    return std::find(free_.begin(), free_.end(), i) != free_.end();
  };
  for (size_t round = 0; round < 20 * m_ + 20; ++round) {
    size_t worst = m_;
    for (size_t i = 0; i < m_; ++i)
      if (among_[i] && !is_free(i) && sum_[i] < -least_ && (worst == m_ || sum_[i] < sum_[worst]))
        worst = i;
    if (worst == m_) return;
    free_.push_back(worst);
    for (;;) {
      if (!solve_free(W, v)) {
        free_.pop_back();
        among_[worst] = 0;
        break;
      }
      T part(1.0);  // of the way to the candidate on which no impulse turns negative
      size_t first = m_;
      for (size_t k = 0; k < free_.size(); ++k) {
        if (candidate_[k] > T(0.0)) continue;
        const T& now = lambda[free_[k]];
        if (const T ends = now / (now - candidate_[k]); first == m_ || ends < part) {
          part = ends;
          first = free_[k];
        }
      }
      for (size_t k = 0; k < free_.size(); ++k) {
        T& now = lambda[free_[k]];
        now = first == m_ ? candidate_[k] : T(now + part * (candidate_[k] - now));
      }
      if (first == m_) break;
      lambda[first] = T(0.0);
      std::erase(free_, first);
    }
    std::copy(v.begin(), v.end(), sum_.begin());
    push(W, lambda, sum_);
    for (const size_t i : free_) sum_[i] = T(0.0);
  }
}

/// Reflections until nothing approaches; elastic_ collects their impulses.
template <class T>
void RigidImpact<T>::reflect(std::span<const T> W, std::span<T> v) {
  std::fill(elastic_.begin(), elastic_.end(), T(0.0));
  const auto lambda = std::span(lambda_).first(m_);
  for (int k = 0; k <= most_reflections && approaches(v); ++k) {
    // Where reflections do not end (no motion leaves all contacts), the rest is a plastic impact.
    const bool ends = k < most_reflections;
    if (!ends) std::fill(among_.begin(), among_.end(), 1);
    plastic(W, v, lambda);
    for (T& l : lambda) l = ends ? T(l + l) : l;
    push(W, lambda, v);
    for (size_t i = 0; i < m_; ++i) elastic_[i] = elastic_[i] + lambda[i];
  }
}

/// One impact by the rule; plastic without e.
template <class T>
void RigidImpact<T>::once(std::span<const T> W, std::span<T> v, std::span<const double> e,
                          Simultaneous rule) {
  const auto before = std::span(before_).first(m_);
  const auto plastics = std::span(plastic_).first(m_);
  std::copy(v.begin(), v.end(), before.begin());
  std::fill(among_.begin(), among_.end(), 1);
  plastic(W, v, plastics);
  double least = e.empty() ? 0 : 1;
  const auto count = [&](std::span<const T> pushing) {
    for (size_t i = 0; i < m_; ++i)
      if (pushing[i] > T(0.0) && least > 0) least = std::min(least, e[i]);
  };
  count(plastics);
  if (rule == Simultaneous::reflections && least > 0) {
    reflect(W, v);
    count(elastic_);
  } else {
    for (size_t i = 0; i < m_; ++i) elastic_[i] = plastics[i] + plastics[i];
  }
  for (size_t i = 0; i < m_; ++i) plastics[i] = T(least) * elastic_[i] + T(1 - least) * plastics[i];
  std::copy(before.begin(), before.end(), v.begin());
  push(W, plastics, v);
}

/// Adds the impulses in plastic_ and what they lose: -Σ ι (v⁻ + v⁺)/2.
template <class T>
void RigidImpact<T>::book(std::span<const T> before, std::span<const T> after) {
  T all(0.0), shares(0.0);
  const auto share = [&](size_t i) {
    const T s = -plastic_[i] * before[i];
    return s > T(0.0) ? s : T(0.0);
  };
  for (size_t i = 0; i < m_; ++i) {
    iota_[i] = iota_[i] + plastic_[i];
    all = all - T(0.5) * plastic_[i] * (before[i] + after[i]);
    shares = shares + share(i);
  }
  if (!(shares > T(0.0)) || !(all > rounding<T>() * shares)) return;
  for (size_t i = 0; i < m_; ++i) loss_[i] = loss_[i] + all * (share(i) / shares);
}

template <class T>
bool RigidImpact<T>::solve(std::span<const T> W, std::span<T> v, std::span<const double> e,
                           Simultaneous rule) {
  m_ = v.size();
  solved_ = 0;
  T largest(0.0);
  for (const T& each : v) largest = std::max(largest, size_of_rate(each));
  least_ = rounding<T>() * largest;
  std::fill(iota_.begin(), iota_.end(), T(0.0));
  std::fill(loss_.begin(), loss_.end(), T(0.0));
  // Moreau's rule may let a contact approach that moved apart: another impact at the same instant.
  int k = 0;
  for (; k <= most_repetitions && approaches(v); ++k) {
    once(W, v, k < most_repetitions ? e : std::span<const double>(), rule);
    book(before_, v);
  }
  return k > 0;
}

template class RigidImpact<double>;
template class RigidImpact<phs::Quad>;

}  // namespace porthos::contact
