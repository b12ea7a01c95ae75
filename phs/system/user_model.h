#pragma once
#include <memory>
#include <utility>
#include <vector>

#include "phs/scalars/derivative.h"
#include "phs/system/check_description.h"
#include "phs/system/system.h"

/// Makes a Model out of a user's plain class. The class needs two members:
///
///   phs::Description description() const;
///   template <class T> T hamiltonian(std::span<const T> x) const;
///
/// and may have any of these (x, e, out sized as in System):
///
///   template <class T> void gradient   (std::span<const T> x, std::span<T> e) const;
///       default: duals (double only)
///   template <class T> void structure  (std::span<const T> x, std::span<const T> e, std::span<T>
///       Je) const;   default: canonical
///   template <class T> void dissipation(std::span<const T> x, std::span<const T> e, std::span<T>
///       Re) const;   default: zero
///   template <class T> void input      (std::span<const T> x, std::span<const T> u, std::span<T>
///       Gu) const;   default: no ports
///   template <class T> void drive      (T t, std::span<const T> x, std::span<T> dx) const;
///       default: none; adds to the field
///   template <class T> void invariants (std::span<const T> x, std::span<T> values) const;
///       default: none declared
///   template <class T> void flow       (int k, T t, T h, std::span<T> x) const;
///       default: none; exact flow of part k
///   template <class T> void stored     (std::span<const T> x, std::span<T> values) const;
///       default: one storage, H
///   template <class T> void powers     (T t, std::span<const T> x, std::span<const T> e,
///       std::span<T> values) const;
///       default: "dissipation" eᵀRe and "drive", if they exist
///
/// T is a double, lanes, a Quad or a dual: functions are those of phs (using phs::sqrt;), since
/// std::sqrt knows doubles alone. y = Gᵀe is derived from `input`, so ports are collocated by
/// construction.
namespace porthos::phs {

template <class S, class T>
concept HasGradient = requires(const S& s, std::span<const T> x, std::span<T> o) {
  s.gradient(x, o);
};
template <class S, class T>
concept HasStructure = requires(const S& s, std::span<const T> x, std::span<T> o) {
  s.structure(x, x, o);
};
template <class S, class T>
concept HasDissipation = requires(const S& s, std::span<const T> x, std::span<T> o) {
  s.dissipation(x, x, o);
};
template <class S, class T>
concept HasInput = requires(const S& s, std::span<const T> x, std::span<T> o) {
  s.input(x, x, o);
};
template <class S, class T>
concept HasDrive = requires(const S& s, T t, std::span<const T> x, std::span<T> o) {
  s.drive(t, x, o);
};
template <class S, class T>
concept HasFlow = requires(const S& s, T t, std::span<T> x) {
  s.flow(0, t, t, x);
};
template <class S, class T>
concept HasStored = requires(const S& s, std::span<const T> x, std::span<T> o) {
  s.stored(x, o);
};
template <class S, class T>
concept HasPowers = requires(const S& s, T t, std::span<const T> x, std::span<T> o) {
  s.powers(t, x, x, o);
};
template <class S, class T>
concept HasInvariants = requires(const S& s, std::span<const T> x, std::span<T> o) {
  s.invariants(x, o);
};

/// Names the member that a user's class lacks, in the first line of the compiler's error.
template <class S>
consteval bool is_user_system() {
  static_assert(
      requires(const S& s) {
        { s.description() } -> std::convertible_to<Description>;
      },
      "a phs system needs:  phs::Description description() const  -- its state blocks, ports and "
      "invariants");
  static_assert(
      requires(const S& s, std::span<const double> x) {
        { s.hamiltonian(x) } -> std::convertible_to<double>;
      },
      "a phs system needs:  template <class T> T hamiltonian(std::span<const T> x) const  -- its "
      "energy H(x)");
  return true;
}

/// The model of a user's system S, in every scalar. Members that S lacks have the defaults listed
/// above.
template <class S>
class UserModel : public ModelFor<UserModel<S>> {
  static_assert(is_user_system<S>());

 public:
  /// @throws InvalidArgument for a description whose slices are wrong (check_description)
  explicit UserModel(S system) : system_(std::move(system)), description_(system_.description()) {
    check_description(description_);
    if constexpr (!HasPowers<S, double>) {
      description_.powers.clear();
      if (HasDissipation<S, double> && !description_.traits.lossless)
        description_.powers.push_back({"dissipation", PowerKind::dissipated});
      if (HasDrive<S, double>) description_.powers.push_back({"drive", PowerKind::supplied});
    }
  }
  const Description& description() const override { return description_; }

  template <class T>
  class Evaluator : public System<T> {
    using In = std::span<const T>;
    using Out = std::span<T>;

