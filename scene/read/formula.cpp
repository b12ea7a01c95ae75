#include "scene/read/formula.h"

#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>
#include <numbers>
#include <string_view>

#include "phs/error.h"

namespace porthos::scene {
namespace {

constexpr size_t longest = 1000;  // characters

/// Refuses what muParser takes and a formula cannot mean: an assignment to a name.
void refuse_assignment(const std::string& text) {
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '=') continue;
    const bool after =
        i > 0 && std::string_view("=!<>").find(text[i - 1]) != std::string_view::npos;
    const bool before = i + 1 < text.size() && text[i + 1] == '=';
    if (!after && !before)
      throw InvalidArgument(fmt::format("\"{}\" assigns by '=', expected a comparison '=='", text));
  }
}

}  // namespace

struct Formula::Parser {
  std::vector<double> values;
  mu::Parser of;
};

Formula::Formula(const std::string& text, const std::vector<std::string>& names)
    : parser_(std::make_unique<Parser>()) {
  if (text.size() > longest)
    throw InvalidArgument(
        fmt::format("has {} characters, expected at most {}", text.size(), longest));
  refuse_assignment(text);
  auto& p = *parser_;
  p.values.resize(names.size());
  try {
    p.of.DefineNameChars("0123456789_.abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ");
    for (size_t i = 0; i < names.size(); ++i) p.of.DefineVar(names[i], &p.values[i]);
    if (std::find(names.begin(), names.end(), "pi") == names.end())
      p.of.DefineConst("pi", std::numbers::pi);
    p.of.SetExpr(text);
    p.of.Eval();  // finds what is wrong now
    if (p.of.GetNumResults() != 1)
      throw InvalidArgument(
          fmt::format("\"{}\" states {} numbers, expected one", text, p.of.GetNumResults()));
  } catch (const mu::Parser::exception_type& e) {
    std::string known;
    for (const auto& name : names) known += (known.empty() ? "" : ", ") + name;
    throw InvalidArgument(fmt::format("\"{}\" is no formula: {} (known: {})", text, e.GetMsg(),
                                      known.empty() ? "no outputs before it" : known));
  }
}
Formula::Formula(Formula&&) noexcept = default;
Formula::~Formula() = default;

bool Formula::uses(const std::string& name) const {
  return parser_->of.GetUsedVar().count(name) > 0;
}

double Formula::operator()(std::span<const double> values) {
  std::copy_n(values.begin(), parser_->values.size(), parser_->values.begin());
  return parser_->of.Eval();
}

}  // namespace porthos::scene
