// The derivative as part of the contract: of mechanisms and networks against duals, of parameters
// against 113 bits.
#include "phs/system/linearised.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "mechanics/derivatives/linearised_mechanism.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/momentum.h"
#include "phs/network/network.h"
#include "phs/scalars/lane.h"
#include "tests/support/random_tree.h"

namespace porthos::mechanics::linearised_test {
namespace {

using phs::Pack4;
using phs::Quad;
using Vec = std::vector<double>;

/// A tree with springs, damping and rotors at its joints of one freedom, and a welded body.
std::shared_ptr<Mechanism> tree(std::uint64_t seed, const std::string& root, bool aligned,
                                bool dampers = true) {
  test::RandomTree random(seed);
  random.rotor = 0.1;
  random.aligned = aligned;
  MechanismBuilder builder("random");
  const auto types = joint_type_names();
  for (int i = 0; i < 6; ++i) {
    const std::string parent =
        i == 0 ? "world" : "body_" + std::to_string(std::max(0, i - 1 - i % 2));
    const std::string type = i == 0   ? root
                             : i == 3 ? "fixed"
                             : i == 4 ? "revolute"
                                      : types[size_t(random.below(int(types.size())))];
    BodySpec b = random.body(i, parent, type);
    if (freedoms(type) == 1) {
      b.joint.stiffness = 1.5 + i;
      b.joint.damping = dampers ? 0.25 * (1 + i) : 0;
      b.joint.rest = 0.125;
    }
    builder.add(b);
  }
  return std::make_shared<Mechanism>(builder.gravity({1, 2, -9.81}).build());
}
Vec random_vector(size_t n, std::uint64_t seed) {
  test::RandomTree random(seed);
  Vec v(n);
  for (double& x : v) x = random.uniform(-1, 1);
  return v;
}
double apart(const Vec& a, const Vec& b) {
  double most = 0, size = 1;
  for (size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::fabs(a[i] - b[i]));
    size = std::max(size, std::fabs(b[i]));
  }
  return most / size;
}
template <class T>
std::vector<T> as(const Vec& x) {
  return {x.begin(), x.end()};
}

/// Field and both products against duals, in double and in lanes. @return the largest difference
template <class T>
double off_duals(const phs::Model& model, std::uint64_t seed) {
  const size_t n = size_t(model.description().nx);
  auto x = as<T>(random_vector(n, seed)), v = as<T>(random_vector(n, seed + 1)),
       l = as<T>(random_vector(n, seed + 2));
  if constexpr (phs::is_pack<T>)
    for (size_t i = 0; i < n; ++i) x[i].set(1, 0.5 + 0.25 * x[i][1]);
  const std::vector<T> turns(size_t(model.description().angle_count()), T(2 * M_PI));
  std::vector<Vec> results[2];
  int k = 0;
  for (auto& linear : {phs::linearise<T>(model), phs::linearise_by_duals<T>(model)}) {
    std::vector<T> out(n);
    linear->set_turn_angles(turns);
    const auto keep = [&] {
      for (int lane = 0; lane < phs::lanes<T>; ++lane) {
        results[k].emplace_back();
        for (const T& y : out) results[k].back().push_back(phs::lane_of(y, lane));
      }
    };
    linear->at(T(0.75), x, out);
    keep();
    linear->times(v, out);
    keep();
    linear->transpose_times(l, out);
    keep();
    ++k;
  }
  double worst = 0;
  for (size_t i = 0; i < results[0].size(); ++i)
    worst = std::max(worst, apart(results[0][i], results[1][i]));
  return worst;
}

TEST(Linearised, MechanismsAreTheirDuals) {
  double worst = 0;
  for (const auto& root : joint_type_names())
    for (std::uint64_t seed = 1; seed <= 3 && root != "fixed"; ++seed) {
      const MechanicalModel model(tree(seed, root, false));
      worst = std::max({worst, off_duals<double>(model, seed), off_duals<Pack4>(model, seed)});
    }
  std::printf("  off duals by %.1e of the largest   bound 1e-13\n", worst);
  EXPECT_LT(worst, 1e-13);
}

/// Springs, dry friction, a damper between two joints and a torque on plain joints; the free base
/// also gets a force, which turns with it: then the network falls back on duals.
std::shared_ptr<const phs::Model> network(bool force_on_base) {
  MechanismBuilder builder("arm");
  test::RandomTree random(3);
  builder.add(random.body(0, "world", "free"));
  for (int i = 1; i < 4; ++i)
    builder.add(random.body(i, "body_" + std::to_string(i - 1), i == 3 ? "prismatic" : "revolute"));
  auto arm = std::make_shared<MechanicalModel>(std::make_shared<Mechanism>(builder.build()));
  phs::Network net("net");
  net.add("arm", arm)
      .potential("hard", "arm.joint_1", phs::spring(3, 0.25, 8))
      .resist(
          "dry", "arm.joint_2.torque",
          phs::friction({.coulomb = 0.5, .breakaway = 0.75, .stribeck = 0.5, .smoothing = 0.25}))
      .source("push", "arm.joint_3.force", phs::sine(2, 0.5))
      .resist("between", {"arm.joint_1.torque", "arm.joint_2.torque"},
              phs::Matrix{{0.5, -0.25}, {-0.25, 0.5}});
  if (force_on_base) net.source("thrust", "arm.joint_0.wrench", phs::constant(1), 4);
  return net.build();
}

TEST(Linearised, NetworksAreTheirDuals) {
  for (const bool force : {false, true}) {
    const auto model = network(force);
    const double worst = std::max(off_duals<double>(*model, 7), off_duals<Pack4>(*model, 8));
    const bool own = !phs::linearise<double>(*model)->parameters().empty();
    std::printf("  %s: off duals by %.1e   bound 1e-13\n", own ? "own" : "by duals", worst);
    EXPECT_LT(worst, 1e-13);
    EXPECT_EQ(own, !force);
  }
}

/// Control: with the sign of damping wrong, the product is not the transpose.
TEST(Linearised, DampingEntersTheTransposeWithItsSign) {
  const auto damped = tree(2, "free", false), free = tree(2, "free", false, false);
  const MechanicalModel model(damped), undamped(free);
  const auto a = phs::linearise<double>(model), b = phs::linearise<double>(undamped);
  const size_t n = size_t(model.description().nx);
  const Vec x = random_vector(n, 1), v = random_vector(n, 2), l = random_vector(n, 3);
  Vec f(n), forth(n), back(n), without(n);
  a->at(0, x, f);
  b->at(0, x, f);
  a->times(v, forth);
  a->transpose_times(l, back);
  b->transpose_times(l, without);
  double right = 0, wrong = 0, moduli = 0;
  for (size_t i = 0; i < n; ++i) {
    right += l[i] * forth[i] - back[i] * v[i];
    wrong += l[i] * forth[i] - (2 * without[i] - back[i]) * v[i];
    moduli += std::fabs(l[i] * forth[i]);
  }
  std::printf("  off by %.1e of the moduli   bound 1e-14;  other sign %.1e\n",
              std::fabs(right) / moduli, std::fabs(wrong) / moduli);
  EXPECT_LT(std::fabs(right), 1e-14 * moduli);
  EXPECT_GT(std::fabs(wrong), 1e-5 * moduli);
}

/// λᵀf in 113 bits, of a mechanism with one number changed.
Quad scalar_field(const Mechanism& m, const Vec& x, const Vec& lambda) {
  const MechanicalModel model(std::make_shared<Mechanism>(m));
  const auto system = model.instantiate<Quad>();
  std::vector<Quad> f(x.size());
  system->field(Quad(0), as<Quad>(x), {}, f);
  Quad sum = 0;
  for (size_t i = 0; i < x.size(); ++i) sum += Quad(lambda[i]) * f[i];
  return sum;
}
/// Adds a mass, a first moment or an inertia, given in the frame of a link, to its node.
void add_inertial(Mechanism& m, const BodyFrame& link, int number, double by) {
  auto& nodes = const_cast<std::vector<Node>&>(m.nodes());
  RigidInertia<double>& I = nodes[size_t(link.node)].inertia;
  const Mat3<double>& R = link.pose.R;
  const Vec3d r = link.pose.r;
  const auto along = [&](int k) {
    return R * Vec3d{k == 0 ? by : 0, k == 1 ? by : 0, k == 2 ? by : 0};
  };
  const auto add_sym = [&](const Vec3d& a, const Vec3d& b) {  // a bᵀ + b aᵀ
    I.I = I.I + Sym3<double>{2 * a.x * b.x, a.x * b.y + a.y * b.x, a.x * b.z + a.z * b.x,
                             2 * a.y * b.y, a.y * b.z + a.z * b.y, 2 * a.z * b.z};
  };
  const auto add_unit = [&](double s) { I.I = I.I + Sym3<double>{s, 0, 0, s, 0, s}; };
  if (number == 0) {
    I.m += by;
    I.mc = I.mc + by * r;
    add_unit(by * dot(r, r));
    add_sym(-0.5 * by * r, r);
    for (int i = link.node; i >= 0; i = nodes[size_t(i)].parent) {
      double& mass = nodes[size_t(i)].subtree_mass;
      double s, e;
      phs::two_sum(mass, by, s, e);
      mass = s;
      nodes[size_t(i)].subtree_mass_low += e;
    }
  } else if (number < 4) {
    const Vec3d c = along(number - 1);
    I.mc = I.mc + c;
    add_unit(2 * dot(c, r));
    add_sym(-1.0 * c, r);
  } else {
    const int rows[6] = {0, 0, 0, 1, 1, 2}, columns[6] = {0, 1, 2, 1, 2, 2};
    const int a = rows[number - 4], b = columns[number - 4];
    const auto unit = [&](int k) {
      return R * Vec3d{k == 0 ? 1. : 0, k == 1 ? 1. : 0, k == 2 ? 1. : 0};
    };
    const Vec3d u = unit(a);
    add_sym((a == b ? 0.5 : 1.0) * by * u, unit(b));
  }
}

using Change = std::function<void(Mechanism&, double)>;
/// How each parameter is changed, in the order of Linearised::parameters().
std::vector<Change> changes(const Mechanism& m) {
  std::vector<Change> all;
  for (const BodyFrame& link : m.bodies())
    for (int number = 0; number < 10 && link.node >= 0; ++number)
      all.push_back([=](Mechanism& c, double by) { add_inertial(c, link, number, by); });
  for (const auto member : {&JointProperties::rotor_inertia, &JointProperties::stiffness,
                            &JointProperties::damping, &JointProperties::rest})
    for (size_t k = 0; k < m.joint_properties().size(); ++k)
      all.push_back([=](Mechanism& c, double by) {
        auto& j = const_cast<JointProperties&>(c.joint_properties()[k]);
        j.*member += by;
        if (member == &JointProperties::rotor_inertia)
          for (Node& node : const_cast<std::vector<Node>&>(c.nodes()))
            if (node.v == j.v) node.rotor_inertia += by;
      });
  return all;
}

/// The slopes of a number by all parameters: central differences in 113 bits, extrapolated once.
/// The mechanism holds doubles, so a change is off by the rounding of what it changes.
Vec differences(const Mechanism& m, double step, const std::function<Quad(const Mechanism&)>& of) {
  Vec slopes;
  for (const Change& change : changes(m)) {
    const auto difference = [&](double by) {
      Mechanism up = m, down = m;
      change(up, by);
      change(down, -by);
      return (of(up) - of(down)) / Quad(2 * by);
    };
    slopes.push_back(double((4 * difference(step / 2) - difference(step)) / 3));
  }
  return slopes;
}

double off_differences(const Mechanism& m, std::uint64_t seed, double step) {
  const size_t n = size_t(2 * m.nq());
  const Vec x = random_vector(n, seed), lambda = random_vector(n, seed + 1);
  const auto linear = linearise<double>(m);
  Vec f(n), out(n), gradient(linear->parameters().size(), 0.0);
  linear->at(0, x, f);
  linear->transpose_times(lambda, out);
  linear->add_gradient(1, gradient);
  const Vec expected =
      differences(m, step, [&](const Mechanism& c) { return scalar_field(c, x, lambda); });
  EXPECT_EQ(expected.size(), gradient.size());
  return apart(gradient, expected);
}

TEST(Linearised, ParametersAreThoseOf113Bits) {
  double aligned = 0, turned = 0;
  for (const std::string root : {"free", "revolute", "spherical", "planar"})
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      aligned = std::max(aligned, off_differences(*tree(seed, root, true), seed, 0x1p-14));
      turned = std::max(turned, off_differences(*tree(seed, root, false), seed, 0x1p-13));
    }
  std::printf("  off by %.1e, in turned frames %.1e of the largest   bounds 1e-10, 1e-7\n", aligned,
              turned);
  EXPECT_LT(aligned, 1e-10);
  // Of the differences: roundings of what changes, and step⁴, both amplified where a body's inertia
  // is small. The random trees of two compilers differ: 7e-11 (GCC), 4e-9 (Clang).
  EXPECT_LT(turned, 1e-7);
}

