#include "space/split_scheme.h"

#include <cmath>

#include "phs/error.h"

namespace porthos::space {
namespace {

constexpr const char* lobatto_source =
    "Laskar, Robutel 2001 (Celest. Mech. Dyn. Astron. 80), S-BAB_n";

/// The drifts are set so that they sum to 1 and the scheme is palindromic.
SplitScheme aba864() {
  const double a[] = {
      0.0711334264982231177779387300061549964174, 0.241153427956640098736487795326289649618,
      0.521411761772814789212136078067994229991, -0.333698616227678005726562603400438876027};
  const double b[] = {
      0.183083687472197221961703757166430291072, 0.310782859898574869507522291054262796375,
      -0.0265646185119588006972121379164987592663, 0.0653961422823734184559721793911134363710};
  return {"aba864",
          "orders 8, 6, 4 in the terms ε, ε², ε³; steps backwards inside a step",
          {0, b[0], b[1], b[2], b[3], b[2], b[1], b[0], 0},
          {a[0], a[1], a[2], a[3], a[3], a[2], a[1], a[0]},
          4,
          8,
          false,
          0,
          "Blanes et al. 2013 (Appl. Numer. Math. 68), table 3"};
}

}  // namespace

const std::vector<SplitScheme>& split_schemes() {
  static const std::vector<SplitScheme> all = [] {
    const double s5 = std::sqrt(5.0), s21 = std::sqrt(21.0) / 14;
    const double out6 = 0.5 - 0.1 * s5, mid6 = 0.2 * s5;
    std::vector<SplitScheme> list{{"strang",
                                   "a kick at both ends of a step",
                                   {0.5, 0.5},
                                   {1.0},
                                   2,
                                   2,
                                   true,
                                   0,
                                   "Strang 1968; Wisdom, Holman 1991"},
                                  {"lobatto4",
                                   "kicks at both ends and the middle",
                                   {1.0 / 6, 2.0 / 3, 1.0 / 6},
                                   {0.5, 0.5},
                                   2,
                                   4,
                                   true,
                                   0,
                                   lobatto_source},
                                  {"lobatto6",
                                   "kicks at four nodes",
                                   {1.0 / 12, 5.0 / 12, 5.0 / 12, 1.0 / 12},
                                   {out6, mid6, out6},
                                   2,
                                   6,
                                   true,
                                   0,
                                   lobatto_source},
                                  {"lobatto8",
                                   "kicks at five nodes",
                                   {0.05, 49.0 / 180, 16.0 / 45, 49.0 / 180, 0.05},
                                   {0.5 - s21, s21, s21, 0.5 - s21},
                                   2,
                                   8,
                                   true,
                                   0,
                                   lobatto_source}};
    const double c[] = {1.0 / 72, (13 - 5 * s5) / 288, (3861 - 791 * std::sqrt(21.0)) / 64800};
    for (size_t i = 1; i <= 3; ++i) {
      SplitScheme s = list[i];
      s.name += "c";
      s.title += ", corrected";
      s.order = 4;
      s.corrector = c[i - 1];
      s.source = "Laskar, Robutel 2001 (Celest. Mech. Dyn. Astron. 80), S-BABC_n";
      list.push_back(std::move(s));
    }
    list.push_back(aba864());
    return list;
  }();
  return all;
}

const SplitScheme& split_scheme(const std::string& name) {
  return find_named(split_schemes(), name, "there is no splitting");
}

}  // namespace porthos::space
