#include "phs/functions/formula.h"

#include <cmath>
#include <cstring>
#include <functional>
#include <random>

#include "tests/support/bounds.h"

/// Formulas: what they mean, in every scalar, and the sentence for each mistake.
namespace porthos::test::formula_test {
namespace {

using phs::Dual;
using phs::Formula;
using phs::Quad;

double value(const std::string& text, double x = 0, double y = 0) {
  const double variables[] = {x, y};
  return Formula(text, {"x", "y"}).at(std::span<const double>(variables));
}

TEST(Formula, ReadsAsInABook) {
  EXPECT_EQ(value("1 + 2*3"), 7);
  EXPECT_EQ(value("6/2*3"), 9);
  EXPECT_EQ(value("1 - 2 - 3"), -4);
  EXPECT_EQ(value("-2^2"), -4);
  EXPECT_EQ(value("2^3^2"), 512);
  EXPECT_EQ(value("2^-1"), 0.5);
  EXPECT_EQ(value("2 * -3"), -6);
  EXPECT_EQ(value("+(1 + 2)*3"), 9);
  EXPECT_EQ(value("1.5e1 + .5"), 15.5);
  EXPECT_EQ(value("2*pi"), 2 * M_PI);
  EXPECT_EQ(value("-x^2", 3), -9);
  EXPECT_EQ(value("max(x, y) - min(x, y)", 2, 5), 3);
  const double one[] = {4.0};
  const Formula f("n*x^n + k", {"x"}, {{"n", 2}, {"k", 0.25}});
  EXPECT_EQ(f.at(std::span<const double>(one)), 32.25);
}

/// Every sign and function, as a text and as the same in C++.
struct Both {
  const char* text;
  std::function<double(double, double)> same;
};
const std::vector<Both>& both() {
  static const std::vector<Both> all{
      {"x + y", [](double x, double y) { return x + y; }},
      {"x - y", [](double x, double y) { return x - y; }},
      {"x*y", [](double x, double y) { return x * y; }},
      {"x/y", [](double x, double y) { return x / y; }},
      {"-x", [](double x, double) { return -x; }},
      {"x^2", [](double x, double) { return x * x; }},
      {"x^3", [](double x, double) { return x * x * x; }},
      {"x^-2", [](double x, double) { return 1 / (x * x); }},
      {"x^7", [](double x, double) { return std::pow(x, 7); }},
      {"x^0", [](double, double) { return 1.0; }},
      {"x^1.5", [](double x, double) { return std::pow(x, 1.5); }},
      {"sqrt(x)", [](double x, double) { return std::sqrt(x); }},
      {"exp(x)", [](double x, double) { return std::exp(x); }},
      {"log(x)", [](double x, double) { return std::log(x); }},
      {"sin(x)", [](double x, double) { return std::sin(x); }},
      {"cos(x)", [](double x, double) { return std::cos(x); }},
      {"tan(x)", [](double x, double) { return std::tan(x); }},
      {"sinh(x)", [](double x, double) { return std::sinh(x); }},
      {"cosh(x)", [](double x, double) { return std::cosh(x); }},
      {"tanh(x)", [](double x, double) { return std::tanh(x); }},
      {"atan(x)", [](double x, double) { return std::atan(x); }},
      {"abs(x - y)", [](double x, double y) { return std::fabs(x - y); }},
      {"min(x, y)", [](double x, double y) { return std::min(x, y); }},
      {"max(x, y)", [](double x, double y) { return std::max(x, y); }},
  };
  return all;
}

// Each is one function of the C library or at most five products: within four units of the last
// place. Where sin and cos are ours the bound of trig_test holds, one unit.
TEST(Formula, HasTheValuesOfTheFunctions) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> argument(0.1, 1.4);
  double worst = 0;
  for (const Both& b : both())
    for (int i = 0; i < 200; ++i) {
      const double x = argument(generator), y = argument(generator), exact = b.same(x, y);
      worst = std::max(worst, std::fabs(value(b.text, x, y) - exact) / std::fabs(exact));
    }
  keeps("values against the C library", worst, 4 * 2.3e-16);
  const double exact = both()[6].same(1.1, 0);
  breaks("control: x^3 for x^3 (1 + 1e-12)", std::fabs(value("x^3*(1 + 1e-12)", 1.1) / exact - 1),
         4 * 2.3e-16);
}

template <class P>
void expect_lanes(const Both& b) {
  const Formula f(b.text, {"x", "y"});
  P variables[] = {P(0.0), P(0.0)};
  for (int i = 0; i < phs::lanes<P>; ++i) {
    variables[0].set(i, 0.3 + 0.1 * i);
    variables[1].set(i, 0.9 - 0.07 * i);
  }
  const P lanes = f.at(std::span<const P>(variables));
  for (int i = 0; i < phs::lanes<P>; ++i) {
    const double one[] = {variables[0][i], variables[1][i]};
    const double lane = lanes[i], alone = f.at(std::span<const double>(one));
    EXPECT_EQ(std::memcmp(&lane, &alone, sizeof lane), 0) << b.text << " lane " << i;
  }
}

TEST(Formula, LanesHaveTheBitsOfOneNumber) {
  for (const Both& b : both()) {
    expect_lanes<phs::Pack4>(b);
    expect_lanes<phs::Pack8>(b);
  }
}

// In duals the derivative; the reference is the difference quotient in 113 bits: h = 1e-17 has an
// error of h² f''' = 1e-33 and of rounding 1e-34 / h = 1e-17.
TEST(Formula, DualsHaveItsDerivative) {
  double worst = 0, low_digits = 0;
  for (const Both& b : both()) {
    const Formula f(b.text, {"x", "y"});
    const double x = 0.71, y = 0.43;
    const Dual seeded[] = {Dual(x, 1), Dual(y, 0)};
    const Quad h = 1e-17, up[] = {Quad(x) + h, Quad(y)}, down[] = {Quad(x) - h, Quad(y)};
    const double slope =
        double((f.at(std::span<const Quad>(up)) - f.at(std::span<const Quad>(down))) / (2 * h));
    worst = std::max(worst, std::fabs(f.at(std::span<const Dual>(seeded)).d - slope) /
                                std::max(1.0, std::fabs(slope)));
    const long double wide[] = {x, y};
    const Quad exact[] = {Quad(x), Quad(y)};
    low_digits =
        std::max(low_digits, std::fabs(double(Quad(f.at(std::span<const long double>(wide))) -
                                              f.at(std::span<const Quad>(exact)))));
  }
  keeps("derivatives against differences of 113 bits", worst, 1e-14);
  keeps("long double against 113 bits", low_digits, 1e-17);
}

TEST(Formula, KnowsOnWhatItDepends) {
  const Formula f("0*x + 2", {"x", "y"});
  EXPECT_TRUE(f.depends_on(0)) << "as it is written";
  EXPECT_FALSE(f.depends_on(1));
}

TEST(Formula, MistakesAreNamedWithTheirPlace) {
  const std::pair<std::string, const char*> bad[] = {
      {"", "\"\": it ends at character 1, expected a number, a name or '('"},
      {"0.5*k*ph^2",
       "\"0.5*k*ph^2\": unknown name 'ph' at character 7, the nearest known one is "
       "'phi' (known: phi, sigma, k, pi)"},
      {"k*cosch(phi)", "unknown function 'cosch' at character 3, the nearest known one is 'cosh'"},
      {"k*phi**2", "there is '**' at character 6, expected '^' for a power"},
      {"k*(phi + 1", "it ends at character 11, expected ')'"},
      {"k*phi)", "there is ')' at character 6, expected an operator or the end"},
      {"2 phi*k", "there is 'phi' at character 3, expected an operator or the end"},
      {"k*phi^phi", "there is a power whose exponent varies at character 6, expected a constant"},
      {"k*sin", "there is sin at character 3, expected one operand in brackets after it"},
      {"k*sin(phi, 1)", "there is sin at character 3, expected one operand in brackets"},
      {"k*max(phi)", "there is max at character 3, expected two operands in brackets after it"},
      {"phi^2", "parameter 'k' is not in \"phi^2\", expected only what is used"},
      {"k*1e999", "expected a number"},
      {std::string(4001, '1'), "has 4001 characters, expected at most 4000"},
      {std::string(300, '(') + "k", "there are too many brackets or signs at character"},
      {std::string(300, '-') + "k", "there are too many brackets or signs at character"}};
  for (const auto& [text, words] : bad) {
    const auto why = refusal([&, t = text] { Formula(t, {"phi", "sigma"}, {{"k", 1}}); });
    EXPECT_NE(why.find(words), std::string::npos) << why << "\n  expected: " << words;
  }
  std::string chain = "k*phi";
  for (int i = 0; i < 250; ++i) chain += "+phi";
  EXPECT_NE(refusal([&] {
              Formula(chain, {"phi"}, {{"k", 1}});
            }).find("has more than 200 signs and functions within each other"),
            std::string::npos);
  const std::pair<Formula::Constants, const char*> parameters[] = {
      {{{"phi", 1}}, "parameter 'phi' has a name of the language of formulas, expected another"},
      {{{"pi", 1}}, "parameter 'pi' has a name"},
      {{{"log", 1}}, "parameter 'log' has a name"},
      {{{"2k", 1}}, "parameter '2k' is no name, expected letters, digits and '_'"},
      {{{"k", NAN}}, "parameter 'k' is nan, expected a finite number"}};
  for (const auto& [constants, words] : parameters) {
    const auto why = refusal([&, c = constants] { Formula("phi", {"phi"}, c); });
    EXPECT_NE(why.find(words), std::string::npos) << why;
  }
}

}  // namespace
}  // namespace porthos::test::formula_test
