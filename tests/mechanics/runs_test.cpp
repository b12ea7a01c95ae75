// The sweeps take bodies in runs, within which inertias, biases and twists stay in registers: the
// bits are those of a sweep that takes body by body through the workspace.
#include <gtest/gtest.h>

#include <cstring>

#include "mechanics/aba.h"
#include "mechanics/hamiltonian_field-inl.h"
#include "mechanics/rnea.h"
#include "tests/support/random_tree.h"

namespace porthos::mechanics::runs_test {
namespace {

using Model = std::shared_ptr<const Mechanism>;
using Vec = std::vector<double>;

/// Chains of two to four bodies of one joint type, with a rotor here and there, and side branches.
Model tree() {
  MechanismBuilder b("runs");
  const char* types[] = {"free",      "revolute",  "revolute",    "revolute",  "revolute",
                         "prismatic", "prismatic", "cylindrical", "spherical", "spherical",
                         "revolute",  "revolute",  "revolute",    "helical",   "helical"};
  const int parents[] = {-1, 0, 1, 2, 3, 4, 5, 6, 7, 8, 2, 10, 2, 12, 13};
  for (int i = 0; i < 15; ++i) {
    BodySpec s;
    s.name = "b" + std::to_string(i);
    s.parent = parents[i] < 0 ? "world" : "b" + std::to_string(parents[i]);
    s.joint.type = types[i];
    s.joint.axis = i % 2 ? Vec3d{0, 0.6, 0.8} : Vec3d{1, 0, 0};
    if (i == 3 || i == 6) s.joint.rotor_inertia = 0.3;
    if (s.joint.type == "helical") s.joint.pitch = 0.1;
    s.placement.r = {0.3, 0.1 * i, -0.2};
    s.mass = {1.0 + i, {0.1, -0.05, 0.02 * i}, {0.5, 0.01, 0, 0.6, 0.02, 0.7}};
    b.add(s);
  }
  return std::make_shared<Mechanism>(b.build());
}

struct Taken {
  size_t begin, end;
  bool without_rotor;
  bool operator==(const Taken&) const = default;
};
template <class J>
bool knows_no_rotor(J) {
  return requires { J::may_have_rotor; };
}
std::vector<Taken> runs(const Mechanism& m, bool down) {
  std::vector<Taken> all;
  if (down)
    passes::runs_down(m, [&](auto J, size_t i) {
      const size_t begin = i;
      while (passes::in_run(m.nodes(), ++i)) continue;
      all.push_back({begin, i, knows_no_rotor(J)});
      return i;
    });
  else
    passes::runs_up(m, [&](auto J, size_t i) {
      const size_t end = i;
      while (passes::in_run(m.nodes(), --i)) continue;
      all.insert(all.begin(), {i, end, knows_no_rotor(J)});
      return i;
    });
  return all;
}

TEST(Runs, HoldBodiesOfOneJointEachCarryingTheNext) {
  const std::vector<Taken> expected{{0, 1, false},  {1, 3, true},   {3, 4, false},  {4, 5, true},
                                    {5, 6, false},  {6, 7, false},  {7, 8, false},  {8, 10, false},
                                    {10, 12, true}, {12, 13, true}, {13, 15, false}};
  const Model m = tree();
  EXPECT_EQ(runs(*m, true), expected);
  EXPECT_EQ(runs(*m, false), expected);
}

/// The factors of the mass matrix and the joint rates, body by body.
Workspace<double> body_by_body(const Mechanism& m, const Vec& q, const Vec& p) {
  Workspace<double> w(m);
  const auto& nodes = m.nodes();
  passes::place_joints(m, w, q.data());
  for (size_t i = nodes.size(); i-- > 0;) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      Joint::momentum(&q[size_t(n.q)], &p[size_t(n.q)], &w.mu[size_t(n.v)]);
      if (n.leaf) {
        w.A[i] = ArticulatedInertia<double>(n.inertia);
        w.b[i] = passes::zero_force<double>();
      }
      passes::eliminate<Joint>(n, w, w.mu.data(), n.parent < 0, w.A[i], w.b[i]);
      if (n.parent < 0) return;
      const size_t parent = size_t(n.parent);
      ArticulatedInertia<double> A = w.A[i];
      passes::pass_to_parent<Joint>(m, n, w, i, A);
      w.A[parent] = A;
      if (n.last_child) w.b[parent] = passes::zero_force<double>();
      w.b[parent] += passes::to_parent<Joint>(n, w, i, w.b[i]);
    });
  }
  for (size_t i = 0; i < nodes.size(); ++i)
    visit_joint(nodes[i].type, [&](auto J) {
      using Joint = decltype(J);
      w.V[i] = passes::zero_motion<double>();
      if (nodes[i].parent >= 0)
        w.V[i] = passes::to_child<Joint>(nodes[i], w, i, w.V[size_t(nodes[i].parent)]);
      passes::back_substitute<Joint>(nodes[i], w, w.V[i], w.rate.data());
    });
  return w;
}
template <class V>
bool same_bits(const std::vector<V>& a, const std::vector<V>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(V)) == 0;
}

TEST(Runs, HaveTheBitsOfASweepBodyByBody) {
  const Model m = tree();
  test::RandomTree random(5);
  const Vec q = random.q(*m), p = random.numbers(m->nq());
  const Workspace<double> each = body_by_body(*m, q, p);
  Workspace<double> w(*m);
  Vec q_dot(q), p_dot(q);
  hamiltonian_field<double>(*m, w, q, p, {}, q_dot, p_dot);
  EXPECT_TRUE(same_bits(w.K, each.K) && same_bits(w.D_inverse, each.D_inverse));
  EXPECT_TRUE(same_bits(w.b, each.b) && same_bits(w.u, each.u));
  EXPECT_TRUE(same_bits(w.V, each.V) && same_bits(w.rate, each.rate));
  EXPECT_EQ(w.A[11].M.xz, each.A[11].M.xz) << "what is left of A serves the tangent";
  EXPECT_EQ(w.A[3].I.zz, each.A[3].I.zz) << "with a rotor all of it";

  // ABA has the same inertias.
  Workspace<double> forward(*m);
  Vec a(size_t(m->nv())), tau(a), rates(each.rate);
  aba<double>(*m, forward, q, rates, {}, a);
  EXPECT_TRUE(same_bits(forward.K, each.K) && same_bits(forward.D_inverse, each.D_inverse));
  rnea<double>(*m, forward, q, rates, a, {}, tau);
  for (const double t : tau) EXPECT_NEAR(t, 0, 1e-9) << "the inverse of ABA without forces";

  EXPECT_FALSE(same_bits(body_by_body(*m, random.q(*m), p).K, each.K)) << "the control";
}

}  // namespace
}  // namespace porthos::mechanics::runs_test
