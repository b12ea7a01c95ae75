// Rotor (armature) inertia: every algorithm against a dense mass matrix Σ Jᵀ I J + diag(rotor), J
// by duals of the poses.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "integrators/core/integrator.h"
#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"
#include "mechanics/urdf.h"
#include "phs/system/check.h"
#include "tests/support/frame_jacobian.h"
#include "tests/support/random_tree.h"

namespace porthos::mechanics::rotor_test {
namespace {

using Vec = std::vector<double>;
constexpr double rotor = 3;  // of the size of the trees' own inertias about their joints

double dot(const Vec& a, const Vec& b) {
  double s = 0;
  for (size_t i = 0; i < a.size(); ++i) s += a[i] * b[i];
  return s;
}
/// |a - b| over |b| (2-norms).
double relative(const Vec& a, const Vec& b) {
  Vec d = a;
  for (size_t i = 0; i < a.size(); ++i) d[i] -= b[i];
  return std::sqrt(dot(d, d) / dot(b, b));
}
Vec times(const Vec& M, const Vec& v) {
  Vec r(v.size(), 0.0);
  for (size_t j = 0; j < v.size(); ++j)
    for (size_t i = 0; i < v.size(); ++i) r[i] += M[i + v.size() * j] * v[j];
  return r;
}

/// Σ Jᵀ I J over the moving bodies, plus the rotors where asked.
Vec dense_mass_matrix(const Mechanism& m, const Vec& q, bool rotors) {
  const size_t nv = size_t(m.nv());
  Vec M(nv * nv, 0.0);
  for (size_t i = 0; i < m.nodes().size(); ++i) {
    const Vec J = test::frame_jacobian(m, q, int(i), {Mat3<double>::identity(), {0, 0, 0}});
    const auto twist = [&](size_t k) {
      Motion<double> t;
      for (int r = 0; r < 6; ++r) t[r] = J[size_t(r) + 6 * k];
      return t;
    };
    for (size_t k = 0; k < nv; ++k) {
      const Force<double> h = m.nodes()[i].inertia * twist(k);
      for (size_t l = 0; l < nv; ++l) M[l + nv * k] += mechanics::dot(twist(l), h);
    }
    if (rotors) M[size_t(m.nodes()[i].v) * (nv + 1)] += m.nodes()[i].rotor_inertia;
  }
  return M;
}

/// A tree with rotors and the same without.
struct Twins {
  std::shared_ptr<const Mechanism> with, without;
};
Twins twins(std::uint64_t seed, const char* root, Vec3d gravity = {0, 0, -9.81}) {
  test::RandomTree a(seed), b(seed);
  a.rotor = rotor;
  return {a.tree(8, root, "", gravity), b.tree(8, root, "", gravity)};
}
int rotors_in(const Mechanism& m) {
  int n = 0;
  for (const auto& j : m.joint_properties()) n += j.rotor_inertia > 0;
  return n;
}

TEST(Rotor, EveryAlgorithmAgreesWithTheDenseMassMatrix) {
  struct {
    double crba = 0, momenta = 0, rates = 0, energy = 0, rnea = 0, aba = 0;
  } worst;
  double control = 1;
  int rotors = 0;
  for (const char* root : {"free", "spherical", "revolute", "prismatic", "helical"})
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const auto [m, plain] = twins(seed, root);
      test::RandomTree r(seed + 1000);
      Workspace<double> w(*m);
      const size_t nv = size_t(m->nv()), nq = size_t(m->nq());
      const Vec q = r.q(*m), v = r.numbers(m->nv(), 2), vdot = r.numbers(m->nv(), 5);
      const Vec dense = dense_mass_matrix(*m, q, true), mu = times(dense, v);
      rotors += rotors_in(*m);
      const auto note = [](double& most, double e) { most = std::max(most, e); };

      Vec M(nv * nv), p(nq), tau(nv), bias(nv), back(nv);
      crba<double>(*m, w, q, M);
      note(worst.crba, relative(M, dense));
      if (rotors_in(*m)) control = std::min(control, relative(M, dense_mass_matrix(*m, q, false)));

      momenta_from_rates<double>(*m, w, q, v, p);
      rates_from_momenta<double>(*m, w, q, p);
      note(worst.momenta, relative(w.mu, mu));
      note(worst.rates, relative(w.rate, v));
      const double T = kinetic_energy<double>(*m, w, q, p);
      note(worst.energy, std::fabs(T / (0.5 * dot(v, mu)) - 1));

      // What depends on the velocity is the same without rotors: their inertia is constant.
      rnea<double>(*plain, w, q, v, {}, {}, bias);
      rnea<double>(*m, w, q, v, vdot, {}, tau);
      Vec expected = times(dense, vdot);
      for (size_t i = 0; i < nv; ++i) expected[i] += bias[i];
      note(worst.rnea, relative(tau, expected));
      aba<double>(*m, w, q, v, {tau, {}}, back);
      note(worst.aba, relative(back, vdot));
    }
  std::printf(
      "  %d rotors: crba %.1e  momenta %.1e  rates %.1e  energy %.1e  rnea %.1e  aba %.1e   bound "
      "1e-12;  mass matrix without the rotors: off by %.1e at least\n",
      rotors, worst.crba, worst.momenta, worst.rates, worst.energy, worst.rnea, worst.aba, control);
  for (double e : {worst.crba, worst.momenta, worst.rates, worst.energy, worst.rnea, worst.aba})
    EXPECT_LE(e, 1e-12);
  EXPECT_GT(control, 1e-4);
  EXPECT_GT(rotors, 100);
}

// The gradient against duals of the H checked above, the field, the balance and the invariants.
TEST(Rotor, AxiomsHold) {
  for (const char* root : {"free", "spherical", "revolute"})
    for (const auto gravity : {Vec3d{0, 0, 0}, Vec3d{1, 2, -9}})
      for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        const MechanicalModel model(twins(seed, root, gravity).with);
        phs::CheckOptions few;
        few.samples = 4;
        const auto report = phs::check(model, few);
        EXPECT_TRUE(report.holds()) << root << " " << seed << "\n" << report.text();
      }
}

