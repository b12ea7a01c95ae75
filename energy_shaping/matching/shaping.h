#pragma once
#include <array>
#include <concepts>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "phs/error.h"
#include "phs/scalars/derivative.h"

/// The interface of a design: the desired energy of the closed loop.
namespace porthos::energy_shaping {

/// A tunable number of a design, which may differ between SIMD lanes.
struct Gain {
  std::string name;  ///< "kv"
  double value = 0;
};

inline constexpr int max_coordinates = 8;  ///< of a shaped plant

/// Source of J2 of the closed loop.
enum class Skew {
  zero,   ///< J2 = 0
  given,  ///< the design's own
  /// found from the kinetic matching equation; underactuation degree one, 2 or 3 coordinates
  solved,
};

/// The target of interconnection and damping assignment (Ortega, Spong, Gomez-Estern, Blankenstein
/// 2002):
///   H_d = ½ pᵀM_d(q)⁻¹p + V_d(q),  q' = M⁻¹M_d ∂H_d/∂p,
///   p' = -M_d M⁻¹ ∂H_d/∂q + (J2 - G Kv Gᵀ) ∂H_d/∂p.
/// Immutable, shared by threads. k: the gains, one number per lane where T has lanes. Matrices row
/// by row.
class Shaping {
 public:
  virtual ~Shaping() = default;
  virtual const std::string& name() const = 0;
  virtual int size() const = 0;  ///< n: coordinates
  virtual std::vector<Gain> gains() const = 0;
  virtual Skew skew_kind() const = 0;

#define PORTHOS_SHAPING(T)                                                                         \
  /* M_d, and where dMd is not empty ∂M_d/∂q_k at dMd[k n²] */                                \
  virtual void mass(std::span<const T> q, std::span<const T> k, std::span<T> Md, std::span<T> dMd) \
      const = 0;                                                                                   \
  /* V_d and its gradient */                                                                       \
  virtual T potential(std::span<const T> q, std::span<const T> k, std::span<T> dV) const = 0;      \
  /* J2(q, p), n × n, of Skew::given */                                                           \
  virtual void skew(std::span<const T> q, std::span<const T> p, std::span<const T> k,              \
                    std::span<T> J2) const = 0;                                                    \
  /* Kv(q), m × m */                                                                              \
  virtual void damping(std::span<const T> q, std::span<const T> k, std::span<T> Kv) const = 0;
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_SHAPING)
#undef PORTHOS_SHAPING
  /// Why the design is not meant for these coordinates, and what to do; empty: it is.
  virtual std::string hindrance(std::span<const double> q) const {
    (void)q;
    return {};
  }
};

template <class D>
concept HasHindrance = requires(const D& d, std::span<const double> q) {
  d.hindrance(q);
};
template <class D>
concept HasSkew = requires(const D& d, std::span<const double> x, std::span<double> o) {
  d.skew(x, x, x, o);
};
template <class D>
concept SolvesSkew = requires {
  requires D::solve_skew;
};
template <class D>
concept HasDamping = requires(const D& d, std::span<const double> x, std::span<double> o) {
  d.damping(x, x, o);
};

/// A Shaping from a plain class with formulas. D has
///   static constexpr int n;  std::string name;  std::vector<Gain> gains() const;
///   template <class S, class T> void mass(std::span<const S> q, std::span<const T> k, std::span<S>
///       Md) const;
///   template <class S, class T> S potential(std::span<const S> q, std::span<const T> k) const;
/// and may have
///   template <class T> void skew(std::span<const T> q, std::span<const T> p, std::span<const T> k,
///       std::span<T> J2) const;
///   static constexpr bool solve_skew = true;      instead of skew
///   template <class T> void damping(std::span<const T> q, std::span<const T> k, std::span<T> Kv)
///       const;
///                                                 default: the gain named "kv" times the identity
///   std::string hindrance(std::span<const double> q) const;
/// S is T or a tangent of T: derivatives are exact, in every scalar.
template <class D>
class UserShaping final : public Shaping {
  static constexpr size_t n = size_t(D::n);
  static_assert(D::n >= 1 && D::n <= max_coordinates);