TEST(Linearised, NetworkParametersAreFactorsOfForces) {
  const auto model = network(false);
  const auto linear = phs::linearise<double>(*model);
  const size_t n = size_t(model->description().nx);
  const Vec x = random_vector(n, 1), lambda = random_vector(n, 2);
  Vec f(n), out(n), gradient(linear->parameters().size(), 0.0);
  linear->at(0.5, x, f);
  linear->transpose_times(lambda, out);
  linear->add_gradient(1, gradient);
  const auto number = [&](const std::string& name) {
    const auto& names = linear->parameters();
    return gradient[size_t(std::find(names.begin(), names.end(), name) - names.begin())];
  };
  const size_t q = 8, p = size_t(n / 2) + q;  // of the second revolute joint
  const double z = x[q - 1] - 0.25;
  EXPECT_NEAR(number("hard.factor"), -lambda[p - 1] * (3 * z + 8 * z * z * z), 1e-14);
  EXPECT_NEAR(number("push.factor"), lambda[p + 1] * 2 * std::sin(M_PI / 2), 1e-14);
  const auto law =
      phs::friction({.coulomb = 0.5, .breakaway = 0.75, .stribeck = 0.5, .smoothing = 0.25});
  EXPECT_NEAR(number("dry.factor"), -lambda[p] * (*law)(f[q]), 1e-14);
}

