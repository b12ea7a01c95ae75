#include "scene/read/formula.h"

#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>

#include "phs/error.h"

namespace porthos::scene {

struct Formula::Parser {
  std::vector<double> values;
  mu::Parser of;
};

Formula::Formula(const std::string& text, const std::vector<std::string>& names)
    : parser_(std::make_unique<Parser>()) {
  auto& p = *parser_;
  p.values.resize(names.size());
  try {
    p.of.DefineNameChars("0123456789_.abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ");
    for (size_t i = 0; i < names.size(); ++i) p.of.DefineVar(names[i], &p.values[i]);
    p.of.SetExpr(text);
    p.of.Eval();  // finds what is wrong now
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
