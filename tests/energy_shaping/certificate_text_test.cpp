// How a certificate reads, as text, as HTML and for programs.
#include <nlohmann/json.hpp>

#include "energy_shaping/loop/closed_loop.h"
#include "tests/support/bounds.h"

namespace porthos::energy_shaping::certificate_text_test {
namespace {

using test::refusal;

TEST(Certificate, HtmlIsEscapedAndNamesWhatFails) {
  Certificate c("a <b>law</b> & more");
  c.at_most("force \"free\"", 2, 1, "joint <j3>", {0.5});
  const std::string html = c.html();
  EXPECT_NE(html.find("a &lt;b&gt;law&lt;/b&gt; &amp; more"), std::string::npos);
  EXPECT_NE(html.find("not certified: force &quot;free&quot;"), std::string::npos);
  EXPECT_NE(html.find("joint &lt;j3&gt; at (0.5)"), std::string::npos);
  EXPECT_EQ(html.find("<b>law"), std::string::npos);
  EXPECT_NE(html.find("<td>FAILS</td>"), std::string::npos);
}

/// A figure is no condition. Control: with one that holds all do.
TEST(Certificate, WithoutAConditionSaysThatNothingIsChecked) {
  Certificate c("law of a file");
  for (int figures = 0; figures < 2; ++figures) {
    EXPECT_TRUE(c.text().ends_with("\n  nothing is checked\n")) << c.text();
    EXPECT_NE(c.html().find("</b>: nothing is checked</p>"), std::string::npos) << c.html();
    EXPECT_TRUE(c.holds());
    c.report("gain", 2, "a figure");
  }
  c.at_most("residual", 0, 1, "");
  EXPECT_TRUE(c.text().ends_with("\n  all conditions hold\n")) << c.text();
  c.help("of a condition that holds");  // a control
  for (const char* what : {"it may <drift>", "it creaks"}) {
    c.report("gain", 2, "a figure");
    c.help(what);
  }
  EXPECT_TRUE(c.text().ends_with("\n  all conditions hold, but it may <drift>; it creaks\n"));
  EXPECT_NE(c.html().find("hold, but it may &lt;drift&gt;; it creaks</p>"), std::string::npos);
  EXPECT_TRUE(c.holds());
}

/// All that fails is named, with what to do; places have the names of the coordinates.
TEST(Certificate, NamesAllThatFailsAndWhatToDo) {
  Certificate c("a law");
  c.name_coordinates({"slide", "swing"});
  c.at_least("Hessian of V_d > 0", -1, 1e-12, "the softest is 'swing'", {0.5, -1});
  c.at_most("own condition", 2, 1, "of a test", {0.5, -1, 3, 4});
  c.at_most("rank of G", 0, 1, "holds");
  const std::string text = c.text();
  const auto says = [&](const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  says("the softest is 'swing' at slide 0.5, swing -1\n");
  says("of a test at slide 0.5, swing -1, momenta (3, 4)\n");
  says(
      "  NOT certified: Hessian of V_d > 0; own condition\n"
      "    Hessian of V_d > 0: raise the stiffness of the coordinate named; of a matched design "
      "try "
      "another ratio, of the other sign too\n");
  EXPECT_EQ(text.find("rank of G:"), std::string::npos);
  for (const char* of : {"basin, c - H_d(rest)", "run at 20 ms", "run, continuous, rise of H_d"})
    EXPECT_NE(remedy(of), "") << of;
  EXPECT_EQ(remedy("runner"), "") << "a control";
  EXPECT_NE(c.html().find("<p>Hessian of V_d &gt; 0: raise the stiffness"), std::string::npos);
  const auto items = nlohmann::json::parse(c.json())["items"];
  EXPECT_EQ(items[0]["remedy"], remedy("Hessian of V_d > 0"));
  EXPECT_FALSE(items[1].contains("remedy") || items[2].contains("remedy"));
  EXPECT_EQ(refusal([&] { refuse_failure(c); }),
            "a law: Hessian of V_d > 0 fails: -1, expected at least 1e-12 (the softest is 'swing' "
            "at slide 0.5, swing -1); raise the stiffness of the coordinate named; of a matched "
            "design try another ratio, of the other sign too");
}

}  // namespace
}  // namespace porthos::energy_shaping::certificate_text_test
