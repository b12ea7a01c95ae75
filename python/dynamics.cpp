// The dynamics algorithms on numpy arrays, one state or many.
#include <pybind11/stl.h>

#include <optional>

#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/derivatives/dynamics_derivatives.h"
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"
#include "python/batch.h"
#include "python/bind.h"

namespace porthos::python {
namespace {

using namespace mechanics;

/// Wrenches of the moving bodies from 6 numbers each.
template <class T>
std::span<const Force<T>> wrenches(Scratch& s, std::span<const T> numbers) {
  if (numbers.empty()) return {};
  const size_t n = numbers.size() / 6;
  auto& w = s.pick<T>(s.wrench, s.wrenches, n);
  for (size_t b = 0; b < n; ++b)
    for (int k = 0; k < 6; ++k) w[b][k] = numbers[6 * b + size_t(k)];
  return {w.data(), n};
}

/// A matrix that a kernel writes column by column, returned row by row.
template <class T, class F>
void by_rows(Scratch& s, size_t rows, size_t cols, std::span<T> out, F kernel) {
  auto& a = s.pick<T>(s.numbers, s.packs, rows * cols);
  kernel(std::span<T>(a.data(), rows * cols));
  for (size_t i = 0; i < rows; ++i)
    for (size_t j = 0; j < cols; ++j) out[i * cols + j] = a[j * rows + i];
}

/// The input of wrenches.
Source wrenches_in(Rows& r, const SharedMechanism& m, py::handle wrench) {
  return r.in("wrench", wrench, Shape{m->body_count(), 6}, true);
}

py::array_t<double> aba_of(const SharedMechanism& m, py::object q, py::object v, py::object tau,
                           py::object wrench, py::object out) {
  Rows r;
  const std::array in{r.in("q", q, nq(m)), r.in("v", v, nv(m)), r.in("tau", tau, nv(m), true),
                      wrenches_in(r, m, wrench)};
  return one_array(m, r, in, out, Shape{m->nv()},
                   [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
                     aba<T>(*m, w, a[0], a[1], {a[2], wrenches<T>(s, a[3])}, o[0]);
                   });
}

py::array_t<double> rnea_of(const SharedMechanism& m, py::object q, py::object v, py::object vdot,
                            py::object wrench, py::object out) {
  Rows r;
  const std::array in{r.in("q", q, nq(m)), r.in("v", v, nv(m), true),
                      r.in("vdot", vdot, nv(m), true), wrenches_in(r, m, wrench)};
  return one_array(m, r, in, out, Shape{m->nv()},
                   [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
                     rnea<T>(*m, w, a[0], a[1], a[2], wrenches<T>(s, a[3]), o[0]);
                   });
}

py::array_t<double> crba_of(const SharedMechanism& m, py::object q, py::object out) {
  Rows r;
  return one_array(m, r, std::array{r.in("q", q, nq(m))}, out, Shape{m->nv(), m->nv()},
                   [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                     crba<T>(*m, w, a[0], o[0]);
                   });
}

JacobianAxes axes_of(const std::string& axes) {
  if (axes == "body") return JacobianAxes::body;
  if (axes == "world") return JacobianAxes::world;
  throw InvalidArgument("axes is '" + axes + "', expected 'body' or 'world'");
}

py::array_t<double> jacobian_of(const SharedMechanism& m, py::object q, const std::string& body,
                                const std::string& axes, py::object out) {
  const BodyFrame& frame = m->body(body);
  const JacobianAxes in_axes = axes_of(axes);
  Rows r;
  return one_array(m, r, std::array{r.in("q", q, nq(m))}, out, Shape{6, m->nv()},
                   [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
                     by_rows<T>(s, 6, nv(m), o[0], [&](std::span<T> c) {
                       jacobian<T>(*m, w, a[0], frame, in_axes, c);
                     });
                   });
}

py::array_t<double> centroidal(const SharedMechanism& m, py::object q, py::object out) {
  Rows r;
  return one_array(m, r, std::array{r.in("q", q, nq(m))}, out, Shape{6, m->nv()},
                   [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
                     by_rows<T>(s, 6, nv(m), o[0], [&](std::span<T> c) {
                       centroidal_momentum_matrix<T>(*m, w, a[0], c);
                     });
                   });
}

py::tuple hamiltonian_field_of(const SharedMechanism& m, py::object q, py::object p, py::object tau,
                               py::object wrench, py::object out) {
  Rows r;
  const std::array in{r.in("q", q, nq(m)), r.in("p", p, nq(m)), r.in("tau", tau, nv(m), true),
                      wrenches_in(r, m, wrench)};
  const auto [first, second] = two(out);
  auto q_dot = r.out("out[0]", first, nq(m)), p_dot = r.out("out[1]", second, nq(m));
  over_rows(m, r, in,
            std::array{Target{q_dot.mutable_data(), nq(m)}, Target{p_dot.mutable_data(), nq(m)}},
            [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
              hamiltonian_field<T>(*m, w, a[0], a[1], {a[2], wrenches<T>(s, a[3])}, o[0], o[1]);
            });
  return py::make_tuple(q_dot, p_dot);
}

/// A square matrix from columns to rows.
template <class T>
void transpose(std::span<T> A, size_t n) {
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j < i; ++j) std::swap(A[i * n + j], A[j * n + i]);
}

/// A kernel's value, and its derivatives by q, by v and, of forward dynamics, by the joint forces.
template <bool forward>
py::tuple derivatives_of(const SharedMechanism& m, py::object q, py::object v, py::object given,
                         py::object wrench) {
  constexpr size_t matrices = forward ? 3 : 2;
  Rows r;
  const size_t n = nv(m);
  const std::array in{r.in("q", q, nq(m)), r.in("v", v, n),
                      r.in(forward ? "tau" : "vdot", given, n), wrenches_in(r, m, wrench)};
  py::tuple all(matrices + 1);
  std::array<Target, matrices + 1> out;
  for (size_t k = 0; k <= matrices; ++k) {
    auto array =
        k == 0 ? r.out("out", py::none(), n) : r.out("out", py::none(), Shape{m->nv(), m->nv()});
    out[k] = {array.mutable_data(), k == 0 ? n : n * n};
    all[k] = array;
  }
  over_rows(m, r, in, out, [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
    const auto forces = wrenches<T>(s, a[3]);
    auto& d = s.derivatives<T>();
    if constexpr (forward)
      aba_derivatives<T>(*m, w, d, a[0], a[1], {a[2], forces}, o[0], o[1], o[2], o[3]);
    else
      rnea_derivatives<T>(*m, w, d, a[0], a[1], a[2], forces, o[0], o[1], o[2]);
    for (size_t k = 1; k <= matrices; ++k) transpose(o[k], n);
  });
  return all;
}

py::array_t<double> regressor_of(const SharedMechanism& m, py::object q, py::object v,
                                 py::object vdot) {
  Rows r;
  const size_t columns = 10 * m->bodies().size();
  const std::array in{r.in("q", q, nq(m)), r.in("v", v, nv(m)), r.in("vdot", vdot, nv(m))};
  return one_array(m, r, in, py::none(), Shape{m->nv(), py::ssize_t(columns)},
                   [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
                     by_rows<T>(s, nv(m), columns, o[0], [&](std::span<T> c) {
                       inertial_regressor<T>(*m, w, s.derivatives<T>(), a[0], a[1], a[2], c);
                     });
                   });
}

}  // namespace