// Where the joint is all there is, the rotor is one more moment of inertia about it: the same
// motion bit for bit.
TEST(Rotor, OnAWheelItIsTheWheelsOwnInertia) {
  const auto wheel = [](double inertia, double rotor_inertia) {
    BodySpec b;
    b.name = "wheel";
    b.parent = "world";
    b.joint.type = "revolute";
    b.joint.rotor_inertia = rotor_inertia;
    b.mass = {2, {0, 0, 0}, {1, 0, 0, 1, 0, inertia}};
    return MechanismBuilder("wheel").add(b).build();
  };
  for (const auto& m : {wheel(1.25, 0.5), wheel(1.75, 0)}) {
    Workspace<double> w(m);
    const Vec q{0.3}, p{3.5};
    rates_from_momenta<double>(m, w, q, p);
    EXPECT_EQ(w.rate[0], 2.0);
  }
}

/// Momentum of the bodies one by one, about the world's origin, [angular; linear]; `spin`: that of
/// the rotors about their joints' axes besides.
template <class T>
std::vector<T> momentum_of_bodies(const Mechanism& m, std::span<const T> x, bool spin) {
  Workspace<T> w(m);
  const size_t nq = size_t(m.nq());
  rates_from_momenta<T>(m, w, x.first(nq), x.subspan(nq));
  const auto V = w.V;
  const auto rate = w.rate;
  std::vector<Transform<T>> pose(m.nodes().size());
  forward_kinematics<T>(m, w, x.first(nq), pose);
  std::vector<T> sum(6, T(0.0));
  for (size_t i = 0; i < pose.size(); ++i) {
    const Node& n = m.nodes()[i];
    const RigidInertia<T> I{T(n.inertia.m), Vec3<T>(n.inertia.mc), Sym3<T>(n.inertia.I)};
    Force<T> h = pose[i].to_parent(I * V[i]);
    if (spin) h.n += (T(n.rotor_inertia) * rate[size_t(n.v)]) * pose[i].R.z;
    for (int k = 0; k < 6; ++k) sum[size_t(k)] = sum[size_t(k)] + h[k];
  }
  return sum;
}

// Free-floating: the declared momenta are those of the bodies, and kept exactly. With the rotors'
// spin they are not.
TEST(Rotor, MomentumOfTheBodiesIsKept) {
  using phs::Dual;
  double same = 0, kept = 0, with_spin = 1;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    test::RandomTree r(seed);
    r.rotor = rotor;
    const auto m = r.tree(8, "free", "revolute", {0, 0, 0});
    const MechanicalModel model(m);
    const Vec x = model.state(r.q(*m), r.numbers(m->nv(), 2));
    const auto system = model.instantiate<double>();
    Vec declared(size_t(model.description().invariant_count())), dx(x.size());
    system->invariants(x, declared);
    const Vec bodies = momentum_of_bodies<double>(*m, x, false);
    const Vec read{declared[3], declared[4], declared[5], declared[0], declared[1], declared[2]};
    same = std::max(same, relative(read, bodies));

    system->field(0, x, {}, dx);
    std::vector<Dual> along(x.size());
    for (size_t i = 0; i < x.size(); ++i) along[i] = Dual(x[i], dx[i]);
    const auto change = [&](bool spin) {  // |d/dt| of the six components, relative
      Vec h, rate;
      for (const Dual& c : momentum_of_bodies<Dual>(*m, along, spin)) {
        h.push_back(c.v);
        rate.push_back(c.d);
      }
      return std::sqrt(dot(rate, rate) / dot(h, h));
    };
    kept = std::max(kept, change(false));
    with_spin = std::min(with_spin, change(true));
  }
  std::printf(
      "  declared momentum = that of the bodies to %.1e  bound 1e-13;  its rate %.1e /s  bound "
      "1e-12;  rate with the rotors' spin %.1e /s at least\n",
      same, kept, with_spin);
  EXPECT_LE(same, 1e-13);
  EXPECT_LE(kept, 1e-12);
  EXPECT_GT(with_spin, 1e-3);
}

