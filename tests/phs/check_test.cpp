// phs::check finds each broken axiom by name and shows the state; user systems say at compile time
// what they lack.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <sstream>
#include <string>

#include "integrators/core/integrator.h"
#include "phs/system/check.h"
#include "phs/system/user_model.h"
#include "tests/places.h"

namespace porthos::phs::check_test {
namespace {

template <class T>
using In = std::span<const T>;
template <class T>
using Out = std::span<T>;

// A user's system: a damped pendulum of 2 kg and 0.5 m, driven by a torque.
struct Pendulum {
  phs::Description description() const {
    return {"pendulum",
            2,
            1,
            {{"hinge", BlockKind::angle, 0, 1, 1, "rad", "kg m^2/s"}},
            {{"motor", PortKind::effort_in, 1, 0, "N m", "rad/s"}},
            {},
            {.canonical = true, .separable = true, .lossless = false}};
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    return x[1] * x[1] + T(9.81) * (T(1.0) - phs::cos(x[0]));
  }
  template <class T>
  void dissipation(In<T>, In<T> e, Out<T> Re) const {
    Re[0] = T(0.0);
    Re[1] = T(0.1) * e[1];
  }
  template <class T>
  void input(In<T>, In<T> u, Out<T> Gu) const {
    Gu[0] = T(0.0);
    Gu[1] = u[0];
  }
};

AxiomResult axiom(const CheckReport& r, const std::string& name) {
  const auto it = std::find_if(r.axioms.begin(), r.axioms.end(),
                               [&](const auto& a) { return a.axiom == name; });
  if (it == r.axioms.end()) throw InvalidArgument("no axiom " + name + " in\n" + r.text());
  return *it;
}
std::set<std::string> violated(const CheckReport& r) {
  std::set<std::string> names;
  for (const auto& a : r.axioms)
    if (!a.holds()) names.insert(a.axiom);
  return names;
}
using Names = std::set<std::string>;

TEST(Check, ACorrectSystemHolds) {
  const UserModel model{Pendulum{}};
  const auto r = check(model);
  EXPECT_TRUE(r.holds()) << r.text();
  EXPECT_EQ(r.axioms.size(), 12u);
  for (const char* name :
       {"J skew", "R symmetric", "R >= 0", "canonical", "separable", "gradient", "efforts", "rate",
        "field", "storages", "power balance", "passive dissipation"}) {
    EXPECT_GE(axiom(r, name).worst, 0);
    EXPECT_LE(axiom(r, name).worst, 1e-13) << name << ": far below the limit of 1e-11";
    EXPECT_NE(r.text().find(std::string("holds    ") + name + ": worst "), std::string::npos)
        << r.text();
  }
  EXPECT_EQ(r.text().find("VIOLATED"), std::string::npos);
  const std::string text = r.text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 12);
}

TEST(Check, TheFieldIsWhatTheAxiomsSay) {
  const UserModel model{Pendulum{}};
  const auto f = model.instantiate<double>();
  const double x[] = {0.3, 0.7}, u[] = {0.25};
  double dx[2], y[1], e[2];
  f->field(0, x, u, dx);
  EXPECT_DOUBLE_EQ(dx[0], 1.4);
  EXPECT_DOUBLE_EQ(dx[1], -9.81 * std::sin(0.3) - 0.1 * 1.4 + 0.25);
  f->field(0, x, {}, dx);
  EXPECT_DOUBLE_EQ(dx[1], -9.81 * std::sin(0.3) - 0.1 * 1.4) << "an empty u is zero";
  f->gradient(x, e);
  f->output(x, e, y);
  EXPECT_DOUBLE_EQ(y[0], 1.4) << "collocated: the rate of the hinge";
}

// One system per axiom, wrong in that alone.
struct SkewBroken : Pendulum {
  template <class T>
  void structure(In<T>, In<T> e, Out<T> Je) const {
    Je[0] = e[1];
    Je[1] = T(-1.001) * e[0];
  }
};
struct ActiveFriction : Pendulum {
  template <class T>
  void dissipation(In<T>, In<T> e, Out<T> Re) const {
    Re[0] = T(0.0);
    Re[1] = T(-0.1) * e[1];
  }
};
struct LopsidedFriction : Pendulum {  // R = [1 0.5; 0 1]: positive, not symmetric
  template <class T>
  void dissipation(In<T>, In<T> e, Out<T> Re) const {
    Re[0] = e[0] + T(0.5) * e[1];
    Re[1] = e[1];
  }
};
struct WrongGradient : Pendulum {
  template <class T>
  void gradient(In<T> x, Out<T> e) const {
    e[0] = T(9.81) * phs::cos(x[0]);
    e[1] = T(2.0) * x[1];
  }
};
struct HiddenForce : Pendulum {
  template <class T>
  void drive(T, In<T>, Out<T> dx) const {
    dx[1] = dx[1] + T(0.01);
  }
};
struct NotANumber : Pendulum {
  template <class T>
  void gradient(In<T> x, Out<T> e) const {
    e[0] = log(-x[0] * x[0]);
    e[1] = T(2.0) * x[1];
  }
};
/// Two masses on a line, joined by a spring; the declared total momentum is kept, the first mass's
/// own is not.
struct TwoMasses {
  const char* declared;
  phs::Description description() const {
    phs::Description d;
    d.name = "two masses";
    d.nx = 4;
    d.traits.canonical = true;
    d.blocks = {{"a", BlockKind::linear, 0, 1, 2, "m", "kg m/s"},
                {"b", BlockKind::linear, 1, 1, 3, "m", "kg m/s"}};
    d.invariants = {{declared, 1, 0, 1, "kg m/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    return T(0.5) * (x[2] * x[2] + x[3] * x[3] + (x[0] - x[1]) * (x[0] - x[1]));
  }
  template <class T>
  void invariants(In<T> x, Out<T> v) const {
    v[0] = std::string(declared) == "total" ? x[2] + x[3] : x[2];
  }
};

/// Exactly the expected axioms are violated, each with a state; the text shows worst value, limit
/// and state.
template <class S>
void expect_violated(const S& system, const Names& expected) {
  const UserModel<S> model{system};
  const auto r = check(model);
  EXPECT_FALSE(r.holds());
  EXPECT_EQ(violated(r), expected) << r.text();
  for (const auto& name : expected) {
    const auto a = axiom(r, name);
    EXPECT_GT(a.worst, a.limit);
    ASSERT_EQ(int(a.state.size()), model.description().nx) << name;
    std::ostringstream line;
    line << "VIOLATED " << name << ": worst " << a.worst << ", limit 1e-11, at x = [" << a.state[0]
         << ", " << a.state[1];
    EXPECT_NE(r.text().find(line.str()), std::string::npos) << "expected " << line.str() << " in\n"
                                                            << r.text();
  }
}

TEST(Check, NamesTheBrokenAxiom) {
  expect_violated(SkewBroken{}, {"J skew", "canonical", "power balance"});
  expect_violated(ActiveFriction{}, {"R >= 0", "passive dissipation"});
  expect_violated(LopsidedFriction{}, {"R symmetric"});
  expect_violated(WrongGradient{}, {"gradient"});
  expect_violated(HiddenForce{}, {"rate"});
  expect_violated(TwoMasses{"first"}, {"invariant first"});
}

// --- traits --------------------------------------------------------------------------------------

/// p²/(2(1+q²)) + q²/2: canonical, and not separable whatever it says.
struct VariableMass {
  bool separable;
  phs::Description description() const {
    phs::Description d;
    d.name = "variable mass";
    d.nx = 2;
    d.blocks = {{"q", BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    d.traits = {.canonical = true, .separable = separable};
    return d;
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    return T(0.5) * x[1] * x[1] / (T(1.0) + x[0] * x[0]) + T(0.5) * x[0] * x[0];
  }
};
/// A charge in a plane across a magnetic field: J has one entry more than [0 I; -I 0].
struct Charge {
  double field;
  phs::Description description() const {
    phs::Description d;
    d.name = "charge";
    d.nx = 4;
    d.blocks = {{"q", BlockKind::linear, 0, 2, 2, "m", "kg m/s"}};
    d.traits = {.canonical = true, .separable = true};
    return d;
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    return T(0.5) * (x[0] * x[0] + T(2.0) * x[1] * x[1] + x[2] * x[2] + x[3] * x[3]);
  }
  template <class T>
  void structure(In<T>, In<T> e, Out<T> Je) const {
    Je[0] = e[2];
    Je[1] = e[3];
    Je[2] = T(field) * e[3] - e[0];
    Je[3] = -T(field) * e[2] - e[1];
  }
};

TEST(Check, TraitsAreAxioms) {
  expect_violated(VariableMass{true}, {"separable"});
  expect_violated(Charge{1e-6}, {"canonical"});
  EXPECT_TRUE(check(UserModel{VariableMass{false}}).holds());
  EXPECT_TRUE(check(UserModel{Charge{0}}).holds()) << "the control: without the field";
}

TEST(Check, AFalseTraitIsNamed) {
  EXPECT_EQ(false_trait(UserModel{VariableMass{true}}),
            "system 'variable mass' says it is separable, but its slope over q changes with p: H "
            "is not T(p) + V(q)");
  EXPECT_EQ(false_trait(UserModel{Charge{1}}),
            "system 'charge' says it is canonical, but its J is not [0 I; -I 0]");
  EXPECT_EQ(false_trait(UserModel{VariableMass{false}}), std::nullopt);
  // What relies on the trait does not start; what does not, does.
  const UserModel lie{VariableMass{true}};
  for (const char* name : {"kahan_li8_sv", "blanes_moan6", "stormer_verlet"}) try {
      integrators::make_integrator(name, lie, 0.1);
      ADD_FAILURE() << name << " must refuse it";
    } catch (const InvalidArgument& e) {
      EXPECT_EQ(std::string(e.what()),
                "method '" + std::string(name) + "' relies on it: " + *false_trait(lie));
    }
  EXPECT_NE(integrators::make_integrator("gauss4", lie, 0.1), nullptr);
  EXPECT_EQ(false_trait(UserModel{Pendulum{}}), std::nullopt);
}

TEST(Check, KeptInvariantHolds) {
  const UserModel model{TwoMasses{"total"}};
  const auto r = check(model);
  EXPECT_TRUE(r.holds()) << r.text();
  EXPECT_NE(r.text().find("holds    invariant total: worst"), std::string::npos) << r.text();
}

TEST(Check, NaNIsAViolation) {
  const UserModel model{NotANumber{}};
  const auto r = check(model);
  EXPECT_EQ(axiom(r, "gradient").worst, INFINITY) << r.text();
  EXPECT_FALSE(r.holds());
}

/// What drives it is not to be had by the field.
struct Shy : Pendulum {
  template <class T>
  void drive(T, In<T>, Out<T>) const {
    throw InvalidArgument("the drive acts elsewhere");
  }
};

TEST(Check, AFieldThatRefusesLeavesItsAxiomsUntried) {
  const UserModel model{Shy{}};
  const auto r = check(model);
  EXPECT_TRUE(r.holds()) << r.text();
  for (const char* name : {"rate", "efforts", "field", "power balance"}) {
    EXPECT_FALSE(axiom(r, name).applies());
    EXPECT_EQ(axiom(r, name).why_not, "the drive acts elsewhere");
  }
  for (const char* name : {"J skew", "R >= 0", "gradient", "storages"})
    EXPECT_TRUE(axiom(r, name).applies()) << name;
  EXPECT_NE(r.text().find("not applicable field: the drive acts elsewhere"), std::string::npos);
}

TEST(Check, StatesOfAnySize) {
  CheckOptions o;
  o.sizes = {1, 1e6};
  const auto r = check(UserModel{WrongGradient{}}, o);
  EXPECT_FALSE(axiom(r, "gradient").holds());
  EXPECT_GT(std::fabs(axiom(check(UserModel{WrongGradient{}}, o), "gradient").state[1]), 100);
  o.sizes = {1};
  EXPECT_THROW(check(UserModel{Pendulum{}}, o), InvalidArgument);
}

TEST(Check, Options) {
  const UserModel broken{WrongGradient{}};
  CheckOptions o;
  o.tolerance = 2;  // more than any relative error
  EXPECT_TRUE(check(broken, o).holds());
  o.samples = 0;
  EXPECT_FALSE(check(broken, o).holds()) << "nothing sampled is nothing shown";
  o = {};
  o.spread = 1e-3;
  const auto near = axiom(check(broken, o), "gradient").state;
  for (double x : near) EXPECT_LT(std::fabs(x), 0.01);
  CheckOptions other;
  other.seed = 2;
  EXPECT_EQ(axiom(check(broken), "gradient").state, axiom(check(broken), "gradient").state)
      << "the same seed, the same states";
  EXPECT_NE(axiom(check(broken), "gradient").state, axiom(check(broken, other), "gradient").state);
}

// --- gradient by duals ---------------------------------------------------------------------------

struct AnalyticPendulum : Pendulum {
  template <class T>
  void gradient(In<T> x, Out<T> e) const {
    e[0] = T(9.81) * phs::sin(x[0]);
    e[1] = T(2.0) * x[1];
  }
};

TEST(UserModel, GradientByDualsEqualsAnalytic) {
  const UserModel by_duals{Pendulum{}};
  const UserModel analytic{AnalyticPendulum{}};
  const auto a = by_duals.instantiate<double>(), b = analytic.instantiate<double>();
  const auto lanes = by_duals.instantiate<Pack8>();
  std::mt19937_64 rng(1);
  std::normal_distribution<double> number(0, 2);
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    std::vector<Pack8> x8(2), e8(2);
    std::vector<double> x(2), e(2), f(2);
    for (int l = 0; l < 8; ++l)
      for (size_t k = 0; k < 2; ++k) x8[k].set(l, number(rng));
    lanes->gradient(x8, e8);
    for (int l = 0; l < 8; ++l) {
      for (size_t k = 0; k < 2; ++k) x[k] = x8[k][l];
      a->gradient(x, e);
      b->gradient(x, f);
      for (size_t k = 0; k < 2; ++k) {
        worst = std::max(worst, std::fabs(e[k] - f[k]) / (1 + std::fabs(f[k])));
        ASSERT_EQ(e8[k][l], e[k]) << "lane " << l;
      }
    }
  }
  std::printf("  duals against formulas %.1e  bound 4e-16\n", worst);
  EXPECT_LE(worst, 4e-16);
}

template <class T>
std::string refusal_of_gradient(const Model& model) {
  std::vector<T> x(2, T(0.5)), e(2);
  try {
    model.instantiate<T>()->gradient(x, e);
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "";
}

TEST(UserModel, DualsAreForDoublesAndLanes) {
  const UserModel model{Pendulum{}};
  const std::string expected =
      "system 'pendulum' has no gradient(x, e), expected one for compare, derivatives of runs and "
      "113 bits: duals replace it in double and lanes only";
  EXPECT_EQ(refusal_of_gradient<Dual>(model), expected);
  EXPECT_EQ(refusal_of_gradient<Quad>(model), expected);
  EXPECT_EQ(refusal_of_gradient<long double>(model), expected);
  EXPECT_EQ(refusal_of_gradient<double>(model), "");
  EXPECT_EQ(refusal_of_gradient<Pack4>(model), "");
  const UserModel analytic{AnalyticPendulum{}};
  EXPECT_EQ(refusal_of_gradient<Quad>(analytic), "");
  EXPECT_EQ(refusal_of_gradient<Dual>(analytic), "");
}

TEST(UserModel, CloneEvaluatesTheSame) {
  const UserModel model{Pendulum{}};
  const auto f = model.instantiate<double>(), g = f->clone();
  const double x[] = {0.3, 0.7}, u[] = {0.25};
  double a[2], b[2];
  f->field(0, x, u, a);
  g->field(0, x, u, b);
  EXPECT_TRUE(a[0] == b[0] && a[1] == b[1]);
  EXPECT_EQ(&f->description(), &g->description());
}

// --- what the compiler says ----------------------------------------------------------------------

/// The first line with "error" that `compiler` prints for a user's class with these members; "" if
/// it compiles.
std::string first_error(const std::string& compiler, const std::string& members) {
  std::string name = testing::TempDir() + "/porthos_compile_fail_XXXXXX";
  if (!mkdtemp(name.data())) throw std::runtime_error("no temporary directory " + name);
  const std::filesystem::path folder = name;
  std::ofstream(folder / "user.cpp")
      << "#include \"phs/system/user_model.h\"\nnamespace phs = porthos::phs;\nstruct Mine {\n"
      << members
      << "\n};\nint main() { phs::UserModel<Mine> model(Mine{}); "
         "(void)model.instantiate<double>(); }\n";
  const std::string command = compiler + " -std=c++20 -w -fsyntax-only -I\"" + PORTHOS_SOURCE_DIR +
                              "\" \"" + (folder / "user.cpp").string() + "\" > \"" +
                              (folder / "log").string() + "\" 2>&1";
  const int status = std::system(command.c_str());
  std::ifstream log(folder / "log");
  std::string line, found;
  while (found.empty() && std::getline(log, line))
    if (line.find("error") != std::string::npos) found = line;
  if (found.empty() && status != 0)
    found = "status " + std::to_string(status) + " and no error line of " + command;
  std::filesystem::remove_all(folder);
  return found;
}

const std::string describes = "  phs::Description description() const { return {}; }\n";
const std::string has_energy =
    "  template <class T> T hamiltonian(std::span<const T> x) const { return x[0]; }\n";
const std::string energy_sentence =
    "a phs system needs:  template <class T> T hamiltonian(std::span<const T> x) const  -- its "
    "energy H(x)";
const std::string description_sentence =
    "a phs system needs:  phs::Description description() const  -- its state blocks, ports and "
    "invariants";

std::string own_compiler() { return std::getenv("CXX") ? std::getenv("CXX") : "c++"; }
/// What `compiler --version` says after the name it was called by; "" if there is no such compiler.
std::string version(const std::string& compiler) {
  std::string text;
  if (FILE* pipe = popen((compiler + " --version 2>/dev/null").c_str(), "r")) {
    char line[256];
    if (fgets(line, sizeof line, pipe)) text = line;
    while (fgets(line, sizeof line, pipe)) {
    }
    pclose(pipe);
  }
  return text.substr(std::min(text.size(), text.find(' ')));
}

TEST(CompileFail, SaysWhatIsMissing) {
  if (version(own_compiler()).empty()) GTEST_SKIP() << "no compiler " << own_compiler() << " here";
  EXPECT_EQ(first_error(own_compiler(), describes + has_energy), "")
      << "control: a whole class compiles";
  const std::string energy = first_error(own_compiler(), describes),
                    description = first_error(own_compiler(), has_energy);
  EXPECT_NE(energy.find(energy_sentence), std::string::npos) << energy;
  EXPECT_NE(description.find(description_sentence), std::string::npos) << description;
}
TEST(CompileFail, SaysItInTheOtherCompilersToo) {
  int others = 0;
  for (const std::string compiler : {"g++", "clang++"}) {
    if (version(compiler).empty() || version(compiler) == version(own_compiler())) continue;
    ++others;
    const std::string energy = first_error(compiler, describes);
    EXPECT_NE(energy.find(energy_sentence), std::string::npos) << compiler << ": " << energy;
  }
  if (others == 0) GTEST_SKIP() << "no other compiler here than " << own_compiler();
}

}  // namespace
}  // namespace porthos::phs::check_test