   public:
    explicit Evaluator(const UserModel& m)
        : m_(m),
          e_(size_t(m.description_.nx)),
          w_(size_t(m.description_.nx)),
          u_(size_t(m.description_.nu)) {
      if constexpr (!HasGradient<S, T>) dual_.resize(e_.size());
    }
    const Description& description() const override { return m_.description_; }
    std::unique_ptr<System<T>> clone() const override { return std::make_unique<Evaluator>(m_); }

    T hamiltonian(In x) override { return m_.system_.hamiltonian(x); }

    void gradient(In x, Out e) override {
      if constexpr (HasGradient<S, T>)
        m_.system_.gradient(x, e);
      else
        gradient_of_hamiltonian(x, e);
    }
    void field(T t, In x, In u, Out dx) override {
      gradient(x, e_);
      rate(t, x, e_, dx);
      if constexpr (HasInput<S, T>) {
        if (!u.empty()) {
          m_.system_.input(x, u, Out(w_));
          for (size_t i = 0; i < dx.size(); ++i) dx[i] = dx[i] + w_[i];
        }
      }
    }
    void rate(T t, In x, In e, Out dx) override {
      apply_structure(x, e, dx);
      if constexpr (HasDissipation<S, T>) {
        m_.system_.dissipation(x, e, Out(w_));
        for (size_t i = 0; i < dx.size(); ++i) dx[i] = dx[i] - w_[i];
      }
      if constexpr (HasDrive<S, T>) m_.system_.drive(t, x, dx);
    }
    void apply_structure(In x, In e, Out Je) override {
      if constexpr (HasStructure<S, T>) {
        m_.system_.structure(x, e, Je);
      } else {
        const size_t n = e.size() / 2;
        for (size_t i = 0; i < n; ++i) {
          Je[i] = e[n + i];
          Je[n + i] = -e[i];
        }
      }
    }
    void apply_dissipation(In x, In e, Out Re) override {
      if constexpr (HasDissipation<S, T>)
        m_.system_.dissipation(x, e, Re);
      else
        for (auto& r : Re) r = T(0.0);
    }
    void apply_input(In x, In u, Out Gu) override {
      if constexpr (HasInput<S, T>)
        m_.system_.input(x, u, Gu);
      else
        for (auto& g : Gu) g = T(0.0);
    }
    void output(In x, In e, Out y) override {
      if constexpr (HasInput<S, T>) {
        for (size_t j = 0; j < y.size(); ++j) {  // y_j = eᵀ G(:, j)
          for (size_t k = 0; k < u_.size(); ++k) u_[k] = T(k == j ? 1.0 : 0.0);
          m_.system_.input(x, In(u_), Out(w_));
          T sum(0.0);
          for (size_t i = 0; i < e.size(); ++i) sum = sum + e[i] * w_[i];
          y[j] = sum;
        }
      }
    }
    void stored(In x, Out values) override {
      if constexpr (HasStored<S, T>)
        m_.system_.stored(x, values);
      else
        values[0] = hamiltonian(x);
    }
    void powers(T t, In x, In e, Out values) override {
      if constexpr (HasPowers<S, T>) {
        m_.system_.powers(t, x, e, values);
      } else {
        size_t k = 0;
        if constexpr (HasDissipation<S, T>)
          if (!m_.description_.traits.lossless) {
            m_.system_.dissipation(x, e, Out(w_));
            values[k++] = along(e);
          }
        if constexpr (HasDrive<S, T>) {
          for (T& w : w_) w = T(0.0);
          m_.system_.drive(t, x, Out(w_));
          values[k] = along(e);
        }
      }
    }
    void invariants(In x, Out values) override {
      if constexpr (HasInvariants<S, T>) m_.system_.invariants(x, values);
    }
    void flow(int k, T t, T h, Out x) override {
      if constexpr (HasFlow<S, T>)
        m_.system_.flow(k, t, h, x);
      else
        System<T>::flow(k, t, h, x);
    }

   private:
    /// eᵀw
    T along(In e) const {
      T sum(0.0);
      for (size_t i = 0; i < e.size(); ++i) sum = sum + e[i] * w_[i];
      return sum;
    }
    /// ∂H/∂x where the system has no gradient.
    void gradient_of_hamiltonian(In x, Out e) {
      if constexpr (has_gradient_by_duals<T>) {
        gradient_by_duals<T>([&](auto y) { return m_.system_.hamiltonian(y); }, x, dual_, e);
      } else {
        throw InvalidArgument("system '" + m_.description_.name +
                              "' has no gradient(x, e), expected one for compare, derivatives of "
                              "runs and 113 bits: duals replace it in double and lanes only");
      }
    }

    const UserModel& m_;
    std::vector<T> e_, w_, u_;
    std::vector<Dual> dual_;
  };

  template <class T>
  std::unique_ptr<System<T>> make_system() const {
    return std::make_unique<Evaluator<T>>(*this);
  }

 private:
  S system_;
  Description description_;
};

}  // namespace porthos::phs
