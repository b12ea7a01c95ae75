// Matched loops from formulas of the user's own: texts, as SymPy writes them.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include "energy_shaping/matching/matched_loop.h"
#include "phs/functions/formula.h"
#include "python/bind.h"
#include "python/keywords.h"

namespace porthos::python {
namespace {

namespace es = energy_shaping;
using phs::Formula;
using py::arg;
using FormulaTexts = std::vector<std::string>;

constexpr size_t most_formula_gains = 8;

/// M_d and V_d as formulas of N coordinates and of the gains.
template <int N, bool solved>
struct FormulaDesign {
  static constexpr int n = N;
  static constexpr bool solve_skew = solved;
  std::string name;
  std::vector<es::Gain> list;
  std::vector<Formula> Md, Vd;  // N × N; one

  std::vector<es::Gain> gains() const { return list; }
  template <class S, class T>
  void mass(std::span<const S> q, std::span<const T> k, std::span<S> M) const {
    const auto x = variables(q, k);
    for (size_t i = 0; i < M.size(); ++i) M[i] = Md[i].at(x.of(list));
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T> k) const {
    return Vd[0].at(variables(q, k).of(list));
  }

 private:
  template <class S>
  struct Variables {
    std::array<S, size_t(N) + most_formula_gains> x;
    std::span<const S> of(const std::vector<es::Gain>& k) const {
      return std::span<const S>(x).first(size_t(N) + k.size());
    }
  };
  template <class S, class T>
  Variables<S> variables(std::span<const S> q, std::span<const T> k) const {
    Variables<S> v;
    for (size_t i = 0; i < size_t(N); ++i) v.x[i] = q[i];
    for (size_t i = 0; i < list.size(); ++i) v.x[size_t(N) + i] = S(k[i]);
    return v;
  }
};

template <int N, bool solved>
std::shared_ptr<const es::Shaping> formula_design(
    const std::string& name, const FormulaTexts& coordinates, const std::vector<FormulaTexts>& Md,
    const std::string& Vd, const std::vector<std::pair<std::string, double>>& k) {
  FormulaDesign<N, solved> d{name, {}, {}, {}};
  FormulaTexts known = coordinates;
  for (const auto& [gain, value] : k) {
    d.list.push_back({gain, value});
    known.push_back(gain);
  }
  const auto formula = [&](const std::string& what, const std::string& text) {
    try {
      return Formula(text, known);
    } catch (const InvalidArgument& e) {
      throw InvalidArgument(fmt::format("matched_loop: {}: {}", what, e.what()));
    }
  };
  for (int i = 0; i < N * N; ++i)
    d.Md.push_back(
        formula(fmt::format("Md[{}][{}]", i / N, i % N), Md[size_t(i / N)][size_t(i % N)]));
  d.Vd.push_back(formula("Vd", Vd));
  return es::shaping(std::move(d));
}

void check_formulas(const FormulaTexts& coordinates, const std::vector<FormulaTexts>& Md,
                    const std::vector<std::pair<std::string, double>>& gains) {
  const size_t n = coordinates.size();
  if (n != 2 && n != 3)
    throw InvalidArgument(
        fmt::format("matched_loop: {} coordinates are named, expected 2 or 3", n));
  bool square = Md.size() == n;
  for (const FormulaTexts& row : Md) square = square && row.size() == n;
  if (!square)
    throw InvalidArgument(
        fmt::format("matched_loop: Md is not {0} rows of {0} formulas, as many as coordinates", n));
  if (gains.size() > most_formula_gains)
    throw InvalidArgument(fmt::format("matched_loop: there are {} gains, expected {} or less",
                                      gains.size(), most_formula_gains));
}

std::shared_ptr<es::MatchedLoop> matched_from_texts(
    std::shared_ptr<const phs::Model> plant, const FormulaTexts& actuated,
    const FormulaTexts& coordinates, const std::vector<FormulaTexts>& Md, const std::string& Vd,
    const std::vector<std::pair<std::string, double>>& gains, bool solve_skew,
    std::vector<double> rest, std::vector<double> lower, std::vector<double> upper, double rate,
    int samples, double matching, bool refuse, const std::string& name) {
  check_formulas(coordinates, Md, gains);
  const auto make = coordinates.size() == 2
                        ? (solve_skew ? formula_design<2, true> : formula_design<2, false>)
                        : (solve_skew ? formula_design<3, true> : formula_design<3, false>);
  const auto shaping = make(name, coordinates, Md, Vd, gains);
  if (rest.empty()) rest.assign(coordinates.size(), 0.0);
  es::MatchingOptions o;
  o.region = {std::move(lower), std::move(upper), rate, samples};
  o.matching = matching;
  o.refuse = refuse;
  const py::gil_scoped_release released;
  return std::make_shared<es::MatchedLoop>(std::move(plant), shaping, actuated, std::move(rest), o);
}

}  // namespace

void bind_matched_formulas(py::module_& core) {
  py::module_ m = core.attr("energy_shaping");
  m.def("matched_from_texts", &matched_from_texts, arg("plant"), arg("actuated"),
        arg("coordinates"), arg("Md"), arg("Vd"), arg("gains"), arg("solve_skew"), arg("rest"),
        arg("lower"), arg("upper"), arg("rate"), arg("samples"), arg("matching"), arg("refuse"),
        arg("name"), "What matched_loop() calls, with texts for its formulas.");
}

}  // namespace porthos::python
