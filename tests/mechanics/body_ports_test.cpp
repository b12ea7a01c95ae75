// Body ports: wrench in, twist out, against Jacobians by duals of the poses.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "mechanics/mechanical_model.h"
#include "phs/system/check.h"
#include "tests/support/frame_jacobian.h"
#include "tests/support/random_tree.h"

namespace porthos::mechanics::body_ports_test {
namespace {

using Vec = std::vector<double>;

template <class T>
T dot(const std::vector<T>& a, const std::vector<T>& b) {
  T s(0.0);
  for (size_t i = 0; i < a.size(); ++i) s = s + a[i] * b[i];
  return s;
}
double norm(const Vec& a) { return std::sqrt(dot(a, a)); }
double relative(const Vec& a, const Vec& b) {
  Vec d = a;
  for (size_t i = 0; i < a.size(); ++i) d[i] -= b[i];
  return norm(d) / norm(b);
}

/// A random tree with a port on each moving link, those on fixed joints too.
struct Case {
  test::RandomTree r;
  std::shared_ptr<const Mechanism> m;
  std::vector<BodyPort> ports;
  std::shared_ptr<const MechanicalModel> model;
  int fixed_links = 0;

  Case(std::uint64_t seed, const char* root, Vec3d gravity = {0, 0, -9.81}) : r(seed) {
    r.rotor = seed % 2;
    m = r.tree(9, root, "", gravity);
    for (const auto& b : m->bodies())
      if (b.node >= 0) ports.push_back({"port_" + b.name, b.name, r.vector(1)});
    fixed_links = int(ports.size()) - int(m->nodes().size());
    model = std::make_shared<MechanicalModel>(m, ports);
  }
  /// On the unit sphere and off it.
  Vec state() {
    auto x = model->state(r.q(*m), r.numbers(m->nv(), 2));
    for (auto& c : x) c += 0.1 * r.uniform(-1, 1);
    return x;
  }
  Pose frame(const BodyPort& p) const {
    return m->body(p.link).pose * Pose{Mat3<double>::identity(), p.position};
  }
};
constexpr const char* roots[] = {"free",      "spherical",   "revolute",
                                 "prismatic", "cylindrical", "fixed"};

TEST(BodyPorts, AreTheJacobianAndItsTranspose) {
  double input = 0, output = 0, field = 0, at_link_origin = 1, in_node_axes = 1;
  size_t count = 0;
  for (const char* root : roots)
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      Case c(seed, root);
      const auto system = c.model->instantiate<double>();
      const size_t nv = size_t(c.m->nv()), nq = size_t(c.m->nq());
      const Vec x = c.state(), q(x.begin(), x.begin() + long(nq));
      const Vec u = c.r.numbers(c.model->description().nu, 3), e = c.r.numbers(int(2 * nq));
      ASSERT_EQ(u.size(), nv + 6 * c.ports.size());
      Vec Gu(2 * nq), y(u.size()), forces(u.size(), 0.0), expected(2 * nq), twists;
      std::copy_n(u.begin(), nv, forces.begin());
      system->output(x, e, y);
      const Vec rates(y.begin(), y.begin() + long(nv));
      Vec moved_forces = forces, turned_forces = forces;
      for (size_t k = 0; k < c.ports.size(); ++k) {
        const auto& b = c.m->body(c.ports[k].link);
        const auto J = test::frame_jacobian(*c.m, q, b.node, c.frame(c.ports[k]));
        const auto J_link = test::frame_jacobian(*c.m, q, b.node, b.pose);
        const auto J_node = test::frame_jacobian(*c.m, q, b.node,
                                                 {Mat3<double>::identity(), c.frame(c.ports[k]).r});
        for (size_t row = 0; row < 6; ++row) {
          double twist = 0;
          for (size_t j = 0; j < nv; ++j) {
            const double w = u[nv + 6 * k + row];
            twist += J[row + 6 * j] * rates[j];
            forces[j] += J[row + 6 * j] * w;
            moved_forces[j] += J_link[row + 6 * j] * w;
            turned_forces[j] += J_node[row + 6 * j] * w;
          }
          twists.push_back(twist);
        }
      }
      system->apply_input(x, u, Gu);
      system->apply_input(x, forces, expected);  // joint forces alone
      input = std::max(input, relative(Gu, expected));
      output = std::max(output, relative(Vec(y.begin() + long(nv), y.end()), twists));
      system->apply_input(x, moved_forces, expected);
      at_link_origin = std::min(at_link_origin, relative(Gu, expected));
      system->apply_input(x, turned_forces, expected);
      in_node_axes = std::min(in_node_axes, relative(Gu, expected));

      Vec driven(2 * nq), free(2 * nq), difference(2 * nq);
      system->field(0, x, u, driven);
      system->field(0, x, {}, free);
      for (size_t i = 0; i < 2 * nq; ++i) difference[i] = driven[i] - free[i] - Gu[i];
      field = std::max(field, norm(difference) / (norm(free) + norm(Gu)));
      count += c.ports.size();
    }
  std::printf(
      "  %zu ports: Gu %.1e  y %.1e  field %.1e   bound 1e-13;  about the link's origin %.1e, in "
      "the node's axes %.1e, at least\n",
      count, input, output, field, at_link_origin, in_node_axes);
  EXPECT_LE(input, 1e-13);
  EXPECT_LE(output, 1e-13);
  EXPECT_LE(field, 1e-13);
  EXPECT_GT(at_link_origin, 1e-2);
  EXPECT_GT(in_node_axes, 1e-2);
}

/// |eᵀ(G u) - (Gᵀe)ᵀu| over the sizes, for e that is no gradient; `other`: output of another model.
template <class T>
double pairing(Case& c, const MechanicalModel& other, const Vec& x0, const Vec& u0, const Vec& e0) {
  const std::vector<T> x(x0.begin(), x0.end()), u(u0.begin(), u0.end()), e(e0.begin(), e0.end());
  std::vector<T> Gu(x.size()), y(u.size());
  c.model->instantiate<T>()->apply_input(x, u, Gu);
  other.instantiate<T>()->output(x, e, y);
  const T size = phs::sqrt(dot(e, e) * dot(Gu, Gu)) + phs::sqrt(dot(y, y) * dot(u, u));
  return double(phs::abs((dot(e, Gu) - dot(y, u)) / size));
}

TEST(BodyPorts, InputAndOutputAreTransposesForAnyE) {
  double in_double = 0, in_quad = 0, control = 0;
  for (const char* root : roots)
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      Case c(seed, root);
      const Vec x = c.state(), u = c.r.numbers(c.model->description().nu);
      const Vec e = c.r.numbers(c.model->description().nx);
      in_double = std::max(in_double, pairing<double>(c, *c.model, x, u, e));
      in_quad = std::max(in_quad, pairing<phs::Quad>(c, *c.model, x, u, e));
      auto shifted = c.ports;
      shifted[0].position.y += 1e-6;
      control = std::max(control, pairing<double>(c, MechanicalModel(c.m, shifted), x, u, e));
    }
  std::printf(
      "  double %.1e  bound 1e-15   113 bits %.1e  bound 1e-33;  one port off by 1e-6 m: %.1e\n",
      in_double, in_quad, control);
  EXPECT_LE(in_double, 1e-15);
  EXPECT_LE(in_quad, 1e-33);
  EXPECT_GT(control, 1e-9);
}