void bind_dynamics(py::module_& m) {
  using py::arg;
  const py::object none = py::none();

  m.def(
      "aba", &aba_of, arg("mechanism"), arg("q"), arg("v"), arg("tau") = none, arg("wrench") = none,
      arg("out") = none,
      R"(Forward dynamics by the articulated-body algorithm, O(n): M(q) vdot + C(q, v) v + dV/dq = tau + loads.

q: configuration, (nq,) or (n, nq). v: joint rates, (nv,) [rad/s | m/s]. tau: joint forces, (nv,) [N m | N].
wrench: per moving body [moment; force] about its frame's origin in its own axes, (bodies, 6) [N m; N].
Returns vdot, (nv,) or (n, nv); of a free or ball joint the derivative of its body-frame twist. Every array has one
state, or all have n, in C order; a batch runs in SIMD lanes and gives the bits of its rows one by one.
Source: Featherstone 2008, table 7.1.)");
  m.def(
      "rnea", &rnea_of, arg("mechanism"), arg("q"), arg("v") = none, arg("vdot") = none,
      arg("wrench") = none, arg("out") = none,
      R"(Inverse dynamics by the recursive Newton-Euler algorithm, O(n): tau = M(q) vdot + C(q, v) v + dV/dq - wrench terms.

Shapes as in aba; v and vdot left out are zero. Returns tau, (nv,) or (n, nv).
Source: Featherstone 2008, table 5.1, with the world accelerated by -g.)");
  m.def("rnea_derivatives", &derivatives_of<false>, arg("mechanism"), arg("q"), arg("v"),
        arg("vdot"), arg("wrench") = none,
        R"(Inverse dynamics and its derivatives, O(n depth): returns (tau, dtau_dq, dtau_dv).

Shapes as in rnea; the matrices are (nv, nv) or (n, nv, nv). The derivative by the coordinates of a ball or free joint is
along its twists: it turns about the child's axes, a free joint also moves along them. Rates and wrenches keep their
values in their bodies' axes. Source: Carpentier, Mansard 2018; Singh, Russell, Wensing 2022.)");
  m.def(
      "aba_derivatives", &derivatives_of<true>, arg("mechanism"), arg("q"), arg("v"), arg("tau"),
      arg("wrench") = none,
      R"(Forward dynamics and its derivatives: returns (vdot, dvdot_dq, dvdot_dv, dvdot_dtau), the last M(q)^-1.

Shapes and coordinates as in rnea_derivatives. Springs and dampers of the mechanism's joints are not part of it.)");
  m.def(
      "inertial_regressor", &regressor_of, arg("mechanism"), arg("q"), arg("v"), arg("vdot"),
      R"(Y of tau = Y theta, inverse dynamics as a linear function of the bodies' inertias, without rotors and wrenches.

theta has ten numbers for each of mechanism.bodies: mass, first moment (3), and xx xy xz yy yz zz of the inertia about
the origin of the body's frame, along its axes. Returns Y, (nv, 10 bodies) or (n, nv, 10 bodies).
Source: Atkeson, An, Hollerbach 1986.)");
  m.def("crba", &crba_of, arg("mechanism"), arg("q"), arg("out") = none,
        R"(Joint-space mass matrix by the composite-rigid-body algorithm, O(n depth).

q: (nq,) or (n, nq). Returns M, (nv, nv) or (n, nv, nv), both triangles; zero between branches.
Source: Featherstone 2008, table 6.2.)");
  m.def(
      "jacobian", &jacobian_of, arg("mechanism"), arg("q"), arg("body"), arg("axes") = "world",
      arg("out") = none,
      R"(Jacobian of a body frame: its twist is J v, [angular; linear], the linear part that of the frame's origin.

axes: 'body' or 'world', the axes the rows are written in. Returns J, (6, nv) or (n, 6, nv).)");
  m.def(
      "centroidal_momentum_matrix", &centroidal, arg("mechanism"), arg("q"), arg("out") = none,
      R"(Centroidal momentum matrix: (k_G, l) = A_G v, k_G about the centre of mass, world axes, rows [angular; linear].

Of the bodies, without the spin of rotors. Returns A, (6, nv) or (n, 6, nv). Source: Orin, Goswami, Lee 2013.)");
  m.def(
      "hamiltonian_field", &hamiltonian_field_of, arg("mechanism"), arg("q"), arg("p"),
      arg("tau") = none, arg("wrench") = none, arg("out") = none,
      R"(The O(n) Hamiltonian vector field of H(q, p) = p M(q)^-1 p / 2 + V(q), no mass matrix formed: q' = dH/dp, p' = -dH/dq + loads.

q, p: (nq,) or (n, nq), rotation blocks: quaternion and lift. Returns (q_dot, p_dot); out: a tuple of two arrays.)");
}

}  // namespace porthos::python
