// The picture of a comparison: its names stand where they can be read.
#include "scene/compare/work_precision_plot.h"

#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "integrators/catalogue.h"
#include "scene/compare/compare.h"
#include "scene/plot/svg.h"
#include "tests/run/scenes.h"
#include "tests/support/bounds.h"

namespace porthos::test::work_precision_plot_test {
namespace {

/// Methods whose lines cross each other: of orders 1, 2, ... and of other costs.
scene::Comparison crossing(const std::vector<std::string>& names) {
  scene::Comparison c;
  c.title = "crossing";
  c.by_energy = true;
  c.duration_s = 100;
  for (size_t k = 0; k < names.size(); ++k) {
    scene::MethodTrials m{integrators::declaration_of(names[k]), {}, false, false};
    for (double step = 1; step > 1e-2; step /= 2) {
      scene::Trial t;
      t.setting = {names[k], step, 1e-12};
      t.report.cpu_s = 0.01 * (1 + 0.3 * double(k)) / step;
      t.report.energy.max_rel_error =
          1e-3 * std::pow(10, 0.2 * double(k)) * std::pow(step, 1 + k % 4);
      m.trials.push_back(t);
    }
    c.methods.push_back(std::move(m));
  }
  return c;
}

struct Seen {
  int names = 0, on_lines = 0, on_names = 0;
};
/// Of the names in the plot, and how many lie on lines or on each other.
Seen seen_in(const std::string& svg) {
  tinyxml2::XMLDocument document;
  document.Parse(svg.c_str());
  const auto* root = document.RootElement();
  struct Name {
    double x1, y1, x2, y2;
  };
  std::vector<Name> names;
  for (auto* t = root->FirstChildElement("text"); t; t = t->NextSiblingElement("text"))
    if (t->Attribute("paint-order")) {
      const double x = t->DoubleAttribute("x"), y = t->DoubleAttribute("y");
      names.push_back({x, y - 8, x + scene::text_width(t->GetText(), 11.5), y + 2});
    }
  Seen seen{int(names.size())};
  for (size_t i = 0; i < names.size(); ++i) {
    const Name& n = names[i];
    for (size_t j = 0; j < i; ++j)
      seen.on_names +=
          n.x1 < names[j].x2 && names[j].x1 < n.x2 && n.y1 < names[j].y2 && names[j].y1 < n.y2;
    bool on_line = false;
    for (auto* l = root->FirstChildElement("polyline"); l; l = l->NextSiblingElement("polyline")) {
      std::istringstream in(l->Attribute("points"));
      char comma;
      double x0 = NAN, y0 = NAN;
      for (double x, y; in >> x >> comma >> y; x0 = x, y0 = y)
        for (int k = 0; k <= 1000; ++k) {
          const double f = k / 1000.0, at = x0 + f * (x - x0), height = y0 + f * (y - y0);
          on_line |= at > n.x1 && at < n.x2 && height > n.y1 && height < n.y2;
        }
    }
    seen.on_lines += on_line;
  }
  return seen;
}

TEST(WorkPrecisionPlot, NamesLieOnNoLineAndNoOtherName) {
  const std::vector<std::string> all{
      "gauss4",         "gauss8",       "gauss16",  "rk4",      "midpoint",
      "stormer_verlet", "blanes_moan6", "lobatto4", "gonzalez", "tao2"};
  for (const size_t methods : {2, 5, 10}) {
    const auto c = crossing({all.begin(), all.begin() + long(methods)});
    const auto svg = scene::work_precision_plot(c, 1e-6);
    const Seen seen = seen_in(svg);
    std::printf("  %zu methods: %d named beside their lines\n", methods, seen.names);
    EXPECT_EQ(seen.on_lines, 0);
    EXPECT_EQ(seen.on_names, 0);
    EXPECT_GE(seen.names, int(std::min<size_t>(methods, 7))) << "there is room";
    for (const auto& m : c.methods)  // in the legend
      EXPECT_NE(svg.find(">" + m.label() + "<"), std::string::npos);
  }
  // Control: names right of their dots, wherever that is, lie on lines.
  auto c = crossing(all);
  auto svg = scene::work_precision_plot(c, 1e-6);
  size_t moved = 0;
  for (size_t at = 0; (at = svg.find("<polyline points=\"", at)) != svg.npos && moved < 3;
       ++moved) {
    at += 18;
    const std::string dot = svg.substr(at, svg.find(' ', at) - at);
    const size_t comma = dot.find(',');
    svg.insert(svg.find("</svg>"), "<text x=\"" + dot.substr(0, comma) + "\" y=\"" +
                                       dot.substr(comma + 1) +
                                       "\" paint-order=\"stroke\">some_method</text>\n");
  }
  EXPECT_GT(seen_in(svg).on_lines, 0);
}

// The picture is made again from compare.json alone. Control: of other numbers it is another one.
TEST(WorkPrecisionPlot, IsDrawnAgainFromTheResults) {
  const TemporaryFolder folder;
  auto c = crossing({"gauss4", "rk4", "gauss16"});
  for (const auto control :
       {integrators::StepControl::fixed, integrators::StepControl::time_transformed}) {
    auto more = c.methods[2];
    more.short_sweeps = control == integrators::StepControl::fixed;
    more.control = control;
    for (scene::Trial& t : more.trials) {
      if (more.short_sweeps) t.setting.iteration_tolerance = 1e-6;
      t.setting.control = control;
      t.report.cpu_s *= 0.5;
    }
    c.methods.push_back(more);
  }
  c.methods[1].trials[0].failure = "did not converge";
  const scene::Scene scene;
  const auto json = folder / "compare.json", svg = folder / "work_precision.svg";
  write_bytes(json, scene::comparison_json(scene, c));
  EXPECT_EQ(scene::replot_comparison(folder / ""), svg.string());
  const std::string drawn = read_bytes(svg);
  EXPECT_EQ(drawn, scene::work_precision_plot(c, scene.target()));
  for (const char* name : {">gauss16 short<", ">gauss16 time_transformed<"})
    EXPECT_NE(drawn.find(name), drawn.npos) << name;
  c.methods[0].trials[0].report.cpu_s *= 2;
  EXPECT_NE(drawn, scene::work_precision_plot(c, scene.target())) << "control";
  c.by_energy = false;
  c.trajectory_time_s = 3;
  c.reference.emplace().error = 1e-6;
  for (auto& m : c.methods)
    for (auto& t : m.trials) t.trajectory_error = 0.1 * t.report.energy.max_rel_error;
  write_bytes(json, scene::comparison_json(scene, c));
  (void)scene::replot_comparison(folder / "");
  EXPECT_EQ(read_bytes(svg), scene::work_precision_plot(c, scene.target())) << "of trajectories";
  write_bytes(json, "{}");
  EXPECT_NE(refusal([&] { (void)scene::replot_comparison(folder / ""); }).find("is damaged"),
            std::string::npos);
  fs::remove(json);
  EXPECT_NE(refusal([&] {
              (void)scene::replot_comparison(folder / "");
            }).find("has no compare.json, expected the results of porthos compare"),
            std::string::npos);
}

}  // namespace
}  // namespace porthos::test::work_precision_plot_test