TEST(Linearised, EnergyByParametersIsThatOf113Bits) {
  for (const std::string root : {"free", "spherical", "revolute"}) {
    const auto m = tree(4, root, true);
    const Vec x = random_vector(size_t(2 * m->nq()), 1);
    const Vec expected = differences(*m, 0x1p-14, [&](const Mechanism& c) {
      const MechanicalModel model(std::make_shared<const Mechanism>(c));
      return model.make_system<Quad>()->hamiltonian(as<Quad>(x));
    });
    const Vec mine = energy_by_parameters(*m, x, {});
    ASSERT_EQ(mine.size(), expected.size());
    std::printf("  %-9s off by %.1e of the largest   bound 1e-10\n", root.c_str(),
                apart(mine, expected));
    EXPECT_LT(apart(mine, expected), 1e-10);
  }
}

/// λ·x(q, v, θ) in 113 bits.
Quad scalar_start(const Mechanism& m, const std::vector<Quad>& q, const std::vector<Quad>& v,
                  const Vec& lambda) {
  Workspace<Quad> w(m);
  std::vector<Quad> p(q.size());
  momenta_from_rates<Quad>(m, w, q, v, p);
  Quad sum = 0;
  for (size_t i = 0; i < q.size(); ++i)
    sum += Quad(lambda[i]) * q[i] + Quad(lambda[q.size() + i]) * p[i];
  return sum;
}

