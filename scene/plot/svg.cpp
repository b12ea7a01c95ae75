#include "scene/plot/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string_view>

#include "scene/files/text_table.h"

namespace porthos::scene {
namespace {

std::string escape(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '&')
      out += "&amp;";
    else if (static_cast<unsigned char>(c) >= 0x20)
      out += c;
  }
  return out;
}

}  // namespace

std::string power_of_ten(int exponent) {
  static const char* digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = exponent < 0 ? "10⁻" : "10";
  for (const char c : std::to_string(std::abs(exponent))) text += digits[c - '0'];
  return text;
}

std::string scientific(double x) {
  int e = static_cast<int>(std::floor(std::log10(x)));
  double m = std::round(x / std::pow(10.0, e) * 100) / 100;
  if (m >= 10) {
    m /= 10;
    ++e;
  }
  return m == 1 ? power_of_ten(e) : fmt::format("{:g}·{}", m, power_of_ten(e));
}

std::string number_text(double x, bool powers, int digits) {
  if (x == 0 || !std::isfinite(x)) return x == 0 ? "0" : fmt::format("{}", x);
  const std::string rounded = fmt::format("{:.{}e}", std::fabs(x), digits - 1);  // 1.500e+03
  const auto e = rounded.find('e');
  const int exponent = std::stoi(rounded.substr(e + 1));
  std::string text = fmt::format("{:.9g}", std::stod(rounded));
  if (powers || text.find('e') != std::string::npos) {
    text = fmt::format("{:.9g}", std::stod(rounded.substr(0, e)));
    text = text == "1" ? power_of_ten(exponent) : text + "·" + power_of_ten(exponent);
  }
  return (x < 0 ? "−" : "") + text;
}

double round_step(double span, int parts) {
  const double rough = span / parts, ten = std::pow(10.0, std::floor(std::log10(rough)));
  return ten * (rough / ten < 1.5 ? 1 : rough / ten < 3.5 ? 2 : rough / ten < 7.5 ? 5 : 10);
}

double text_width(const std::string& text, double size) {
  const auto some = [&](std::string_view of) {
    return double(std::ranges::count_if(text, [&](char c) { return of.find(c) != of.npos; }));
  };
  return size * (0.6 * double(letters(text)) + 0.3 * some("mwMW") - 0.2 * some("fijlt.,:;|'()[] ") +
                 0.1 * some("ABCDEFGHIJKLMNOPQRSTUVWXYZ"));
}

std::string dashed(const std::string& pattern, double width) {
  std::istringstream in(pattern);
  std::string text;
  for (double x = 0; in >> x;) text += fmt::format("{:.3g} ", width * x);
  return text.empty() ? "" : fmt::format(R"( stroke-dasharray="{}")", text);
}

std::string fit_text(const std::string& text, double size, double room) {
  if (text_width(text, size) <= room) return text;
  std::string cut = text;
  while (!cut.empty() && text_width(cut, size) > room - size) {
    while (!cut.empty() && (cut.back() & 0xC0) == 0x80) cut.pop_back();
    if (!cut.empty()) cut.pop_back();
  }
  return cut + "…";
}

Svg::Svg(double width, double height, const char* unit) {
  raw(R"(<?xml version="1.0" encoding="UTF-8"?>)");
  raw(fmt::format(
      R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0} {1}" width="{0}{2}" height="{1}{2}" )"
      R"(font-family="Inter, 'Helvetica Neue', Helvetica, Arial, 'DejaVu Sans', sans-serif">)",
      width, height, unit));
  raw(fmt::format(R"(<rect width="{}" height="{}" fill="#ffffff"/>)", width, height));
}

void Svg::text(double x, double y, const char* anchor, double size, const std::string& colour,
               const std::string& t, const char* more) {
  raw(fmt::format(
      R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}" font-size="{}" fill="{}"{}>{}</text>)", x, y,
      anchor, size, colour, more, escape(t)));
}

void Svg::text_upwards(double x, double y, double size, const std::string& colour,
                       const std::string& t) {
  raw(fmt::format(
      R"svg(<text transform="translate({} {:.1f}) rotate(-90)" text-anchor="middle" font-size="{}" )svg"
      R"(fill="{}">{}</text>)",
      x, y, size, colour, escape(t)));
}

void Svg::rule(double x1, double y1, double x2, double y2, const std::string& colour, double width,
               const char* more) {
  raw(fmt::format(
      R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="{}" stroke-width="{}"{}/>)",
      x1, y1, x2, y2, colour, width, more));
}

void Svg::polyline(const std::string& points, const std::string& colour, double width,
                   const char* more) {
  raw(fmt::format(
      R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="{}" stroke-linejoin="round"{}/>)",
      points, colour, width, more));
}

void Svg::marker(size_t shape, double x, double y, double r, const std::string& fill,
                 const std::string& stroke) {
  const double a = 0.88 * r, b = 1.25 * r;
  std::string points;
  switch (shape % 4) {
    case 1:
      points =
          fmt::format("M{:.1f},{:.1f}h{:.1f}v{:.1f}h{:.1f}z", x - a, y - a, 2 * a, 2 * a, -2 * a);
      break;
    case 2:
      points = fmt::format("M{:.1f},{:.1f}l{:.1f},{:.1f}h{:.1f}z", x, y - b, b, 1.75 * b, -2 * b);
      break;
    case 3:
      points = fmt::format("M{:.1f},{:.1f}l{:.1f},{:.1f}l{:.1f},{:.1f}l{:.1f},{:.1f}z", x, y - b, b,
                           b, -b, b, -b, -b);
      break;
    default:
      raw(fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" fill="{}" stroke="{}"/>)", x, y,
                      r, fill, stroke));
      return;
  }
  raw(fmt::format(R"(<path d="{}" fill="{}" stroke="{}"/>)", points, fill, stroke));
}

}  // namespace porthos::scene
