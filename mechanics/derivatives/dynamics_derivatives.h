#pragma once
#include <optional>

#include "mechanics/hamiltonian_field.h"

namespace porthos::mechanics {

/// Columns of a matrix of T that are worked on together.
template <class T>
struct ColumnsOf {
  using type = T;
  static constexpr int count = 1;
};
template <>
struct ColumnsOf<double> {
  static constexpr int count = phs::native_lanes == 8 ? 8 : 4;
  using type = phs::Pack<double, count>;
};

/// Scratch memory of the two algorithms below, beside a Workspace: one per thread, allocated once.
template <class T>
struct DerivativeWorkspace {
  using Columns = typename ColumnsOf<T>::type;

  explicit DerivativeWorkspace(const Mechanism& m)
      : pose(m.nodes().size()),
        bodies(m.nodes().size()),
        columns(size_t(m.nv())),
        beta(m.nodes().size()),
        alpha(m.nodes().size()),
        inverse(size_t(m.nv()) * blocks(m)),
        product(size_t(m.nv())),
        tau(size_t(m.nv())) {
    if (ColumnsOf<T>::count > 1) factor.emplace(m);
  }
  /// Groups of columns of M⁻¹, the last filled up.
  static size_t blocks(const Mechanism& m) {
    constexpr int count = ColumnsOf<T>::count;
    return size_t((m.nv() + count - 1) / count);
  }

  /// A body in world axes, about the origin of the first body; I to p are then of its subtree.
  struct Body {
    Motion<T> V, a;     ///< twist, acceleration less gravity
    RigidInertia<T> I;  ///< inertia
    Force<T> f;         ///< net force
    Mat3<T> N;          ///< of B, see rnea_derivatives()
    Vec3<T> p;          ///< linear momentum
  };
  /// A degree of freedom: S, and what a unit of its coordinate and of its rate adds to the twist
  /// and the acceleration of the bodies it carries.
  struct Column {
    Motion<T> S, P, Q, U;
  };
  std::vector<Transform<T>> pose;
  std::vector<Body> bodies;
  std::vector<Column> columns;
  std::vector<Force<Columns>> beta;          ///< per body, of a group of columns of M⁻¹
  std::vector<Motion<Columns>> alpha;        ///< likewise
  std::optional<Workspace<Columns>> factor;  ///< of M⁻¹, the same for every column of a group
  std::vector<Columns> inverse;              ///< -M⁻¹, a group of rows after another
  std::vector<Columns> product;              ///< of one column, or of a group of unit vectors
  std::vector<T> tau;
};

/// Inverse dynamics τ(q, v, v̇) and its derivatives by coordinates and rates, O(n · depth):
///
///   ∂τ_i/∂q_j = S_i · (2B P_j + I Q_j + S_j ×* f)     ∂τ_i/∂v_j = S_i · (2B S_j + I U_j)
///   ∂τ_j/∂q_i = S_j · (2B P_i + I Q_i)                ∂τ_j/∂v_i = S_j · (2B S_i + I U_i)
///
/// for joint j and each i that carries it (the term of f only if they are different joints), with
/// I, f, B of the subtree of j, P = V_λ × S, Q = a_λ × S + V_λ × P, U = P + V × S, λ the parent. In
/// one system of axes B acts on rotations alone: 2B (ω, u) = (N ω, 2 ω × p).
///
/// The derivative by the coordinates of a joint of several freedoms is along its twists: a ball or
/// free joint turns about the child's axes, a free one moves along them. Rates keep their values in
/// these axes, wrenches in those of their bodies.
/// @param q  size nq;  v, vdot  size nv;  wrench  per moving body in its axes (empty: none)
/// @param tau  written, size nv;  dq, dv  written, nv × nv, column by column
/// Allocates nothing. Source: Carpentier, Mansard 2018 (RSS); Singh, Russell, Wensing 2022 (IEEE
/// RA-L 7), eqs. of algorithm 1.
template <class T>
void rnea_derivatives(const Mechanism& m, Workspace<T>& w, DerivativeWorkspace<T>& d,
                      std::span<const T> q, std::span<const T> v, std::span<const T> vdot,
                      std::span<const Force<T>> wrench, std::span<T> tau, std::span<T> dq,
                      std::span<T> dv);

/// The inertial regressor: inverse dynamics without rotors and wrenches is τ = Y θ, with ten
/// numbers in θ for each of Mechanism::bodies(): mass, first moment (3), and xx xy xz yy yz zz of
/// the inertia about the origin of its frame, along its axes. A body of the world has columns of
/// zeros.
/// ∂v̇/∂θ = -M⁻¹ Y. O(bodies · depth).
/// @param q  size nq;  v, vdot  size nv;  Y  written, nv × 10·bodies, column by column
/// Source: Atkeson, An, Hollerbach 1986 (IJRR 5).
template <class T>
void inertial_regressor(const Mechanism& m, Workspace<T>& w, DerivativeWorkspace<T>& d,
                        std::span<const T> q, std::span<const T> v, std::span<const T> vdot,
                        std::span<T> Y);

/// Forward dynamics v̇(q, v, τ) and its derivatives: ∂v̇/∂τ = M⁻¹, by the factors of the
/// articulated-body algorithm, the others -M⁻¹ times those of rnea_derivatives() at v̇. O(n²) for
/// M⁻¹, and two products of matrices.
/// @param vdot  written, size nv;  dq, dv, dtau  written, nv × nv, column by column
template <class T>
void aba_derivatives(const Mechanism& m, Workspace<T>& w, DerivativeWorkspace<T>& d,
                     std::span<const T> q, std::span<const T> v, const Loads<T>& loads,
                     std::span<T> vdot, std::span<T> dq, std::span<T> dv, std::span<T> dtau);

}  // namespace porthos::mechanics
