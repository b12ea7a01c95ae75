// Poses, rates, momenta and energies on numpy arrays, one state or many.
#include <pybind11/stl.h>

#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "python/batch.h"
#include "python/bind.h"

namespace porthos::python {
namespace {

using namespace mechanics;

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

py::tuple forward_kinematics_of(const SharedMechanism& m, py::object q, py::object out) {
  Rows r;
  const size_t n = size_t(m->body_count());
  const std::array in{r.in("q", q, nq(m))};
  const auto [first, second] = two(out);
  auto R = r.out("out[0]", first, Shape{py::ssize_t(n), 3, 3}),
       x = r.out("out[1]", second, Shape{py::ssize_t(n), 3});
  over_rows(m, r, in, std::array{Target{R.mutable_data(), 9 * n}, Target{x.mutable_data(), 3 * n}},
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

py::tuple body_pose_of(const SharedMechanism& m, py::object q, const std::string& body,
                       py::object out) {
  const BodyFrame& frame = m->body(body);
  Rows r;
  const size_t n = size_t(m->body_count());
  const std::array in{r.in("q", q, nq(m))};
  const auto [first, second] = two(out);
  auto R = r.out("out[0]", first, Shape{3, 3}), x = r.out("out[1]", second, Shape{3});
  over_rows(m, r, in, std::array{Target{R.mutable_data(), 9}, Target{x.mutable_data(), 3}},
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

/// A function of q, or of q and one more array, that gives numbers of the shape `item`.
template <class F>
py::array_t<double> of_q(const SharedMechanism& m, py::handle q, py::handle out, const Shape& item,
                         F f) {
  Rows r;
  return one_array(m, r, std::array{r.in("q", q, nq(m))}, out, item, f);
}
template <class F>
py::array_t<double> of_two(const SharedMechanism& m, py::handle q, const char* name, py::handle a,
                           size_t n, py::handle out, const Shape& item, F f) {
  Rows r;
  return one_array(m, r, std::array{r.in("q", q, nq(m)), r.in(name, a, n)}, out, item, f);
}

/// A number for one state, an array of n for a batch.
py::object number(py::array_t<double> y) {
  if (y.ndim() == 0) return py::float_(*y.data());
  return y;
}

}  // namespace

// NOLINTNEXTLINE(readability-function-size): a list of bindings
void bind_kinematics(py::module_& m) {
  using py::arg;
  const py::object none = py::none();

  m.def("forward_kinematics", &forward_kinematics_of, arg("mechanism"), arg("q"), arg("out") = none,
        R"(Pose of the moving bodies' frames in the world, root to leaf: (R, r).

R: (bodies, 3, 3) or (n, bodies, 3, 3), columns are the body's axes; r: (bodies, 3), origins [m]. A user's body: body_pose.)");
  m.def(
      "body_pose", &body_pose_of, arg("mechanism"), arg("q"), arg("body"), arg("out") = none,
      R"(Pose of a body of that name in the world: (R, r), (3, 3) and (3,), or (n, 3, 3) and (n, 3).)");
  m.def(
      "coordinate_rates",
      [](const SharedMechanism& p, py::object q, py::object v, py::object out) {
        return of_two(p, q, "v", v, nv(p), out, Shape{p->nq()},
                      [&]<class T>(Scratch&, Workspace<T>&, const auto& a, const auto& o) {
                        coordinate_rates<T>(*p, a[0], a[1], o[0]);
                      });
      },
      arg("mechanism"), arg("q"), arg("v"), arg("out") = none,
      "Flat coordinate derivatives q' from joint rates v: (nq,) or (n, nq).");
  m.def(
      "momenta_from_rates",
      [](const SharedMechanism& p, py::object q, py::object v, py::object out) {
        return of_two(p, q, "v", v, nv(p), out, Shape{p->nq()},
                      [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                        momenta_from_rates<T>(*p, w, a[0], a[1], o[0]);
                      });
      },
      arg("mechanism"), arg("q"), arg("v"), arg("out") = none,
      "p = flat momenta of the joint rates v: (nq,) or (n, nq).");
  m.def(
      "rates_from_momenta",
      [](const SharedMechanism& mech, py::object q, py::object p, py::object out) {
        return of_two(mech, q, "p", p, nq(mech), out, Shape{mech->nv()},
                      [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                        rates_from_momenta<T>(*mech, w, a[0], a[1]);
                        std::copy_n(w.rate.begin(), o[0].size(), o[0].begin());
                      });
      },
      arg("mechanism"), arg("q"), arg("p"), arg("out") = none,
      "Joint rates v = M(q)^-1 p from the flat momenta: (nv,) or (n, nv).");
  m.def(
      "momentum",
      [](const SharedMechanism& mech, py::object q, py::object p, py::object out) {
        return of_two(mech, q, "p", p, nq(mech), out, Shape{6},
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
      [](const SharedMechanism& mech, py::object q, py::object out) {
        return of_q(mech, q, out, Shape{3},
                    [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                      put(centre_of_mass<T>(*mech, w, a[0]), &o[0][0]);
                    });
      },
      arg("mechanism"), arg("q"), arg("out") = none,
      "Centre of mass of the moving bodies in the world [m]: (3,) or (n, 3).");
  m.def(
      "kinetic_energy",
      [](const SharedMechanism& mech, py::object q, py::object p, py::object out) {
        return number(of_two(mech, q, "p", p, nq(mech), out, Shape{},
                             [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                               o[0][0] = kinetic_energy<T>(*mech, w, a[0], a[1]);
                             }));
      },
      arg("mechanism"), arg("q"), arg("p"), arg("out") = none,
      "T = p q'/2 at (q, p) [J]: a number, or (n,) of a batch.");
  m.def(
      "potential_energy",
      [](const SharedMechanism& mech, py::object q, py::object out) {
        return number(of_q(mech, q, out, Shape{},
                           [&]<class T>(Scratch&, Workspace<T>& w, const auto& a, const auto& o) {
                             o[0][0] = potential_energy<T>(*mech, w, a[0]);
                           }));
      },
      arg("mechanism"), arg("q"), arg("out") = none,
      "V = -sum m_i g c_i, zero at the world's origin [J]: a number, or (n,) of a batch. Joint "
      "springs are the system's.");
}

}  // namespace porthos::python
