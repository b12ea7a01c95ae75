// family = "formula": an energy as a text has the numbers of the family that says the same.
#include "vsa/formula.h"

#include <cstring>

#include "scene/ensemble/ensemble.h"
#include "scene/run/growth_words.h"
#include "tests/places.h"
#include "tests/run/scenes.h"
#include "tests/support/bounds.h"
#include "vsa/families.h"

namespace porthos::test::vsa_formula_test {
namespace {

using phs::Quad;
using vsa::ElasticPtr;
using vsa::Limits;

/// A family and the same energy as a text, over one range.
struct Pair {
  const char* name;
  ElasticPtr family, formula;
  double deflection, sigma_lower, sigma_upper;
};

std::vector<Pair> pairs(double factor = 1) {
  const auto range = [](double low, double high) {
    Limits l;
    l.sigma_lower = low;
    l.sigma_upper = high;
    return l;
  };
  Limits lever = range(0.02, 0.09);
  lever.deflection = 0.4;
  lever.stop_stiffness = 1e4;
  const double f = factor;
  return {
      {"series_elastic", vsa::series_elastic({50, 4000}),
       vsa::formula({"k/2*phi^2 + k3/4*phi^4", {{"k", 50 * f}, {"k3", 4000}}}), 0.6, 0, 0},
      {"variable_lever", vsa::variable_lever({{20, 60, 120, 0}}, range(0, 1)),
       vsa::formula(
           {"0.5*(k0 + k1*sigma + k2*sigma^2)*phi^2", {{"k0", 20 * f}, {"k1", 60}, {"k2", 120}}},
           range(0, 1)),
       1, 0, 1},
      {"antagonistic_quadratic", vsa::antagonistic_quadratic({3e5, 0.02}, range(0, 1)),
       vsa::formula({"ks*r^3/3*(max(sigma + phi, 0)^3 + max(sigma - phi, 0)^3)",
                     {{"ks", 3e5 * f}, {"r", 0.02}}},
                    range(0, 1)),
       1.5, 0, 1},
      {"antagonistic_exponential", vsa::antagonistic_exponential({0.2, 4}, range(0, 0.8)),
       vsa::formula({"c/b*(exp(b*(sigma + phi)) + exp(b*(sigma - phi)) - 2*b*sigma - 2)",
                     {{"c", 0.2 * f}, {"b", 4}}},
                    range(0, 0.8)),
       0.6, 0, 0.8},
      {"cosh", vsa::cosh_springs({6.7328, 0.0222}, range(-0.8, 0.8)),
       vsa::formula({"k/a*(cosh(a*(phi - sigma)) + cosh(a*(phi + sigma)) - 2)",
                     {{"a", 6.7328}, {"k", 0.0222 * f}}},
                    range(-0.8, 0.8)),
       0.8, -0.8, 0.8},
      {"lever_arm", vsa::lever_arm({8e4}, lever),
       vsa::formula({"ks*(sigma*sin(phi))^2", {{"ks", 8e4 * f}}}, lever), 0.45, 0.02, 0.09},
  };
}

struct Difference {
  double energy = 0, slope = 0, stiffness = 0, wide = 0;
};
/// Largest differences of the two over the range, of the largest value.
Difference difference(const Pair& p) {
  Difference d, size;
  const auto grow = [](double& most, double x) { most = std::max(most, std::fabs(x)); };
  for (int i = 0; i <= 40; ++i)
    for (int j = 0; j <= 8; ++j) {
      const double phi = p.deflection * (i / 20.0 - 1), theta = 0.3, q = theta + phi;
      const double sigma = p.sigma_lower + (p.sigma_upper - p.sigma_lower) * j / 8;
      const auto at = [&](auto x) {
        using T = decltype(x);
        return std::pair{p.family->slopes(T(q), T(theta), T(sigma)),
                         p.formula->slopes(T(q), T(theta), T(sigma))};
      };
      const auto [a, b] = at(double());
      const auto H = p.family->hessian(q, theta, sigma), G = p.formula->hessian(q, theta, sigma);
      grow(d.energy, p.family->energy(q, theta, sigma) - p.formula->energy(q, theta, sigma));
      grow(size.energy, p.family->energy(q, theta, sigma));
      for (const auto& [x, y] : {std::pair{a.q, b.q}, {a.theta, b.theta}, {a.sigma, b.sigma}}) {
        grow(d.slope, x - y);
        grow(size.slope, x);
      }
      for (size_t k = 0; k < 9; ++k) {
        grow(d.stiffness, H[k / 3][k % 3] - G[k / 3][k % 3]);
        grow(size.stiffness, H[k / 3][k % 3]);
      }
      const auto [c, e] = at(Quad());
      grow(d.wide, double(c.q - e.q));
      grow(size.wide, double(c.q));
    }
  return {d.energy / size.energy, d.slope / size.slope, d.stiffness / size.stiffness,
          d.wide / size.wide};
}

// Both forms have at most 30 roundings, whose errors the functions multiply by at most a |d| = 11
// (of cosh): 2 · 30 · 11 · 1.1e-16 = 7e-14 of the largest value. In 113 bits what remains are the
// constants, rounded to double by each form in its own way: five times 1.1e-16, times 11.
TEST(FormulaEnergy, HasTheNumbersOfTheFamilies) {
  for (const Pair& p : pairs()) {
    const auto d = difference(p);
    keeps(std::string(p.name) + ": energy", d.energy, 7e-14);
    keeps(std::string(p.name) + ": torque and efforts", d.slope, 7e-14);
    keeps(std::string(p.name) + ": second derivatives", d.stiffness, 7e-14);
    keeps(std::string(p.name) + ": torque in 113 bits", d.wide, 6e-15);
  }
  for (const Pair& p : pairs(1 + 1e-10))
    breaks(std::string(p.name) + ": control, a parameter 1e-10 off", difference(p).slope, 7e-14);
}

template <class P>
void expect_lanes(const Pair& p) {
  P q(0.0), theta(0.2), sigma(0.0);
  const auto& e = *p.formula;
  for (int i = 0; i < phs::lanes<P>; ++i) {
    q.set(i, 0.2 + p.deflection * (0.25 * i - 0.9));
    sigma.set(i, p.sigma_lower + (p.sigma_upper - p.sigma_lower) * i / 8);
  }
  const P E = e.energy(q, theta, sigma);
  const auto s = e.slopes(q, theta, sigma);
  for (int i = 0; i < phs::lanes<P>; ++i) {
    const auto one = e.slopes(q[i], 0.2, sigma[i]);
    const double lanes[] = {E[i], s.q[i], s.theta[i], s.sigma[i]};
    const double alone[] = {e.energy(q[i], 0.2, sigma[i]), one.q, one.theta, one.sigma};
    EXPECT_EQ(std::memcmp(lanes, alone, sizeof lanes), 0) << p.name << " lane " << i;
  }
}

TEST(FormulaEnergy, LanesHaveTheBitsOfOneNumber) {
  for (const Pair& p : pairs()) {
    expect_lanes<phs::Pack4>(p);
    expect_lanes<phs::Pack8>(p);
  }
}

TEST(FormulaEnergy, WhatIsNoSpringIsRefusedWithItsPlace) {
  Limits sigma;
  sigma.sigma_lower = 0;
  sigma.sigma_upper = 1;
  Limits small = sigma;
  small.deflection = 0.5;
  small.stop_stiffness = 100;
  struct Bad {
    const char* energy;
    Limits limits;
    const char* words;
  };
  const Bad bad[] = {
      {"0.5*phi^2 - phi^4",
       {},
       "the stiffness is -117.435 N m/rad at phi = -3.142 rad, expected 0 "
       "or more over the range of the limits"},
      {"0.5*phi^2 - phi^4", small, "the stiffness is -2 N m/rad at phi = -0.5 rad, expected"},
      {"(sigma - 0.5)*phi^2", small,
       "the stiffness is -1 N m/rad at phi = -0.5 rad and sigma = 0, expected"},
      {"(2 + sigma)*phi - 90*phi^3", small,
       "the energy is odd in phi: is it the torque? state its integral"},
      {"0.5*phi^2 - phi^3", small, "the equilibrium would not be unique"},  // control: not odd
      {"log(phi)*phi", {}, "the energy is nan at phi = -3.142 rad, expected a finite number"},
      {"sqrt(phi^2)", {}, "is nan at phi = 0 rad, expected a finite number"},
      {"phi^2/sigma", sigma, "is inf at phi = -3.142 rad and sigma = 0, expected a finite"},
      {"exp(300*phi)", {}, "is inf at phi = 2.356 rad, expected"},
      {"phi^2*sigma",
       {},
       "the energy depends on sigma, expected its range in the limits (a scene: limits.sigma = "
       "[lower, upper]; Python: limits=Limits(sigma_lower=..., sigma_upper=...)): over it"},
      {"0.5*phi^2 + 0.01*abs(phi - 0.3)",
       {},
       "the torque jumps from 0.29 to 0.31 N m at phi = 0.3 rad, expected one without jumps"},
      {"sigma^2", sigma, "the energy \"sigma^2\" does not depend on phi, expected one that does"},
      {"phi", {}, "the stiffness is 0 everywhere, expected an energy that bends with phi"},
      {"phi^2*k", {}, "formula: the energy \"phi^2*k\": unknown name 'k' at character 7"}};
  for (const Bad& b : bad) {
    const auto why = refusal([&] { vsa::formula({b.energy, {}}, b.limits); });
    EXPECT_NE(why.find(b.words), std::string::npos) << b.energy << ": " << why;
  }
  EXPECT_EQ(refusal([&] {
              vsa::formula({"0.5*phi^2 - phi^4", {}}, [] {
                Limits l;
                l.deflection = 0.25;
                l.stop_stiffness = 1;
                return l;
              }());
            }),
            "")
      << "the same within the range where it is a spring";
}

// Poles between the 201 deflections, or on one of them to rounding. tan(φ/0.2): at ±0.1 π =
// ±0.3142 rad and on.
TEST(FormulaEnergy, APoleBetweenThePlacesIsRefused) {
  const auto why = [](const char* energy, double deflection = HUGE_VAL, bool with_sigma = false) {
    Limits l;
    l.deflection = deflection;
    l.stop_stiffness = deflection < HUGE_VAL ? 1e4 : 0;
    if (with_sigma) l.sigma_lower = 1, l.sigma_upper = 2;
    return refusal([&] { vsa::formula({energy, {}}, l); });
  };
  const char* const tangent = "15*(tan(phi/0.2))^2*0.2^2";
  const auto said = why(tangent);
  EXPECT_TRUE(says(said, "the stiffness grows without bound towards phi = -"));
  EXPECT_LE(said.size(), 220u);
  EXPECT_TRUE(says(why(tangent, 0.35), "towards phi = -0.3142 rad"));
  EXPECT_EQ(why(tangent, 0.3), "") << "the same below its poles";
  EXPECT_TRUE(says(why("15*phi^2 + 1e-3/(phi - 1.2345)^2"), "phi = 1.235 rad, a pole"));
  EXPECT_TRUE(says(why("15*phi^2 - log((phi - 0.7654321)^2)"), "phi = 0.7654 rad, a pole"));
  EXPECT_TRUE(says(why("15*phi^2 + 1e-3/(phi - 0.61*sigma)^2", HUGE_VAL, true),
                   "towards phi = 0.915 rad at sigma = 1.5, a pole"));
  // Controls: steep, narrow or bent, and bounded.
  EXPECT_EQ(why("cosh(100*phi)"), "");
  EXPECT_EQ(why("exp(-100*phi)"), "");
  EXPECT_EQ(why("15*phi^2 + 1e8*max(phi - 0.31, 0)^3 + 1e8*max(-0.31 - phi, 0)^3"), "");
  EXPECT_EQ(why("15*phi^2 + 1e4*phi^4"), "");
  EXPECT_EQ(why("15*phi^2 + 10*sqrt((phi - 0.303)^2 + 1e-6)"), "") << "1e4 N m/rad within 1 mrad";
  EXPECT_EQ(why("15*phi^2 + 0.1*sqrt((phi - 0.303)^2 + 1e-12)"), "");
}

TEST(FormulaEnergy, AKinkOfTheStiffnessIsRemarked) {
  const auto remark = [](const char* energy) {
    return vsa::formula({energy, {}}, {})->traits().remark;
  };
  // A linear spring that a second one joins at 0.2 rad.
  EXPECT_TRUE(says(remark("2*phi^2 + 3*max(phi - 0.2, 0)^2"),
                   "the stiffness jumps from 4 to 10 N m/rad at phi = 0.2 rad"));
  EXPECT_EQ(remark("2*phi^2 + 3*max(phi - 0.2, 0)^3"), "") << "a stiffness that bends only";
  EXPECT_EQ(remark("2*phi^2 + exp(3*phi)"), "");
  const auto kink = [](const char* energy) {
    return vsa::formula({energy, {}}, {})->traits().kink;
  };
  EXPECT_NEAR(kink("2*phi^2 + 3*max(phi - 0.2, 0)^3"), 0.2, 1e-12);
  EXPECT_NEAR(kink("5*abs(phi)*phi^2"), 0, 1e-12);
  EXPECT_NEAR(std::fabs(kink("2*phi^2 + 4*max(abs(phi) - 0.1, 0)^3")), 0.1, 1e-12);
  // The jump of a kink to a higher power is in a higher derivative, as of two that cancel below it.
  EXPECT_NEAR(kink("2*phi^2 + 3*max(phi - 0.2, 0)^4"), 0.2, 1e-12);
  EXPECT_NEAR(kink("2*phi^2 + abs(phi)^5"), 0, 1e-12);
  EXPECT_NEAR(kink("2*phi^2 + max(phi, 0)^3 - max(-phi, 0)^3 - phi^3 + max(phi - 0.1, 0)^6"), 0.1,
              1e-12);
  EXPECT_TRUE(std::isnan(kink("2*phi^2 + max(phi, 0)^8 + sqrt(phi^2 + 0.001^2)"))) << "control";
  EXPECT_TRUE(std::isnan(kink("2*phi^2 + exp(3*phi)"))) << "control: no kinks";
}

// --- scenes --------------------------------------------------------------------------------------

/// A shipped scene whose qbmoves are replaced by their energy as a formula.
class FormulaScene : public ::testing::Test {
 protected:
  std::string text(const std::string& name) const {
    return read_bytes(fs::path(PORTHOS_SOURCE_DIR) / "examples" / name / "scene.toml");
  }
  std::string by_formula(std::string s, const std::string& a = "6.7328") const {
    const std::string device = "device = \"qbmove_advanced\"";
    for (size_t at; (at = s.find(device)) != std::string::npos;)
      s.replace(at, device.size(),
                "family = \"formula\"\n"
                "energy = \"k/a*(cosh(a*(phi - sigma)) + cosh(a*(phi + sigma)) - 2)\"\n"
                "parameters = { a = " +
                    a + ", k = 0.0222 }\nlimits = { sigma = [-0.8, 0.8] }");
    return s;
  }
  scene::Scene read(const std::string& example, const std::string& urdf,
                    const std::string& scene) const {
    fs::copy_file(fs::path(PORTHOS_SOURCE_DIR) / "examples" / example / urdf, folder_ / urdf,
                  fs::copy_options::overwrite_existing);
    write_bytes(folder_ / "scene.toml", scene);
    return scene::read_scene((folder_ / "scene.toml").string());
  }
  std::vector<double> end(const scene::Scene& s, const std::string& out) const {
    const auto r = scene::run(s, scene::assemble(s), into(folder_ / out));
    EXPECT_TRUE(r.passed()) << out;
    return r.final_state.x;
  }
  TemporaryFolder folder_;
};

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

// 2000 steps whose forces differ by 7e-14 of 1 N m on 0.005 kg m²: 7e-14/0.005 · 12.6² / 2 s² =
// 1e-9 if all pushed one way.
TEST_F(FormulaScene, RunsAsTheDevice) {
  const auto original = text("vsa_cycle");
  const auto device = end(read("vsa_cycle", "links.urdf", original), "device");
  const auto formula = end(read("vsa_cycle", "links.urdf", by_formula(original)), "formula");
  const auto other = end(read("vsa_cycle", "links.urdf", by_formula(original, "6.7329")), "other");
  keeps("vsa_cycle by formula, end state", distance(device, formula), 1e-9);
  breaks("control: a = 6.7329", distance(device, other), 1e-9);
}

// |φ|³ costs gauss12 its order: the run names the kink, and not slopes that Porthos makes itself.
TEST_F(FormulaScene, AFailingEnergyNamesTheKink) {
  const auto words = [&](const std::string& energy, const std::string& method) {
    const auto s = read(
        "qbmove_arm", "arm.urdf",
        "[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[[actuator]]\nname = \"a\"\n"
        "joint = \"shoulder\"\nfamily = \"formula\"\nenergy = \"" +
            energy + "\"\ntheta = { drive = \"fixed\", start = 0.5 }\n[integrator]\nmethod = \"" +
            method + "\"\nstep = 0.01\n[run]\nduration = 5.0\n");
    const auto r =
        scene::run(s, scene::assemble(s), into(folder_ / (method + energy.substr(0, 1))));
    std::string all = scene::growth_words(r) + "\n";
    for (const auto& n : r.notes) all += n + "\n";
    return all;
  };
  const std::string kink = words("5*abs(phi)*phi^2", "gauss12");
  EXPECT_TRUE(says(kink, "to sixth order of the energy of actuator 'a' jumps at phi = 0 rad"));
  EXPECT_EQ(kink.find("energies of your own"), std::string::npos) << kink;
  EXPECT_EQ(words("5*phi^2", "gauss12").find("jumps at"), std::string::npos) << "control: smooth";
  EXPECT_EQ(words("5*abs(phi)*phi^2", "gonzalez").find("jumps at"), std::string::npos)
      << "control: keeps the energy whatever its shape";
}

TEST_F(FormulaScene, ResumesBitForBit) {
  const auto s = read("vsa_cycle", "links.urdf", by_formula(text("vsa_cycle")));
  const auto a = scene::assemble(s);
  const auto whole = scene::run(s, a, into(folder_ / "whole"));
  auto stop = into(folder_ / "parts");
  stop.stop_at = 700;
  EXPECT_TRUE(scene::run(s, a, stop).interrupted);
  const auto rest = scene::run(s, a, into(folder_ / "parts", true));
  EXPECT_TRUE(whole.final_state == rest.final_state);
}

TEST_F(FormulaScene, AnEnsembleVariesItsParametersAndHasTheBitsOfOneRun) {
  auto t = by_formula(text("vsa_cycle"));
  t.replace(t.find("duration = 12.566370614359172"), 29, "duration = 0.6283185307179586");
  t += "\n[ensemble]\ncases = 9\nseed = 3\n[ensemble.vary]\n"
       "\"actuator[1].parameters.k\" = { uniform = [0.01, 0.03] }\n"
       "\"initial.joints.loaded.position\" = { uniform = [-0.3, 0.3] }\n";
  const scene::Ensemble e(read("vsa_cycle", "links.urdf", t));
  const auto r = scene::run_ensemble(e, {.out = (folder_ / "cases").string(), .threads = 1});
  EXPECT_TRUE(r.complete);
  EXPECT_EQ(r.passed, 9);
  std::string without = t;
  without.erase(without.find("\"actuator[1]"),
                without.find("\"initial.joints.loaded.position\"") - without.find("\"actuator[1]"));
  const scene::Ensemble lanes(read("vsa_cycle", "links.urdf", without));
  EXPECT_TRUE(lanes.in_lanes());
  std::string files[2];
  for (const bool in_lanes : {false, true}) {
    const auto out = folder_ / (in_lanes ? "lanes" : "alone");
    scene::EnsembleOptions o;
    o.out = out.string();
    o.threads = 1;
    o.lanes = in_lanes;
    EXPECT_EQ(scene::run_ensemble(lanes, o).passed, 9);
    files[in_lanes] = read_bytes(out / "ensemble.h5");
  }
  EXPECT_TRUE(files[0] == files[1]) << "lanes have the bits of one run";
}

TEST_F(FormulaScene, MistakesAreRefusedWithTheirLine) {
  const auto why = [&](const std::string& from, const std::string& to) {
    auto t = by_formula(text("vsa_cycle"));
    const size_t at = t.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    t.replace(at, from.size(), to);
    return refusal([&] { read("vsa_cycle", "links.urdf", t); });
  };
  EXPECT_TRUE(says(why("cosh(a*(phi - ", "cosh(a*(ph - "),
                   "scene.toml:12:1: formula: the energy \"k/a*(cosh(a*(ph - sigma)) + "
                   "cosh(a*(phi + sigma)) - 2)\": unknown name 'ph' at character 14, the nearest "
                   "known one is 'phi' (known: phi, sigma, a, k, pi)"));
  EXPECT_TRUE(says(why("k = 0.0222 }", "k = 0.0222, b = 1 }"),
                   "scene.toml:12:1: formula: the energy parameter 'b' is not in"));
  EXPECT_TRUE(
      says(why("a = 6.7328,", "a = \"6\","), "parameters.a is a string, expected a number"));
  EXPECT_TRUE(says(why("family = \"formula\"", "family = \"cosh\""),
                   "energy is given without family = \"formula\", expected both or neither"));
  EXPECT_TRUE(says(why("family = \"formula\"", "family = \"formulas\""),
                   "family is \"formulas\", expected \"series_elastic\""));
  EXPECT_TRUE(says(why("limits = { sigma = [-0.8, 0.8] }", ""),
                   "the energy depends on sigma, expected its range in the limits"));
  EXPECT_TRUE(says(why("energy = \"k/a", "#"), "[[actuator]] lacks the key 'energy', expected"));
}

}  // namespace
}  // namespace porthos::test::vsa_formula_test
