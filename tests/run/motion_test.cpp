// The plot of a motion: what it shows is what was simulated.
#include "scene/plot/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "mechanics/momentum.h"
#include "scene/session/replot.h"
#include "tests/run/scenes.h"

namespace porthos::test::motion_test {
namespace {

using Rows = std::vector<double>;

const scene::TracePanel* panel(const std::vector<scene::TracePanel>& all, const std::string& what) {
  for (const auto& p : all)
    if (p.what == what) return &p;
  return nullptr;
}

/// A box that turns about its z axis at 2 rad/s and a rod on it at -30 rad/s.
struct Spinner {
  mechanics::Mechanism m;
  std::vector<double> t;
  std::map<std::string, Rows> series;

  static mechanics::Mechanism build() {
    mechanics::MechanismBuilder b("spinner");
    mechanics::BodySpec box;
    box.name = "box";
    box.parent = "world";
    box.joint.name = "base";
    box.joint.type = "free";
    box.mass = {3, {0, 0, 0}, {1, 0, 0, 1, 0, 2}};
    b.add(box);
    mechanics::BodySpec rod;
    rod.name = "rod";
    rod.parent = "box";
    rod.joint.name = "wheel";
    rod.joint.type = "continuous";
    rod.joint.axis = {0, 0, 1};
    rod.mass = {1, {0, 0, 0}, {0.1, 0, 0, 0.1, 0, 0.2}};
    b.add(rod);
    return b.build();
  }
  Spinner() : m(build()) {
    mechanics::Workspace<double> w(m);
    for (int i = 0; i <= 200; ++i) {
      const double at = 0.05 * i, angle = 2 * at, wheel = -30 * at;
      t.push_back(at);
      Rows q(size_t(m.nq())), p(size_t(m.nq())), v(size_t(m.nv()), 0.0);
      const auto &a = m.coordinate("base.attitude"), &r = m.coordinate("base.position"),
                 &c = m.coordinate("wheel");
      q[size_t(a.q)] = std::cos(angle / 2);
      q[size_t(a.q) + 3] = std::sin(angle / 2);
      q[size_t(r.q)] = 7 + 0.5 * at;
      const double turns = std::round(wheel / 6.283185307179586);
      q[size_t(c.q)] = wheel - 6.283185307179586 * turns;
      v[size_t(a.v) + 2] = 2;
      v[size_t(r.v)] = 0.5 * std::cos(angle);
      v[size_t(r.v) + 1] = -0.5 * std::sin(angle);
      v[size_t(c.v)] = -30;
      mechanics::momenta_from_rates<double>(m, w, q, v, p);
      for (const auto& k : m.coordinates())
        for (int j = 0; j < k.nq; ++j) {
          series["state/" + k.name].push_back(q[size_t(k.q + j)]);
          series["momentum/" + k.name].push_back(p[size_t(k.q + j)]);
        }
      series["turns"].push_back(turns);
    }
  }
  std::vector<scene::TracePanel> panels() const {
    return scene::motion_panels(m, {t, {"wheel"}, [&](const std::string& name) {
                                      const auto at = series.find(name);
                                      return at == series.end() ? Rows{} : at->second;
                                    }});
  }
};

double off(const scene::TraceLine& l, const std::function<double(double)>& exact) {
  double most = 0;
  for (size_t i = 0; i < l.t.size(); ++i)
    most = std::max(most, std::fabs(l.value[i] - exact(l.t[i])));
  return most;
}

TEST(Motion, ShowsWhatMoved) {
  Spinner s;
  const auto all = s.panels();
  for (const char* what :
       {"turning joints [rad]", "rates of turning joints [rad/s]", "rotation of base [rad]",
        "rates of base, own axes [rad/s]", "path of base [m]", "velocity of base [m/s]"})
    ASSERT_TRUE(panel(all, what)) << what;
  EXPECT_EQ(all.size(), 6u);
  const auto line = [&](const char* what, size_t k) { return panel(all, what)->lines.at(k); };
  struct Case {
    const char* name;
    double off;
  };
  const Case cases[] = {
      // measured: 1e-13 and less; the angle reaches 300 rad
      {"wheel", off(line("turning joints [rad]", 0), [](double t) { return -30 * t; })},
      {"wheel's rate", off(line("rates of turning joints [rad/s]", 0), [](double) { return -30; })},
      {"rotation z, three turns and more",
       off(line("rotation of base [rad]", 3), [](double t) { return 2 * t; })},
      {"angle", off(line("rotation of base [rad]", 0), [](double t) { return 2 * t; })},
      {"rate z", off(line("rates of base, own axes [rad/s]", 2), [](double) { return 2; })},
      {"path x", off(line("path of base [m]", 0), [](double t) { return 0.5 * t; })},
      {"velocity x, world axes",
       off(line("velocity of base [m/s]", 0), [](double) { return 0.5; })},
      {"velocity y, world axes", off(line("velocity of base [m/s]", 1), [](double) { return 0; })}};
  for (const Case& c : cases) {
    std::printf("  %-36s off by %.1e (1e-11)\n", c.name, c.off);
    EXPECT_LT(c.off, 1e-11) << c.name;
  }
  // Must fail: other momenta are other rates.
  for (double& p : s.series["momentum/wheel"]) p *= 1.01;
  EXPECT_GT(off(panel(s.panels(), "rates of turning joints [rad/s]")->lines[0],
                [](double) { return -30; }),
            1e-3);
}

TEST(Motion, WithoutMomentaThereAreNoRates) {
  Spinner s;
  s.series.erase("momentum/wheel");
  EXPECT_EQ(s.panels().size(), 3u);
  s.series.erase("state/wheel");
  EXPECT_TRUE(s.panels().empty());
}

}  // namespace
}  // namespace porthos::test::motion_test
