#include "energy_shaping/certificate.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "phs/error.h"

namespace porthos::energy_shaping {
namespace {

const char* word(Finding f) {
  return f == Finding::holds ? "holds" : f == Finding::fails ? "FAILS" : "";
}

std::string list(const std::vector<double>& numbers) {
  std::string s;
  for (const double x : numbers) s += fmt::format("{}{:.5g}", s.empty() ? "" : ", ", x);
  return fmt::format("({})", s);
}

std::string escaped(const std::string& text) {
  std::string s;
  for (const char c : text)
    s += c == '&'   ? "&amp;"
         : c == '<' ? "&lt;"
         : c == '>' ? "&gt;"
         : c == '"' ? "&quot;"
                    : std::string(1, c);
  return s;
}

nlohmann::json number(double x) {  // JSON has no inf and no NaN
  if (std::isfinite(x)) return x;
  return std::isnan(x) ? "nan" : x > 0 ? "inf" : "-inf";
}

}  // namespace

bool Certificate::has(const std::string& name) const {
  for (const auto& i : items_)
    if (i.name == name) return true;
  return false;
}

const CertificateItem& Certificate::item(const std::string& name) const {
  return find_named(items_, name, "certificate '" + title_ + "' has no item");
}

void Certificate::at_most(const std::string& name, double value, double bound,
                          const std::string& text, std::vector<double> at) {
  add({name,
       value <= bound ? Finding::holds : Finding::fails,
       value,
       bound,
       text,
       {},
       std::move(at)});
}

void Certificate::at_least(const std::string& name, double value, double bound,
                           const std::string& text, std::vector<double> at) {
  add({name,
       value >= bound ? Finding::holds : Finding::fails,
       value,
       bound,
       text,
       {},
       std::move(at)});
}

void Certificate::report(const std::string& name, double value, const std::string& text,
                         std::vector<double> numbers, std::vector<double> at) {
  add({name, Finding::reported, value, std::numeric_limits<double>::quiet_NaN(), text,
       std::move(numbers), std::move(at)});
}

const CertificateItem* Certificate::failure() const {
  for (const auto& i : items_)
    if (i.finding == Finding::fails) return &i;
  return nullptr;
}

bool Certificate::holds() const { return failure() == nullptr; }

std::string Certificate::text() const {
  std::string s = fmt::format("certificate: {}\n", title_);
  for (const auto& i : items_) {
    s += fmt::format("  {:<34} {:>13.6g} {:>12}  {:<6} {}", i.name, i.value,
                     std::isnan(i.bound) ? "" : fmt::format("({:.3g})", i.bound), word(i.finding),
                     i.text);
    if (!i.numbers.empty()) s += " " + list(i.numbers);
    if (!i.at.empty()) s += " at " + list(i.at);
    s += '\n';
  }
  return s + (holds() ? "  all conditions hold\n"
                      : fmt::format("  NOT certified: {}\n", failure()->name));
}

std::string Certificate::html() const {
  std::string s = fmt::format(
      "<p><b>{}</b>: {}</p>\n<table>\n<tr><th>condition</th><th>value</th>"
      "<th>bound</th><th></th><th></th></tr>\n",
      escaped(title_),
      holds() ? std::string("all conditions hold") : "not certified: " + escaped(failure()->name));
  for (const auto& i : items_) {
    std::string about = i.text;
    if (!i.numbers.empty()) about += " " + list(i.numbers);
    if (!i.at.empty()) about += " at " + list(i.at);
    s += fmt::format("<tr><td>{}</td><td>{:.6g}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                     escaped(i.name), i.value,
                     std::isnan(i.bound) ? "" : fmt::format("{:.3g}", i.bound), word(i.finding),
                     escaped(about));
  }
  return s + "</table>\n";
}

std::string Certificate::json() const {
  nlohmann::json j{{"title", title_}, {"holds", holds()}, {"items", nlohmann::json::array()}};
  for (const auto& i : items_) {
    nlohmann::json e{{"name", i.name}, {"value", number(i.value)}, {"text", i.text}};
    e["finding"] = i.finding == Finding::holds   ? "holds"
                   : i.finding == Finding::fails ? "fails"
                                                 : "reported";
    if (!std::isnan(i.bound)) e["bound"] = number(i.bound);
    for (const double x : i.numbers) e["numbers"].push_back(number(x));
    for (const double x : i.at) e["at"].push_back(number(x));
    j["items"].push_back(std::move(e));
  }
  return j.dump(2) + "\n";
}

}  // namespace porthos::energy_shaping