// Newton and Euler: in free space a wrench changes the momentum of the whole by itself, taken about
// the world's origin.
TEST(BodyPorts, AWrenchIsTheRateOfMomentum) {
  using phs::Dual;
  double worst = 0, in_world_axes = 1;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Case c(seed, "free", {0, 0, 0});
    const auto system = c.model->instantiate<double>();
    const auto dual = c.model->instantiate<Dual>();
    const size_t nq = size_t(c.m->nq()), nv = size_t(c.m->nv());
    const Vec x = c.model->state(c.r.q(*c.m), c.r.numbers(c.m->nv()));
    std::vector<Pose> pose(c.m->nodes().size());
    Workspace<double> w(*c.m);
    forward_kinematics<double>(*c.m, w, std::span(x).first(nq), pose);
    for (size_t k = 0; k < c.ports.size(); ++k) {
      Vec u(size_t(c.model->description().nu), 0.0), dx(x.size());
      const Force<double> own{c.r.vector(1), c.r.vector(1)};
      for (int i = 0; i < 6; ++i) u[nv + 6 * k + size_t(i)] = own[i];
      system->field(0, x, u, dx);
      std::vector<Dual> along(x.size()), momentum(size_t(c.model->description().invariant_count()));
      for (size_t i = 0; i < x.size(); ++i) along[i] = Dual(x[i], dx[i]);
      dual->invariants(along, momentum);
      Vec rate;
      for (size_t i = 0; i < 6; ++i) rate.push_back(momentum[i].d);  // linear, angular
      const auto X = pose[size_t(c.m->body(c.ports[k].link).node)] * c.frame(c.ports[k]);
      const auto compare = [&](const Force<double>& h) {
        return relative(rate, {h.f.x, h.f.y, h.f.z, h.n.x, h.n.y, h.n.z});
      };
      worst = std::max(worst, compare(X.to_parent(own)));
      in_world_axes =
          std::min(in_world_axes, compare(Pose{Mat3<double>::identity(), X.r}.to_parent(own)));
    }
  }
  std::printf("  worst %.1e  bound 1e-12;  wrench taken in world axes: %.1e at least\n", worst,
              in_world_axes);
  EXPECT_LE(worst, 1e-12);
  EXPECT_GT(in_world_axes, 1e-2);
}