TEST(Rotor, ARunKeepsEnergyAndMomentum) {
  test::RandomTree r(7);
  r.rotor = rotor;
  const auto m = r.tree(5, "free", "revolute", {0, 0, 0});
  const MechanicalModel model(m);
  const auto system = model.instantiate<double>();
  phs::State s(model.description(), model.state(r.q(*m), r.numbers(m->nv(), 1)));
  const auto gauge = [&](double& H) {
    Vec values(size_t(model.description().invariant_count()));
    H = system->hamiltonian(s.x);
    system->invariants(s.x, values);
    return values;
  };
  double H0, H, turned = 0;
  const Vec before = gauge(H0);
  const auto method = integrators::make_integrator("gauss8", model, 0.01);
  const Vec start = s.x;
  for (int k = 0; k < 2000; ++k) ASSERT_EQ(method->step(s), integrators::Outcome::ok);
  for (size_t i = 0; i < start.size(); ++i) turned = std::max(turned, std::fabs(s.x[i] - start[i]));
  const Vec after = gauge(H);
  const double momentum = relative(after, before), energy = std::fabs(H / H0 - 1);
  std::printf("  20 s: invariants %.1e  bound 1e-13   energy %.1e  bound 1e-12   moved by %.1f\n",
              momentum, energy, turned);
  EXPECT_LE(momentum, 1e-13);
  EXPECT_LE(energy, 1e-12);
  EXPECT_GT(turned, 1);
}

template <class F>
std::string message(F&& f) {
  try {
    f();
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "accepted";
}
BodySpec body(const std::string& type, double rotor_inertia) {
  BodySpec b;
  b.name = "arm";
  b.parent = "world";
  b.joint.type = type;
  b.joint.rotor_inertia = rotor_inertia;
  b.mass = {2, {0.1, 0.2, 0.3}, {0.3, 0, 0, 0.4, 0, 0.5}};
  return b;
}

TEST(Rotor, RefusesWhatHasNoMeaning) {
  const auto refusal = [](BodySpec b) {
    return message([&] { MechanismBuilder("test").add(b).build(); });
  };
  EXPECT_EQ(refusal(body("revolute", 0.1)), "accepted");
  EXPECT_EQ(refusal(body("revolute", -1)),
            "joint 'arm': rotor inertia is -1, expected a finite number >= 0");
  EXPECT_EQ(refusal(body("revolute", std::nan(""))),
            "joint 'arm': rotor inertia is nan, expected a finite number >= 0");
  EXPECT_EQ(
      refusal(body("universal", 1)),
      "joint 'arm': a rotor inertia needs a joint of one degree of freedom, 'universal' has 2");
  EXPECT_EQ(refusal(body("fixed", 1)),
            "joint 'arm': a rotor inertia needs a joint of one degree of freedom, 'fixed' has 0");
  BodySpec frame = body("revolute", 1);  // the rotor gives the joint inertia, but nothing has mass
  frame.mass = {};
  EXPECT_EQ(refusal(frame), "mechanism 'test' has no mass: every moving body is massless");
}

TEST(Rotor, IsGivenToUrdfJointsByName) {
  const std::string text = R"(<robot name="r"><link name="base"/><link name="arm"><inertial>
    <mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="shoulder" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>)";
  UrdfOptions o;
  o.rotor_inertia = {{"shoulder", 0.25}};
  const auto m = parse_urdf(text, "r.urdf", o).mechanism;
  Workspace<double> w(m);
  Vec M(1);
  crba<double>(m, w, m.neutral(), M);
  EXPECT_EQ(M[0], 1.25);
  ASSERT_EQ(m.joint_properties().size(), 1u);
  EXPECT_EQ(m.joint_properties()[0].rotor_inertia, 0.25);
  o.rotor_inertia = {{"elbow", 0.25}};
  EXPECT_EQ(message([&] { parse_urdf(text, "r.urdf", o); }),
            "r.urdf: rotor inertia: 'elbow' is not a joint of this file");
}

}  // namespace
}  // namespace porthos::mechanics::rotor_test
