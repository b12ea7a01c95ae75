#pragma once
#include <array>
#include <string>

/// Code shared by the pictures of the results. Pixels, y downwards.
namespace porthos::scene {

namespace colour {
inline constexpr const char* ink = "#1f2933";
inline constexpr const char* soft = "#66717f";
inline constexpr const char* grid = "#e4e8ed";
inline constexpr const char* guide = "#8a94a0";
inline constexpr const char* alarm = "#c8472f";
/// Of the lines of every picture, here, in the report (--c0 ... --c7 of web/src/style.css) and in
/// Python (porthos.plotting.LINES).
inline constexpr std::array lines{"#1d5c96", "#c8472f", "#2f8f5b", "#b8741a",
                                  "#8a5fb0", "#2a8c99", "#7a5a48", "#6fa8dc"};
}  // namespace colour

/// "10⁻¹²"
std::string power_of_ten(int exponent);
/// "3·10⁻¹²", "10⁻¹²". x > 0.
std::string scientific(double x);
/// "−0.5", "1500", "2.5·10⁷": no E. powers: as a power of ten whatever the size.
std::string number_text(double x, bool powers = false, int digits = 9);
/// Whether the numbers of an axis that reaches `largest` are powers of ten.
inline bool in_powers(double largest) { return largest < 1e-3 || largest >= 1e6; }
/// The step 1, 2 or 5 times a power of ten that divides a span into about `parts` parts.
double round_step(double span, int parts);
/// Rough width of a text in px, hardly less than in DejaVu Sans, the widest of the fonts.
double text_width(const std::string& text, double size);
/// The attribute of a line with dashes and gaps in widths of the line; "": a full line.
std::string dashed(const std::string& pattern, double width);
/// The part of a text that fits, with an ellipsis. Cuts between characters, never inside one.
std::string fit_text(const std::string& text, double size, double room);

/// An SVG document under construction. `more`: further attributes, with a leading blank.
class Svg {
 public:
  /// unit: of a length, "pt"; none: pixels
  Svg(double width, double height, const char* unit = "");

  void raw(const std::string& element) { text_ += element + "\n"; }
  void text(double x, double y, const char* anchor, double size, const std::string& colour,
            const std::string& t, const char* more = "");
  /// A text turned by -90°, centred at (x, y).
  void text_upwards(double x, double y, double size, const std::string& colour,
                    const std::string& t);
  void rule(double x1, double y1, double x2, double y2, const std::string& colour, double width,
            const char* more = "");
  /// points: "x,y x,y …"
  void polyline(const std::string& points, const std::string& colour, double width,
                const char* more = "");
  /// shape: 0 disc, 1 square, 2 triangle, 3 diamond, then repeating; all of about the same area.
  void marker(size_t shape, double x, double y, double r, const std::string& fill,
              const std::string& stroke);

  /// The document; nothing can be added after it.
  std::string finish() { return std::move(text_ += "</svg>\n"); }

 private:
  std::string text_;
};

}  // namespace porthos::scene