TEST(BodyPorts, AxiomsHold) {
  for (const char* root : roots)
    for (const auto gravity : {Vec3d{0, 0, 0}, Vec3d{1, 2, -9}}) {
      const Case c(11, root, gravity);
      phs::CheckOptions few;
      few.samples = 8;
      const auto report = phs::check(*c.model, few);
      EXPECT_TRUE(report.holds()) << root << "\n" << report.text();
    }
}

// The free joint's own port and a body port on the same link: the same numbers, bit for bit.
TEST(BodyPorts, OnTheBaseIsTheBaseJointsPort) {
  test::RandomTree r(3);
  const auto m = r.tree(6, "free");
  const MechanicalModel model(m, {{"base", "body_0", {0, 0, 0}}});
  const auto& d = model.description();
  ASSERT_EQ(d.ports.front().name, "joint_0.wrench");
  ASSERT_EQ(d.ports.front().size, 6);
  const auto& port = d.ports.back();
  EXPECT_EQ(port.name, "base.wrench");
  EXPECT_EQ(port.kind, phs::PortKind::effort_in);
  EXPECT_EQ(port.size, 6);
  EXPECT_EQ(port.at, m->nv());
  EXPECT_EQ(port.input_unit, "N m; N");
  EXPECT_EQ(port.output_unit, "rad/s; m/s");
  const auto system = model.instantiate<double>();
  const Vec x = model.state(r.q(*m), r.numbers(m->nv())), w = r.numbers(6);
  Vec by_joint(size_t(d.nu), 0.0), by_body = by_joint, a(x.size()), b(x.size()), y(by_joint.size());
  std::copy(w.begin(), w.end(), by_joint.begin() + d.ports.front().at);
  std::copy(w.begin(), w.end(), by_body.begin() + port.at);
  system->apply_input(x, by_joint, a);
  system->apply_input(x, by_body, b);
  EXPECT_EQ(a, b);
  EXPECT_NE(a, Vec(x.size(), 0.0));
  system->output(x, r.numbers(d.nx), y);
  for (int k = 0; k < 6; ++k) EXPECT_EQ(y[size_t(k)], y[size_t(port.at + k)]);
}

