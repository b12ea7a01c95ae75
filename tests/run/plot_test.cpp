#include "scene/plot/plot.h"
#include "scene/plot/ledger_plot.h"
#include "scene/plot/look.h"
#include "scene/plot/svg.h"
#include "scene/plot/trace_plot.h"

#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <random>
#include <regex>
#include <sstream>

#include "tests/places.h"
#include "tests/support/bounds.h"

namespace porthos::test::plot_test {
namespace {

using namespace scene;

Envelope random_walk(double first, double last, int n) {
  Envelope e(first, last);
  std::mt19937_64 rng(2);
  std::normal_distribution<double> step(0, 1e-17);
  double error = 0;
  for (int i = 0; i <= n; ++i) {
    e.add(i * last / n, error);
    error += step(rng);
  }
  return e;
}

void expect_valid(const std::string& svg) {
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(svg.c_str()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
  EXPECT_STREQ(document.RootElement()->Name(), "svg");
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(Plot, IsValidXmlWhateverTheTitle) {
  const auto e = random_walk(1, 1e4, 10000);
  const auto svg = trace_plot({residual_panel(e, 1e-12)}, "a <b> & \"c\" \x01 — ü", "gauss16");
  expect_valid(svg);
  EXPECT_NE(svg.find("a &lt;b&gt; &amp;"), std::string::npos);
}

TEST(Plot, DecimatesTo1500ColumnsAndKeepsTheExtremes) {
  Envelope e(1, 1e6);
  for (int i = 0; i <= 1000000; ++i) e.add(i, i == 777777 ? 1e-3 : 1e-9);
  EXPECT_LE(e.points().size(), 1500u);
  double highest = 0;
  for (const auto& p : e.points()) highest = std::max(highest, p.high);
  EXPECT_EQ(highest, 1e-3);
}

TEST(Plot, HasALogarithmicTimeAxisOnlyOverDecades) {
  EXPECT_TRUE(Envelope(1, 101).logarithmic());
  EXPECT_FALSE(Envelope(1, 99).logarithmic());
}

TEST(Plot, SurvivesEveryDegenerateSeries) {
  for (const double value : {0.0, 1e-300, 1e300, HUGE_VAL, double(NAN)}) {
    Envelope e(1, 50);
    for (int i = 0; i <= 50; ++i) e.add(i, value);
    expect_valid(trace_plot({residual_panel(e, 1e-12)}, "t", "s"));
  }
  expect_valid(trace_plot({residual_panel(Envelope(0, 0), std::nullopt)}, "", ""));
  Envelope one(0, 0);
  one.add(0, 0);
  expect_valid(trace_plot({residual_panel(one, 0.0)}, "t", "s"));
}

/// A coordinate that a lock holds differs by its last bit: ticks that fine would not end.
TEST(Plot, TracesOfAlmostEqualValuesHaveTicks) {
  for (const double low : {0.0, 1e-300, 0.32, -5e6, 1e300})
    for (const double high : {low, std::nextafter(low, HUGE_VAL), low + 1e-10 * std::fabs(low)}) {
      const std::vector<TracePanel> panels{{"angle [rad]", {{"j", {0, 1}, {low, high}}}}};
      const auto svg = trace_plot(panels, "t", "s");
      expect_valid(svg);
      EXPECT_LT(svg.size(), 10000u) << low << ' ' << high;
    }
}

TEST(Plot, NumbersAreWrittenAsAReaderWritesThem) {
  EXPECT_EQ(number_text(1500), "1500");
  EXPECT_EQ(number_text(-0.5), "−0.5");
  EXPECT_EQ(number_text(2.5e10), "2.5·10¹⁰");
  EXPECT_EQ(number_text(-1e-12), "−10⁻¹²");
  EXPECT_EQ(number_text(123456.789), "123456.789");
  EXPECT_EQ(number_text(2e-4, true), "2·10⁻⁴");
  EXPECT_EQ(number_text(0, true), "0");
  EXPECT_EQ(number_text(-1234.56, false, 3), "−1230");
  EXPECT_EQ(number_text(9.9996e-7, false, 3), "10⁻⁶");
}

/// The texts of a picture.
std::vector<std::string> texts(const std::string& svg) {
  static const std::regex text("<text[^>]*>([^<]*)</text>");
  std::vector<std::string> all;
  for (std::sregex_iterator i(svg.begin(), svg.end(), text), end; i != end; ++i)
    all.push_back((*i)[1]);
  return all;
}

TEST(Plot, NoAxisHasAnEOrAHyphenForAMinus) {
  size_t numbers = 0;
  for (const double size : {1e-13, 3e-5, 0.4, 1500.0, 7.5e5, 4e8, 2e300}) {
    const std::vector<TracePanel> panels{{"x [m]", {{"a", {0, 7e3}, {-size, size}}}}};
    for (const auto& svg : {trace_plot(panels, "", ""), figure(panels)})
      for (const auto& t : texts(svg)) {
        numbers += t.find_first_of("0123456789") != std::string::npos;
        EXPECT_FALSE(std::regex_search(t, std::regex("[0-9]e[+-]?[0-9]|-[0-9]"))) << t;
      }
  }
  EXPECT_GT(numbers, 100u);  // control: there are such texts
}

LedgerSeries idle_ports(int idle) {
  LedgerSeries s{{0, 1}, {{"kinetic", {1, 2}}}, {{"motor", {0, 1}}}, {}, {0, 1e-16}};
  for (int k = 0; k < idle; ++k) s.supplied.push_back({"port_" + std::to_string(k), {0, 0}});
  return s;
}

TEST(Plot, LinesThatAreZeroAreCountedInTheLegend) {
  const auto many = texts(ledger_plot(idle_ports(7), "t", "s"));
  EXPECT_EQ(std::ranges::count(many, "7 others: 0"), 1);
  EXPECT_EQ(std::ranges::count(many, "port_3 (in)"), 0);
  EXPECT_EQ(std::ranges::count(many, "motor (in)"), 1);
  const auto few = texts(ledger_plot(idle_ports(2), "t", "s"));  // control: a few have their names
  EXPECT_EQ(std::ranges::count(few, "port_1 (in)"), 1);
  auto moved = idle_ports(7);  // control: one that is not 0 has its name
  moved.supplied[4].value[1] = 1e-9;
  const auto named = texts(ledger_plot(moved, "t", "s"));
  EXPECT_EQ(std::ranges::count(named, "6 others: 0"), 1);
  EXPECT_EQ(std::ranges::count(named, "port_3 (in)"), 1);
}

TEST(Plot, AFigureIsOfOneColumnAndItsLinesDifferByTheirDashes) {
  TracePanel p{"joints [rad]", {}};
  for (size_t k = 0; k < most_lines; ++k)
    p.lines.push_back({"joint_" + std::to_string(k), {0, 1}, {0.1, double(k)}});
  const auto svg = figure({p});
  expect_valid(svg);
  tinyxml2::XMLDocument document;
  document.Parse(svg.c_str());
  const auto* root = document.RootElement();
  EXPECT_NEAR(std::stod(root->Attribute("width")) / 72 * 25.4, 85, 0.01);
  EXPECT_NEAR(std::stod(root->Attribute("height")) / 72 * 25.4, 60, 0.01);
  EXPECT_STREQ(std::strstr(root->Attribute("width"), "pt"), "pt");
  std::vector<std::string> dashes;
  for (auto* l = root->FirstChildElement("polyline"); l; l = l->NextSiblingElement("polyline")) {
    const char* dash = l->Attribute("stroke-dasharray");
    dashes.emplace_back(dash ? dash : "");
  }
  ASSERT_EQ(dashes.size(), most_lines);
  std::ranges::sort(dashes);
  EXPECT_EQ(std::ranges::adjacent_find(dashes), dashes.end());
  EXPECT_EQ(svg.find("font-size=\"7"), std::string::npos);
  EXPECT_NE(svg.find("font-size=\"8\""), std::string::npos);
}

TEST(Plot, ALineThatCoversAnAreaHasNoDashes) {
  const auto dashed = [](int turns, auto picture) {
    TracePanel p{"joints [rad]", {{"a", {0, 1}, {0, 1}}, {"b", {}, {}}}};
    for (int i = 0; i <= 1500; ++i) {
      p.lines[1].t.push_back(i / 1500.0);
      p.lines[1].value.push_back((i * turns / 1500) % 2 ? 1 : -1);
    }
    const std::string svg = picture(std::vector{p});
    expect_valid(svg);
    return svg.find("stroke-dasharray") != svg.npos;
  };
  const auto screen = [](const auto& p) { return trace_plot(p, "t", "s"); };
  EXPECT_FALSE(dashed(1500, screen));
  EXPECT_FALSE(dashed(1500, figure));
  EXPECT_TRUE(dashed(40, screen)) << "the control: its swings are apart";
  EXPECT_TRUE(dashed(40, figure));
}

TEST(Plot, ALineHasNoNameWhereItsPanelHasIt) {
  const auto named = [](const char* what) {
    return std::ranges::count(texts(figure({{what, {{"m", {0, 1}, {0, 1}}}}})), "m");
  };
  EXPECT_EQ(named("m [rad]"), 0);
  EXPECT_EQ(named("motors [rad]"), 1) << "the control: another name that begins alike";
}

TEST(Plot, AFigureOfManyPanelsHasTwoColumns) {
  const auto size = [](size_t panels) {
    std::vector<TracePanel> all(panels, {"joints [rad]", {{"a", {0, 1}, {0, 1}}}});
    const auto svg = figure(all);
    expect_valid(svg);
    EXPECT_EQ(std::ranges::count(texts(svg), "joints [rad]"), long(panels));
    tinyxml2::XMLDocument document;
    document.Parse(svg.c_str());
    const auto* root = document.RootElement();
    return std::pair{std::round(std::stod(root->Attribute("width")) / 72 * 25.4),
                     std::round(std::stod(root->Attribute("height")) / 72 * 25.4)};
  };
  EXPECT_EQ(size(6), std::pair(85., 360.));  // the control
  EXPECT_EQ(size(7), std::pair(170., 240.));
  EXPECT_EQ(size(12), std::pair(170., 360.));
}

/// Width of a text in DejaVu Sans, whose advances are in 1/1000 of its size.
double width_in_dejavu(const std::string& text, double size) {
  static const std::map<char, double> advance{
      {'a', 613}, {'b', 635}, {'d', 635}, {'e', 615}, {'f', 352}, {'h', 634}, {'i', 278},
      {'j', 278}, {'l', 278}, {'m', 974}, {'n', 634}, {'o', 612}, {'p', 635}, {'r', 411},
      {'s', 521}, {'t', 392}, {'u', 634}, {'w', 818}, {'_', 500}, {'1', 636}, {'2', 636},
      {'A', 684}, {'D', 770}, {'E', 632}, {'F', 575}, {'H', 752}, {'L', 557}, {'M', 863},
      {'N', 748}, {'O', 787}, {'R', 695}, {'T', 611}, {'U', 732}, {'W', 989}, {'c', 550},
      {'g', 635}, {'q', 635}, {'v', 592}, {'.', 318}, {' ', 318}, {'(', 390}, {')', 390}};
  double sum = 0;
  for (const char c : text) sum += advance.at(c);
  return 1e-3 * size * sum;
}

/// By how much texts of the legend of a figure reach into the dashes right of them [pt].
double overlap(const std::vector<std::string>& names) {
  TracePanel p{"joints [rad]", {}};
  for (const auto& n : names) p.lines.push_back({n, {0, 1}, {0.1, 1}});
  tinyxml2::XMLDocument document;
  document.Parse(figure({p}).c_str());
  const auto* root = document.RootElement();
  double most = -HUGE_VAL;
  for (auto* t = root->FirstChildElement("text"); t; t = t->NextSiblingElement("text")) {
    if (std::ranges::find(names, t->GetText()) == names.end()) continue;
    const double end = t->DoubleAttribute("x") + width_in_dejavu(t->GetText(), 8);
    most = std::max(most, end - root->DoubleAttribute("width"));
    const auto* next = t->NextSiblingElement();  // the dash of the name beside it
    if (!next || std::strcmp(next->Name(), "line") != 0) continue;
    if (std::fabs(t->DoubleAttribute("y") - next->DoubleAttribute("y1")) < 4)
      most = std::max(most, end - next->DoubleAttribute("x1"));
  }
  return most;
}

TEST(Plot, NamesOfALegendDoNotReachTheDashesBesideThem) {
  const std::vector<std::string> arm{"arm1_panda_joint1", "arm2_panda_joint2", "arm1_panda_joint2"},
      other{"LEFT_WHEEL_MOMENTUM", "mmm_momentum", "HEAD_ROLL", "shoulder", "wheel_1"};
  const std::vector<std::string> works{"m.theta.torque (in)", "m.sigma.rate (in)",
                                       "m.theta.viscous (lost)", "elbow.damper (lost)"};
  keeps("17 letters of lower case [pt]", overlap(arm), 0);
  keeps("narrow letters [pt]", overlap(works), 0);
  keeps("capitals and wide letters [pt]", overlap(other), 0);
  // two of 17 letters stand side by side, so that there is something to reach
  breaks("of the works, were texts a tenth wider [pt]",
         overlap(works) + 0.1 * width_in_dejavu(works[2], 8), 0);
  breaks("the same, were texts a quarter wider [pt]",
         overlap(arm) + 0.25 * width_in_dejavu(arm[0], 8), 0);
}

/// The ticks of y of a picture of one panel: the least distance of a label from the panel's name
/// [px | pt], by the advances of DejaVu Sans; and how high the panel is.
struct Layout {
  double gap, height;
};
Layout layout_of(const std::string& svg, const std::string& name) {
  tinyxml2::XMLDocument document;
  document.Parse(svg.c_str());
  const auto* root = document.RootElement();
  Layout l{HUGE_VAL, 0};
  double least = HUGE_VAL, most = -HUGE_VAL, descent = 0;
  for (auto* t = root->FirstChildElement("text"); t; t = t->NextSiblingElement("text"))
    if (const char* at = t->Attribute("transform"); at && t->GetText() == name) {
      std::sscanf(at, "translate(%lf", &descent);
      descent += 0.24 * t->DoubleAttribute("font-size");  // below the base line of turned letters
    }
  for (auto* t = root->FirstChildElement("text"); t; t = t->NextSiblingElement("text")) {
    if (!t->Attribute("text-anchor", "end")) continue;
    double em = 0;
    for (const char c : std::string(t->GetText()))
      em += c == '.' ? 0.318 : c == '\xE2' ? 0.838 : (c & 0x80) ? 0 : 0.636;  // a minus begins so
    l.gap =
        std::min(l.gap, t->DoubleAttribute("x") - em * t->DoubleAttribute("font-size") - descent);
  }
  for (auto* p = root->FirstChildElement("polyline"); p; p = p->NextSiblingElement("polyline"))
    for (const char* at = std::strchr(p->Attribute("points"), ','); at;
         at = std::strchr(at + 1, ',')) {
      least = std::min(least, std::atof(at + 1));
      most = std::max(most, std::atof(at + 1));
    }
  l.height = most - least;
  return l;
}

// They are as wide as there is room.
TEST(Plot, LongLabelsOfTicksKeepOffTheNameOfTheAxis) {
  for (const auto& [low, high] : {std::pair{1.00001222, 1.00001245}, {-0.00154, -0.0009}}) {
    const std::vector<TracePanel> one{{"residual [J]", {{"m", {0, 1}, {low, high}}}}};
    for (const bool print : {true, false}) {
      const auto svg = print ? figure(one) : trace_plot(one, "t", "s");
      const double gap = layout_of(svg, "residual [J]").gap;
      EXPECT_GT(gap, print ? 2.5 : 5);
      EXPECT_LT(gap, print ? 7 : 10) << "they need the room";
    }
  }
}

// Control: one name less than a row's leaves the panel as it is.
TEST(Plot, ALegendOfManyNamesMakesAFigureTaller) {
  const auto panel = [](int works) {
    TracePanel p{"works [J]", {}};
    for (int k = 0; k < works; ++k)
      p.lines.push_back(
          {"shoulder_" + std::to_string(k) + ".controller.hold (lost)", {0, 1}, {0, k + 1.0}});
    return figure({p});
  };
  const double of_14 = layout_of(panel(14), "works [J]").height;
  std::printf("  curves of 14 works: %.1f pt\n", of_14);
  EXPECT_GT(of_14, 0.5 * height_in_print);
  EXPECT_LT(of_14, layout_of(panel(2), "works [J]").height) << "control";
}

size_t count(const std::string& text, const std::string& word) {
  size_t n = 0;
  for (size_t at = 0; (at = text.find(word, at)) != text.npos; ++at) ++n;
  return n;
}

TEST(Plot, AnAngleThatJumpsHasAGapThere) {
  std::vector<double> t, angle, rate;
  for (int i = 0; i < 200; ++i) {
    t.push_back(i);
    angle.push_back(std::remainder(0.1 * i, 2 * std::numbers::pi));  // three jumps
    rate.push_back(i < 100 ? -3.2 : 3.2);
  }
  const auto lines = [&](const std::string& what, const std::vector<double>& v) {
    const std::vector<TracePanel> panels{{what, {{"z", t, v}}}};
    EXPECT_EQ(count(figure(panels), "<polyline"), count(trace_plot(panels, "", ""), "<polyline"));
    return double(count(figure(panels), "<polyline"));
  };
  keeps("pieces of an angle that jumps thrice, off 4", std::fabs(lines("a [rad]", angle) - 4), 0);
  keeps("pieces of other numbers, off 1", std::fabs(lines("a [m]", angle) - 1), 0);
  keeps("of what leaves [-pi, pi], off 1", std::fabs(lines("a [rad]", rate) - 1), 0);
  breaks("control: an angle that jumps, off 1", std::fabs(lines("a [rad]", angle) - 1), 0);
}

/// The points of the lines or outlines of a picture.
std::vector<std::vector<std::pair<double, double>>> points_of(const std::string& svg,
                                                              const char* element) {
  tinyxml2::XMLDocument document;
  document.Parse(svg.c_str());
  const auto* root = document.RootElement();
  std::vector<std::vector<std::pair<double, double>>> all;
  for (auto* l = root->FirstChildElement(element); l; l = l->NextSiblingElement(element)) {
    std::istringstream in(l->Attribute("points"));
    all.emplace_back();
    char comma;
    for (double x, y; in >> x >> comma >> y;) all.back().emplace_back(x, y);
  }
  return all;
}

TEST(Plot, ALineBreaksWhereRecordsAreMissing) {
  TracePanel p{"x [m]", {{"a", {}, {}}}};
  for (int i = 0; i < 4000; ++i) {  // drawn thinned
    p.lines[0].t.push_back(i < 2000 ? i : i + 500);
    p.lines[0].value.push_back(std::sin(1e-3 * i));
  }
  const auto pieces = [](const TracePanel& panel) {
    return points_of(trace_plot({panel}, "", ""), "polyline").size();
  };
  EXPECT_EQ(pieces(p), 1u) << "control: no record is missing";
  p.holes = {1999};
  EXPECT_EQ(pieces(p), 2u);
  p.lines[0].value[1001] = NAN;  // between two that are drawn
  EXPECT_EQ(pieces(p), 3u);
  p.holes = {3999 + 500};
  EXPECT_EQ(pieces(p), 2u) << "control: nothing follows";
}

TEST(Plot, WhatIsHeldIsDrawnAsStairs) {
  std::vector<double> t, held, smooth, rest;
  for (int i = 0; i < 100; ++i) {
    t.push_back(i);
    const double angle = 0.1 * (i / 5);
    held.push_back(5 + std::sin(angle) + 1e-15 * (i % 3));  // with the rounding of a difference
    smooth.push_back(5 + std::sin(0.02 * i));
    rest.push_back(i < 60 ? 0 : std::sin(0.02 * (i - 59)));
  }
  EXPECT_TRUE(is_held(held));
  EXPECT_FALSE(is_held(smooth));
  EXPECT_FALSE(is_held(rest)) << "control: it rests before it moves";
  EXPECT_FALSE(is_held({0, 0, 1, 1})) << "control: one jump is no stair";
  EXPECT_FALSE(is_held({0, 1, 0, 1, 0, 1})) << "control: sampled at each record";
  EXPECT_TRUE(is_held({0, 0, 1, 1, NAN, 2, 2, 3, 3}));
  const auto slanted = [&](const std::vector<double>& v) {
    size_t n = 0;
    for (const auto& l : points_of(figure({{"u [N m]", {{"u", t, v}}}}), "polyline"))
      for (size_t i = 1; i < l.size(); ++i)
        n += l[i].first != l[i - 1].first && l[i].second != l[i - 1].second;
    return double(n);
  };
  keeps("slanted pieces of a held line", slanted(held), 0);
  breaks("of a smooth one", slanted(smooth), 0);
}

TEST(Plot, TheOutlineOfABandGoesForthAndBack) {
  TracePanel p{"x [m]", {{"b", {0, 1, 2, 3}, {2, 3, 4, 5}, Stroke::band, {1, 1, 2, 2}}}};
  const auto outline = points_of(trace_plot({p}, "", ""), "polygon").at(0);
  ASSERT_EQ(outline.size(), 8u);
  for (size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(outline[k].first, outline[7 - k].first);
    EXPECT_LT(outline[k].second, outline[7 - k].second) << "the upper edge first";
  }
  EXPECT_LT(outline[0].first, outline[3].first);
}

TEST(Plot, InstantsAreMarkedWithTheirNames) {
  TracePanel p{"x [m]", {{"a", {0, 10}, {0, 1}}}};
  const auto rules = [&] { return count(figure({p}), "<line"); };
  const size_t before = rules();
  p.marks = {{5, "phase 2"}, {5.001, "phase 3"}, {11, "beyond"}};
  EXPECT_EQ(rules(), before + 2);
  const auto names = texts(figure({p}));
  EXPECT_EQ(std::ranges::count(names, "phase 3"), 1);
  EXPECT_EQ(std::ranges::count(names, "phase 2"), 0) << "no room beside the next";
  EXPECT_EQ(std::ranges::count(names, "beyond"), 0);
}

TEST(Plot, TheLegendTellsWhichLinesAreElsewhere) {
  TracePanel p{"joints [rad]", {{"a", {0, 1}, {0, 1}}}};
  p.others = "2 others are in 'turning joints'";
  for (const auto& svg : {figure({p}), trace_plot({p}, "", "")})
    EXPECT_EQ(std::ranges::count(texts(svg), p.others), 1);
}

/// The report has the colours of the SVG files.
TEST(Plot, ThePageHasTheSameColours) {
  std::ifstream file(PORTHOS_SOURCE_DIR "/report/web/src/style.css");
  const std::string css{std::istreambuf_iterator<char>(file), {}};
  for (size_t k = 0; k < colour::lines.size(); ++k)
    EXPECT_NE(css.find("--c" + std::to_string(k) + ": " + colour::lines[k]), std::string::npos)
        << k;
  EXPECT_EQ(css.find("--c0: " + std::string(colour::lines[1])), std::string::npos);
}

}  // namespace
}  // namespace porthos::test::plot_test