TEST(Linearised, StartInRatesIsThatOf113Bits) {
  for (const std::string root : {"free", "spherical"}) {
    const auto m = tree(4, root, false);
    const size_t nq = size_t(m->nq()), nv = size_t(m->nv());
    const Vec q = random_vector(nq, 1), v = random_vector(nv, 2), lambda = random_vector(2 * nq, 3);
    const auto g = start_in_rates(*m, q, v, lambda);
    const auto difference = [&](const auto& change) {
      const double by = 0x1p-20;
      Mechanism up = *m, down = *m;
      auto q1 = as<Quad>(q), q2 = q1, v1 = as<Quad>(v), v2 = v1;
      change(up, q1, v1, by);
      change(down, q2, v2, -by);
      return double((scalar_start(up, q1, v1, lambda) - scalar_start(down, q2, v2, lambda)) /
                    Quad(2 * by));
    };
    using Quads = std::vector<Quad>;
    Vec expected_q, expected_v, expected;
    for (size_t k = 0; k < nq; ++k)
      expected_q.push_back(
          difference([&](Mechanism&, Quads& x, Quads&, double by) { x[k] += Quad(by); }));
    for (size_t k = 0; k < nv; ++k)
      expected_v.push_back(
          difference([&](Mechanism&, Quads&, Quads& x, double by) { x[k] += Quad(by); }));
    for (const BodyFrame& link : m->bodies())
      for (int number = 0; number < 10 && link.node >= 0; ++number)
        expected.push_back(difference(
            [&](Mechanism& c, Quads&, Quads&, double by) { add_inertial(c, link, number, by); }));
    const Vec inertial(g.parameters.begin(),
                       g.parameters.begin() + std::ptrdiff_t(expected.size()));
    std::printf("  off by %.1e, %.1e, %.1e of the largest   bounds 1e-10, 1e-10, 1e-9\n",
                apart(g.q, expected_q), apart(g.v, expected_v), apart(inertial, expected));
    EXPECT_LT(apart(g.q, expected_q), 1e-10);
    EXPECT_LT(apart(g.v, expected_v), 1e-10);
    EXPECT_LT(apart(inertial, expected), 1e-9);
  }
}

TEST(Linearised, RefusesConstraints) {
  ConstraintSpec spec;
  const auto m = tree(1, "revolute", false);
  spec.couplings.push_back({.name = "gear", .terms = {{"joint_0", 1}, {"joint_4", 2}}});
  const MechanicalModel model(m, {}, spec);
  try {
    phs::linearise<double>(model);
    FAIL();
  } catch (const InvalidArgument& e) {
    EXPECT_NE(std::string(e.what()).find("a derivative takes no constraints"), std::string::npos);
  }
}

}  // namespace
}  // namespace porthos::mechanics::linearised_test