// Ports cost the field nothing where u is empty, and change no bit of it.
TEST(BodyPorts, LeaveTheUndrivenFieldAlone) {
  Case c(5, "free");
  const MechanicalModel bare(c.m);
  const Vec x = c.state();
  Vec a(x.size()), b(x.size());
  c.model->instantiate<double>()->field(0, x, {}, a);
  bare.instantiate<double>()->field(0, x, {}, b);
  EXPECT_EQ(a, b);
  EXPECT_EQ(bare.description().nu, c.m->nv());
}

// A hand on the tool, which a fixed joint holds half a metre down the arm: τ about the shoulder is
// r × F.
TEST(BodyPorts, OnALinkOfAFixedJoint) {
  MechanismBuilder builder("arm");
  BodySpec arm, tool;
  arm.name = "arm";
  arm.parent = "world";
  arm.joint.type = "revolute";
  arm.mass = {2, {0.1, 0.2, 0.3}, {0.3, 0, 0, 0.4, 0, 0.5}};
  tool.name = "tool";
  tool.parent = "arm";
  tool.joint.name = "mount";
  tool.placement = {{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}}, {0.5, 0, 0}};  // turned by 90° about z
  const auto m = std::make_shared<Mechanism>(builder.add(arm).add(tool).build());
  const MechanicalModel model(m, {{"hand", "tool", {0, -0.25, 0}}});  // 0.75 m along the arm's x
  const auto system = model.instantiate<double>();
  const Vec x{0.7, 0.0}, e{0, 2};
  Vec Gu(2), y(7);
  system->apply_input(x, Vec{0, 0, 0, 0, 3, 0, 0}, Gu);  // 3 N along the tool's x, the arm's y
  EXPECT_EQ(Gu, (Vec{0, 3 * 0.75}));
  system->output(x, e, y);
  EXPECT_EQ(y, (Vec{2, 0, 0, 2, 2 * 0.75, 0, 0}));
}

TEST(BodyPorts, RefusesByName) {
  MechanismBuilder builder("arm");
  BodySpec stand, arm;
  stand.name = "stand";
  stand.parent = "world";
  arm.name = "arm";
  arm.parent = "stand";
  arm.joint.type = "free";
  arm.joint.name = "base";
  arm.mass = {2, {0.1, 0.2, 0.3}, {0.3, 0, 0, 0.4, 0, 0.5}};
  const auto m = std::make_shared<Mechanism>(builder.add(stand).add(arm).build());
  const auto refusal = [&](const std::vector<BodyPort>& ports) -> std::string {
    try {
      MechanicalModel model(m, ports);
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refusal({{"hand", "arm", {}}, {"foot", "arm", {}}}), "accepted");
  EXPECT_EQ(refusal({{"hand", "leg", {}}}),
            "body port 'hand': there is no link 'leg'; known: stand, arm");
  EXPECT_EQ(refusal({{"hand", "stand", {}}}),
            "body port 'hand': its link 'stand' is fixed to the world and never moves");
  EXPECT_EQ(refusal({{"", "arm", {}}}), "a body port on 'arm' has no name");
  EXPECT_EQ(refusal({{"hand", "arm", {0, NAN, 0}}}),
            "body port 'hand': its position is not finite");
  EXPECT_EQ(refusal({{"hand", "arm", {}}, {"hand", "arm", {}}}),
            "body port 'hand': there is already a port 'hand.wrench'");
  EXPECT_EQ(refusal({{"base", "arm", {}}}),
            "body port 'base': there is already a port 'base.wrench'");
}

}  // namespace
}  // namespace porthos::mechanics::body_ports_test