 public:
  explicit UserShaping(D design) : design_(std::move(design)) {
    const auto list = design_.gains();
    for (size_t i = 0; i < list.size(); ++i)
      if (list[i].name == "kv") kv_ = int(i);
    if (!HasDamping<D> && kv_ < 0)
      throw InvalidArgument("design '" + design_.name +
                            "' has neither a member damping nor a gain named kv");
  }
  const std::string& name() const override { return design_.name; }
  int size() const override { return D::n; }
  std::vector<Gain> gains() const override { return design_.gains(); }
  Skew skew_kind() const override {
    return HasSkew<D> ? Skew::given : SolvesSkew<D> ? Skew::solved : Skew::zero;
  }

#define PORTHOS_SHAPING(T)                                                                     \
  void mass(std::span<const T> q, std::span<const T> k, std::span<T> Md, std::span<T> d)       \
      const override {                                                                         \
    mass_of(q, k, Md, d);                                                                      \
  }                                                                                            \
  T potential(std::span<const T> q, std::span<const T> k, std::span<T> dV) const override {    \
    return potential_of(q, k, dV);                                                             \
  }                                                                                            \
  void skew(std::span<const T> q, std::span<const T> p, std::span<const T> k, std::span<T> J2) \
      const override {                                                                         \
    if constexpr (HasSkew<D>)                                                                  \
      design_.skew(q, p, k, J2);                                                               \
    else                                                                                       \
      for (auto& j : J2) j = static_cast<T>(0.0);                                              \
  }                                                                                            \
  void damping(std::span<const T> q, std::span<const T> k, std::span<T> Kv) const override {   \
    damping_of(q, k, Kv);                                                                      \
  }
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_SHAPING)
#undef PORTHOS_SHAPING
  std::string hindrance(std::span<const double> q) const override {
    if constexpr (HasHindrance<D>)
      return design_.hindrance(q);
    else
      return {};
  }

 private:
  template <class T>
  void mass_of(std::span<const T> q, std::span<const T> k, std::span<T> Md,
               std::span<T> dMd) const {
    design_.mass(q, k, Md);
    if (dMd.empty()) return;
    using S = phs::BasicDual<T>;
    std::array<S, n> x;
    std::array<S, n * n> d;
    for (size_t i = 0; i < n; ++i) x[i] = S(q[i]);
    phs::along_each(x, [&](size_t j) {
      design_.mass(std::span<const S>(x), k, std::span<S>(d));
      for (size_t i = 0; i < n * n; ++i) dMd[j * n * n + i] = d[i].d;
    });
  }
  template <class T>
  T potential_of(std::span<const T> q, std::span<const T> k, std::span<T> dV) const {
    if (dV.empty()) return design_.potential(q, k);
    using S = phs::BasicDual<T>;
    std::array<S, n> x;
    S V;
    for (size_t i = 0; i < n; ++i) x[i] = S(q[i]);
    phs::along_each(x, [&](size_t j) {
      V = design_.potential(std::span<const S>(x), k);
      dV[j] = V.d;
    });
    return V.v;
  }
  template <class T>
  void damping_of(std::span<const T> q, std::span<const T> k, std::span<T> Kv) const {
    if constexpr (HasDamping<D>) {
      design_.damping(q, k, Kv);
    } else {
      size_t m = 1;
      while (m * m < Kv.size()) ++m;
      for (size_t i = 0; i < m * m; ++i) Kv[i] = i % (m + 1) == 0 ? k[size_t(kv_)] : T(0.0);
    }
  }

  D design_;
  int kv_ = -1;
};

/// A design as a Shaping, in every scalar.
template <class D>
std::shared_ptr<const Shaping> shaping(D design) {
  return std::make_shared<UserShaping<D>>(std::move(design));
}

}  // namespace porthos::energy_shaping
