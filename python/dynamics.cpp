// The dynamics algorithms on numpy arrays, one state or many.
#include <pybind11/stl.h>

#include <optional>

#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/lanes.h"

namespace porthos::python {
namespace {

using namespace mechanics;
using phs::Pack8;
using MechanismPtr = std::shared_ptr<const Mechanism>;

/// The scratch of the kernels, kept from call to call: one per thread for each of the last few
/// mechanisms.
struct Scratch {
  explicit Scratch(const MechanismPtr& m) : mechanism(m), one(*m), eight(*m) {}
  std::weak_ptr<const Mechanism> mechanism;
  Workspace<double> one;
  Workspace<Pack8> eight;
  std::vector<double> numbers;
  std::vector<Pack8> packs;
  std::vector<Force<double>> wrench;
  std::vector<Force<Pack8>> wrenches;
  std::vector<Transform<double>> pose;
  std::vector<Transform<Pack8>> poses;

  template <class T>
  auto& pick(auto& of_double, auto& of_packs, size_t n) {
    auto& v = [&]() -> auto& {
      if constexpr (std::is_same_v<T, double>)
        return of_double;
      else
        return of_packs;
    }
    ();
    if (v.size() < n) v.resize(n);
    return v;
  }
};

Scratch& scratch_of(const MechanismPtr& m) {
  constexpr size_t most = 8;
  thread_local std::vector<std::unique_ptr<Scratch>> kept;
  for (size_t i = 0; i < kept.size(); ++i)
    if (kept[i]->mechanism.lock() == m) {
      if (i > 0) std::swap(kept[0], kept[i]);
      return *kept[0];
    }
  if (kept.size() == most) kept.pop_back();
  kept.insert(kept.begin(), std::make_unique<Scratch>(m));
  return *kept[0];
}

/// Runs f(scratch, workspace, in, out) over the rows: a generic callable with spans over double or
/// Pack8.
template <size_t I, size_t O, class F>
void over_rows(const MechanismPtr& m, const Rows& rows, const std::array<Source, I>& in,
               const std::array<Target, O>& out, F f) {
  Scratch& s = scratch_of(m);
  Lanes<I, O> lanes(in, out);
  const auto work = [&] {
    lanes.run(
        rows.count(),
        [&](const auto& a, const auto& b) { f.template operator()<double>(s, s.one, a, b); },
        [&](const auto& a, const auto& b) { f.template operator()<Pack8>(s, s.eight, a, b); });
  };
  if (rows.count() < 32) return work();
  const py::gil_scoped_release released;
  work();
}

template <class T>
Workspace<T>& of(Scratch& s) {
  if constexpr (std::is_same_v<T, double>)
    return s.one;
  else
    return s.eight;
}

/// Wrenches of the moving bodies out of 6 numbers each.
template <class T>
std::span<const Force<T>> wrenches(Scratch& s, std::span<const T> numbers) {
  if (numbers.empty()) return {};
  const size_t n = numbers.size() / 6;
  auto& w = s.pick<T>(s.wrench, s.wrenches, n);
  for (size_t b = 0; b < n; ++b)
    for (int k = 0; k < 6; ++k) w[b][k] = numbers[6 * b + size_t(k)];
  return {w.data(), n};
}

/// A matrix that a kernel writes column by column, handed out row by row.
template <class T, class F>
void by_rows(Scratch& s, size_t rows, size_t cols, std::span<T> out, F kernel) {
  auto& a = s.pick<T>(s.numbers, s.packs, rows * cols);
  kernel(std::span<T>(a.data(), rows * cols));
  for (size_t i = 0; i < rows; ++i)
    for (size_t j = 0; j < cols; ++j) out[i * cols + j] = a[j * rows + i];
}

size_t nq(const MechanismPtr& m) { return size_t(m->nq()); }
size_t nv(const MechanismPtr& m) { return size_t(m->nv()); }
Shape wrench_shape(const MechanismPtr& m) { return {m->body_count(), 6}; }

py::array_t<double> aba_of(const MechanismPtr& m, py::object q, py::object v, py::object tau,
                           py::object wrench, py::object out) {
  Rows r;
  const size_t b = 6 * size_t(m->body_count());
  const std::array<Source, 4> in{{{r.in("q", q, nq(m)), nq(m)},
                                  {r.in("v", v, nv(m)), nv(m)},
                                  {r.in("tau", tau, nv(m), true), nv(m)},
                                  {r.in("wrench", wrench, wrench_shape(m), true), b}}};
  auto vdot = r.out("out", out, nv(m));
  over_rows(m, r, in, std::array<Target, 1>{{{vdot.mutable_data(), nv(m)}}},
            [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
              aba<T>(*m, w, a[0], a[1], {a[2], wrenches<T>(s, a[3])}, o[0]);
            });
  return vdot;
}

py::array_t<double> rnea_of(const MechanismPtr& m, py::object q, py::object v, py::object vdot,
                            py::object wrench, py::object out) {
  Rows r;
  const size_t b = 6 * size_t(m->body_count());
  const std::array<Source, 4> in{{{r.in("q", q, nq(m)), nq(m)},
                                  {r.in("v", v, nv(m), true), nv(m)},
                                  {r.in("vdot", vdot, nv(m), true), nv(m)},
                                  {r.in("wrench", wrench, wrench_shape(m), true), b}}};
  auto tau = r.out("out", out, nv(m));
  over_rows(m, r, in, std::array<Target, 1>{{{tau.mutable_data(), nv(m)}}},
            [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
              rnea<T>(*m, w, a[0], a[1], a[2], wrenches<T>(s, a[3]), o[0]);
            });
  return tau;
}

py::array_t<double> crba_of(const MechanismPtr& m, py::object q, py::object out) {
  Rows r;
  const std::array<Source, 1> in{{{r.in("q", q, nq(m)), nq(m)}}};
  auto M = r.out("out", out, Shape{m->nv(), m->nv()});
  over_rows(m, r, in, std::array<Target, 1>{{{M.mutable_data(), nv(m) * nv(m)}}},
            [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
              crba<T>(*m, w, a[0], o[0]);
            });
  return M;
}

JacobianAxes axes_of(const std::string& axes) {
  if (axes == "body") return JacobianAxes::body;
  if (axes == "world") return JacobianAxes::world;
  throw InvalidArgument("axes is '" + axes + "', expected 'body' or 'world'");
}

py::array_t<double> jacobian_of(const MechanismPtr& m, py::object q, const std::string& body,
                                const std::string& axes, py::object out) {
  const BodyFrame& frame = m->body(body);
  const JacobianAxes in_axes = axes_of(axes);
  Rows r;
  const std::array<Source, 1> in{{{r.in("q", q, nq(m)), nq(m)}}};
  auto J = r.out("out", out, Shape{6, m->nv()});
  over_rows(m, r, in, std::array<Target, 1>{{{J.mutable_data(), 6 * nv(m)}}},
            [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
              by_rows<T>(s, 6, nv(m), o[0],
                         [&](std::span<T> c) { jacobian<T>(*m, w, a[0], frame, in_axes, c); });
            });
  return J;
}

py::array_t<double> centroidal(const MechanismPtr& m, py::object q, py::object out) {
  Rows r;
  const std::array<Source, 1> in{{{r.in("q", q, nq(m)), nq(m)}}};
  auto A = r.out("out", out, Shape{6, m->nv()});
  over_rows(m, r, in, std::array<Target, 1>{{{A.mutable_data(), 6 * nv(m)}}},
            [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
              by_rows<T>(s, 6, nv(m), o[0],
                         [&](std::span<T> c) { centroidal_momentum_matrix<T>(*m, w, a[0], c); });
            });
  return A;
}

/// A pair of outputs: None, or a tuple of two.
std::pair<py::object, py::object> two(py::handle out) {
  if (out.is_none()) return {py::none(), py::none()};
  if (!py::isinstance<py::tuple>(out) || py::len(out) != 2)
    throw InvalidArgument("out is " + kind_of(out) + ", expected a tuple of two arrays");
  const auto t = py::reinterpret_borrow<py::tuple>(out);
  return {t[0], t[1]};
}

py::tuple hamiltonian_field_of(const MechanismPtr& m, py::object q, py::object p, py::object tau,
                               py::object wrench, py::object out) {
  Rows r;
  const size_t b = 6 * size_t(m->body_count());
  const std::array<Source, 4> in{{{r.in("q", q, nq(m)), nq(m)},
                                  {r.in("p", p, nq(m)), nq(m)},
                                  {r.in("tau", tau, nv(m), true), nv(m)},
                                  {r.in("wrench", wrench, wrench_shape(m), true), b}}};
  const auto [first, second] = two(out);
  auto q_dot = r.out("out[0]", first, nq(m)), p_dot = r.out("out[1]", second, nq(m));
  over_rows(m, r, in,
            std::array<Target, 2>{{{q_dot.mutable_data(), nq(m)}, {p_dot.mutable_data(), nq(m)}}},
            [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
              hamiltonian_field<T>(*m, w, a[0], a[1], {a[2], wrenches<T>(s, a[3])}, o[0], o[1]);
            });
  return py::make_tuple(q_dot, p_dot);
}

template <class T>
void put(const Vec3<T>& v, T* to) {
  to[0] = v.x;
  to[1] = v.y;
  to[2] = v.z;
}
template <class T>
void put(const Mat3<T>& R, T* to) {  // row by row
  for (int i = 0; i < 3; ++i) {
    to[3 * i] = R.x[i];
    to[3 * i + 1] = R.y[i];
    to[3 * i + 2] = R.z[i];
  }
}

py::tuple forward_kinematics_of(const MechanismPtr& m, py::object q, py::object out) {
  Rows r;
  const size_t n = size_t(m->body_count());
  const std::array<Source, 1> in{{{r.in("q", q, nq(m)), nq(m)}}};
  const auto [first, second] = two(out);
  auto R = r.out("out[0]", first, Shape{py::ssize_t(n), 3, 3}),
       x = r.out("out[1]", second, Shape{py::ssize_t(n), 3});
  over_rows(m, r, in, std::array<Target, 2>{{{R.mutable_data(), 9 * n}, {x.mutable_data(), 3 * n}}},
            [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
              auto& pose = s.pick<T>(s.pose, s.poses, n);
              forward_kinematics<T>(*m, w, a[0], std::span<Transform<T>>(pose.data(), n));
              for (size_t b = 0; b < n; ++b) {
                put(pose[b].R, &o[0][9 * b]);
                put(pose[b].r, &o[1][3 * b]);
              }
            });
  return py::make_tuple(R, x);
}

py::tuple body_pose_of(const MechanismPtr& m, py::object q, const std::string& body,
                       py::object out) {
  const BodyFrame& frame = m->body(body);
  Rows r;
  const size_t n = size_t(m->body_count());
  const std::array<Source, 1> in{{{r.in("q", q, nq(m)), nq(m)}}};
  const auto [first, second] = two(out);
  auto R = r.out("out[0]", first, Shape{3, 3}), x = r.out("out[1]", second, Shape{3});
  over_rows(m, r, in, std::array<Target, 2>{{{R.mutable_data(), 9}, {x.mutable_data(), 3}}},
            [&]<class T>(Scratch& s, Workspace<T>& w, const auto& a, const auto& o) {
              auto& pose = s.pick<T>(s.pose, s.poses, n);
              const std::span<Transform<T>> all(pose.data(), n);
              forward_kinematics<T>(*m, w, a[0], all);
              const Transform<T> p = body_pose<T>(*m, frame, all);
              put(p.R, &o[0][0]);
              put(p.r, &o[1][0]);
            });
  return py::make_tuple(R, x);
}

/// A function of two arrays (or one, of n2 = 0) that gives numbers of the shape `item`.
template <class F>
py::array_t<double> simple(const MechanismPtr& m, const char* a, py::handle qa, size_t na,
                           const char* b, py::handle qb, size_t nb, py::handle out,
                           const Shape& item, F f) {
  Rows r;
  const std::array<Source, 2> in{{{r.in(a, qa, na), na}, {b ? r.in(b, qb, nb) : nullptr, nb}}};
  auto y = r.out("out", out, item);
  size_t n = 1;
  for (const auto k : item) n *= size_t(k);
  over_rows(m, r, in, std::array<Target, 1>{{{y.mutable_data(), n}}}, f);
  return y;
}

/// A number for one state, an array of n for a batch.
py::object number(py::array_t<double> y) {
  if (y.ndim() == 0) return py::float_(*y.data());
  return y;
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
  m.def("forward_kinematics", &forward_kinematics_of, arg("mechanism"), arg("q"), arg("out") = none,
        R"(Pose of the moving bodies' frames in the world, root to leaf: (R, r).

R: (bodies, 3, 3) or (n, bodies, 3, 3), columns are the body's axes; r: (bodies, 3), origins [m]. A user's body: body_pose.)");
  m.def(
      "body_pose", &body_pose_of, arg("mechanism"), arg("q"), arg("body"), arg("out") = none,
      R"(Pose of a body of that name in the world: (R, r), (3, 3) and (3,), or (n, 3, 3) and (n, 3).)");
  m.def(
      "coordinate_rates",
      [](const MechanismPtr& p, py::object q, py::object v, py::object out) {
        return simple(p, "q", q, nq(p), "v", v, nv(p), out, Shape{p->nq()},
                      [&]<class T>(Scratch&, Workspace<T>&, const auto& a, const auto& o) {
                        coordinate_rates<T>(*p, a[0], a[1], o[0]);
                      });
      },
      arg("mechanism"), arg("q"), arg("v"), arg("out") = none,
      "Flat coordinate derivatives q' from joint rates v: (nq,) or (n, nq).");
  m.def(
      "momenta_from_rates",
      [](const MechanismPtr& p, py::object q, py::object v, py::object out) {
        return simple(p, "q", q, nq(p), "v", v, nv(p), out, Shape{p->nq()},
                      [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                        momenta_from_rates<T>(*p, w, a[0], a[1], o[0]);
                      });
      },
      arg("mechanism"), arg("q"), arg("v"), arg("out") = none,
      "p = flat momenta of the joint rates v: (nq,) or (n, nq).");
  m.def(
      "rates_from_momenta",
      [](const MechanismPtr& mech, py::object q, py::object p, py::object out) {
        return simple(mech, "q", q, nq(mech), "p", p, nq(mech), out, Shape{mech->nv()},
                      [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                        rates_from_momenta<T>(*mech, w, a[0], a[1]);
                        std::copy_n(w.rate.begin(), o[0].size(), o[0].begin());
                      });
      },
      arg("mechanism"), arg("q"), arg("p"), arg("out") = none,
      "Joint rates v = M(q)^-1 p from the flat momenta: (nv,) or (n, nv).");
  m.def(
      "momentum",
      [](const MechanismPtr& mech, py::object q, py::object p, py::object out) {
        return simple(mech, "q", q, nq(mech), "p", p, nq(mech), out, Shape{6},
                      [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                        const Momentum<T> h = momentum<T>(*mech, w, a[0], a[1]);
                        put(h.angular, &o[0][0]);
                        put(h.linear, &o[0][3]);
                      });
      },
      arg("mechanism"), arg("q"), arg("p"), arg("out") = none,
      R"(Total momentum at (q, p), [angular; linear]: (6,) or (n, 6), world axes, angular about the world's origin [kg m^2/s; kg m/s].

It is the momentum of the bodies; the spin of rotors is not in it.)");
  m.def(
      "centre_of_mass",
      [](const MechanismPtr& mech, py::object q, py::object out) {
        return simple(mech, "q", q, nq(mech), nullptr, {}, 0, out, Shape{3},
                      [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                        put(centre_of_mass<T>(*mech, w, a[0]), &o[0][0]);
                      });
      },
      arg("mechanism"), arg("q"), arg("out") = none,
      "Centre of mass of the moving bodies in the world [m]: (3,) or (n, 3).");
  m.def(
      "kinetic_energy",
      [](const MechanismPtr& mech, py::object q, py::object p, py::object out) {
        return number(simple(mech, "q", q, nq(mech), "p", p, nq(mech), out, Shape{},
                             [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                               o[0][0] = kinetic_energy<T>(*mech, w, a[0], a[1]);
                             }));
      },
      arg("mechanism"), arg("q"), arg("p"), arg("out") = none,
      "T = p q'/2 at (q, p) [J]: a number, or (n,) of a batch.");
  m.def(
      "potential_energy",
      [](const MechanismPtr& mech, py::object q, py::object out) {
        return number(simple(mech, "q", q, nq(mech), nullptr, {}, 0, out, Shape{},
                             [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                               o[0][0] = potential_energy<T>(*mech, w, a[0]);
                             }));
      },
      arg("mechanism"), arg("q"), arg("out") = none,
      "V = -sum m_i g c_i, zero at the world's origin [J]: a number, or (n,) of a batch. Joint "
      "springs are the system's.");
}

}  // namespace porthos::python
